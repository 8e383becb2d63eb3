//! The plan of a table: how log C is divided for a muscle, and the equations in its rows.

use super::rows::{POINTS, Row, solve};
use crate::arithmetic::exponential::{LN_2, LOG2_E, exp2_neg, log2_neg};
use crate::muscle::CalciumForce;
use crate::muscle::spec::CalciumForceSpec;
use crate::range::OutOfRange;

/// Longest interval, in τ1·ln 2, tenths. z is then below 1.18, and H within 0.55…1.81: half of it is
/// within the range of [`inverse`], and all sums of `Row` fit their format.
const LONGEST_IN_TAU1: u32 = 17;

/// Octaves below K, in 2^-8, at which x is C/K, and below which the rows of the table are alike: the
/// least.
const LEAST_TAIL: u32 = 10 << 8;
/// Accuracy, in octaves of 2^-8, up to which the effect of τ2 must have faded at the table's end.
const FADED: i32 = 17 << 8;

/// Division of log C into intervals for one muscle, and what its rows follow from.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct TablePlan {
    /// Intervals per µs, Q32.
    pub(super) per_us: u32,
    /// Duration of an interval, µs, rounded down.
    pub(super) interval_us: u32,
    /// Octaves per interval, Q31.
    pub(super) octaves: u32,
    /// Intervals per octave, Q29.
    pub(super) per_octave: u32,
    /// Index of the last row, below [`super::MOST_ROWS`].
    pub(super) last: u32,
    /// Share of C that an interval leaves, Q32: 1/2 or more, less a few millionths.
    pub(super) left: u32,
    /// Share of F that an interval leaves without calcium, Q32.
    pub(super) relaxed: u32,
    /// Product A·τm, 2^-17 N: below 12,000 N.
    pub(super) full_scale: u32,
    /// Ratio h/τm.
    length: f32,
    /// Ratio τ1/h.
    floor: f32,
    /// Ratio τ2/h.
    span: f32,
    k: f32,
}

impl TablePlan {
    /// No plan: a table without rows.
    pub(super) const NONE: Self = Self {
        per_us: 0,
        interval_us: 0,
        octaves: 0,
        per_octave: 0,
        last: 0,
        left: 0,
        relaxed: 0,
        full_scale: 0,
        length: 0.0,
        floor: 0.0,
        span: 0.0,
        k: 0.0,
    };

    /// Divides log C for a muscle. Returns `None` for a muscle whose force the table would not have
    /// within its bound:
    ///
    /// - it would need more than [`super::MOST_ROWS`] intervals, because τ1 is much shorter than τc,
    ///   or
    /// - one pulse at full gain raises the force by less than 1/150 of A·τm, for which the
    ///   format has too few digits at small gains.
    ///
    /// [`CalciumForce`] integrates these muscles.
    ///
    /// # Errors
    /// Returns [`OutOfRange`] with the first parameter outside its range.
    pub fn new(spec: &CalciumForceSpec) -> Result<Option<Self>, OutOfRange> {
        spec.check()?;
        Ok(Self::of_checked(spec))
    }

    /// Returns the number of rows of the table.
    #[must_use]
    pub const fn row_count(&self) -> u32 {
        self.last + 1 // at most 64
    }

    /// Implements [`Self::new`].
    fn of_checked(spec: &CalciumForceSpec) -> Option<Self> {
        let tau_m_us = spec.tau1_us + spec.tau2_us;
        // One pulse raises C to 1, and F to about τc/τm·x. In units of 1/150 000 000: 10^5 · 10^9 fits.
        let rise = u64::from(spec.tau_c_us) * 150_000_000;
        if rise < u64::from(tau_m_us) * u64::from(spec.k_micro + 1_000_000) {
            return None;
        }
        // The least, 13 octaves, would need more than 64 intervals.
        if spec.tau_c_us > 10 * spec.tau1_us {
            return None;
        }
        // An octave, or less for a short τ1: 3,400…100,000 µs, times ln 2.
        let us = spec.tau_c_us.min(spec.tau1_us * LONGEST_IN_TAU1 / 10);
        let per_us = (2 * u64::from(LOG2_E) / u64::from(us)) as u32; // log2 e in Q31; below 2^21
        // h is 1/`per_us` exactly, so no error of its own accumulates: below 2^36.
        let per_tau = u64::from(per_us) * u64::from(spec.tau_c_us);
        let octaves = (((2 * u64::from(LOG2_E)) << 31) / per_tau) as u32;
        // At most 5.9; Q28 · Q32 in Q29.
        let per_octave = ((per_tau >> 4) * u64::from(LN_2)) >> 31;
        // In 2^-8: below 2^14.
        let octaves_down = u64::from(Self::octaves_down(spec));
        let last = ((octaves_down * per_octave) >> (8 + 29)) + 1;
        if last >= super::MOST_ROWS as u64 {
            return None;
        }
        let h = 4_294_967_296.0 / per_us as f32;
        Some(Self {
            per_us,
            interval_us: u32::MAX / per_us,
            octaves,
            per_octave: per_octave as u32,
            last: last as u32,
            left: exp2_neg(u64::from(octaves) << 1) << 1,
            relaxed: relaxed(per_us, spec.tau1_us),
            full_scale: CalciumForce::derive(*spec, spec.tau1_us).full_scale,
            length: h / tau_m_us as f32,
            floor: spec.tau1_us as f32 / h,
            span: spec.tau2_us as f32 / h,
            k: spec.k_micro as f32 * 1e-6,
        })
    }

    /// Returns the octaves from C = 32 to the table's last row, 2^-8.
    ///
    /// Below K/2^n the table takes C/K for x, and τ1 for τ. τ2 matters until x is below τ1/τ2; from
    /// there on F falls by R = τc/τ1 octaves while C falls by one, and so does its relative error
    /// R·x·τ2/τ1. Both together have faded after (17 + log2 R)/(1 + R) octaves.
    fn octaves_down(spec: &CalciumForceSpec) -> u32 {
        let log = |value: u32| -> i32 {
            // 31 − log2 of a value above 0, from 0 up.
            (31 << 8) - (log2_neg(value) >> 24) as i32
        };
        let to_k = (5 << 8) + log(1_000_000) - log(spec.k_micro);
        let ratio = log(spec.tau_c_us) - log(spec.tau1_us);
        let shorter = (log(spec.tau2_us) - log(spec.tau1_us)).max(0);
        // R in 2^-8: at most 50.
        let r = (spec.tau_c_us << 8) / spec.tau1_us;
        let faded = ((FADED + ratio) << 8) / (256 + r.cast_signed());
        let tail = (shorter + faded).max(LEAST_TAIL.cast_signed()) + 256;
        // K is at most 5, so all are positive.
        (to_k + tail).max(0).cast_unsigned()
    }

    /// Solves the row with this index, at whose beginning C is `calcium`. Returns it with C at its
    /// end.
    pub(super) fn solve(&self, index: u32, calcium: f32) -> (Row, f32) {
        const UNIT: f32 = 1.0 / 2_147_483_648.0;
        // Q31 · Q32; at most one octave.
        let share = |s: u64| exp2_neg((u64::from(self.octaves) * s) >> 31) as f32 * UNIT;
        let points = POINTS.map(|s| {
            let over_k = calcium * share(u64::from(s)) / self.k;
            if index == self.last {
                self.slope_and_rate(over_k, 0.0)
            } else {
                let x = over_k / (1.0 + over_k);
                self.slope_and_rate(x, x)
            }
        });
        (solve(&points), calcium * share(1 << 32))
    }

    /// Returns u for the activation x, and z for the activation `x_of_tau`.
    fn slope_and_rate(&self, x: f32, x_of_tau: f32) -> (f32, f32) {
        (self.length * x, 1.0 / (self.floor + self.span * x_of_tau))
    }
}

/// Returns the share of F that an interval leaves without calcium, e^(−h/τ1), Q32.
fn relaxed(per_us: u32, tau1_us: u32) -> u32 {
    // h/τ1 is 0.017…1.18, so the divisor is above 2^31. Q31 · Q31, below 2^32.4 · 2^31.6.
    let octaves = ((1 << 63) / (u64::from(per_us) * u64::from(tau1_us))) * u64::from(LOG2_E);
    exp2_neg(octaves >> 30) << 1
}
