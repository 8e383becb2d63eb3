//! `flexor demo`: runs experiment 4 of Hamana 2022 as declared, on the native simulator, and
//! reports the simulator's speed and the README's picture.

use super::experiment::{ExperimentResult, Order, RepeatedRecord, load_or_repeat};
use super::out::OutArgs;
use super::{CommandOutput, Output};
use anyhow::Context;
use clap::Args;
use hal_sim::world::World;
use host_core::link::Port;
use host_core::record::{Run, Trial};
use host_core::report;
use host_core::run::{DeviceName, SessionFile, edges_of_one_period, run};
use host_core::session::LawName;
use std::path::Path;
use std::time::{Duration, Instant};
use studies::laboratory::{ConductedTrial, Experiment, comparison};

/// Run Hamana 2022's finger experiment on the simulated board
///
/// Writes a record and a report with figures.
#[derive(Args, Debug)]
pub struct Demo {
    #[command(flatten)]
    out: OutArgs,
    /// Seed of the simulated finger's sensor noise and of the order of trials
    #[arg(long, default_value_t = 1)]
    seed: u64,
    #[arg(skip)]
    again: Option<RepeatedRecord>,
}

/// Name of the command in the record, and the experiment that it runs.
const COMMAND: &str = "demo";
const EXPERIMENT: &str = "hamana-4";

impl Demo {
    /// Returns the demo that repeats the record in `dir` and writes to `out`; `None` if another
    /// command made the record.
    pub fn from_record(dir: &Path, record: &Run, out: OutArgs) -> Option<Self> {
        let plan = record.plan.as_ref()?;
        (plan.command == COMMAND).then_some(Self {
            out,
            seed: record.seed?,
            again: Some(RepeatedRecord::new(dir, plan)),
        })
    }
}

/// Session of the picture: ten channels, three of them on the forearm.
const TEN_AND_HAND: (&str, &str) = (
    "ten_channels_and_hand.toml",
    include_str!("../../sessions/ten_channels_and_hand.toml"),
);
/// Session for the simulator's speed: ten channels, three of them on a finger.
const TEN_AND_FINGER: (&str, &str) = (
    "ten_channels_and_finger.toml",
    include_str!("../../sessions/ten_channels_and_finger.toml"),
);

/// # Errors
/// Fails if a session does not run or a folder cannot be written.
pub fn main(args: &Demo, output: Output) -> anyhow::Result<()> {
    carry_out(args, output)?.print(output)
}

/// Runs and records the demo.
///
/// # Errors
/// Returns the errors of [`main`].
pub(super) fn carry_out(args: &Demo, output: Output) -> anyhow::Result<CommandOutput> {
    let begin = Instant::now();
    let order = Order {
        experiment: load_or_repeat(EXPERIMENT, args.again.as_ref())?,
        command: COMMAND.to_owned(),
        device: &DeviceName::Native,
        decided: (args.seed, 0),
        out: &args.out,
        again: args.again.as_ref(),
    };
    let mut about = None;
    let mut report = order.carry_out(COMMAND, output, |dir, record, came| {
        let simulated: f64 = record.trials.iter().map(|trial| trial.duration_s).sum();
        let speed_factor = simulated / came.took.as_secs_f64();
        record.host.speed_factor = Some(speed_factor);
        let (picture, ten) = picture(args.seed)?;
        let path = dir.join("picture.svg");
        std::fs::write(&path, picture)
            .with_context(|| format!("cannot write {}", path.display()))?;
        let compared = comparison(&came.outcome);
        about = compared.as_ref().map(|comparison| comparison.in_columns());
        Ok(serde_json::json!({
            "comparison": compared, "trials": trial_rows(&order.experiment, came), "report": dir.join("report.html"),
            "speed_factor": speed_factor, "ten_channel_simulator_speed_factor": ten.simulator,
            "ten_channel_speed_factor": ten.whole,
        }))
    })?;
    report["seconds"] = begin.elapsed().as_secs_f64().into();
    Ok(CommandOutput {
        people: about.map_or_else(String::new, |text| text + "\n") + &text_report(&report),
        machines: report,
    })
}

/// Returns one row for each trial, in the order of the conditions.
fn trial_rows(experiment: &Experiment, came: &ExperimentResult) -> Vec<serde_json::Value> {
    let is_rmse = |measure: &str| measure == "rmse_deg";
    let mut trials: Vec<&ConductedTrial> = came.course.trials.iter().collect();
    trials.sort_by_key(|measurement| measurement.place.condition);
    let row = |measurement: &&ConductedTrial| {
        let condition = experiment.conditions.get(measurement.place.condition);
        let measures = experiment.measures().zip(&measurement.measured);
        let rmse = measures.filter(|(measure, _)| is_rmse(measure.id));
        let declaration = &experiment.declaration;
        let mut printed = condition
            .into_iter()
            .flat_map(|condition| declaration.printed_of(&condition.levels))
            .filter(|printed| is_rmse(&printed.measure));
        serde_json::json!({
            "trial": measurement.trial.name,
            "rmse_deg": rmse.filter_map(|(_, number)| *number).next(),
            "paper_mean_deg": printed.next().and_then(|printed| printed.mean()),
            "pulses": measurement.trial.pulses,
        })
    };
    trials.iter().map(row).collect()
}

/// Simulated time divided by wall time, with ten channels at 50 Hz, ten muscle models and the
/// finger.
#[derive(Clone, Copy)]
struct Speed {
    /// Speed of the simulator alone, which consists of device, wire and wearer.
    simulator: f64,
    /// Speed together with the host program, which streams setpoints and records.
    whole: f64,
}

/// A port that measures how much wall time the simulated world takes.
struct Stopwatch {
    port: Box<dyn Port>,
    in_world: Duration,
}

impl Port for Stopwatch {
    fn now_us(&mut self) -> u64 {
        self.port.now_us()
    }

    fn send(&mut self, frame: &[u8]) -> std::io::Result<()> {
        self.port.send(frame)
    }

    fn receive(&mut self, until_us: u64) -> std::io::Result<Vec<u8>> {
        let begin = Instant::now();
        let bytes = self.port.receive(until_us);
        self.in_world += begin.elapsed();
        bytes
    }

    fn world(&mut self) -> Option<&mut World> {
        self.port.world()
    }
}

/// Returns docs/demo.svg, the README's picture: ten channels and the forearm in one session, under
/// the default controller and under the paper's controller.
///
/// # Errors
/// Fails if a session does not run.
pub fn overview_svg(seed: u64) -> anyhow::Result<String> {
    Ok(picture(seed)?.0)
}

/// Returns the picture, and the speed of a simulation with ten channels and a finger.
fn picture(seed: u64) -> anyhow::Result<(String, Speed)> {
    let (_, speed) = run_ten_channels(TEN_AND_FINGER, LawName::Recommended, seed)?;
    let (default, _) = run_ten_channels(TEN_AND_HAND, LawName::Recommended, seed)?;
    let (paper, _) = run_ten_channels(TEN_AND_HAND, LawName::Paper, seed)?;
    Ok((report::overview_picture(&default, &paper), speed))
}

/// Runs a ten-channel session under a control law, and keeps the edges of one period.
fn run_ten_channels(
    (name, text): (&str, &str),
    law: LawName,
    seed: u64,
) -> anyhow::Result<(Trial, Speed)> {
    let mut session = SessionFile::parse(name, text)?;
    session.session = session.session.with_law(law)?;
    let timed = Stopwatch {
        port: DeviceName::Native.open(&session.session, seed)?,
        in_world: Duration::ZERO,
    };
    let begin = Instant::now();
    let (outcome, timed) = run(&session, timed, None, |_| ());
    let wall = begin.elapsed();
    if let Some(error) = outcome.error {
        return Err(error).context(name.to_owned());
    }
    let mut trial = outcome.trial;
    let in_world = timed.as_ref().map_or(wall, |timed| timed.in_world);
    if let (Some(mut timed), Some(epoch)) = (timed, outcome.epoch_us)
        && let Some(world) = timed.world()
    {
        let trace = &world.recorder.trace;
        trial.edges = edges_of_one_period(&session.session, trace, epoch, 20_000_000);
    }
    let speed = Speed {
        simulator: trial.duration_s / in_world.as_secs_f64(),
        whole: trial.duration_s / wall.as_secs_f64(),
    };
    Ok((trial, speed))
}

/// Formats the JSON result as text for people.
fn text_report(report: &serde_json::Value) -> String {
    let number = |value: &serde_json::Value| value.as_f64().unwrap_or(f64::NAN);
    let mut text = format!(
        "{:<34} {:>10} {:>18} {:>8}\n",
        "RMSE of each trial, degrees", "simulated", "paper, table 8", "pulses"
    );
    for row in report["trials"].as_array().into_iter().flatten() {
        let name = row["trial"].as_str().unwrap_or_default();
        let [rmse, mean, pulses] =
            ["rmse_deg", "paper_mean_deg", "pulses"].map(|key| number(&row[key]));
        text += &format!("{name:<34} {rmse:>10.2} {mean:>12.1} (mean) {pulses:>8}\n");
    }
    text + &format!(
        "\nSimulated, no evidence about people: the most typical forearm model of those\n\
         that agree with the voltages printed for participant P. Its finger bends by 24°\n\
         (5 to 90° in 90 % of them), where the reference asks for up to 85°.\n\
         The effect of two points is computed; most parameters of the forearm are\n\
         assumed. Six 30 s sessions ran at {:.0} x real time. Ten channels at 50 Hz with\n\
         ten muscles and a finger: simulator alone {:.0} x, with the host program {:.0} x\n\
         real time. Total: {:.2} s.\n\
         Report: {}",
        number(&report["speed_factor"]),
        number(&report["ten_channel_simulator_speed_factor"]),
        number(&report["ten_channel_speed_factor"]),
        number(&report["seconds"]),
        report["report"].as_str().unwrap_or_default(),
    )
}
