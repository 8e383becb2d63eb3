//! Runs a board that stimulates, forks it at the moment of a fault, and judges each fork.

use super::bench::Bench;
use super::case::{CaseEnd, CaseResult};
use super::declaration::{Declaration, Timing};
use super::error::{FaultsError, never_runs};
use super::simulated::{
    Boards, FaultableDevice, TWO_WINDOWS_US, is_isolated_for_good, judge_case, judge_case_until,
};
use super::truth::declared_truth;
use firmware::lockstep::Sensors;
use hal_sim::body::{CHANNELS, Load};
use hal_sim::chip::Cycle;
use hal_sim::chip::board::{Board, CYCLES_PER_US};
use hal_sim::chip::cpu::Observer;
use hal_sim::chip::image::Image;
use hal_sim::random::Random;
use hal_sim::trace::Trace;
use hal_sim::trace::judge::{Pump, QuietInterval, Rule, Truth, Verdict};
use std::io;
use std::ops::Range;

/// A chip simulator with its host and recorded output.
pub(super) type Chip = Bench<Board<()>>;

/// Interval between stored copies of the undisturbed board, µs. Cases start from a copy, and
/// running cases are compared with the next copies.
const KEPT_US: u64 = 20_000;
/// Resistance between the electrodes of every channel, Ω; voltage stages of the session state the
/// same load.
const LOAD_OHM: u32 = 2_000;
/// Undisturbed run of a board, with copies of the board from which the cases start.
pub(super) struct ForkSource {
    kept: Vec<Chip>,
    /// Undisturbed output, up to the end of the last case.
    whole: Trace,
    pump: Pump,
    to_the_end: bool,
    truth: Truth,
    timing: Timing,
    /// Longest allowed time from the host's last message to the last output, µs.
    silence_us: u64,
    /// Rule and channel of each finding that the judge would report without protective circuits,
    /// although no fault was injected.
    always: Vec<(Rule, u8)>,
}

impl ForkSource {
    /// Runs the session of the campaign without a fault, and stores copies of the board.
    ///
    /// # Errors
    /// Fails if the board does not stimulate, or if its output is severe by itself.
    pub fn record(declaration: &Declaration, image: &Image) -> Result<Self, FaultsError> {
        let (session, timing) = (&declaration.scene.session, declaration.timing());
        let sensors = Sensors {
            load_ohm: [LOAD_OHM; CHANNELS],
            ..Sensors::default()
        };
        let bench = image.board(session, sensors, &|_| ())?;
        let wanted = session.setpoints.at(0).to_request(None);
        let mut bench = bench.into_stimulating(session, wanted, timing.warm_us)?;
        let end_us = bench.now_us() + timing.window_us;
        let mut kept = Vec::new();
        let mut last = bench.clone();
        while bench.now_us() < end_us + timing.runs_us {
            kept.push(bench.clone());
            bench.run_to(bench.now_us() + KEPT_US).map_err(never_runs)?;
            if bench.now_us() <= end_us {
                last = bench.clone();
            }
        }
        let wearer = &session.wearer;
        let silence_ms = u64::from(wearer.host_timeout_ms + wearer.fall_ms);
        let mut stem = Self {
            kept,
            pump: bench.device.pump(),
            whole: std::mem::take(&mut bench.recorder.trace),
            to_the_end: declaration.to_the_end,
            truth: declared_truth(session, &[Load::Ohms(LOAD_OHM.into()); CHANNELS]),
            timing,
            silence_us: 1000 * silence_ms + TWO_WINDOWS_US,
            always: Vec::new(),
        };
        // This run includes the host silence; otherwise it would reconverge at once.
        let begin_us = last.now_us();
        let (fate, verdict) = stem.play_to_end(last, begin_us);
        stem.always = verdict
            .bare
            .findings
            .iter()
            .map(|f| (f.rule, f.channel))
            .collect();
        match (fate.severe.first(), fate.stopped) {
            (Some(severe), _) => Err(FaultsError::SevereItself(severe.clone())),
            (_, Some(why)) => Err(FaultsError::NeverStimulates(why)),
            _ => Ok(stem),
        }
    }

    /// Returns the lowest main stack pointer that occurred in the undisturbed run, if it is known.
    pub fn deepest_stack(&self) -> Option<u32> {
        let deepest = |chip: &Chip| chip.device.cpu.system.deepest_msp;
        self.kept.last().and_then(deepest)
    }

    /// Returns the device time at the fraction `part`, 0 to 1, of the time in which faults are
    /// injected, µs.
    pub fn moment(&self, part: f64) -> u64 {
        let begin_us = self.kept.first().map_or(0, Bench::now_us);
        begin_us + (part * self.timing.window_us as f64) as u64
    }

    /// Returns the cycle at device time 0, and the range of cycles in which faults are injected.
    pub fn cycles(&self) -> (Cycle, Range<Cycle>) {
        let origin = self
            .kept
            .first()
            .map_or(0, |bench| bench.device.around.origin());
        let [begin, end] = [0.0, 1.0].map(|part| origin + self.moment(part) * CYCLES_PER_US);
        (origin, begin..end)
    }

    /// Returns a copy of the undisturbed board at `cycle`, or at the end of the instruction that
    /// runs then.
    pub fn fork_at(&self, cycle: Cycle) -> Result<Chip, FaultsError> {
        let (origin, _) = self.cycles();
        let mut fork = self.fork(cycle.saturating_sub(origin) / CYCLES_PER_US)?;
        fork.device.run_to(cycle)?;
        Ok(fork)
    }

    /// Repeats the undisturbed run with `observer` from the first possible fault to the end of the
    /// last case; calls `at` at each of `cycles`, which must be in ascending order.
    pub fn run_with_observer<O: Observer + Send + Clone + 'static>(
        &self,
        observer: O,
        cycles: &[Cycle],
        at: &mut dyn FnMut(&mut Board<O>),
    ) -> Result<Bench<Board<O>>, FaultsError> {
        let begin = self.kept.first();
        let none = || FaultsError::NeverStimulates("no fork point was recorded".into());
        let begin = begin.ok_or_else(none)?;
        let end_us = begin.now_us() + self.timing.window_us + self.timing.runs_us;
        let mut bench = begin.with_device(begin.device.clone().with_observer(observer));
        let origin = bench.device.around.origin();
        for &cycle in cycles {
            let us = cycle.saturating_sub(origin) / CYCLES_PER_US;
            bench.run_to(us).map_err(never_runs)?;
            bench.device.run_to(cycle)?;
            at(&mut bench.device);
        }
        bench.run_to(end_us).map_err(never_runs)?;
        // In the undisturbed run the host falls silent at the end, as in the forks.
        bench.speaks = false;
        bench
            .run_to(end_us + self.timing.silent_us)
            .map_err(never_runs)?;
        Ok(bench)
    }

    /// Returns a copy of the undisturbed board at `moment_us`, a time at which faults are injected.
    pub fn fork(&self, moment_us: u64) -> Result<Chip, FaultsError> {
        let after = self.kept.partition_point(|kept| kept.now_us() <= moment_us);
        let Some(kept) = self.kept.get(after.saturating_sub(1)) else {
            return Err(FaultsError::NeverStimulates(
                "no fork point was recorded".into(),
            ));
        };
        let mut fork = kept.clone();
        fork.run_to(moment_us).map_err(never_runs)?;
        Ok(fork)
    }

    /// Returns a copy of the undisturbed board, for a fault at the fraction `part` of the time in
    /// which faults are injected. A random number of cycles within a microsecond is added, so that
    /// the fault can hit any cycle.
    pub fn instant(&self, part: f64, random: &mut Random) -> Result<Chip, FaultsError> {
        let mut fork = self.fork(self.moment(part))?;
        let cycle = fork.device.cpu.cycle + random.below(CYCLES_PER_US);
        fork.device.run_to(cycle).map_err(never_runs)?;
        Ok(fork)
    }

    /// Runs a case whose fault was injected at `moment_us` until its result is certain, and judges
    /// it.
    pub fn play_and_judge(&self, fork: Chip, moment_us: u64) -> CaseResult {
        CaseResult {
            shown_us: None,
            ..self.play_and_judge_shown(fork, moment_us)
        }
    }

    /// Runs and judges as [`Self::play_and_judge`] does, and also determines for how long an output
    /// line differed from the undisturbed run.
    pub fn play_and_judge_shown(&self, fork: Chip, moment_us: u64) -> CaseResult {
        let (mut fate, verdict) = self.play_or_reconverge(fork, moment_us);
        let bare = verdict.bare.findings.iter();
        let bare = bare.filter(|finding| !self.always.contains(&(finding.rule, finding.channel)));
        fate.bare = bare.map(ToString::to_string).collect();
        fate
    }

    fn play_or_reconverge(&self, mut fork: Chip, moment_us: u64) -> (CaseResult, Verdict) {
        let silent_us = moment_us + self.timing.runs_us;
        let after = self.kept.partition_point(|kept| kept.now_us() <= moment_us);
        for stem in self.kept.iter().skip(after).filter(|_| !self.to_the_end) {
            // A fork that cannot continue returns its error at once; the error recurs below.
            if stem.now_us() >= silent_us || fork.run_to(stem.now_us()).is_err() {
                break;
            }
            let (device, trace) = (&fork.device, &fork.recorder.trace);
            if is_isolated_for_good(fork.reports(), device, trace, fork.now_us()) {
                return self.judge_ended(fork, moment_us, CaseEnd::Isolated, Ok(()));
            }
            if fork.has_same_host_state(stem)
                && fork.device.first_difference(&stem.device).is_none()
            {
                return self.judge_reconverged(stem, fork, moment_us);
            }
        }
        self.play_to_end(fork, moment_us)
    }

    /// Runs a case to its configured end, and judges its output.
    fn play_to_end(&self, mut fork: Chip, moment_us: u64) -> (CaseResult, Verdict) {
        let silent_us = moment_us + self.timing.runs_us;
        let end_us = silent_us + self.timing.silent_us;
        let played = fork.run_to(silent_us);
        fork.speaks = false;
        let played = played.and_then(|()| fork.run_to(end_us));
        self.judge_ended(fork, moment_us, CaseEnd::Played, played)
    }

    /// Judges a case whose board has reached the state of the undisturbed board `stem`. From then
    /// on both have the same output, which is therefore taken from the undisturbed run.
    fn judge_reconverged(
        &self,
        stem: &Chip,
        mut fork: Chip,
        moment_us: u64,
    ) -> (CaseResult, Verdict) {
        let (at_us, end_us) = (stem.now_us(), moment_us + self.timing.runs_us);
        // Skips by count instead of time, because both report an event shortly after it happened.
        let (trace, stem_trace) = (&mut fork.recorder.trace, &stem.recorder.trace);
        let before_end = |t: u64| t < end_us;
        let levels = self.whole.levels.iter().skip(stem_trace.levels.len());
        trace
            .levels
            .extend(levels.filter(|level| before_end(level.0)));
        let dac = self.whole.dac.iter().skip(stem_trace.dac.len());
        trace
            .dac
            .extend(dac.filter(|dac_write| before_end(dac_write.t_us)));
        let trips = self.whole.trips.iter().skip(stem_trace.trips.len());
        trace
            .trips
            .extend(trips.filter(|trip_write| before_end(trip_write.t_us)));
        let pump = fork.device.pump().followed_by(&self.pump, at_us);
        let on = (&pump, end_us);
        let (mut fate, verdict) = judge_case_until(&mut fork, moment_us, self.truth.clone(), on);
        fate.ended = CaseEnd::Reconverged;
        self.compare(&mut fate, &fork, (moment_us, at_us));
        (fate, verdict)
    }

    fn judge_ended(
        &self,
        mut fork: Chip,
        moment_us: u64,
        ended: CaseEnd,
        played: io::Result<()>,
    ) -> (CaseResult, Verdict) {
        let mut truth = self.truth.clone();
        truth.quiet.push(QuietInterval {
            from_us: fork.last_sent_us() + self.silence_us,
            until_us: u64::MAX,
        });
        let (mut fate, verdict) = judge_case(&mut fork, moment_us, truth);
        (fate.ended, fate.stopped) = (ended, played.err().map(|e| e.to_string()));
        let silent_us = moment_us + self.timing.runs_us;
        // The last pulses of a fall have DAC codes so small that they are unbalanced anyway.
        let truncated = verdict.as_built.truncated.iter();
        let truncated = truncated.filter(|truncated| truncated.t_us < silent_us);
        fate.truncated_uc = truncated.map(|truncated| truncated.charge_uc).collect();
        let compared_us = fork.now_us().min(silent_us);
        self.compare(&mut fate, &fork, (moment_us, compared_us));
        (fate, verdict)
    }

    /// Compares edges and DAC codes with the undisturbed run from `from_us` to `to_us`, and sets
    /// the fields of `fate` that follow.
    fn compare(&self, fate: &mut CaseResult, fork: &Chip, (from_us, to_us): (u64, u64)) {
        let changed = first_difference(&self.whole, &fork.recorder.trace, from_us, to_us);
        fate.changed_us = changed.map(|at| at.saturating_sub(from_us));
        fate.must_find = changed.is_some() && fate.stopped.is_none();
        let trace = &fork.recorder.trace;
        let shown_to_us = fate.isolated_us.map_or(to_us, |us| to_us.min(from_us + us));
        fate.shown_us = changed.and(longest_difference(&self.whole, trace, from_us, shown_to_us));
    }
}

impl Chip {
    /// Returns the device time of the processor core, µs. Within a simulated step it may be ahead
    /// of the host's time.
    pub fn device_us(&self) -> u64 {
        self.device.around.us_of(self.device.cpu.cycle)
    }
}

/// Returns the first time, from `from_us` on and before `to_us`, at which a line or a DAC code
/// differs between both traces; `None` if they are equal.
pub(super) fn first_difference(a: &Trace, b: &Trace, from_us: u64, to_us: u64) -> Option<u64> {
    let within = |t: &u64| (from_us..to_us).contains(t);
    let levels = |trace: &Trace| {
        let changes = trace.levels.iter().map(|&(t, levels)| (t, levels.0));
        changes.filter(|(t, _)| within(t)).collect::<Vec<_>>()
    };
    let codes = |trace: &Trace| {
        let writes = trace.dac.iter().map(|w| (w.t_us, (w.channel, w.code)));
        writes.filter(|(t, _)| within(t)).collect::<Vec<_>>()
    };
    let levels = first_unlike(&levels(a), &levels(b));
    let codes = first_unlike(&codes(a), &codes(b));
    levels.into_iter().chain(codes).min()
}

/// Returns the longest uninterrupted time for which the lines of both traces differ, from `from_us`
/// on and before `to_us`, µs; 0 if no difference lasts a microsecond, `None` if there is none.
fn longest_difference(a: &Trace, b: &Trace, from_us: u64, to_us: u64) -> Option<u64> {
    let within = |trace: &Trace| {
        let changes = trace.levels.iter().copied();
        changes
            .filter(|(t, _)| (from_us..to_us).contains(t))
            .collect::<Vec<_>>()
    };
    let is_unlike = within(a) != within(b);
    let mut times: Vec<u64> = [a, b]
        .iter()
        .flat_map(|trace| trace.levels.iter().map(|l| l.0))
        .collect();
    times.retain(|t| (from_us..to_us).contains(t));
    times.push(to_us);
    times.sort_unstable();
    let at = |trace: &Trace, t: u64| {
        let after = trace.levels.partition_point(|level| level.0 <= t);
        after.checked_sub(1).map(|last| trace.levels[last].1)
    };
    let (mut since, mut longest) = (None, is_unlike.then_some(0));
    for t in times {
        if let Some(since) = since {
            longest = longest.max(Some(t - since));
        }
        since = match t < to_us && at(a, t) != at(b, t) {
            true => since.or(Some(t)),
            false => None,
        };
    }
    longest
}

/// Returns the time of the first difference between two lists in ascending order of time.
fn first_unlike<T: PartialEq>(a: &[(u64, T)], b: &[(u64, T)]) -> Option<u64> {
    let same = a.iter().zip(b).take_while(|(a, b)| a == b).count();
    let next = |list: &[(u64, T)]| list.get(same).map(|list| list.0);
    next(a).into_iter().chain(next(b)).min()
}

#[cfg(test)]
mod tests {
    use super::*;
    use hal_sim::trace::Levels;

    #[test]
    fn a_line_that_is_back_within_the_microsecond_was_another() {
        let [mut whole, mut glitch, mut long] = [const { Vec::new() }; 3];
        for (at, on) in [(10, 1), (20, 0)] {
            whole.push((at, Levels(on)));
            long.push((at + 2, Levels(on)));
        }
        glitch.extend([
            (10, Levels(1)),
            (15, Levels(3)),
            (15, Levels(1)),
            (20, Levels(0)),
        ]);
        let [whole, glitch, long] = [whole, glitch, long].map(|levels| Trace {
            levels,
            ..Trace::default()
        });
        let longest = |b| longest_difference(&whole, b, 5, 30);
        assert_eq!(
            [&whole, &glitch, &long].map(longest),
            [None, Some(0), Some(2)]
        );
    }
}
