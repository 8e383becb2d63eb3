//! The two ways in which stimulation ends: along the wearer's fall, or at once.

use super::{Fall, Guard, Mode, Rise, Step, Watch};
use crate::pulse::CHANNELS;
use crate::safety::{Inputs, Notice, Stimulus, StopCause};
use crate::units::Micros;

impl Guard {
    pub(super) fn ramp_down(&mut self, from: Micros, cause: StopCause) -> Notice {
        self.begin_fall(Fall::new(from, self.fall_us()), cause);
        Notice::Stopping(cause)
    }

    pub(super) fn fall_us(&self) -> u32 {
        self.setup.as_ref().map_or(0, |s| s.wearer.fall_us())
    }

    /// Stops stimulation along `fall`. The caller reports the stop. Timed setpoints that are not
    /// due yet are dropped.
    pub(super) fn begin_fall(&mut self, fall: Fall, cause: StopCause) {
        self.open_core();
        self.waiting.clear();
        self.mode = Mode::Stopping {
            fall,
            cause,
            is_told: true,
        };
    }

    /// Stops after an input that was held closed has opened: no further pulse begins.
    pub(super) fn stop_at_once(&mut self, now: Micros, released: u8) -> Notice {
        let cause = release_cause(released);
        self.begin_fall(Fall::new(now, 0), cause);
        Notice::Stopping(cause)
    }

    /// Clears every wanted amplitude, every amplitude in force and every timed setpoint.
    pub(super) fn clear_amplitudes(&mut self) {
        // The old amplitudes do not matter any more, but the armed channels still do.
        for channel in 0..CHANNELS as u8 {
            self.verify_channel(channel);
        }
        self.wanted.fill(Stimulus::default());
        self.rises.fill(Rise::default());
        self.in_force.fill(Stimulus::default());
        self.steps.fill(Step::default());
        self.watches.fill(Watch::default());
        self.delayed = 0;
        self.end_list();
        self.waiting.clear();
    }

    pub(super) fn enter_idle(&mut self, cause: StopCause) -> Notice {
        self.open_core();
        self.mode = Mode::Idle;
        self.clear_amplitudes();
        self.close_allowance();
        Notice::Idle(cause)
    }
}

/// Returns whether a stop for this reason lets no further pulse begin.
pub(super) const fn is_immediate(cause: StopCause) -> bool {
    matches!(cause, StopCause::HandStop | StopCause::ArmKey)
}

/// Returns the stop cause for inputs that opened, as bits of [`Inputs::closed`]. The hand-held
/// stop takes precedence over the arm key.
pub(super) const fn release_cause(released: u8) -> StopCause {
    if released & Inputs::STOP != 0 {
        StopCause::HandStop
    } else {
        StopCause::ArmKey
    }
}
