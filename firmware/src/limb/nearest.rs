//! Nearest-neighbour recruitment: algorithm 1 of Sierotowicz & Castellini 2023.

use super::{JOINTS, Jacobians, Number, Vector, Wrench};

/// Choice of the recruitment at one joint.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub enum Choice<N> {
    /// The wrench needs no torque at this joint.
    #[default]
    None,
    /// The wrench needs a torque, and no line of this joint has a torque within 90° of its
    /// direction.
    Unhelped,
    /// Index of the chosen line in the specification, and its force, N.
    Line(u8, N),
}

/// Selects at each joint the line whose torque is closest in direction to the needed torque, with
/// the force whose torque equals the component of the needed torque along that direction.
///
/// Corrections of the printed algorithm: τ_target in line 11 has the components of all joints, but
/// τ_des, with this joint's three, must be meant; ‖r̄‖·‖d‖ is ‖d‖², since d is the torque per
/// newton and its length the moment arm. The argmax of line 10 may be negative (no muscle can
/// contribute): then no line is chosen. A line that does not cross a joint has d = 0, by which line
/// 8 divides: it is no candidate there. A line that crosses two joints is a candidate only at the
/// joint that its specification states, so no line is chosen twice.
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
        // A moment arm shorter than 1 µm is a rounding error.
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
