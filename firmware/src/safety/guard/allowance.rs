//! Stimulation time and charge that the wearer allows until power is removed. Neither arming nor a
//! fault nor a reset restores any of them.
//!
//! Time counts in Stimulating and Stopping, whether or not the host says anything. It is added at
//! every [`SAVE_US`] and whenever stimulation ends. The counts are handed out as entries
//! ([`Guard::entry`]), to be stored in memory that a reset does not clear.

use super::{Fall, Guard, Mode};
use crate::pulse::{CHANNELS, WINDOW_US};
use crate::safety::allowance::{Entry, OPEN_US, RemainingAllowance, Usage, UsageAtBoot};
use crate::safety::{Channel, Denial, Setup, StopCause, Wearer};
use crate::seal::Checksum;
use crate::units::{Micros, us};

/// Number of charge units (256ths of a pC) in 1 mC.
const PER_MC: u64 = 256_000_000_000;
/// Number of charge units (256ths of a pC) in 1 µC.
const PER_UC: u64 = PER_MC / 1_000;

const PER_S: u64 = 1_000_000;

/// Longest time between two entries while stimulating, µs.
const SAVE_US: u32 = 200_000;
// The rest of the time is for the thread that writes the entry: the watchdog resets the device 12
// ms after that thread hangs.
const _: () = assert!(SAVE_US + 2 * WINDOW_US + 12_000 < OPEN_US);

/// Stimulation time and charge spent since power came up.
#[derive(Clone, Debug)]
pub(super) struct Allowance {
    /// Stimulation time up to `since`, µs.
    time_us: u64,
    /// Device time up to which `time_us` counts.
    since: Micros,
    /// Checksum over `time_us` and `since`.
    time_seal: Checksum,
    /// Time at which stimulation time is counted next; covered by the checksum of the guard's
    /// state.
    due: Micros,
    /// Charge of each channel, in 256ths of a pC, counting one phase of each pulse. Covered by the
    /// checksum of the channel's amplitudes.
    charge: [u64; CHANNELS],
    /// Largest charge that each channel can output within [`OPEN_US`], nC.
    most_nc: [u32; CHANNELS],
    /// Whether stimulation is in progress or may begin, from arming on.
    is_open: bool,
    /// Whether an entry has to be written.
    is_owed: bool,
    /// Whether the amount spent before the reset is unknown.
    is_lost: bool,
}

/// How a burst's charge compares with the wearer's charge limit.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Dose {
    Within,
    /// The burst uses the allowance up exactly.
    Reached,
    /// The burst would exceed the allowance.
    Beyond,
}

impl Allowance {
    /// Returns the allowance after a boot; `found` is the time and charge spent before.
    pub(super) fn new(found: UsageAtBoot) -> Self {
        let (spent, is_lost) = match found {
            UsageAtBoot::Spent(spent) => (spent, false),
            UsageAtBoot::Lost => (Usage::default(), true),
        };
        let since = Micros::new(0);
        Self {
            time_us: spent.time_us,
            since,
            time_seal: Checksum::of(&(spent.time_us, since)),
            due: since,
            charge: spent.charge,
            most_nc: [0; CHANNELS],
            is_open: false,
            is_owed: false,
            is_lost,
        }
    }

    /// Checks that time and charge are left for `setup`.
    ///
    /// # Errors
    /// Returns the limit that is used up, or that the counts were lost.
    pub(super) fn check(&self, setup: &Setup) -> Result<(), Denial> {
        if self.is_lost {
            return Err(Denial::AllowanceLost);
        }
        let wearer = setup.wearer.spec();
        if self.time_left_us(&setup.wearer) == 0 {
            let max_s = wearer.max_session_s;
            return Err(Denial::TimeOver { max_s });
        }
        let max_mc = wearer.max_dose_mc;
        for (channel, charge) in (0u8..).zip(self.charge) {
            if setup.channel(channel).is_some() && charge >= u64::from(max_mc) * PER_MC {
                return Err(Denial::DoseReached { channel, max_mc });
            }
        }
        Ok(())
    }

    /// Returns the time until the amplitudes must begin to fall, µs, if the fall has to end within
    /// the wearer's allowed time.
    fn time_left_us(&self, wearer: &Wearer) -> u64 {
        let fall_us = u64::from(wearer.fall_us() + WINDOW_US);
        max_time_us(wearer).saturating_sub(self.time_us.saturating_add(fall_us))
    }

    /// Returns the time at which stimulation time is counted next, for the checksum of the guard's
    /// state.
    pub(super) const fn next_count_time(&self) -> Micros {
        self.due
    }

    /// Returns the charge that a channel has output, in 256ths of a pC, for its checksum.
    pub(super) fn charge(&self, channel: usize) -> Option<u64> {
        self.charge.get(channel).copied()
    }

    /// Counts `charge` (256ths of a pC) of a burst before the burst is output, and compares the
    /// channel's total with the wearer's limit `max_mc`.
    #[inline(always)]
    pub(super) fn spend_charge(&mut self, channel: usize, charge: u64, max_mc: u32) -> Dose {
        let Some(sum) = self.charge.get_mut(channel) else {
            return Dose::Within;
        };
        let max = u64::from(max_mc) * PER_MC;
        // A day of the largest bursts is 3e18 or less.
        let after = sum.saturating_add(charge);
        if after > max {
            // Less than one burst is left, so the allowance counts as used up.
            *sum = (*sum).max(max);
            return Dose::Beyond;
        }
        *sum = after;
        if after == max {
            Dose::Reached
        } else {
            Dose::Within
        }
    }

    fn renew_time_checksum(&mut self) {
        self.time_seal = Checksum::of(&(self.time_us, self.since));
    }
}

impl Guard {
    /// Returns whether stimulation time must be counted in the window at `now`.
    #[inline(always)]
    pub(super) fn is_time_due(&self, now: Micros) -> bool {
        now.has_reached(self.allowance.due)
    }

    /// Opens the allowance at arming. A reset from now on may interrupt stimulation; the boot after
    /// it then adds the largest charge that each channel could have output.
    #[inline(never)]
    pub(super) fn open_allowance(&mut self) {
        if let Some(setup) = &self.setup {
            for (channel, most_nc) in (0u8..).zip(&mut self.allowance.most_nc) {
                let config = setup.channel(channel);
                *most_nc = config.map_or(0, |config| max_charge_nc(config, &setup.wearer));
            }
        }
        (self.allowance.is_open, self.allowance.is_owed) = (true, true);
    }

    /// Closes the allowance after the outputs have ended and the time was counted. A reset then
    /// adds nothing.
    pub(super) fn close_allowance(&mut self) {
        if core::mem::take(&mut self.allowance.is_open) {
            self.allowance.is_owed = true;
        }
    }

    /// Starts counting stimulation time at `at`.
    #[inline(never)]
    pub(super) fn begin_time(&mut self, at: Micros) {
        let allowance = &mut self.allowance;
        if !allowance
            .time_seal
            .matches(&(allowance.time_us, allowance.since))
        {
            return self.note_checksum_mismatch(); // and the refill ends in a fault
        }
        allowance.since = at;
        allowance.renew_time_checksum();
        self.schedule_count(at);
    }

    /// Counts the stimulation time up to `at`, and ends stimulation if the allowed time is over.
    /// Does nothing outside Stimulating and Stopping.
    #[inline(never)]
    pub(super) fn count_time(&mut self, at: Micros) {
        let (Mode::Stimulating | Mode::Stopping { .. }) = self.mode else {
            return;
        };
        let allowance = &mut self.allowance;
        let is_whole = allowance
            .time_seal
            .matches(&(allowance.time_us, allowance.since));
        // A fault is latched at once, within a window whose time was counted already.
        if allowance.since.is_before(at) {
            let elapsed_us = at.elapsed_since(allowance.since);
            allowance.time_us = allowance.time_us.saturating_add(elapsed_us.into());
            allowance.since = at;
            allowance.renew_time_checksum();
        }
        allowance.is_owed = true;
        if !is_whole {
            self.note_checksum_mismatch(); // and the refill ends in a fault
        }
        if self.time_left_us() == 0 {
            self.end_allowance(at, StopCause::TimeOver);
        }
        self.schedule_count(at);
    }

    fn time_left_us(&self) -> u64 {
        let setup = self.setup.as_ref();
        setup.map_or(0, |setup| self.allowance.time_left_us(&setup.wearer))
    }

    fn schedule_count(&mut self, at: Micros) {
        let mut wait_us = SAVE_US;
        if let Mode::Stimulating = self.mode {
            wait_us = self.time_left_us().min(SAVE_US.into()) as u32;
        }
        self.open_core();
        self.allowance.due = at + us(wait_us);
    }

    /// Ends stimulation with a normal fall, because the allowance is used up. The next tick
    /// reports it.
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

    /// Returns whether an entry has to be written to memory that a reset does not clear.
    #[must_use]
    #[inline(always)]
    pub fn has_entry_to_write(&self) -> bool {
        self.allowance.is_owed
    }

    /// Returns the time and charge spent so far, as an entry to be written.
    #[must_use]
    pub fn entry(&self) -> Entry {
        let Allowance {
            time_us,
            charge,
            most_nc,
            is_open,
            ..
        } = self.allowance;
        Entry {
            spent: Usage { time_us, charge },
            is_open,
            most_nc,
        }
    }

    /// Notes that [`Self::entry`] is on its way to be written.
    pub const fn mark_entry_sent(&mut self) {
        self.allowance.is_owed = false;
    }

    /// Returns the time and charge left at `now` within the wearer's limits, for the setup that is
    /// armed or was armed last; `None` before the first arming.
    #[must_use]
    pub fn remaining_allowance(&self, now: Micros) -> Option<RemainingAllowance> {
        let setup = self.setup.as_ref()?;
        let mut time_us = self.allowance.time_us;
        if let Mode::Stimulating | Mode::Stopping { .. } = self.mode
            && self.allowance.since.is_before(now)
        {
            time_us = time_us.saturating_add(now.elapsed_since(self.allowance.since).into());
        }
        let left_us = max_time_us(&setup.wearer).saturating_sub(time_us);
        let max = u64::from(setup.wearer.spec().max_dose_mc) * PER_MC;
        let doses = (0u8..).zip(self.allowance.charge);
        let armed = doses.filter(|(channel, _)| setup.channel(*channel).is_some());
        let left = armed.map(|(channel, charge)| (channel, max.saturating_sub(charge)));
        let (channel, dose) = left.min_by_key(|(_, left)| *left)?;
        Some(RemainingAllowance {
            time_ms: (left_us / 1_000) as u32, // a day is 8.6e7
            channel,
            dose_uc: u32::try_from(dose / PER_UC).unwrap_or(u32::MAX),
        })
    }
}

fn max_time_us(wearer: &Wearer) -> u64 {
    u64::from(wearer.spec().max_session_s) * PER_S
}

/// Returns the largest charge that a channel can output within [`OPEN_US`], nC.
fn max_charge_nc(config: &Channel, wearer: &Wearer) -> u32 {
    let bursts = u64::from(OPEN_US / config.min_period_us.max(1) + 2);
    let widest = config.charge_at(*config.train.widths().end());
    // At most 150 000 · 2^23 · 52 of 256ths of a pC.
    let by_limit = u64::from(config.limit.get()) * u64::from(widest) * bursts / 256_000 + 1;
    let pulses = u64::from(config.train.spec().burst_count);
    let by_charge = u64::from(wearer.spec().max_charge_nc) * pulses * bursts;
    u32::try_from(by_limit.min(by_charge)).unwrap_or(u32::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::safety::WearerSpec;
    use crate::safety::setup::tests::CHANNEL;

    /// In 250 ms, 14 bursts of 20 mA begin at a period of 20 ms. They have 200 µs, or widths whose
    /// charge the wearer limits.
    #[test]
    fn a_reset_counts_the_most_that_a_channel_could_have_put_out() {
        let wearer = WearerSpec::default().validate().unwrap();
        let channel = CHANNEL.validate(&wearer).unwrap();
        assert_eq!(max_charge_nc(&channel, &wearer), 14 * 4_000 + 1);
        let wearer = WearerSpec {
            max_charge_nc: 8_000,
            ..WearerSpec::default()
        };
        let wearer = wearer.validate().unwrap();
        let mut wide = CHANNEL;
        wide.train.max_width_us = 500;
        let wide = wide.validate(&wearer).unwrap();
        assert_eq!(max_charge_nc(&wide, &wearer), 14 * 8_000);
    }
}
