//! The reasons why a call to a drive fails.

use super::DriveState;
use crate::choice::ChoiceError;
use crate::record::RecordError;
use crate::run::{OpenError, RunError};
use std::fmt;

/// State of a drive that a call needs.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum RequiredState {
    /// Nothing is armed.
    Idle,
    /// The device is armed.
    Armed,
    /// The device stimulates.
    Running,
}

/// Reason why a call to a drive failed.
#[derive(Debug, thiserror::Error)]
pub enum DriveError {
    /// The device refused, ended stimulation or is lost, or the record cannot be written.
    #[error(transparent)]
    Run(#[from] RunError),
    /// The device cannot be opened.
    #[error(transparent)]
    Open(#[from] OpenError),
    /// The record cannot be created or completed.
    #[error(transparent)]
    Record(#[from] RecordError),
    /// No muscle model suits the session.
    #[error(transparent)]
    Choice(#[from] ChoiceError),
    /// The call is not possible in the present state (E772).
    #[error("E772 {call}() is not possible while the device is {state}; {}", .needed.advice(*.state))]
    Order {
        /// Name of the call.
        call: String,
        /// State that the call needs.
        needed: RequiredState,
        /// Present state.
        state: DriveState,
    },
    /// The program did not renew its lease in time, so stimulation was stopped (E773).
    #[error(
        "E773 no call came for {lease_s} s, the lease, so stimulation was stopped: use dev.wait(5) \
         instead of time.sleep(5)"
    )]
    LeaseExpired {
        /// Length of the lease, s.
        lease_s: f64,
    },
    /// A setpoint waited longer than the host timeout before it could be sent, so it was not sent
    /// (E774).
    #[error(
        "E774 a setpoint was {late_ms} ms late, longer than the host timeout of {timeout_ms} ms, \
         and was not sent; send the present value again"
    )]
    Late {
        /// Time for which the setpoint waited, ms.
        late_ms: u64,
        /// The wearer's host timeout, ms.
        timeout_ms: u64,
    },
    /// The device was closed, or belongs to the process from which this one was forked (E775).
    #[error("E775 the device is closed; connect again")]
    Closed,
    /// The call needs a simulator (E776).
    #[error("E776 {0} is possible with a simulator only; connect to `sim:`")]
    NotSimulated(&'static str),
    /// The session has another simulated wearer than the trial before (E777).
    #[error(
        "E777 the session has another [body] than the trial before, and the simulated wearer \
         continues from trial to trial; call reset() first"
    )]
    OtherBody,
    /// Every train with a fixed number of pulses has played (E778).
    #[error(
        "E778 every train has played its pulses, and the trial is over; call stop() for its record"
    )]
    Over,
    /// The device, or its simulated wearer, cannot be copied (E779).
    #[error(
        "E779 this device cannot be copied: only an armed simulator can, with a wearer of its own \
         and not with a limb that a program computes; run the session again instead"
    )]
    NotCopyable,
}

impl fmt::Display for DriveState {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Idle => "not armed",
            Self::Armed => "armed",
            Self::Running => "stimulating",
            Self::Closed => "closed",
        })
    }
}

impl RequiredState {
    /// Returns which calls lead from `state` to the required one.
    const fn advice(self, state: DriveState) -> &'static str {
        match (self, state) {
            (Self::Armed, DriveState::Running) => "call stop() and arm() first",
            (Self::Idle, _) => "call stop() first",
            (Self::Armed, _) => "call arm() first",
            (Self::Running, DriveState::Armed) => "call start() first",
            (Self::Running, _) => "call arm() and start() first",
        }
    }
}
