//! What a host says of a wearer's arm, and the checks it must pass once.

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
    /// Sternoclavicular: thorax to shoulder girdle.
    Sternoclavicular,
    /// Glenohumeral: shoulder girdle to upper arm.
    Glenohumeral,
    /// Elbow: upper arm to forearm.
    Elbow,
}

impl JointName {
    /// Along the chain.
    pub const ALL: [Self; JOINTS] = [Self::Sternoclavicular, Self::Glenohumeral, Self::Elbow];

    /// Its place in the chain: 0…2. The segment above it has the same number.
    #[must_use]
    pub const fn index(self) -> u8 {
        match self {
            Self::Sternoclavicular => 0,
            Self::Glenohumeral => 1,
            Self::Elbow => 2,
        }
    }
}

/// A point that a line of action passes, fixed to a segment.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize, Schema)]
pub struct ViaSpec {
    /// 0 thorax, 1 shoulder girdle, 2 upper arm, 3 forearm.
    pub segment: u8,
    /// From the segment's origin along its own axes (backward, right, up), µm;
    /// ±1 000 000.
    pub at_um: [i32; 3],
}

/// A wearer's lines.
pub type Lines = Vec<LineSpec, LINES>;

/// One muscle group under one electrode pair.
#[derive(Clone, PartialEq, Eq, Debug, Serialize, Deserialize, Schema)]
pub struct LineSpec {
    /// Channel number, 0…9; each at most once.
    pub channel: u8,
    /// The joint at which the nearest-neighbour recruitment considers it: one that
    /// the line crosses. Others that it crosses get their torque all the same.
    pub joint: JointName,
    /// Origin to insertion, 2…6, segments never falling, the first's below the last's.
    pub vias: Vec<ViaSpec, VIAS>,
    /// g, force per current above the threshold, mN/mA (mN/V on a voltage stage);
    /// 1…100 000 000.
    pub gain_mn_per_ma: u32,
    /// −q, where force begins, µA (mV); at most 199 999.
    pub threshold: Amplitude,
    /// The most this wearer agreed to: above the threshold, at most 200 000.
    pub limit: Amplitude,
}

/// A wearer's right arm: bones, ranges of the joints, muscles.
#[derive(Clone, PartialEq, Eq, Debug, Serialize, Deserialize, Schema)]
pub struct LimbSpec {
    /// From a segment's origin to the next joint, along its own axes (backward, right,
    /// up), µm, ±1 000 000: thorax to SC, SC to GH, GH to EL, EL to hand. The last
    /// three at least 10 mm long.
    pub ways_um: [[i32; 3]; JOINTS + 1],
    /// Lowest and highest angle of each axis, m°; ±180 000, the middle axis of each
    /// joint ±80 000: beyond it its outer axes come too close to each other.
    pub ranges_mdeg: [(i32, i32); AXES],
    /// 1…10.
    pub lines: Lines,
}

/// Shortest bone.
const SHORTEST_UM: i64 = 10_000;

impl LineSpec {
    /// Of [`Self::channel`].
    pub const CHANNEL: Range = super::CHANNEL;
    /// How many [`Self::vias`].
    pub const VIA_COUNT: Range = Range::new("vias", 2, 6);
    /// Of [`ViaSpec::segment`].
    pub const SEGMENT: Range = Range::new("segment", 0, 3);
    /// Of each of [`ViaSpec::at_um`].
    pub const AT_UM: Range = Range::new("at_um", -1_000_000, 1_000_000);
    /// Of [`Self::gain_mn_per_ma`].
    pub const GAIN_MN_PER_MA: Range = Range::new("gain_mn_per_ma", 1, 100_000_000);
    /// Of [`Self::threshold`].
    pub const THRESHOLD: Range = Range::new("threshold", 0, 199_999);
    /// Of [`Self::limit`], above the lowest threshold.
    pub const LIMIT: Range = Range::new("limit", 1, 200_000);

    /// Tells `note` of every field that is not within its range.
    pub fn report_mistakes(&self, note: &mut dyn FnMut(OutOfRange)) {
        let mut hold = |checked: Result<(), OutOfRange>| {
            if let Err(range) = checked {
                note(range);
            }
        };
        hold(Self::CHANNEL.check(self.channel));
        hold(Self::VIA_COUNT.check(self.vias.len() as i64)); // at most 6
        // A segment below the one before, or no joint between first and last, is
        // told by the segment that would do.
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
    /// Of each of [`Self::ways_um`].
    pub const WAY_UM: Range = Range::new("ways_um", -1_000_000, 1_000_000);
    /// How many [`Self::lines`].
    pub const LINE_COUNT: Range = Range::new("lines", 1, 10);
    /// Of both of [`Self::ranges_mdeg`], the middle axes' apart.
    pub const RANGE_MDEG: Range = Range::new("ranges_mdeg", -180_000, 180_000);
    /// Of those of middle axes.
    pub const MIDDLE_MDEG: Range = Range::new("ranges_mdeg", -80_000, 80_000);

    /// Tells `note` of every mistake in bones and ranges.
    pub fn report_bone_mistakes(
        ways_um: &[[i32; 3]; JOINTS + 1],
        ranges_mdeg: &[(i32, i32); AXES],
        note: &mut dyn FnMut(LimbError),
    ) {
        for (way, um) in (0u8..).zip(ways_um) {
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

    /// Tells `note` of every mistake, bones first.
    pub fn report_mistakes(&self, note: &mut dyn FnMut(LimbError)) {
        Self::report_bone_mistakes(&self.ways_um, &self.ranges_mdeg, note);
        // At most 10.
        if let Err(range) = Self::LINE_COUNT.check(self.lines.len() as i64) {
            note(LimbError::Lines(range));
        }
        let mut taken = 0u32;
        for (line, spec) in (0u8..).zip(&self.lines) {
            spec.report_mistakes(&mut |range| note(LimbError::Line { line, range }));
            let channel = spec.channel;
            let bit = 1u32.wrapping_shl(channel.into()); // 0…9, or told already
            if taken & bit != 0 {
                note(LimbError::ChannelTwice { line, channel });
            }
            taken |= bit;
        }
    }
}

/// A way's components, and that a bone has a length.
fn check_segment_vector(n: u8, way: &[i32; 3]) -> Result<(), OutOfRange> {
    for &um in way {
        LimbSpec::WAY_UM.check(um)?;
    }
    // At most 3·10^12.
    let square: i64 = way.iter().map(|&um| i64::from(um) * i64::from(um)).sum();
    if n > 0 && square < SHORTEST_UM * SHORTEST_UM {
        let longest = way.iter().map(|um| um.unsigned_abs()).max();
        let length = Range {
            min: SHORTEST_UM as i32,
            ..LimbSpec::WAY_UM
        };
        return length.check(longest.unwrap_or(0));
    }
    Ok(())
}

/// Low and high of an axis, low first.
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
