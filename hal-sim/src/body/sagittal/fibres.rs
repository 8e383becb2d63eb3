//! Muscle fibres under a pair of electrodes.

use super::spec::{Electrode, SagittalSpec};
use crate::body::muscle::{Muscle, Step};
use crate::body::wearer::{effective_voltage, recruitment};
use std::collections::VecDeque;

/// Time step, µs; split at pulses.
pub(super) const TICK_US: u64 = 1000;
/// Relative force below which fibres without pulses count as resting.
const RESTING: f64 = 1e-6;
/// Time after the last pulse at which the fibres count as no longer stimulated, µs: no train that
/// fuses has longer gaps.
const FREE_US: u64 = 100_000;

/// Fibres under one pair of electrodes: their activation and the pending pulses.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Fibres {
    electrode: Electrode,
    muscle: Muscle,
    whole: Step,
    /// Pending pulses: time at which each takes effect, µs, and recruited share of the fibres that
    /// the electrodes reach.
    under_way: VecDeque<(u64, f64)>,
    last: Option<(u64, f64)>,
}

impl Fibres {
    pub fn new(spec: &SagittalSpec, electrode: Electrode) -> Self {
        Self {
            electrode,
            muscle: Muscle::new(spec.dynamics),
            whole: Step::new(&spec.dynamics, TICK_US as f64 * 1e-6),
            under_way: VecDeque::new(),
            last: None,
        }
    }

    /// Schedules a pulse that leaves the output stage at `at_us`.
    pub fn excite(&mut self, spec: &SagittalSpec, at_us: u64, current_ma: f64, width_us: u32) {
        let own = |ma: f64| effective_voltage(ma, spec.width_us);
        let part = recruitment(
            effective_voltage(current_ma, width_us),
            own(self.electrode.threshold_ma),
            own(self.electrode.full_ma),
            spec.curvature,
        );
        if part > 0.0 {
            self.under_way
                .push_back((at_us + u64::from(spec.delay_us), part));
        }
    }

    /// Simulates the millisecond from `start_us` on.
    pub fn pass(&mut self, spec: &SagittalSpec, start_us: u64) {
        let end_us = start_us + TICK_US;
        let mut now_us = start_us;
        while let Some((due_us, part)) = self.under_way.front().copied() {
            if due_us >= end_us {
                break;
            }
            self.under_way.pop_front();
            let span_us = due_us.saturating_sub(now_us);
            if span_us > 0 {
                self.muscle
                    .step(&Step::new(&spec.dynamics, span_us as f64 * 1e-6));
                now_us = due_us;
            }
            self.muscle.pulse(part);
            self.last = Some((due_us, part));
        }
        match self.last {
            None => {}
            Some(_) if now_us > start_us => {
                let rest_s = (end_us - now_us) as f64 * 1e-6;
                self.muscle.step(&Step::new(&spec.dynamics, rest_s));
            }
            Some((last_us, _)) => {
                self.muscle.step(&self.whole);
                let is_free = end_us - last_us.min(end_us) > FREE_US;
                if is_free && self.muscle.force() < RESTING {
                    self.muscle = Muscle::new(spec.dynamics);
                    self.last = None;
                }
            }
        }
    }

    /// Returns the force relative to that of the whole muscle; for a fused train, 0 to the share
    /// that the electrodes reach.
    pub fn force(&self) -> f64 {
        self.electrode.reached * self.muscle.force()
    }

    /// Returns the share of the whole muscle that pulses keep active at `now_us`.
    pub fn pulsed_share(&self, now_us: u64) -> f64 {
        let own = self
            .last
            .filter(|(last_us, _)| now_us.saturating_sub(*last_us) <= FREE_US);
        self.electrode.reached * own.map_or(0.0, |(_, part)| part)
    }
}
