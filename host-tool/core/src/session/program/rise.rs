//! Computes the order with which a burst has the amplitude that a program wants, although the
//! device limits the rise (docs/protocol.md, "Rise").

use firmware::device::validate_channel;
use firmware::safety::{Stage, Stimulus};
use firmware::units::{Amplitude, DacCode};

use super::super::channel::Channel;
use super::super::setup::SetupSpec;

/// Limits on how fast a channel's amplitude may rise in the device.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Rise {
    /// Period of the channel's train, µs.
    pub(super) period_us: u64,
    /// Time of the channel's first burst, µs after the start of the trains.
    offset_us: u64,
    rise_us: u64,
    rise_bursts: u64,
    /// Largest increase of the amplitude from one burst to the next, thousandths of the channel's
    /// unit.
    slope: f64,
    /// Largest amplitude that the device outputs at once, without a rise, thousandths of the
    /// channel's unit.
    start: f64,
    /// Pulse width of the channel's train, µs.
    own_us: f64,
    /// Smallest amplitude whose DAC code is not 0, thousandths of the channel's unit.
    least: u32,
}

impl Rise {
    /// Returns the limits on the rise of a channel, or `None` if the device would refuse to arm the
    /// channel.
    pub(super) fn from_channel(channel: &Channel, setup: &SetupSpec) -> Option<Self> {
        let wearer = setup.wearer.validate().ok()?;
        let armed = validate_channel(&channel.spec, channel.force.as_ref(), &wearer).ok()?;
        let train = &channel.spec.train;
        let (rise_us, rise_bursts) = wearer.rise();
        Some(Self {
            period_us: train.period_us.into(),
            offset_us: train.offset_us.into(),
            rise_us: rise_us.into(),
            rise_bursts: rise_bursts.into(),
            slope: armed.slope(&wearer).get().into(),
            start: armed.start.get().into(),
            own_us: train.width_us.into(),
            least: smallest_amplitude(armed.stage),
        })
    }

    /// Returns the time of the channel's first burst at or after `t_us`, µs after the start of the
    /// trains.
    pub(super) fn next_burst_us(&self, t_us: u64) -> u64 {
        let periods = t_us.saturating_sub(self.offset_us).div_ceil(self.period_us);
        self.offset_us + periods * self.period_us
    }

    /// Returns the shortest duration of a rise from 0 to full amplitude, µs: the larger of
    /// `rise_ms` and `rise_bursts` periods.
    pub(super) fn duration_us(&self) -> u64 {
        self.rise_us.max(self.rise_bursts * self.period_us)
    }

    /// Returns the setpoint, in thousandths of the unit, with which a burst has the amplitude
    /// `amplitude` (thousandths). The burst comes `since_us` after the first burst of its rise.
    ///
    /// During a rise the device outputs a share of the setpoint. For burst k (from 1) at time t,
    /// with the period T, the share is min(k / (`rise_bursts` + 1), (t + T) / (`rise_ms` + T)). A
    /// setpoint of at most `start` is output at once. The burst then differs from `amplitude` by at
    /// most a thousandth or a step of the DAC.
    pub(super) fn order_amplitude(&self, amplitude: f64, width_us: u16, since_us: u64) -> u32 {
        if amplitude <= 0.0 {
            return 0;
        }
        let order = match self.reached_share(since_us) {
            part if part < 1.0 && amplitude > self.immediate_amplitude(width_us) => {
                (amplitude / part - EXACT).ceil()
            }
            _ => (amplitude + EXACT).floor(),
        };
        // An order of less than a step of the DAC would end the rise.
        (order as u32).max(self.least)
    }

    /// Returns the share of the setpoint that the device outputs `since_us` after the first burst
    /// of a rise; 1 when the rise is complete.
    fn reached_share(&self, since_us: u64) -> f64 {
        let part = |part: u64, total: u64| (part + 1) as f64 / (total + 1) as f64;
        let period = self.period_us as f64;
        let played = (since_us / self.period_us).min(self.rise_bursts);
        let elapsed_us = since_us.min(self.rise_us) as f64;
        let by_time = (elapsed_us + period) / (self.rise_us as f64 + period);
        by_time.min(part(played, self.rise_bursts))
    }

    /// Returns the largest amplitude that the device outputs at once at this pulse width,
    /// thousandths of the channel's unit. It is lower at a width above the train's own, because the
    /// charge counts.
    fn immediate_amplitude(&self, width_us: u16) -> f64 {
        let by_charge = (self.start * self.own_us / f64::from(width_us.max(1))).floor();
        self.start.min(by_charge)
    }

    /// Returns whether the device outputs `stimulus` at once, without a rise.
    pub(super) fn is_immediate(&self, stimulus: Stimulus) -> bool {
        f64::from(stimulus.amplitude.get()) <= self.immediate_amplitude(stimulus.width_us)
    }

    /// Returns the shortest duration of a linear change between two stimuli, µs, or `None` if no
    /// time is long enough. A rise from 0 takes at least as long as the wearer's rise, even if
    /// `start` would allow less. No burst may exceed the one before by more than the device allows.
    pub(super) fn shortest_us(&self, from: Stimulus, to: Stimulus) -> Option<u64> {
        let is_lower = to.amplitude <= from.amplitude && to.width_us <= from.width_us;
        let is_rise = from.amplitude == Amplitude::ZERO;
        if to.amplitude == Amplitude::ZERO || is_lower || (self.is_immediate(to) && !is_rise) {
            return Some(0);
        }
        let number = |stimulus: Stimulus| {
            (
                f64::from(stimulus.amplitude.get()),
                f64::from(stimulus.width_us),
            )
        };
        let ((a, w), (b, v)) = (number(from), number(to));
        let period = self.period_us as f64;
        let by_amplitude = (b - a).max(0.0) * period / self.slope;
        // The first burst of a rise already has a share of the amplitude.
        let (least_us, by_amplitude) = match is_rise {
            true => (self.duration_us() as f64, by_amplitude - period),
            false => (0.0, by_amplitude),
        };
        let is_own = w == self.own_us && v == self.own_us;
        let by_charge = match is_own {
            true => 0.0,
            false => {
                let steepest = |at: f64, wide: f64| ((b - a) * wide + at * (v - w)) / self.own_us;
                let steepest = steepest(a, w).max(steepest(b, v)).max(0.0);
                // Rounding to whole thousandths and microseconds takes a part of the slope.
                let by_width = if v == w { 0.0 } else { a.max(b) / self.own_us };
                let left = self.slope - 1.0 - w.max(v) / self.own_us - by_width;
                if left <= 0.0 {
                    return None;
                }
                steepest * period / left
            }
        };
        let shortest_us = least_us.max(by_amplitude).max(by_charge);
        Some((shortest_us - EXACT).ceil() as u64) // not negative
    }
}

/// Tolerance for rounding: a value that should be a whole number may differ from it by this much
/// after computation in floating point.
const EXACT: f64 = 1e-6;

/// Returns the smallest amplitude of this output stage whose DAC code is not 0, in thousandths.
fn smallest_amplitude(stage: Stage) -> u32 {
    let near = stage.amplitude(DacCode::new(1)).get();
    let amplitudes = near..=near + 2;
    let has_code = |value: &u32| stage.code(Amplitude::new(*value)) > DacCode::new(0);
    amplitudes.into_iter().find(has_code).unwrap_or(near).max(1)
}
