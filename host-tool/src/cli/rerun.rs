//! `flexor rerun`: repeats a recorded run from its folder alone.

use super::chip::ChipArgs;
use super::demo::{self, Demo};
use super::experiment::{self, ExperimentArgs};
use super::out::OutArgs;
use super::perform::{Controls, Order, RunResult, perform};
use super::{CommandOutput, Incomplete, Output, moment};
use anyhow::Context;
use clap::Args;
use host_core::choice;
use host_core::record::{
    DeviceKind, Difference, PROGRAM_COMMAND, Place, Plan, Program, RecordError, Run, compare_rows,
    load, sha256, trial_folder,
};
use host_core::run::{DeviceName, Keys, SessionFile};
use host_core::session::{KEPT_AS, LawName};
use std::path::{Path, PathBuf};
use studies::laboratory::{compared_files, differs};

/// Repeat a simulated run from its record and compare the results
#[derive(Args, Debug)]
pub struct Rerun {
    /// Folder of the record
    record: PathBuf,
    #[command(flatten)]
    out: OutArgs,
}

/// The reason why a record cannot be repeated or the rerun differs.
#[derive(Debug, thiserror::Error)]
enum RerunError {
    #[error(
        "E595 {0} is not the {1} file of this run: it is missing or its SHA-256 differs; use an \
         unchanged copy of the folder"
    )]
    Altered(PathBuf, &'static str),
    #[error("E596 the rerun differs from the record: {differs}; {why}")]
    Differs { differs: Difference, why: String },
    #[error(
        "E597 {dir} is the record of a board ({id}), and the wearer's reaction cannot be repeated; \
         run its session with flexor run {dir}/01-*/session.toml --device PORT"
    )]
    Board { dir: PathBuf, id: String },
    #[error(
        "E812 {dir} is the record of a breadboard ({board}), which only that board or its simulator \
         can repeat; run its session with flexor run {dir}/01-*/session.toml --device PORT, or \
         --device chip --board"
    )]
    Breadboard { dir: PathBuf, board: String },
    #[error(
        "E598 {dir} was recorded in real time through {device}, which cannot be repeated to the \
         microsecond; run its session with flexor run {dir}/01-*/session.toml"
    )]
    RealTime { dir: PathBuf, device: String },
    #[error(
        "E589 {dir} was recorded by a program of its own (`{command}`), whose calls it does not \
         contain; run that program again"
    )]
    OwnProgram { dir: PathBuf, command: String },
    #[error(
        "E599 {dir} does not contain {what}: it was written by an older flexor, or changed; run \
         the session again"
    )]
    Unknown { dir: PathBuf, what: &'static str },
}

/// # Errors
/// Fails if there is no record, it is damaged or cannot be repeated, the rerun differs, or the
/// rerun would replace its own record.
pub fn main(args: &Rerun, output: Output) -> anyhow::Result<()> {
    let dir = args.record.as_path();
    let record = load(dir)?;
    args.out
        .check_not_record(std::slice::from_ref(&args.record))?;
    check_source_files(dir, &record)?;
    if let Some(damaged) = record.damage_error(dir) {
        return Err(damaged.into());
    }
    let plan = repeatable_plan(dir, &record)?;
    let now = Program::current();
    if now != record.program {
        let (then, now) = (record.program.words(), now.words());
        eprintln!("note: recorded by flexor {then}, repeated by {now}: results may differ");
    }
    let out = if args.out.is_given() {
        args.out.clone()
    } else {
        OutArgs::in_folder(rerun_folder(dir)?)
    };
    let report = if let Some(again) = Demo::from_record(dir, &record, out.clone()) {
        demo::carry_out(&again, output)?
    } else if let Some(again) = ExperimentArgs::from_record(dir, &record, out.clone()) {
        experiment::carry_out(&again, output)?
    } else {
        let performed = rerun_session(dir, &record, &plan, &out, output)?;
        if performed.ended.is_err() && !record.ending.is_incomplete() {
            return performed.print(output);
        }
        let (again, new) = (&performed.record, performed.place.dir());
        let result = CommandOutput {
            people: String::new(),
            machines: performed.to_json(),
        };
        return print_comparison((dir, &record), (new, again), result, output);
    };
    let new = out
        .dir()
        .context("E577 the rerun has no folder for its record; give one with --out")?;
    print_comparison((dir, &record), (new, &load(new)?), report, output)
}

/// Returns the plan of a record, if it can be repeated.
fn repeatable_plan(dir: &Path, record: &Run) -> Result<Plan, RerunError> {
    let dir = dir.to_owned();
    let identity = record.trials.iter().find_map(|t| t.identity.as_ref());
    if let Some(board) = identity.filter(|identity| identity.kind == DeviceKind::Board) {
        let id = board.unique_id.clone().unwrap_or_default();
        return Err(RerunError::Board { dir, id });
    }
    if let Some(board) = identity.filter(|identity| identity.kind == DeviceKind::Breadboard) {
        let board = board.board.clone();
        return Err(RerunError::Breadboard { dir, board });
    }
    if !record.is_repeatable() {
        let device = record.device.clone();
        return Err(RerunError::RealTime { dir, device });
    }
    let part = "the command that made it";
    let Some(plan) = record.plan.clone() else {
        return Err(RerunError::Unknown { dir, what: part });
    };
    if plan.command == PROGRAM_COMMAND {
        let command = record.host.arguments.join(" ");
        return Err(RerunError::OwnProgram { dir, command });
    }
    Ok(plan)
}

/// Checks that the session and wearer files are unchanged since the run.
fn check_source_files(dir: &Path, record: &Run) -> Result<(), RerunError> {
    if !record.is_repeatable() || record.plan.is_none() {
        return Ok(()); // the caller refuses such a record
    }
    for (position, trial) in record.trials.iter().enumerate() {
        let sum = sha256(trial.session_text.as_bytes());
        if trial.session_sha256.as_deref() != Some(&sum) {
            let folder = trial_folder(dir, position, &trial.name);
            return Err(RerunError::Altered(folder.join("session.toml"), "session"));
        }
        if let Some(wearer) = &trial.wearer
            && wearer.sha256 != sha256(wearer.text.as_bytes())
        {
            let folder = trial_folder(dir, position, &trial.name);
            return Err(RerunError::Altered(folder.join(KEPT_AS), "wearer"));
        }
    }
    Ok(())
}

/// Runs the session of a record again, with its original options.
fn rerun_session(
    dir: &Path,
    record: &Run,
    plan: &Plan,
    out: &OutArgs,
    output: Output,
) -> anyhow::Result<RunResult> {
    let unknown = |part| RerunError::Unknown {
        dir: dir.to_owned(),
        what: part,
    };
    let trial = record.trials.first().ok_or(unknown("a trial"))?;
    let mut session = SessionFile::from_trial(trial)?;
    if let Some(law) = &plan.law {
        let law = LawName::from_name(law).ok_or(unknown("a controller that this flexor knows"))?;
        session.session = session.session.with_law(law)?;
    }
    if !choice::restore_choice(&mut session.session, trial) {
        output.settle_models(&mut session.session)?; // an older record
    }
    let kind = trial.identity.as_ref().map(|identity| identity.kind);
    let device = kind.and_then(DeviceName::from_kind);
    let device = device.ok_or(unknown("the device that ran it"))?;
    let chip = ChipArgs::with_image(plan.image.then(|| dir.join("image.elf")));
    record.seed.ok_or(unknown("its seed"))?;
    let (ordered, now) = (plan.clone(), moment::now());
    let mut again = Run::begin(&record.title, &record.device, record.seed, ordered, now);
    again.study = record.study.clone();
    again.host.rerun_of = Some(dir.display().to_string());
    let vcd = out.dir().filter(|_| plan.vcd);
    let vcd = vcd.map(|new| new.join("outputs.vcd"));
    let order = Order {
        session: &session,
        device: &device,
        chip: &chip,
        vcd: vcd.as_deref(),
        replaces: out.overwrites(),
        controls: Controls::Repeated(Keys::from_markers(&trial.markers)),
    };
    perform(&order, again, |title| out.claim_folder(title), output)
}

/// Prints the result of the rerun, then the comparison.
fn print_comparison(
    (dir, record): (&Path, &Run),
    (new, again): (&Path, &Run),
    mut report: CommandOutput,
    output: Output,
) -> anyhow::Result<()> {
    let is_cut = record.ending.is_incomplete();
    let differs = match compare_rows(record, again) {
        None => differs(dir, new, is_cut)?,
        differs => differs,
    };
    report.machines["rerun_of"] = dir.display().to_string().into();
    report.machines["same"] = differs.is_none().into();
    if let Some(differs) = differs {
        let (error, result) = (
            difference_error(record, again, differs).into(),
            report.machines,
        );
        return Err(Incomplete { error, result }.into());
    }
    let rows: usize = record.trials.iter().map(|t| t.samples.len()).sum();
    let mut contents = match is_cut {
        true => "samples (all that the record has)".to_owned(),
        false => "samples and every edge".to_owned(),
    };
    for file in compared_files(is_cut)
        .iter()
        .filter(|text| dir.join(text).is_file())
    {
        contents += &format!(", {file}");
    }
    if !report.people.is_empty() {
        report.people += "\n\n";
    }
    let (dir, new) = (dir.display(), new.display());
    report.people += &format!("identical: {rows} {contents} of {dir}; the rerun is in {new}");
    report.print(output)
}

/// Explains why a rerun may differ from its record.
fn difference_error(record: &Run, again: &Run, differs: Difference) -> RerunError {
    let same = record.program == again.program;
    let why = match record.program.modified {
        _ if !same => format!(
            "it was recorded by flexor {} and repeated by {}",
            record.program.words(),
            again.program.words()
        ),
        Some(false) => "the computer differs, or a file that is in neither record".to_owned(),
        _ => "the program was built from modified sources, so the programs may differ".to_owned(),
    };
    RerunError::Differs { differs, why }
}

/// Creates a new folder beside `dir`.
fn rerun_folder(dir: &Path) -> Result<PathBuf, RecordError> {
    let dir = dir.canonicalize().map_err(RecordError::io(dir))?;
    let name = dir.file_name().unwrap_or_default().to_string_lossy();
    let base = dir.parent().unwrap_or(Path::new("."));
    let place = Place::create_new(base, &format!("{name}-rerun"), moment::now())?;
    Ok(place.dir().to_owned())
}
