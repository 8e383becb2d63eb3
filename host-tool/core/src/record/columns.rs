//! The columns of a record's tables, declared once for their headers, for the dictionary beside
//! them and for docs/reference/record.md.

use super::ChannelInfo;
use crate::session::joint_name;
use std::collections::BTreeSet;
use std::io;

/// Description of a column of a table, or of a group of columns with one column for each channel of
/// some kind.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Column {
    /// Name in the header line; for a group, the part before the channel number.
    pub name: &'static str,
    /// Unit of the values. Empty if there is none, or if each channel has its own unit (V or mA).
    pub unit: &'static str,
    /// Meaning of a value, and when a field is empty.
    pub meaning: &'static str,
    /// Where the value comes from, for instance the device's clock or a sensor.
    pub source: &'static str,
    /// Whether the table has one such column, or one for each channel or joint of some kind.
    pub each: ColumnScope,
}

/// For what a table has a column of this description: once in all, or for each channel or joint of
/// some kind.
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
    /// Once if the session drives the muscles of an arm.
    Arm,
    /// Once if joint angles modulate the stimulation.
    Lift,
    /// Once for each joint whose angle modulates the stimulation.
    Joint,
}

const fn column(
    scope: ColumnScope,
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
        each: scope,
    }
}

/// Columns of `samples.csv`, from left to right.
#[rustfmt::skip]
pub const SAMPLES: [Column; 24] = [
    column(ColumnScope::Table, "t_s", "s", "time since the start of the pulse trains, in increasing order, with six decimals", "device clock, 1 µs"),
    column(ColumnScope::Table, "target_deg", "°", "reference of the joint angle, or position of the wall; empty before the first setpoint and without joint or wall", "device: its present setpoint, held or extrapolated"),
    column(ColumnScope::Table, "measured_deg", "°", "measured joint angle; empty before the first measurement and without joint or wall", "the session's sensor, as the device received it"),
    column(ColumnScope::Table, "true_deg", "°", "true joint angle of the simulated limb; 0 without a limb, empty unless this program simulates the wearer", "simulated limb"),
    column(ColumnScope::Table, "effort", "", "output of the control law, of which at most 1 is played; at a wall the penetration in °; empty while neither is active", "device: control law"),
    column(ColumnScope::Table, "limiting", "0, 1", "1 while at least one channel cannot reach its reference: an amplitude still rises as fast as the wearer's limits allow, a computed amplitude is held at the wearer's limit, or the reference force is below the force at threshold or above the force that the muscle, possibly fatigued, can produce", "device: guard, force control"),
    column(ColumnScope::Table, "state", "", "state of the device: boot, idle, armed, stimulating, stopping or fault", "device"),
    column(ColumnScope::Channel, "amplitude", "", "present amplitude, in whole steps of 0.001; empty while the channel outputs no pulses", "device: as sent to the DAC; not measured"),
    column(ColumnScope::Width, "width", "µs", "present pulse width; empty while the channel outputs no pulses", "device: as output; not measured"),
    column(ColumnScope::Muscle, "force", "N", "force that the muscle model predicts from the pulses; empty while no model runs", "device: muscle model; not measured"),
    column(ColumnScope::Force, "wanted", "N", "reference force; empty before its first setpoint", "device: its present setpoint"),
    column(ColumnScope::Force, "rate", "Hz", "present pulse rate; empty while the channel outputs no pulses", "device: force control"),
    column(ColumnScope::Force, "below", "N", "nearest force below the reference that the limits allow; empty if they allow the reference itself", "device: force control"),
    column(ColumnScope::Force, "above", "N", "nearest force above the reference that the limits allow; empty if they allow the reference itself", "device: force control"),
    column(ColumnScope::Arm, "hand_x_n", "N", "reference force at the hand, backward component; empty before the first setpoint", "device: its present setpoint"),
    column(ColumnScope::Arm, "hand_y_n", "N", "the same, component to the right", "device: its present setpoint"),
    column(ColumnScope::Arm, "hand_z_n", "N", "the same, upward component", "device: its present setpoint"),
    column(ColumnScope::Arm, "hand_made", "", "share of that force that the muscles can produce in this posture of the arm, minimum since the previous row; at 1 the force is produced, below 1 no force is produced", "device: recruitment"),
    column(ColumnScope::Arm, "hand_fx_n", "N", "true force at the hand, backward component: the force of the arm on the cuff near its wrist, without its weight; empty unless this program simulates an arm in a cuff", "simulated arm: true value, without the noise of a force sensor; not measured"),
    column(ColumnScope::Arm, "hand_fy_n", "N", "the same, component to the right", "simulated arm, likewise"),
    column(ColumnScope::Arm, "hand_fz_n", "N", "the same, upward component", "simulated arm, likewise"),
    column(ColumnScope::Lift, "held", "0, 1, 2", "1 while an object is held, 0 while none is held, 2 if it was held too long and must be released; empty before the start", "device: its present setpoint"),
    column(ColumnScope::Joint, "angle", "°", "angle of the joint; empty without a recent and plausible measurement", "the host, as the device received it"),
    column(ColumnScope::Joint, "phase", "1, -1", "direction of the elbow's latest movement: 1 flexion, -1 extension; empty before it moves", "device: sign of the elbow's velocity"),
];

/// Columns of `edges.csv`, from left to right.
#[rustfmt::skip]
pub const EDGES: [Column; 4] = [
    column(ColumnScope::Table, "t_us", "µs", "time since the start of the recorded period", "simulated pins"),
    column(ColumnScope::Table, "channel", "", "channel number, from 1", "simulated pins"),
    column(ColumnScope::Table, "state", "", "new state: isolated (disconnected), cathodic, anodic or grounded; isolated before the first row", "simulated pins"),
    column(ColumnScope::Table, "dac_code", "0–65535", "amplitude code of the channel's DAC", "simulated pins"),
];

/// Columns of `markers.csv`, from left to right.
#[rustfmt::skip]
pub const MARKERS: [Column; 7] = [
    column(ColumnScope::Table, "t_s", "s", "device time since the start of the pulse trains, with six decimals", "device clock, 1 µs"),
    column(ColumnScope::Table, "device_us", "µs", "device time since its boot, which does not wrap", "device clock; for a key it is estimated from the latest answers, unless this program simulates the device"),
    column(ColumnScope::Table, "host_us", "µs", "host time since the start of the pulse trains at which a key took effect, or at which the host received the edge", "host clock; simulated time if this program simulates the device"),
    column(ColumnScope::Table, "kind", "", "`pause`, `resume`, `raise`, `lower`, `mark` or `stop` for a key; `trigger` or `sync` for an edge of that line", "keyboard; device"),
    column(ColumnScope::Table, "channel", "", "channel of `raise` and `lower`, from 1", "keyboard"),
    column(ColumnScope::Table, "intensity_percent", "%", "intensity of the channel from then on, relative to the session's amplitudes", "host"),
    column(ColumnScope::Table, "text", "", "text typed with `mark`, or the reason why a key had no effect", "keyboard; host"),
];

impl Column {
    /// Returns the name and the unit of each column that this description has in a trial with these
    /// channels.
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

/// Returns the numbers of the joints whose angles modulate these channels, in ascending order, each
/// once.
pub(super) fn joints(channels: &[ChannelInfo]) -> impl Iterator<Item = u8> {
    let numbers: BTreeSet<u8> = channels
        .iter()
        .filter_map(|channel_info| channel_info.joint)
        .collect();
    numbers.into_iter()
}

/// Returns a unit as it appears in a column name: in lower case, with "u" for "µ".
fn unit_in_name(unit: &str) -> String {
    unit.to_lowercase().replace('µ', "u")
}

/// Returns the header line of a table with these columns, in the order of the fields in a row.
pub(super) fn header(columns: &[Column], channels: &[ChannelInfo]) -> String {
    let names = columns
        .iter()
        .flat_map(|column| column.names_and_units(channels));
    let names: Vec<String> = names.map(|(name, _)| name).collect();
    names.join(",")
}

/// Returns `columns.csv` of a trial: the unit, meaning and source of every column of its tables.
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

/// Returns the columns as a Markdown table for docs/reference/record.md.
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
