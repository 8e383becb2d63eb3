//! Ranges of the parts of a joint's specification, and the reasons why a joint is refused.

use crate::range::{OutOfRange, Range};

/// Largest amplitude that a specification may contain, mV or µA. It only bounds arithmetic;
/// `safety` limits what a wearer receives.
pub const AMPLITUDE_MAX: i32 = 200_000;
/// Range of the channel number of a stimulation point or a wall.
pub const CHANNEL: Range = Range::new("channel", 0, 9);
/// Largest gain of any control law except b: 100 in thousandths.
pub(super) const GAIN_MAX_MILLI: i32 = 100_000;
/// Half a turn, m°.
const HALF_TURN: i32 = 180_000;

/// Range of the lowest angle of a joint, m°.
pub const ANGLE_MIN_MDEG: Range = Range::new("angle_min_mdeg", -HALF_TURN, HALF_TURN - 1);
/// Range of the highest angle of a joint, m°, which must also exceed the lowest.
pub const ANGLE_MAX_MDEG: Range = Range::new("angle_max_mdeg", 1 - HALF_TURN, HALF_TURN);

/// Reason why a joint was refused.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum SpecError {
    /// A field is outside its range, which may depend on the fields before it.
    Range(OutOfRange),
    /// Two points use the same channel.
    ChannelTwice {
        /// Number of the channel, 0…9.
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
