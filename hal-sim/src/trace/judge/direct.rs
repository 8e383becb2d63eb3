//! Computes the net direct current of one electrode, second by second.
//!
//! The net charge is the charge that passed through the electrode within a second, between complete
//! pulses, minus the increase of the charge on its series capacitor. That increase is bounded and
//! flows back (the bias of monophasic trains and of voltage stages, hardware.md); the current
//! through the bleed resistor does not. The charge of a pulse that was truncated or lost its second
//! phase counts in full. That of an excused pulse is left out or counted, whichever gives the
//! smaller result, so that an excuse cannot make a balanced pair worse. A phase that begins within
//! the maximum gap after an excused pulse may be its rest; no second begins between them.

use std::collections::VecDeque;

const SECOND_US: u64 = 1_000_000;

/// Charge that has flowed so far, C, taken when the electrode is at rest.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Sample {
    pub t_us: u64,
    /// Charge through the electrode, C.
    pub passed: f64,
    /// Charge on the series capacitor, C, without that of truncated pulses.
    pub held: f64,
}

/// Samples of the last second.
#[derive(Clone, Debug, Default)]
pub(super) struct DirectCurrentWindow {
    samples: VecDeque<Sample>,
    /// Excused pulses of the last second: end time, µs, and charge, C.
    excused: Vec<(u64, f64)>,
    /// Net direct current of the last window, A.
    pub last: f64,
}

impl DirectCurrentWindow {
    /// Excuses the pulse of this charge, C, that ended at `t_us`.
    pub fn excuse(&mut self, t_us: u64, charge: f64) {
        self.excused.push((t_us, charge));
    }

    /// Removes the latest sample, because a phase that begins now may be the rest of the pulse that
    /// was excused at that sample.
    pub fn resume_excused(&mut self) {
        self.samples.pop_back();
    }

    /// Returns the net direct current, A, of the second before `now`, at which the electrode is at
    /// rest. `keeps` gives the share of the capacitor's charge that is left after a rest in
    /// seconds.
    pub fn net_direct_current(&mut self, now: Sample, keeps: impl Fn(f64) -> f64) -> f64 {
        let start_us = now.t_us.saturating_sub(SECOND_US);
        while self
            .samples
            .get(1)
            .is_some_and(|next| next.t_us <= start_us)
        {
            self.samples.pop_front();
        }
        // The electrode is at rest from then on, or a pulse began there, which then counts too.
        let known = self.samples.front();
        let first = known.filter(|first| first.t_us <= start_us);
        let first = first.copied().unwrap_or_default();
        let rested = (start_us - first.t_us) as f64 * 1e-6;
        self.samples.push_back(now);
        // The charge of one second is the mean current.
        let total = now.passed - first.passed - (now.held - first.held * keeps(rested));
        self.excused.retain(|excused| excused.0 > first.t_us);
        self.last = least(total, &self.excused);
        self.last
    }
}

/// Returns what remains of the charge `total` after subtraction of those excused charges, any
/// number of them, that make its magnitude smallest.
fn least(total: f64, excused: &[(u64, f64)]) -> f64 {
    let Some((&(_, charge), others)) = excused.split_first() else {
        return total;
    };
    let (left_in, taken_out) = (least(total, others), least(total - charge, others));
    if taken_out.abs() < left_in.abs() {
        taken_out
    } else {
        left_in
    }
}
