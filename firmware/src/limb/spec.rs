//! Specification of a wearer's arm by the host, and its checks.

use super::refusal::LimbError;
use super::{AXES, JOINTS, LINES, VIAS};
use crate::range::{OutOfRange, Range};
use crate::units::Amplitude;
use heapless::Vec;
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

/// A joint of the arm.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize, Schema)]
pub enum JointName {
    /// Sternoclavicular joint: thorax to shoulder girdle.
    Sternoclavicular,
    /// Glenohumeral joint: shoulder girdle to upper arm.
    Glenohumeral,
    /// Elbow joint: upper arm to forearm.
    Elbow,
}

impl JointName {
    /// All joints along the chain, from the thorax.
    pub const ALL: [Self; JOINTS] = [Self::Sternoclavicular, Self::Glenohumeral, Self::Elbow];

    /// Returns the joint's position in the chain, 0…2. The segment above the joint has the same
    /// number.
    #[must_use]
    pub const fn index(self) -> u8 {
        match self {
            Self::Sternoclavicular => 0,
            Self::Glenohumeral => 1,
            Self::Elbow => 2,
        }
    }
}

/// A point on a line of action, fixed to a segment.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize, Schema)]
pub struct ViaSpec {
    /// Number of the segment: 0 thorax, 1 shoulder girdle, 2 upper arm, 3 forearm.
    pub segment: u8,
    /// Position from the segment's origin along its own axes (backward, right, up), µm; ±1 000 000.
    pub at_um: [i32; 3],
}

/// Lines of action of a wearer, at most [`LINES`].
pub type Lines = Vec<LineSpec, LINES>;

/// One muscle group under one electrode pair.
#[derive(Clone, PartialEq, Eq, Debug, Serialize, Deserialize, Schema)]
pub struct LineSpec {
    /// Channel number, 0…9; each at most once.
    pub channel: u8,
    /// Joint at which the nearest-neighbour recruitment considers the line; the line must cross
    /// this joint. Other joints that it crosses also receive its torque.
    pub joint: JointName,
    /// Points from origin to insertion, 2…6, with segments in ascending order; the first segment
    /// must be above the joint and the last below it.
    pub vias: Vec<ViaSpec, VIAS>,
    /// Force g per current above the threshold, mN/mA (mN/V on a voltage stage); 1…100 000 000.
    pub gain_mn_per_ma: u32,
    /// Amplitude −q at which force begins, µA (mV); at most 199 999.
    pub threshold: Amplitude,
    /// Largest amplitude to which this wearer agreed; above the threshold, at most 200 000.
    pub limit: Amplitude,
}

/// A wearer's right arm: bones, ranges of the joints and muscles.
#[derive(Clone, PartialEq, Eq, Debug, Serialize, Deserialize, Schema)]
pub struct LimbSpec {
    /// Vectors from a segment's origin to the next joint, along its own axes (backward, right, up),
    /// µm, ±1 000 000: thorax to SC, SC to GH, GH to EL, EL to hand. The last three must be at
    /// least 10 mm long.
    pub offsets_um: [[i32; 3]; JOINTS + 1],
    /// Lowest and highest angle of each axis, m°; ±180 000, and ±80 000 for the middle axis of each
    /// joint, beyond which its outer axes come too close to each other.
    pub ranges_mdeg: [(i32, i32); AXES],
    /// Lines of action, 1…10.
    pub lines: Lines,
}

/// Length of the shortest bone allowed, µm.
const SHORTEST_UM: i64 = 10_000;

impl LineSpec {
    /// Range of [`Self::channel`].
    pub const CHANNEL: Range = super::CHANNEL;
    /// Range of the number of [`Self::vias`].
    pub const VIA_COUNT: Range = Range::new("vias", 2, 6);
    /// Range of [`ViaSpec::segment`].
    pub const SEGMENT: Range = Range::new("segment", 0, 3);
    /// Range of each component of [`ViaSpec::at_um`].
    pub const AT_UM: Range = Range::new("at_um", -1_000_000, 1_000_000);
    /// Range of [`Self::gain_mn_per_ma`].
    pub const GAIN_MN_PER_MA: Range = Range::new("gain_mn_per_ma", 1, 100_000_000);
    /// Range of [`Self::threshold`].
    pub const THRESHOLD: Range = Range::new("threshold", 0, 199_999);
    /// Range of [`Self::limit`], for the lowest threshold.
    pub const LIMIT: Range = Range::new("limit", 1, 200_000);

    /// Calls `note` for every field outside its range.
    pub fn report_mistakes(&self, note: &mut dyn FnMut(OutOfRange)) {
        let mut hold = |checked: Result<(), OutOfRange>| {
            if let Err(range) = checked {
                note(range);
            }
        };
        hold(Self::CHANNEL.check(self.channel));
        hold(Self::VIA_COUNT.check(self.vias.len() as i64)); // at most 6
        // For segments in the wrong order, or no joint between first and last, the report contains
        // the segments that would be allowed.
        let mut lowest = 0;
        for via in &self.vias {
            hold(Self::SEGMENT.with_min_at_least(lowest).check(via.segment));
            lowest = via.segment.min(3).into();
            for um in via.at_um {
                hold(Self::AT_UM.check(um));
            }
        }
        let joint = u32::from(self.joint.index());
        let ends = (self.vias.first(), self.vias.last());
        if let (Some(first), Some(last)) = ends {
            hold(Self::SEGMENT.with_max_at_most(joint).check(first.segment));
            hold(
                Self::SEGMENT
                    .with_min_at_least(joint + 1)
                    .check(last.segment),
            ); // joint is 0…2
        }
        hold(Self::GAIN_MN_PER_MA.check(self.gain_mn_per_ma));
        hold(Self::THRESHOLD.check(self.threshold.get()));
        let above = self.threshold.get().saturating_add(1);
        hold(Self::LIMIT.with_min_at_least(above).check(self.limit.get()));
    }
}

impl LimbSpec {
    /// Range of each component of [`Self::offsets_um`].
    pub const OFFSET_UM: Range = Range::new("offsets_um", -1_000_000, 1_000_000);
    /// Range of the number of [`Self::lines`].
    pub const LINE_COUNT: Range = Range::new("lines", 1, 10);
    /// Range of both angles of [`Self::ranges_mdeg`], except those of middle axes.
    pub const RANGE_MDEG: Range = Range::new("ranges_mdeg", -180_000, 180_000);
    /// Range of both angles of middle axes.
    pub const MIDDLE_MDEG: Range = Range::new("ranges_mdeg", -80_000, 80_000);

    /// Calls `note` for every mistake in bones and ranges.
    pub fn report_bone_mistakes(
        offsets_um: &[[i32; 3]; JOINTS + 1],
        ranges_mdeg: &[(i32, i32); AXES],
        note: &mut dyn FnMut(LimbError),
    ) {
        for (way, um) in (0u8..).zip(offsets_um) {
            if let Err(range) = check_segment_vector(way, um) {
                note(LimbError::Way { way, range });
            }
        }
        for (axis, &range_mdeg) in (0u8..).zip(ranges_mdeg) {
            if let Err(range) = check_range(axis, range_mdeg) {
                note(LimbError::Axis { axis, range });
            }
        }
    }

    /// Calls `note` for every mistake, those of the bones first.
    pub fn report_mistakes(&self, note: &mut dyn FnMut(LimbError)) {
        Self::report_bone_mistakes(&self.offsets_um, &self.ranges_mdeg, note);
        // At most 10.
        if let Err(range) = Self::LINE_COUNT.check(self.lines.len() as i64) {
            note(LimbError::Lines(range));
        }
        let mut taken = 0u32;
        for (line, spec) in (0u8..).zip(&self.lines) {
            spec.report_mistakes(&mut |range| note(LimbError::Line { line, range }));
            let channel = spec.channel;
            let bit = 1u32.wrapping_shl(channel.into()); // 0…9, or already reported
            if taken & bit != 0 {
                note(LimbError::ChannelTwice { line, channel });
            }
            taken |= bit;
        }
    }
}

/// Checks the components of a segment vector, and that a bone has a length.
fn check_segment_vector(n: u8, way: &[i32; 3]) -> Result<(), OutOfRange> {
    for &um in way {
        LimbSpec::OFFSET_UM.check(um)?;
    }
    // At most 3·10^12.
    let square: i64 = way.iter().map(|&um| i64::from(um) * i64::from(um)).sum();
    if n > 0 && square < SHORTEST_UM * SHORTEST_UM {
        let longest = way.iter().map(|um| um.unsigned_abs()).max();
        let length = Range {
            min: SHORTEST_UM as i32,
            ..LimbSpec::OFFSET_UM
        };
        return length.check(longest.unwrap_or(0));
    }
    Ok(())
}

/// Checks that both angles of an axis are allowed, and that the lower one comes first.
fn check_range(axis: u8, (low, high): (i32, i32)) -> Result<(), OutOfRange> {
    let allowed = match axis % 3 {
        1 => LimbSpec::MIDDLE_MDEG,
        _ => LimbSpec::RANGE_MDEG,
    };
    allowed.check(low)?;
    let above = Range {
        min: low, // within ±180 000
        ..allowed
    };
    above.check(high)
}
