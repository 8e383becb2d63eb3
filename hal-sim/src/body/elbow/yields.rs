//! A wearer who pushes less while stimulation is felt.

use super::{TICK_S, TICK_US};
use std::collections::VecDeque;

/// Reaction of a wearer to felt stimulation. From `delay_s` after the first felt pulse, the wearer
/// pushes with only the share `to` of the full strength. Full strength returns `delay_s` after
/// stimulation is no longer felt. Harris' participant was asked to push "at a low force level" once
/// in contact; here felt stimulation counts as contact. All of this is assumed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct YieldSpec {
    /// Delay from a pulse to the changed push, s, 0 to 2.
    pub delay_s: f64,
    /// Share of the strength that remains, 0 to 1.
    pub to: f64,
    /// Smallest current that is felt, on either muscle, mA.
    pub at_ma: f64,
}

/// Time without a pulse after which nothing is felt any more, µs. A train of 20 Hz or more is
/// therefore felt without interruption. Assumed.
const LASTS_US: u64 = 50_000;
/// Time in which the strength changes between full and none, s, because people change a force
/// gradually. Assumed.
const CHANGE_S: f64 = 0.2;

/// State of the reaction to felt stimulation.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct YieldState {
    latest_us: Option<u64>,
    /// Whether stimulation was felt in each of the latest milliseconds, oldest first.
    before: VecDeque<bool>,
    /// Share of the strength that is given up, 0 to 1.
    given_up: f64,
}

impl YieldSpec {
    pub(super) fn is_valid(&self) -> bool {
        let in_range = (0.0..=2.0).contains(&self.delay_s) && (0.0..=1.0).contains(&self.to);
        in_range && self.at_ma.is_finite() && self.at_ma >= 0.0
    }
}

impl YieldState {
    pub(super) fn pulse(&mut self, yields: Option<YieldSpec>, t_us: u64, current_ma: f64) {
        if yields.is_some_and(|yields| current_ma >= yields.at_ma) {
            self.latest_us = Some(t_us);
        }
    }

    /// Returns the share of the strength that is left in the millisecond from `t_us` on: exactly 1
    /// for a wearer who does not yield.
    pub(super) fn strength(&mut self, yields: Option<YieldSpec>, t_us: u64) -> f64 {
        let Some(YieldSpec { delay_s, to, .. }) = yields else {
            return 1.0;
        };
        let lasts = |latest: u64| t_us.saturating_sub(latest) < LASTS_US;
        self.before.push_back(self.latest_us.is_some_and(lasts));
        let delay = (delay_s * 1e6) as u64 / TICK_US;
        let acts = self.before.len() as u64 > delay && self.before.pop_front() == Some(true);
        let step = if acts { TICK_S } else { -TICK_S } / CHANGE_S;
        self.given_up = (self.given_up + step).clamp(0.0, 1.0 - to);
        1.0 - self.given_up
    }
}
