//! Whether the choice holds where nobody measured: a loop closed over the
//! model's own prediction, on drawn scenes off the grid.
//!
//! The wearer has no force sensor, so the device steers by the force that its
//! model predicts: each pulse gets the gain whose predicted force comes nearest
//! to the wanted one until the next pulse. The better the rung, the nearer the
//! true force. The wanted force is what the nominal muscle gives, fresh, when
//! the scene is played at [`LEVEL`]; the true muscle differs from the nominal
//! one in every constant, and tires.
//!
//! What is judged is the true force: the tolerance is a just-noticeable
//! difference, so a rung is replaceable if the force that results differs from
//! the one under the top rung by less than that at every moment. How far the
//! error against the wanted force changes is told beside it.

use super::fatigue::{self, Tiring};
use super::protocol::{Protocol, Random};
use super::signal::{START, predicted, spec};
use super::table::RUNG_NAMES;
use super::{MeasureError, each};
use firmware::muscle::choice::{Choice, NoRung, Scene, Share, choose};
use firmware::muscle::{FatigueSpec, Gain, Ladder, LadderState, Model, Rung};
use fixed::types::U1F31;
use hal_sim::body::muscle::{Parameters, SUBJECTS};

/// Gain at which the wanted force is laid out: leaves room to make up for
/// fatigue.
const LEVEL: f64 = 0.7;
/// How far each constant of the true muscle is from the nominal one's at most.
const MISMATCH: f64 = 0.1;
/// Scenes drawn at most, to find enough for every rung.
const DRAWN: u64 = 20_000;
/// How far ahead a pulse's effect is looked at if no other follows, ms.
const HORIZON_MS: u32 = 100;

/// What becomes of a scene if the top rung takes another's place; parts of the
/// wanted peak.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Change {
    /// Largest difference between the two true forces at any moment.
    pub force: f64,
    /// Change of the true force's root-mean-square error.
    pub rms_error: f64,
    /// Change of its worst error.
    pub worst_error: f64,
}

impl Change {
    /// From a true force to another, both wanted to be `wanted`.
    fn between(one: &[f64], other: &[f64], wanted: &[f64]) -> Self {
        let peak = wanted.iter().copied().fold(f64::MIN_POSITIVE, f64::max);
        let apart = |a: &[f64], b: &[f64]| {
            let each = a.iter().zip(b).map(|(a, b)| (a - b).abs() / peak);
            let (worst, sum) = each.fold((0f64, 0.0), |(w, s), d| (w.max(d), s + d * d));
            (worst, (sum / a.len().max(1) as f64).sqrt())
        };
        let (one_error, other_error) = (apart(one, wanted), apart(other, wanted));
        Self {
            force: apart(one, other).0,
            rms_error: (one_error.1 - other_error.1).abs(),
            worst_error: (one_error.0 - other_error.0).abs(),
        }
    }

    fn max(self, other: Self) -> Self {
        Self {
            force: self.force.max(other.force),
            rms_error: self.rms_error.max(other.rms_error),
            worst_error: self.worst_error.max(other.worst_error),
        }
    }
}

/// What one held-out scene showed, the worst over all ten subjects.
#[derive(Clone, Copy, Debug)]
pub struct Verdict {
    /// The scene.
    pub scene: Scene,
    /// What was chosen for it.
    pub choice: Choice,
    /// Error of the chosen rung's prediction in this very scene, played at full
    /// gain: to compare with what the choice expects.
    pub found: f64,
    /// The same of the next lower rung.
    pub found_lower: Option<f64>,
    /// If the top rung replaces the chosen one.
    pub chosen: Change,
    /// If it replaces the next lower one; none below the lowest.
    pub lower: Option<Change>,
}

/// A scene off the grid. Every second one has a constant pulse rate, every
/// third one is unbroken, every second one is long enough to tire.
#[must_use]
pub fn held_out(seed: u64, index: u64) -> Scene {
    let mut random = Random(seed.wrapping_mul(0x0DD5_EED5).wrapping_add(index));
    let mut between = |low: f64, high: f64| random.log_uniform(low, high) as u32;
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
    let protocol = Protocol::draw(scene, seed);
    let mut verdict = Verdict {
        scene: *scene,
        choice,
        found: 0.0,
        found_lower: below(choice.rung).map(|_| 0.0),
        chosen: Change::default(),
        lower: below(choice.rung).map(|_| Change::default()),
    };
    for (subject, number) in SUBJECTS.iter().zip(0..) {
        let wearer = Wearer::new(subject, scene, seed ^ (number << 32));
        let wanted = wearer.wanted(&protocol);
        let force = |rung| wearer.force(&protocol, &wanted, rung);
        let top = force(Rung::CalciumForceFatigue)?;
        let change = |rung| Ok::<_, MeasureError>(Change::between(&force(rung)?, &top, &wanted));
        verdict.chosen = verdict.chosen.max(change(choice.rung)?);
        if let (Some(rung), Some(worst)) = (below(choice.rung), verdict.lower) {
            verdict.lower = Some(worst.max(change(rung)?));
            let found = wearer.open(&protocol, rung)?;
            verdict.found_lower = verdict.found_lower.map(|worst| worst.max(found));
        }
        verdict.found = verdict.found.max(wearer.open(&protocol, choice.rung)?);
    }
    Ok(Ok(verdict))
}

/// The first `per_rung` held-out scenes of a seed for which each rung is chosen,
/// among [`DRAWN`]: cheap rungs suffice few of the scenes drawn, and are to be
/// judged all the same. In order of rung, then of drawing.
#[must_use]
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

/// [`judge`] on [`scenes`].
///
/// # Errors
/// [`MeasureError`].
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
    /// The error found is at most the one that the choice expects.
    pub as_expected: usize,
    /// The top rung in place of the chosen one changes the true force by less
    /// than the tolerance.
    pub sufficient: usize,
    /// Scenes whose chosen rung has one below it.
    pub with_lower: usize,
    /// Of these: the next lower rung changes the true force by the tolerance or
    /// more.
    pub lower_fails: usize,
    /// Of these: not so, but its prediction is wrong by the tolerance or more;
    /// the loop forgives.
    pub lower_forgiven: usize,
    /// Of these: nor that; the choice was too careful for this very scene.
    pub too_careful: usize,
}

impl Summary {
    /// Counts verdicts.
    pub fn of<'a>(verdicts: impl IntoIterator<Item = &'a Verdict>, tolerance: Share) -> Self {
        let tolerance = f64::from(tolerance.0) * 1e-4;
        let mut sum = Self::default();
        for verdict in verdicts {
            sum.scenes += 1;
            let expected = f64::from(verdict.choice.error.0) * 1e-4;
            sum.as_expected += usize::from(verdict.found <= expected);
            sum.sufficient += usize::from(verdict.chosen.force < tolerance);
            let (Some(lower), Some(found)) = (verdict.lower, verdict.found_lower) else {
                continue;
            };
            sum.with_lower += 1;
            if lower.force >= tolerance {
                sum.lower_fails += 1;
            } else if found >= tolerance {
                sum.lower_forgiven += 1;
            } else {
                sum.too_careful += 1;
            }
        }
        sum
    }
}

/// The committed table of verdicts, `docs/charts/ladder_held_out.csv`; percent.
#[must_use]
pub fn csv(verdicts: &[Verdict]) -> String {
    let mut out = "burst_ms,slowest_mhz,fastest_mhz,ramp_ms,session_s,chosen,expected_pct,\
                   found_pct,force_change_pct,rms_error_change_pct,lower_found_pct,\
                   lower_force_change_pct,lower_rms_error_change_pct\n"
        .to_owned();
    let pct = |part: f64| format!("{:.3}", part * 100.0);
    let or_empty = |part: Option<f64>| part.map_or_else(String::new, pct);
    for v in verdicts {
        let s = &v.scene;
        let cells = [
            s.burst_ms.to_string(),
            s.slowest_mhz.to_string(),
            s.fastest_mhz.to_string(),
            s.ramp_ms.to_string(),
            s.session_s.to_string(),
            RUNG_NAMES[v.choice.rung as usize].to_owned(),
            pct(f64::from(v.choice.error.0) * 1e-4),
            pct(v.found),
            pct(v.chosen.force),
            pct(v.chosen.rms_error),
            or_empty(v.found_lower),
            or_empty(v.lower.map(|l| l.force)),
            or_empty(v.lower.map(|l| l.rms_error)),
        ];
        out.push_str(&cells.join(","));
        out.push('\n');
    }
    out
}

/// A nominal muscle and a true one.
struct Wearer {
    nominal: Parameters,
    truth: Parameters,
    fatigue: FatigueSpec,
    true_fatigue: FatigueSpec,
}

impl Wearer {
    fn new(subject: &Parameters, scene: &Scene, seed: u64) -> Self {
        let mut random = Random(seed);
        let mut off = || 1.0 + MISMATCH * (2.0 * random.uniform() - 1.0);
        let truth = Parameters {
            a_n_per_s: subject.a_n_per_s * off(),
            k: subject.k * off(),
            tau_c_s: subject.tau_c_s * off(),
            tau1_s: subject.tau1_s * off(),
            tau2_s: subject.tau2_s * off(),
        };
        let mut fatigue = FatigueSpec::scaled_to(spec(subject).a_mn_per_s);
        if scene.session_s == 0 {
            fatigue = FatigueSpec {
                alpha_a_milli_per_s2: 0,
                alpha_k_nano_per_n_s: 0,
                alpha_tau1_nano_per_n: 0,
                ..fatigue
            };
        }
        let mut drawn = |alpha: u32| (f64::from(alpha) * off()) as u32;
        Self {
            nominal: *subject,
            truth,
            fatigue,
            true_fatigue: FatigueSpec {
                alpha_a_milli_per_s2: drawn(fatigue.alpha_a_milli_per_s2),
                alpha_k_nano_per_n_s: drawn(fatigue.alpha_k_nano_per_n_s),
                alpha_tau1_nano_per_n: drawn(fatigue.alpha_tau1_nano_per_n),
                ..fatigue
            },
        }
    }

    fn model(&self, rung: Rung) -> Result<Ladder, MeasureError> {
        Ok(Ladder::new(spec(&self.nominal), Some(self.fatigue), rung)?)
    }

    /// Worst error of a rung's prediction for the nominal muscle, in parts of
    /// the peak.
    fn open(&self, protocol: &Protocol, rung: Rung) -> Result<f64, MeasureError> {
        let truth = fatigue::reference(&self.nominal, &self.fatigue, protocol);
        let model = predicted(&self.model(rung)?, protocol);
        Ok(super::signal::Difference::of(&truth, &model).worst)
    }

    /// The force that the scene wants, every millisecond, N.
    fn wanted(&self, protocol: &Protocol) -> Vec<f64> {
        let mut wanted = super::signal::reference(&self.nominal, protocol);
        wanted.iter_mut().for_each(|force| *force *= LEVEL);
        wanted
    }

    /// The true force with a rung in the loop, every millisecond, N.
    fn force(
        &self,
        protocol: &Protocol,
        wanted: &[f64],
        rung: Rung,
    ) -> Result<Vec<f64>, MeasureError> {
        let model = self.model(rung)?;
        let mut state = model.at_rest(START);
        let mut muscle = Tiring::new(self.truth, &self.true_fatigue);
        let mut pulses = protocol.pulses.iter().peekable();
        let mut now_us = 0;
        let mut force = Vec::with_capacity(wanted.len());
        for ms in 0..=protocol.duration_ms {
            while let Some(&(at_us, _)) = pulses.next_if(|p| p.0 <= ms * 1000) {
                let next_ms = pulses.peek().map_or(u32::MAX, |p| p.0 / 1000);
                let until_ms = next_ms.min(ms + HORIZON_MS).min(protocol.duration_ms);
                let ahead = &wanted[ms as usize..=until_ms.max(ms) as usize];
                let gain = best_gain(&model, &state, at_us, ms, ahead);
                muscle.pass(at_us - now_us);
                now_us = at_us;
                muscle.pulse(gain.get().to_num());
                model.pulse(&mut state, START.plus(at_us), gain);
            }
            muscle.pass(ms * 1000 - now_us);
            now_us = ms * 1000;
            model.advance(&mut state, START.plus(now_us));
            force.push(muscle.force());
        }
        Ok(force)
    }
}

/// The gain of a pulse at `at_us` that brings the predicted force nearest, in
/// the least squares, to what is wanted at `first_ms` and the milliseconds
/// after it. By the last pulse of a rung that does not see an effect: [`LEVEL`].
fn best_gain(
    model: &Ladder,
    state: &LadderState,
    at_us: u32,
    first_ms: u32,
    wanted: &[f64],
) -> Gain {
    // Until the next pulse every rung's force is linear in this one's gain.
    let (mut weak, mut full) = (*state, *state);
    model.pulse(&mut weak, START.plus(at_us), least_gain());
    model.pulse(&mut full, START.plus(at_us), Gain::FULL);
    let (mut product, mut square) = (0.0, 0.0);
    for (ms, wanted) in (first_ms..).zip(wanted) {
        let force = |state: &mut LadderState| {
            model.advance(state, START.plus(ms * 1000));
            model.force(state).0.to_num::<f64>()
        };
        let (without, with) = (force(&mut weak), force(&mut full));
        product += (wanted - without) * (with - without);
        square += (with - without) * (with - without);
    }
    let gain = if square > 1e-9 {
        product / square
    } else {
        LEVEL
    };
    Gain::new(U1F31::saturating_from_num(gain.max(0.0))).max(least_gain())
}

/// The least gain a pulse gets: 0 would be no pulse.
fn least_gain() -> Gain {
    Gain::new(U1F31::from_num(1e-3))
}
