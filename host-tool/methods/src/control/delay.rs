//! Compensation of the delay between effort and angle by a model in the loop.

use super::super::real::Real;

/// Longest delay, in periods.
const LONGEST: usize = 80;

/// Smith predictor (Smith, Chem. Eng. Prog. 53 (1957)) around two lags in series, those of muscle
/// and joint: adds to the measured angle the pending effect of the efforts of the last `delay`.
#[derive(Clone, Copy, Debug)]
pub struct SmithPredictor<R> {
    /// e^(−h/τ) of each lag.
    keeps: [R; 2],
    /// Steady-state angle per effort, rad.
    gain: R,
    delay: usize,
    lags: [R; 2],
    past: [R; LONGEST],
    next: usize,
}

impl<R: Real> SmithPredictor<R> {
    /// Creates the predictor with `gain` in rad per effort, the time constants of muscle and joint
    /// and the delay in s, and the period `h` in s. A delay beyond the memory of 80 periods is
    /// shortened.
    pub fn new(gain: R, lags_s: [R; 2], delay_s: R, h: R) -> Self {
        // The value is in 0…80, so it fits.
        let periods = (delay_s / h).to_f64() + 0.5;
        let delay = periods.clamp(0.0, (LONGEST - 1) as f64) as usize;
        Self {
            keeps: lags_s.map(|tau| (-(h / tau)).exp()),
            gain,
            delay,
            lags: [R::ZERO; 2],
            past: [R::ZERO; LONGEST],
            next: 0,
        }
    }

    /// Returns the offset to add to the angle measured now, rad.
    pub fn prediction_offset(&self) -> R {
        let then = self
            .past
            .get((self.next + LONGEST - 1 - self.delay) % LONGEST);
        let [_, now] = self.lags;
        self.gain * (now - then.copied().unwrap_or(R::ZERO))
    }

    /// Records the effort that acts until the next period, within ±1.
    pub fn record_effort(&mut self, effort: R) {
        let [keep_muscle, keep_joint] = self.keeps;
        let [muscle, joint] = &mut self.lags;
        *muscle = effort + (*muscle - effort) * keep_muscle;
        *joint = *muscle + (*joint - *muscle) * keep_joint;
        if let Some(slot) = self.past.get_mut(self.next) {
            *slot = *joint;
        }
        self.next = (self.next + 1) % LONGEST;
    }
}
