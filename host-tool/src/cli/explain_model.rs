//! `flexor explain-model`: which muscle model each channel gets, and why.

use super::{Output, wrong};
use anyhow::{bail, ensure};
use clap::Args;
use firmware::muscle::Rung;
use host_core::choice::{Cycles, Scene, Share, cycles, expected_change, expected_error};
use host_core::session::scene::Needs;
use host_core::session::{Channel, Model, Session};
use serde_json::{Value, json};
use std::path::PathBuf;
use studies::ladder::table::RUNG_NAMES;

/// Tell which muscle model each channel of a session gets, and why.
#[derive(Args, Debug)]
pub struct ExplainModel {
    /// Session file (TOML)
    session: PathBuf,
    /// Change of force allowed, in percent of the scene's largest, in steps of 0.01;
    /// the session's own, or else 10, if left out
    #[arg(long, value_name = "PERCENT")]
    tolerance: Option<f64>,
}

/// # Errors
/// The session; a tolerance that is none (E518) or that no model meets (E553);
/// a session without a muscle (E554).
pub fn main(args: &ExplainModel, output: Output) -> anyhow::Result<()> {
    let asked = args.tolerance.map(share).transpose()?;
    let session = Session::load(&args.session)?;
    let tolerance = asked.unwrap_or(session.tolerance);
    for note in &session.notes {
        eprintln!("note: {note}");
    }
    let all: Vec<(&Channel, Needs)> = session
        .channels
        .iter()
        .filter_map(|channel| Some((channel, session.needs(channel, tolerance)?)))
        .collect();
    ensure!(
        !all.is_empty(),
        "E554 {}: no channel has a `muscle`, so no force is predicted; docs/sessions.md says how to give it one",
        args.session.display()
    );
    for (channel, needs) in &all {
        if let Err(none) = needs.choice {
            bail!("E553 --tolerance, channel {}: {none}", channel.number);
        }
    }
    output.say(
        || people(&session, tolerance, &all),
        || machines(tolerance, &all),
    )?;
    Ok(())
}

/// Hundredths of a percent.
fn share(percent: f64) -> anyhow::Result<Share> {
    if !(0.01..=600.0).contains(&percent) {
        return wrong(format!(
            "--tolerance is {percent}: allowed is 0.01 to 600 percent"
        ));
    }
    // Down: never more than what is allowed. At most 60 000.
    Ok(Share((percent * 100.0 + 1e-9) as u16))
}

/// At most 80 columns.
fn people(session: &Session, tolerance: Share, all: &[(&Channel, Needs)]) -> String {
    let mut out = format!(
        "{}\nThe lowest model that the top one may replace without changing the true force\n\
         by more than {tolerance} of its peak. changes: by so much. errs: its prediction\n\
         by itself, without a loop. cycles: of a 1 ms tick without/with a pulse, at most.\n",
        cut(&session.title, 78)
    );
    for (channel, needs) in all {
        block(&mut out, channel, needs, tolerance);
    }
    out.trim_end().to_owned()
}

fn block(out: &mut String, channel: &Channel, needs: &Needs, tolerance: Share) {
    let name = cut(&channel.name, 24);
    let rung = RUNG_NAMES[needs.rung as usize];
    let by = match channel.muscle.as_ref().map(|muscle| muscle.model) {
        Some(Model::Fixed(_)) => " (the file says so)",
        _ => "",
    };
    out.push_str(&format!(
        "\nchannel {}, {name}: {rung}{by}\n",
        channel.number
    ));
    out.push_str(&format!("  {}\n", scene(&needs.scene)));
    let [model, changes, errs, cost_of] = ["model", "changes", "errs", "cycles"];
    out.push_str(&format!(
        "  {model:<21}{changes:>10}{errs:>10}{cost_of:>12}\n"
    ));
    let chosen = needs.choice.map(|choice| choice.rung).ok();
    for candidate in Rung::ALL {
        let change = expected_change(&needs.scene, candidate);
        let error = expected_error(&needs.scene, candidate);
        let verdict = if Some(candidate) == chosen {
            "lowest that will do"
        } else if change <= tolerance {
            "more than enough"
        } else {
            "too coarse"
        };
        out.push_str(&format!(
            "  {:<21}{:>10}{:>10}{:>12}   {verdict}\n",
            RUNG_NAMES[candidate as usize],
            brief(change),
            brief(error),
            cost(cycles(candidate))
        ));
    }
    if let Some(change) = needs.change_if_it_tires.filter(|c| *c > tolerance) {
        out.push_str(&format!(
            "  of the fresh muscle; as it tires up to {change}: give it a `fatigue`\n"
        ));
    }
    if let Ok(choice) = needs.choice {
        out.push_str(&format!(
            "  also enough: law {} ms {}, telemetry {} ms, body step {} ms\n",
            choice.law_period_ms,
            format!("{:?}", choice.discretization).to_lowercase(),
            choice.telemetry_ms,
            choice.body_step_ms
        ));
    }
}

/// At most so many letters.
fn cut(text: &str, letters: usize) -> String {
    if text.chars().count() <= letters {
        return text.to_owned();
    }
    text.chars().take(letters - 1).chain(['…']).collect()
}

/// "5.93 %", or a dash if it was not measured.
fn brief(share: Share) -> String {
    match share {
        Share::UNKNOWN => "-".into(),
        known => known.to_string(),
    }
}

/// "83/215": cycles of a tick without and with a pulse.
fn cost(cycles: Cycles) -> String {
    if cycles == Cycles::UNKNOWN {
        return "-".into();
    }
    format!("{}/{}", cycles.tick, cycles.tick_with_pulse)
}

/// What is asked of the muscle, for people.
fn scene(scene: &Scene) -> String {
    let hz = |mhz: u32| f64::from(mhz) / 1e3;
    let seconds = |ms: u32| f64::from(ms) / 1e3;
    let rate = if scene.slowest_mhz == scene.fastest_mhz {
        format!("{:.4} Hz", hz(scene.slowest_mhz))
    } else {
        format!(
            "{:.4}–{:.4} Hz",
            hz(scene.slowest_mhz),
            hz(scene.fastest_mhz)
        )
    };
    let burst = if scene.burst_ms >= Scene::UNBROKEN {
        "unbroken".to_owned()
    } else {
        format!("bursts of {} s", seconds(scene.burst_ms))
    };
    let work = match scene.session_s {
        0 => "fatigue left aside".to_owned(),
        s => format!("{s} s of work"),
    };
    format!(
        "{rate}, ramps of {} s, {burst}, {work}",
        seconds(scene.ramp_ms)
    )
}

fn machines(tolerance: Share, all: &[(&Channel, Needs)]) -> Value {
    let percent = |share: Share| (share != Share::UNKNOWN).then(|| f64::from(share.0) / 100.0);
    let cost = |rung: Rung| {
        let Cycles {
            tick,
            tick_with_pulse,
        } = cycles(rung);
        (cycles(rung) != Cycles::UNKNOWN)
            .then(|| json!({ "tick": tick, "tick_with_pulse": tick_with_pulse }))
    };
    let channels: Vec<Value> = all
        .iter()
        .map(|(channel, needs)| {
            let rungs = Rung::ALL.map(|rung| {
                json!({
                    "model": RUNG_NAMES[rung as usize],
                    "change_pct": percent(expected_change(&needs.scene, rung)),
                    "error_pct": percent(expected_error(&needs.scene, rung)),
                    "cycles": cost(rung),
                })
            });
            let Scene {
                burst_ms,
                slowest_mhz,
                fastest_mhz,
                ramp_ms,
                session_s,
            } = needs.scene;
            json!({
                "channel": channel.number,
                "name": channel.name,
                "model": RUNG_NAMES[needs.rung as usize],
                "change_pct": percent(needs.change),
                "error_pct": percent(needs.error),
                "change_if_it_tires_pct": needs.change_if_it_tires.and_then(percent),
                "cycles": cost(needs.rung),
                "chosen": needs.choice.ok().map(|choice| json!({
                    "model": RUNG_NAMES[choice.rung as usize],
                    "law_period_ms": choice.law_period_ms,
                    "discretization": format!("{:?}", choice.discretization).to_lowercase(),
                    "telemetry_ms": choice.telemetry_ms,
                    "body_step_ms": choice.body_step_ms,
                })),
                "scene": {
                    "burst_ms": burst_ms,
                    "unbroken": burst_ms >= Scene::UNBROKEN,
                    "slowest_hz": f64::from(slowest_mhz) / 1e3,
                    "fastest_hz": f64::from(fastest_mhz) / 1e3,
                    "ramp_ms": ramp_ms,
                    "session_s": session_s,
                },
                "models": rungs,
            })
        })
        .collect();
    json!({ "tolerance_pct": percent(tolerance), "channels": channels })
}
