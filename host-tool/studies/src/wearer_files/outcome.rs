//! The wearer files that are compared, and the result of one of them on one wearer.

/// What the session of the default controller knows of the wearer.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Hash)]
pub enum Files {
    /// No file: the super-twisting control law alone, with voltages that somebody typed. They are
    /// those of the study's search on hands, and the nominal wearer's on fingers.
    Absent,
    /// The file of the nominal wearer, participant P, for whom the parameters were searched. Only
    /// fingers have it.
    Nominal,
    /// A file with the wearer's true voltages, torques and spring.
    True,
    /// The true file, with a session that switches learning off (`scale_learning` and
    /// `damping_learning` are 0).
    TrueWithoutLearning,
    /// The file that the procedure of `flexor calibrate` wrote. It has voltages and no torques.
    Calibrated,
}

impl Files {
    /// All files, in the order of tables.
    pub const ALL: [Self; 5] = [
        Self::Absent,
        Self::Nominal,
        Self::True,
        Self::TrueWithoutLearning,
        Self::Calibrated,
    ];
    /// Reason of a refusal: the calibration found no range at a point that the session uses, so the
    /// session is refused (E657).
    pub const NOT_CALIBRATED: &str = "not calibrated";

    /// Returns the name in tables.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Absent => "none",
            Self::Nominal => "participant P's",
            Self::True => "true",
            Self::TrueWithoutLearning => "true, learning off",
            Self::Calibrated => "written by calibrate",
        }
    }
}

/// Result of the default controller on one wearer with one file.
#[derive(Clone, PartialEq, Debug)]
pub struct Outcome {
    /// RMSE over the scored time, °. If the device refused or stopped, it includes the time without
    /// stimulation.
    pub rmse_deg: f64,
    /// Name of the field, fault or reason for which the session was refused or stopped.
    pub refused: Option<String>,
    /// Number of limit cycles that the device detected.
    pub limit_cycles: usize,
    /// Whether the session's maxima exceed what the voltage stage delivers into this hand's
    /// electrodes. A device would refuse them (E450, or E229 on arming), but the study goes on.
    pub is_beyond_stage: bool,
}

impl Outcome {
    pub(super) fn refused(rmse_deg: f64, why: &str) -> Self {
        Self {
            rmse_deg,
            refused: Some(why.to_owned()),
            limit_cycles: 0,
            is_beyond_stage: false,
        }
    }
}
