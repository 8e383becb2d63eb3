//! How stimulation ends: by the wearer's fall, or at once.

use super::{Fall, Guard, Mode};
use crate::safety::{Inputs, Notice, StopCause};
use crate::units::Micros;

impl Guard {
    pub(super) fn ramp_down(&mut self, from: Micros, cause: StopCause) -> Notice {
        self.fall(Fall::new(from, self.fall_us()), cause);
        Notice::Stopping(cause)
    }

    pub(super) fn fall_us(&self) -> u32 {
        self.setup.as_ref().map_or(0, |s| s.wearer.fall_us())
    }

    /// Stops along `fall`, which is told by the caller.
    pub(super) const fn fall(&mut self, fall: Fall, cause: StopCause) {
        self.open_core();
        self.mode = Mode::Stopping {
            fall,
            cause,
            is_told: true,
        };
    }

    /// What was held closed opened: no further pulse begins.
    pub(super) fn stop_at_once(&mut self, now: Micros, released: u8) -> Notice {
        let cause = let_go(released);
        self.fall(Fall::new(now, 0), cause);
        Notice::Stopping(cause)
    }
}

/// Whether a stop for this reason lets no further pulse begin.
pub(super) const fn is_at_once(cause: StopCause) -> bool {
    matches!(cause, StopCause::HandStop | StopCause::ArmKey)
}

/// Why what was held closed stops, as bits of [`Inputs::closed`]: the stop comes first.
pub(super) const fn let_go(released: u8) -> StopCause {
    if released & Inputs::STOP != 0 {
        StopCause::HandStop
    } else {
        StopCause::ArmKey
    }
}
