//! The nearest-neighbour recruitment: algorithm 1 of Sierotowicz & Castellini 2023.

use super::{JOINTS, Jacobians, Number, Vector, Wrench};

/// What the recruitment chose at a joint.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub enum Choice<N> {
    /// Nothing is wanted there.
    #[default]
    None,
    /// Something is wanted, and no line of this joint has a torque within 90° of it.
    Unhelped,
    /// This line (its place in the spec) with this force, N.
    Line(u8, N),
}

/// At each joint the line whose torque is closest in direction to the wanted, with the
/// force whose torque has the wanted's component along it.
///
/// Where the print cannot be meant: line 11's τ_target has all joints' components, and
/// τ_des, this joint's three, is meant; its ‖r̄‖·‖d‖ is ‖d‖², since d is the torque
/// per newton and its length the moment arm. The argmax of line 10 may be negative (no
/// muscle helps): then none is chosen. A line that does not cross a joint has d = 0,
/// which line 8 divides by: it is no candidate there. A line that crosses two joints is
/// one at that which its spec names, so that none is chosen twice.
#[must_use]
pub fn nearest<N: Number>(jacobians: &Jacobians<N>, wanted: &Wrench<N>) -> [Choice<N>; JOINTS] {
    let [a, b, c, d, e, f, g, h, i] = jacobians.torques(wanted);
    let wanted = [[a, b, c], [d, e, f], [g, h, i]].map(|[x, y, z]| Vector::new(x, y, z));
    let mut found = wanted.map(|torque| match torque == Vector::ZERO {
        true => Choice::None,
        false => Choice::Unhelped,
    });
    let mut best = [N::ZERO; JOINTS];
    for (n, (at, levers)) in (0u8..).zip(&jacobians.muscles) {
        let mut joints = levers
            .iter()
            .zip(&wanted)
            .zip(found.iter_mut())
            .zip(&mut best);
        let Some((((&lever, &torque), found), best)) = joints.nth((*at).into()) else {
            continue;
        };
        // Shorter than 1 µm is no lever, only the rounding of one.
        let square = lever.dot(lever);
        if square < N::ratio(1, 1_000_000) * N::ratio(1, 1_000_000) {
            continue;
        }
        let inverse = square.inverse_root();
        let along = lever.dot(torque) * inverse;
        if along > *best {
            *best = along;
            *found = Choice::Line(n, along * inverse);
        }
    }
    found
}
