//! A loop closed over a model's own prediction, and what becomes of the true
//! force if the top rung takes another's place in it.
//!
//! The wearer has no force sensor, so the device steers by the force that its
//! model predicts: each pulse gets the gain whose predicted force comes nearest
//! to the wanted one until the next pulse. The wanted force is what the nominal
//! muscle gives, fresh, when the scene is played at [`LEVEL`]; the true muscle
//! differs from the nominal one, and tires.
//!
//! A change is the largest difference, at any moment, between the true force
//! under a rung and that under the top rung, as a part of the wanted peak.

use super::MeasureError;
use super::fatigue;
use super::protocol::Protocol;
use super::signal::{START, reference, spec};
use firmware::muscle::{FatigueSpec, Gain, Ladder, LadderState, Model, Rung};
use firmware::units::us;
use fixed::types::U1F31;
use hal_sim::body::muscle::{Parameters, SUBJECTS};
use hal_sim::random::Random;
use host_core::choice::Scene;

/// Gain at which the wanted force is laid out: leaves room to make up for
/// fatigue.
const LEVEL: f64 = 0.7;
/// How far each constant of the true muscle is from the nominal one's at most.
pub const MISMATCH: f64 = 0.1;
/// How far ahead a pulse's effect is looked at if no other follows, ms.
const HORIZON_MS: u32 = 100;

/// A true muscle: A, K, τc, τ1 and τ2 as parts of the nominal ones.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Off(pub [f64; 5]);

impl Off {
    /// The strong muscles within [`MISMATCH`]: more force from every pulse, and
    /// it fades slowly (first) or fast (second). Among the 16 corners with a strong
    /// A (the true force is in proportion to it) and the nominal muscle, one of
    /// these two showed the largest change in 168 of 180 trials, sixty drawn
    /// scenes for each rung; in the others, changes above 6 %, another corner
    /// came up to a tenth of it higher.
    pub const STRONG: [Self; 2] = [
        Self([1.1, 0.9, 1.1, 1.1, 1.1]),
        Self([1.1, 0.9, 1.1, 0.9, 1.1]),
    ];

    /// Any muscle within [`MISMATCH`].
    pub fn draw(random: &mut Random) -> Self {
        Self(std::array::from_fn(|_| {
            1.0 + MISMATCH * (2.0 * random.unit() - 1.0)
        }))
    }

    fn of(&self, nominal: &Parameters) -> Parameters {
        let [a, k, tau_c, tau1, tau2] = self.0;
        Parameters {
            a_n_per_s: nominal.a_n_per_s * a,
            k: nominal.k * k,
            tau_c_s: nominal.tau_c_s * tau_c,
            tau1_s: nominal.tau1_s * tau1,
            tau2_s: nominal.tau2_s * tau2,
        }
    }
}

/// A nominal muscle in a scene.
#[derive(Clone, Copy, Debug)]
pub struct Wearer {
    nominal: Parameters,
    fatigue: FatigueSpec,
}

impl Wearer {
    /// One who tires as Ding's quadriceps scaled to the strength, or not at all
    /// if the scene leaves fatigue aside.
    pub fn new(nominal: &Parameters, scene: &Scene) -> Self {
        let tires = FatigueSpec::scaled_to(spec(nominal).a_mn_per_s);
        let never = FatigueSpec {
            alpha_a_milli_per_s2: 0,
            alpha_k_nano_per_n_s: 0,
            alpha_tau1_nano_per_n: 0,
            ..tires
        };
        Self {
            nominal: *nominal,
            fatigue: if scene.session_s == 0 { never } else { tires },
        }
    }

    /// The nominal muscle on a rung.
    ///
    /// # Errors
    /// One that the firmware does not take.
    pub fn model(&self, rung: Rung) -> Result<Ladder, MeasureError> {
        Ok(Ladder::new(spec(&self.nominal), Some(self.fatigue), rung)?)
    }

    /// Worst error of a rung's prediction for the nominal muscle at full gain,
    /// in parts of the peak.
    ///
    /// # Errors
    /// As [`Self::model`].
    pub fn prediction_error(&self, protocol: &Protocol, rung: Rung) -> Result<f64, MeasureError> {
        let truth = fatigue::reference(&self.nominal, &self.fatigue, protocol);
        let model = super::signal::predicted(&self.model(rung)?, protocol);
        Ok(super::signal::Difference::of(&truth, &model).worst)
    }

    /// The running change of each of `rungs`, in the worst of the true muscles
    /// `offs`: at every millisecond the largest up to then.
    ///
    /// # Errors
    /// As [`Self::model`].
    pub fn changes(
        &self,
        protocol: &Protocol,
        rungs: &[Rung],
        offs: &[Off],
    ) -> Result<Vec<Vec<f64>>, MeasureError> {
        let mut wanted = reference(&self.nominal, protocol);
        wanted.iter_mut().for_each(|force| *force *= LEVEL);
        let peak = wanted.iter().copied().fold(f64::MIN_POSITIVE, f64::max);
        let steered = |rung| Ok::<_, MeasureError>(steer(&self.model(rung)?, protocol, &wanted));
        let top = steered(Rung::CalciumForceFatigue)?;
        let others: Vec<Protocol> = rungs
            .iter()
            .map(|&rung| steered(rung))
            .collect::<Result<_, _>>()?;
        let mut all = vec![vec![0.0; wanted.len()]; rungs.len()];
        for off in offs {
            let truth = off.of(&self.nominal);
            let force = |protocol| fatigue::reference(&truth, &self.fatigue, protocol);
            let top = force(&top);
            for (worst, other) in all.iter_mut().zip(&others) {
                let mut running = 0f64;
                for ((worst, a), b) in worst.iter_mut().zip(&top).zip(force(other)) {
                    running = running.max((a - b).abs() / peak);
                    *worst = running.max(*worst);
                }
            }
        }
        Ok(all)
    }
}

/// The change of each rung below the top one in a scene, the worst over the
/// subjects, the strong muscles and any given ones, and the protocols.
///
/// # Errors
/// A subject the firmware does not take.
pub fn changes(
    scene: &Scene,
    protocols: &[Protocol],
    drawn: &[Off],
) -> Result<[f64; 3], MeasureError> {
    // Without fatigue calcium–force is the top rung.
    let below = if scene.session_s == 0 { 2 } else { 3 };
    let offs = [&Off::STRONG, drawn].concat();
    let mut worst = [0f64; 3];
    for protocol in protocols {
        for subject in &SUBJECTS {
            let courses =
                Wearer::new(subject, scene).changes(protocol, &Rung::ALL[..below], &offs)?;
            for (worst, course) in worst.iter_mut().zip(courses) {
                *worst = worst.max(course.last().copied().unwrap_or(0.0));
            }
        }
    }
    Ok(worst)
}

/// The protocol with the gains that a loop over `model` gives its pulses.
fn steer(model: &Ladder, protocol: &Protocol, wanted: &[f64]) -> Protocol {
    let mut state = model.at_rest(START);
    let mut pulses = protocol.pulses.clone();
    let mut ahead = protocol.pulses.iter().peekable();
    let mut steered = pulses.iter_mut();
    for ms in 0..=protocol.duration_ms {
        while let Some(&(at_us, _)) = ahead.next_if(|pulse| pulse.0 <= ms * 1000) {
            let next_ms = ahead.peek().map_or(u32::MAX, |pulse| pulse.0 / 1000);
            let until_ms = next_ms.min(ms + HORIZON_MS).min(protocol.duration_ms);
            let wanted = &wanted[ms as usize..=until_ms.max(ms) as usize];
            let gain = best_gain(model, &state, at_us, ms, wanted);
            model.pulse(&mut state, START + us(at_us), gain);
            if let Some(pulse) = steered.next() {
                pulse.1 = gain.get().to_num();
            }
        }
        model.advance(&mut state, START + us(ms * 1000));
    }
    Protocol {
        pulses,
        duration_ms: protocol.duration_ms,
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
    model.pulse(&mut weak, START + us(at_us), least_gain());
    model.pulse(&mut full, START + us(at_us), Gain::FULL);
    let (mut product, mut square) = (0.0, 0.0);
    for (ms, wanted) in (first_ms..).zip(wanted) {
        let force = |state: &mut LadderState| {
            model.advance(state, START + us(ms * 1000));
            model.force(state).get().to_num::<f64>()
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
