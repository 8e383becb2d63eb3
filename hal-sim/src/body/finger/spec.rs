//! Parameters of a finger.

use crate::body::CHANNELS;
use crate::body::joint::JointSpec;
use crate::body::muscle::Parameters;
use crate::body::sensor::SensorSpec;
use crate::body::wearer::{Participant, RECRUITMENT_CURVATURE, Site};

/// Pulse rate to which the torques of a [`FingerSpec`] refer, Hz (Hamana 2022 §II-D).
pub const TORQUE_FREQUENCY_HZ: f64 = 50.0;

/// Effect of two flexor points that are pulsed together, beyond that of one.
///
/// **Assumed in the specification of the finger, never a result**: any advantage or disadvantage of
/// two points over one follows from this assumption, and reports say so. In [`super::super::hand`]
/// the effect follows from a model of the forearm instead.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pair {
    /// Torque of both points at full recruitment and 50 Hz, finger straight, N·m: as a conducted
    /// pair and as an isolated one; each at least that of one point.
    pub torque_nm: [f64; 2],
    /// Threshold of A and of B while the other point is pulsed as well, V; below the point's
    /// `max_v`.
    pub threshold_v: [f64; 2],
}

/// The PIP joint of an index finger with its muscles and its angle sensor. All fields are public,
/// so that wearers can be generated randomly; [`super::Finger::new`] checks them.
///
/// The default values come from an earlier plant that was calibrated once to Hamana 2022's table 8:
/// agreement with that table would be no evidence for them.
#[derive(Debug, Clone, PartialEq)]
pub struct FingerSpec {
    /// Thresholds and channel of flexor point A.
    pub flexor_a: Site,
    /// Thresholds and channel of flexor point B.
    pub flexor_b: Site,
    /// Thresholds and channel of the extensor point.
    pub extensor: Site,
    /// Combined effect of both flexor points. With `None`, two points together pull as strongly as
    /// the stronger of them, and each pulls from its own threshold on.
    pub pair: Option<Pair>,
    /// Curvature of the recruitment curve, see [`RECRUITMENT_CURVATURE`]; not zero.
    pub recruitment_curvature: f64,
    /// Calcium-force dynamics of all three muscles, normalised to a force of 1.
    pub muscle: Parameters,
    /// Torque of one flexor point at full recruitment and 50 Hz, finger straight, N·m.
    pub flexor_torque_nm: f64,
    /// Torque of the extensor at full recruitment and 50 Hz, finger fully bent, N·m.
    pub extensor_torque_nm: f64,
    /// Share of its torque that a muscle loses by shortening over the range of motion, 0 to 1.
    pub torque_loss: f64,
    /// Share of the force that remains under sustained full activation, 0 to 1; 1 for a muscle
    /// without fatigue.
    pub fatigue_floor: f64,
    /// Time constant of fatigue and of recovery, s.
    pub fatigue_time_s: f64,
    /// Delay from a pulse to its effect on the muscle, µs.
    pub electromechanical_delay_us: u32,
    /// Moment of inertia of the finger about the joint, kg·m².
    pub inertia_kg_m2: f64,
    /// Stiffness towards the rest angle, N·m/rad.
    pub stiffness_nm_per_rad: f64,
    /// Viscous friction of the joint, N·m·s/rad.
    pub damping_nm_s_per_rad: f64,
    /// Angle of the relaxed finger, degrees.
    pub rest_deg: f64,
    /// Inelastic stops of the joint, and the measuring range of the sensor, degrees, low to high.
    pub stops_deg: [f64; 2],
    /// Time constant of the angle sensor, s; 0 for a sensor without lag.
    pub sensor_lag_s: f64,
    /// Standard deviation of the sensor's noise, white from step to step, degrees.
    pub sensor_noise_deg: f64,
    /// Resolution of the sensor's reading, degrees, above zero.
    pub sensor_resolution_deg: f64,
    /// Time step of joint and sensor, µs, 100 to 10 000. Muscles are also split at every pulse.
    pub step_us: u32,
}

/// Error: the value of a field of a [`FingerSpec`] is out of range. Contains the name of the field.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("finger: `{0}` is out of range")]
pub struct InvalidSpec(pub &'static str);

impl FingerSpec {
    /// Returns the finger of a participant, with A, B and the extensor on channels 0, 1, 2. It has
    /// no [`Pair`]: two points pull as strongly as one.
    pub fn participant(participant: Participant) -> Self {
        let voltages = participant.voltages();
        let site = |channel: usize| Site {
            channel,
            threshold_v: voltages[channel].0,
            max_v: voltages[channel].1,
        };
        Self {
            flexor_a: site(0),
            flexor_b: site(1),
            extensor: site(2),
            pair: None,
            recruitment_curvature: RECRUITMENT_CURVATURE,
            muscle: Parameters::mean_subject_at_50_hz(), // 50 Hz is TORQUE_FREQUENCY_HZ
            flexor_torque_nm: 0.22,
            extensor_torque_nm: 0.15,
            torque_loss: 0.25,
            fatigue_floor: 1.0,
            fatigue_time_s: 60.0,
            electromechanical_delay_us: 25_000,
            inertia_kg_m2: 4e-5,
            stiffness_nm_per_rad: 0.12,
            damping_nm_s_per_rad: 0.018,
            rest_deg: 5.0,
            stops_deg: [0.0, 100.0],
            sensor_lag_s: 0.010,
            sensor_noise_deg: 0.3,
            sensor_resolution_deg: 0.1,
            step_us: 1000,
        }
    }

    /// Returns the time step [`Self::step_us`], converted to seconds.
    pub(super) fn step_s(&self) -> f64 {
        f64::from(self.step_us) * 1e-6
    }

    pub(super) const fn joint(&self) -> JointSpec {
        JointSpec {
            inertia_kg_m2: self.inertia_kg_m2,
            stiffness_nm_per_rad: self.stiffness_nm_per_rad,
            damping_nm_s_per_rad: self.damping_nm_s_per_rad,
            rest_deg: self.rest_deg,
            stops_deg: self.stops_deg,
        }
    }

    pub(in crate::body) const fn sensor(&self) -> SensorSpec {
        SensorSpec {
            lag_s: self.sensor_lag_s,
            noise_deg: self.sensor_noise_deg,
            resolution_deg: self.sensor_resolution_deg,
            range_deg: self.stops_deg,
        }
    }

    /// Moves flexor points A and B to these sites. The thresholds of their [`Pair`] keep their
    /// ratios to `max_v` of the points.
    pub fn place_flexors(&mut self, sites: [Site; 2]) {
        let from = [self.flexor_a.max_v, self.flexor_b.max_v];
        [self.flexor_a, self.flexor_b] = sites;
        let thresholds = self.pair.iter_mut().flat_map(|pair| &mut pair.threshold_v);
        for ((threshold_v, from_v), site) in thresholds.zip(from).zip(sites) {
            *threshold_v = *threshold_v / from_v * site.max_v;
        }
    }

    /// Returns the three points in the order A, B, extensor.
    pub fn sites(&self) -> [Site; 3] {
        [self.flexor_a, self.flexor_b, self.extensor]
    }

    pub(in crate::body) fn validate(&self) -> Result<(), InvalidSpec> {
        let positive = |v: f64| v.is_finite() && v > 0.0;
        let not_negative = |v: f64| v.is_finite() && v >= 0.0;
        let part = |v: f64| (0.0..=1.0).contains(&v);
        let sites_hold = self.sites().iter().all(|s| {
            s.channel < CHANNELS && not_negative(s.threshold_v) && s.max_v > s.threshold_v
        });
        let [low, high] = self.stops_deg;
        let pair_holds = self.pair.is_none_or(|pair| {
            let single_nm = self.flexor_torque_nm;
            let torques = pair.torque_nm.iter();
            let limits = [self.flexor_a.max_v, self.flexor_b.max_v];
            single_nm > 0.0
                && { torques }.all(|nm| nm.is_finite() && *nm >= single_nm)
                && (pair.threshold_v.iter().zip(limits))
                    .all(|(threshold_v, max_v)| (0.0..max_v).contains(threshold_v))
        });
        #[rustfmt::skip]
        let rules = [
            ("flexor_a, flexor_b, extensor", sites_hold),
            ("pair", pair_holds),
            ("recruitment_curvature", self.recruitment_curvature != 0.0),
            ("muscle", self.muscle.all().into_iter().all(positive)),
            ("flexor_torque_nm", not_negative(self.flexor_torque_nm)),
            ("extensor_torque_nm", not_negative(self.extensor_torque_nm)),
            ("torque_loss", part(self.torque_loss)),
            ("fatigue_floor", part(self.fatigue_floor)),
            ("fatigue_time_s", positive(self.fatigue_time_s)),
            ("inertia_kg_m2", positive(self.inertia_kg_m2)),
            ("stiffness_nm_per_rad", positive(self.stiffness_nm_per_rad)),
            ("damping_nm_s_per_rad", not_negative(self.damping_nm_s_per_rad)),
            ("rest_deg, stops_deg", low < high && (low..=high).contains(&self.rest_deg)),
            ("sensor_lag_s", not_negative(self.sensor_lag_s)),
            ("sensor_noise_deg", not_negative(self.sensor_noise_deg)),
            ("sensor_resolution_deg", positive(self.sensor_resolution_deg)),
            ("step_us", (100..=10_000).contains(&self.step_us)),
        ];
        match rules.iter().find(|(_, holds)| !holds) {
            Some((field, _)) => Err(InvalidSpec(field)),
            None => Ok(()),
        }
    }
}
