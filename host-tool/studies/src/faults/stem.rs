//! A board that stimulates, the forks of it, and how each goes on.

use super::bench::Bench;
use super::case::Fate;
use super::declaration::{Declaration, Timing};
use super::error::FaultsError;
use super::simulated::{Boards, TWO_WINDOWS_US, judged};
use super::truth::declared_truth;
use firmware::lockstep::Sensors;
use hal_sim::body::{CHANNELS, Load};
use hal_sim::chip::board::{Board, CYCLES_PER_US};
use hal_sim::chip::image::Image;
use hal_sim::random::Random;
use hal_sim::trace::Trace;
use hal_sim::trace::judge::{Quiet, Rule, Truth, Verdict};
use std::io;

/// A chip and its host.
pub(super) type Chip = Bench<Board<()>>;

/// From one kept fork to the next, µs.
const KEPT_US: u64 = 20_000;
/// Every electrode of the scene, Ω: the load that its voltage stages declare.
const LOAD_OHM: u32 = 2_000;
/// A board that nothing broke, kept at moments from which forks begin.
pub(super) struct Stem {
    kept: Vec<Chip>,
    /// What it puts out, to the end of the last fork.
    whole: Trace,
    truth: Truth,
    timing: Timing,
    /// From the host's last word to the last output that is allowed.
    silence_us: u64,
    /// What is severe without protection although nothing broke: rule and channel.
    always: Vec<(Rule, u8)>,
}

impl Stem {
    /// Plays the declared scene.
    ///
    /// # Errors
    /// It does not stimulate, or is severe by itself.
    pub fn grow(declaration: &Declaration, image: &Image) -> Result<Self, FaultsError> {
        let (session, timing) = (&declaration.scene.session, declaration.timing());
        let sensors = Sensors {
            load_ohm: [LOAD_OHM; CHANNELS],
            ..Sensors::default()
        };
        let bench = image.board(session, sensors, &|_| ())?;
        let wanted = session.setpoints.at(0).request(None);
        let mut bench = bench.stimulating(session, wanted, timing.warm_us)?;
        let end_us = bench.now_us() + timing.window_us;
        let mut kept = Vec::new();
        while bench.now_us() < end_us {
            kept.push(bench.clone());
            bench.run_to(bench.now_us() + KEPT_US).map_err(never)?;
        }
        let last = bench.clone();
        bench.run_to(end_us + timing.runs_us).map_err(never)?;
        let wearer = &session.wearer;
        let silence_ms = u64::from(wearer.host_timeout_ms + wearer.fall_ms);
        let mut stem = Self {
            kept,
            whole: std::mem::take(&mut bench.recorder.trace),
            truth: declared_truth(session, &[Load::Ohms(LOAD_OHM.into()); CHANNELS]),
            timing,
            silence_us: 1000 * silence_ms + TWO_WINDOWS_US,
            always: Vec::new(),
        };
        let (fate, verdict) = stem.judged(last, end_us);
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

    /// When the part `part` (0 to 1) of the window has gone by, device time in µs.
    pub fn moment(&self, part: f64) -> u64 {
        let begin_us = self.kept.first().map_or(0, Bench::now_us);
        begin_us + (part * self.timing.window_us as f64) as u64
    }

    /// The board at `moment_us` of the window.
    pub fn fork(&self, moment_us: u64) -> Result<Chip, FaultsError> {
        let after = self.kept.partition_point(|kept| kept.now_us() <= moment_us);
        let Some(kept) = self.kept.get(after.saturating_sub(1)) else {
            return Err(FaultsError::NeverStimulates("no moment was kept".into()));
        };
        let mut fork = kept.clone();
        fork.run_to(moment_us).map_err(never)?;
        Ok(fork)
    }

    /// The board at an instant of the window, even in cycles (an instruction begins).
    pub fn instant(&self, random: &mut Random) -> Result<Chip, FaultsError> {
        let mut fork = self.fork(self.moment(random.unit()))?;
        let cycle = fork.device.cpu.cycle + random.below(CYCLES_PER_US);
        fork.device.run_to(cycle).map_err(never_runs)?;
        Ok(fork)
    }

    /// Plays on what was broken at `moment_us`, and judges it.
    pub fn follow(&self, fork: Chip, moment_us: u64) -> Fate {
        let (mut fate, verdict) = self.judged(fork, moment_us);
        let bare = verdict.bare.findings.iter();
        let bare = bare.filter(|it| !self.always.contains(&(it.rule, it.channel)));
        fate.bare = bare.map(ToString::to_string).collect();
        fate
    }

    fn judged(&self, mut fork: Chip, moment_us: u64) -> (Fate, Verdict) {
        let silent_us = moment_us + self.timing.runs_us;
        let end_us = silent_us + self.timing.silent_us;
        let played = fork.run_to(silent_us);
        fork.speaks = false;
        let played = played.and_then(|()| fork.run_to(end_us));
        let mut truth = self.truth.clone();
        truth.quiet.push(Quiet {
            from_us: fork.said_us() + self.silence_us,
            until_us: u64::MAX,
        });
        let (mut fate, verdict) = judged(&mut fork, moment_us, truth);
        let compared_us = fork.now_us().min(silent_us);
        let changed = first_difference(&self.whole, &fork.recorder.trace, moment_us, compared_us);
        fate.changed_us = changed.map(|at| at.saturating_sub(moment_us));
        fate.stopped = played.err().map(|e| e.to_string());
        fate.must_find = changed.is_some() && fate.stopped.is_none();
        (fate, verdict)
    }
}

impl Chip {
    /// Device time of the core, µs: within a step of the host's, later than that.
    pub fn device_us(&self) -> u64 {
        self.device.around.us_of(self.device.cpu.cycle)
    }
}

/// Before anything broke.
pub(super) fn never_runs(why: impl ToString) -> FaultsError {
    FaultsError::NeverStimulates(why.to_string())
}

fn never(lost: io::Error) -> FaultsError {
    FaultsError::NeverStimulates(lost.to_string())
}

/// When the first line or code differs from `from_us` on and before `to_us`.
pub(super) fn first_difference(a: &Trace, b: &Trace, from_us: u64, to_us: u64) -> Option<u64> {
    let within = |t: &u64| (from_us..to_us).contains(t);
    let levels = |trace: &Trace| {
        let all = trace.levels.iter().map(|&(t, levels)| (t, levels.0));
        all.filter(|(t, _)| within(t)).collect::<Vec<_>>()
    };
    let codes = |trace: &Trace| {
        let all = trace.dac.iter().map(|w| (w.t_us, (w.channel, w.code)));
        all.filter(|(t, _)| within(t)).collect::<Vec<_>>()
    };
    let levels = first_unlike(&levels(a), &levels(b));
    let codes = first_unlike(&codes(a), &codes(b));
    levels.into_iter().chain(codes).min()
}

/// When two lists in order of time first differ.
fn first_unlike<T: PartialEq>(a: &[(u64, T)], b: &[(u64, T)]) -> Option<u64> {
    let same = a.iter().zip(b).take_while(|(a, b)| a == b).count();
    let next = |list: &[(u64, T)]| list.get(same).map(|it| it.0);
    next(a).into_iter().chain(next(b)).min()
}
