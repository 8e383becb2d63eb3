//! Limits on how far an amplitude may rise per burst and per second, once it has risen from zero
//! (which a ramp governs). A lower amplitude is always allowed. A wider phase counts as the
//! amplitude that has its charge at the train's own width, so that a width cannot do what an
//! amplitude may not.

use super::Guard;
use crate::safety::measures::Measures;
use crate::safety::{Channel, Denial, Stimulus, WearerSpec};
use crate::units::{Amplitude, MicroAmps, Micros, us};

const SECOND_US: u32 = 1_000_000;

/// Earlier setpoints of a channel, for the wearer's step limits. They decide only whether a
/// setpoint is accepted; the output itself is bounded by the channel's limit. So they have no
/// checksum.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Step {
    /// Stimulus that was wanted when the latest burst began; zero before the first burst of a
    /// rise.
    pub(super) burst: Stimulus,
    /// Smallest wanted measures since `since`.
    low: Measures,
    /// Smallest wanted measures in the second before `since`.
    low_before: Measures,
    /// Start of the second that `low` covers.
    since: Micros,
}

/// Returns the width of the train's own phases, µs.
const fn own_width_us(channel: &Channel) -> u16 {
    channel.train.spec().width_us
}

impl Step {
    /// Returns this state brought forward to `now`; `wanted` did not change since it was last
    /// updated.
    fn updated_to(mut self, wanted: Measures, now: Micros) -> Self {
        // A negative difference exceeds half the clock's range: it is long ago.
        let elapsed_us = (now - self.since).us().cast_unsigned();
        if elapsed_us >= 2 * SECOND_US {
            (self.low_before, self.low, self.since) = (wanted, wanted, now);
        } else if elapsed_us >= SECOND_US {
            (self.low_before, self.low) = (self.low, wanted);
            self.since += us(SECOND_US);
        }
        self
    }
}

impl Guard {
    /// Returns whether the wearer limits steps at all. Most wearers do not.
    pub(super) fn limits_steps(&self) -> bool {
        let (burst, second) = (&WearerSpec::MAX_STEP_UA, &WearerSpec::MAX_STEP_UA_PER_S);
        self.setup.as_ref().is_some_and(|setup| {
            let spec = setup.wearer.spec();
            spec.max_step_ua < burst.max.cast_unsigned()
                || spec.max_step_ua_per_s < second.max.cast_unsigned()
        })
    }

    /// Returns the largest amplitude that may be asked of `channel` at `now`, with phases of
    /// `width_us`. It exceeds the smallest amplitude wanted in the present second and in the whole
    /// second before by no more than the wearer allows per second. Thus the amplitude rises by no
    /// more than that within any second.
    #[inline(never)]
    pub(super) fn max_orderable_amplitude(
        &self,
        channel: u8,
        width_us: u16,
        now: Micros,
    ) -> Amplitude {
        let index = usize::from(channel);
        let wanted = self.wanted.get(index).copied().unwrap_or_default();
        let setup = self.setup.as_ref();
        let config = setup.and_then(|setup| setup.channel(channel));
        let (Some(setup), Some(config), Some(step)) = (setup, config, self.steps.get(index)) else {
            return Amplitude::ZERO;
        };
        let spec = setup.wearer.spec();
        if wanted.amplitude == Amplitude::ZERO || step.burst.amplitude == Amplitude::ZERO {
            return config.limit;
        }
        let own_us = own_width_us(config);
        let wanted = Measures::of(wanted, own_us);
        let step = step.updated_to(wanted, now);
        let above = |from: Amplitude, by_ua: u32| {
            let by = config.stage.amplitude_for_current(MicroAmps::new(by_ua));
            Amplitude::new(from.get().saturating_add(by.get()))
        };
        let Measures(burst) = Measures::of(step.burst, own_us);
        let Measures(low) = step.low.min(step.low_before);
        let bound = |burst, low, wanted: Amplitude| {
            let by_burst = above(burst, spec.max_step_ua);
            let by_second = above(low, spec.max_step_ua_per_s);
            by_burst.min(by_second).max(wanted)
        };
        let Measures([wanted, wanted_charge]) = wanted;
        let ([burst, burst_charge], [low, low_charge]) = (burst, low);
        let by_charge = bound(burst_charge, low_charge, wanted_charge).get();
        // A saturated value is far above every limit.
        let by_charge = by_charge.saturating_mul(own_us.into());
        let by_charge = by_charge.checked_div(width_us.into()).unwrap_or(0);
        let most = bound(burst, low, wanted).min(Amplitude::new(by_charge));
        most.min(config.limit)
    }

    /// Checks that the `listed` stimuli, the wanted stimulus, and the minimum of this second and
    /// the second before are all within one step of each other: the smaller of the wearer's two
    /// step limits.
    ///
    /// # Errors
    /// [`Denial::TooLargeStep`] with the largest allowed amplitude; [`Denial::NoChannel`].
    #[inline(never)]
    pub(super) fn check_spread(
        &self,
        channel: u8,
        listed: impl Iterator<Item = Stimulus> + Clone,
        now: Micros,
    ) -> Result<(), Denial> {
        let index = usize::from(channel);
        let wanted = self.wanted.get(index).copied().unwrap_or_default();
        let setup = self.setup.as_ref();
        let config = setup.and_then(|setup| setup.channel(channel));
        let (Some(setup), Some(config), Some(step)) = (setup, config, self.steps.get(index)) else {
            return Err(Denial::NoChannel { channel });
        };
        let (spec, own_us) = (setup.wearer.spec(), own_width_us(config));
        let now_wanted = Measures::of(wanted, own_us);
        let step = step.updated_to(now_wanted, now);
        let low = step.low.min(step.low_before).min(now_wanted);
        let listed_measures = || {
            listed
                .clone()
                .map(|stimulus| Measures::of(stimulus, own_us))
        };
        let Measures(low) = listed_measures().fold(low, Measures::min);
        let by = MicroAmps::new(spec.max_step_ua.min(spec.max_step_ua_per_s));
        let by = config.stage.amplitude_for_current(by);
        let above = |low: Amplitude| Amplitude::new(low.get().saturating_add(by.get()));
        let [most, most_charge] = low.map(above);
        let is_far = |measures: Measures| measures.0[0] > most || measures.0[1] > most_charge;
        if listed_measures().chain([now_wanted]).any(is_far) {
            let highest = most;
            return Err(Denial::TooLargeStep { channel, highest });
        }
        Ok(())
    }

    /// Records that `stimulus` is about to be wanted on `channel`.
    #[inline(never)]
    pub(super) fn note_order(&mut self, channel: u8, stimulus: Stimulus, now: Micros) {
        let index = usize::from(channel);
        let wanted = self.wanted.get(index).copied().unwrap_or_default();
        let setup = self.setup.as_ref();
        let config = setup.and_then(|setup| setup.channel(channel));
        let (Some(config), Some(step)) = (config, self.steps.get_mut(index)) else {
            return;
        };
        let own_us = own_width_us(config);
        let ordered = Measures::of(stimulus, own_us);
        if wanted.amplitude == Amplitude::ZERO || step.burst.amplitude == Amplitude::ZERO {
            *step = Step {
                burst: Stimulus::default(),
                low: ordered,
                low_before: ordered,
                since: now,
            };
        } else {
            *step = step.updated_to(Measures::of(wanted, own_us), now);
            step.low = step.low.min(ordered);
        }
    }
}
