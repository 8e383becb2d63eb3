//! The arm: selects the muscles and amplitudes that produce a given force at the hand.
//!
//! This module contains lines of action over nine revolute axes, three each at the
//! sternoclavicular, the glenohumeral and the elbow joint; the Jacobians of the arm and the
//! muscles; the nearest-neighbour recruitment (algorithm 1 of Sierotowicz & Castellini 2023); and
//! the conversion of a muscle's force into its amplitude. The source of the posture, calibration,
//! ramps and limits of the board (`safety`) are elsewhere.
//! Inputs are a [`LimbSpec`] once, a posture and a reference [`Wrench`]. Output is an amplitude per
//! channel, or the reason why there is none and the share of the wrench that is possible.
//!
//! The device computes in f32: additions, products, quotients and their rounding follow IEEE 754,
//! and sine and cosine are those of micromath, so the same inputs give the same bits on every
//! machine. The geometry is generic over [`Number`]; hosts test it in f64.

mod jacobian;
mod line;
mod nearest;
mod number;
mod recruitment;
mod refusal;
mod skeleton;
mod spec;
mod vector;
mod wrench;

pub use jacobian::{Axis, Jacobians};
pub use line::Line;
pub use nearest::{Choice, nearest};
pub use number::{Number, TURN_ERROR};
pub use recruitment::{Orders, RecruitmentResult};
pub use refusal::{LimbError, PostureError, ReachError};
pub use skeleton::{Pose, Skeleton};
pub use spec::{JointName, LimbSpec, LineSpec, Lines, ViaSpec};
pub use vector::{Rotation, RotationAxis, Vector};
pub use wrench::Wrench;

use crate::range::Range;
use crate::units::Angle;
use heapless::Vec;

/// Number of joints: sternoclavicular, glenohumeral and elbow.
pub const JOINTS: usize = 3;
/// Number of revolute axes, three per joint.
pub const AXES: usize = 3 * JOINTS;
/// Names of the nine axes, in the order of a posture.
pub const AXIS_NAMES: [&str; AXES] = [
    "sc_protraction",
    "sc_elevation",
    "sc_roll",
    "gh_flexion",
    "gh_abduction",
    "gh_rotation",
    "el_flexion",
    "el_bend",
    "el_pronation",
];
/// Range of a line's channel on the link.
const CHANNEL: Range = Range::new("channel", 0, 9);
/// Maximum number of lines of action, one per channel.
pub const LINES: usize = 10;
/// Maximum number of points of one line, including origin and insertion.
pub const VIAS: usize = 6;

/// The nine angles of a posture: those of the sternoclavicular joint first, and each joint's in the
/// order of its axes ([`Skeleton::ORDER`]).
pub type Posture = [Angle; AXES];

/// A validated [`LimbSpec`] for computations in numbers of type `N`.
#[derive(Clone, Debug)]
pub struct Limb<N = f32> {
    skeleton: Skeleton<N>,
    ranges: [(Angle, Angle); AXES],
    lines: Vec<Line<N>, LINES>,
    curves: Vec<recruitment::Curve<N>, LINES>,
}

impl<N: Number> Limb<N> {
    /// Validates the arm of a wearer.
    ///
    /// # Errors
    /// Returns [`LimbError`] with the first offending field, its line or axis, and its range.
    /// [`LimbSpec::report_mistakes`] reports all mistakes.
    pub fn new(spec: &LimbSpec) -> Result<Self, LimbError> {
        let mut first = None;
        spec.report_mistakes(&mut |mistake| {
            first.get_or_insert(mistake);
        });
        if let Some(mistake) = first {
            return Err(mistake);
        }
        let range = |&(low, high): &(i32, i32)| {
            let [low, high] = [low, high].map(Angle::from_millideg);
            (low, high)
        };
        let mut ranges = [<(Angle, Angle)>::default(); AXES];
        for (to, from) in ranges.iter_mut().zip(&spec.ranges_mdeg) {
            *to = range(from);
        }
        Ok(Self {
            skeleton: Skeleton::new(spec),
            ranges,
            lines: spec.lines.iter().map(Line::new).collect(),
            curves: spec.lines.iter().map(recruitment::Curve::new).collect(),
        })
    }

    /// Returns the skeleton of the arm, for its forward kinematics.
    #[must_use]
    pub const fn skeleton(&self) -> &Skeleton<N> {
        &self.skeleton
    }

    /// Returns the lines of action, in the order of the specification.
    #[must_use]
    pub fn lines(&self) -> &[Line<N>] {
        &self.lines
    }

    /// Converts a posture into radians.
    ///
    /// # Errors
    /// Returns [`PostureError`] for the first axis whose angle is outside this wearer's range.
    pub fn radians(&self, posture: &Posture) -> Result<[N; AXES], PostureError> {
        let mut radians = [N::ZERO; AXES];
        let axes = radians.iter_mut().zip(posture).zip(&self.ranges);
        for (axis, ((radians, &angle), &(low, high))) in (0u8..).zip(axes) {
            if angle < low || angle > high {
                return Err(PostureError {
                    axis,
                    mdeg: angle.to_millideg(),
                    low_mdeg: low.to_millideg(),
                    high_mdeg: high.to_millideg(),
                });
            }
            // ±180° in 2^-16 is below 2^24, exact in f32.
            let degrees = N::ratio(angle.get().to_bits(), 1 << 16);
            *radians = degrees * N::RADIANS_PER_DEGREE;
        }
        Ok(radians)
    }

    /// Computes both Jacobians in a posture.
    ///
    /// # Errors
    /// Returns [`PostureError`] for the first axis whose angle is outside this wearer's range.
    pub fn jacobians_at_posture(&self, posture: &Posture) -> Result<Jacobians<N>, PostureError> {
        Ok(self.jacobians(&self.radians(posture)?))
    }

    /// Computes both Jacobians at angles in radians, without a check of the wearer's ranges.
    #[must_use]
    pub fn jacobians(&self, radians: &[N; AXES]) -> Jacobians<N> {
        Jacobians::new(&self.skeleton.pose(radians), &self.lines)
    }

    /// Computes the amplitudes that produce a wrench at the hand, with the nearest-neighbour
    /// recruitment: at each joint it recruits the one line whose torque is closest in direction to
    /// the needed torque. Channels that are not in the result are not stimulated.
    ///
    /// # Errors
    /// Returns [`ReachError`] if no muscle can contribute at any joint, or if only a share of the
    /// wrench is possible.
    pub fn recruit(
        &self,
        jacobians: &Jacobians<N>,
        wanted: &Wrench<N>,
    ) -> Result<RecruitmentResult<N>, ReachError<N>> {
        let choice = nearest(jacobians, wanted);
        recruitment::recruit(&self.curves, &choice)
    }

    /// Returns the largest force of each line, N, at the wearer's limit, in the order of the
    /// specification.
    pub fn max_forces(&self) -> impl Iterator<Item = N> {
        self.curves.iter().map(recruitment::Curve::max_force)
    }

    /// Returns the amplitudes with which the lines produce `forces` (N, in the order of the
    /// specification), for callers that choose the forces in another way than [`Self::recruit`].
    /// Lines with a force of zero or less are left out; a force above a line's largest gives the
    /// line's limit.
    #[must_use]
    pub fn orders(&self, forces: &[N]) -> Orders {
        recruitment::orders(&self.curves, forces)
    }
}
