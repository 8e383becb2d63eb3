//! Sierotowicz 2023 on simulated arms: do nine muscles make a wanted force at the hand, and
//! does the calibration from twitches help?
//!
//! Lives here: what was declared (`host-tool/endpoint/study.toml`), how the device thinks
//! an arm works (`limb`), how it shares a wrench out (`recruit`), its calibration
//! (`calibrate`, `imus`), participants and their conditions C1 to C4 (`participant`,
//! `replication`), what they come to (`metrics`, `regression`, `population`). Not here: the
//! body (`hal_sim::body::arm`), the command (`cli`). In: a seed. Out: numbers beside the
//! paper's. All simulated: no evidence about people.

mod calibrate;
mod claims;
mod declaration;
mod error;
mod imus;
mod limb;
mod metrics;
mod participant;
mod picture;
mod population;
mod recruit;
mod regression;
mod replication;
mod sheets;

pub use calibrate::{calibrated, geometry_error_deg, routed, still, twitches};
pub use declaration::{DECLARED, Study};
pub use error::EndpointError;
pub use imus::check as check_imus;
pub use limb::{Action, Frame, JOINT_NAMES, JOINTS, Limb, Point, Segment, cursory};
pub use metrics::{Correlation, Measures, Target, align, measures, median, pearson};
pub use participant::{Command, DIRECTION_NAMES, DIRECTIONS, Participant};
pub use picture::page as arms_page;
pub use population::{Told, outcome};
pub use recruit::{
    LeastSquares, NearestNeighbour, Recruits, Switches, reachable_n, switches, torques,
};
pub use regression::{Features, Score, folds, predicted, ridge, score};
pub use replication::{
    CONDITIONS, Condition, PARTICIPANTS, Person, Replication, frame_of, person, replication,
};
