//! The device at work on an arm that it was told of: `firmware::limb` as it is flashed, the
//! same in double precision, and the bounded least squares of `host_core::limb`.

use super::error::EndpointError;
use super::model::{Model, turned};
use crate::limb::{self, Arm, Recruiter, choices};
use firmware::limb::{Jacobians, Limb, Pose, Vector};
use hal_sim::body::arm::ELECTRODES;
use host_core::limb::{Exact, Forces, ToDouble, Trouble, WrenchVector, amplitudes};
use nalgebra::{Matrix3, Vector3};

/// A way to share a wanted force out among muscles.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// Algorithm 1 in the device's own numbers.
    Nearest,
    /// The same in double precision.
    Exact,
    /// Least squares with bounds, as `Weights::DECLARED` weighs.
    Squares,
}

/// A device that was told of an arm, at its posture.
#[derive(Clone, Debug)]
pub struct Device {
    limb: Limb,
    jacobians: Jacobians<f32>,
    arm: Arm,
    pose: Pose<Exact>,
}

impl Device {
    /// # Errors
    /// E700, E701, E704: the model, all its mistakes; its posture.
    pub fn new(model: &Model) -> Result<Self, EndpointError> {
        let (spec, posture) = (model.spec(), model.frame.angles());
        let arm = Arm::new(&spec, &posture)?;
        let limb =
            Limb::new(&spec).map_err(|limb_error| Trouble::Spec(vec![limb_error.to_string()]))?;
        let jacobians = limb.refresh(&posture).map_err(Trouble::from)?;
        let radians = arm.limb.radians(&posture).map_err(Trouble::from)?;
        Ok(Self {
            pose: arm.limb.skeleton().pose(&radians),
            limb,
            jacobians,
            arm,
        })
    }

    /// Force of each muscle for a wanted force at the hand (the body's axes), N, beyond
    /// what it has where the nearest neighbour asks for more.
    ///
    /// # Errors
    /// E706.
    pub fn forces_n(&self, method: Method, wanted_n: [f64; 3]) -> Result<Forces, EndpointError> {
        let wanted = turned(wanted_n);
        Ok(match method {
            Method::Nearest => {
                let [x, y, z] = wanted.map(|value| value as f32);
                limb::chosen(choices(&self.jacobians, Vector::new(x, y, z)))
            }
            Method::Exact => self.arm.nearest(wanted),
            Method::Squares => {
                Recruiter::new(&self.arm, limb::Method::LeastSquares)?.recruit(wanted)?
            }
        })
    }

    /// The currents for these forces, mA, each at most its greatest; none of no force.
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

    /// Whether a muscle would have to be stronger than its greatest current makes it: what
    /// the device refuses, and the study plays at the greatest current.
    #[must_use]
    pub fn is_beyond(&self, forces_n: &Forces) -> bool {
        // Half a microampere is no more.
        let more = |(force, most): (&f64, &f64)| *force > most * (1.0 + 1e-4);
        forces_n.iter().zip(&self.arm.most).any(more)
    }

    /// Each force as a part of what its muscle has, at most 1.
    #[must_use]
    pub fn parts(&self, forces_n: &Forces) -> [f64; ELECTRODES] {
        std::array::from_fn(|at| (forces_n[at] / self.arm.most[at]).min(1.0))
    }

    /// The size of a force along `direction` at which the first muscle at shoulder or elbow
    /// that the nearest neighbour takes is at its greatest current; of a direction that only
    /// the girdle helps, there; zero where nothing helps.
    #[must_use]
    pub fn reachable_n(&self, direction: [f64; 3]) -> f64 {
        let [x, y, z] = turned(direction).map(Exact);
        let [girdle, shoulder, elbow] = choices(&self.arm.jacobians, Vector::new(x, y, z));
        let size = |choice: Option<(u8, f64)>| {
            let (at, force) = choice?;
            self.arm.most.get(usize::from(at)).map(|most| most / force)
        };
        let arm = [shoulder, elbow].into_iter().filter_map(size);
        let arm = arm.reduce(f64::min).or_else(|| size(girdle));
        arm.unwrap_or(0.0)
    }

    /// Torque of one newton of a channel's muscle about its own joint, m, the device's axes
    /// in space.
    #[must_use]
    pub fn arm_m(&self, channel: usize) -> Vector3<f64> {
        let line = self.arm.limb.lines().get(channel);
        let torque = line.and_then(|line| {
            let torques = line.torques(&self.pose);
            torques.get(usize::from(line.joint())).copied()
        });
        torque.map_or_else(Vector3::zeros, vector)
    }

    /// The torques about the nine axes with which the hand exerts `wrench` (the body's axes,
    /// N and N m), N m (equation 8).
    #[must_use]
    pub fn torques(&self, wrench: &[f64; 6]) -> Vec<f64> {
        let [x, y, z, a, b, c] = *wrench;
        let (force, torque) = (turned([x, y, z]), turned([a, b, c]));
        let both = WrenchVector::from_iterator(force.into_iter().chain(torque));
        self.arm.posed.torques(&both).iter().copied().collect()
    }

    /// Origins of the four segments and how they are turned (columns are their axes), the
    /// device's axes in space, m.
    #[must_use]
    pub fn segments(&self) -> [(Vector3<f64>, Matrix3<f64>); 4] {
        self.pose.segments.map(|(origin, rotation)| {
            let axes = [rotation.x, rotation.y, rotation.z].map(vector);
            (vector(origin), Matrix3::from_columns(&axes))
        })
    }
}

fn vector(item: Vector<Exact>) -> Vector3<f64> {
    item.to_array().map(ToDouble::to_double).into()
}

/// How smoothly muscles follow as the wanted direction goes around three great circles in
/// steps of a degree.
#[derive(Clone, Copy, Debug, PartialEq, Default, serde::Serialize, serde::Deserialize)]
pub struct Switches {
    /// Steps in which some muscle changed by more than the jump.
    pub jumps: usize,
    /// Greatest change of a muscle in one step, as a part of what it has.
    pub greatest: f64,
}

/// The same of `method`, with a force of `size_n`; a jump is `jump` of a range.
///
/// # Errors
/// E706.
pub fn switches(
    device: &Device,
    method: Method,
    size_n: f64,
    jump: f64,
) -> Result<Switches, EndpointError> {
    let mut all = Switches::default();
    for plane in 0..3 {
        let parts = |deg: u32| {
            let wanted = around(plane, f64::from(deg).to_radians(), size_n);
            let forces = device.forces_n(method, wanted)?;
            Ok::<_, EndpointError>(device.parts(&forces))
        };
        let mut before = parts(0)?;
        for deg in 1..=360 {
            let now = parts(deg)?;
            let change = before.iter().zip(&now).map(|(a, b)| (a - b).abs());
            let change = change.fold(0.0, f64::max);
            all.jumps += usize::from(change > jump);
            all.greatest = all.greatest.max(change);
            before = now;
        }
    }
    Ok(all)
}

/// A force of `size_n` at `angle` (rad) of one of three great circles.
#[must_use]
pub fn around(plane: usize, angle: f64, size_n: f64) -> [f64; 3] {
    let mut wanted = [0.0; 3];
    wanted[plane % 3] = size_n * angle.cos();
    wanted[(plane + 1) % 3] = size_n * angle.sin();
    wanted
}
