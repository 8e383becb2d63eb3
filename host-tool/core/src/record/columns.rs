//! The columns of a record's tables, declared once for their headers, for the dictionary beside
//! them and for docs/record.md.

use super::ChannelInfo;
use crate::session::joint_name;
use std::collections::BTreeSet;
use std::io;

/// A column of a table, or a group of columns with one for each channel of some kind.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Column {
    /// Name in the header; for a column of each channel, the part before the channel number.
    pub name: &'static str,
    /// Unit; empty if there is none, and if it is the channel's own (V or mA).
    pub unit: &'static str,
    /// Meaning of a value, and when the field is empty.
    pub meaning: &'static str,
    /// Source of the value.
    pub source: &'static str,
    /// Number of columns: one for the table, or one for each channel of some kind.
    pub each: ColumnScope,
}

/// Number of times that a column occurs in a table.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum ColumnScope {
    /// Once in every table.
    Table,
    /// Once for each channel in use.
    Channel,
    /// Once for each channel whose pulse width may change.
    Width,
    /// Once for each channel whose muscle's force is predicted.
    Muscle,
    /// Once for each channel under force control.
    Force,
    /// Once if the session drives an arm.
    Arm,
    /// Once if the session has modulated joints.
    Lift,
    /// Once for each modulated joint.
    Joint,
}

const fn column(
    each: ColumnScope,
    name: &'static str,
    unit: &'static str,
    meaning: &'static str,
    source: &'static str,
) -> Column {
    Column {
        name,
        unit,
        meaning,
        source,
        each,
    }
}

/// Columns of `samples.csv`, in order.
#[rustfmt::skip]
pub const SAMPLES: [Column; 24] = [
    column(ColumnScope::Table, "t_s", "s", "time since the start of the trains, rising, with six decimals", "device clock, 1 µs"),
    column(ColumnScope::Table, "target_deg", "°", "wanted joint angle, or where the wall stands; empty before the first setpoint and without joint or wall", "device: the setpoint it follows, held or extrapolated"),
    column(ColumnScope::Table, "measured_deg", "°", "joint angle; empty before the first measurement and without joint or wall", "the session's sensor, as the device took it"),
    column(ColumnScope::Table, "true_deg", "°", "joint angle of the simulated body; empty unless one runs in this program", "simulated body"),
    column(ColumnScope::Table, "effort", "", "what the control law asks for, 1 is all; at a wall the penetration in °; empty while neither runs", "device: control law"),
    column(ColumnScope::Table, "limiting", "0, 1", "1 while the device cannot give what is wanted, on any channel: a computed amplitude is held at the wearer's limit, or a force is wanted that is below that of threshold or beyond what the muscle, perhaps tired, gives", "device: guard, force control"),
    column(ColumnScope::Table, "state", "", "the device's state: boot, idle, armed, stimulating, stopping or fault", "device"),
    column(ColumnScope::Channel, "amplitude", "", "amplitude in force, in whole steps of 0.001; empty while the channel plays nothing", "device: as sent to the DAC; no measurement"),
    column(ColumnScope::Width, "width", "µs", "pulse width in force; empty while the channel plays nothing", "device: as played; no measurement"),
    column(ColumnScope::Muscle, "force", "N", "force that the muscle model predicts from the pulses played; empty where none runs", "device: muscle model; no measurement"),
    column(ColumnScope::Force, "wanted", "N", "wanted force; empty before its first setpoint", "device: the setpoint it follows"),
    column(ColumnScope::Force, "rate", "Hz", "pulse rate in force; empty while the channel plays nothing", "device: force control"),
    column(ColumnScope::Force, "below", "N", "force below the wanted one that the limits can give; empty unless they cannot give the wanted one", "device: force control"),
    column(ColumnScope::Force, "above", "N", "force above the wanted one that the limits can give; empty as before", "device: force control"),
    column(ColumnScope::Arm, "hand_x_n", "N", "wanted force at the hand, backward; empty before the first", "device: the setpoint it follows"),
    column(ColumnScope::Arm, "hand_y_n", "N", "the same, to the right", "device: the setpoint it follows"),
    column(ColumnScope::Arm, "hand_z_n", "N", "the same, upward", "device: the setpoint it follows"),
    column(ColumnScope::Arm, "hand_made", "", "part of that force that can be made as the arm is held, the least since the row before: 1 is all, and given; less is not given at all", "device: recruitment"),
    column(ColumnScope::Arm, "hand_fx_n", "N", "force at the hand, backward: what the arm pushes the cuff near its wrist with beside its weight; empty unless a simulated arm in a cuff runs in this program", "simulated body: its truth, without its force sensor's noise; no measurement"),
    column(ColumnScope::Arm, "hand_fy_n", "N", "the same, to the right", "simulated body, likewise"),
    column(ColumnScope::Arm, "hand_fz_n", "N", "the same, upward", "simulated body, likewise"),
    column(ColumnScope::Lift, "held", "0, 1, 2", "1 while an object is held, 0 while not, 2 if it was for too long and is to be released; empty before the start", "device: the setpoint it follows"),
    column(ColumnScope::Joint, "angle", "°", "angle of the joint; empty without a fresh one that can be believed", "the host, as the device took it"),
    column(ColumnScope::Joint, "phase", "1, -1", "1 since its elbow flexed last, -1 since it extended; empty before it moves", "device: sign of the elbow's velocity"),
];

/// Columns of `edges.csv`, in order.
#[rustfmt::skip]
pub const EDGES: [Column; 4] = [
    column(ColumnScope::Table, "t_us", "µs", "time since the start of the period drawn", "simulated pins"),
    column(ColumnScope::Table, "channel", "", "channel, from 1", "simulated pins"),
    column(ColumnScope::Table, "state", "", "from now on: isolated, cathodic, anodic or grounded; isolated before the first row", "simulated pins"),
    column(ColumnScope::Table, "dac_code", "0–65535", "amplitude code of the channel's DAC", "simulated pins"),
];

/// Columns of `markers.csv`, in order.
#[rustfmt::skip]
pub const MARKERS: [Column; 7] = [
    column(ColumnScope::Table, "t_s", "s", "device time since the start of the trains, with six decimals", "device clock, 1 µs"),
    column(ColumnScope::Table, "device_us", "µs", "device time since its boot, which does not wrap", "device clock; of a key estimated from its latest answers where the device is no part of this program"),
    column(ColumnScope::Table, "host_us", "µs", "host time since the start of the trains: of a key when it took effect, of an edge when the host heard of it", "host clock; of a simulated device its own"),
    column(ColumnScope::Table, "kind", "", "`pause`, `resume`, `raise`, `lower`, `mark` or `stop` by hand; `trigger` and `sync` for an edge of that line", "keyboard; device"),
    column(ColumnScope::Table, "channel", "", "channel of `raise` and `lower`, from 1", "keyboard"),
    column(ColumnScope::Table, "intensity_percent", "%", "the channel's intensity from then on, of the session's own amplitudes", "host"),
    column(ColumnScope::Table, "text", "", "what was typed with `mark`; why a key had no effect", "keyboard; host"),
];

impl Column {
    /// Returns the names and units of this column for these channels.
    fn names_and_units(&self, channels: &[ChannelInfo]) -> Vec<(String, String)> {
        if self.each == ColumnScope::Table {
            return vec![(self.name.to_owned(), self.unit.to_owned())];
        }
        if self.each == ColumnScope::Arm {
            let is_driven = channels.iter().any(|channel| channel.line);
            let name = (self.name.to_owned(), self.unit.to_owned());
            return is_driven.then_some(name).into_iter().collect();
        }
        if self.each == ColumnScope::Lift {
            let name = (self.name.to_owned(), self.unit.to_owned());
            return joints(channels).next().map(|_| name).into_iter().collect();
        }
        if self.each == ColumnScope::Joint {
            let named = joints(channels).map(|joint| {
                let joint = joint_name(joint).replace('-', "_");
                let unit = ["", "_deg"][usize::from(self.unit == "°")];
                (format!("{}_{joint}{unit}", self.name), self.unit.to_owned())
            });
            return named.collect();
        }
        let own = channels.iter().filter(|channel| match self.each {
            ColumnScope::Table
            | ColumnScope::Arm
            | ColumnScope::Lift
            | ColumnScope::Joint
            | ColumnScope::Channel => true,
            ColumnScope::Width => channel.live_width,
            ColumnScope::Muscle => channel.muscle,
            ColumnScope::Force => channel.force,
        });
        let named = own.map(|channel| {
            let is_own = self.each == ColumnScope::Channel;
            let unit = if is_own { &channel.unit } else { self.unit };
            let name = format!("{}_{}_{}", self.name, channel.number, unit_in_name(unit));
            (name, unit.to_owned())
        });
        named.collect()
    }
}

/// Returns the numbers of the joints that the channels follow, in rising order.
pub(super) fn joints(channels: &[ChannelInfo]) -> impl Iterator<Item = u8> {
    let numbers: BTreeSet<u8> = channels
        .iter()
        .filter_map(|channel_info| channel_info.joint)
        .collect();
    numbers.into_iter()
}

/// Returns a unit in the form that it has in a column name: in lower case, with "u" for "µ".
fn unit_in_name(unit: &str) -> String {
    unit.to_lowercase().replace('µ', "u")
}

/// Returns the header line for these columns and channels, in the order of the fields in a row.
pub(super) fn header(columns: &[Column], channels: &[ChannelInfo]) -> String {
    let names = columns
        .iter()
        .flat_map(|column| column.names_and_units(channels));
    let names: Vec<String> = names.map(|(name, _)| name).collect();
    names.join(",")
}

/// Returns the dictionary of a trial as CSV: every column of its tables with unit, meaning and
/// source.
pub(super) fn dictionary(channels: &[ChannelInfo]) -> io::Result<Vec<u8>> {
    let mut out = csv::Writer::from_writer(Vec::new());
    out.write_record(["file", "name", "unit", "meaning", "source"])?;
    let tables = [
        ("samples.csv", SAMPLES.as_slice()),
        ("edges.csv", EDGES.as_slice()),
        ("markers.csv", MARKERS.as_slice()),
    ];
    for (file, columns) in tables {
        for column in columns {
            for (name, unit) in column.names_and_units(channels) {
                let row = [file, &name, &unit, column.meaning, column.source];
                out.write_record(row)?;
            }
        }
    }
    out.into_inner()
        .map_err(|why| io::Error::other(why.to_string()))
}

/// Returns the columns as a Markdown table for docs/record.md.
pub(super) fn to_markdown(columns: &[Column]) -> String {
    let mut text = "| column | unit | meaning | source |\n|---|---|---|---|\n".to_owned();
    for column in columns {
        let (name, unit) = match column.each {
            ColumnScope::Table | ColumnScope::Arm | ColumnScope::Lift => {
                (column.name.to_owned(), column.unit)
            }
            ColumnScope::Joint if column.unit == "°" => {
                (format!("{}_J_deg", column.name), column.unit)
            }
            ColumnScope::Joint => (format!("{}_J", column.name), column.unit),
            ColumnScope::Channel => (format!("{}_N_ma, …_v", column.name), "the channel's"),
            ColumnScope::Width | ColumnScope::Muscle | ColumnScope::Force => (
                format!("{}_N_{}", column.name, unit_in_name(column.unit)),
                column.unit,
            ),
        };
        let whose = match column.each {
            ColumnScope::Table => "",
            ColumnScope::Channel => "; for each channel N",
            ColumnScope::Width => "; for each channel N with a `max_width_us`",
            ColumnScope::Muscle => "; for each channel N with a muscle",
            ColumnScope::Force => "; for each channel N under force control",
            ColumnScope::Arm => "; with an arm",
            ColumnScope::Lift => "; with modulated joints",
            ColumnScope::Joint => "; for each modulated joint J",
        };
        let (meaning, source) = (column.meaning, column.source);
        text += &format!("| `{name}` | {unit} | {meaning}{whose} | {source} |\n");
    }
    text
}
