//! `flexor experiment`: the papers' protocols.

use super::out::OutArgs;
use super::{Bar, Output, interrupt, wrong};
use clap::{Args, Subcommand};
use host_core::analysis::Hit;
use host_core::link::Interruption;
use host_core::record::{Assumption, Ending, Plan, Role, Run, Trial, write_run};
use host_core::run::{DeviceName, RunError, TrialPlace, greet, interruptible, record};
use std::path::Path;
use studies::experiments::harris_wall::{self, SPEEDS_DEG_PER_S, Shares, hit_at};

/// Run a paper's protocol
#[derive(Subcommand, Debug)]
pub enum Experiment {
    HarrisWall(HarrisWall),
}

pub fn main(experiment: &Experiment, output: Output) -> anyhow::Result<()> {
    match experiment {
        Experiment::HarrisWall(args) => harris_wall(args, output),
    }
}

/// Harris 2017: hit a virtual wall slowly and fast, with and without pre-wall
/// and co-contraction; then the same with arms drawn at random
#[derive(Args, Debug)]
pub struct HarrisWall {
    /// native, chip, qemu, a serial port, or tcp:HOST:PORT
    #[arg(long, default_value = "native")]
    device: DeviceName,
    /// Arms to draw; each hits every wall at every speed
    #[arg(long, default_value_t = 288)]
    arms: u64,
    /// Decides the sensor's noise and the arms drawn
    #[arg(long, default_value_t = 1)]
    seed: u64,
    #[command(flatten)]
    out: OutArgs,
    /// Of which record this is a rerun.
    #[arg(skip)]
    rerun_of: Option<String>,
}

impl Experiment {
    /// The experiment of a record, again, in `out`; `None` for another command's.
    pub fn again(record: &Run, out: OutArgs, of: String) -> Option<Self> {
        let plan = record.plan.as_ref()?;
        let identity = record.trials.first()?.identity.as_ref()?;
        let device = DeviceName::of(identity.kind)?;
        (plan.command == "experiment harris-wall").then_some(Self::HarrisWall(HarrisWall {
            device,
            arms: plan.arms?,
            seed: record.seed?,
            out,
            rerun_of: Some(of),
        }))
    }
}

fn harris_wall(args: &HarrisWall, output: Output) -> anyhow::Result<()> {
    if !(1..=100_000).contains(&args.arms) {
        let arms = args.arms;
        return wrong(format!("--arms is {arms}, allowed is 1 to 100000"));
    }
    let interruption = interrupt::heed()?;
    if args.out.overwrites() && args.device.is_port() {
        // No record goes for a device that is not there.
        if let Some((_, file)) = harris_wall::sessions()?.first() {
            greet(args.device.open(&file.session, args.seed)?, &interruption)?;
        }
    }
    let place = args.out.place("harris-wall")?;
    let dir = place.dir();
    let bar = output.bar("Harris 2017, virtual wall");
    let title = "Harris 2017: a virtual wall with and without pre-wall and co-contraction";
    let device = args.device.to_string();
    let plan = Plan {
        arms: Some(args.arms),
        ..Plan::of("experiment harris-wall", &device)
    };
    let mut record = Run::begin(title, &device, Some(args.seed), plan);
    record.host.rerun_of = args.rerun_of.clone();
    write_run(dir, &record)?;
    let cut_short = scenarios(dir, args, &interruption, &mut record.trials, &bar)?;
    let mut drawn = Vec::new();
    if cut_short.is_none() {
        drawn = harris_wall::drawn(args.arms, args.seed, &mut |part| {
            bar.set(0.2 + 0.8 * part);
            interruption.asked().is_none()
        })?;
    }
    bar.finish();
    let ended = interrupt::after_runs(cut_short, &interruption);
    if let Err(error) = ended {
        return Err(interrupt::conclude(dir, record, error));
    }
    let shares = Shares::of(&drawn);
    record.assumptions = assumptions(&shares);
    write_run(dir, &record)?;
    record.ending = Ending::complete();
    let page = interrupt::close(dir, &mut record).inspect_err(|_| super::lies_in(dir))?;
    let page = page.display().to_string();
    output.say(
        || people(&record.trials, &shares, &page),
        || machines(&record.trials, &shares, &page),
    )?;
    Ok(())
}

/// Runs the scenarios as far as they go, and says what cut them short.
fn scenarios(
    dir: &Path,
    args: &HarrisWall,
    interruption: &Interruption,
    trials: &mut Vec<Trial>,
    bar: &Bar,
) -> anyhow::Result<Option<RunError>> {
    let sessions = harris_wall::sessions()?;
    for (position, (name, file)) in sessions.iter().enumerate() {
        let place = TrialPlace {
            dir,
            position,
            name,
        };
        let half_us = file.session.duration_us / 2;
        let watch = interruptible(interruption, |_| ());
        let recorded = record(place, file, (&args.device, args.seed), half_us, watch)?;
        trials.push(recorded.trial);
        if recorded.error.is_some() {
            return Ok(recorded.error);
        }
        bar.set(0.2 * trials.len() as f64 / sessions.len() as f64);
    }
    Ok(None)
}

fn people(trials: &[Trial], shares: &Shares, page: &str) -> String {
    let mut text = format!(
        "{:<26}{:>16}{:>8}{:>12}   (inside the wall; late: third quarter of a hit)\n",
        "hit at 15 and at 55 °/s", "deepest, °", "turns", "late swing"
    );
    for trial in trials {
        for speed in SPEEDS_DEG_PER_S {
            text += &match hit_at(trial, speed) {
                Some(hit) => row(&trial.name, speed, &hit),
                None => format!("{:<20}{speed:>4.0} °/s: not touched\n", trial.name),
            };
        }
    }
    text += &format!(
        "\nArms drawn at random, {} hits of each wall, without a board around the device's wall:\n",
        shares.visits
    );
    for (what, share) in findings(shares) {
        text += &format!("{:>6.1} %  {what}\n", 100.0 * share);
    }
    text + &format!(
        "\nSimulated: what came of assumed arms, no evidence about people. The paper's pre-wall\n\
         reaches full current at the wall itself, so it is also the same ramp 9° further out: less\n\
         depth inside the wall follows from that alone. Report: {page}"
    )
}

fn row(name: &str, speed: f64, hit: &Hit) -> String {
    format!(
        "{name:<26}{speed:>4.0} °/s{:>9.1}{:>8}{:>11.1}°\n",
        hit.deepest_deg, hit.turns, hit.late_swing_deg
    )
}

/// What was asked of the drawn arms, and its share.
#[rustfmt::skip]
fn findings(shares: &Shares) -> [(&'static str, f64); 6] {
    [
        ("pre-wall: less deep inside the wall (paper: less)", shares.pre_wall_less_deep),
        ("pre-wall: less far beyond where current begins", shares.pre_wall_less_beyond_begin),
        ("pre-wall: swings no more (paper: less)", shares.pre_wall_swings_no_more),
        ("co-contraction: swings less, with pre-wall (paper: less)", shares.co_contraction_helps_with_pre_wall),
        ("co-contraction: swings less, without pre-wall (paper: no)", shares.co_contraction_helps_without),
        ("co-contraction: helps only with pre-wall (the paper's conclusion)", shares.helps_only_with_pre_wall),
    ]
}

/// What the experiment assumes.
const PUT_IN: [&str; 4] = [
    "The arm: inertia 0.06 kg m², muscle dynamics and delay of the finger, everything else assumed.",
    "The person moves at a meant speed with at most 1.5 N m and pushes on with that; no reflexes, \
     no reaction, no sight.",
    "Stiffness and pulse rate are not stated in the paper: 80 mA over 9° and 50 Hz are assumed.",
    "The paper's pre-wall reaches full current at the wall, so it is also the same ramp 9° further \
     out.",
];

fn assumptions(shares: &Shares) -> Vec<Assumption> {
    let put = |text: &str| Assumption {
        role: Role::PutIn,
        text: text.to_owned(),
    };
    let mut all = PUT_IN.map(put).to_vec();
    all.extend(findings(shares).map(|(what, share)| Assumption {
        role: Role::CameOut,
        text: format!(
            "{what}: in {:.0} % of {} hits by arms drawn at random.",
            100.0 * share,
            shares.visits
        ),
    }));
    all
}

fn machines(trials: &[Trial], shares: &Shares, page: &str) -> serde_json::Value {
    let hits = |trial: &Trial| SPEEDS_DEG_PER_S.map(|speed| hit_at(trial, speed));
    let trials: Vec<_> = trials
        .iter()
        .map(|trial| serde_json::json!({ "scenario": trial.name, "hits": hits(trial) }))
        .collect();
    serde_json::json!({ "scenarios": trials, "drawn_arms": shares, "report": page })
}
