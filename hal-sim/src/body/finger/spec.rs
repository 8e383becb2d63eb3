//! The numbers of one finger.

use crate::body::CHANNELS;
use crate::body::joint::JointSpec;
use crate::body::muscle::Parameters;
use crate::body::sensor::SensorSpec;
use crate::body::wearer::{Participant, RECRUITMENT_CURVATURE, Site};

/// Stimulation frequency at which the torques of a [`FingerSpec`] hold, Hz
/// (Hamana 2022 §II-D).
pub const TORQUE_FREQUENCY_HZ: f64 = 50.0;

/// What the two flexor points do when both are pulsed that one does not.
///
/// **Assumed by whoever makes the finger, never an outcome**: whatever two points then
/// do better, or worse, than one rests on it, and reports say so. In
/// [`super::super::hand`] it follows from the forearm instead.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pair {
    /// Torque of both points at full recruitment and 50 Hz, finger straight, N·m: as a
    /// conducted pair and as an isolated one; each at least that of one point.
    pub torque_nm: [f64; 2],
    /// Threshold of A and of B while the other one is pulsed as well, V; below its
    /// maximum.
    pub threshold_v: [f64; 2],
}

/// An index finger's PIP joint, its muscles and its angle sensor. All fields are
/// free, so that wearers can be drawn at random; [`super::Finger::new`] checks them.
///
/// The default numbers come from an earlier plant that was calibrated once to
/// Hamana 2022's table 8: agreement with that table would be no evidence for them.
#[derive(Debug, Clone, PartialEq)]
pub struct FingerSpec {
    /// Flexor point A.
    pub flexor_a: Site,
    /// Flexor point B.
    pub flexor_b: Site,
    /// Extensor point.
    pub extensor: Site,
    /// What both flexor points do together; without it they pull as the stronger one,
    /// each from its own threshold on.
    pub pair: Option<Pair>,
    /// See [`RECRUITMENT_CURVATURE`]; not zero.
    pub recruitment_curvature: f64,
    /// Dynamics of all three muscles, force normalised to 1.
    pub muscle: Parameters,
    /// Torque of one flexor point at full recruitment and 50 Hz, finger straight, N·m.
    pub flexor_torque_nm: f64,
    /// Torque of the extensor likewise, finger fully bent, N·m.
    pub extensor_torque_nm: f64,
    /// Part of its torque that a muscle loses as it shortens over the range of
    /// motion, 0 to 1.
    pub torque_loss: f64,
    /// Capacity that a muscle under lasting full activation tires to, 0 to 1;
    /// 1 for a muscle that does not tire.
    pub fatigue_floor: f64,
    /// Time constant of tiring and of recovery, s.
    pub fatigue_time_s: f64,
    /// Time from a pulse to its effect on the muscle, µs.
    pub electromechanical_delay_us: u32,
    /// Moment of inertia, kg·m².
    pub inertia_kg_m2: f64,
    /// Stiffness towards the rest angle, N·m/rad.
    pub stiffness_nm_per_rad: f64,
    /// Viscous friction, N·m·s/rad.
    pub damping_nm_s_per_rad: f64,
    /// Angle of the relaxed finger, degrees.
    pub rest_deg: f64,
    /// Inelastic stops and the sensor's measuring range, degrees, low to high.
    pub stops_deg: [f64; 2],
    /// Time constant of the angle sensor, s; zero for none.
    pub sensor_lag_s: f64,
    /// Standard deviation of the sensor's noise, white from step to step, degrees.
    pub sensor_noise_deg: f64,
    /// Step of the sensor's reading, degrees, above zero.
    pub sensor_resolution_deg: f64,
    /// Level of detail: the step of joint and sensor, µs, 100 to 10 000. Muscles
    /// are also split at every pulse.
    pub step_us: u32,
}

/// A number of a [`FingerSpec`] that no finger can have; names the field.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("finger: `{0}` is out of range")]
pub struct InvalidSpec(pub &'static str);

impl FingerSpec {
    /// The finger of a participant, with A, B and the extensor on channels 0, 1, 2;
    /// two points pull as one.
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
            muscle: Parameters::mean_subject_at_50_hz(), // TORQUE_FREQUENCY_HZ
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

    /// [`Self::step_us`] in seconds.
    pub(super) fn step_s(&self) -> f64 {
        f64::from(self.step_us) * 1e-6
    }

    /// Its joint.
    pub(super) const fn joint(&self) -> JointSpec {
        JointSpec {
            inertia_kg_m2: self.inertia_kg_m2,
            stiffness_nm_per_rad: self.stiffness_nm_per_rad,
            damping_nm_s_per_rad: self.damping_nm_s_per_rad,
            rest_deg: self.rest_deg,
            stops_deg: self.stops_deg,
        }
    }

    /// Its angle sensor.
    pub(in crate::body) const fn sensor(&self) -> SensorSpec {
        SensorSpec {
            lag_s: self.sensor_lag_s,
            noise_deg: self.sensor_noise_deg,
            resolution_deg: self.sensor_resolution_deg,
            range_deg: self.stops_deg,
        }
    }

    /// Puts A and B at these sites; thresholds of their pair move with their maxima.
    pub fn place_flexors(&mut self, sites: [Site; 2]) {
        let from = [self.flexor_a.max_v, self.flexor_b.max_v];
        [self.flexor_a, self.flexor_b] = sites;
        let thresholds = self.pair.iter_mut().flat_map(|pair| &mut pair.threshold_v);
        for ((threshold_v, from_v), site) in thresholds.zip(from).zip(sites) {
            *threshold_v = *threshold_v / from_v * site.max_v;
        }
    }

    /// The three points in the order A, B, extensor.
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
            let one = self.flexor_torque_nm;
            let torques = pair.torque_nm.iter();
            let limits = [self.flexor_a.max_v, self.flexor_b.max_v];
            one > 0.0
                && { torques }.all(|nm| nm.is_finite() && *nm >= one)
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
