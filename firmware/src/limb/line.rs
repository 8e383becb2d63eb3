//! A line of action: a string from origin to insertion, along which the force of a muscle acts.

use super::{LineSpec, Number, Pose, VIAS, Vector};
use heapless::Vec;

/// A validated line of action.
#[derive(Clone, Debug)]
pub struct Line<N> {
    /// Segment and position in it, m, of each point, origin first.
    vias: Vec<(u8, Vector<N>), VIAS>,
    /// Joint at which the nearest-neighbour recruitment considers the line, 0…2.
    joint: u8,
}

impl<N: Number> Line<N> {
    pub(super) fn new(spec: &LineSpec) -> Self {
        let via = |via: &super::ViaSpec| (via.segment, Vector::from_um(via.at_um));
        Self {
            vias: spec.vias.iter().map(via).collect(),
            joint: spec.joint.index(),
        }
    }

    /// Returns the joint at which the nearest-neighbour recruitment considers the line: 0 SC, 1 GH,
    /// 2 EL.
    #[must_use]
    pub const fn joint(&self) -> u8 {
        self.joint
    }

    /// Returns the points of the line in a pose, in the thorax frame, m, with their segments.
    pub fn points<'a>(&'a self, pose: &'a Pose<N>) -> impl Iterator<Item = (u8, Vector<N>)> + 'a {
        self.vias.iter().map(|&(segment, at)| {
            let (origin, rotation) = match (segment, pose.segments) {
                (0, [thorax, ..]) => thorax,
                (1, [_, girdle, ..]) => girdle,
                (2, [_, _, upper_arm, _]) => upper_arm,
                (_, [.., forearm]) => forearm,
            };
            (segment, origin.plus(rotation.apply(at)))
        })
    }

    /// Computes the torque about each joint per newton of the muscle's force, m, in the thorax
    /// frame: SC, GH, EL; zero at a joint that the line does not cross.
    ///
    /// Only the stretch of the string that crosses a joint turns that joint: it pulls its far end q
    /// towards its near end along u, and the torque about the joint j is (q − j) × u. That is
    /// −∂l/∂θ of the string's length about every axis through j. Equation (3) has (a_i − j) × (a_i
    /// − a_{i−1}), which is +∂l/∂θ, and averages over all stretches, including those within one
    /// segment.
    #[must_use]
    pub fn torques(&self, pose: &Pose<N>) -> [Vector<N>; 3] {
        let mut torques = [Vector::ZERO; 3];
        let [_, (sc, _), (gh, _), (el, _)] = pose.segments;
        let mut near: Option<(u8, Vector<N>)> = None;
        for (segment, q) in self.points(pose) {
            if let Some((before, p)) = near
                && before < segment
            {
                let u = p.minus(q).direction();
                for ((torque, j), joint) in torques.iter_mut().zip([sc, gh, el]).zip(0u8..) {
                    if before <= joint && joint < segment {
                        *torque = q.minus(j).cross(u);
                    }
                }
            }
            near = Some((segment, q));
        }
        torques
    }

    /// Computes the length of the line in a pose, m, with the square root of the number type.
    #[must_use]
    pub fn length(&self, pose: &Pose<N>) -> N {
        let mut length = N::ZERO;
        let mut near: Option<Vector<N>> = None;
        for (_, q) in self.points(pose) {
            if let Some(p) = near {
                let way = q.minus(p);
                let square = way.dot(way);
                length = length + square * square.inverse_root();
            }
            near = Some(q);
        }
        length
    }
}
