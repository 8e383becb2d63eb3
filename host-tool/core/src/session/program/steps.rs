//! Checks the orders of a program against a wearer who limits steps (refusal 237).

use firmware::safety::{Stimulus, WearerSpec};
use firmware::units::{Amplitude, MicroAmps};

use super::super::channel::Channel;
use super::super::setup::SetupSpec;
use super::rise::Rise;
use crate::fields::error::Problem;
use crate::fields::table::Table;

/// Largest steps between two setpoints above 0 that a wearer allows on a channel. All amplitudes
/// are in thousandths of the channel's unit.
#[derive(Clone, Copy, Debug)]
pub(super) struct Steps {
    burst: f64,
    second: f64,
    /// Size of the largest setpoint of the program, as [`Self::order_size`] computes it.
    peak: f64,
    period_us: f64,
    own_us: f64,
}

/// Time over which the device adds up steps, µs: the present second and the one before it.
const LOOKED_BACK_US: f64 = 2e6;

/// Amount that rounding may add to a step from burst to burst, thousandths of the unit.
const ROUNDING: f64 = 2.0;

impl Steps {
    /// Returns the largest steps that the wearer allows on the channel, or `None` if the wearer
    /// does not limit steps. `stimuli` are all stimuli of the program.
    pub(super) fn from_channel(
        found: &Channel,
        setup: &SetupSpec,
        stimuli: impl Iterator<Item = Stimulus>,
    ) -> Option<Self> {
        let wearer = &setup.wearer;
        let [burst, second] = [WearerSpec::MAX_STEP_UA, WearerSpec::MAX_STEP_UA_PER_S]
            .map(|range| range.max.cast_unsigned());
        if wearer.max_step_ua >= burst && wearer.max_step_ua_per_s >= second {
            return None;
        }
        let stage = found.spec.stage.validate().ok()?;
        let amplitude = |ua: u32| f64::from(stage.amplitude_for_current(MicroAmps::new(ua)).get());
        let mut steps = Self {
            burst: amplitude(wearer.max_step_ua),
            second: amplitude(wearer.max_step_ua_per_s),
            peak: 0.0,
            period_us: found.spec.train.period_us.into(),
            own_us: found.spec.train.width_us.into(),
        };
        steps.peak = stimuli
            .map(|stimulus| steps.order_size(stimulus))
            .fold(0.0, f64::max);
        Some(steps)
    }

    /// Returns the shortest duration of a linear change between two stimuli that respects the
    /// wearer's limits on steps, µs.
    pub(super) fn shortest_us(&self, from: Stimulus, to: Stimulus) -> u64 {
        let by = (self.order_size(to) - self.order_size(from)).max(0.0);
        let by_burst = by * self.period_us / (self.burst - ROUNDING).max(1.0);
        let by_second = match self.peak <= self.second {
            true => 0.0,
            false => by * LOOKED_BACK_US / self.second.max(1.0),
        };
        by_burst.max(by_second).ceil() as u64
    }

    /// Reports a change at once between two setpoints if the second exceeds the first by more than
    /// the wearer allows. A change from 0 or to 0 is always allowed.
    pub(super) fn check(
        &self,
        (t, field): (&Table<'_>, &str),
        found: &Channel,
        from: Stimulus,
        to: Stimulus,
    ) {
        let most = self.burst.min(self.second);
        let is_free = [from, to]
            .iter()
            .any(|stimulus| stimulus.amplitude == Amplitude::ZERO);
        if !is_free && self.order_size(to) - self.order_size(from) > most {
            let [from, to] = [from, to].map(|stimulus| found.format_amplitude(stimulus.amplitude));
            let (channel, most) = (
                found.number,
                found.format_amplitude(Amplitude::new(most as u32)),
            );
            let problem = Problem::StepTooLarge {
                channel,
                from,
                to,
                most,
            };
            t.report(field, problem);
        }
    }

    /// Reports a ramp up from 0 that takes `up_us` if it contains a step larger than the wearer
    /// allows. Such a step arises at `start`: up to there the setpoint equals the wanted amplitude,
    /// and above it the setpoint jumps to the value with which the device's own rise gives the
    /// wanted amplitude.
    pub(super) fn check_start(
        &self,
        at: (&Table<'_>, &str),
        found: &Channel,
        rise: &Rise,
        to: Stimulus,
        up_us: u64,
    ) {
        let start = Stimulus {
            amplitude: found.spec.start,
            ..to
        };
        let part = (rise.duration_us() as f64 + self.period_us) / (up_us as f64 + self.period_us);
        let order = f64::from(to.amplitude.get()) * part.min(1.0);
        let first = Stimulus {
            amplitude: Amplitude::new(order as u32),
            ..to
        };
        if !rise.is_immediate(to) {
            self.check(at, found, start, first);
        }
    }

    /// Returns the size of a setpoint for the limits on steps: its amplitude or, at a width above
    /// the train's own, the amplitude that has the same charge at the train's own width.
    fn order_size(&self, stimulus: Stimulus) -> f64 {
        let wider = f64::from(stimulus.width_us) / self.own_us.max(1.0);
        f64::from(stimulus.amplitude.get()) * wider.max(1.0)
    }
}
