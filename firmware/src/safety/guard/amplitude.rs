//! Amplitudes of bursts: the wanted amplitude within all limits, along rise and fall.

use super::allowance::Dose;
use super::{Guard, Mode, bit};
use crate::pulse::{Burst, BurstTime, Supply, Train};
use crate::safety::ramp::Rise;
use crate::safety::{Channel, Denial, ElectrodeCheck, Expected, Setup, Stimulus, StopCause};
use crate::units::{Amplitude, DacCode, Micros};
use core::num::{NonZeroU16, NonZeroU32};

impl Guard {
    /// Sets the amplitudes and pulse widths that a host asks for directly, all of them or none;
    /// width 0 stands for the train's own width. An amplitude beyond the wearer's limit, or one
    /// that rises faster than the wearer allows, is refused and not reduced: a host that asks for
    /// it is in error, and nobody asked for an amplitude in between.
    ///
    /// # Errors
    /// Refuses if the device is not armed, a channel does not exist or is driven by a controller,
    /// its train does not allow the width, the amplitude is above the limit or, at this width,
    /// above the charge limit, or the step is too large.
    pub fn set_amplitudes(
        &mut self,
        orders: impl Iterator<Item = (u8, Stimulus)> + Clone,
        now: Micros,
    ) -> Result<(), Denial> {
        let setup = self.setup_for_orders()?;
        let limits_steps = self.limits_steps();
        for (channel, stimulus) in orders.clone() {
            let stimulus = check_stimulus(setup, channel, stimulus)?;
            if limits_steps {
                self.check_step(channel, stimulus, now)?;
            }
        }
        for (channel, stimulus) in orders {
            self.set_wanted(channel, stimulus, now);
        }
        Ok(())
    }

    /// Stores `stimulus` as the wanted stimulus of `channel` from `now` on. The caller has checked
    /// it against every limit.
    fn set_wanted(&mut self, channel: u8, stimulus: Stimulus, now: Micros) {
        if !self.verify_channel_inlined(channel) {
            return; // and the refill ends in a fault
        }
        let stimulus = self.with_width(channel, stimulus);
        // A host repeats the wanted amplitude of the train; only a different order ends the list.
        if self.list.is_on(channel) && self.wanted.get(usize::from(channel)) != Some(&stimulus) {
            self.end_list();
        }
        if self.limits_steps() {
            self.note_order(channel, stimulus, now);
        }
        if let Some(wanted) = self.wanted.get_mut(usize::from(channel)) {
            *wanted = stimulus;
        }
    }

    /// Returns `stimulus` with the train's own width in place of width 0.
    #[inline]
    fn with_width(&self, channel: u8, stimulus: Stimulus) -> Stimulus {
        let config = self.setup.as_ref().and_then(|setup| setup.channel(channel));
        config.map_or(stimulus, |config| config.with_width(stimulus))
    }

    /// Returns the setup if its channels accept a host's setpoints in this state.
    #[inline]
    pub(super) fn setup_for_orders(&self) -> Result<&Setup, Denial> {
        match self.mode {
            Mode::Armed { .. } | Mode::Stimulating => self.setup.as_ref().ok_or(Denial::NotArmed),
            Mode::Fault(record) => Err(Denial::FaultLatched(record.fault)),
            _ => Err(Denial::NotArmed),
        }
    }

    #[inline(never)]
    fn check_step(&self, channel: u8, stimulus: Stimulus, now: Micros) -> Result<(), Denial> {
        let highest = self.max_orderable_amplitude(channel, stimulus.width_us, now);
        if stimulus.amplitude > highest {
            return Err(Denial::TooLargeStep { channel, highest });
        }
        Ok(())
    }

    /// Sets an amplitude that the control law computed, at the train's own width. Controllers keep
    /// within the limits of their channels, so the clamp to the limit matters only if that
    /// guarantee is broken. The control law does not know the wearer's step limits, so its
    /// amplitude is reduced to them. Returns whether it was reduced, so that the caller can report
    /// it to the control law.
    pub fn set_control_amplitude(
        &mut self,
        channel: u8,
        amplitude: Amplitude,
        now: Micros,
    ) -> bool {
        let wanted = self.wanted.get(usize::from(channel));
        if wanted.is_some_and(|wanted| wanted.amplitude == amplitude) {
            return false; // as mostly: what stands there need not be opened and sealed
        }
        let (Mode::Armed { .. } | Mode::Stimulating) = self.mode else {
            return false;
        };
        let setup = self.setup.as_ref();
        let Some(config) = setup.and_then(|setup| setup.channel(channel)) else {
            return false;
        };
        let (limit, width_us) = (config.limit, config.train.spec().width_us);
        let highest = if self.limits_steps() {
            self.max_orderable_amplitude(channel, width_us, now)
        } else {
            limit
        };
        let amplitude = amplitude.min(limit);
        let stimulus = Stimulus {
            amplitude: amplitude.min(highest),
            width_us,
        };
        self.set_wanted(channel, stimulus, now);
        amplitude > highest
    }

    /// Returns `period_us` limited to the range of periods for which the limits of `channel` were
    /// checked; `None` if the channel does not exist or the state accepts no setpoints.
    #[must_use]
    pub fn clamp_period(&self, channel: u8, period_us: u32) -> Option<u32> {
        let (Mode::Armed { .. } | Mode::Stimulating) = self.mode else {
            return None;
        };
        let config = self.setup.as_ref()?.channel(channel)?;
        // Not `clamp`, which panics if its minimum exceeds its maximum.
        Some(
            period_us
                .max(config.min_period_us)
                .min(config.max_period_us),
        )
    }

    /// Returns what `train` may output on an armed channel, for
    /// [`OutputCheck`](crate::safety::OutputCheck), which checks windows before they play.
    #[must_use]
    pub fn expected_output(&self, channel: u8, train: Option<Train>) -> Option<Expected> {
        let (config, train) = (self.setup.as_ref()?.channel(channel)?, train?);
        let max_nc = self.setup.as_ref()?.wearer.spec().max_charge_nc;
        Some(Expected {
            train,
            // A train other than the channel's own plays once: it is the electrode check's.
            min_period_us: config.min_period_us.min(train.spec().period_us),
            max_code: config.stage.code(config.limit),
            max_code_us: config.stage.code_us(max_nc),
        })
    }

    /// Returns amplitude and width of the channel's latest burst.
    #[must_use]
    pub fn stimulus_in_force(&self, channel: u8) -> Stimulus {
        self.in_force
            .get(usize::from(channel))
            .copied()
            .unwrap_or_default()
    }
}

impl Supply for Guard {
    fn burst(&mut self, channel: u8, time: BurstTime) -> Burst {
        if !self.verify_channel_for_burst(channel) {
            return Burst::SILENT; // and the refill ends in a fault
        }
        if time.opens
            && let Some(rise) = self.rises.get_mut(usize::from(channel))
        {
            *rise = Rise::default(); // a list may leave this burst out
        }
        let wanted = if self.list.is_on(channel) {
            self.take_listed_stimulus()
        } else {
            self.wanted.get(usize::from(channel)).copied()
        };
        let burst = wanted.and_then(|wanted| self.next_burst(channel, wanted, time));
        burst.unwrap_or(Burst::SILENT)
    }

    fn burst_interval_us(&self, channel: u8) -> Option<NonZeroU32> {
        let next_us = self.list.next_us_on(channel);
        next_us.filter(|_| self.check_no_mismatch().is_ok()) // else the refill ends in a fault
    }

    fn may_pulse(&mut self, _: u8, end: Micros) -> bool {
        match self.mode {
            Mode::Checking { .. } | Mode::Stimulating => true,
            Mode::Stopping { fall, .. } => fall.end().has_reached(end),
            _ => false,
        }
    }
}

impl Guard {
    /// Returns the burst of `channel` at `time`, if its wanted stimulus is `wanted`; `None` leaves
    /// the burst out. The caller has verified the channel's memory.
    #[inline(always)]
    fn next_burst(&mut self, channel: u8, wanted: Stimulus, time: BurstTime) -> Option<Burst> {
        let at = time.at;
        let index = usize::from(channel);
        let setup = self.setup.as_ref()?;
        let config = setup.channel(channel)?;
        let wearer = &setup.wearer;
        let rise = self.rises.get_mut(index)?;
        let mut least = DacCode::new(0);
        let amplitude = match self.mode {
            Mode::Checking { until, .. } => {
                let (amplitude, code) = check_step(config, until, at);
                *self.in_force.get_mut(index)? = Stimulus {
                    amplitude,
                    ..wanted
                };
                return Some(Burst::with_own_width(code));
            }
            // A channel without a wanted amplitude stays out of the schedule.
            _ if wanted.amplitude == Amplitude::ZERO => {
                *rise = Rise::default();
                self.steps.get_mut(index)?.burst = wanted;
                return None;
            }
            // An amplitude too small for the DAC cannot be the start of a rise.
            Mode::Stimulating if config.stage.code(wanted.amplitude) == DacCode::new(0) => {
                *rise = Rise::default();
                wanted.amplitude
            }
            Mode::Stimulating | Mode::Stopping { .. } => {
                let reach = rise.note_burst(time, wearer.rise());
                let previous = self.in_force.get(index).copied()?;
                let amplitude = reach.amplitude(config, wearer, wanted, previous);
                if let Mode::Stopping { fall, .. } = self.mode {
                    fall.apply(amplitude, at)
                } else {
                    self.delayed &= !bit(channel);
                    if amplitude != wanted.amplitude {
                        self.delayed |= bit(channel);
                    }
                    // A rise has no silent burst, so that a train's first pulse is a real pulse.
                    least = DacCode::new(1);
                    amplitude
                }
            }
            _ => return None,
        };
        let code = config.stage.code(amplitude).max(least);
        // At most 150 000 · 2^23.
        let charge = u64::from(amplitude.get()) * u64::from(config.charge_at(wanted.width_us));
        let max_mc = setup.wearer.spec().max_dose_mc;
        let dose = self.allowance.spend_charge(index, charge, max_mc);
        if dose != Dose::Within {
            self.end_allowance(at, StopCause::DoseReached);
        }
        if dose == Dose::Beyond {
            return None; // the others fall, this one ends here
        }
        // Rise, slope and fall lower the amplitude at the wanted width. No combination on the way
        // has more current or charge than the one that was checked.
        let width_us = wanted.width_us;
        *self.in_force.get_mut(index)? = Stimulus {
            amplitude,
            width_us,
        };
        self.steps.get_mut(index)?.burst = wanted;
        Some(Burst {
            code: Some(code),
            width_us: NonZeroU16::new(width_us),
        })
    }
}

/// Checks a host's stimulus against the limits that hold at all times, and returns it with the
/// train's own width in place of width 0.
#[inline]
pub(super) fn check_stimulus(
    setup: &Setup,
    channel: u8,
    stimulus: Stimulus,
) -> Result<Stimulus, Denial> {
    let config = setup
        .channel(channel)
        .ok_or(Denial::NoChannel { channel })?;
    if setup.controlled & bit(channel) != 0 {
        return Err(Denial::Controlled { channel });
    }
    let stimulus = config.with_width(stimulus);
    let widths = config.train.widths();
    if !widths.contains(&stimulus.width_us) {
        return Err(Denial::Width {
            channel,
            min_us: *widths.start(),
            max_us: *widths.end(),
        });
    }
    let limit = config.limit;
    if stimulus.amplitude > limit {
        return Err(Denial::AboveLimit { channel, limit });
    }
    let highest = config.max_amplitude_at(stimulus.width_us, &setup.wearer);
    if stimulus.amplitude > highest {
        return Err(Denial::Charge { channel, highest });
    }
    match config.pulses_below(stimulus, &setup.wearer) {
        0 => Ok(stimulus),
        pulses => Err(Denial::AboveStart {
            channel,
            pulses,
            start: config.start,
        }),
    }
}

/// Returns amplitude and DAC code at `at` of the electrode check that ends at `until`.
#[inline(never)]
fn check_step(config: &Channel, until: Micros, at: Micros) -> (Amplitude, DacCode) {
    let left_us = until.elapsed_since(at); // none is begun after the end
    let elapsed_us = ElectrodeCheck::length_us().saturating_sub(left_us);
    let last = check_amplitude(config);
    let code = ElectrodeCheck::code(config.stage.code(last), elapsed_us);
    if ElectrodeCheck::is_last_step(elapsed_us) {
        (last, code)
    } else {
        (config.stage.amplitude(code), code)
    }
}

/// Returns the amplitude of the electrode check: below the motor threshold, and never above the
/// wearer's limit.
fn check_amplitude(config: &Channel) -> Amplitude {
    config.stage.check_amplitude().min(config.limit)
}
