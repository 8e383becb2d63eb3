//! Turns a random arm into ten forces at the hand and the model that the device has of it.

use crate::sierotowicz2023::{EndpointError, Frame, Model, cursory};
use firmware::limb::{JointName, LimbSpec, LineSpec, Posture, ViaSpec};
use firmware::units::Amplitude;
use hal_sim::body::arm::{Arm, ArmSpec, ELECTRODES, FOREARM, Muscle, UPPER_ARM, anatomy::ALL};
use nalgebra::Vector3;

/// Muscle under each electrode: the nine of the study, and the brachioradialis.
pub const MUSCLES: [Muscle; ELECTRODES + 1] = [
    Muscle::Biceps,
    Muscle::Triceps,
    Muscle::DeltoidSuperior,
    Muscle::DeltoidAnterior,
    Muscle::DeltoidPosterior,
    Muscle::PectoralisClavicular,
    Muscle::PectoralisSternal,
    Muscle::Trapezius,
    Muscle::Latissimus,
    Muscle::Brachioradialis,
];
/// Muscle names that results show, in the order of [`MUSCLES`].
pub const NAMES: [&str; MUSCLES.len()] = {
    let mut names = [""; MUSCLES.len()];
    let mut at = 0;
    while at < MUSCLES.len() {
        names[at] = MUSCLES[at].name();
        at += 1;
    }
    names
};

/// Names of [`directions`]: f forward, b backward, l left, r right, u up, d down.
pub const DIRECTION_NAMES: [&str; 26] = [
    "f", "b", "l", "r", "u", "d", "fl", "fr", "bl", "br", "fu", "fd", "bu", "bd", "lu", "ld", "ru",
    "rd", "flu", "fld", "fru", "frd", "blu", "bld", "bru", "brd",
];

/// Returns the unit vectors to the faces, edges and corners of a cube, in the axes of the simulated
/// arm: forward, left, up.
#[must_use]
pub fn directions() -> [Vector3<f64>; 26] {
    DIRECTION_NAMES.map(|name| {
        let along = |plus: char, minus: char| {
            f64::from(u8::from(name.contains(plus))) - f64::from(u8::from(name.contains(minus)))
        };
        Vector3::new(along('f', 'b'), along('l', 'r'), along('u', 'd')).normalize()
    })
}

/// Simulated wearer with ten electrodes.
#[derive(Clone, Debug)]
pub struct Wearer {
    /// Largest force at the cuff that each electrode produces, N.
    pub forces_n: [Vector3<f64>; MUSCLES.len()],
    /// The device's model of the arm: approximate lines of action, and true strengths.
    pub limb: LimbSpec,
    /// Posture in which the arm is held.
    pub posture: Posture,
}

/// Returns the line of action of the tenth electrode's muscle by approximate anatomy: from the
/// outside above the elbow to the distal end of the forearm. Assumed, to the centimetre.
fn tenth(stature_m: f64, gain_mn_per_ma: u32, [threshold, limit]: [Amplitude; 2]) -> LineSpec {
    let [upper, fore] = [UPPER_ARM[0], FOREARM[0]].map(|part| (1e6 * part * stature_m) as i32);
    let via = |segment, at_um| ViaSpec { segment, at_um };
    let vias = [
        via(2, [-10_000, 20_000, 80_000 - upper]),
        via(3, [-20_000, 10_000, -4 * fore / 5]),
    ];
    LineSpec {
        channel: ELECTRODES as u8,
        joint: JointName::Elbow,
        vias: vias.into_iter().collect(),
        gain_mn_per_ma,
        threshold,
        limit,
    }
}

impl Wearer {
    /// Generates arm `index` of `seed` from the same random ranges as the main study.
    ///
    /// # Errors
    /// Returns E716 if the random arm is invalid.
    pub fn random(seed: u64, index: u64) -> Result<Self, EndpointError> {
        let spec = ArmSpec::random(seed, index);
        let strengths_n = spec.forces_n();
        let arm = Arm::new(spec.clone())?;
        let forces_n = MUSCLES.map(|muscle| {
            let torques = strengths_n[muscle as usize] * arm.arms_m(muscle);
            let wrench = arm.to_wrench() * torques;
            Vector3::new(wrench[0], wrench[1], wrench[2])
        });
        let ranges_ma: [[f64; 2]; ELECTRODES] =
            std::array::from_fn(|at| [spec.threshold_ma[at], spec.max_ma[at]]);
        let model = Model {
            actions: cursory(),
            gains: std::array::from_fn(|at| {
                let [least, greatest] = ranges_ma[at];
                strengths_n[ALL[at] as usize] / (greatest - least)
            }),
            ranges_ma,
            frame: Frame {
                stature_m: spec.stature_m,
                posture: spec.posture,
            },
        };
        let mut limb = model.spec();
        // Gain for a range of 1 mA, because the tenth electrode's own range does not matter here.
        let gain = (1e3 * strengths_n[Muscle::Brachioradialis as usize]).round() as u32;
        let range = [1_000, 2_000].map(Amplitude::new);
        // The list has capacity for ten lines.
        let _ = limb.lines.push(tenth(spec.stature_m, gain, range));
        Ok(Self {
            forces_n,
            limb,
            posture: model.frame.angles(),
        })
    }
}
