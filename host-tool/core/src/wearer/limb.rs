//! `[limb]`: the right arm of a wearer, with its bones and the lines along which its muscles pull.

use firmware::limb::{AXES, JOINTS, JointName, LimbError, LimbSpec, LineSpec, VIAS, ViaSpec};
use firmware::pulse::CHANNELS;
use firmware::units::Amplitude;

use super::Electrode;
use crate::fields::error::Problem;
use crate::fields::field::Need::Required;
use crate::fields::field::{Kind, Number, Section, channel_number, field, list, number_in, one_of};
use crate::fields::table::Table;

/// A right arm: its bones, the ranges of its joints, and the lines along which its muscles pull.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Limb {
    /// Vectors along the bones, µm: from the thorax's origin to the first joint, from joint to
    /// joint, and to the hand, as [`LimbSpec::offsets_um`].
    pub offsets_um: [[i32; 3]; JOINTS + 1],
    /// Lowest and highest angle of each of the nine axes, in 0.001°, as [`LimbSpec::ranges_mdeg`].
    pub ranges_mdeg: [(i32, i32); AXES],
    /// Line of action of each muscle, sorted by channel.
    pub lines: Vec<Line>,
}

/// Line of action: the path along which the muscle under an electrode pulls, with the muscle's
/// strength.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Line {
    /// Channel of the electrode, 1–10.
    pub channel: u8,
    /// Joint for which the device considers this muscle when it recruits muscles for a force. The
    /// line must cross this joint.
    pub joint: JointName,
    /// Points of the path from the muscle's origin to its insertion, two to six. Each is fixed to a
    /// segment of the arm.
    pub vias: Vec<ViaSpec>,
    /// Force of the muscle per amplitude above its motor threshold, mN per mA or V.
    pub gain_mn_per_unit: u32,
}

impl Line {
    /// Returns the line as the device receives it. The muscle's force begins at the amplitude
    /// `threshold` and is largest at `limit`.
    #[must_use]
    pub fn spec(&self, threshold: Amplitude, limit: Amplitude) -> LineSpec {
        LineSpec {
            channel: self.channel.saturating_sub(1), // 1–10
            joint: self.joint,
            vias: self.vias.iter().take(VIAS).copied().collect(),
            gain_mn_per_ma: self.gain_mn_per_unit,
            threshold,
            limit,
        }
    }
}

/// Names of the fields that hold the vectors of [`Limb::offsets_um`], in the same order.
pub(super) const WAYS: [&str; JOINTS + 1] = ["to_sc_mm", "to_gh_mm", "to_el_mm", "to_hand_mm"];
/// Names of the fields that hold the ranges of [`Limb::ranges_mdeg`], in the same order.
pub(super) const RANGES: [&str; AXES] = [
    "sc_protraction_deg",
    "sc_elevation_deg",
    "sc_roll_deg",
    "gh_flexion_deg",
    "gh_abduction_deg",
    "gh_rotation_deg",
    "el_flexion_deg",
    "el_bend_deg",
    "el_pronation_deg",
];
/// Joints of the arm, and their names in wearer files.
pub(super) const JOINT_WORDS: [(&str, JointName); JOINTS] = [
    ("sternoclavicular", JointName::Sternoclavicular),
    ("glenohumeral", JointName::Glenohumeral),
    ("elbow", JointName::Elbow),
];
/// Segments of the arm from the thorax to the forearm: names in wearer files, and numbers in the
/// protocol.
pub(super) const SEGMENTS: [(&str, u8); JOINTS + 1] = [
    ("thorax", 0),
    ("girdle", 1),
    ("upper-arm", 2),
    ("forearm", 3),
];
/// Description of a field that holds three numbers, for error messages.
const TRIPLE: &str = "a list of three numbers";
/// Description of a field that holds two numbers, for error messages.
const PAIR: &str = "a list of two numbers";

/// Returns the fields of `[limb]`.
#[rustfmt::skip]
pub(super) fn fields() -> Section {
    let place = |range| Kind::Wholes(Number::from_range("mm", 3, range), TRIPLE);
    let turns = |range| Kind::Wholes(Number::from_range("°", 3, range), PAIR);
    let points = vec![
        field("segment", one_of(&SEGMENTS), Required, "segment to which the point is fixed"),
        field("at_mm", place(LineSpec::AT_UM), Required, "position from the segment's origin: backward, to the right, upward"),
    ];
    let lines = vec![
        field("channel", channel_number(), Required, "an electrode of the file; its force begins at `motor_threshold` and is largest at `maximum` or `limit`"),
        field("joint", one_of(&JOINT_WORDS), Required, "joint for which the recruitment considers this muscle; the line must cross it"),
        field("points", list(points, 2, Some(VIAS), "points"), Required, "`{ segment, at_mm }`: points from origin to insertion, with segments in order from the thorax on"),
        field("gain_n_per_unit", number_in("N per unit", 3, LineSpec::GAIN_MN_PER_MA), Required, "force per amplitude above the motor threshold"),
    ];
    let ways = ["from the origin of the thorax to the sternoclavicular joint", "from there to the glenohumeral joint", "from there to the elbow", "from there to the hand"];
    let axes = ["protraction", "elevation", "roll", "flexion", "abduction", "internal rotation", "flexion", "sideways bend", "pronation"];
    let ways = WAYS.into_iter().zip(ways);
    let mut section: Section = ways.map(|(name, meaning)| field(name, place(LimbSpec::OFFSET_UM), Required, meaning)).collect();
    section.extend(RANGES.into_iter().zip(axes).enumerate().map(|(axis, (name, meaning))| {
        let range = [LimbSpec::RANGE_MDEG, LimbSpec::MIDDLE_MDEG][usize::from(axis % 3 == 1)];
        field(name, turns(range), Required, meaning)
    }));
    section.push(field("line", list(lines, 1, Some(CHANNELS), "lines"), Required, "line of action, one for each muscle"));
    section
}

/// Reads `[limb]`, and reports everything in it that the device would refuse. `are_whole` is
/// whether all electrodes of the file could be read; only then is a line without an electrode an
/// error.
pub(super) fn read(t: &Table<'_>, electrodes: &[Electrode], are_whole: bool) -> Option<Limb> {
    let ways = WAYS.map(|name| read_triple(t, name));
    let ranges = RANGES.map(|name| read_pair(t, name));
    let items = t.tables("line");
    let lines: Vec<Option<Line>> = items.iter().map(read_line).collect();
    let mut offsets_um = [[0, 0, -100_000]; JOINTS + 1];
    for (to, from) in offsets_um.iter_mut().zip(ways) {
        *to = from.unwrap_or(*to);
    }
    let mut ranges_mdeg = [(0, 0); AXES];
    for (to, from) in ranges_mdeg.iter_mut().zip(ranges) {
        *to = from.unwrap_or(*to);
    }
    LimbSpec::report_bone_mistakes(&offsets_um, &ranges_mdeg, &mut |mistake| match mistake {
        LimbError::Way { way, .. } if ways[usize::from(way)].is_some() => {
            let allowed = "a bone of at least 10 mm, with each number within ±1000".into();
            t.report_out_of_range(WAYS[usize::from(way)], allowed);
        }
        LimbError::Axis { axis, .. } if ranges[usize::from(axis)].is_some() => {
            let most = [180, 80][usize::from(axis % 3 == 1)];
            let allowed = format!("the lowest and the highest angle, within ±{most}");
            t.report_out_of_range(RANGES[usize::from(axis)], allowed);
        }
        _ => {}
    });
    let mut known: Vec<Line> = Vec::new();
    for (item, line) in items.iter().zip(lines) {
        let Some(line) = line else { continue };
        let channel = line.channel;
        if known.iter().any(|line| line.channel == channel) {
            item.report("channel", Problem::ChannelTwice { channel });
        }
        let is_there = electrodes
            .iter()
            .any(|electrode| electrode.channel == channel);
        if !is_there && are_whole {
            item.report("channel", Problem::NoSuchChannel { channel });
        }
        let mut is_routed = true;
        // The values of the electrode are checked with the electrode.
        line.spec(Amplitude::ZERO, Amplitude::new(1))
            .report_mistakes(&mut |range| is_routed &= range.field != LineSpec::SEGMENT.field);
        if !is_routed {
            let allowed = "from a segment before its `joint` to one after it, in order".into();
            item.report_out_of_range("points", allowed);
        }
        known.push(line);
    }
    known.sort_by_key(|line| line.channel);
    Some(Limb {
        offsets_um,
        ranges_mdeg,
        lines: known,
    })
}

fn read_line(t: &Table<'_>) -> Option<Line> {
    let via = |item: &Table<'_>| {
        Some(ViaSpec {
            segment: item.choice("segment", &SEGMENTS)?,
            at_um: read_triple(item, "at_mm")?,
        })
    };
    let vias: Option<Vec<ViaSpec>> = t.tables("points").iter().map(via).collect();
    if !t.is_valid() {
        return None;
    }
    Some(Line {
        channel: t.integer("channel"),
        joint: t.choice("joint", &JOINT_WORDS)?,
        vias: vias?,
        gain_mn_per_unit: t.integer("gain_n_per_unit"),
    })
}

/// Returns the three numbers in the field `name`, in the device's steps (µm or mN). Reports a list
/// of another length.
pub(crate) fn read_triple(t: &Table<'_>, name: &str) -> Option<[i32; 3]> {
    let values = wholes(t, name);
    let found = <[i32; 3]>::try_from(values).ok();
    if found.is_none() && t.has(name) && has_no_reported_error(t, name) {
        t.report_out_of_range(name, "three numbers: backward, to the right, upward".into());
    }
    found
}

fn read_pair(t: &Table<'_>, name: &str) -> Option<(i32, i32)> {
    let values = wholes(t, name);
    let found = <[i32; 2]>::try_from(values).ok();
    if found.is_none() && t.has(name) && has_no_reported_error(t, name) {
        t.report_out_of_range(name, "two numbers: lowest and highest".into());
    }
    found.map(|[low, high]| (low, high))
}

/// Returns whether the list `name` has no error yet that was reported: it has numbers, or it is
/// empty and the whole table is without error.
fn has_no_reported_error(t: &Table<'_>, name: &str) -> bool {
    !t.integers(name).is_empty() || t.is_valid()
}

fn wholes(t: &Table<'_>, name: &str) -> Vec<i32> {
    let values = t.integers(name).iter();
    values
        .map(|(value, _)| i32::try_from(*value).unwrap_or(i32::MAX)) // within its range
        .collect()
}
