//! `[fidelity]`: what a session tolerates, and what its scenes then need of muscle
//! models, law rate, telemetry and the simulated body's level of detail.
//!
//! Lives here: the choice for a whole session, the finest of its channels'. Not here:
//! a channel's scene (`scene`), what was measured (`crate::choice`).
//! In: a session that is otherwise read. Out: the same, settled.

use crate::choice::grid::LAW_PERIODS_MS;
use crate::choice::{Choice, Share};
use firmware::control::{Joint, JointSpec, LawSpec};

use super::Session;
use super::body::BodySpec;
use super::error::Problem;
use super::muscle::{Model, Muscle};
use super::scene::Needs;
use super::table::Table;

/// Where a session's tolerance stands.
const FIELD: &str = "tolerance_percent";

/// Gives `"auto"` models their meaning in this session: the lowest rung within the
/// tolerance, which is the just-noticeable difference of force unless `[fidelity]`
/// says otherwise. With `[fidelity]`, what the scenes need no finer than that is
/// made as coarse: telemetry, the finger's step, and the law's period if the file
/// leaves it out.
///
/// Tells of a tolerance that no model meets, and of `[fidelity]` without a muscle.
pub(super) fn settle(root: &Table<'_>, session: &mut Session) {
    let table = root.table("fidelity");
    let asked = table.map(|t| Share(t.whole(FIELD)));
    session.tolerance = asked.unwrap_or(Share::JUST_NOTICEABLE);
    let needs: Vec<Option<Needs>> = session
        .channels
        .iter()
        .map(|channel| {
            // Nobody asks otherwise, and reading what was measured takes a while.
            let is_auto = |muscle: &Muscle| muscle.model == Model::Auto;
            let is_asked = table.is_some() || channel.muscle.as_ref().is_some_and(is_auto);
            is_asked.then(|| session.needs(channel, session.tolerance))?
        })
        .collect();
    for (channel, needs) in session.channels.iter_mut().zip(&needs) {
        if let (Some(muscle), Some(needs)) = (&mut channel.muscle, needs)
            && muscle.model == Model::Auto
        {
            muscle.auto = needs.rung;
        }
    }
    let Some(table) = table else {
        return;
    };
    let mut choices = Vec::new();
    for (channel, needs) in session.channels.iter().zip(needs) {
        match needs.map(|needs| needs.choice) {
            None => {}
            Some(Ok(choice)) => choices.push(choice),
            Some(Err(none)) => {
                let (least, number) = (none.least, channel.number);
                let allowed =
                    format!("{least} or more, as far as the best model of channel {number} errs");
                return table.out_of_range(FIELD, allowed);
            }
        }
    }
    let law_is_given = root
        .table("joint")
        .is_none_or(|joint| joint.has("law_period_ms"));
    if !fit(session, &choices, law_is_given) {
        table.say(FIELD, Problem::NothingToFit {});
    }
}

/// Makes telemetry, body and law as coarse as all of `choices` allow. Whether there
/// is any.
fn fit(session: &mut Session, choices: &[Choice], law_is_given: bool) -> bool {
    let finest = |of: fn(&Choice) -> u16| choices.iter().map(of).min();
    let (Some(telemetry_ms), Some(step_ms), Some(law_ms)) = (
        finest(|c| c.telemetry_ms),
        finest(|c| c.body_step_ms.into()),
        finest(|c| c.law_period_ms.into()),
    ) else {
        return false;
    };
    session.telemetry_ms = telemetry_ms;
    let mut note = format!(
        "fidelity {}: telemetry every {telemetry_ms} ms",
        session.tolerance
    );
    if let Some(BodySpec::Finger(finger)) = &mut session.body {
        finger.step_us = u32::from(step_ms) * 1000;
        note.push_str(&format!(", finger in steps of {step_ms} ms"));
    }
    // Measured for this law only.
    if let Some(joint) = &mut session.joint
        && joint.law == LawSpec::ALONE
        && !law_is_given
    {
        joint.law_period_ms = longest_period(joint, law_ms);
        note.push_str(&format!(", law every {} ms", joint.law_period_ms));
    }
    session.notes.push(note);
    true
}

/// The longest measured period, up to `most_ms`, that the law's gains allow; else
/// its own.
fn longest_period(joint: &JointSpec, most_ms: u16) -> u8 {
    let up_to = |period: &u8| u16::from(*period) <= most_ms;
    let is_allowed = |period: &u8| {
        let spec = JointSpec {
            law_period_ms: *period,
            ..joint.clone()
        };
        Joint::new(&spec).is_ok()
    };
    let mut periods = LAW_PERIODS_MS.into_iter().rev().filter(up_to);
    periods.find(is_allowed).unwrap_or(joint.law_period_ms)
}
