//! The arm: which muscles give a wanted force at the hand.
//!
//! Lives here: lines of action over nine revolute axes, three each at the
//! sternoclavicular, the glenohumeral and the elbow joint; the arm's and the muscles'
//! Jacobians; the nearest-neighbour recruitment (algorithm 1 of Sierotowicz &
//! Castellini 2023); from a muscle's force to its amplitude. Not here: where a posture
//! comes from, calibration, ramps and limits of the board (`safety` has the last word).
//! In: a [`LimbSpec`] once, a posture, a wanted [`Wrench`]. Out: an amplitude per
//! channel, or why there is none and what can be made.
//! In f32 on the device: additions, products, quotients and their rounding are IEEE
//! 754's, sine and cosine micromath's, so the same inputs give the same bits on every
//! machine. The geometry is written once for any [`Number`]; hosts try it in f64.

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

/// Joints: sternoclavicular, glenohumeral, elbow.
pub const JOINTS: usize = 3;
/// Revolute axes, three a joint.
pub const AXES: usize = 3 * JOINTS;
/// The nine axes by name, in the order of a posture.
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
/// Of a line's channel on the link.
const CHANNEL: Range = Range::new("channel", 0, 9);
/// Most lines of action: one a channel.
pub const LINES: usize = 10;
/// Most points of one line, origin and insertion included.
pub const VIAS: usize = 6;

/// The nine angles of a posture: those of the sternoclavicular joint first, each
/// joint's in the order of its axes ([`Skeleton::ORDER`]).
pub type Posture = [Angle; AXES];

/// A validated [`LimbSpec`], ready to compute in numbers of kind `N`.
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
    /// [`LimbError`] names the first offending field, its line or axis, and what it
    /// allows; [`LimbSpec::mistakes`] tells of all.
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

    /// The bones.
    #[must_use]
    pub const fn skeleton(&self) -> &Skeleton<N> {
        &self.skeleton
    }

    /// The lines of action, in the spec's order.
    #[must_use]
    pub fn lines(&self) -> &[Line<N>] {
        &self.lines
    }

    /// A posture in radians.
    ///
    /// # Errors
    /// The first axis whose angle is outside this wearer's range.
    pub fn radians(&self, posture: &Posture) -> Result<[N; AXES], PostureError> {
        let mut radians = [N::ZERO; AXES];
        let all = radians.iter_mut().zip(posture).zip(&self.ranges);
        for (axis, ((radians, &angle), &(low, high))) in (0u8..).zip(all) {
            if angle < low || angle > high {
                return Err(PostureError {
                    axis,
                    mdeg: angle.to_millideg(),
                    low_mdeg: low.to_millideg(),
                    high_mdeg: high.to_millideg(),
                });
            }
            // ±180° in 2^-16: below 2^24, exact in f32.
            let degrees = N::ratio(angle.get().to_bits(), 1 << 16);
            *radians = degrees * N::RADIANS_PER_DEGREE;
        }
        Ok(radians)
    }

    /// Both Jacobians at a posture.
    ///
    /// # Errors
    /// The first axis whose angle is outside this wearer's range.
    pub fn jacobians_at_posture(&self, posture: &Posture) -> Result<Jacobians<N>, PostureError> {
        Ok(self.jacobians(&self.radians(posture)?))
    }

    /// Both Jacobians at angles in radians, whatever the wearer's ranges.
    #[must_use]
    pub fn jacobians(&self, radians: &[N; AXES]) -> Jacobians<N> {
        Jacobians::new(&self.skeleton.pose(radians), &self.lines)
    }

    /// The amplitudes that give a wanted wrench at the hand, by the nearest-neighbour
    /// recruitment: at each joint the one line whose torque is closest in direction to
    /// the wanted is recruited. Channels that are not named rest.
    ///
    /// # Errors
    /// [`ReachError`]: that no muscle helps at any joint, or what share of the wrench
    /// can be made.
    pub fn recruit(
        &self,
        jacobians: &Jacobians<N>,
        wanted: &Wrench<N>,
    ) -> Result<RecruitmentResult<N>, ReachError<N>> {
        let choice = nearest(jacobians, wanted);
        recruitment::recruit(&self.curves, &choice)
    }

    /// The most force of each line, N, in the spec's order: at the wearer's limit.
    pub fn max_forces(&self) -> impl Iterator<Item = N> {
        self.curves.iter().map(recruitment::Curve::max_force)
    }

    /// The amplitudes for a force of each line (N, in the spec's order), below zero as
    /// zero, above its most as its most: for a recruitment that is not this room's.
    #[must_use]
    pub fn orders(&self, forces: &[N]) -> Orders {
        recruitment::orders(&self.curves, forces)
    }
}
