//! Lists of pulses: their checks, and how they replace the pulses of a train.

use super::{Guard, Mode, bit};
use crate::pulse::BurstTime;
use crate::safety::list::Playing;
use crate::safety::ramp::Rise;
use crate::safety::{Channel, Denial, ListedPulse, PulseList, Stimulus, Wearer};
use crate::seal::Checksum;
use crate::units::{Micros, us};

impl Guard {
    /// Plays `list` from the channel's next burst on, in place of the train's pulses. The train
    /// continues a period after the last listed pulse. Each pulse is checked like a setpoint. Only
    /// a train can raise a channel from zero: before the rise is over, a list would skip the rise
    /// or be altered by it.
    ///
    /// # Errors
    /// Refuses if the state is not Stimulating; if the channel does not exist, is driven by a
    /// controller, takes no lists or has not risen; if another list is in progress; or if a pulse
    /// is not allowed, comes too soon or too late, or differs too much from the others where the
    /// wearer limits steps.
    #[inline(never)]
    pub fn play_list(&mut self, list: &PulseList, now: Micros) -> Result<(), Denial> {
        let channel = list.channel;
        match self.mode {
            Mode::Stimulating => {}
            Mode::Fault(record) => return Err(Denial::FaultLatched(record.fault)),
            Mode::Armed { .. } => return Err(Denial::WrongState(self.state())),
            _ => return Err(Denial::NotArmed),
        }
        let setup = self.setup.as_ref().ok_or(Denial::NotArmed)?;
        let config = setup
            .channel(channel)
            .ok_or(Denial::NoChannel { channel })?;
        if setup.controlled & bit(channel) != 0 {
            return Err(Denial::Controlled { channel });
        }
        if !config.train.spec().lists {
            return Err(Denial::NoLists { channel });
        }
        if self.list.is_playing() {
            return Err(Denial::ListPlays);
        }
        let rise = self.rises.get(usize::from(channel));
        if !rise.is_some_and(Rise::is_risen) {
            return Err(Denial::NotRisen { channel });
        }
        let mut least_us = 0;
        for pulse in &list.pulses {
            check_pulse(channel, config, &setup.wearer, pulse, least_us)?;
            least_us = config.min_period_us;
        }
        self.check_rise(config, &setup.wearer, list)?;
        if self.limits_steps() {
            let listed = list.pulses.iter().map(ListedPulse::stimulus);
            self.check_spread(channel, listed.clone(), now)?;
            if self.verify_channel(channel) {
                for stimulus in listed {
                    self.note_order(channel, stimulus, now);
                }
            }
        }
        self.list = Playing::new(list);
        self.renew_list_checksum();
        Ok(())
    }

    /// Simulates `list` on a copy of its channel's rise: each pulse is played as listed, or the
    /// list is refused. The first pulse follows the latest burst by one period plus its own delay.
    #[inline(never)]
    fn check_rise(
        &self,
        config: &Channel,
        wearer: &Wearer,
        list: &PulseList,
    ) -> Result<(), Denial> {
        let channel = list.channel;
        let rise = self.rises.get(usize::from(channel)).copied();
        let mut rise = rise.ok_or(Denial::NoChannel { channel })?;
        let period_us = config.train.spec().period_us;
        let mut previous = self.stimulus_in_force(channel);
        let mut at = rise.last_burst_time() + us(period_us);
        for pulse in &list.pulses {
            at += us(pulse.after_us);
            let time = BurstTime {
                at,
                period_us,
                opens: false,
            };
            let wanted = pulse.stimulus();
            let reach = rise.note_burst(time, wearer.rise());
            let highest = reach.amplitude(config, wearer, wanted, previous);
            if highest < pulse.amplitude {
                return Err(Denial::ListedSlope { channel, highest });
            }
            previous = wanted;
        }
        Ok(())
    }

    /// Returns the stimulus that the list in progress gives to its channel's next burst, in place
    /// of the train's. `None` leaves the burst out.
    #[inline(never)]
    pub(super) fn take_listed_stimulus(&mut self) -> Option<Stimulus> {
        if !self.list_seal.matches(&self.list) {
            self.note_checksum_mismatch(); // and the refill ends in a fault
            return None;
        }
        let stimulus = self.list.next_stimulus();
        self.renew_list_checksum();
        stimulus
    }

    /// Ends any list in progress, because a later setpoint replaces it.
    #[inline(never)]
    pub(super) fn end_list(&mut self) {
        self.list = Playing::NOTHING;
        self.renew_list_checksum();
    }

    fn renew_list_checksum(&mut self) {
        let seal = Checksum::of(&self.list);
        self.list_seal = seal;
    }
}

/// Checks that a channel may play `pulse` at least `least_us` after the previous one.
fn check_pulse(
    channel: u8,
    config: &Channel,
    wearer: &Wearer,
    pulse: &ListedPulse,
    least_us: u32,
) -> Result<(), Denial> {
    let after = ListedPulse::AFTER_US.with_min_at_least(least_us);
    if after.check(pulse.after_us).is_err() {
        return Err(Denial::Listed { channel, least_us });
    }
    let widths = config.train.widths();
    if !widths.contains(&pulse.width_us) {
        return Err(Denial::ListedWidth {
            channel,
            min_us: *widths.start(),
            max_us: *widths.end(),
        });
    }
    let limit = config.limit;
    if pulse.amplitude > limit {
        return Err(Denial::AboveLimit { channel, limit });
    }
    let highest = config.max_amplitude_at(pulse.width_us, wearer);
    if pulse.amplitude > highest {
        return Err(Denial::Charge { channel, highest });
    }
    Ok(())
}
