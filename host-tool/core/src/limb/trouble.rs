//! What is said where an arm, a posture or a wrench cannot be had.

use firmware::limb::{LimbError, LimbSpec, PostureError};

/// What the nine angles are.
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

/// Why no recruitment came.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Trouble {
    /// The specification has mistakes, all of them told.
    #[error("E700 the arm has mistakes:\n{}", .0.join("\n"))]
    Spec(Vec<String>),
    /// An angle outside its range.
    #[error(
        "E701 {} is {}°, outside this wearer's {}…{}°: bring the arm back, or set `ranges_mdeg` of axis {} to \
         what the joint can do", axis_name(.0.axis), degrees(.0.mdeg), degrees(.0.low_mdeg), degrees(.0.high_mdeg), .0.axis
    )]
    Posture(PostureError),
    /// No line helps.
    #[error(
        "E702 no muscle under an electrode turns any joint the way that this force needs: want \
         another direction, or place an electrode on a muscle that does"
    )]
    NoMuscleHelps,
    /// More than can be made.
    #[error(
        "E703 {wanted_n:.1} N cannot be made in this posture: of that direction ({}, {}, {}) N \
         can (backward, right, upward); want that, or raise the limits of the channels",
        one_place(.nearest[0]), one_place(.nearest[1]), one_place(.nearest[2])
    )]
    Beyond {
        /// How strong the wanted force is, N.
        wanted_n: f64,
        /// The most of it that can be made, N.
        nearest: [f64; 3],
    },
    /// Some wrench needs no torque.
    #[error(
        "E704 in this posture the arm holds some wrench without any torque (joints and hand lie \
         in one line): no muscles' forces can be told from it; bend the arm"
    )]
    Singular,
    /// A weight that leaves more than one answer.
    #[error("E705 the weight `{weight}` of the least squares is {value}: it must be {allowed}")]
    Weight {
        /// Which.
        weight: &'static str,
        /// What it is.
        value: f64,
        /// What it may be.
        allowed: &'static str,
    },
    /// The numbers are no numbers.
    #[error(
        "E706 the least squares came to no end: a wanted force, a lever or a weight is not finite, \
         or so large that others vanish beside it"
    )]
    NotConverged,
}

impl Trouble {
    /// All mistakes of a specification at once; nothing if there are none.
    ///
    /// # Errors
    /// [`Trouble::Spec`].
    pub fn of_spec(spec: &LimbSpec) -> Result<(), Self> {
        let mut lines = Vec::new();
        spec.mistakes(&mut |mistake| lines.push(told(&mistake, spec)));
        match lines.is_empty() {
            true => Ok(()),
            false => Err(Self::Spec(lines)),
        }
    }
}

impl From<PostureError> for Trouble {
    fn from(error: PostureError) -> Self {
        Self::Posture(error)
    }
}

/// A mistake with the names that people have for axes and channels.
fn told(mistake: &LimbError, spec: &LimbSpec) -> String {
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
    name.copied().unwrap_or("an axis that is not there")
}

fn degrees(mdeg: i32) -> f64 {
    f64::from(mdeg) / 1000.0
}

/// One decimal place, never `-0.0`.
fn one_place(number: f64) -> String {
    let words = format!("{number:.1}");
    match words.as_str() {
        "-0.0" => "0.0".to_owned(),
        _ => words,
    }
}
