//! Transposed Jacobians of the arm and of its muscles, which convert a wrench and muscle forces
//! into joint torques.

use super::{AXES, LINES, Line, Number, Pose, Vector, Wrench};
use heapless::Vec;

/// A column of the arm's Jacobian (Sierotowicz 2023, (8)): the motion of the hand per rotation
/// about one axis, and so the torque about that axis that a wrench at the hand needs.
#[derive(Clone, Copy, Debug, Default)]
pub struct Axis<N> {
    /// Linear part e × (hand − joint), m.
    pub linear: Vector<N>,
    /// Direction e of the axis.
    pub angular: Vector<N>,
}

/// Jacobians of the arm and of the muscles in one posture.
#[derive(Clone, Debug, Default)]
pub struct Jacobians<N> {
    /// Jacobian of the arm, one column per axis.
    pub(super) arm: [Axis<N>; AXES],
    /// Torque of each line per newton about the three axes of each joint, m, and the joint at which
    /// the nearest-neighbour recruitment considers the line.
    pub(super) muscles: Vec<(u8, [Vector<N>; 3]), LINES>,
}

impl<N: Number> Jacobians<N> {
    pub(super) fn new(pose: &Pose<N>, lines: &[Line<N>]) -> Self {
        let [_, (sc, _), (gh, _), (el, _)] = pose.segments;
        let joints = [sc, sc, sc, gh, gh, gh, el, el, el];
        let mut arm = [Axis::default(); AXES];
        for ((axis, &angular), joint) in arm.iter_mut().zip(&pose.axes).zip(joints) {
            let linear = angular.cross(pose.hand.minus(joint));
            *axis = Axis { linear, angular };
        }
        let [s0, s1, s2, g0, g1, g2, e0, e1, e2] = pose.axes;
        let about = |torque: Vector<N>, [a, b, c]: [Vector<N>; 3]| {
            Vector::new(torque.dot(a), torque.dot(b), torque.dot(c))
        };
        let muscle = |line: &Line<N>| {
            let [sc, gh, el] = line.torques(pose);
            let levers = [
                about(sc, [s0, s1, s2]),
                about(gh, [g0, g1, g2]),
                about(el, [e0, e1, e2]),
            ];
            (line.joint(), levers)
        };
        let muscles = lines.iter().map(muscle).collect();
        Self { arm, muscles }
    }

    /// Returns the Jacobian of the arm, one column per axis.
    #[must_use]
    pub const fn arm(&self) -> &[Axis<N>; AXES] {
        &self.arm
    }

    /// Returns J_mus, one row per line in the order of the specification: the line's torque about
    /// each axis per newton, which is −∂l/∂θ, m/rad.
    pub fn muscles(&self) -> impl Iterator<Item = [N; AXES]> {
        self.muscles.iter().map(|(_, [sc, gh, el])| {
            let [a, b, c] = sc.to_array();
            let [d, e, f] = gh.to_array();
            let [g, h, i] = el.to_array();
            [a, b, c, d, e, f, g, h, i]
        })
    }

    /// Computes the torques about the nine axes that a wrench of the hand needs, N·m: J_armᵀ·w.
    #[must_use]
    pub fn torques(&self, wrench: &Wrench<N>) -> [N; AXES] {
        self.arm
            .map(|Axis { linear, angular }| linear.dot(wrench.force) + angular.dot(wrench.torque))
    }
}
