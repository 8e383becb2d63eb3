//! `flexor demo`: experiment 4 of Hamana 2022 on the native simulator.

use super::out::OutArgs;
use super::{Bar, Output, interrupt};
use anyhow::Context;
use clap::Args;
use hal_sim::body::finger::TWO_POINT_FACTOR;
use hal_sim::world::World;
use host_core::analysis::metrics_but_lag;
use host_core::link::{Interruption, Port};
use host_core::record::{Assumption, Ending, PaperRow, Plan, Role, Run, Trial, write_run};
use host_core::report::{self, Report};
use host_core::run::{
    DeviceName, Recorded, RunError, SessionFile, TrialPlace, edges_of_one_period, interruptible,
    run,
};
use host_core::session::LawName;
use rayon::prelude::*;
use std::path::Path;
use std::time::{Duration, Instant};

/// Run Hamana 2022's finger experiment on the simulated board, with a report.
#[derive(Args, Debug)]
pub struct Demo {
    #[command(flatten)]
    out: OutArgs,
    /// Seed of the simulated finger's sensor noise
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Of which record this is a rerun.
    #[arg(skip)]
    rerun_of: Option<String>,
}

impl Demo {
    /// The demo of a record, again, in `out`.
    pub fn again(record: &Run, out: OutArgs, of: String) -> Self {
        Self {
            out,
            seed: record.seed,
            rerun_of: Some(of),
        }
    }
}

#[rustfmt::skip]
const SESSIONS: [(&str, &str, &str); 3] = [
    ("one-point A", "hamana_exp4_one_point_a.toml", include_str!("../../sessions/hamana_exp4_one_point_a.toml")),
    ("one-point B", "hamana_exp4_one_point_b.toml", include_str!("../../sessions/hamana_exp4_one_point_b.toml")),
    ("two-point", "hamana_exp4_two_point.toml", include_str!("../../sessions/hamana_exp4_two_point.toml")),
];

/// Ten channels, three of them on the finger.
const TEN_CHANNELS: (&str, &str) = (
    "ten_channels_and_finger.toml",
    include_str!("../../sessions/ten_channels_and_finger.toml"),
);

const LAWS: [(LawName, &str); 2] = [
    (LawName::Recommended, "recommended law"),
    (LawName::Paper, "paper's law"),
];

/// Hamana 2022, table 8, participant P, degrees: the better of A and B for one
/// point, and two points.
const TABLE_8_ONE: [f64; 5] = [8.40, 19.0, 20.5, 13.5, 26.6];
const TABLE_8_TWO: [f64; 5] = [9.00, 11.0, 12.6, 10.6, 10.2];

/// # Errors
/// A session that does not run, a folder that cannot be written.
pub fn main(args: &Demo, output: Output) -> anyhow::Result<()> {
    let begin = Instant::now();
    let place = args.out.place("demo")?;
    let dir = place.dir();
    let bar = output.bar("Hamana 2022, experiment 4");
    let interruption = interrupt::heed()?;
    let title = "Hamana 2022, experiment 4: following 45 ± 40° with one and two points";
    let device = DeviceName::Native.to_string();
    let mut record = Run::begin(title, &device, args.seed, Plan::of("demo", &device));
    record.host.rerun_of = args.rerun_of.clone();
    write_run(dir, &record)?;
    let (trials, error) = all_trials(dir, args.seed, &interruption, &bar)?;
    bar.finish();
    let simulated: f64 = trials.iter().map(|(trial, _)| trial.duration_s).sum();
    let wall: f64 = trials.iter().map(|(_, wall)| wall).sum();
    record.trials = trials.into_iter().map(|(trial, _)| trial).collect();
    record.host.speed_factor = Some(simulated / wall);
    let ten = ten_channel_speed(args.seed)?;
    if let Err(error) = interrupt::after_runs(error, &interruption) {
        return Err(interrupt::conclude(dir, record, error));
    }
    (record.paper, record.assumptions) = (paper_rows(&record), assumptions(&record));
    write_run(dir, &record)?;
    record.ending = Ending::complete();
    let page = report::write(dir, &Report::of(&record))?;
    let picture = dir.join("picture.svg");
    std::fs::write(&picture, overview(args.seed)?)
        .with_context(|| format!("cannot write {}", picture.display()))?;
    let seconds = begin.elapsed().as_secs_f64();
    output.say(
        || table(&record, &page.display().to_string(), seconds, ten),
        || json(&record, &page.display().to_string(), seconds, ten),
    )?;
    Ok(())
}

/// A trial with the wall time it took, s.
type Timed = (Trial, f64);

/// Every trial, and what cut them short. One runs on each core.
fn all_trials(
    dir: &Path,
    seed: u64,
    interruption: &Interruption,
    bar: &Bar,
) -> anyhow::Result<(Vec<Timed>, Option<RunError>)> {
    let jobs: Vec<_> = LAWS
        .iter()
        .flat_map(|law| SESSIONS.iter().map(move |session| (*law, *session)))
        .enumerate()
        .collect();
    let mut results = Vec::new();
    for some in jobs.chunks(rayon::current_num_threads()) {
        let run = |job: &Job| one_trial(*job, dir, seed, interruption);
        let done: Vec<_> = some.par_iter().map(run).collect();
        let mut error = None;
        for result in done {
            let recorded = result?;
            results.push((recorded.trial, recorded.took.as_secs_f64()));
            error = error.or(recorded.error);
        }
        if error.is_some() {
            return Ok((results, error));
        }
        bar.set(results.len() as f64 / jobs.len() as f64);
    }
    Ok((results, None))
}

type Job = (
    usize,
    (
        (LawName, &'static str),
        (&'static str, &'static str, &'static str),
    ),
);

fn one_trial(
    (position, ((law, law_name), (name, file, text))): Job,
    dir: &Path,
    seed: u64,
    interruption: &Interruption,
) -> anyhow::Result<Recorded> {
    let mut session = SessionFile::parse(file, text)?;
    session.session = session.session.with_law(law)?;
    let place = TrialPlace {
        dir,
        position,
        name: &format!("{name}, {law_name}"),
    };
    let watch = interruptible(interruption, |_| ());
    let device = (&DeviceName::Native, seed);
    Ok(host_core::run::record(
        place, &session, device, 20_000_000, watch,
    )?)
}

/// Virtual over wall time with ten channels at 50 Hz, ten muscle models and the
/// finger.
#[derive(Clone, Copy)]
struct Speed {
    /// Of the simulator: device, wire and wearer.
    simulator: f64,
    /// With the host program that streams setpoints and records.
    whole: f64,
}

/// A port that sums up the wall time in which the world goes on.
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

fn ten_channel_speed(seed: u64) -> anyhow::Result<Speed> {
    let session = SessionFile::parse(TEN_CHANNELS.0, TEN_CHANNELS.1)?;
    let port = DeviceName::Native.open(&session.session, seed)?;
    let begin = Instant::now();
    let timed = Stopwatch {
        port,
        in_world: Duration::ZERO,
    };
    let (outcome, timed) = run(&session, timed, None, |_| ());
    let wall = begin.elapsed();
    if let Some(error) = outcome.error {
        return Err(error.into());
    }
    let in_world = timed.map_or(wall, |timed| timed.in_world);
    Ok(Speed {
        simulator: outcome.trial.duration_s / in_world.as_secs_f64(),
        whole: outcome.trial.duration_s / wall.as_secs_f64(),
    })
}

/// docs/demo.svg, the README's picture, as an SVG file: ten channels and the
/// finger in one session, under the device's default law and under the paper's.
///
/// # Errors
/// A session that does not run.
pub fn overview(seed: u64) -> anyhow::Result<String> {
    let [default, paper] = LAWS.map(|(law, _)| ten_channels(law, seed));
    Ok(report::overview_picture(&default?, &paper?))
}

/// The session of ten channels under a law, with the edges of one period.
fn ten_channels(law: LawName, seed: u64) -> anyhow::Result<Trial> {
    let mut session = SessionFile::parse(TEN_CHANNELS.0, TEN_CHANNELS.1)?;
    session.session = session.session.with_law(law)?;
    let port = DeviceName::Native.open(&session.session, seed)?;
    let (outcome, port) = run(&session, port, None, |_| ());
    if let Some(error) = outcome.error {
        return Err(error).context(TEN_CHANNELS.0);
    }
    let mut trial = outcome.trial;
    if let (Some(mut port), Some(epoch)) = (port, outcome.epoch_us)
        && let Some(world) = port.world()
    {
        let trace = &world.recorder.trace;
        trial.edges = edges_of_one_period(&session.session, trace, epoch, 20_000_000);
    }
    Ok(trial)
}

fn paper_rows(record: &Run) -> Vec<PaperRow> {
    let row = |trial: &Trial| {
        let two = trial.name.starts_with("two-point");
        PaperRow {
            trial: trial.name.clone(),
            values: if two {
                TABLE_8_TWO.to_vec()
            } else {
                TABLE_8_ONE.to_vec()
            },
            source: if two {
                "table 8, participant P, two-point".to_owned()
            } else {
                "table 8, participant P, one-point (the better of A and B)".to_owned()
            },
        }
    };
    record.trials.iter().map(row).collect()
}

fn assumptions(record: &Run) -> Vec<Assumption> {
    let put = |text: String| Assumption {
        role: Role::PutIn,
        text,
    };
    let mut all = vec![
        put(format!(
            "The simulated finger bends {TWO_POINT_FACTOR} times as hard when both flexor points are pulsed, \
             conducted, as with one: typed into the body, so nothing here is evidence for it."
        )),
        put("Two points move the finger from 0.7 of their maximum voltage on, as table 7 reports for participant P."
            .to_owned()),
        put("The plant (inertia, stiffness, damping, delays, torques, sensor noise) was calibrated once to the order \
             of table 8; the paper's posture changes and fatigue are not in it."
            .to_owned()),
        put("The sine's offset is not stated in the paper; 45° is assumed. The sliding law's sign is corrected.".to_owned()),
        put("The angle is measured by the board's converter every millisecond, not by a data glove at 90 Hz; the \
             host streams 90 setpoints a second."
            .to_owned()),
    ];
    for trial in &record.trials {
        if let Some(m) = metrics_but_lag(trial) {
            all.push(Assumption {
                role: Role::CameOut,
                text: format!(
                    "{}: RMSE {:.2}°, limiting {:.0} % of the time.",
                    trial.name,
                    m.rmse_deg,
                    100.0 * m.limiting_share
                ),
            });
        }
    }
    all
}

fn rows(record: &Run) -> impl Iterator<Item = (String, f64, f64, f64)> + '_ {
    record
        .trials
        .iter()
        .zip(paper_rows(record))
        .filter_map(|(trial, paper)| {
            let m = metrics_but_lag(trial)?;
            let mean = paper.mean()?;
            Some((
                trial.name.clone(),
                m.rmse_deg,
                mean,
                trial.counters.iter().find(|c| c.0.starts_with("pulses"))?.1 as f64,
            ))
        })
}

fn table(record: &Run, page: &str, seconds: f64, ten: Speed) -> String {
    let mut text = format!(
        "{:<34} {:>10} {:>18} {:>8}\n",
        "RMSE over 10-30 s, degrees", "simulated", "paper, table 8", "pulses"
    );
    for (name, rmse, mean, pulses) in rows(record) {
        text += &format!("{name:<34} {rmse:>10.2} {mean:>12.1} (mean) {pulses:>8}\n");
    }
    text += &format!(
        "\nSimulated, so no evidence about people: the two-point torque factor of {TWO_POINT_FACTOR}\n\
         is put into the body. Six 30 s sessions, {:.0} x real time each; ten channels at\n\
         50 Hz with ten muscles and the finger: simulator {:.0} x, with the host program\n\
         {:.0} x real time. All in {seconds:.2} s.\n\
         Report: {page}",
        record.host.speed_factor.unwrap_or_default(),
        ten.simulator,
        ten.whole,
    );
    text
}

fn json(record: &Run, page: &str, seconds: f64, ten: Speed) -> serde_json::Value {
    let trials: Vec<_> = rows(record)
        .map(|(name, rmse, mean, pulses)| {
            serde_json::json!({ "trial": name, "rmse_deg": rmse, "paper_mean_deg": mean, "pulses": pulses })
        })
        .collect();
    serde_json::json!({
        "trials": trials, "report": page, "seconds": seconds, "speed_factor": record.host.speed_factor,
        "ten_channel_simulator_speed_factor": ten.simulator,
        "ten_channel_speed_factor": ten.whole, "two_point_factor_put_in": TWO_POINT_FACTOR,
    })
}
