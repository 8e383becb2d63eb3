//! A muscle in the formats of [`super::device_formats`] behind the trait of this module: with steps
//! planned from each pulse on and read through cubics, or with steps from event to event.

use super::Integrator;
use super::device_formats::{Coefficients, NativeMuscle, NativeRule, ONE_PULSE, StepFactors, high};
use firmware::muscle::CalciumForceSpec;
use firmware::units::{Micros, us};

/// Converts a force from Q31 of A·τm to newtons.
#[derive(Clone, Copy, Debug)]
struct Answer {
    /// Force A·τm in units of 2^-`fraction` N, with the top bit set.
    scale: u32,
    fraction: u32,
}

impl Answer {
    fn new(spec: &CalciumForceSpec) -> Self {
        let tau_m_us = u64::from(spec.tau1_us) + u64::from(spec.tau2_us);
        // A·τm in nN is below 2^44.
        let nanonewtons = u64::from(spec.a_mn_per_s).saturating_mul(tau_m_us).max(1);
        let shift = nanonewtons.leading_zeros();
        let scaled = (nanonewtons << shift) as f64 * 1e-9;
        // A·τm = scaled·2^-shift N; its word has 32 bits.
        let mut fraction = shift;
        let mut word = scaled;
        while word >= 4_294_967_295.0 {
            word *= 0.5;
            fraction = fraction.wrapping_sub(1);
        }
        Self {
            scale: word as u32,
            fraction,
        }
    }
    #[inline(always)]
    fn bits(&self, force: i32) -> u32 {
        high(force.cast_unsigned() << 1, self.scale)
    }
    fn newtons(&self, force: i32) -> f64 {
        let mut value = f64::from(self.bits(force));
        for _ in 0..self.fraction {
            value *= 0.5;
        }
        value
    }
}

/// A muscle with the step that is planned from the latest pulse, or from the end of the previous
/// step; readings come from its cubic.
#[derive(Clone, Copy, Debug)]
struct NativeCurve<M> {
    muscle: NativeMuscle<M>,
    answer: Answer,
    whole: StepFactors,
    step_us: u32,
    /// Ratio 1 µs/h, Q31.
    per_us: u32,
    /// C at the beginning of the step, U5F27.
    c: u32,
    /// Force over the step, in powers of the part of it that is over: F in Q31, then Q29.
    cubic: [i32; 4],
    from: Micros,
    /// C and F at the end of the step, with the coefficients there.
    end: (u32, i32, Coefficients),
    now: Micros,
}

/// Returns the upper word of twice a product: for a Q31 factor, the format stays that of the other.
#[inline(always)]
const fn twice_high(a: i32, b: i32) -> i32 {
    (((a as i64 * b as i64) >> 32) as i32) << 1
}

impl<M: NativeRule> NativeCurve<M> {
    fn new(spec: &CalciumForceSpec, step_us: u32) -> Self {
        let muscle = NativeMuscle::new(spec);
        Self {
            whole: muscle.factors(step_us),
            answer: Answer::new(spec),
            step_us,
            per_us: 0x7FFF_FFFF / step_us.max(1),
            c: 0,
            cubic: [0; 4],
            from: Micros::new(0),
            end: (0, 0, muscle.coefficients(0)),
            now: Micros::new(0),
            muscle,
        }
    }

    #[inline(always)]
    fn plan(&mut self) {
        let (c, f, here) = self.end;
        self.c = c;
        self.end = self.muscle.step(&self.whole, &here, c, f);
        let (_, f1, there) = &self.end;
        let begin = NativeMuscle::<M>::scaled(&self.whole, &here);
        let end = NativeMuscle::<M>::scaled(&self.whole, there);
        let (g0, g1) = (begin.slope(f) >> 1, end.slope(*f1) >> 1); // Q29
        let rise = f1.wrapping_sub(f) >> 2;
        let bend = rise.wrapping_sub(g0);
        let turn = g1.wrapping_sub(rise).wrapping_sub(bend);
        self.cubic = [f, g0, bend.wrapping_sub(turn), turn];
    }

    #[inline(always)]
    fn force(&self) -> i32 {
        // The part is below 1, as the ratio is rounded down.
        let part = self.now.elapsed_since(self.from).wrapping_mul(self.per_us) as i32;
        let [a0, a1, a2, a3] = self.cubic;
        let rest = a2.wrapping_add(twice_high(a3, part));
        let rest = a1.wrapping_add(twice_high(rest, part));
        let force = a0.wrapping_add(twice_high(rest, part) << 2);
        force & !(force >> 31)
    }

    fn calcium_word(&self) -> u32 {
        let left = self.muscle.decay_in(self.now.elapsed_since(self.from));
        high(self.c, left) << 1
    }

    #[inline(never)]
    fn plan_until(&mut self, to: Micros) {
        while to.elapsed_since(self.from) > self.step_us {
            self.from += us(self.step_us);
            self.plan();
        }
    }
}

impl<M: NativeRule> Integrator for NativeCurve<M> {
    #[inline(never)]
    fn pulse(&mut self, at: Micros) {
        self.advance(at);
        let c = self.calcium_word().wrapping_add(ONE_PULSE);
        self.end = (c, self.force(), self.muscle.coefficients(c));
        self.from = at;
        self.plan();
    }
    fn advance(&mut self, to: Micros) {
        if to.elapsed_since(self.from) > self.step_us {
            self.plan_until(to);
        }
        self.now = to;
    }
    fn calcium(&self) -> f64 {
        f64::from(self.calcium_word()) / f64::from(ONE_PULSE)
    }
    fn force_n(&self) -> f64 {
        self.answer.newtons(self.force())
    }
    fn force_bits(&self) -> u32 {
        self.answer.bits(self.force())
    }
}

/// A muscle whose steps end at pulses and readings.
#[derive(Clone, Copy, Debug)]
struct NativeEvents<M> {
    muscle: NativeMuscle<M>,
    answer: Answer,
    longest_us: u32,
    longest: StepFactors,
    /// Length of the latest shorter step, µs, and its constants.
    part: (u32, StepFactors),
    state: (u32, i32, Coefficients),
    at: Micros,
}

impl<M: NativeRule> NativeEvents<M> {
    fn new(spec: &CalciumForceSpec, longest_us: u32) -> Self {
        let muscle = NativeMuscle::new(spec);
        let longest = muscle.factors(longest_us);
        Self {
            answer: Answer::new(spec),
            longest_us,
            longest,
            part: (longest_us, longest),
            state: (0, 0, muscle.coefficients(0)),
            at: Micros::new(0),
            muscle,
        }
    }

    #[inline(always)]
    fn step(&mut self, step: &StepFactors) {
        let (c, f, here) = self.state;
        self.state = self.muscle.step(step, &here, c, f);
    }
}

impl<M: NativeRule> Integrator for NativeEvents<M> {
    fn pulse(&mut self, at: Micros) {
        self.advance(at);
        let (c, f, _) = self.state;
        let c = c.wrapping_add(ONE_PULSE);
        self.state = (c, f, self.muscle.coefficients(c));
    }
    #[inline(never)]
    fn advance(&mut self, to: Micros) {
        let mut left_us = to.elapsed_since(self.at);
        self.at = to;
        while left_us >= self.longest_us {
            let longest = self.longest;
            self.step(&longest);
            left_us = left_us.wrapping_sub(self.longest_us);
        }
        if left_us == 0 {
            return;
        }
        if left_us != self.part.0 {
            self.part = (left_us, self.muscle.factors(left_us));
        }
        let part = self.part.1;
        self.step(&part);
    }
    fn calcium(&self) -> f64 {
        f64::from(self.state.0) / f64::from(ONE_PULSE)
    }
    fn force_n(&self) -> f64 {
        self.answer.newtons(self.state.1)
    }
    fn force_bits(&self) -> u32 {
        self.answer.bits(self.state.1)
    }
}

/// Calls `then` with a muscle that plans steps of `step_us`, or of what the formats allow for it.
#[inline(never)]
pub(super) fn with_planned<M: NativeRule, T>(
    spec: &CalciumForceSpec,
    step_us: u32,
    then: impl FnOnce(&mut dyn Integrator) -> T,
) -> T {
    let step_us = step_us.min(NativeMuscle::<M>::longest_us(spec));
    then(&mut NativeCurve::<M>::new(spec, step_us))
}

/// Calls `then` with a muscle whose steps go from event to event and last at most `longest_us`, or
/// what the formats allow for it.
#[inline(never)]
pub(super) fn with_events<M: NativeRule, T>(
    spec: &CalciumForceSpec,
    longest_us: u32,
    then: impl FnOnce(&mut dyn Integrator) -> T,
) -> T {
    let longest_us = longest_us.min(NativeMuscle::<M>::longest_us(spec));
    then(&mut NativeEvents::<M>::new(spec, longest_us))
}
