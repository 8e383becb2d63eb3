//! Why a session did not run to its end.

use super::{Stopped, interruption};
use crate::link::{Error, Signal};
use crate::record::RecordError;

/// Why a session did not run to its end. What was recorded is kept.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// The link or a refusal.
    #[error(transparent)]
    Link(#[from] Error),
    /// The record on disk.
    #[error(transparent)]
    Record(#[from] RecordError),
    /// The device stopped by itself.
    #[error(
        "E512 the device ended the session at {t_s:.2} s: {why}; {advice}; what was recorded is kept"
    )]
    Ended {
        /// From the start, s.
        t_s: f64,
        /// The event.
        why: String,
        /// What to do about it.
        advice: String,
    },
    /// The session declares other stages than the board has.
    #[error("E505 {0}; declare the stages that the board has, or use the board it was made for")]
    OtherStages(String),
    /// The board cannot tell its stages.
    #[error(
        "E506 the board does not know its output stages ({0}), so nothing can be armed; store them with `flexor stages --store`"
    )]
    StagesUnknown(&'static str),
    /// The board's stages cannot drive in opposite directions at once.
    #[error(
        "E507 {0}; move their pulses apart, in one period, or give both the same direction; on stages with a supply each, store that: `flexor stages --store ... --supply separate`"
    )]
    Opposed(String),
    /// Only a simulated wearer has the arm whose angles this session measures.
    #[error(
        "E550 the session's posture is measured by the host, and {0} has no simulated arm; say posture_deg, or [body] kind = \"arm\""
    )]
    NoPosture(String),
    /// Only a simulated device is told a file's angles.
    #[error(
        "E755 the session's joint angles are a script, and {0} may have a wearer: stimulate by angles that a client measures (docs/protocol.md), or run it on a simulator"
    )]
    ScriptedAngles(String),
    /// Only a simulated wearer has the glove that this session measures with.
    #[error(
        "E513 the session's angle is measured by the host, and {0} has no simulated glove; use sensor = \"adc\""
    )]
    NoGlove(String),
    /// The observer wished for it.
    #[error("E516 the session was stopped by hand at {t_s:.2} s; what was recorded is kept")]
    Interrupted {
        /// From the start, s.
        t_s: f64,
    },
    /// The simulated wearer was not computed throughout.
    #[error(
        "E567 in {0} stretches of time the simulated hand's circuit has no consistent currents, \
         so that none flowed there and its angle means nothing; what was recorded is kept"
    )]
    Unsettled(u64),
    /// A signal came.
    #[error("E580 {}", interruption::told(*.signal, *.t_s, .stopped))]
    Signal {
        /// Which.
        signal: Signal,
        /// From the start, s; `None` before it.
        t_s: Option<f64>,
        /// Whether the device is known to have stopped.
        stopped: Stopped,
    },
}
