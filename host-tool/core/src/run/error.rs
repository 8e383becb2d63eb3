//! The reasons why a session does not run to its end.

use super::{Stopped, interruption};
use crate::link::{Error, Signal};
use crate::record::RecordError;

/// Reason why a session did not run to its end. The rows that were recorded until then are kept.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// The link to the device failed, or the device refused a request.
    #[error(transparent)]
    Link(#[from] Error),
    /// The record could not be written to disk.
    #[error(transparent)]
    Record(#[from] RecordError),
    /// The device ended the session, although neither the session nor a person at the controls had
    /// ended it (E512).
    #[error(
        "E512 the device ended the session at {t_s:.2} s: {why}; {advice}; what was recorded is kept"
    )]
    Ended {
        /// Time at which the session ended, s since the start of the trains.
        t_s: f64,
        /// Event by which the device reported the end, in words.
        why: String,
        /// What the user can do about it.
        advice: String,
    },
    /// The board has output stages that differ from those in the session file (E505).
    #[error(
        "E505 {0}; configure the stages that the board has, or use the board that the session was made for"
    )]
    OtherStages(String),
    /// The board does not know its output stages, because no valid table of them is stored (E506).
    #[error(
        "E506 the board does not know its output stages ({0}), so nothing can be armed; store them with `flexor stages --store`"
    )]
    StagesUnknown(&'static str),
    /// Two channels can drive in opposite directions at once, which the board's stages cannot do
    /// (E507).
    #[error(
        "E507 {0}; move their pulses apart within one period, or give both the same direction; if each stage has its own supply, store that: `flexor stages --store ... --supply separate`"
    )]
    Opposed(String),
    /// The session needs the measured angles of an arm, which only a simulated wearer has (E550).
    #[error(
        "E550 the session expects the host to measure the posture, but {0} has no simulated arm; set posture_deg, or [body] kind = \"arm\" on a simulator"
    )]
    NoPosture(String),
    /// The session file prescribes the joint angles. Only a simulated device may receive such
    /// angles, because a board needs measured ones (E755).
    #[error(
        "E755 the session's joint angles are scripted, but {0} may have a real wearer; use angles that a client measures (docs/protocol.md), or run the session on a simulator"
    )]
    ScriptedAngles(String),
    /// The session needs the angle that a data glove measures, which only a simulated wearer has
    /// (E513).
    #[error(
        "E513 the session expects the host to measure the angle, but {0} has no simulated glove; set sensor = \"adc\", or run the session on a simulator"
    )]
    NoGlove(String),
    /// An observer requested the end of the session (E516).
    #[error("E516 the operator stopped the session at {t_s:.2} s; what was recorded is kept")]
    Interrupted {
        /// Time at which the session ended, s since the start of the trains.
        t_s: f64,
    },
    /// The currents in the simulated hand could not be computed in some stretches of time, so the
    /// result is not reliable (E567). The field is the number of these stretches.
    #[error(
        "E567 at {0} times of the session the simulation could not compute the currents in the \
         hand and assumed none: do not use the angles of this record, change the load or the \
         amplitudes and run again"
    )]
    Unsettled(u64),
    /// A signal ended the session (E580).
    #[error("E580 {}", interruption::describe_signal(*.signal, *.t_s, .stopped))]
    Signal {
        /// Signal that the program received.
        signal: Signal,
        /// Time at which the signal arrived, s since the start of the trains; `None` if they had
        /// not started.
        t_s: Option<f64>,
        /// Whether a stop was sent to the device because of the signal, and whether the device
        /// acknowledged it.
        stopped: Stopped,
    },
}
