//! `flexor selftest --bench-test`: guides a person through the bench test of a board on dummy loads.

use super::typed::{Closed, TypedLines};
use super::{Output, interrupt, usage_error};
use crate::selftest::bench::{Answer, Bench, BoardActivity, Pattern, Sheet, Step, Verdict};
use crate::selftest::bench::{read_value, steps};
use anyhow::Context;
use clap::Args;
use hal_sim::input;
use host_core::link::Interruption;
use host_core::run::{DeviceName, identity};
use serde_json::json;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Sentence that the operator types to confirm that no person is connected to the outputs.
const SENTENCE: &str = "nobody is connected";

/// Options of a bench test.
#[derive(Args, Debug)]
pub struct BenchOptions {
    /// Measure a board on dummy loads (--device is its port; native to rehearse): the program
    /// outputs a pattern, asks for your measurements, and writes --out
    #[arg(long, requires_all = ["out", "operator", "date", "instruments"])]
    pub bench_test: bool,
    /// With --bench-test: file for the measurements (JSON)
    #[arg(long, requires = "bench_test")]
    out: Option<PathBuf>,
    /// With --bench-test: continue the measurements in --out
    #[arg(long, requires = "bench_test")]
    resume: bool,
    /// With --bench-test: name of the operator
    #[arg(long, requires = "bench_test")]
    operator: Option<String>,
    /// With --bench-test: date for the file
    #[arg(long, requires = "bench_test")]
    date: Option<String>,
    /// With --bench-test: oscilloscope, probe and meter
    #[arg(long, requires = "bench_test")]
    instruments: Option<String>,
    /// With --bench-test: channel, 1 to 10
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u8).range(1..=10))]
    channel: u8,
    /// With --bench-test: confirm that nobody is connected to any output
    #[arg(long, requires = "bench_test")]
    nobody_connected: bool,
    /// With --bench-test: read the values from a file with lines `STEP VALUE UNIT` instead of asking
    #[arg(long, requires = "bench_test")]
    answers: Option<PathBuf>,
}

/// # Errors
/// Fails if nobody confirms that no person is connected, if there is no board or it refuses, if a
/// value is missing or outside its bounds, or if a signal arrives.
pub fn main(options: &BenchOptions, device: &DeviceName, output: Output) -> anyhow::Result<()> {
    if matches!(device, DeviceName::Chip | DeviceName::Qemu) {
        return usage_error(format!(
            "--device is {device}; allowed with --bench-test: a port, or native to rehearse"
        ));
    }
    let (Some(out), details) = (options.out.as_deref(), operator_details(options)?) else {
        return usage_error("--bench-test needs --out"); // clap has checked
    };
    if out.exists() && !options.resume {
        return usage_error(format!(
            "--out {} already exists; give another name, or --resume to continue it",
            out.display()
        ));
    }
    let interruption = interrupt::catch_signals()?;
    let mut asking = AnswerSource {
        typed: None,
        answers: options.answers.as_deref().map(read_answers).transpose()?,
        interruption: interruption.clone(),
    };
    asking.confirm_nobody_connected(options)?;
    let mut bench = Bench::open(device, interruption)?;
    let Some(stage) = bench.stage(options.channel) else {
        return usage_error(format!(
            "--channel is {}, where the board has no output stage; `flexor stages` lists them",
            options.channel
        ));
    };
    let pattern = Pattern::new(options.channel, stage);
    if let Some(answers) = &asking.answers {
        check_answers(&pattern, answers)?;
    }
    let is_in_process = bench.is_in_process();
    let identity = identity(&bench.info, is_in_process);
    let next = Sheet::begin(details, identity, &pattern);
    let mut sheet = match options.resume {
        true => Sheet::resume(out, &next, &pattern)?,
        false => next,
    };
    sheet.write(out)?;
    let walked = measure_steps(&mut bench, &mut asking, &pattern, &mut sheet, out);
    let ended = bench.end(); // before any error is returned
    walked?;
    ended?;
    conclude(&sheet, &pattern, out, output)
}

/// Returns the operator, the date and the instruments.
fn operator_details(options: &BenchOptions) -> anyhow::Result<[&str; 3]> {
    let fields = [
        ("--operator", &options.operator),
        ("--date", &options.date),
        ("--instruments", &options.instruments),
    ];
    for (name, text) in fields {
        if !text.as_deref().is_some_and(Sheet::is_valid_text) {
            return usage_error(format!(
                "{name} must have 1 to 200 characters and no control characters"
            ));
        }
    }
    Ok(fields.map(|(_, text)| text.as_deref().unwrap_or_default()))
}

/// Measures every step that has no answer yet, load by load.
fn measure_steps(
    bench: &mut Bench,
    asking: &mut AnswerSource,
    pattern: &Pattern,
    sheet: &mut Sheet,
    out: &Path,
) -> anyhow::Result<()> {
    let mut load_ohm = None;
    for step in steps(pattern) {
        if sheet.has_answer(&step.id) {
            continue;
        }
        let is_new = load_ohm != Some(step.load_ohm);
        if is_new || step.doing != BoardActivity::Plays {
            bench.end()?;
            if is_new {
                asking.wait_for_load(pattern, step.load_ohm)?;
                bench.set_load(step.load_ohm);
            }
            bench.begin(*pattern)?;
            load_ohm = Some(step.load_ohm);
        }
        print_step(&step);
        bench.perform(step.doing)?;
        let Some(measured) = asking.ask_value(bench, &step)? else {
            continue; // the operator skipped this step
        };
        let answer = Answer::new(&step, measured);
        let (holds, low, high) = (answer.holds, answer.low, answer.high);
        let verdict = if holds { "passes" } else { "FAILS" };
        eprintln!(
            "  {measured} {}: {verdict}; allowed: {low} to {high}",
            step.unit
        );
        sheet.add_answer(answer, pattern);
        sheet.write(out)?;
    }
    Ok(())
}

fn print_step(step: &Step) {
    let Step { id, what, unit, .. } = step;
    eprintln!("{id}: {what}");
    eprintln!(
        "  expected {} {unit}, passes from {} to {} ({})",
        step.expected, step.low, step.high, step.source
    );
}

/// Source of the measured values: a file or the terminal.
struct AnswerSource {
    typed: Option<TypedLines>,
    /// Values from a file, by step.
    answers: Option<BTreeMap<String, String>>,
    interruption: Interruption,
}

impl AnswerSource {
    fn confirm_nobody_connected(&mut self, options: &BenchOptions) -> anyhow::Result<()> {
        if options.nobody_connected {
            return Ok(());
        }
        if self.answers.is_none() {
            eprintln!("Connect dummy loads only. To confirm, type: {SENTENCE}");
            if self.read_line(|| Ok(()))?.as_deref().map(str::trim) == Some(SENTENCE) {
                return Ok(());
            }
        }
        anyhow::bail!(
            "E784 it is not confirmed that nobody is connected, so no pulses were emitted; remove \
             every electrode, then give --nobody-connected or type `{SENTENCE}`"
        )
    }

    /// Waits until the operator has changed the load, while the outputs are silent.
    fn wait_for_load(&mut self, pattern: &Pattern, load_ohm: u32) -> anyhow::Result<()> {
        let channel = pattern.channel;
        eprintln!(
            "\nThe outputs are silent. Connect {load_ohm} ohm to the output of channel {channel}."
        );
        eprintln!("Press Enter to output {}", pattern.description());
        if self.answers.is_none() && self.read_line(|| Ok(()))?.is_none() {
            anyhow::bail!(
                "E783 the input ended; the measured values are kept: continue with --resume"
            );
        }
        Ok(())
    }

    /// Returns a measured value; `None` for a step that is skipped.
    fn ask_value(&mut self, bench: &mut Bench, step: &Step) -> anyhow::Result<Option<f64>> {
        if let Some(answers) = &self.answers {
            for _ in 0..10 {
                bench.keep_playing()?; // as long as a person would need
            }
            let typed = answers.get(&step.id);
            return Ok(typed.map(|typed| read_value(step, typed)).transpose()?);
        }
        loop {
            eprintln!("  value and unit, or `skip`:");
            let Some(line) = self.read_line(|| Ok(bench.keep_playing()?))? else {
                anyhow::bail!(
                    "E783 the input ended; the measured values are kept: continue with --resume"
                );
            };
            if line.trim() == "skip" {
                return Ok(None);
            }
            match read_value(step, &line) {
                Ok(value) => return Ok(Some(value)),
                Err(error) => eprintln!("  {error}"),
            }
        }
    }

    /// Returns the next typed line and calls `alive` while it waits; `None` at the end of the
    /// input.
    fn read_line(
        &mut self,
        mut alive: impl FnMut() -> anyhow::Result<()>,
    ) -> anyhow::Result<Option<String>> {
        let typed = self.typed.get_or_insert_with(TypedLines::start);
        loop {
            if let Some(signal) = self.interruption.received_signal() {
                let when = "during the bench test: the values are kept; continue with --resume";
                return Err(interrupt::EndedBySignal(signal, when.to_owned()).into());
            }
            match typed.next_line() {
                Ok(Some(line)) => return Ok(Some(line)),
                Ok(None) => {
                    alive()?;
                    std::thread::sleep(Duration::from_millis(2));
                }
                Err(Closed) => return Ok(None),
            }
        }
    }
}

/// Reads lines `STEP VALUE UNIT`; ignores empty lines and lines that begin with #.
fn read_answers(path: &Path) -> anyhow::Result<BTreeMap<String, String>> {
    let text = input::read_text(path, input::LONGEST_TYPED);
    let text = text.with_context(|| {
        format!(
            "E789 the file of answers {} cannot be read; check the path and the permissions",
            path.display()
        )
    })?;
    let mut answers = BTreeMap::new();
    let lines = text.lines().map(str::trim);
    for line in lines.filter(|line| !line.is_empty() && !line.starts_with('#')) {
        let (id, value) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
        let before = answers.insert(id.to_owned(), value.to_owned());
        anyhow::ensure!(
            before.is_none(),
            "E789 the file of answers {} has two values for the step {id}; delete one of them",
            path.display()
        );
    }
    Ok(answers)
}

/// Checks all answers before any output is driven.
fn check_answers(pattern: &Pattern, answers: &BTreeMap<String, String>) -> anyhow::Result<()> {
    let test_steps = steps(pattern);
    let known = |id: &String| test_steps.iter().find(|step| step.id == *id);
    let mistakes: Vec<String> = answers
        .iter()
        .filter_map(|(id, typed)| match known(id) {
            None => Some(format!("there is no step {id}")),
            Some(step) => {
                let read = read_value(step, typed);
                read.err().map(|error| format!("{id}: {error}"))
            }
        })
        .collect();
    anyhow::ensure!(
        mistakes.is_empty(),
        "E789 the file given with --answers has mistakes, so no pulses were emitted; correct \
         them:\n  {}",
        mistakes.join("\n  ")
    );
    Ok(())
}

/// Prints the verdict, and fails if a step is missing or outside its bounds.
fn conclude(sheet: &Sheet, pattern: &Pattern, out: &Path, output: Output) -> anyhow::Result<()> {
    let test_steps = steps(pattern);
    let missing: Vec<_> = test_steps
        .iter()
        .filter(|step| !sheet.has_answer(&step.id))
        .collect();
    let missing: Vec<_> = missing.iter().map(|step| step.id.as_str()).collect();
    let failed = sheet.answers.iter().filter(|answer| !answer.holds);
    let failed: Vec<_> = failed.map(|answer| answer.id.as_str()).collect();
    let place = out.display();
    output.print(
        || {
            let counts = format!(
                "{} of {} steps measured",
                sheet.answers.len(),
                test_steps.len()
            );
            match sheet.verdict {
                Verdict::Simulated => {
                    format!("{counts} on a simulator: no evidence about a board; {place}")
                }
                Verdict::Passed => format!("{counts}, all within their bounds; {place}"),
                Verdict::Failed | Verdict::Incomplete => format!("{counts}; {place}"),
            }
        },
        || {
            json!({
                "verdict": sheet.verdict, "simulated": sheet.device.simulated,
                "failed": failed, "missing": missing, "sheet": sheet,
            })
        },
    )?;
    anyhow::ensure!(
        failed.is_empty() && missing.is_empty(),
        "E788 the bench test is not passed; outside their bounds: {}; not measured: {}; repair the \
         board, or measure the missing steps with --resume",
        list_or_none(&failed),
        list_or_none(&missing)
    );
    Ok(())
}

fn list_or_none(ids: &[&str]) -> String {
    match ids {
        [] => "none".to_owned(),
        ids => ids.join(", "),
    }
}
