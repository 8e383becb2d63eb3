//! Verdicts on the selection of muscle models.

use super::draw::{Kind, session};
use super::{JudgeError, draw};
use firmware::muscle::MuscleLevel;
use hal_sim::random::Random;
use host_core::choice::{SEED, choose, with_courses};
use host_core::session::{Bounds, Model, Session, Share, level_name};
use rayon::prelude::*;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Tolerances at which the selection is judged: 1, 3, 10 and 30 %.
pub const TOLERANCES: [Share; 4] = [Share(100), Share(300), Share(1_000), Share(3_000)];
/// Noise seed of the simulated wearer on which a choice is judged. The choice itself was made with
/// another seed, [`SEED`].
pub const NOISE: u64 = 101;
/// Number of random live clients that are tried within a session's bounds.
const CLIENTS: u64 = 3;

/// Verdict on the model that was chosen for one muscle at one tolerance. Errors are in % of the
/// largest true force.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Verdict {
    /// Chosen model level; `None` if the selection refused because no model meets the tolerance.
    pub chosen: Option<MuscleLevel>,
    /// Error of the chosen model, in a simulation in which all muscles of the session use their
    /// chosen models.
    pub error_pct: f64,
    /// Error of the next cheaper model; `None` if no cheaper model exists.
    pub cheaper_pct: Option<f64>,
}

/// A muscle of a random session, with the verdicts on its models.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// Index of the session, from 0.
    pub session: usize,
    pub kind: Kind,
    /// Length of the session, s.
    pub duration_s: f64,
    /// Channel number, from 1.
    pub channel: u8,
    /// Whether the session's model of the muscle includes fatigue.
    pub tires: bool,
    /// Whether the session reports the muscle's force.
    pub report: bool,
    /// Whether the session controls the muscle's force.
    pub steering: bool,
    /// Verdict at each of [`TOLERANCES`].
    pub verdicts: [Verdict; 4],
}

/// Judges the first `count` sessions of `seed`; `step` receives the finished part, 0 to 1.
///
/// # Errors
/// Returns [`JudgeError`] if a session cannot be generated or simulated.
pub fn campaign(
    seed: u64,
    count: usize,
    step: impl Fn(f64) + Sync,
) -> Result<Vec<Row>, JudgeError> {
    let done = AtomicUsize::new(0);
    let results = (0..count).into_par_iter().map(|index| {
        let rows = judge_session(seed, index)?;
        let done = done.fetch_add(1, Ordering::Relaxed) + 1;
        step(done as f64 / count as f64);
        Ok(rows)
    });
    let rows: Vec<Vec<Row>> = results.collect::<Result<_, JudgeError>>()?;
    Ok(rows.into_iter().flatten().collect())
}

/// Judges session `index` of `seed` at all tolerances; returns a row for each muscle.
fn judge_session(seed: u64, index: usize) -> Result<Vec<Row>, JudgeError> {
    let (kind, session) = session(seed, index)?;
    let attempts = TOLERANCES.map(|tolerance| verdicts(&session, tolerance, seed ^ index as u64));
    let [a, b, c, d] = attempts;
    let judged = [a?, b?, c?, d?];
    let muscles = session
        .channels
        .iter()
        .filter(|channel| channel.muscle.is_some());
    let rows = muscles.enumerate().map(|(n, channel)| {
        let muscle = channel.muscle.as_ref();
        Row {
            session: index,
            kind,
            duration_s: session.duration_us as f64 * 1e-6,
            channel: channel.number,
            tires: muscle.is_some_and(|muscle| muscle.fatigue.is_some()),
            report: muscle.is_some_and(|muscle| muscle.report),
            steering: channel.force.is_some(),
            verdicts: std::array::from_fn(|t| judged[t][n]),
        }
    });
    Ok(rows.collect())
}

/// Returns the verdict on each muscle of a session at one tolerance. `seed` determines the random
/// live clients.
fn verdicts(session: &Session, tolerance: Share, seed: u64) -> Result<Vec<Verdict>, JudgeError> {
    let choice = choose(session, tolerance, SEED)?;
    // The chosen models become fixed in the session; cheaper ones are compared with them.
    let mut settled = session.clone();
    for need in &choice.needs {
        if let Some(muscle) = &mut settled.channels[need.place].muscle {
            muscle.model = Model::Fixed(need.level);
        }
    }
    let judged = choose(&settled, tolerance, NOISE)?;
    let mut errors: Vec<f64> = judged.needs.iter().map(|need| need.together).collect();
    if !session.setpoints.bounds.is_empty() {
        // Judged with random clients instead of the worst case that the choice was made with.
        errors.fill(0.0);
        for client in 0..CLIENTS {
            let mut random = Random::new(seed.wrapping_add(client << 32));
            let mut live = with_courses(&settled, |bounds| {
                random_course(bounds, session, &mut random)
            });
            live.setpoints.bounds.clear();
            let live = choose(&live, tolerance, NOISE)?;
            for (worst, need) in errors.iter_mut().zip(&live.needs) {
                *worst = worst.max(need.together);
            }
        }
    }
    let triples = choice.needs.iter().zip(&judged.needs).zip(errors);
    let results = triples.map(|((chosen, judged), error)| {
        let cheaper = judged
            .tried
            .iter()
            .rev()
            .find(|trial| trial.level < chosen.level);
        Verdict {
            chosen: chosen.enough.map(|_| chosen.level),
            error_pct: error * 100.0,
            cheaper_pct: cheaper.map(|trial| trial.error() * 100.0),
        }
    });
    Ok(results.collect())
}

/// Returns random values that a live client could set within its bounds, as pairs of time, µs, and
/// value.
fn random_course(bounds: &Bounds, session: &Session, random: &mut Random) -> Vec<(u64, u32)> {
    let span = f64::from(bounds.most - bounds.least);
    let values: Vec<(u32, u64)> = (0..2_000)
        .map(|_| {
            let value = bounds.least + (span * random.unit()) as u32;
            let stay_s = bounds.shortest_us as f64 * random.log_between(1.0, 20.0);
            (value, stay_s as u64)
        })
        .collect();
    bounds.course_through(values, session.duration_us)
}

/// Counts over all judged sessions at one tolerance.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct Summary {
    /// Number of muscles for which a model was chosen.
    pub muscles: usize,
    /// Number of muscles for which no model meets the tolerance.
    pub refused: usize,
    /// Number of `muscles` whose chosen model has an error within the tolerance.
    pub within: usize,
    /// Number of `muscles` for which a cheaper model than the chosen one exists.
    pub with_cheaper: usize,
    /// Number of `with_cheaper` muscles whose next cheaper model exceeds the tolerance, so that the
    /// choice was necessary.
    pub cheaper_fails: usize,
    /// Number of sessions in which every muscle has a chosen model.
    pub sessions: usize,
    /// Number of `sessions` in which every muscle's error is within the tolerance.
    pub sessions_within: usize,
}

impl Summary {
    /// Counts the rows at one tolerance, given its index in [`TOLERANCES`].
    #[must_use]
    pub fn from_rows(rows: &[Row], tolerance: usize) -> Self {
        let limit_pct = TOLERANCES[tolerance].fraction() * 100.0;
        let mut sum = Self::default();
        for session in rows.chunk_by(|a, b| a.session == b.session) {
            let verdicts = || session.iter().map(|row| row.verdicts[tolerance]);
            let is_within = |verdict: &Verdict| verdict.error_pct <= limit_pct;
            let chosen = || verdicts().filter(|verdict| verdict.chosen.is_some());
            let cheaper = || chosen().filter_map(|verdict| verdict.cheaper_pct);
            sum.muscles += chosen().count();
            sum.refused += verdicts()
                .filter(|verdict| verdict.chosen.is_none())
                .count();
            sum.within += chosen().filter(is_within).count();
            sum.with_cheaper += cheaper().count();
            sum.cheaper_fails += cheaper().filter(|value| *value > limit_pct).count();
            if verdicts().all(|verdict| verdict.chosen.is_some()) {
                sum.sessions += 1;
                sum.sessions_within += usize::from(verdicts().all(|verdict| is_within(&verdict)));
            }
        }
        sum
    }
}

/// Formats all rows as the table docs/charts/ladder.csv.
#[must_use]
pub fn csv(rows: &[Row]) -> String {
    let mut out = "session,kind,duration_s,channel,tires,report,steering".to_owned();
    for tolerance in TOLERANCES {
        let t = tolerance.0 / 100;
        out.push_str(&format!(",chosen_{t},error_{t}_pct,cheaper_{t}_pct"));
    }
    out.push('\n');
    for row in rows {
        out.push_str(&format!(
            "{},{},{:.3},{},{},{},{}",
            row.session,
            row.kind.name(),
            row.duration_s,
            row.channel,
            row.tires,
            row.report,
            row.steering
        ));
        for verdict in row.verdicts {
            let chosen = verdict.chosen.map_or("refused", level_name);
            let cheaper = verdict
                .cheaper_pct
                .map_or(String::new(), |cheaper_pct| format!("{cheaper_pct:.3}"));
            out.push_str(&format!(",{chosen},{:.3},{cheaper}", verdict.error_pct));
        }
        out.push('\n');
    }
    out
}

/// Judges the preregistered sessions: [`draw::SESSIONS`] of seed [`draw::JUDGED`].
///
/// # Errors
/// Returns [`JudgeError`] if a session cannot be generated or simulated.
pub fn judge_declared(step: impl Fn(f64) + Sync) -> Result<Vec<Row>, JudgeError> {
    campaign(draw::JUDGED, draw::SESSIONS, step)
}
