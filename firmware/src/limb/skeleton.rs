//! Forward kinematics: positions of the joints and the hand, and directions of the axes.

use super::{AXES, JOINTS, LimbSpec, Number, Rotation, RotationAxis, Vector};

/// Four segments in a chain: thorax, shoulder girdle, upper arm, forearm with hand.
///
/// With all angles zero the arm hangs straight down, and the axes of all segments are those of the
/// thorax: x backward, y to the right, z upward. About them a right arm's flexion, abduction and
/// internal rotation are positive. Lengths are in m.
#[derive(Clone, Copy, Debug)]
pub struct Skeleton<N> {
    /// Vectors from a segment's origin to the next joint, along the chain: origin of the thorax to
    /// SC, SC to GH, GH to EL, EL to hand.
    ways: [Vector<N>; JOINTS + 1],
}

/// The chain in one posture, in the thorax frame.
#[derive(Clone, Copy, Debug)]
pub struct Pose<N> {
    /// Origin of each segment (its upper joint), m, and its rotation.
    pub segments: [(Vector<N>, Rotation<N>); JOINTS + 1],
    /// Directions of the nine axes, in the order of the angles of a posture.
    pub axes: [Vector<N>; AXES],
    /// Position of the hand in the thorax frame, m.
    pub hand: Vector<N>,
}

impl<N: Number> Skeleton<N> {
    /// Axes of the segment about which each joint rotates, in order. The middle rotation stays
    /// clear of ±90°, where the first and the last axis would coincide: SC protracts (z), elevates
    /// (x) and rolls (y); GH flexes (y), abducts (x) and rotates (z); EL flexes (y), bends sideways
    /// (x) and pronates (z).
    pub const ORDER: [[RotationAxis; 3]; JOINTS] = [
        [RotationAxis::Z, RotationAxis::X, RotationAxis::Y],
        [RotationAxis::Y, RotationAxis::X, RotationAxis::Z],
        [RotationAxis::Y, RotationAxis::X, RotationAxis::Z],
    ];

    pub(super) fn new(spec: &LimbSpec) -> Self {
        Self {
            ways: spec.offsets_um.map(Vector::from_um),
        }
    }

    /// Returns the vectors from each segment's origin to the next joint or to the hand, m, thorax
    /// first.
    #[must_use]
    pub const fn segment_vectors(&self) -> &[Vector<N>; JOINTS + 1] {
        &self.ways
    }

    /// Computes the pose of the chain at nine angles in radians.
    #[must_use]
    pub fn pose(&self, radians: &[N; AXES]) -> Pose<N> {
        let [thorax, girdle, upper_arm, forearm] = self.ways;
        let &[s0, s1, s2, g0, g1, g2, e0, e1, e2] = radians;
        let [sc, gh, el] = Self::ORDER;
        let trunk = (Vector::ZERO, Rotation::NONE);
        let (first, [a0, a1, a2]) = next_segment(trunk, thorax, sc, [s0, s1, s2]);
        let (second, [a3, a4, a5]) = next_segment(first, girdle, gh, [g0, g1, g2]);
        let (third, [a6, a7, a8]) = next_segment(second, upper_arm, el, [e0, e1, e2]);
        Pose {
            segments: [trunk, first, second, third],
            axes: [a0, a1, a2, a3, a4, a5, a6, a7, a8],
            hand: third.0.plus(third.1.apply(forearm)),
        }
    }
}

type Segment<N> = (Vector<N>, Rotation<N>);

/// Returns the next segment of the chain, and the three axes between the segments.
fn next_segment<N: Number>(
    (origin, rotation): Segment<N>,
    way: Vector<N>,
    [a, b, c]: [RotationAxis; 3],
    [first, second, third]: [N; 3],
) -> (Segment<N>, [Vector<N>; 3]) {
    let joint = origin.plus(rotation.apply(way));
    let once = rotation.rotated(a, first);
    let twice = once.rotated(b, second);
    let axes = [rotation.axis(a), once.axis(b), twice.axis(c)];
    ((joint, twice.rotated(c, third)), axes)
}
