//! Recruitment of the muscles of one configured arm, by three methods: `firmware::limb` as it is
//! flashed, the same in double precision, and the bounded least squares of `host_core::limb`.

use super::error::EndpointError;
use super::model::{Model, turned};
use crate::limb::{self, Arm, Recruiter, choices};
use firmware::limb::{Jacobians, Limb, Pose, Vector};
use hal_sim::body::arm::ELECTRODES;
use host_core::limb::{Exact, Forces, RecruitmentError, ToDouble, WrenchVector, amplitudes};
use nalgebra::{Matrix3, Vector3};

/// Method that distributes a reference force among muscles.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// Algorithm 1 (nearest neighbour) in single precision, as the device computes it.
    Nearest,
    /// Algorithm 1 in double precision.
    Exact,
    /// Bounded least squares with the weights `Weights::DECLARED`.
    Squares,
}

/// A device that is configured for one arm, in the posture of the arm's model.
#[derive(Clone, Debug)]
pub struct Device {
    limb: Limb,
    jacobians: Jacobians<f32>,
    arm: Arm,
    pose: Pose<Exact>,
}

impl Device {
    /// Configures a device for the arm of `model`.
    ///
    /// # Errors
    /// Returns E700 with all mistakes of the model, and E701 or E704 for its posture.
    pub fn new(model: &Model) -> Result<Self, EndpointError> {
        let (spec, posture) = (model.spec(), model.frame.angles());
        let arm = Arm::new(&spec, &posture)?;
        let limb =
            Limb::new(&spec).map_err(|error| RecruitmentError::Spec(vec![error.to_string()]))?;
        let jacobians = limb
            .jacobians_at_posture(&posture)
            .map_err(RecruitmentError::from)?;
        let radians = arm.limb.radians(&posture).map_err(RecruitmentError::from)?;
        Ok(Self {
            pose: arm.limb.skeleton().pose(&radians),
            limb,
            jacobians,
            arm,
        })
    }

    /// Returns the force of each muscle, N, for a reference force at the hand, N, in the axes of
    /// the simulated arm. The nearest neighbour may ask for more force than a muscle has.
    ///
    /// # Errors
    /// Returns E706 if a force or a weight is not finite.
    pub fn forces_n(&self, method: Method, wanted_n: [f64; 3]) -> Result<Forces, EndpointError> {
        let wanted = turned(wanted_n);
        Ok(match method {
            Method::Nearest => {
                let [x, y, z] = wanted.map(|component| component as f32);
                limb::forces_of_choices(choices(&self.jacobians, Vector::new(x, y, z)))
            }
            Method::Exact => self.arm.nearest_forces(wanted),
            Method::Squares => {
                Recruiter::new(&self.arm, limb::Method::LeastSquares)?.recruit(wanted)?
            }
        })
    }

    /// Returns the current of each channel for these forces, mA. A current is at most the channel's
    /// largest, and 0 if the muscle makes no force.
    #[must_use]
    pub fn currents_ma(&self, forces_n: &Forces) -> [f64; ELECTRODES] {
        let mut currents = [0.0; ELECTRODES];
        for (channel, amplitude) in amplitudes(&self.limb, forces_n) {
            if let Some(current) = currents.get_mut(usize::from(channel)) {
                *current = f64::from(amplitude.get()) / 1000.0;
            }
        }
        currents
    }

    /// Returns whether a muscle would need more force than its largest current makes. The device
    /// refuses such a force; the study stimulates at the largest current instead.
    #[must_use]
    pub fn is_beyond(&self, forces_n: &Forces) -> bool {
        // Tolerates a difference of half a microampere.
        let exceeds = |(force, most): (&f64, &f64)| *force > most * (1.0 + 1e-4);
        forces_n.iter().zip(&self.arm.most).any(exceeds)
    }

    /// Returns each force as a fraction of the muscle's largest force, at most 1.
    #[must_use]
    pub fn parts(&self, forces_n: &Forces) -> [f64; ELECTRODES] {
        std::array::from_fn(|muscle| (forces_n[muscle] / self.arm.most[muscle]).min(1.0))
    }

    /// Returns the largest force along `direction` that the nearest neighbour can request, N. At
    /// this force, the first of the muscles that it chooses at shoulder and elbow reaches its
    /// largest current. If only a muscle at the girdle helps, that muscle decides; if no muscle
    /// helps, returns 0.
    #[must_use]
    pub fn reachable_n(&self, direction: [f64; 3]) -> f64 {
        let [x, y, z] = turned(direction).map(Exact);
        let [girdle, shoulder, elbow] = choices(&self.arm.jacobians, Vector::new(x, y, z));
        let size = |choice: Option<(u8, f64)>| {
            let (muscle, force) = choice?;
            let most = self.arm.most.get(usize::from(muscle));
            most.map(|most| most / force)
        };
        let sizes = [shoulder, elbow].into_iter().filter_map(size);
        let reached = sizes.reduce(f64::min).or_else(|| size(girdle));
        reached.unwrap_or(0.0)
    }

    /// Returns the torque of a channel's muscle about its own joint per newton, m, in the device's
    /// axes in space; 0 for a channel without a muscle.
    #[must_use]
    pub fn arm_m(&self, channel: usize) -> Vector3<f64> {
        let line = self.arm.limb.lines().get(channel);
        let torque = line.and_then(|line| {
            let torques = line.torques(&self.pose);
            torques.get(usize::from(line.joint())).copied()
        });
        torque.map_or_else(Vector3::zeros, to_vector3)
    }

    /// Returns the torques about the nine axes, N·m, with which the hand exerts `wrench` (N and
    /// N·m, in the axes of the simulated arm; equation 8).
    #[must_use]
    pub fn torques(&self, wrench: &[f64; 6]) -> Vec<f64> {
        let [x, y, z, a, b, c] = *wrench;
        let (force, torque) = (turned([x, y, z]), turned([a, b, c]));
        let wrench = WrenchVector::from_iterator(force.into_iter().chain(torque));
        self.arm.posed.torques(&wrench).iter().copied().collect()
    }

    /// Returns the origin, m, and the orientation of the four segments, in the device's axes in
    /// space. The columns of each matrix are the axes of the segment.
    #[must_use]
    pub fn segments(&self) -> [(Vector3<f64>, Matrix3<f64>); 4] {
        self.pose.segments.map(|(origin, rotation)| {
            let axes = [rotation.x, rotation.y, rotation.z].map(to_vector3);
            (to_vector3(origin), Matrix3::from_columns(&axes))
        })
    }
}

fn to_vector3(vector: Vector<Exact>) -> Vector3<f64> {
    vector.to_array().map(ToDouble::to_double).into()
}

/// How smoothly the forces of the muscles change while the reference force goes around three great
/// circles in steps of 1°.
#[derive(Clone, Copy, Debug, PartialEq, Default, serde::Serialize, serde::Deserialize)]
pub struct Switches {
    /// Number of steps in which some muscle changed by more than the jump.
    pub jumps: usize,
    /// Largest change of a muscle in one step, as a fraction of its largest force.
    pub greatest: f64,
}

/// Computes [`Switches`] of `method` for a reference force of `size_n`. A change counts as a jump
/// if it exceeds `jump`, a fraction of a muscle's largest force.
///
/// # Errors
/// Returns E706 if a force or a weight is not finite.
pub fn switches(
    device: &Device,
    method: Method,
    size_n: f64,
    jump: f64,
) -> Result<Switches, EndpointError> {
    let mut switches = Switches::default();
    for plane in 0..3 {
        let parts = |deg: u32| {
            let wanted = force_on_circle(plane, f64::from(deg).to_radians(), size_n);
            let forces = device.forces_n(method, wanted)?;
            Ok::<_, EndpointError>(device.parts(&forces))
        };
        let mut before = parts(0)?;
        for deg in 1..=360 {
            let now = parts(deg)?;
            let change = before.iter().zip(&now).map(|(a, b)| (a - b).abs());
            let change = change.fold(0.0, f64::max);
            switches.jumps += usize::from(change > jump);
            switches.greatest = switches.greatest.max(change);
            before = now;
        }
    }
    Ok(switches)
}

/// Returns a force of `size_n` at `angle` (rad) on one of three great circles. `plane` (0 to 2) is
/// the index of the axis that points to angle 0.
#[must_use]
pub fn force_on_circle(plane: usize, angle: f64, size_n: f64) -> [f64; 3] {
    let mut wanted = [0.0; 3];
    wanted[plane % 3] = size_n * libm::cos(angle);
    wanted[(plane + 1) % 3] = size_n * libm::sin(angle);
    wanted
}
