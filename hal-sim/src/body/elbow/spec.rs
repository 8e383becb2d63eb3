//! The numbers of one elbow and of the person it belongs to.

use super::{TICK_S, YieldSpec};
use crate::body::CHANNELS;
use crate::body::muscle::Parameters;
use crate::body::wearer::RECRUITMENT_CURVATURE;

/// A muscle across the elbow and the electrodes on it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ElbowMuscle {
    /// Channel whose electrodes are on it, 0 to 9.
    pub channel: usize,
    /// Motor threshold, mA at `width_us`.
    pub threshold_ma: f64,
    /// Current of full recruitment, mA at `width_us`; above the threshold.
    pub max_ma: f64,
    /// Pulse width at which the currents hold, µs.
    pub width_us: u32,
    /// Torque at full recruitment and [`TORQUE_FREQUENCY_HZ`], N·m.
    pub torque_nm: f64,
    /// Dynamics, force normalised to 1 at [`TORQUE_FREQUENCY_HZ`].
    pub dynamics: Parameters,
}

/// Stimulation frequency at which an elbow's torques hold, Hz.
pub const TORQUE_FREQUENCY_HZ: f64 = 50.0;

/// One voluntary movement into the direction of flexion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VoluntaryApproach {
    /// When it begins, s after the simulated world does.
    pub at_s: f64,
    /// Speed meant, °/s, above 0.
    pub speed_deg_per_s: f64,
    /// How long the person goes on, pushing where something resists, s; the
    /// arm then goes back.
    pub for_s: f64,
}

/// The person: moves at a meant speed with limited strength.
///
/// The voluntary torque is gain · (meant rate − rate), clamped to ± `push_nm`.
/// Free, the arm moves at nearly the meant speed; held back, the person pushes
/// with a constant torque, as Harris' participant was told to ("at a low force
/// level, held as constant as possible"). The meant rate rises along a
/// minimum-jerk course (Flash & Hogan 1985) over `onset_s`. There is no reflex,
/// and no reaction to what is felt but with [`YieldSpec`]: both later than an oscillation
/// that matters here, and none known for this participant. With [`VisionSpec`] the person
/// corrects, late and now and then.
#[derive(Debug, Clone, PartialEq)]
pub struct MotorBehaviour {
    /// Angle the arm rests at and goes back to, degrees.
    pub start_deg: f64,
    /// Movements, in order of time.
    pub approaches: Vec<VoluntaryApproach>,
    /// Strongest voluntary torque, either way, N·m.
    pub push_nm: f64,
    /// Torque per error of rate, N·m·s/rad. High, so that a held arm meets
    /// `push_nm` at any speed: the person adds a force, not a damper.
    pub gain_nm_s_per_rad: f64,
    /// Duration of the rise of the meant rate, s.
    pub onset_s: f64,
    /// Speed of going back, °/s.
    pub return_deg_per_s: f64,
    /// A screen with the arm's angle and a line; without it the person is blind.
    pub sight: Option<VisionSpec>,
    /// What the person does who feels stimulation; nothing without it.
    pub yields: Option<YieldSpec>,
}

/// What a person does who sees the arm's angle and a line to stay at: at steps of
/// `every_s` the meant speed becomes what would bring the angle seen, `delay_s` old,
/// to the line within a step, never faster than the approach. Between steps nothing
/// corrects: people move intermittently. Delay and step are of the order that the
/// tracking literature gives (visual reaction 0.2 to 0.25 s, two to four corrections
/// a second); for this participant they are assumed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VisionSpec {
    /// From the arm to the person's muscles, s.
    pub delay_s: f64,
    /// From one correction to the next, s; above 0.
    pub every_s: f64,
    /// Where the line is, degrees.
    pub line_deg: f64,
}

/// A forearm about its elbow, in the horizontal plane (Harris' platform carries
/// it: no gravity), flexion positive. All fields are free, so that arms can be
/// drawn at random; [`super::Elbow::new`] checks them.
#[derive(Debug, Clone, PartialEq)]
pub struct ElbowSpec {
    /// Extends: pulls out of a wall that stops flexion.
    pub triceps: ElbowMuscle,
    /// Flexes.
    pub biceps: ElbowMuscle,
    /// See [`RECRUITMENT_CURVATURE`]; not zero.
    pub recruitment_curvature: f64,
    /// Time from a pulse to its effect on the muscle, µs.
    pub electromechanical_delay_us: u32,
    /// Moment of inertia about the elbow, kg·m².
    pub inertia_kg_m2: f64,
    /// Passive stiffness towards the rest angle, N·m/rad.
    pub stiffness_nm_per_rad: f64,
    /// Passive viscous friction, N·m·s/rad.
    pub damping_nm_s_per_rad: f64,
    /// Viscous friction per torque of each active muscle, the slope of its
    /// force-velocity curve, s/rad.
    pub active_damping_s_per_rad: f64,
    /// Angle without passive torque, degrees.
    pub rest_deg: f64,
    /// Inelastic stops, degrees, low to high.
    pub stops_deg: [f64; 2],
    /// Resistance of every pair of electrodes, Ω.
    pub load_ohm: f64,
    /// Standard deviation of the sensor's noise, white at 1 kHz, degrees.
    pub sensor_noise_deg: f64,
    /// Whose arm it is.
    pub person: MotorBehaviour,
}

/// A number of an [`ElbowSpec`] that no arm can have; names the field.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("elbow: `{0}` is out of range")]
pub struct InvalidElbow(pub &'static str);

impl Default for ElbowSpec {
    /// An arm for Harris' experiment, triceps on channel 0, biceps on 1.
    ///
    /// From sources: inertia 0.06 kg·m² (our study of Harris); delay and muscle
    /// dynamics as the finger's (Lee 2020, mean of table 4: no elbow's constants
    /// are in the papers at hand); active friction 75/m · 0.03 m · 0.05 s =
    /// 0.11 s/rad (arm model of PMC2784227, table 1: stiffness per force,
    /// elbow moment arm, damping per stiffness). Assumed, order of magnitude
    /// only: passive stiffness and friction with the platform's bearing, torques,
    /// thresholds (80 mA at 35 µs is Harris' strongest triceps stimulation, 40 mA
    /// at 25 µs his biceps at "25 % to 50 %" co-contraction), load, push.
    fn default() -> Self {
        let dynamics = Parameters::mean_subject_at_50_hz(); // TORQUE_FREQUENCY_HZ
        Self {
            triceps: ElbowMuscle {
                channel: 0,
                threshold_ma: 25.0,
                max_ma: 80.0,
                width_us: 35,
                torque_nm: 5.0,
                dynamics,
            },
            biceps: ElbowMuscle {
                channel: 1,
                threshold_ma: 20.0,
                max_ma: 70.0,
                width_us: 25,
                torque_nm: 6.0,
                dynamics,
            },
            recruitment_curvature: RECRUITMENT_CURVATURE,
            electromechanical_delay_us: 25_000,
            inertia_kg_m2: 0.06,
            stiffness_nm_per_rad: 1.0,
            damping_nm_s_per_rad: 0.4,
            active_damping_s_per_rad: 0.11,
            rest_deg: 70.0,
            stops_deg: [0.0, 145.0],
            load_ohm: 1_000.0,
            sensor_noise_deg: 0.02,
            person: MotorBehaviour::default(),
        }
    }
}

impl Default for MotorBehaviour {
    /// Waits at 60°: 30° before Harris' wall.
    fn default() -> Self {
        Self {
            start_deg: 60.0,
            approaches: Vec::new(),
            push_nm: 1.5,
            gain_nm_s_per_rad: 30.0,
            onset_s: 0.2,
            return_deg_per_s: 30.0,
            sight: None,
            yields: None,
        }
    }
}

impl ElbowSpec {
    pub(super) fn validate(&self) -> Result<(), InvalidElbow> {
        let positive = |v: f64| v.is_finite() && v > 0.0;
        let not_negative = |v: f64| v.is_finite() && v >= 0.0;
        let muscle = |m: &ElbowMuscle| {
            let is_range = m.max_ma.is_finite() && m.max_ma > m.threshold_ma;
            m.channel < CHANNELS
                && m.width_us > 0
                && [m.threshold_ma, m.torque_nm].into_iter().all(not_negative)
                && is_range
                && m.dynamics.all().into_iter().all(positive)
        };
        let [low, high] = self.stops_deg;
        let between = |v: f64| (low..=high).contains(&v);
        let person = &self.person;
        let approaches = &person.approaches;
        let after = |pair: &[VoluntaryApproach]| pair[0].at_s + pair[0].for_s <= pair[1].at_s;
        let in_order = approaches.windows(2).all(after);
        let holds = |a: &VoluntaryApproach| {
            not_negative(a.at_s) && [a.speed_deg_per_s, a.for_s].map(positive) == [true; 2]
        };
        let hold = approaches.iter().all(holds);
        let curvature = self.recruitment_curvature;
        #[rustfmt::skip]
        let rules = [
            ("triceps", muscle(&self.triceps)),
            ("biceps", muscle(&self.biceps)),
            ("recruitment_curvature", curvature.is_finite() && curvature != 0.0),
            ("inertia_kg_m2", positive(self.inertia_kg_m2)),
            ("stiffness_nm_per_rad", not_negative(self.stiffness_nm_per_rad)),
            ("damping_nm_s_per_rad", not_negative(self.damping_nm_s_per_rad)),
            ("active_damping_s_per_rad", not_negative(self.active_damping_s_per_rad)),
            ("stops_deg", low.is_finite() && high.is_finite() && low < high),
            ("rest_deg", between(self.rest_deg)),
            ("load_ohm", positive(self.load_ohm)),
            ("sensor_noise_deg", not_negative(self.sensor_noise_deg)),
            ("start_deg", between(person.start_deg)),
            ("approaches", in_order && hold),
            ("push_nm", not_negative(person.push_nm)),
            ("gain_nm_s_per_rad", positive(person.gain_nm_s_per_rad)),
            ("onset_s", positive(person.onset_s)),
            ("return_deg_per_s", positive(person.return_deg_per_s)),
            ("sight", person.sight.is_none_or(|sight| {
                (0.0..=2.0).contains(&sight.delay_s) && sight.every_s >= TICK_S && between(sight.line_deg)
            })),
            ("yields", person.yields.is_none_or(|yields| yields.is_valid())),
        ];
        match rules.iter().find(|(_, holds)| !holds) {
            Some((field, _)) => Err(InvalidElbow(field)),
            None => Ok(()),
        }
    }
}
