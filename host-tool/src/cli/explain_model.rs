//! `flexor explain-model`: explains the muscle model of each channel.

use super::{Output, usage_error};
use anyhow::ensure;
use clap::Args;
use firmware::muscle::{MuscleLevel, TablePlan};
use hal_sim::body::arm::{MUSCLES, Support};
use hal_sim::body::hand::FittedHand;
use host_core::choice::{
    self, Choice, Cycles, Effect, LevelResult, ModelUses, Need, arm_muscles, coarsest,
};
use host_core::session::{
    BodySpec, Model, Muscle, Session, Share, escape_control_chars, level_name,
};
use serde_json::{Value, json};
use std::path::PathBuf;

/// Print which muscle model each channel gets, and why
#[derive(Args, Debug)]
pub struct ExplainModel {
    /// Session file (TOML)
    session: PathBuf,
    /// Largest error of the values that the session uses, in percent of the largest force, in steps
    /// of 0.01; default: the session's own, or else 10
    #[arg(long, value_name = "PERCENT")]
    tolerance: Option<f64>,
    /// Seed of the simulated wearer on which the models are compared
    #[arg(long, default_value_t = choice::SEED)]
    seed: u64,
}

/// # Errors
/// Fails if the session is invalid, the tolerance is invalid (E518) or met by no model (E553), the
/// session has no muscle (E554) or cannot be simulated (E552).
pub fn main(args: &ExplainModel, output: Output) -> anyhow::Result<()> {
    let asked = args.tolerance.map(parse_tolerance).transpose()?;
    let session = Session::load(&args.session)?;
    for note in &session.notes {
        eprintln!("note: {}", escape_control_chars(note));
    }
    ensure!(
        session.channels.iter().any(|c| c.muscle.is_some())
            || session.hand().is_some()
            || session.arm_step_ms().is_some(),
        "E554 {}: no channel has a `muscle`, so no force is predicted; add a `muscle` to a channel \
         (docs/reference/sessions.md)",
        args.session.display()
    );
    let tolerance = asked.unwrap_or(session.tolerance);
    let choice = choice::choose(&session, tolerance, args.seed)?;
    choice.check_tolerance(&session)?;
    output.print(
        || text_report(&session, &choice),
        || json_report(&session, &choice),
    )
}

/// Converts percent to hundredths of a percent.
fn parse_tolerance(percent: f64) -> anyhow::Result<Share> {
    let hundredths = (percent * 100.0).round();
    if !(1.0..=60_000.0).contains(&hundredths) || (percent * 100.0 - hundredths).abs() > 1e-6 {
        return usage_error(format!(
            "--tolerance is {percent}; allowed: 0.01 to 600 percent in steps of 0.01"
        ));
    }
    Ok(Share(hundredths as u16))
}

/// Formats the report in at most 80 columns.
fn text_report(session: &Session, choice: &Choice) -> String {
    let part = match choice.tried_us < session.duration_us {
        true => "the first ",
        false => "",
    };
    let more = match choice.sessions {
        1 => String::new(),
        n => format!(" and on the {} worst sessions within its bounds", n - 1),
    };
    let mut out = format!(
        "{}\n{} {}.\n\
         Tried on {part}{} s{more},\n\
         in {} {}. Errors are relative to the largest true force; cycles are the\n\
         largest number in a 1 ms tick without/with a pulse.\n",
        truncate(&escape_control_chars(&session.title), 78),
        match choice.needs.iter().all(|need| is_given(session, need)) {
            true => {
                "Models at the session's start, from the session file. The error in the\nvalues \
                 that the session uses should be at most"
            }
            false => {
                "Models at the session's start: the cheapest whose error in the values\nthat the \
                 session uses is at most"
            }
        },
        choice.tolerance,
        choice.tried_us as f64 / 1e6,
        choice.plays,
        if choice.plays == 1 {
            "simulation"
        } else {
            "simulations"
        },
    );
    for need in &choice.needs {
        write_channel(&mut out, session, need, choice.tolerance);
    }
    let tried = &choice.fidelity;
    if let Some(hand) = session.hand() {
        out.push_str(&hand_text(hand, choice));
    }
    out.push_str(&arm_text(session, choice));
    for (name, effects) in [
        ("controller", &tried.law),
        ("telemetry", &tried.telemetry),
        ("finger", &tried.step),
    ] {
        let Some(own) = coarsest(effects, choice.tolerance.fraction()) else {
            continue;
        };
        let changes = effects.iter().map(|effect| match effect.error.is_finite() {
            true => format!("{} {:.2} %", effect.setting / 1_000, effect.error * 100.0),
            false => format!("{} oscillates", effect.setting / 1_000),
        });
        out.push_str(&format!(
            "\n{name}: every {} ms; change of the result at each period in ms:\n  {}\n",
            own.setting / 1_000,
            changes.collect::<Vec<_>>().join(", ")
        ));
    }
    out.trim_end().to_owned()
}

/// Describes the level of detail of a simulated hand.
fn hand_text(hand: &FittedHand, choice: &Choice) -> String {
    let every = hand.spec.units;
    let mut text =
        "\nhand: the 3 muscle pools of the index finger; the session uses no other digit,\n  \
                    so that leaving out 5 of 8 pools changes nothing\n"
            .to_owned();
    let tried = &choice.fidelity.hand;
    let Some(own) = coarsest(tried, choice.tolerance.fraction()) else {
        return text
            + &format!("  all {every} motor units of each pool; `[fidelity]` chooses fewer\n");
    };
    let errors = tried
        .iter()
        .map(|effect| format!("{} {:.2} %", effect.setting, effect.error * 100.0));
    text.push_str(&format!(
        "  {} of {every} motor units of each pool; change of the angle (rms, in % of the\n  \
         reference's range) at each number of units:\n  {}\n",
        own.setting,
        errors.collect::<Vec<_>>().join(", ")
    ));
    text
}

/// Describes the level of detail of a simulated arm; empty without one.
fn arm_text(session: &Session, choice: &Choice) -> String {
    let (Some(BodySpec::Arm { held, .. }), Some(reached)) = (&session.body, arm_muscles(session))
    else {
        return String::new();
    };
    let mut text = format!(
        "\narm: {} of {MUSCLES} muscles; no channel reaches another one, so that leaving out the\n  \
         others changes nothing\n",
        reached.len()
    );
    let tried = &choice.fidelity.arm;
    let Some(own) = coarsest(tried, choice.tolerance.fraction()) else {
        return text + "  in steps of 1 ms; `[fidelity]` chooses coarser ones\n";
    };
    let errors = tried
        .iter()
        .map(|effect| format!("{} {:.2} %", effect.setting, effect.error * 100.0));
    // The true force at the hand is recorded only if the session produces a force there.
    let quantity = match (held, &session.limb) {
        (Support::InCuff, Some(_)) => "true force at the hand (rms, in % of\n  the largest)",
        _ => "elbow angle (rms, in % of its\n  range)",
    };
    text.push_str(&format!(
        "  in steps of {} ms; change of the {quantity} at each step in ms:\n  {}\n",
        own.setting,
        errors.collect::<Vec<_>>().join(", ")
    ));
    text
}

/// Returns whether the session file names the channel's model.
fn is_given(session: &Session, need: &Need) -> bool {
    let muscle = session.channels[need.place].muscle.as_ref();
    muscle.is_some_and(|muscle| muscle.model != Model::Auto)
}

fn write_channel(out: &mut String, session: &Session, need: &Need, tolerance: Share) {
    let channel = &session.channels[need.place];
    let model = level_name(need.level);
    let head = format!(
        "channel {}, {}",
        channel.number,
        escape_control_chars(&channel.name)
    );
    out.push_str(&format!("\n{}: {model}\n", truncate(&head, 54)));
    out.push_str(&format!("  uses: {}\n", uses_text(need.uses)));
    let [model, report, steering, cost_of] = ["model", "report", "steering", "cycles"];
    out.push_str(&format!(
        "  {model:<21}{report:>10}{steering:>10}{cost_of:>12}\n"
    ));
    for tried in &need.tried {
        let verdict = match tried.error() <= tolerance.fraction() {
            _ if need.enough == Some(tried.level) => "cheapest that will do",
            true => "more than enough",
            false => "too coarse",
        };
        out.push_str(&format!(
            "  {:<21}{:>10}{:>10}{:>12}   {verdict}\n",
            level_name(tried.level),
            percent(tried.report),
            percent(tried.steering),
            cycles_text(tried.cycles)
        ));
    }
    let muscle = channel.muscle.as_ref();
    if let Some(muscle) = muscle
        && need.level == MuscleLevel::CalciumForce
    {
        out.push_str(&match (muscle.fatigue, table_rows(muscle)) {
            (Some(_), _) => "  integrated: fatigue changes the muscle once a second\n".to_owned(),
            (None, Some(rows)) => format!("  by a table of {rows} rows\n"),
            (None, None) => {
                "  integrated: the muscle is too fast or too weak for a table\n".to_owned()
            }
        });
    }
    for (at_us, level) in muscle.iter().flat_map(|muscle| &muscle.changes) {
        let at_s = *at_us as f64 / 1e6;
        let name = level_name(*level);
        out.push_str(&format!(
            "  from {at_s} s on: {name}, set in the file and not checked\n"
        ));
    }
    if need.raised {
        out.push_str("  raised: with the cheaper model, all channels together err too much\n");
    }
    if is_given(session, need) {
        out.push_str("  the session file sets this model\n");
    }
}

/// Returns the number of rows of the table by which the device computes the muscle's force; `None` if
/// it integrates the muscle.
fn table_rows(muscle: &Muscle) -> Option<u32> {
    let plan = TablePlan::new(&muscle.force).ok().flatten();
    plan.filter(|_| muscle.fatigue.is_none())
        .map(|plan| plan.row_count())
}

/// Describes how the session uses the channel's force.
fn uses_text(uses: ModelUses) -> &'static str {
    match (uses.report, uses.steering) {
        (true, true) => "the reported force and the force that controls its pulses",
        (true, false) => "the reported force",
        (false, true) => "the force that controls its pulses",
        (false, false) => "nothing",
    }
}

/// Shortens the text to at most `letters` characters.
fn truncate(text: &str, letters: usize) -> String {
    if text.chars().count() <= letters {
        return text.to_owned();
    }
    text.chars().take(letters - 1).chain(['…']).collect()
}

/// Formats a fraction as "5.93 %", or a dash if the session does not use it.
fn percent(part: Option<f64>) -> String {
    part.map_or("-".into(), |part| format!("{:.2} %", part * 100.0))
}

/// Formats the cycles of a tick without and with a pulse: "83/215".
fn cycles_text(cycles: Option<Cycles>) -> String {
    cycles.map_or("-".into(), |cycles| {
        format!("{}/{}", cycles.tick, cycles.tick_with_pulse)
    })
}

fn json_report(session: &Session, choice: &Choice) -> Value {
    let part = |part: Option<f64>| part.map(|part| part * 100.0);
    let level = |tried: &LevelResult| {
        json!({
            "model": level_name(tried.level),
            "report_pct": part(tried.report),
            "steering_pct": part(tried.steering),
            "cycles": tried.cycles.map(|cycles| json!({
                "tick": cycles.tick, "tick_with_pulse": cycles.tick_with_pulse,
            })),
            "worst_cycles_per_s": tried.cycles.map(|_| tried.cost()),
        })
    };
    let channels = choice.needs.iter().map(|need| {
        let channel = &session.channels[need.place];
        let changes = channel.muscle.iter().flat_map(|muscle| &muscle.changes);
        let changes = changes.map(
            |(at_us, level)| json!({ "at_s": *at_us as f64 / 1e6, "model": level_name(*level) }),
        );
        json!({
            "channel": channel.number,
            "name": channel.name,
            "uses": { "report": need.uses.report, "steering": need.uses.steering },
            "model": level_name(need.level),
            "enough": need.enough.map(level_name),
            "raised": need.raised,
            "table_rows": channel.muscle.as_ref().and_then(table_rows),
            "changes": changes.collect::<Vec<_>>(),
            "together_pct": need.together * 100.0,
            "models": need.tried.iter().map(level).collect::<Vec<_>>(),
        })
    });
    let effects = |rows: &[Effect]| {
        let own = coarsest(rows, choice.tolerance.fraction()).map(|effect| effect.setting);
        let tried = rows
            .iter()
            .map(|effect| json!({ "us": effect.setting, "change_pct": effect.error * 100.0 }));
        json!({ "chosen_us": own, "tried": tried.collect::<Vec<_>>() })
    };
    let fidelity = &choice.fidelity;
    json!({
        "law": effects(&fidelity.law),
        "telemetry": effects(&fidelity.telemetry),
        "finger": effects(&fidelity.step),
        "hand": session.hand().map(|hand| json!({
            "pools": 3,
            "units": hand.spec.units,
            "chosen_units": coarsest(&fidelity.hand, choice.tolerance.fraction())
                .map(|effect| effect.setting),
            "tried": fidelity.hand.iter().map(|effect| json!({
                "units": effect.setting, "change_pct": effect.error * 100.0,
            })).collect::<Vec<_>>(),
        })),
        "arm": arm_muscles(session).map(|muscles| json!({
            "muscles": muscles.iter().map(|muscle| muscle.name()).collect::<Vec<_>>(),
            "chosen_step_ms": coarsest(&fidelity.arm, choice.tolerance.fraction())
                .map(|effect| effect.setting),
            "tried": fidelity.arm.iter().map(|effect| json!({
                "step_ms": effect.setting, "change_pct": effect.error * 100.0,
            })).collect::<Vec<_>>(),
        })),
        "tolerance_pct": choice.tolerance.fraction() * 100.0,
        "models_at_s": 0.0,
        "tried_s": choice.tried_us as f64 / 1e6,
        "plays": choice.plays,
        "sessions": choice.sessions,
        "channels": channels.collect::<Vec<_>>(),
    })
}
