//! The numbers of one such arm.

use super::JOINTS;
use crate::body::muscle::Parameters;

/// Muscles under electrodes: biceps, triceps, deltoid's anterior and posterior part, the
/// first of [`super::ALL`].
pub const ELECTRODES: usize = 4;

/// A pair of electrodes on a muscle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Electrode {
    /// Current at which the first fibres answer, mA at the spec's width.
    pub threshold_ma: f64,
    /// Current at which all that it reaches answer, mA.
    pub full_ma: f64,
    /// Part of the muscle's fibres that it reaches at all.
    pub reached: f64,
}

/// An arm that moves in the sagittal plane. Its length and mass are of stature and mass by
/// the tables of [`crate::body::arm`].
#[derive(Debug, Clone, PartialEq)]
pub struct SagittalSpec {
    /// Stature, m.
    pub stature_m: f64,
    /// Mass of the whole body, kg.
    pub mass_kg: f64,
    /// Force of every muscle against its sources'.
    pub strength: f64,
    /// Fibre length of every muscle with the elbow at 90° and the upper arm raised 45°,
    /// against its best.
    pub fibre_length: f64,
    /// What an exoskeleton adds to elbow and shoulder, kg m².
    pub added_inertia_kg_m2: [f64; JOINTS],
    /// Viscous friction of elbow and shoulder, N m s/rad.
    pub damping_nm_s_per_rad: [f64; JOINTS],
    /// Stiffness of elbow and shoulder of a person who moves, N m/rad, and what the torque of
    /// driven muscles adds to it, 1/rad: about where the joint is meant to be.
    pub stiffness_nm_per_rad: [f64; JOINTS],
    /// See there.
    pub stiffness_per_rad: [f64; JOINTS],
    /// Viscosity over that stiffness, s.
    pub viscosity_s: f64,
    /// Friction of a joint per torque of stimulated fibres, s/rad.
    pub active_damping_s_per_rad: f64,
    /// From a drive to activation, s.
    pub activation_s: f64,
    /// Pulse width at which currents hold, µs.
    pub width_us: u32,
    /// How strongly recruitment curves upwards with current, as
    /// `wearer::RECRUITMENT_CURVATURE`; not zero.
    pub curvature: f64,
    /// From a pulse to its effect on the muscle, µs.
    pub delay_us: u32,
    /// Dynamics of stimulated fibres, force 1 at the train's frequency.
    pub dynamics: Parameters,
    /// What lies on the first four muscles.
    pub electrodes: [Electrode; ELECTRODES],
    /// Part of every muscle that is of fast fibres.
    pub fast_part: f64,
}

/// A number that no arm can have.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("E766 an arm that lifts: `{0}` is out of range")]
pub struct InvalidSagittal(pub &'static str);

impl SagittalSpec {
    /// # Errors
    /// The first field that no arm can have.
    pub fn validate(&self) -> Result<(), InvalidSagittal> {
        let positive = |value: f64| value.is_finite() && value > 0.0;
        let not_negative = |value: f64| value.is_finite() && value >= 0.0;
        let part = |value: f64| (0.0..=1.0).contains(&value);
        let on = |electrode: &Electrode| {
            electrode.threshold_ma >= 0.0
                && electrode.full_ma > electrode.threshold_ma
                && part(electrode.reached)
        };
        #[rustfmt::skip]
        let rules = [
            ("stature_m", positive(self.stature_m)),
            ("mass_kg", positive(self.mass_kg)),
            ("strength", positive(self.strength)),
            ("fibre_length", (0.5..=1.5).contains(&self.fibre_length)),
            ("added_inertia_kg_m2", self.added_inertia_kg_m2.into_iter().all(not_negative)),
            ("damping_nm_s_per_rad", self.damping_nm_s_per_rad.into_iter().all(not_negative)),
            ("stiffness_nm_per_rad", self.stiffness_nm_per_rad.into_iter().all(not_negative)),
            ("stiffness_per_rad", self.stiffness_per_rad.into_iter().all(not_negative)),
            ("viscosity_s", not_negative(self.viscosity_s)),
            ("active_damping_s_per_rad", not_negative(self.active_damping_s_per_rad)),
            ("activation_s", self.activation_s.is_finite() && self.activation_s >= 2e-3),
            ("width_us", self.width_us > 0),
            ("curvature", self.curvature.is_finite() && self.curvature != 0.0),
            ("dynamics", self.dynamics.all().into_iter().all(positive)),
            ("electrodes", self.electrodes.iter().all(on)),
            ("fast_part", part(self.fast_part)),
        ];
        match rules.iter().find(|(_, holds)| !holds) {
            Some((field, _)) => Err(InvalidSagittal(field)),
            None => Ok(()),
        }
    }
}
