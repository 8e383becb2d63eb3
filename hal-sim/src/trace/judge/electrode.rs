//! Simulates one channel from its two lines to its electrode, and applies the rules.

use super::account::{Latched, OutputJudgement, Rule, Truncated};
use super::circuit::{Circuit, Path, Source};
use super::direct::{DirectCurrentWindow, Sample};
use super::pulse::{COMMANDED_US, Phase, Pulse};
use super::stage::Logic;
use super::truth::{Channel, Hardware, Stage, Truth};
use crate::trace::levels::State;
use crate::trace::pulses::MAX_GAP_US;
use std::collections::VecDeque;

/// Maximum length of any phase, µs: the one-shot's upper bound (hardware.md, one-shots).
const ANY_US: u64 = 650;
/// Factor by which the current may exceed the wearer's limit.
const CURRENT_MARGIN: f64 = 1.05;
/// Maximum net direct current over a second, A.
const DIRECT_A: f64 = 1e-6;
/// Maximum charge of one truncated pulse, C: 650 µs of 100 mA.
const TRUNCATED_C: f64 = 65e-6;
/// Shortest grounding that counts as giving a phase's charge back, µs (hardware.md: at least 1 ms).
const GIVES_BACK_US: u64 = 900;
const SECOND_US: u64 = 1_000_000;

/// Stage and electrode of one channel, simulated over time.
pub(super) struct Electrode<'a> {
    channel: u8,
    of: &'a Channel,
    truth: &'a Truth,
    built: Option<&'a Hardware>,
    logic: Logic,
    circuit: Circuit,
    code: u16,
    /// Trip level of the bank's comparator, mA; infinite until it is set.
    trip_ma: f64,
    ohm: Option<f64>,
    supplied: bool,
    now_us: u64,
    phase: Option<Phase>,
    pulse: Option<Pulse>,
    grounded_since: Option<u64>,
    /// Time at which the last grounding ended, µs.
    ungrounded_us: u64,
    /// Times of the faults that have not excused a pulse yet, µs.
    faults: VecDeque<u64>,
    /// Start times of the pulses within the last second, µs.
    begun: VecDeque<u64>,
    passed: f64,
    direct: DirectCurrentWindow,
    account: OutputJudgement,
}

impl<'a> Electrode<'a> {
    pub fn new(truth: &'a Truth, channel: u8, built: Option<&'a Hardware>) -> Self {
        Self {
            channel,
            of: &truth.channels[usize::from(channel)],
            truth,
            built,
            logic: Logic::new(built.copied()),
            circuit: Circuit::new(built.map(|h| (h.capacitor_f, h.bleed_ohm))),
            code: 0,
            trip_ma: f64::INFINITY,
            ohm: None,
            supplied: built.is_none(),
            now_us: 0,
            phase: None,
            pulse: None,
            grounded_since: None,
            ungrounded_us: 0,
            faults: truth.faults_of(channel).into(),
            begun: VecDeque::new(),
            passed: 0.0,
            direct: DirectCurrentWindow::default(),
            account: OutputJudgement::default(),
        }
    }

    pub fn set_lines(&mut self, t_us: u64, state: State) {
        self.change(t_us, |e| e.logic.enter(t_us, state));
    }

    pub fn set_code(&mut self, t_us: u64, code: u16) {
        self.change(t_us, |e| e.code = code);
    }

    /// Sets the trip level of the bank's comparator.
    pub fn set_trip(&mut self, t_us: u64, code: u16) {
        let full_scale_ma = self.truth.hardware.bank_full_scale_ma;
        let trip_ma = full_scale_ma * f64::from(code) / 65_535.0;
        self.change(t_us, |e| e.trip_ma = trip_ma);
    }

    pub fn set_load(&mut self, t_us: u64, ohm: Option<f64>) {
        self.change(t_us, |e| e.ohm = ohm);
    }

    pub fn set_supply(&mut self, t_us: u64, on: bool) {
        self.change(t_us, |e| {
            e.supplied = on || e.built.is_none();
            if on {
                e.logic.set_pump_rest(None);
            }
        });
    }

    pub fn rest_pump(&mut self, t_us: u64) {
        self.change(t_us, |e| e.logic.set_pump_rest(Some(t_us)));
    }

    /// Advances to `t_us`, then applies `change`.
    fn change(&mut self, t_us: u64, change: impl FnOnce(&mut Self)) {
        self.advance(t_us);
        let latched = self.logic.latched();
        change(self);
        self.note_latch(t_us, latched);
        self.update_phase(t_us);
    }

    fn note_latch(&mut self, t_us: u64, before: Option<super::Cause>) {
        if let (None, Some(cause)) = (before, self.logic.latched()) {
            let channel = self.channel;
            self.account.latched.push(Latched {
                t_us,
                channel,
                cause,
            });
        }
    }

    /// Advances to `to_us`, and executes the stage's own events on the way.
    fn advance(&mut self, to_us: u64) {
        loop {
            let stage_us = self.logic.next_event();
            let rest_us = self.rest_due().unwrap_or(u64::MAX);
            let next_us = stage_us.min(rest_us);
            if next_us > to_us {
                break;
            }
            self.flow(next_us);
            if stage_us == next_us {
                let latched = self.logic.latched();
                self.logic.run_next_event(next_us);
                self.note_latch(next_us, latched);
                self.update_phase(next_us);
            } else {
                self.end_pulse(next_us);
            }
        }
        self.flow(to_us);
    }

    /// Returns the time at which the present pulse counts as ended if nothing more is driven: its
    /// maximum wait for another phase after the last phase or grounding.
    fn pulse_end_us(&self) -> Option<u64> {
        let pulse = self.pulse.filter(|_| self.phase.is_none())?;
        let is_isolated = self.grounded_since.is_none();
        is_isolated.then_some(pulse.end_us.max(self.ungrounded_us) + pulse.max_wait_us())
    }

    /// Returns [`Self::pulse_end_us`], or `None` if a fault may have delayed the second phase: then
    /// the next phase decides.
    fn rest_due(&self) -> Option<u64> {
        let is_lone = self.pulse.is_some_and(|pulse| pulse.is_lone());
        let over_us = self.pulse_end_us()?;
        (!is_lone || !self.is_due(over_us)).then_some(over_us.max(self.now_us))
    }

    /// Returns how the stage is connected to the load now.
    fn path(&self) -> Path {
        let (state, Some(ohm)) = (self.logic.state(), self.ohm) else {
            return Path::Open;
        };
        match state {
            State::Isolated => Path::Open,
            State::Grounded => Path::Grounded { ohm },
            _ if !self.supplied || self.code == 0 => Path::Open,
            State::Cathodic | State::Anodic => Path::Driven(self.source(state, ohm)),
        }
    }

    fn source(&self, state: State, ohm: f64) -> Source {
        let hardware = &self.truth.hardware;
        let anodic = state == State::Anodic;
        let match_part = if anodic { 1.0 + self.of.mismatch } else { 1.0 };
        let part = match_part * f64::from(self.code) / 65_535.0;
        let sign = if anodic { 1.0 } else { -1.0 };
        match self.of.stage {
            Stage::Current { full_scale_ma } => Source {
                sign,
                ohm,
                volts: hardware.compliance_v,
                limit_a: full_scale_ma * part * 1e-3,
                reverse_a: 0.0,
            },
            Stage::Voltage { full_scale_v } => Source {
                sign,
                ohm,
                volts: full_scale_v * part,
                limit_a: hardware.limiter_ma * 1e-3,
                reverse_a: hardware.limiter_ma * 1e-3,
            },
        }
    }

    /// Advances the circuit to `to_us`, during which nothing changes.
    fn flow(&mut self, to_us: u64) {
        if to_us <= self.now_us {
            return;
        }
        let path = self.path();
        let flow = self
            .circuit
            .advance(path, (to_us - self.now_us) as f64 * 1e-6);
        self.passed += flow.charge - flow.apart;
        if let Some(phase) = &mut self.phase {
            phase.charge += flow.charge - flow.before;
        }
        let (milliamps, limit) = (1e3 * flow.peak, CURRENT_MARGIN * self.of.limit_ma);
        if milliamps > limit {
            self.record_finding(Rule::Current, self.now_us, milliamps, limit);
        }
        self.now_us = to_us;
    }

    /// Updates the phase after a change of the stage or its load at `t_us`.
    fn update_phase(&mut self, t_us: u64) {
        let path = self.path();
        let sign = match path {
            Path::Driven(source) => source.sign as i64,
            Path::Open | Path::Grounded { .. } => 0,
        };
        if self.phase.is_some_and(|phase| phase.sign != sign) {
            self.end_phase(t_us);
        }
        let is_grounded = matches!(path, Path::Grounded { .. });
        match self.grounded_since {
            None if is_grounded => self.grounded_since = Some(t_us),
            Some(since) if !is_grounded => self.end_grounding(since, t_us),
            _ => {}
        }
        if sign != 0 && self.phase.is_none() {
            self.begin_phase(t_us, sign);
        }
        let milliamps = match sign {
            0 => 0.0,
            _ => 1e3 * self.circuit.current(path),
        };
        let levels = [self.of.trip_ma, self.trip_ma];
        self.logic
            .update_comparators(t_us, levels.map(|level| milliamps > level));
    }

    /// Returns whether a fault up to `t_us` has not excused a pulse yet.
    fn is_due(&self, t_us: u64) -> bool {
        self.faults.front().is_some_and(|&fault| fault <= t_us)
    }

    fn begin_phase(&mut self, t_us: u64, sign: i64) {
        let (is_due, lines_us) = (self.is_due(t_us), self.logic.since_us());
        let start_us = match &mut self.pulse {
            Some(pulse) if pulse.is_interrupted(sign, lines_us) => pulse.phase_us,
            Some(pulse) if pulse.lacks(sign) && (is_due || pulse.awaits(t_us)) => {
                let is_late = !pulse.awaits(t_us);
                pulse.begin_second(t_us);
                if is_late {
                    self.count_begun(t_us);
                }
                t_us
            }
            _ => {
                let end_us = self.pulse.map(|pulse| pulse.end_us);
                let is_near = end_us.is_some_and(|us| t_us - us <= MAX_GAP_US);
                if self.end_pulse(t_us) && is_near {
                    self.direct.resume_excused();
                }
                self.circuit.begin_pulse();
                self.pulse = Some(Pulse::new(t_us, sign));
                self.count_begun(t_us);
                t_us
            }
        };
        self.phase = Some(Phase {
            start_us,
            sign,
            charge: 0.0,
        });
    }

    /// Counts another pulse within the last second, and checks the pulse rate.
    fn count_begun(&mut self, t_us: u64) {
        self.begun.push_back(t_us);
        while self.begun.front().is_some_and(|&t| t + SECOND_US <= t_us) {
            self.begun.pop_front();
        }
        let (count, most) = (self.begun.len(), self.of.pulses_per_s);
        if count > most {
            self.record_finding(Rule::Rate, t_us, count as f64, most as f64);
        }
    }

    fn end_phase(&mut self, t_us: u64) {
        let Some(phase) = self.phase.take() else {
            return;
        };
        let lasted = t_us - phase.start_us;
        if lasted > ANY_US {
            self.record_finding(Rule::AnyPhase, phase.start_us, lasted as f64, ANY_US as f64);
        } else if lasted > COMMANDED_US && !self.is_due(t_us) {
            let limit = COMMANDED_US as f64;
            self.record_finding(Rule::CommandedPhase, phase.start_us, lasted as f64, limit);
        }
        for quiet in &self.truth.quiet {
            let last_us = t_us.min(quiet.until_us);
            if phase.start_us.max(quiet.from_us) < last_us {
                let (at, late) = (phase.start_us.max(quiet.from_us), last_us - quiet.from_us);
                let channel = self.channel;
                let account = &mut self.account;
                account.record_finding(Rule::PastDeadline, channel, at, late as f64, 0.0);
            }
        }
        if let Some(pulse) = &mut self.pulse {
            pulse.end_phase(t_us, phase);
        }
    }

    fn end_grounding(&mut self, since_us: u64, t_us: u64) {
        (self.grounded_since, self.ungrounded_us) = (None, t_us);
        if t_us - since_us >= GIVES_BACK_US {
            // The remaining charge has a way back, so only the length of the pulse can have been
            // wrong.
            if let Some(pulse) = &mut self.pulse {
                pulse.net = 0.0;
            }
            self.end_pulse(t_us);
        }
    }

    /// Ends the last pulse when the electrode is at rest: the pulse is complete, or never will be.
    /// Returns whether a fault excuses it.
    fn end_pulse(&mut self, t_us: u64) -> bool {
        let Some(pulse) = self.pulse.take() else {
            return false;
        };
        let is_cut = pulse.is_cut();
        if is_cut {
            self.circuit.set_cut_charge(pulse.net);
        }
        let is_excused = self.is_due(t_us) && (is_cut || pulse.is_long);
        if is_excused {
            self.excuse(&pulse, t_us);
        }
        let now = Sample {
            t_us,
            passed: self.passed,
            held: self.circuit.held_charge(),
        };
        let circuit = &self.circuit;
        let direct = self
            .direct
            .net_direct_current(now, |seconds| circuit.kept_share(seconds))
            .abs();
        if direct > DIRECT_A {
            let limit = 1e6 * DIRECT_A;
            self.record_finding(Rule::DirectCurrent, t_us, 1e6 * direct, limit);
        }
        is_excused
    }

    /// Excuses a pulse that a fault truncated or prolonged.
    fn excuse(&mut self, pulse: &Pulse, t_us: u64) {
        self.faults.pop_front();
        self.direct.excuse(t_us, pulse.net);
        self.account.truncated.push(Truncated {
            t_us: pulse.start_us,
            channel: self.channel,
            charge_uc: 1e6 * pulse.net,
        });
        if pulse.net.abs() > TRUNCATED_C {
            let (amount, limit) = (1e6 * pulse.net.abs(), 1e6 * TRUNCATED_C);
            self.record_finding(Rule::TruncatedCharge, pulse.start_us, amount, limit);
        }
    }

    fn record_finding(&mut self, rule: Rule, t_us: u64, amount: f64, limit: f64) {
        self.account
            .record_finding(rule, self.channel, t_us, amount, limit);
    }

    /// Ends the recording at `end_us`. A phase that is cut off there lasted at least until then;
    /// the charge that its pulse would leave is unknown and not judged.
    pub fn finish(mut self, end_us: u64) -> OutputJudgement {
        self.advance(end_us);
        if self.pulse_end_us().is_some_and(|over_us| over_us <= end_us) {
            self.end_pulse(end_us);
        }
        self.end_phase(end_us);
        self.account.direct_ua.push(1e6 * self.direct.last);
        self.account
    }
}
