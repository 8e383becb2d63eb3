//! Parameters of an elbow and of its wearer.

use super::{TICK_S, YieldSpec};
use crate::body::CHANNELS;
use crate::body::muscle::Parameters;
use crate::body::wearer::RECRUITMENT_CURVATURE;

/// A muscle across the elbow, and the electrodes over it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ElbowMuscle {
    /// Channel whose electrodes are over the muscle, 0 to 9.
    pub channel: usize,
    /// Motor threshold, mA at `width_us`.
    pub threshold_ma: f64,
    /// Current of full recruitment, mA at `width_us`; above the threshold.
    pub max_ma: f64,
    /// Pulse width to which `threshold_ma` and `max_ma` refer, µs.
    pub width_us: u32,
    /// Torque at full recruitment and [`TORQUE_FREQUENCY_HZ`], N·m.
    pub torque_nm: f64,
    /// Calcium-force dynamics, normalised to a force of 1 at [`TORQUE_FREQUENCY_HZ`].
    pub dynamics: Parameters,
}

/// Pulse rate to which the torques of an [`ElbowMuscle`] refer, Hz.
pub const TORQUE_FREQUENCY_HZ: f64 = 50.0;

/// One voluntary movement in the direction of flexion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VoluntaryApproach {
    /// Start of the movement, s after the start of the simulation.
    pub at_s: f64,
    /// Intended speed, °/s, above 0.
    pub speed_deg_per_s: f64,
    /// Duration of the movement, s, including the push against a resistance; the arm then returns.
    pub for_s: f64,
}

/// Motor behaviour of a wearer who moves at an intended speed with limited strength.
///
/// The voluntary torque is gain · (intended rate − rate), clamped to ± `push_nm`. Without
/// resistance the arm moves at nearly the intended speed; against resistance the wearer pushes with
/// a constant torque, as Harris' participant was asked to ("at a low force level, held as constant
/// as possible"). The intended rate rises along a minimum-jerk trajectory (Flash & Hogan 1985) over
/// `onset_s`. There is no reflex, and no reaction to what is felt except with [`YieldSpec`]: both
/// are slower than an oscillation that matters here, and neither is known for this participant.
/// With [`VisionSpec`] the wearer corrects, late and intermittently.
#[derive(Debug, Clone, PartialEq)]
pub struct MotorBehaviour {
    /// Angle at which the arm rests and to which it returns, degrees.
    pub start_deg: f64,
    /// Movements, in order of time.
    pub approaches: Vec<VoluntaryApproach>,
    /// Largest voluntary torque in either direction, N·m.
    pub push_nm: f64,
    /// Gain of the voluntary torque: torque per difference between intended and actual rate,
    /// N·m·s/rad. It is so high that the torque saturates at `push_nm` as soon as something holds
    /// the arm back. The wearer then acts like a constant force, not like a damper.
    pub gain_nm_s_per_rad: f64,
    /// Duration of the rise of the intended rate, s.
    pub onset_s: f64,
    /// Speed of the return, °/s.
    pub return_deg_per_s: f64,
    /// Screen that shows the arm's angle and a line; without it the wearer has no visual feedback.
    pub sight: Option<VisionSpec>,
    /// Reaction to felt stimulation; `None` for no reaction.
    pub yields: Option<YieldSpec>,
}

/// Behaviour of a wearer who sees the arm's angle and a line at which to stay. At intervals of
/// `every_s`, the intended speed becomes the one that would bring the seen angle, which is
/// `delay_s` old, to the line within one interval, never faster than the approach. There is no
/// correction between, because people move intermittently. Delay and interval are of the order that
/// the tracking literature gives (visual reaction 0.2 to 0.25 s, two to four corrections a second);
/// for this participant they are assumed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VisionSpec {
    /// Delay from a movement of the arm to the correction by the wearer's muscles, s.
    pub delay_s: f64,
    /// Interval between corrections, s; above 0.
    pub every_s: f64,
    /// Angle of the line, degrees.
    pub line_deg: f64,
}

/// A forearm about its elbow, in the horizontal plane (Harris' platform carries it, so gravity has
/// no effect), flexion positive. All fields are public, so that arms can be generated randomly;
/// [`super::Elbow::new`] checks them.
#[derive(Debug, Clone, PartialEq)]
pub struct ElbowSpec {
    /// Extensor muscle; it pulls the arm out of a wall that stops flexion.
    pub triceps: ElbowMuscle,
    /// Flexor muscle.
    pub biceps: ElbowMuscle,
    /// Curvature of the recruitment curve, see [`RECRUITMENT_CURVATURE`]; not zero.
    pub recruitment_curvature: f64,
    /// Delay from a pulse to its effect on the muscle, µs.
    pub electromechanical_delay_us: u32,
    /// Moment of inertia about the elbow, kg·m².
    pub inertia_kg_m2: f64,
    /// Passive stiffness towards the rest angle, N·m/rad.
    pub stiffness_nm_per_rad: f64,
    /// Passive viscous friction of the joint, N·m·s/rad.
    pub damping_nm_s_per_rad: f64,
    /// Viscous friction per torque of each active muscle, from the slope of its force-velocity
    /// curve, s/rad.
    pub active_damping_s_per_rad: f64,
    /// Angle at which the passive torque is zero, degrees.
    pub rest_deg: f64,
    /// Inelastic stops of the joint, degrees, low to high.
    pub stops_deg: [f64; 2],
    /// Resistance of every electrode pair, Ω.
    pub load_ohm: f64,
    /// Standard deviation of the sensor's noise, white at 1 kHz, degrees.
    pub sensor_noise_deg: f64,
    /// Motor behaviour of the wearer.
    pub person: MotorBehaviour,
}

/// Error: the value of a field of an [`ElbowSpec`] is out of range. Contains the name of the field.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("elbow: `{0}` is out of range")]
pub struct InvalidElbow(pub &'static str);

impl Default for ElbowSpec {
    /// Returns an arm for Harris' experiment, triceps on channel 0, biceps on 1.
    ///
    /// From sources: inertia 0.06 kg·m² (our study of Harris); delay and muscle dynamics as those
    /// of the finger (Lee 2020, mean of table 4, because the papers at hand have no constants of an
    /// elbow); active friction 75/m · 0.03 m · 0.05 s = 0.11 s/rad (arm model of PMC2784227, table
    /// 1: stiffness per force, elbow moment arm, damping per stiffness). Assumed, order of
    /// magnitude only: passive stiffness and friction including the bearing of the platform,
    /// torques, thresholds (80 mA at 35 µs is Harris' strongest stimulation of the triceps, 40 mA
    /// at 25 µs his biceps at "25 % to 50 %" co-contraction), load, push.
    fn default() -> Self {
        let dynamics = Parameters::mean_subject_at_50_hz(); // 50 Hz is TORQUE_FREQUENCY_HZ
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
    /// Returns a wearer who waits at 60°, 30° before Harris' wall.
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
