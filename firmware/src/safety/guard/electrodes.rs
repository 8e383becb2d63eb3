//! Judging readings of the current: in the check before arming, and while stimulating.

use super::{Guard, Mode};
use crate::pulse::CHANNELS;
use crate::safety::check::{
    CHECK_PAUSE_US, Electrode, SENSED_US, is_above_limit, judge, least_load_ohm,
};
use crate::safety::{Denial, ElectrodeCheck, Fault, Notice, Reading, StopCause};
use crate::units::{Micros, us};

impl Guard {
    /// Returns when the pulses of an electrode check requested at `now` may begin. A check is
    /// delayed and not refused for coming too soon, because arming again within a second is no
    /// error of the host.
    pub(super) fn check_start(&self, now: Micros) -> Micros {
        let since_us = self.checked.map(|began| now.elapsed_since(began));
        // After 72 minutes the clock wraps, and one check in 8,600 is delayed needlessly.
        now + us(since_us.map_or(0, |since_us| CHECK_PAUSE_US.saturating_sub(since_us)))
    }

    #[inline(never)]
    pub(super) fn end_check(&mut self, check: ElectrodeCheck, now: Micros) -> Notice {
        let outcome = match check.first_missing() {
            Some((channel, true)) => Err(Denial::PhaseLost { channel }),
            Some((channel, false)) => Err(Denial::ElectrodeOff { channel }),
            None => self.take_loads(),
        };
        if let Err(denied) = outcome {
            self.enter_idle(StopCause::Request);
            return Notice::Checked(Err(denied));
        }
        self.open_core();
        self.mode = Mode::Armed { since: now };
        self.open_allowance();
        Notice::Checked(Ok(()))
    }

    /// Stores the loads that the check measured. From now on every channel is judged with the lower
    /// of the measured and the configured load, and so is the sum of all channels.
    fn take_loads(&mut self) -> Result<(), Denial> {
        let setup = self.setup.as_ref();
        let Some((mut sums, wearer)) = setup.map(|setup| (setup.sums, setup.wearer)) else {
            return Ok(());
        };
        for channel in 0..CHANNELS as u8 {
            let index = usize::from(channel);
            if !self.verify_channel_for_burst(channel) {
                continue; // and the refill ends in a fault
            }
            let (Some(setup), Some(watch), Some(kept)) = (
                &mut self.setup,
                self.watches.get_mut(index),
                self.loads.get_mut(index),
            ) else {
                continue;
            };
            let load = watch.take_load();
            if let Some(Some(config)) = setup.channels.get_mut(index)
                && let Some(ohm) = least_load_ohm(load)
            {
                let judged = config.with_load(ohm, &wearer);
                let judged = judged.map_err(|_| Denial::LoadTooLow { channel, ohm })?;
                sums.add(config, &judged);
                *config = judged;
            }
            *kept = load;
            self.renew_armed_checksum(channel);
        }
        sums.check(&wearer).map_err(Denial::Together)
    }

    /// Takes a reading during the check. It marks its phase as passed and may be reported, or it
    /// ends the check. A reading sampled before the check's first window has played belongs to an
    /// earlier stimulation and is ignored.
    #[inline(never)]
    pub(super) fn check_reading(&mut self, reading: Reading, now: Micros) -> Option<Notice> {
        let Mode::Checking { check, until } = &mut self.mode else {
            return None;
        };
        let since_epoch = ElectrodeCheck::length_us().checked_sub(until.elapsed_since(now))?;
        let is_last = ElectrodeCheck::is_last_step(since_epoch.checked_sub(SENSED_US)?);
        let (channel, index) = (reading.channel, usize::from(reading.channel));
        let config = *self.setup.as_ref()?.channel(channel)?;
        let applied = self.in_force.get(index)?.amplitude;
        let electrode = judge(reading, &config.stage, applied);
        if electrode == Electrode::Short || is_above_limit(reading, config.max_current) {
            self.enter_idle(StopCause::Request);
            return Some(Notice::Checked(Err(Denial::ElectrodeShort { channel })));
        }
        if electrode == Electrode::Fine && is_last {
            check.mark_passed(channel, reading.second);
            self.open_core();
            self.verify_channel(channel);
            self.watches
                .get_mut(index)?
                .record_check_load(reading, applied);
        }
        (is_last && !reading.second).then_some(Notice::Electrode {
            channel,
            applied,
            current_ua: reading.current().get(),
        })
    }

    /// Judges a current reading that was sampled while stimulating.
    ///
    /// # Errors
    /// Returns the fault that this reading shows, alone or together with earlier ones.
    pub(super) fn watch_reading(&mut self, reading: Reading) -> Result<(), Fault> {
        if !matches!(self.mode, Mode::Stimulating | Mode::Stopping { .. }) {
            return Ok(());
        }
        let index = usize::from(reading.channel);
        let setup = self.setup.as_ref();
        let (Some((config, wearer)), Some(&shown), Some(&load), Some(&watch)) = (
            setup.and_then(|setup| Some((setup.channel(reading.channel)?, &setup.wearer))),
            self.in_force.get(index),
            self.loads.get(index),
            self.watches.get(index),
        ) else {
            return Ok(());
        };
        let max = config.max_current_at(shown.width_us, wearer);
        let after = watch.updated(reading, config, load, (shown.amplitude, max))?;
        // Most readings change nothing, and then the memory need not be checked and summed again.
        if after != watch
            && self.verify_channel(reading.channel)
            && let Some(watch) = self.watches.get_mut(index)
        {
            *watch = after;
        }
        Ok(())
    }
}
