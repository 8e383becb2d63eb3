//! How far an amplitude may rise from what it was: per burst and per second, once it
//! has risen from zero, which a ramp governs. Lower is always allowed.

use super::Guard;
use crate::pulse::CHANNELS;
use crate::safety::WearerSpec;
use crate::units::{Amplitude, MicroAmps, Micros, us};

const SECOND_US: u32 = 1_000_000;

/// What a channel was ordered before. It decides only whether an order is taken, never
/// what is put out, which the channel's limit holds: it is not sealed.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Step {
    /// Wanted when the latest burst began; zero before the first of a rise.
    pub(super) burst: Amplitude,
    /// The least wanted since `since`, and in the second before that.
    low: Amplitude,
    low_before: Amplitude,
    since: Micros,
}

impl Step {
    /// The same when `now` has come, with `wanted` all the time.
    fn at(mut self, wanted: Amplitude, now: Micros) -> Self {
        // Backwards is beyond half the clock: long ago.
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
    /// Whether the wearer limits steps at all. Most do not.
    pub(super) fn limits_steps(&self) -> bool {
        let (burst, second) = (&WearerSpec::MAX_STEP_UA, &WearerSpec::MAX_STEP_UA_PER_S);
        self.setup.as_ref().is_some_and(|setup| {
            let spec = setup.wearer.spec();
            spec.max_step_ua < burst.max.cast_unsigned()
                || spec.max_step_ua_per_s < second.max.cast_unsigned()
        })
    }

    /// The largest amplitude that `channel` may be ordered at `now`. In no second it
    /// rises by more than the wearer allows for one: what is looked back on is the
    /// present second and the whole one before it.
    #[inline(never)]
    pub(super) fn highest(&self, channel: u8, now: Micros) -> Amplitude {
        let index = usize::from(channel);
        let wanted = self.wanted.get(index).copied().unwrap_or_default();
        let setup = self.setup.as_ref();
        let config = setup.and_then(|setup| setup.channel(channel));
        let (Some(setup), Some(config), Some(step)) = (setup, config, self.steps.get(index)) else {
            return Amplitude::ZERO;
        };
        let spec = setup.wearer.spec();
        if wanted == Amplitude::ZERO || step.burst == Amplitude::ZERO {
            return config.limit;
        }
        let step = step.at(wanted, now);
        let above = |from: Amplitude, by_ua: u32| {
            let by = config.stage.amplitude_of(MicroAmps::new(by_ua));
            Amplitude::new(from.get().saturating_add(by.get()))
        };
        let by_burst = above(step.burst, spec.max_step_ua);
        let by_second = above(step.low.min(step.low_before), spec.max_step_ua_per_s);
        by_burst.min(by_second).max(wanted).min(config.limit)
    }

    /// `amplitude` is about to be wanted on `channel`.
    #[inline(never)]
    pub(super) fn note_order(&mut self, channel: u8, amplitude: Amplitude, now: Micros) {
        let index = usize::from(channel);
        let wanted = self.wanted.get(index).copied().unwrap_or_default();
        let Some(step) = self.steps.get_mut(index) else {
            return;
        };
        if wanted == Amplitude::ZERO || step.burst == Amplitude::ZERO {
            *step = Step {
                burst: Amplitude::ZERO,
                low: amplitude,
                low_before: amplitude,
                since: now,
            };
        } else {
            *step = step.at(wanted, now);
            step.low = step.low.min(amplitude);
        }
    }

    pub(super) const NO_STEPS: [Step; CHANNELS] = [Step {
        burst: Amplitude::ZERO,
        low: Amplitude::ZERO,
        low_before: Amplitude::ZERO,
        since: Micros::new(0),
    }; CHANNELS];
}
