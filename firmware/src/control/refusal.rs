//! What any part of a joint's specification may be, and why a joint is refused.

use crate::range::{OutOfRange, Range};

/// Highest amplitude a spec may name, mV or µA. Only bounds arithmetic; what a
/// wearer may get is `safety`'s to say.
pub const AMPLITUDE_MAX: i32 = 200_000;
/// A point's or a wall's channel.
pub const CHANNEL: Range = Range::new("channel", 0, 9);
/// 100 in thousandths: the highest gain of any law but b.
pub(super) const GAIN_MAX_MILLI: i32 = 100_000;
/// Half a turn, m°.
const HALF_TURN: i32 = 180_000;

/// The lowest angle of a joint.
pub const ANGLE_MIN_MDEG: Range = Range::new("angle_min_mdeg", -HALF_TURN, HALF_TURN - 1);
/// The highest; above the lowest.
pub const ANGLE_MAX_MDEG: Range = Range::new("angle_max_mdeg", 1 - HALF_TURN, HALF_TURN);

/// Why a joint was refused.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum SpecError {
    /// A field is outside what is allowed, given the fields before it.
    Range(OutOfRange),
    /// Two points name the same channel.
    ChannelTwice {
        /// That channel.
        channel: u8,
    },
}

impl From<OutOfRange> for SpecError {
    fn from(e: OutOfRange) -> Self {
        Self::Range(e)
    }
}

/// Checks the lowest and the highest angle of a joint, m°.
pub(crate) fn check_angles(low: i32, high: i32) -> Result<(), OutOfRange> {
    ANGLE_MIN_MDEG.check(low)?;
    let above = Range {
        min: low + 1, // low is below half a turn
        ..ANGLE_MAX_MDEG
    };
    above.check(high)
}
