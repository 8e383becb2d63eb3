//! The reasons why a calibration is refused or ends, with advice on each.

use super::Refusal;
use crate::link::Error;
use std::path::PathBuf;

/// Reason why an operator sends no more orders.
#[derive(Clone, Copy, PartialEq, Eq, Debug, thiserror::Error)]
pub enum OperatorLoss {
    /// The input has ended, so that no order can arrive.
    #[error("the input has ended")]
    Ended,
    /// The output is not read, so that nobody sees the state to order for.
    #[error("the output is not read")]
    Unread,
    /// The input contains more than an operator would order.
    #[error("the input is flooded with orders")]
    Flooded,
}

/// Reason why a calibration was refused or ended early. The entries recorded until then are kept.
#[derive(Debug, thiserror::Error)]
pub enum CalibrationError {
    /// The plan is invalid: its name, and all its mistakes (E670).
    #[error("E670 the plan of {0} cannot be carried out:\n  {1}")]
    Plan(String, String),
    /// A file of an earlier calibration exists already (E672).
    #[error(
        "E672 {0} exists already: choose another --out, or continue the calibration with --resume"
    )]
    Taken(PathBuf),
    /// The journal cannot be continued, for the given reason (E673).
    #[error("E673 {0} cannot be resumed: {1}")]
    NotResumable(PathBuf, String),
    /// The journal was changed: path, line and reason (E674).
    #[error(
        "E674 the journal {0}, line {1}: {2}, so the journal is damaged; restore an intact copy, \
         or start a new calibration with another --out"
    )]
    Damaged(PathBuf, usize, String),
    /// The disk is full, or the file system refused to write for another reason (E675).
    #[error(
        "E675 cannot write {0}: {1}; stimulation has ended; free some space, then continue with \
         --resume; what was recorded before is kept"
    )]
    Write(PathBuf, std::io::Error),
    /// The file cannot be opened for writing (E693).
    #[error(
        "E693 cannot write {0}: {1}; nothing was stimulated; choose another --out, or correct the \
         cause"
    )]
    Closed(PathBuf, std::io::Error),
    /// No electrode is complete, so that no wearer file was written (E694).
    #[error("E694 the calibration has no result: {0}; no wearer file was written; {1}")]
    Nothing(String, &'static str),
    /// The wearer file is of a simulated wearer and the device's wearer is a person, or the reverse
    /// (E695).
    #[error(
        "E695 {0} has `evidence = \"{1}\"`, but this device's wearer is {2}; a check would not \
         apply to this file; nothing was stimulated"
    )]
    Another(PathBuf, &'static str, &'static str),
    /// The tolerance is so large that every threshold would be accepted (E696).
    #[error(
        "E696 --tolerance {0} is at least half the threshold of channel {1}, {2}; any threshold \
         would pass; choose a smaller tolerance"
    )]
    Loose(super::Level, u8, super::Level),
    /// The device ended stimulation: event, place and advice (E677).
    #[error("E677 the device ended stimulation ({0}) at {1}; {2}, then continue with --resume")]
    Ended(String, String, &'static str),
    /// This computer stalls repeatedly: the number of stalls within a minute, the last pause in ms,
    /// and the place (E697).
    #[error(
        "E697 this computer stalled {0} times within a minute, the last time for {1} ms, at {2}; \
         each time the device ended stimulation; close other programs, or use another computer, \
         then continue with --resume"
    )]
    Stalls(usize, u32, String),
    /// The instrument's reading does not change under stimulation, N (E680).
    #[error(
        "E680 the instrument saturates: its reading stays at {0:.3} N during stimulation; lower \
         its gain or its preload, then continue with --resume"
    )]
    Saturates(f64),
    /// The instrument answers with the wrong sign, N (E681).
    #[error(
        "E681 the instrument is upside down: it reads {0:.3} N when the muscle pulls; turn it \
         around or change the sign of its signal, then continue with --resume"
    )]
    UpsideDown(f64),
    /// Thresholds differ from those in the wearer file by more than the tolerance (E682).
    #[error(
        "E682 the thresholds have drifted: {0}; calibrate again, or check electrodes and skin \
         and repeat the check"
    )]
    Drifted(String),
    /// The operator ended the calibration at this place (E683).
    #[error("E683 the operator ended the calibration at {0}; continue with --resume")]
    Aborted(String),
    /// The operator sends no more orders: reason and place (E684).
    #[error(
        "E684 the calibration ended at {1}, because no more orders can arrive ({0}); continue \
         with --resume"
    )]
    Gone(OperatorLoss, String),
    /// The text to be written is not a valid wearer file (E687).
    #[error("E687 the text for {0} is not a valid wearer file: {1}; nothing was written")]
    Wrong(PathBuf, String),
    /// The result of a check could not be added to the wearer file (E689).
    #[error("E689 the check was not added to the wearer file: {0}; stimulation has ended")]
    Store(String),
    /// Nobody is at the terminal to answer (E688).
    #[error(
        "E688 this command needs a terminal, because an operator must order each raise; use \
         --json for another program, or --auto on a simulator"
    )]
    Nobody,
    /// An order led to an impossible state.
    #[error(transparent)]
    Refused(#[from] Refusal),
    /// The link failed, or a signal arrived.
    #[error(transparent)]
    Link(#[from] Error),
}
