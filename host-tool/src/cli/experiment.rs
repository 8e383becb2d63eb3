//! `flexor experiment`: a paper's protocol, then the same with wearers drawn.

use super::out::OutArgs;
use super::{Bar, Output, interrupt, wrong};
use clap::Args;
use host_core::link::Interruption;
use host_core::plot::words::in_columns;
use host_core::record::{Ending, Plan, Run, write_run};
use host_core::run::{DeviceName, greet};
use std::io::{BufRead, IsTerminal};
use std::path::Path;
use std::time::{Duration, Instant};
use studies::experiments::named;
use studies::laboratory::{
    Conducted, Course, Ended, Experiment, LaboratoryError, Operator, Outcome, Shard, Sweep,
    headline, publish,
};

/// Run a paper's protocol on a device; then, simulated, with wearers drawn at random
#[derive(Args, Debug)]
pub struct ExperimentArgs {
    /// hamana-4, harris-wall, harris-wall-why, open-trains, or the file of a declaration
    name: String,
    /// native, chip, qemu, a serial port, or tcp:HOST:PORT
    #[arg(long, default_value = "native")]
    device: DeviceName,
    /// Wearers to draw; default: the declaration's number in this program's
    /// simulators, none for a board
    #[arg(long)]
    draws: Option<u64>,
    /// Decides order, noise and wearers; default: the declaration's
    #[arg(long)]
    seed: Option<u64>,
    #[command(flatten)]
    out: OutArgs,
    /// Of which record this is a rerun.
    #[arg(skip)]
    rerun_of: Option<String>,
}

/// How a record of an experiment names its command.
const COMMAND: &str = "experiment ";
/// Most wearers drawn.
const MOST_DRAWS: u64 = 100_000;

impl ExperimentArgs {
    /// The experiment of a record, again, in `out`; `None` for another command's.
    pub fn again(record: &Run, out: OutArgs, of: String) -> Option<Self> {
        let plan = record.plan.as_ref()?;
        let identity = record.trials.first()?.identity.as_ref()?;
        Some(Self {
            name: plan.command.strip_prefix(COMMAND)?.to_owned(),
            device: DeviceName::of(identity.kind)?,
            draws: Some(plan.draws?),
            seed: Some(record.seed?),
            out,
            rerun_of: Some(of),
        })
    }
}

/// # Errors
/// No such experiment, no device, a folder that cannot be written, a trial that ended
/// early.
pub fn main(args: &ExperimentArgs, output: Output) -> anyhow::Result<()> {
    let experiment = named(&args.name)?;
    let seed = args.seed.unwrap_or(experiment.declaration.seed);
    let declared = if args.device.is_port() {
        0
    } else {
        experiment.declaration.draws
    };
    let draws = args.draws.unwrap_or(declared);
    if draws > MOST_DRAWS {
        return wrong(format!("--draws is {draws}, allowed is 0 to {MOST_DRAWS}"));
    }
    let interruption = interrupt::heed()?;
    if args.out.overwrites() && args.device.is_port() {
        // No record goes for a device that is not there.
        if let Some(condition) = experiment.conditions.first() {
            let session = condition.session(&[])?.session;
            greet(args.device.open(&session, seed)?, &interruption)?;
        }
    }
    let place = args.out.place(&experiment.declaration.name)?;
    let dir = place.dir();
    let device = args.device.to_string();
    let plan = Plan {
        draws: Some(draws),
        ..Plan::of(&format!("{COMMAND}{}", args.name), &device)
    };
    let mut record = Run::begin(&experiment.declaration.title, &device, Some(seed), plan);
    record.host.rerun_of = args.rerun_of.clone();
    write_run(dir, &record)?;
    let bar = output.bar(&experiment.declaration.name);
    let mut beside = Beside {
        bar: &bar,
        is_board: args.device.is_port(),
        part: if draws == 0 { 1.0 } else { 0.3 },
        interruption: interruption.clone(),
    };
    let course = experiment.conduct(dir, (&args.device, seed), &mut beside)?;
    record.trials = course.trials.iter().map(|it| it.trial.clone()).collect();
    let outcome = came_to(&experiment, (seed, draws), dir, &course, &beside);
    bar.finish();
    let outcome = match outcome.and_then(|it| ended(course, it, &interruption)) {
        Ok(outcome) => outcome,
        Err(error) => return Err(interrupt::conclude(dir, record, error)),
    };
    record.ending = Ending::complete();
    interrupt::close(dir, &mut record).inspect_err(|_| super::lies_in(dir))?;
    let page = dir.join("result.html").display().to_string();
    output.say(
        || people(&outcome, &page),
        || serde_json::json!({ "result": outcome, "page": page }),
    )?;
    Ok(())
}

/// What the trials, and the wearers drawn, came to; written beside the record as far
/// as it goes.
fn came_to(
    experiment: &Experiment,
    (seed, draws): (u64, u64),
    dir: &Path,
    course: &Course,
    beside: &Beside<'_>,
) -> anyhow::Result<Option<Outcome>> {
    let is_simulated = |it: &Conducted| it.trial.identity.as_ref().is_none_or(|it| it.simulated);
    let simulated = course.trials.iter().all(is_simulated);
    if draws == 0 || course.ended.is_some() {
        let outcome = Outcome::of_trials(experiment, seed, &course.trials, simulated);
        publish(dir, &outcome, &course.trials)?;
        return Ok(Some(outcome));
    }
    let sweep = Sweep::new(experiment, seed, draws, Shard::WHOLE);
    sweep.begin(dir)?;
    let swept = sweep.run(experiment, dir, &course.trials, &mut |part| {
        beside.bar.set(beside.part + (1.0 - beside.part) * part);
        beside.interruption.asked().is_none()
    })?;
    Ok(swept.outcome)
}

/// The outcome of what came to its end.
fn ended(
    course: Course,
    outcome: Option<Outcome>,
    interruption: &Interruption,
) -> anyhow::Result<Outcome> {
    let (done, of) = (course.trials.len(), course.of);
    let stopped = |why: String| LaboratoryError::Stopped { why, done, of };
    let cut_short = match course.ended {
        None => None,
        Some(Ended::Run(error)) => Some(error),
        Some(Ended::Criterion(what)) => return Err(stopped(what).into()),
        Some(Ended::Operator) if interruption.asked().is_some() => None,
        Some(Ended::Operator) => return Err(stopped("whoever operates it said no".into()).into()),
    };
    interrupt::after_runs(cut_short, interruption)?;
    let lost = || stopped("the wearers drawn came to no end".into());
    outcome.ok_or_else(|| lost().into())
}

/// Whoever types the command.
struct Beside<'a> {
    bar: &'a Bar,
    /// Whether a person is stimulated: only they rest, and only they are spoken to.
    is_board: bool,
    /// Of the bar that the protocol takes.
    part: f64,
    interruption: Interruption,
}

impl Operator for Beside<'_> {
    fn ready(&mut self, text: &str) -> bool {
        if self.is_board {
            eprintln!("{text}");
            if std::io::stdin().is_terminal() {
                eprintln!("Enter: go on; q and Enter: end here");
                let mut line = String::new();
                let read = std::io::stdin().lock().read_line(&mut line);
                return read.is_ok() && line.trim().is_empty() && !line.is_empty();
            }
        }
        self.interruption.asked().is_none()
    }

    fn rest(&mut self, rest_s: f64) -> bool {
        let until = Instant::now() + Duration::from_secs_f64(rest_s);
        if self.is_board {
            eprintln!("{rest_s} s of rest");
        }
        while self.is_board && Instant::now() < until && self.interruption.asked().is_none() {
            std::thread::sleep(Duration::from_millis(50));
        }
        self.interruption.asked().is_none()
    }

    fn progress(&mut self, part: f64) {
        self.bar.set(self.part * part);
    }

    fn interruption(&self) -> Interruption {
        self.interruption.clone()
    }
}

/// Shares and headline, in 80 columns.
pub(super) fn people(outcome: &Outcome, page: &str) -> String {
    let mut text = format!("{}\n\n", in_columns(&headline(outcome), 80));
    let mut point = "";
    for share in &outcome.shares {
        if share.at != point {
            point = &share.at;
            text += &format!("{point}\n");
        }
        let paper = match share.paper {
            Some(true) => "paper: yes",
            Some(false) => "paper: no",
            None => "",
        };
        let claim = match share.claim.chars().count() {
            ..=54 => share.claim.clone(),
            _ => share.claim.chars().take(53).chain(['…']).collect(),
        };
        let line = format!("{:>8}  {claim:<54}  {paper}", share.percent());
        text += &format!("{}\n", line.trim_end());
    }
    let who = match outcome.simulated {
        true => "Simulated: what came of assumed bodies, no evidence about people.",
        false => "One person: what was measured here, no more.",
    };
    text + &format!("\n{who}\nPage: {page}")
}
