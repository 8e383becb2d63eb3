//! Why a calibration was refused or did not go on, and what to do about it.

use super::Refusal;
use crate::link::Error;
use std::path::PathBuf;

/// Why no orders come any more.
#[derive(Clone, Copy, PartialEq, Eq, Debug, thiserror::Error)]
pub enum Gone {
    /// Nobody can send any.
    #[error("the input has ended")]
    Ended,
    /// Nobody sees what they are for.
    #[error("the output is not read")]
    Unread,
    /// More comes than anybody orders.
    #[error("the input is flooded")]
    Flooded,
}

/// Why a calibration was refused, or ended before its end. What was recorded is kept.
#[derive(Debug, thiserror::Error)]
pub enum CalibrationError {
    /// The plan: its name, and all that is wrong with it.
    #[error("E670 the plan of {0} cannot be carried out:\n  {1}")]
    Plan(String, String),
    /// A file of an earlier calibration is there.
    #[error(
        "E672 {0} is there already: choose another --out, or go on where it ended with --resume"
    )]
    Taken(PathBuf),
    /// Nothing that could be gone on with.
    #[error("E673 {0} cannot be gone on with: {1}")]
    NotResumable(PathBuf, String),
    /// A journal that was changed.
    #[error(
        "E674 the journal {0}, line {1}: {2}; flexor does not write it so: take it from where it \
         was kept whole, or begin anew with another --out"
    )]
    Damaged(PathBuf, usize, String),
    /// The disk is full, or the file system refused otherwise.
    #[error(
        "E675 cannot write {0}: {1}; stimulation has ended; make room, then go on with --resume: \
         what was recorded before is kept"
    )]
    Write(PathBuf, std::io::Error),
    /// Nothing can be written there.
    #[error("E693 cannot write {0}: {1}; nothing was given; choose another --out, or mend that")]
    Closed(PathBuf, std::io::Error),
    /// No electrode is complete.
    #[error("E694 nothing was found: {0}; no wearer file was written; {1}")]
    Nothing(String, &'static str),
    /// A simulated wearer's check of a person, or a person's of a simulated wearer.
    #[error(
        "E695 {0} says `evidence = \"{1}\"`, and this device's wearer is {2}: a check of it would \
         say nothing of that file; nothing was given"
    )]
    Another(PathBuf, &'static str, &'static str),
    /// A tolerance that every threshold is within.
    #[error(
        "E696 --tolerance {0} is no less than half the threshold of channel {1}, {2}: any would \
         hold; choose a smaller one"
    )]
    Loose(super::Level, u8, super::Level),
    /// The device ended it.
    #[error("E677 the device ended stimulation ({0}) at {1}; {2}, then go on with --resume")]
    Ended(String, String, &'static str),
    /// This computer stalls again and again: how often within a minute, the last pause in
    /// ms, and where.
    #[error(
        "E697 this computer stalled {0} times within a minute, the last time for {1} ms, at {2}: \
         each time the device ended stimulation by itself; close other programs, or use another \
         computer, then go on with --resume"
    )]
    Stalls(usize, u32, String),
    /// The sensor stands still under stimulation.
    #[error(
        "E680 the instrument saturates at {0:.3} N: it reads nothing else under stimulation; \
         lower its gain or its preload, then go on with --resume"
    )]
    Saturates(f64),
    /// The sensor answers with the wrong sign.
    #[error(
        "E681 the instrument is upside down: it reads {0:.3} N where the muscle pulls; turn it \
         or its sign, then go on with --resume"
    )]
    UpsideDown(f64),
    /// Thresholds that are not where the file says.
    #[error(
        "E682 the thresholds have drifted: {0}; calibrate anew, or check electrodes and skin and \
         check again"
    )]
    Drifted(String),
    /// The operator ended it.
    #[error("E683 the operator ended the calibration at {0}; go on with --resume")]
    Aborted(String),
    /// Nobody orders any more.
    #[error("E684 nobody orders any more ({0}) at {1}; go on with --resume")]
    Gone(Gone, String),
    /// What was to be written is no wearer file.
    #[error("E687 what is to be written to {0} is no wearer file: {1}")]
    Wrong(PathBuf, String),
    /// What was found could not be added to a wearer file.
    #[error("E689 the check was not added to the wearer file: {0}; stimulation has ended")]
    Store(String),
    /// Nobody could answer.
    #[error(
        "E688 nobody is at the terminal to order each raise: use --json for another program, or \
         --auto on a simulator"
    )]
    Nobody,
    /// An order led to a state that is none.
    #[error(transparent)]
    Refused(#[from] Refusal),
    /// The link, or a signal.
    #[error(transparent)]
    Link(#[from] Error),
}
