//! A correct trace of one channel, and functions that damage it.

use super::second::judge_both;
use hal_sim::trace::judge::{Channel, Pump, Rule, Stage, Truth, Verdict, judge};
use hal_sim::trace::{Levels, State, Trace};

pub use State::{Anodic, Cathodic, Grounded};

/// DAC code of 12 mA on a stage of 100 mA.
pub const CODE: u16 = 7_864;

/// Start, end, and state between them.
pub type StateInterval = (u64, u64, State);

/// Trace of one channel under construction; disconnected outside the intervals.
pub struct Scene {
    pub stretches: Vec<StateInterval>,
    pub code: u16,
    pub truth: Truth,
    pub pump: Pump,
    pub end_us: u64,
}

impl Scene {
    /// Returns 12 mA into 2 kΩ with `pulses` at 50 Hz, each made of the intervals in `pulse`; 15 mA
    /// and 50 pulses per second are allowed.
    pub fn with_pulses(pulses: u64, pulse: &[StateInterval]) -> Self {
        let starts = (0..pulses).map(|n| 10_000 + n * 20_000);
        let at = |t: u64| {
            pulse
                .iter()
                .map(move |&(a, b, state)| (t + a, t + b, state))
        };
        let mut truth = Truth::default();
        let stage = Stage::Current {
            full_scale_ma: 100.0,
        };
        truth.channels[0] = Channel::steady(stage, 2_000.0, 15.0, 50);
        Self {
            stretches: starts.flat_map(at).collect(),
            code: CODE,
            truth,
            pump: Pump::Throughout,
            end_us: 20_000 + pulses * 20_000,
        }
    }

    pub fn biphasic(pulses: u64, width_us: u64) -> Self {
        Self::with_pulses(pulses, &biphasic(width_us))
    }

    pub fn trace(&self) -> Trace {
        let mut trace = Trace::default();
        trace.record_dac(0, 0, self.code);
        let mut stretches = self.stretches.iter().peekable();
        while let Some(&(start, end, state)) = stretches.next() {
            trace.record_levels(start, Levels::ISOLATED.with_channel(0, state));
            if stretches.peek().is_none_or(|next| next.0 > end) {
                trace.record_levels(end, Levels::ISOLATED);
            }
        }
        trace
    }

    /// Returns the verdict, on which both judges must agree.
    pub fn verdict(&self) -> Verdict {
        judge_both(&self.trace(), &self.pump, &self.truth, self.end_us)
    }

    /// Returns the verdict of `hal_sim`'s judge alone, for thousands of cases or for a logic that
    /// only it knows.
    pub fn judged_once(&self) -> Verdict {
        judge(&self.trace(), &self.pump, &self.truth, self.end_us)
    }

    /// Returns the rules broken by the board as built, and by bare stages that only follow their
    /// lines.
    pub fn rules(&self) -> [Vec<Rule>; 2] {
        let verdict = self.verdict();
        [verdict.as_built, verdict.bare].map(|account| {
            let mut rules: Vec<_> = account.findings.iter().map(|f| f.rule).collect();
            rules.sort_unstable();
            rules
        })
    }
}

pub const fn biphasic(width_us: u64) -> [StateInterval; 2] {
    let second = width_us + 5;
    [(0, width_us, Cathodic), (second, second + width_us, Anodic)]
}

pub const fn monophasic(width_us: u64, ground_us: u64) -> [StateInterval; 2] {
    let grounded = (width_us, width_us + ground_us, Grounded);
    [(0, width_us, Cathodic), grounded]
}
