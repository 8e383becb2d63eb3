//! Net direct current of one electrode, second by second.
//!
//! What passed through the electrode within a second, between whole pulses, less
//! what its series capacitor holds more than at the start: that comes to an end
//! and comes back (the bias of monophasic trains and of voltage stages,
//! hardware.md); what the bleed passes does not. The charge of a pulse that was
//! cut or lost its second phase counts whole. That of an excused one is taken out
//! or left in, whichever leaves less: an excuse cannot make a balanced pair worse. What
//! begins within the longest gap behind it may be its rest: no second begins between them.

use std::collections::VecDeque;

const SECOND_US: u64 = 1_000_000;

/// At rest: what flowed so far, C.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Sample {
    pub t_us: u64,
    /// Through the electrode.
    pub passed: f64,
    /// On the series capacitor, but for pulses that were cut.
    pub held: f64,
}

/// The samples of the last second.
#[derive(Clone, Debug, Default)]
pub(super) struct DirectCurrentWindow {
    samples: VecDeque<Sample>,
    /// Excused pulses of the last second: when each was over, and its charge, C.
    excused: Vec<(u64, f64)>,
    /// Of the last window, A.
    pub last: f64,
}

impl DirectCurrentWindow {
    /// A fault excuses the pulse of this charge, C, that is over at `t_us`.
    pub fn excuse(&mut self, t_us: u64, charge: f64) {
        self.excused.push((t_us, charge));
    }

    /// What begins now may be the rest of the pulse that was excused at the latest sample.
    pub fn resume_excused(&mut self) {
        self.samples.pop_back();
    }

    /// Net direct current, A, of the second before `now`, at which the electrode
    /// is at rest. `keeps` tells what of the capacitor's charge is left after so
    /// many seconds of rest.
    pub fn net_direct_current(&mut self, now: Sample, keeps: impl Fn(f64) -> f64) -> f64 {
        let start_us = now.t_us.saturating_sub(SECOND_US);
        while self
            .samples
            .get(1)
            .is_some_and(|next| next.t_us <= start_us)
        {
            self.samples.pop_front();
        }
        // At rest from then on; or a pulse began there, which then counts too.
        let known = self.samples.front();
        let first = known.filter(|first| first.t_us <= start_us);
        let first = first.copied().unwrap_or_default();
        let rested = (start_us - first.t_us) as f64 * 1e-6;
        self.samples.push_back(now);
        // The charge of one second is the mean current.
        let whole = now.passed - first.passed - (now.held - first.held * keeps(rested));
        self.excused.retain(|excused| excused.0 > first.t_us);
        self.last = least(whole, &self.excused);
        self.last
    }
}

/// What is nearest to nothing of `whole` less any of these charges: a fault has one.
fn least(whole: f64, excused: &[(u64, f64)]) -> f64 {
    let Some((&(_, charge), others)) = excused.split_first() else {
        return whole;
    };
    let (left_in, taken_out) = (least(whole, others), least(whole - charge, others));
    if taken_out.abs() < left_in.abs() {
        taken_out
    } else {
        left_in
    }
}
