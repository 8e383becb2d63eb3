//! Parameters of a sagittal arm.

use super::JOINTS;
use crate::body::muscle::Parameters;

/// Number of muscles under electrodes: biceps, triceps, and the anterior and posterior parts of the
/// deltoid, the first four of [`super::ALL`].
pub const ELECTRODES: usize = 4;

/// A pair of electrodes on a muscle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Electrode {
    /// Current at which the first fibres respond, mA at the spec's width.
    pub threshold_ma: f64,
    /// Current at which all reachable fibres respond, mA at the spec's width.
    pub full_ma: f64,
    /// Share of the muscle's fibres that the electrodes can reach, 0 to 1.
    pub reached: f64,
}

/// Parameters of an arm that moves in the sagittal plane. Its lengths and masses follow from
/// stature and body mass by the tables of [`crate::body::arm`].
#[derive(Debug, Clone, PartialEq)]
pub struct SagittalSpec {
    /// Stature of the wearer, m.
    pub stature_m: f64,
    /// Mass of the whole body, kg.
    pub mass_kg: f64,
    /// Factor on the force of every muscle relative to its source.
    pub strength: f64,
    /// Fibre length of every muscle with the elbow at 90° and the upper arm raised 45°, over its
    /// optimal length.
    pub fibre_length: f64,
    /// Inertia that an exoskeleton adds to elbow and shoulder, kg m².
    pub added_inertia_kg_m2: [f64; JOINTS],
    /// Viscous friction of elbow and shoulder, N m s/rad.
    pub damping_nm_s_per_rad: [f64; JOINTS],
    /// Stiffness of elbow and shoulder about the intended angles while the wearer moves, without
    /// driven muscles, N m/rad.
    pub stiffness_nm_per_rad: [f64; JOINTS],
    /// Increase of `stiffness_nm_per_rad` per torque of driven muscles, 1/rad.
    pub stiffness_per_rad: [f64; JOINTS],
    /// Ratio of the joints' viscosity to their stiffness, s.
    pub viscosity_s: f64,
    /// Viscous friction of a joint per torque of stimulated fibres, s/rad.
    pub active_damping_s_per_rad: f64,
    /// Time constant from voluntary drive to activation, s.
    pub activation_s: f64,
    /// Pulse width to which the currents of `electrodes` refer, µs.
    pub width_us: u32,
    /// Curvature with which recruitment rises with current, as `wearer::RECRUITMENT_CURVATURE`; not
    /// zero.
    pub curvature: f64,
    /// Delay from a pulse to its effect on the muscle, µs.
    pub delay_us: u32,
    /// Calcium-force dynamics of stimulated fibres, normalised to a force of 1 at the pulse rate of
    /// the train.
    pub dynamics: Parameters,
    /// Electrodes on the first four muscles.
    pub electrodes: [Electrode; ELECTRODES],
    /// Share of fast fibres in every muscle, 0 to 1.
    pub fast_part: f64,
}

/// Error: the value of a field of a [`SagittalSpec`] is out of range. Contains the name of the
/// field.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("E766 simulated lifting arm: `{0}` is out of range")]
pub struct InvalidSagittal(pub &'static str);

impl SagittalSpec {
    /// Checks every field.
    ///
    /// # Errors
    /// Returns the name of the first field whose value is out of range.
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
