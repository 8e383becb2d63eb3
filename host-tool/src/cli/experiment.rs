//! `flexor experiment`: runs a paper's protocol, then repeats it with random wearers.

use super::operator::TerminalOperator;
use super::out::OutArgs;
use super::outcome::claims_text;
use super::wearer_args::{ForearmArgs, WearerArgs};
use super::{CommandOutput, Output, WrongUse, drawn, interrupt, moment, usage_error};
use anyhow::Context;
use clap::Args;
use hal_sim::input;
use host_core::link::Interruption;
use host_core::record::{
    Assumption, DeclaredFile, Ending, PaperRow, Place, Plan, Role, Run, replace_file, write_header,
    write_run,
};
use host_core::run::{DeviceName, wait_for_hello};
use host_core::session::SessionError;
use host_core::wearer::{Wearer, builtin_wearer};
use std::io::IsTerminal;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};
use studies::catalog::{Entry, StudyRequest};
use studies::experiments::{self, load_experiment};
use studies::laboratory::{
    ConductedTrial, Course, Experiment, LaboratoryError, Outcome, ProtocolEnd, Shard, Sweep,
    comparison, publish,
};

/// Run a paper's protocol on a device or on simulated wearers
#[derive(Args, Debug)]
pub struct ExperimentArgs {
    #[arg(help = study_names())]
    name: String,
    #[command(flatten)]
    wearer: WearerArgs,
    #[command(flatten)]
    forearms: ForearmArgs,
    /// Device: native, chip, qemu, a serial port, or tcp:HOST:PORT
    #[arg(long, default_value = "native")]
    device: DeviceName,
    /// Number of random wearers; default: the declaration's number, on a board none
    #[arg(long)]
    draws: Option<u64>,
    /// Seed of the order of trials, the noise and the random wearers; default: the declaration's
    #[arg(long)]
    seed: Option<u64>,
    #[command(flatten)]
    out: OutArgs,
    #[arg(skip)]
    again: Option<RepeatedRecord>,
}

/// Lists the names of all studies for the help text.
fn study_names() -> String {
    format!(
        "Study: {}, or a declaration file",
        experiments::all_study_names().join(", ")
    )
}

/// An earlier record, and its declaration files, that a rerun repeats.
#[derive(Clone, Debug)]
pub(super) struct RepeatedRecord {
    dir: PathBuf,
    declared: Vec<DeclaredFile>,
}

impl RepeatedRecord {
    /// Returns the record in `dir`, which was made from `plan`, as the one to repeat.
    pub fn new(dir: &Path, plan: &Plan) -> Self {
        Self {
            dir: dir.to_owned(),
            declared: plan.declared.clone(),
        }
    }
}

/// Prefix of an experiment's command in its record.
const COMMAND: &str = "experiment ";
/// File of the random wearers in the record's folder.
const DRAWS: &str = "draws.csv";
/// Largest number of random wearers.
const MOST_DRAWS: u64 = 100_000;

impl ExperimentArgs {
    fn study_request(&self) -> StudyRequest<'_> {
        StudyRequest {
            name: &self.name,
            wearer: self.wearer.name(),
            ablation: self.forearms.ablation(),
            participants: self.forearms.source(),
            device: &self.device,
            decided: (self.seed, self.draws),
        }
    }

    /// Returns the arguments that repeat the record in `dir` and write to `out`; `None` if another
    /// command made the record.
    pub fn from_record(dir: &Path, record: &Run, out: OutArgs) -> Option<Self> {
        let plan = record.plan.as_ref()?;
        let identity = record.trials.first()?.identity.as_ref()?;
        Some(Self {
            wearer: WearerArgs::default(),
            forearms: ForearmArgs::default(),
            name: plan.command.strip_prefix(COMMAND)?.to_owned(),
            device: DeviceName::from_kind(identity.kind)?,
            draws: Some(plan.draws?),
            seed: Some(record.seed?),
            out,
            again: Some(RepeatedRecord::new(dir, plan)),
        })
    }
}

/// Experiment that is ready to run, with everything that the command line decides.
pub(super) struct Order<'a> {
    pub experiment: Experiment,
    /// Command, as the record names it.
    pub command: String,
    pub device: &'a DeviceName,
    /// Seed of trial order, noise and random wearers; number of random wearers.
    pub decided: (u64, u64),
    /// Folder for the record.
    pub out: &'a OutArgs,
    /// The record that this run repeats, if any.
    pub again: Option<&'a RepeatedRecord>,
}

/// Result of a complete experiment.
pub(super) struct ExperimentResult {
    /// Trials that were conducted, in their sequence.
    pub course: Course,
    /// Wall time of the trials on this computer.
    pub took: Duration,
    /// Outcome of the trials and of the random wearers.
    pub outcome: Outcome,
}

/// Loads the experiment `name`; a rerun loads the one that the record keeps.
///
/// # Errors
/// Fails if there is no such experiment or its file is invalid.
pub(super) fn load_or_repeat(
    name: &str,
    again: Option<&RepeatedRecord>,
) -> Result<Experiment, LaboratoryError> {
    match again.filter(|again| !again.declared.is_empty()) {
        Some(again) => Ok(Experiment::from_record(&again.dir, &again.declared)?.with_name(name)),
        None => load_experiment(name),
    }
}

/// Returns the text of a wearer file, or of a built-in wearer with that name.
fn read_wearer_file(file: &str) -> Result<String, SessionError> {
    match builtin_wearer(file).filter(|_| !Path::new(file).is_file()) {
        Some(text) => Ok(text.to_owned()),
        None => Wearer::text(Path::new(file)),
    }
}

/// # Errors
/// Fails if the experiment or the device does not exist, a folder cannot be written, or a trial
/// ends early.
pub fn main(args: &ExperimentArgs, output: Output) -> anyhow::Result<()> {
    let asked = args.study_request();
    match Entry::find(&asked).map_err(WrongUse)? {
        Some(entry) => drawn::run_experiment(entry, &asked, &args.out, output),
        None => carry_out(args, output)?.print(output),
    }
}

/// Runs and records the experiment.
///
/// # Errors
/// Returns the errors of [`main`].
pub(super) fn carry_out(args: &ExperimentArgs, output: Output) -> anyhow::Result<CommandOutput> {
    let experiment = load_or_repeat(&args.name, args.again.as_ref())?;
    let experiment = match args.wearer.name() {
        Some(file) => {
            let text = read_wearer_file(file)?;
            experiment.with_wearer(file, &text)?
        }
        None => experiment,
    };
    let seed = args.seed.unwrap_or(experiment.declaration.seed);
    let declared = match args.device.is_port() {
        true => 0,
        false => experiment.declaration.draws,
    };
    let draws = args.draws.unwrap_or(declared);
    if draws > MOST_DRAWS {
        return usage_error(format!("--draws is {draws}; allowed: 0 to {MOST_DRAWS}"));
    }
    let order = Order {
        experiment,
        command: format!("{COMMAND}{}", args.name),
        device: &args.device,
        decided: (seed, draws),
        out: &args.out,
        again: args.again.as_ref(),
    };
    let name = order.experiment.declaration.name.clone();
    let (dir, outcome) = order.carry_out(&name, output, |dir, _, came| {
        Ok((dir.to_owned(), came.outcome.clone()))
    })?;
    let page = dir.join("result.html").display().to_string();
    Ok(CommandOutput {
        people: claims_text(&outcome, &page),
        machines: serde_json::json!({ "result": outcome, "page": page }),
    })
}

impl Order<'_> {
    /// Runs the experiment and records it in a folder; `name` names the folder if the user gave
    /// none. `then` adds to the record before it is closed.
    ///
    /// # Errors
    /// Fails if there is no device, a folder cannot be written, or a trial ends early.
    pub fn carry_out<T>(
        &self,
        name: &str,
        output: Output,
        then: impl FnOnce(&Path, &mut Run, &ExperimentResult) -> anyhow::Result<T>,
    ) -> anyhow::Result<T> {
        let (experiment, (seed, draws)) = (&self.experiment, self.decided);
        let interruption = interrupt::catch_signals()?;
        self.check_operator()?;
        self.check_device(&interruption)?;
        let begun = self.recorded_draws();
        let place = match self.out.dir().filter(|_| begun.is_some()) {
            Some(dir) => Place::claim(dir, true)?,
            None => self.out.claim_folder(name)?,
        };
        let dir = place.dir();
        let mut record = self.new_record();
        write_run(dir, &record)?;
        experiment.save_files(dir)?;
        if draws > 0 {
            self.sweep().begin(dir)?;
        }
        if let Some(rows) = begun.filter(|rows| !rows.is_empty()) {
            replace_file(&dir.join(DRAWS), rows.as_bytes())?;
        }
        let bar = output.bar(&experiment.declaration.name);
        let mut beside = TerminalOperator {
            bar: &bar,
            is_board: self.device.is_port(),
            part: if draws == 0 { 1.0 } else { 0.3 },
            interruption: interruption.clone(),
            typed: None,
        };
        let begin = Instant::now();
        let course = experiment.conduct(dir, (self.device, seed), &mut beside)?;
        let took = begin.elapsed();
        let trials = course.trials.iter();
        record.trials = trials.map(|played| played.trial.clone()).collect();
        let outcome = write_outcome(self, dir, &course, &beside);
        bar.finish();
        let ended = outcome.and_then(|outcome| require_complete(course, outcome, &interruption));
        let came = ended.map(|(course, outcome)| ExperimentResult {
            course,
            took,
            outcome,
        });
        let came = match came {
            Ok(came) => came,
            Err(error) => return Err(interrupt::close_failed_record(dir, record, error)),
        };
        add_comparison(experiment, &mut record, &came);
        let result = then(dir, &mut record, &came);
        let value = result.inspect_err(|_| super::print_record_place(dir))?;
        record.ending = Ending::complete();
        write_header(dir, &record)?;
        interrupt::close_record(dir, &mut record)
            .inspect_err(|_| super::print_record_place(dir))?;
        Ok(value)
    }

    /// Returns the rows of the random wearers if this experiment was interrupted in its folder.
    fn recorded_draws(&self) -> Option<String> {
        let is_mine = !self.out.overwrites() && !self.device.is_port();
        let dir = self.out.dir().filter(|_| is_mine)?;
        let is_same = Sweep::read(dir).is_ok_and(|sweep| sweep == self.sweep());
        (is_same && Ending::load(dir).is_incomplete())
            .then(|| input::read_text(&dir.join(DRAWS), input::LONGEST_TABLE).unwrap_or_default())
    }

    fn sweep(&self) -> Sweep {
        let (seed, draws) = self.decided;
        Sweep::new(&self.experiment, seed, draws, Shard::WHOLE)
    }

    /// Checks that a person can answer the protocol's prompts on a board.
    fn check_operator(&self) -> anyhow::Result<()> {
        let protocol = &self.experiment.declaration.protocol;
        let asks = self.device.is_port() && protocol.prompt.is_some();
        anyhow::ensure!(
            !asks || std::io::stdin().is_terminal(),
            "E615 the protocol's prompts on {} need an operator at a terminal; run the command in \
             a terminal, or remove `prompt` from the declaration",
            self.device
        );
        Ok(())
    }

    /// Checks that the device answers before a record is replaced.
    fn check_device(&self, interruption: &Interruption) -> anyhow::Result<()> {
        if self.out.overwrites()
            && self.device.is_port()
            && let Some(first) = self.experiment.sessions(&[])?.first()
        {
            wait_for_hello(
                self.device.open(&first.session, self.decided.0)?,
                interruption,
            )?;
        }
        Ok(())
    }

    /// Returns the record before its first trial.
    fn new_record(&self) -> Run {
        let device = self.device.to_string();
        let (seed, draws) = self.decided;
        let plan = Plan {
            draws: Some(draws),
            declared: self.experiment.declared_files(),
            ..Plan::new(&self.command, &device)
        };
        let declaration = &self.experiment.declaration;
        let mut record = Run::begin(&declaration.title, &device, Some(seed), plan, moment::now());
        record.explained.clone_from(&declaration.explained);
        record.host.rerun_of = self.again.map(|again| again.dir.display().to_string());
        record
    }
}

/// Adds to the record the values that the paper printed for its trials, the assumptions about the
/// simulated wearer, and the results.
fn add_comparison(experiment: &Experiment, record: &mut Run, came: &ExperimentResult) {
    for measurement in &came.course.trials {
        let condition = experiment.conditions.get(measurement.place.condition);
        let levels = condition.map_or(&[][..], |condition| &condition.levels);
        let printed = experiment.declaration.printed_of(levels);
        let printed = printed.filter(|printed_value| printed_value.measure == "rmse_deg");
        record.paper.extend(printed.map(|printed| PaperRow {
            trial: measurement.trial.name.clone(),
            values: printed.values.clone(),
            source: printed.source.clone(),
        }));
    }
    let assumption = |role, text: String| Assumption { role, text };
    let put_in = experiment.declaration.assumed.iter().cloned();
    record.assumptions = put_in.map(|text| assumption(Role::PutIn, text)).collect();
    record.finding = comparison(&came.outcome).map(|comparison| comparison.sentence());
    let shares = came.outcome.shares.iter();
    record.assumptions.extend(shares.map(|share| {
        let (at, claim, holds, cases) = (&share.at, &share.claim, share.holds, share.of);
        let at = Some(at).filter(|at| !at.is_empty());
        let at = at.map_or_else(String::new, |at| format!(" ({at})"));
        let text = format!("{claim}{at}: in {holds} of {cases} cases.");
        assumption(Role::CameOut, text)
    }));
}

/// Computes and writes the outcome of trials and random wearers, even if they are incomplete.
fn write_outcome(
    order: &Order<'_>,
    dir: &Path,
    course: &Course,
    beside: &TerminalOperator<'_>,
) -> anyhow::Result<Option<Outcome>> {
    let (experiment, (seed, draws)) = (&order.experiment, order.decided);
    let simulated = all_simulated(&course.trials, beside.is_board);
    let on = (&*order.device.to_argument(), seed);
    let mut outcome = Outcome::from_trials(experiment, on, &course.trials, simulated);
    let (done, total) = (course.trials.len(), course.of);
    if course.ended.is_some() {
        let how_far =
            format!("Cut short: {done} of {total} trials began; the last may be incomplete.");
        outcome.cut_short = Some(how_far);
    } else if draws > 0 {
        let how_far = "Cut short: the random wearers are missing.";
        outcome.cut_short = Some(how_far.to_owned());
    }
    // Published now, so that it exists even if the program ends early.
    publish(dir, &outcome, &course.trials)?;
    if draws == 0 || course.ended.is_some() {
        return Ok(Some(outcome));
    }
    let swept = order
        .sweep()
        .run(experiment, dir, &course.trials, &mut |part| {
            beside.bar.set(beside.part + (1.0 - beside.part) * part);
            beside.interruption.received_signal().is_none()
        })?;
    Ok(swept.outcome)
}

/// Returns whether all trials are simulated; `None` if a device behind a port has not answered.
fn all_simulated(trials: &[ConductedTrial], is_port: bool) -> Option<bool> {
    let trials = trials.iter().map(|played| &played.trial);
    let is_simulated = trials.map(|trial| match &trial.identity {
        Some(identity) => Some(identity.simulated),
        None => (!is_port).then_some(true),
    });
    let flags: Option<Vec<bool>> = is_simulated.collect();
    match flags {
        Some(values) if values.is_empty() => (!is_port).then_some(true),
        said => said.map(|said| said.into_iter().all(|is_simulated| is_simulated)),
    }
}

/// Returns the course and the outcome if both are complete, or the reason why not.
fn require_complete(
    course: Course,
    outcome: Option<Outcome>,
    interruption: &Interruption,
) -> anyhow::Result<(Course, Outcome)> {
    let (done, total) = (course.trials.len(), course.of);
    let stopped = |why: String| LaboratoryError::Stopped {
        why,
        done,
        of: total,
    };
    let cut_short = match course.ended {
        None => None,
        Some(ProtocolEnd::Run(error)) => Some(error),
        Some(ProtocolEnd::Criterion(what)) => return Err(stopped(what).into()),
        Some(ProtocolEnd::Operator) if interruption.received_signal().is_some() => None,
        Some(ProtocolEnd::Operator) => {
            return Err(stopped("the operator answered no".into()).into());
        }
    };
    let cut_short_in = cut_short.is_some();
    let how_far = || match (done, cut_short_in) {
        (0, _) => format!("before the first of {total} trials"),
        (_, true) => format!("in trial {done} of {total}"),
        (_, false) => format!("after trial {done} of {total}"),
    };
    if let (None, true, Some(signal)) = (&cut_short, done < total, interruption.received_signal()) {
        let when = "between two trials: nothing was stimulated".to_owned();
        return Err(interrupt::EndedBySignal(signal, when)).with_context(how_far);
    }
    interrupt::check_interrupted(cut_short, interruption).with_context(how_far)?;
    let lost = || stopped("the random wearers were not completed".into());
    let outcome = outcome.ok_or_else(lost)?;
    let ended = None;
    Ok((Course { ended, ..course }, outcome))
}
