//! Errors of the arm, its posture and its wrench.

use firmware::limb::{LimbError, LimbSpec, PostureError};

/// Names of the nine axes of the arm, in the order of their indices.
const AXIS_NAMES: [&str; 9] = [
    "sternoclavicular protraction",
    "sternoclavicular elevation",
    "sternoclavicular roll",
    "shoulder flexion",
    "shoulder abduction",
    "shoulder internal rotation",
    "elbow flexion",
    "elbow bend sideways",
    "forearm pronation",
];

/// Reason why the recruitment of the arm's muscles could not be computed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum RecruitmentError {
    /// The specification of the arm has mistakes (E700). The value lists all of them.
    #[error("E700 the specification of the arm has mistakes:\n{}", .0.join("\n"))]
    Spec(Vec<String>),
    /// A joint angle is outside its range (E701).
    #[error(
        "E701 {} is {}°; allowed for this wearer: {} to {}°; move the arm back, or correct \
         `ranges_mdeg` of axis {}", axis_name(.0.axis), degrees(.0.mdeg), degrees(.0.low_mdeg), degrees(.0.high_mdeg), .0.axis
    )]
    Posture(PostureError),
    /// No muscle under an electrode can contribute to the wanted force (E702).
    #[error(
        "E702 no muscle under an electrode turns a joint in the direction that this force needs: \
         choose another direction, or place an electrode on a muscle that pulls that way"
    )]
    NoMuscleHelps,
    /// The wanted force is larger than the muscles can give in this posture (E703).
    #[error(
        "E703 a force of {wanted_n:.1} N is not possible in this posture; the largest in this \
         direction is ({}, {}, {}) N (backward, right, upward): choose at most that, or raise the \
         limits of the channels",
        one_place(.nearest[0]), one_place(.nearest[1]), one_place(.nearest[2])
    )]
    Beyond {
        /// Magnitude of the wanted force, N.
        wanted_n: f64,
        /// Largest possible force in the wanted direction, N: backward, right, upward.
        nearest: [f64; 3],
    },
    /// In this posture the arm exerts some wrench without any torque, so a wrench cannot be
    /// computed from torques (E704).
    #[error(
        "E704 the joints and the hand lie in one line, so the arm holds some forces without any \
         torque, and the forces of its muscles cannot be computed; bend the arm"
    )]
    Singular,
    /// A weight is outside its range, so that the solution would not be unique (E705).
    #[error("E705 the weight `{weight}` of the least squares is {value}; allowed: {allowed}")]
    Weight {
        /// Name of the field of [`super::Weights`].
        weight: &'static str,
        /// Value of the weight, which is refused.
        value: f64,
        /// Description of the allowed values, for example "0 or more".
        allowed: &'static str,
    },
    /// The least squares did not converge, because an input is not finite or too large (E706).
    #[error(
        "E706 the least squares did not converge: a wanted force, a moment arm or a weight is not \
         finite, or is so large that the others become negligible; correct this value"
    )]
    NotConverged,
}

impl RecruitmentError {
    /// Checks the specification of an arm.
    ///
    /// # Errors
    /// [`RecruitmentError::Spec`] with all mistakes at once.
    pub fn check_spec(spec: &LimbSpec) -> Result<(), Self> {
        let mut lines = Vec::new();
        spec.report_mistakes(&mut |mistake| lines.push(describe_mistake(&mistake, spec)));
        match lines.is_empty() {
            true => Ok(()),
            false => Err(Self::Spec(lines)),
        }
    }
}

impl From<PostureError> for RecruitmentError {
    fn from(error: PostureError) -> Self {
        Self::Posture(error)
    }
}

/// Describes a mistake in one line, with the name of its axis or the number of its channel.
fn describe_mistake(mistake: &LimbError, spec: &LimbSpec) -> String {
    match mistake {
        LimbError::Axis { axis, .. } => format!("  {mistake} ({})", axis_name(*axis)),
        LimbError::Line { line, range } => {
            let channel = spec.lines.get(usize::from(*line)).map(|line| line.channel);
            let channel = channel.map_or(String::new(), |channel| format!(" (channel {channel})"));
            let why = match (range.field, range.value) {
                ("gain_mn_per_ma", 0) => ": a muscle without gain gives no force at any amplitude",
                _ => "",
            };
            format!("  {mistake}{channel}{why}")
        }
        _ => format!("  {mistake}"),
    }
}

fn axis_name(axis: u8) -> &'static str {
    let name = AXIS_NAMES.get(usize::from(axis));
    name.copied().unwrap_or("an unknown axis")
}

fn degrees(mdeg: i32) -> f64 {
    f64::from(mdeg) / 1000.0
}

/// Formats a number with one decimal place; a negative number that rounds to zero becomes `0.0`.
fn one_place(number: f64) -> String {
    let words = format!("{number:.1}");
    match words.as_str() {
        "-0.0" => "0.0".to_owned(),
        _ => words,
    }
}
