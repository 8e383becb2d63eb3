//! What the wearer allows of time and charge, since power came up: neither arming nor a
//! fault gives any of it back.

use super::{Fall, Guard, Mode};
use crate::pulse::{CHANNELS, WINDOW_US};
use crate::safety::{Denied, Setup, StopCause};
use crate::seal::Seal;
use crate::units::{Micros, us};

/// 256ths of a pC in 1 mC.
const PER_MC: u64 = 256_000_000_000;

const PER_S: u64 = 1_000_000;

/// What has been spent.
#[derive(Debug)]
pub(super) struct Allowance {
    /// Time of stimulation, µs, up to the host's latest frame; sealed by itself, for it
    /// changes with those frames only.
    time_us: u64,
    time_seal: Seal,
    /// Of each channel, in 256ths of a pC, one phase a pulse: sealed with its amplitudes.
    charge: [u64; CHANNELS],
}

impl Default for Allowance {
    fn default() -> Self {
        Self {
            time_us: 0,
            time_seal: Seal::of(&0u64),
            charge: [0; CHANNELS],
        }
    }
}

impl Allowance {
    /// Whether anything is left for `setup`.
    ///
    /// # Errors
    /// What there is none of.
    pub(super) fn check(&self, setup: &Setup) -> Result<(), Denied> {
        let wearer = setup.wearer.spec();
        let max_s = wearer.max_session_s;
        if self.time_us >= u64::from(max_s) * PER_S {
            return Err(Denied::TimeOver { max_s });
        }
        let max_mc = wearer.max_dose_mc;
        for (channel, charge) in (0u8..).zip(self.charge) {
            if setup.channel(channel).is_some() && charge >= u64::from(max_mc) * PER_MC {
                return Err(Denied::DoseReached { channel, max_mc });
            }
        }
        Ok(())
    }

    /// What a channel has put out, for its seal.
    pub(super) fn charge(&self, channel: usize) -> Option<u64> {
        self.charge.get(channel).copied()
    }

    /// A burst puts out `charge`; whether `max_mc` is reached with it.
    #[inline(always)]
    pub(super) fn spend_charge(&mut self, channel: usize, charge: u64, max_mc: u32) -> bool {
        let Some(sum) = self.charge.get_mut(channel) else {
            return false;
        };
        // A day of the largest bursts is 3e18 or less.
        *sum = sum.saturating_add(charge);
        *sum >= u64::from(max_mc) * PER_MC
    }
}

impl Guard {
    /// Time has passed since the host was heard last. Looked at with each of its frames:
    /// at most its timeout, 1 s, late.
    #[inline(never)]
    pub(super) fn spend_time(&mut self, elapsed_us: u32) {
        let Mode::Stimulating = self.mode else {
            return;
        };
        let time_us = self.allowance.time_us;
        if !self.allowance.time_seal.holds(&time_us) {
            self.break_seal(); // and the refill ends in a fault
        }
        let time_us = time_us.saturating_add(elapsed_us.into());
        self.allowance.time_us = time_us;
        self.allowance.time_seal = Seal::of(&time_us);
        if time_us >= self.max_time_us() {
            let at = self.heard + us(elapsed_us);
            self.end_allowance(at, StopCause::TimeOver);
        }
    }

    /// Whether a frame heard by the window at `now` could end the time.
    pub(super) fn is_time_over_by(&self, now: Micros) -> bool {
        let since_us = now.elapsed_since(self.heard).saturating_add(WINDOW_US);
        self.allowance.time_us.saturating_add(since_us.into()) >= self.max_time_us()
    }

    fn max_time_us(&self) -> u64 {
        let setup = self.setup.as_ref();
        setup.map_or(0, |s| u64::from(s.wearer.spec().max_session_s) * PER_S)
    }

    /// From stimulating to a stop as any other, which the next tick tells.
    #[cold]
    #[inline(never)]
    pub(super) fn end_allowance(&mut self, at: Micros, cause: StopCause) {
        if let Mode::Stimulating = self.mode {
            self.open_core();
            self.mode = Mode::Stopping {
                fall: Fall::new(at, self.fall_us()),
                cause,
                is_told: false,
            };
        }
    }
}
