//! Compensation of the delay between effort and angle by a model in the loop.

use super::super::real::Real;

/// Number of past control periods that the predictor stores; the longest delay is one period less.
const LONGEST: usize = 80;

/// Smith predictor (Smith, Chem. Eng. Prog. 53 (1957)). Its model is two first-order lags in
/// series, those of muscle and joint, followed by a delay. It predicts how much the efforts of the
/// last `delay` periods will still change the angle, and this change is added to the measured
/// angle.
#[derive(Clone, Copy, Debug)]
pub struct SmithPredictor<R> {
    /// Factor e^(−h/τ) by which each lag decays in one period: muscle, then joint.
    keeps: [R; 2],
    /// Angle per effort in steady state, rad.
    gain: R,
    delay: usize,
    lags: [R; 2],
    past: [R; LONGEST],
    next: usize,
}

impl<R: Real> SmithPredictor<R> {
    /// Creates a predictor. `gain` is the steady-state angle per effort, rad; `lags_s` are the time
    /// constants of muscle and joint, s; `delay_s` is the delay, s; and `h` is the control period,
    /// s. A delay of more than 79 periods is shortened to 79.
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

    /// Returns the predicted change of the angle due to efforts that have not acted yet, rad, to be
    /// added to the measured angle.
    pub fn prediction_offset(&self) -> R {
        let then = self
            .past
            .get((self.next + LONGEST - 1 - self.delay) % LONGEST);
        let [_, now] = self.lags;
        self.gain * (now - then.copied().unwrap_or(R::ZERO))
    }

    /// Advances the model by one period with the effort that acts until the next period, −1 to 1.
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
