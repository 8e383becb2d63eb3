//! Whether the choice holds where nobody measured: the loop of `closed` on drawn
//! scenes off the grid.
//!
//! A scene names neither a subject nor how far the true muscle is from the nominal
//! one nor its pauses. So what is judged is the worst over all ten subjects, true
//! muscles off by up to 10 % in every constant and two draws of the scene's random
//! parts: the chosen rung is *sufficient* if for all of them the top rung in its
//! place changes the true force by less than the tolerance, at every moment; the
//! next lower rung *fails* if for one of them it does not.

use super::closed::{Off, Wearer, changes};
use super::protocol::Protocol;
use super::table::RUNG_NAMES;
use super::{MeasureError, each};
use firmware::muscle::Rung;
use hal_sim::body::muscle::SUBJECTS;
use hal_sim::random::Random;
use host_core::choice::{Choice, NoRung, Scene, Share, choose};

/// Draws of a scene's random parts, and of true muscles beside the strong ones.
const DRAWS: u64 = 2;
/// Scenes drawn at most, to find enough for every rung.
const DRAWN: u64 = 20_000;

/// What one held-out scene showed, the worst over subjects, true muscles and
/// draws.
#[derive(Clone, Copy, Debug)]
pub struct Verdict {
    /// The scene.
    pub scene: Scene,
    /// What was chosen for it.
    pub choice: Choice,
    /// Change of the true force if the top rung replaces the chosen one, in parts
    /// of the wanted peak; 0 for the top rung itself.
    pub change: f64,
    /// If it replaces the next lower one; none below the lowest.
    pub change_lower: Option<f64>,
    /// Error of the chosen rung's prediction for the nominal muscles, in parts of
    /// the peak.
    pub error: f64,
    /// The same of the next lower rung.
    pub error_lower: Option<f64>,
}

/// A scene off the grid. Every second one has a constant pulse rate, every
/// third one is unbroken, every second one is long enough to tire.
pub fn held_out(seed: u64, index: u64) -> Scene {
    let mut random = Random::new(seed.wrapping_mul(0x0DD5_EED5).wrapping_add(index));
    let mut between = |low: f64, high: f64| random.log_between(low, high) as u32;
    let (a, b) = (between(5_000.0, 150_000.0), between(5_000.0, 150_000.0));
    let (burst, ramp) = (between(1.0, 3_000.0), between(20.0, 8_000.0));
    let session = between(2.0, 60.0);
    Scene {
        burst_ms: if index.is_multiple_of(3) {
            Scene::UNBROKEN
        } else {
            burst
        },
        slowest_mhz: a.min(b),
        fastest_mhz: if index % 4 < 2 { a.min(b) } else { a.max(b) },
        ramp_ms: if index.is_multiple_of(5) { 0 } else { ramp },
        session_s: if index.is_multiple_of(2) { 0 } else { session },
    }
}

/// The rung below.
fn below(rung: Rung) -> Option<Rung> {
    let place = Rung::ALL.iter().position(|r| *r == rung)?;
    Rung::ALL.get(place.checked_sub(1)?).copied()
}

/// Chooses for a scene and closes the loop with the chosen rung, the top one
/// and the next lower one.
///
/// # Errors
/// [`MeasureError`]; a refusal to choose is the inner result.
pub fn judge(
    scene: &Scene,
    tolerance: Share,
    seed: u64,
) -> Result<Result<Verdict, NoRung>, MeasureError> {
    let choice = match choose(scene, tolerance) {
        Ok(choice) => choice,
        Err(refusal) => return Ok(Err(refusal)),
    };
    let protocols: Vec<_> = (0..DRAWS)
        .map(|draw| Protocol::draw(scene, seed.wrapping_mul(DRAWS).wrapping_add(draw)))
        .collect();
    let mut random = Random::new(seed);
    let drawn: Vec<_> = (0..DRAWS).map(|_| Off::draw(&mut random)).collect();
    let found = changes(scene, &protocols, &drawn)?;
    let change = |rung: Rung| found.get(rung as usize).copied().unwrap_or(0.0);
    let error = |rung| {
        let mut worst = 0f64;
        for subject in &SUBJECTS {
            let wearer = Wearer::new(subject, scene);
            worst = worst.max(wearer.prediction_error(&protocols[0], rung)?);
        }
        Ok::<_, MeasureError>(worst)
    };
    let lower = below(choice.rung);
    Ok(Ok(Verdict {
        scene: *scene,
        choice,
        change: change(choice.rung),
        change_lower: lower.map(change),
        error: error(choice.rung)?,
        error_lower: lower.map(error).transpose()?,
    }))
}

/// The first `per_rung` held-out scenes of a seed for which each rung is chosen,
/// among [`DRAWN`]: cheap rungs suffice few of the scenes drawn, and are to be
/// judged all the same. In order of rung, then of drawing.
pub fn scenes(seed: u64, per_rung: usize, tolerance: Share) -> Vec<(u64, Scene)> {
    let mut of_rung: [Vec<(u64, Scene)>; 4] = Default::default();
    for index in 0..DRAWN {
        let scene = held_out(seed, index);
        if let Ok(choice) = choose(&scene, tolerance) {
            let mine = &mut of_rung[choice.rung as usize];
            if mine.len() < per_rung {
                mine.push((index, scene));
            }
        }
    }
    of_rung.into_iter().flatten().collect()
}

/// Of all held-out scenes of a seed, the part for which no rung's own prediction is
/// within the tolerance, so that none is chosen: they are not judged.
pub fn refused(seed: u64, tolerance: Share) -> f64 {
    let is_refused = |index: &u64| choose(&held_out(seed, *index), tolerance).is_err();
    (0..DRAWN).filter(is_refused).count() as f64 / DRAWN as f64
}

/// [`judge`] on [`scenes`].
pub fn campaign(
    seed: u64,
    per_rung: usize,
    tolerance: Share,
    step: impl Fn(f64) + Sync,
) -> Result<Vec<Verdict>, MeasureError> {
    let jobs = scenes(seed, per_rung, tolerance);
    let verdicts = each(&jobs, step, |(index, scene)| {
        judge(scene, tolerance, seed.wrapping_add(*index))
    })?;
    Ok(verdicts.into_iter().filter_map(Result::ok).collect())
}

/// How many of some held-out scenes keep each half of the promise.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct Summary {
    /// Scenes judged.
    pub scenes: usize,
    /// The change found is at most the one that the choice expects.
    pub as_expected: usize,
    /// The top rung in place of the chosen one changes the true force by less
    /// than the tolerance.
    pub sufficient: usize,
    /// Scenes whose chosen rung has one below it.
    pub with_lower: usize,
    /// Of these: the next lower rung changes the true force by the tolerance or
    /// more.
    pub lower_fails: usize,
}

impl Summary {
    /// Counts verdicts.
    pub fn of<'a>(verdicts: impl IntoIterator<Item = &'a Verdict>, tolerance: Share) -> Self {
        let tolerance = f64::from(tolerance.0) * 1e-4;
        let mut sum = Self::default();
        for verdict in verdicts {
            sum.scenes += 1;
            let expected = f64::from(verdict.choice.change.0) * 1e-4;
            sum.as_expected += usize::from(verdict.change <= expected);
            sum.sufficient += usize::from(verdict.change < tolerance);
            if let Some(lower) = verdict.change_lower {
                sum.with_lower += 1;
                sum.lower_fails += usize::from(lower >= tolerance);
            }
        }
        sum
    }
}

/// The committed table of verdicts, `docs/charts/ladder_held_out.csv`; percent.
pub fn csv(judged: &[(Share, Vec<Verdict>)]) -> String {
    let mut out =
        "tolerance_pct,burst_ms,slowest_mhz,fastest_mhz,ramp_ms,session_s,chosen,expected_pct,\
                   change_pct,lower_change_pct,error_pct,lower_error_pct\n"
            .to_owned();
    let pct = |part: f64| format!("{:.3}", part * 100.0);
    let or_empty = |part: Option<f64>| part.map_or_else(String::new, pct);
    let all = judged.iter().flat_map(|(tolerance, verdicts)| {
        let tolerance = tolerance.0 / 100;
        verdicts.iter().map(move |verdict| (tolerance, verdict))
    });
    for (tolerance, v) in all {
        let s = &v.scene;
        let cells = [
            tolerance.to_string(),
            s.burst_ms.to_string(),
            s.slowest_mhz.to_string(),
            s.fastest_mhz.to_string(),
            s.ramp_ms.to_string(),
            s.session_s.to_string(),
            RUNG_NAMES[v.choice.rung as usize].to_owned(),
            pct(f64::from(v.choice.change.0) * 1e-4),
            pct(v.change),
            or_empty(v.change_lower),
            pct(v.error),
            or_empty(v.error_lower),
        ];
        out.push_str(&cells.join(","));
        out.push('\n');
    }
    out
}
