//! Sums of a constant and decaying exponentials: their zeros, and the first time they fall below 0.

use super::symmetric::SIZE;

/// Maximum number of steps of a root search: enough to halve the bracket down to machine precision.
const STEPS: usize = 120;

/// Fraction of the scale by which a value must fall below 0 to count as having crossed it.
const FELL: f64 = 1e-13;

/// Fraction of the scale by which a rising value may start below 0 and still count as starting at
/// 0. It exceeds `FELL` because the start value comes from other sums.
const BELOW: f64 = 1e-9;

/// The function constant + Σ amplitude · exp(−rate · t), with the terms by rising rate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Exponentials {
    constant: f64,
    /// Rate (1/s) and amplitude of each term.
    terms: [(f64, f64); SIZE],
    count: usize,
}

/// Times in rising order, s, at most as many as there are terms, and their number.
type Instants = ([f64; SIZE], usize);

impl Exponentials {
    /// Creates the function from at most `SIZE` pairs of rate, 1/s and above 0, and amplitude, in
    /// any order.
    pub fn new(constant: f64, pairs: impl Iterator<Item = (f64, f64)>) -> Self {
        let mut terms = [(0.0, 0.0); SIZE];
        let mut count = 0;
        for (place, pair) in terms.iter_mut().zip(pairs) {
            *place = pair;
            count += 1;
        }
        terms[..count].sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
        Self {
            constant,
            terms,
            count,
        }
    }

    /// Returns the function multiplied by `factor`.
    pub fn scaled(mut self, factor: f64) -> Self {
        self.constant *= factor;
        self.terms.iter_mut().for_each(|term| term.1 *= factor);
        self
    }

    /// Returns the function with `more` added to its constant.
    pub fn plus(mut self, more: f64) -> Self {
        self.constant += more;
        self
    }

    fn terms(&self) -> &[(f64, f64)] {
        &self.terms[..self.count]
    }

    /// Returns the value at `t_s` after the start.
    pub fn at(&self, t_s: f64) -> f64 {
        let term = |(rate, amplitude): &(f64, f64)| amplitude * libm::exp(-rate * t_s);
        self.constant + self.terms().iter().map(term).sum::<f64>()
    }

    fn slope(&self, t_s: f64) -> f64 {
        let term = |(rate, amplitude): &(f64, f64)| -rate * amplitude * libm::exp(-rate * t_s);
        self.terms().iter().map(term).sum()
    }

    /// Returns the first time in [0, `end_s`] at which the value crosses 0 and falls. The result is
    /// 0 if the value starts below 0, or so near 0 that rounding decides its sign, and falls.
    /// `scale` is the magnitude of the numbers whose difference the value is.
    pub fn first_falling_zero(&self, end_s: f64, scale: f64) -> Option<f64> {
        if self.lower_bound(end_s) >= -FELL * scale {
            return None;
        }
        let (mut left, mut before) = (0.0, self.at(0.0));
        if before < -BELOW * scale {
            return Some(0.0);
        }
        let (turns, count) = self.derivative().zeros(end_s);
        for right in turns[..count].iter().copied().chain([end_s]) {
            let after = self.at(right);
            if after < -FELL * scale && after < before {
                let is_through = before <= 0.0;
                return Some(if is_through {
                    left
                } else {
                    self.zero(left, right)
                });
            }
            (left, before) = (right, after);
        }
        None
    }

    /// Returns an inexpensive lower bound of the value within [0, `end_s`].
    fn lower_bound(&self, end_s: f64) -> f64 {
        let least = |(rate, amplitude): &(f64, f64)| {
            let is_falling = *amplitude > 0.0;
            amplitude
                * if is_falling {
                    libm::exp(-rate * end_s)
                } else {
                    1.0
                }
        };
        self.constant + self.terms().iter().map(least).sum::<f64>()
    }

    /// Returns the derivative times exp(slowest rate · t), which has the same zeros and one term
    /// less.
    fn derivative(&self) -> Self {
        let Some((slowest, first)) = self.terms().first() else {
            return Self::new(0.0, [].into_iter());
        };
        let rest = self.terms()[1..].iter();
        let rest = rest.map(|(rate, amplitude)| (rate - slowest, -rate * amplitude));
        Self::new(-slowest * first, rest)
    }

    /// Returns all zeros within (0, `end_s`) at which the sign changes. The zeros of the
    /// derivative, which has fewer terms, are computed first: between two of them lies at most one
    /// zero of the function.
    fn zeros(&self, end_s: f64) -> Instants {
        let mut found = ([0.0; SIZE], 0);
        if !self.may_change_sign() {
            return found;
        }
        let (turns, count) = self.derivative().zeros(end_s);
        let (mut left, mut before) = (0.0, self.at(0.0));
        for right in turns[..count].iter().copied().chain([end_s]) {
            let after = self.at(right);
            if before * after < 0.0 {
                found.0[found.1] = self.zero(left, right);
                found.1 += 1;
            }
            (left, before) = (right, after);
        }
        found
    }

    /// Returns whether the sign may change, by Descartes' rule of signs, which holds for
    /// exponentials by rising rate.
    fn may_change_sign(&self) -> bool {
        let amplitudes = || self.terms().iter().map(|term| term.1);
        let is_always = |is: fn(f64) -> bool| is(self.constant) && amplitudes().all(is);
        !(is_always(|value| value >= 0.0) || is_always(|value| value <= 0.0))
    }

    /// Returns the zero between `left` and `right`, where the signs differ: Newton's method, with
    /// bisection where a step would leave the bracket.
    fn zero(&self, mut left: f64, mut right: f64) -> f64 {
        let is_rising = self.at(left) < 0.0;
        let mut t_s = 0.5 * (left + right);
        for _ in 0..STEPS {
            let value = self.at(t_s);
            if value == 0.0 {
                break;
            }
            *(if (value < 0.0) == is_rising {
                &mut left
            } else {
                &mut right
            }) = t_s;
            let newton = t_s - value / self.slope(t_s);
            let is_inside = newton > left && newton < right;
            let next = if is_inside {
                newton
            } else {
                0.5 * (left + right)
            };
            if (next - t_s).abs() <= 2.0 * f64::EPSILON * t_s {
                return next;
            }
            t_s = next;
        }
        t_s
    }
}
