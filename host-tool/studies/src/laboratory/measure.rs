//! Defines the measures that are computed from a trial, by name.

use firmware::safety::StageSpec;
use host_core::analysis::{WallContact, force_metrics, metrics_without_lag, wall_contacts};
use host_core::record::Trial;
use host_core::session::{BodySpec, Session};

/// Definition of a measure: a number that is computed from a trial.
pub struct Measure {
    /// Identifier in declarations, `draws.csv` and `result.json`.
    pub id: &'static str,
    /// Readable name of the measure.
    pub quantity: &'static str,
    /// Unit of the value; empty for a count.
    pub unit: &'static str,
    /// Part that a session needs so that its trials have the measure.
    pub needs: Needs,
    /// Function that computes the value; it returns `None` if the trial does not have the measure.
    pub of: fn(&Session, &Trial) -> Option<f64>,
}

/// Part of a session that a measure needs.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Needs {
    /// No part: every session has the measure.
    Nothing,
    /// A simulated limb that can move.
    Limb,
    /// A reference angle.
    Reference,
    /// A channel under force control.
    Force,
    /// A virtual wall.
    Wall,
}

impl Needs {
    /// Returns whether `session` has the part.
    #[must_use]
    pub fn is_met(self, session: &Session) -> bool {
        match self {
            Self::Nothing => true,
            Self::Limb => !matches!(session.body, None | Some(BodySpec::Still { .. })),
            Self::Reference => session.joint.is_some(),
            Self::Force => session.channels.iter().any(|c| c.force.is_some()),
            Self::Wall => session.wall.is_some(),
        }
    }

    /// Returns the part as a phrase, with the key of a session file.
    #[must_use]
    pub const fn words(self) -> &'static str {
        match self {
            Self::Nothing => "nothing",
            Self::Limb => "a simulated limb that moves (`[body]`)",
            Self::Reference => "a reference angle (`[joint]`)",
            Self::Force => "a channel with `force`",
            Self::Wall => "a virtual wall (`[wall]`)",
        }
    }
}

/// All measures that a declaration can name.
#[rustfmt::skip]
pub const MEASURES: &[Measure] = &[
    Measure { id: "rmse_deg", quantity: "RMSE of the measured angle", unit: "°", needs: Needs::Reference, of: |_, trial| Some(metrics_without_lag(trial)?.rmse_deg) },
    Measure { id: "worst_deg", quantity: "largest error of the measured angle", unit: "°", needs: Needs::Reference, of: |_, trial| Some(metrics_without_lag(trial)?.max_abs_deg) },
    Measure { id: "limiting_share", quantity: "share of samples at a limit", unit: "", needs: Needs::Reference, of: |_, trial| Some(metrics_without_lag(trial)?.limiting_share) },
    Measure { id: "force_rmse_n", quantity: "largest RMSE of a predicted force", unit: "N", needs: Needs::Force, of: |_, trial| force_metrics(trial).iter().map(|m| m.rmse_n).reduce(f64::max) },
    Measure { id: "deepest_deg", quantity: "largest depth inside the wall", unit: "°", needs: Needs::Wall, of: |_, trial| deepest(trial, |_| 0.0) },
    Measure { id: "beyond_begin_deg", quantity: "largest depth beyond the angle where stimulation begins", unit: "°", needs: Needs::Wall, of: |_, trial| deepest(trial, |front_deg| front_deg) },
    Measure { id: "swing_deg", quantity: "peak-to-peak swing over the last 2 s of the push", unit: "°", needs: Needs::Wall, of: |_, trial| Some(visit(trial)?.swing_deg()) },
    Measure { id: "turns", quantity: "reversals of at least 0.5°", unit: "", needs: Needs::Wall, of: |_, trial| Some(last_hit(trial)?.turns as f64) },
    Measure { id: "settling_s", quantity: "time from the first reversal until within 1° of the final angle", unit: "s", needs: Needs::Wall, of: |_, trial| Some(visit(trial)?.settling_s()) },
    Measure { id: "peak_deg", quantity: "largest true angle", unit: "°", needs: Needs::Limb, of: |_, trial| trial.samples.iter().filter_map(|sample| sample.true_deg).reduce(f64::max) },
    Measure { id: "charge_mc", quantity: "charge of all first phases", unit: "mC", needs: Needs::Nothing, of: |session, trial| Some(delivered_dose(session, trial).0) },
    Measure { id: "energy_mj", quantity: "energy into 1 kΩ (assumed) or a voltage stage's load", unit: "mJ", needs: Needs::Nothing, of: |session, trial| Some(delivered_dose(session, trial).1) },
];

/// Returns the measure with this identifier; `None` if there is none.
#[must_use]
pub fn find_measure(id: &str) -> Option<&'static Measure> {
    MEASURES.iter().find(|measure| measure.id == id)
}

/// Length of the last part of a contact with the wall in which the swing is judged, s.
const JUDGED_S: f64 = 2.0;
/// Largest distance of a settled arm from its final angle, °.
const SETTLED_DEG: f64 = 1.0;

fn last_hit(trial: &Trial) -> Option<WallContact> {
    wall_contacts(trial).into_iter().last()
}

fn deepest(trial: &Trial, begin: fn(f64) -> f64) -> Option<f64> {
    let front_deg = begin(trial.wall?.pre_wall_deg);
    Some(last_hit(trial)?.deepest_deg + front_deg)
}

/// Course of a contact with the wall: time, s, and angle, ° of each sample, from the first contact
/// until the trial ends or the arm finally turns back.
struct Visit(Vec<(f64, f64)>);

/// Returns the last contact of the trial with the wall; `None` if there was none.
fn visit(trial: &Trial) -> Option<Visit> {
    let hit = last_hit(trial)?;
    let inside = |t_s: f64| (hit.at_s..=hit.at_s + hit.for_s).contains(&t_s);
    let samples = trial.samples.iter().filter(|sample| inside(sample.t_s));
    let course = samples.filter_map(|s| Some((s.t_s, s.true_deg.or(s.measured_deg)?)));
    let course: Vec<(f64, f64)> = course.collect();
    (!course.is_empty()).then_some(Visit(course))
}

impl Visit {
    /// Returns the angles in the last [`JUDGED_S`] seconds of the contact.
    fn late(&self) -> impl Iterator<Item = f64> {
        let end_s = self.0.last().map_or(0.0, |(t_s, _)| *t_s);
        let late = self
            .0
            .iter()
            .filter(move |(t_s, _)| *t_s >= end_s - JUDGED_S);
        late.map(|(_, deg)| *deg)
    }

    fn swing_deg(&self) -> f64 {
        let (low, high) = self.late().fold((f64::MAX, f64::MIN), |(low, high), deg| {
            (low.min(deg), high.max(deg))
        });
        high - low
    }

    /// Returns the settling time, s: from the first turn of the arm until it stays within
    /// [`SETTLED_DEG`] of its final angle. Time before the first turn does not count, because the
    /// arm still approaches then, and a pre-wall begins earlier than a wall. 0 for an arm that
    /// never turns.
    fn settling_s(&self) -> f64 {
        let (count, sum) = self
            .late()
            .fold((0.0, 0.0), |(n, sum), deg| (n + 1.0, sum + deg));
        let is_off = |(_, deg): &&(f64, f64)| (deg - sum / count).abs() > SETTLED_DEG;
        let turn = self
            .0
            .windows(2)
            .find(|pair| matches!(pair, [a, b] if b.1 < a.1));
        let turn_s = turn
            .and_then(|pair| pair.first())
            .map_or(f64::INFINITY, |pair| pair.0);
        let last_off = self.0.iter().rfind(is_off);
        last_off.map_or(0.0, |(t_s, _)| (t_s - turn_s).max(0.0))
    }
}

/// Load between the electrodes of a current stage, Ω. It is assumed, because the real load is
/// unknown.
const ASSUMED_OHM: f64 = 1_000.0;

/// Returns the charge of all first phases of the trial, mC, and the energy of all phases, mJ. The
/// amplitude of a telemetry sample counts until the next sample.
fn delivered_dose(session: &Session, trial: &Trial) -> (f64, f64) {
    let (mut charge_mc, mut energy_mj) = (0.0, 0.0);
    for (sample, next) in trial.samples.iter().zip(trial.samples.iter().skip(1)) {
        let for_s = next.t_s - sample.t_s;
        for (channel, amplitude) in session.channels.iter().zip(&sample.amplitudes) {
            let Some(amplitude) = amplitude else { continue };
            let train = channel.spec.train;
            let pulses = for_s * f64::from(train.burst_count) / (f64::from(train.period_us) * 1e-6);
            let (ma, ohm) = match channel.spec.stage {
                StageSpec::Voltage { load_ohm, .. } => {
                    let ohm = f64::from(load_ohm);
                    (amplitude * 1e3 / ohm, ohm)
                }
                StageSpec::Current { .. } => (*amplitude, ASSUMED_OHM),
            };
            let width_s = f64::from(train.width_us) * 1e-6;
            let phases = if train.shape.is_biphasic() { 2.0 } else { 1.0 };
            charge_mc += pulses * ma * width_s;
            energy_mj += pulses * phases * ma * ma * 1e-3 * ohm * width_s;
        }
    }
    (charge_mc, energy_mj)
}
