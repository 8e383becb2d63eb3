//! Force from pulses by a table: the calcium–force model of
//! [`calcium_force`](super::calcium_force), solved in advance over intervals of log C.
//!
//! Between pulses x = C/(K + C) depends on C alone, and log C falls at a constant rate. Over one
//! interval of log C, with t from −1/2 to 1/2 within it, eq. (3) of Lee 2020 has the solution
//!
//! ```text
//! F(t) = F(0)·H(t) + gain·P(t)      H(0) = 1, P(0) = 0      (F in A·τm)
//! ```
//!
//! H and P depend on the muscle and the interval, but neither on time nor on the gain. The table has
//! both as polynomials ([`rows`]). A pulse adds 1 to C ([`sum`]), finds F(0) from F at its time and
//! combines both; so does the end of an interval. A reading is one polynomial.
//!
//! Formats: `Qn` are 2^-n. log C counts downwards from C = 32, in intervals.

mod plan;
mod rows;
mod sum;

use fixed::types::{I16F16, U5F27};

use super::Gain;
use super::spec::CalciumForceSpec;
use crate::arithmetic::exponential::{exp2_neg, log2_neg, mul_high};
use crate::arithmetic::reciprocal::signed_high_rounded;
use crate::units::{Force, Micros, us};
pub use plan::TablePlan;
use rows::{Curve, Row};

/// Most intervals that a table has.
pub const MOST_ROWS: usize = 64;

/// Largest calcium C, 24 ([`super::CalciumForce::CALCIUM_END`]), in octaves below 32, 2^-27, and 4e-6
/// less, so that C never reads as more.
const CALCIUM_END_OCTAVES: u32 = 55_706_149;

/// C of one pulse in octaves below 32, 2^-27.
const ONE_PULSE_OCTAVES: u32 = 5 << 27;

/// Interval of a muscle without calcium.
const NOWHERE: u32 = u32::MAX;

/// Time for which a muscle at rest is left alone, µs; then its times are counted from then on. With
/// 35 min more it is below 2^31.
const REST_US: i32 = 1 << 25;

/// State of one muscle whose force is tabulated: 56 bytes, freely copied.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[repr(C)] // the fields that a tick loads are adjacent
pub struct TabulatedForceState {
    /// Time of the latest pulse or change of interval.
    base: Micros,
    /// Time from `base` to the time of the state, µs.
    since_us: i32,
    /// Time from `base` up to which `force` is valid, µs.
    until_us: i32,
    /// Position t of `base` in the interval, Q32.
    t: i32,
    /// Force F in the interval.
    force: Curve,
    /// Interval, from C = 32 downwards; [`NOWHERE`] at rest.
    interval: u32,
    /// Gain of the last pulse that reached the muscle, negated, Q30. Below the table it falls with C.
    drive: i32,
    /// Once `drive` is zero, F at the beginning of the interval, Q61; before, 0. A force that only
    /// decays would stop in the state's own format as soon as it loses less than one unit.
    decaying: u64,
}

impl TabulatedForceState {
    /// Creates a muscle without calcium or force, at time `at`.
    #[must_use]
    pub const fn at_rest(at: Micros) -> Self {
        Self {
            base: at,
            since_us: 0,
            until_us: REST_US,
            t: 0,
            force: Curve::NONE,
            interval: NOWHERE,
            drive: 0,
            decaying: 0,
        }
    }

    /// Returns whether no effect of any pulse is left: calcium and force are exactly zero.
    #[must_use]
    pub const fn is_at_rest(&self) -> bool {
        self.interval == NOWHERE
    }

    /// Returns the time up to which the state has been advanced.
    #[must_use]
    pub fn at(&self) -> Micros {
        self.base + us(self.since_us.cast_unsigned())
    }
}

/// A validated muscle with its table. Any number of [`TabulatedForceState`]s can use one.
///
/// Accuracy: for every subject of Lee's table 4 at 10–100 Hz, the largest error, read every 1 ms,
/// is below 0.002 % of the train's peak, and for every muscle that has a table below 0.005 %
/// (`firmware/tests/muscle_accuracy.rs`, `flexor chart accuracy`).
///
/// ```
/// use firmware::muscle::{CalciumForceSpec, Gain, TabulatedForce, TabulatedForceState};
/// use firmware::units::Micros;
///
/// let k01 = CalciumForceSpec {
///     a_mn_per_s: 121_900,
///     k_micro: 300_000,
///     tau_c_us: 20_800,
///     tau1_us: 33_100,
///     tau2_us: 194_400,
/// };
/// let muscle = TabulatedForce::new(&k01).expect("its table fits");
/// let mut state = TabulatedForceState::at_rest(Micros::new(0));
/// muscle.pulse(&mut state, Micros::new(250), Gain::FULL);
/// muscle.advance(&mut state, Micros::new(60_000));
/// assert!(muscle.force(&state).to_millinewton() > 1_000); // one twitch
/// ```
#[derive(Clone, Debug)]
pub struct TabulatedForce {
    plan: TablePlan,
    /// Number of rows that are solved.
    solved: u32,
    /// C at the beginning of the next row.
    calcium: f32,
    rows: [Row; MOST_ROWS],
}

impl TabulatedForce {
    /// A table without rows, for a muscle that has none.
    pub const NONE: Self = Self {
        plan: TablePlan::NONE,
        solved: 0,
        calcium: 0.0,
        rows: [Row::NONE; MOST_ROWS],
    };

    /// Solves the model for a muscle. Returns `None` for a muscle that is out of range or has no
    /// [`TablePlan`].
    #[must_use]
    pub fn new(spec: &CalciumForceSpec) -> Option<Self> {
        let plan = TablePlan::new(spec).ok()??;
        let mut table = Self::NONE;
        table.begin(Some(plan));
        while !table.solve_next() {}
        Some(table)
    }

    /// Begins the table of another muscle, or of none.
    pub fn begin(&mut self, plan: Option<TablePlan>) {
        self.plan = plan.unwrap_or(TablePlan::NONE);
        (self.solved, self.calcium) = (0, 32.0);
    }

    /// Solves one row. Returns whether the table is complete.
    ///
    /// A row takes some 4,000 cycles (`tabulated_row` of docs/charts/cycles.csv).
    pub fn solve_next(&mut self) -> bool {
        if let Some(row) = self.rows.get_mut(self.solved as usize)
            && self.solved <= self.plan.last
        {
            (*row, self.calcium) = self.plan.solve(self.solved, self.calcium);
            self.solved = self.solved.wrapping_add(1); // up to 64
        }
        self.solved > self.plan.last
    }

    /// Returns whether the row with this index is as it was solved. Rows are checked by a sum, and all
    /// that are not solved are intact.
    #[must_use]
    pub fn is_row_intact(&self, index: usize) -> bool {
        let is_solved = index < self.solved as usize;
        !is_solved || self.rows.get(index).is_none_or(Row::is_intact)
    }

    /// Changes a bit of a row, as faulty memory would.
    #[cfg(test)]
    pub(crate) fn corrupt_row(&mut self, index: usize) {
        self.rows[index].corrupt();
    }

    /// Applies a pulse at `at`: adds 1 to C at that time, and from then on drives the muscle with
    /// `gain` (eq. 6). Advances the state to `at`; an earlier pulse is applied at the state's time.
    /// A pulse with [`Gain::ZERO`] reaches no fibre and has no effect.
    #[inline]
    pub fn pulse(&self, state: &mut TabulatedForceState, at: Micros, gain: Gain) {
        if gain != Gain::ZERO {
            self.pulse_with(state, at, drive(gain.get().to_bits()));
        }
    }

    /// Applies [`Self::pulse`] with a [`drive`].
    #[inline(never)]
    pub(super) fn pulse_with(&self, state: &mut TabulatedForceState, at: Micros, drive: i32) {
        self.advance(state, at);
        let (octaves, force) = if state.interval == NOWHERE {
            (ONE_PULSE_OCTAVES, 0)
        } else {
            let t = self.t(state);
            (
                self.octaves_after_pulse(state.interval, t),
                state.force.at(t),
            )
        };
        let now = state.at();
        self.set(state, now, octaves, force, drive);
    }

    /// Returns t, Q32, of the state's time in its interval.
    #[inline(always)]
    const fn t(&self, state: &TabulatedForceState) -> i32 {
        let per_us = self.plan.per_us.cast_signed();
        // Within the interval by `until_us`, so the wrapped product is exact.
        state.t.wrapping_add(state.since_us.wrapping_mul(per_us))
    }

    /// Sets log C (octaves below 32, 2^-27), F (Q29) and the drive (Q30) at `now`.
    #[inline(always)]
    fn set(
        &self,
        state: &mut TabulatedForceState,
        now: Micros,
        octaves: u32,
        force: i32,
        drive: i32,
    ) {
        let (interval, place) = self.place_of(octaves);
        state.interval = interval;
        self.begin_at(state, now, place);
        state.drive = drive;
        state.decaying = 0;
        let Some(row) = self.row(state.interval) else {
            return;
        };
        let middle = row.force_in_middle(force, state.drive, state.t);
        state.force = row.combine(middle, state.drive);
    }

    /// Returns the interval of a C (octaves below 32, 2^-27), and the place in it, Q32.
    #[inline(always)]
    fn place_of(&self, octaves: u32) -> (u32, u32) {
        // Q56 to Q32: at most 32 · 6 intervals.
        let place = (u64::from(octaves) * u64::from(self.plan.per_octave)) >> 24;
        ((place >> 32) as u32, place as u32)
    }

    /// Counts the state's times from `now` on, at the position `place` (Q32, from 0) in its interval.
    #[inline(always)]
    fn begin_at(&self, state: &mut TabulatedForceState, now: Micros, place: u32) {
        state.base = now;
        state.since_us = 0;
        state.t = (place ^ 1 << 31).cast_signed();
        // Rounded down twice: by less than 2 µs. An interval has 2,350 µs or more, and below 70,000;
        // of a table without rows, 0.
        state.until_us = mul_high(!place, self.plan.interval_us).cast_signed();
    }

    /// Returns the row of an interval: that of the last for those below the table.
    #[inline(always)]
    fn row(&self, interval: u32) -> Option<&Row> {
        // `last` is within the table.
        self.rows.get(interval.min(self.plan.last) as usize)
    }

    /// Returns the state at `now` of a muscle with the force `share` (Q31 of A·τm), calcium in U5F27
    /// and the gain (Q31) of its last pulse.
    pub(super) fn state_of(
        &self,
        now: Micros,
        share: u32,
        calcium: u32,
        gain: u32,
    ) -> TabulatedForceState {
        let mut state = TabulatedForceState::at_rest(now);
        if share == 0 && calcium == 0 {
            return state;
        }
        // Octaves below 32, Q32 to Q27; a muscle without calcium counts as one that has 2^-26.
        let octaves = (log2_neg(calcium >> 1) >> 5) as u32;
        // Below the table the drive falls with C: up to 130 times.
        let mut drive = drive(gain);
        for _ in self.plan.last..self.place_of(octaves).0 {
            drive = self.left_of(drive);
        }
        self.set(&mut state, now, octaves, (share >> 2).cast_signed(), drive);
        state
    }

    /// Returns C after a pulse at t in an interval, in octaves below 32, 2^-27.
    #[inline(always)]
    fn octaves_after_pulse(&self, interval: u32, t: i32) -> u32 {
        if interval >> 8 != 0 {
            return ONE_PULSE_OCTAVES; // C is below 2^-42
        }
        // Q23 · Q31: at most 256 octaves in 2^-22.
        let octaves = mul_high(place(interval, t), self.plan.octaves);
        sum::octaves_of_sum(octaves).max(CALCIUM_END_OCTAVES)
    }

    /// Advances the state to `to`, which may be up to 35 min ahead; an earlier time has no effect.
    ///
    /// By the ranges of the parameters a muscle comes to rest within 7 s of the last pulse, and an
    /// interval lasts 2.4 ms or more, so no call passes more than 3,000 of them.
    #[inline(always)]
    pub fn advance(&self, state: &mut TabulatedForceState, to: Micros) {
        let since_us = (to - state.base).us();
        if since_us <= state.since_us {
            return;
        }
        state.since_us = since_us;
        if since_us > state.until_us {
            self.pass_intervals(state);
        }
    }

    /// Enters interval after interval up to that of the state's time, or until the muscle is at
    /// rest.
    #[inline(never)]
    fn pass_intervals(&self, state: &mut TabulatedForceState) {
        let now = state.at();
        let begin = (state.t ^ i32::MIN).cast_unsigned();
        let passed = u64::from(state.since_us.cast_unsigned()) * u64::from(self.plan.per_us);
        let place = u64::from(begin).wrapping_add(passed); // below 2^53
        if place >> 32 != 1 || state.interval >= self.plan.last {
            return self.pass_many(state, now, place);
        }
        // By far the most common case: one interval, within the table.
        state.interval = state.interval.wrapping_add(1); // at most `last`
        self.begin_at(state, now, place as u32);
        self.continue_from(state, state.force.at_end());
    }

    /// Computes the force in the state's interval from that at its beginning, Q29.
    #[inline(always)]
    fn continue_from(&self, state: &mut TabulatedForceState, begin: i32) {
        if let Some(row) = self.row(state.interval) {
            let middle = row.force_from_begin(begin, state.drive);
            state.force = row.combine(middle, state.drive);
        }
    }

    /// Enters as many intervals as `place` (Q32, from the present one's beginning) has.
    #[inline(never)]
    fn pass_many(&self, state: &mut TabulatedForceState, now: Micros, place: u64) {
        let mut intervals = (place >> 32) as u32;
        while intervals > 0 {
            if state.is_at_rest() || !self.enter_next(state) {
                *state = TabulatedForceState::at_rest(now);
                return;
            }
            intervals = intervals.wrapping_sub(1); // above 0
        }
        self.begin_at(state, now, place as u32);
    }

    /// Enters the next interval. Returns `false` if nothing is left of any pulse.
    #[inline(always)]
    fn enter_next(&self, state: &mut TabulatedForceState) -> bool {
        state.interval = state.interval.wrapping_add(1); // up to a few thousand
        if state.interval > self.plan.last {
            state.drive = self.left_of(state.drive);
        }
        let begin = if state.drive == 0 {
            self.decay(state)
        } else {
            state.force.at_end()
        };
        self.continue_from(state, begin);
        begin != 0 || state.drive != 0
    }

    /// Returns what is left of a drive after an interval below the table.
    #[inline(always)]
    const fn left_of(&self, drive: i32) -> i32 {
        let left = mul_high(drive.unsigned_abs(), self.plan.left);
        left.cast_signed().wrapping_neg() // at most 2^30
    }

    /// Returns F at the beginning of the next interval of a muscle without drive, rounded down, so
    /// that it reaches zero.
    #[cold]
    #[inline(never)]
    fn decay(&self, state: &mut TabulatedForceState) -> i32 {
        state.decaying = if state.decaying == 0 {
            u64::from(state.force.at_end().cast_unsigned()) << 32
        } else {
            // Below 2^61 · 2^32 >> 32.
            let upper = (state.decaying >> 32) * u64::from(self.plan.relaxed);
            let lower = u64::from(mul_high(state.decaying as u32, self.plan.relaxed));
            upper.wrapping_add(lower)
        };
        (state.decaying >> 32) as i32
    }

    /// Returns the muscle's force, 0…12,000 N, at [`TabulatedForceState::at`].
    #[must_use]
    #[inline(always)]
    pub fn force(&self, state: &TabulatedForceState) -> Force {
        // Below 1 in Q31, as F is below 24/(K + 24). Below 2^31 · 2^31, so the upper half fits.
        let share = state.force.at(self.t(state)).wrapping_shl(2);
        let newtons = signed_high_rounded(share, self.plan.full_scale.cast_signed());
        Force::new(I16F16::from_bits(newtons))
    }

    /// Returns C of eq. (2) at the state's time, 0…24; one pulse adds 1.
    #[must_use]
    pub fn calcium(&self, state: &TabulatedForceState) -> U5F27 {
        if state.interval >> 8 != 0 {
            return U5F27::ZERO; // C is below 2^-42, or at rest
        }
        // Q23 · Q31 to Q32.
        let place = u64::from(place(state.interval, self.t(state)));
        let octaves = (place * u64::from(self.plan.octaves)) >> 22;
        // 32 times Q31 in U5F27; below 32, as C is at most 24.
        U5F27::from_bits(exp2_neg(octaves).wrapping_shl(1))
    }
}

/// Returns the drive, −1…0 in Q30, of a pulse with this gain (Q31, above 0). It is negated, because
/// the compiler multiplies numbers that it knows to be positive as unsigned, in three instructions
/// instead of one.
#[inline(always)]
pub(super) fn drive(gain: u32) -> i32 {
    (gain >> 1).max(1).cast_signed().wrapping_neg() // at most 2^30
}

/// Returns the place of t (Q32) in one of the first 256 intervals: intervals below C = 32, Q23.
#[inline(always)]
const fn place(interval: u32, t: i32) -> u32 {
    interval << 23 | (t ^ i32::MIN).cast_unsigned() >> 9
}
