//! The reasons why a calibration is refused or ends, with advice on each.

use super::Refusal;
use crate::link::Error;
use crate::run::OpenError;
use hal_sim::body::bench::InvalidBench;
use std::path::PathBuf;

/// Reason why no more commands can come from an operator.
#[derive(Clone, Copy, PartialEq, Eq, Debug, thiserror::Error)]
pub enum OperatorLoss {
    /// The input has ended, so that no command can arrive.
    #[error("the input has ended")]
    Ended,
    /// Nobody reads the output, so that nobody sees the state that a command refers to.
    #[error("the output is not read")]
    Unread,
    /// The input contains more commands than an operator would give.
    #[error("the input is flooded with orders")]
    Flooded,
}

/// Reason why a calibration was refused or ended early. The journal keeps all entries up to then.
#[derive(Debug, thiserror::Error)]
pub enum CalibrationError {
    /// The plan is invalid (E670). The values are the name of the plan and all its mistakes.
    #[error("E670 the plan of {0} cannot be carried out:\n  {1}")]
    Plan(String, String),
    /// A file of an earlier calibration exists already at this path (E672).
    #[error(
        "E672 {0} exists already: choose another --out, or continue the calibration with --resume"
    )]
    Taken(PathBuf),
    /// The journal at this path cannot be continued, for the given reason (E673).
    #[error("E673 {0} cannot be resumed: {1}")]
    NotResumable(PathBuf, String),
    /// The journal was changed after it was written (E674). The values are its path, the line and
    /// the reason.
    #[error(
        "E674 the journal {0}, line {1}: {2}, so the journal is damaged; restore an intact copy, \
         or start a new calibration with another --out"
    )]
    Damaged(PathBuf, usize, String),
    /// The file at this path cannot be written, for example because the disk is full (E675).
    #[error(
        "E675 cannot write {0}: {1}; stimulation has ended; free some space, then continue with \
         --resume; what was recorded before is kept"
    )]
    Write(PathBuf, std::io::Error),
    /// The file at this path cannot be opened for writing, before any stimulation (E693).
    #[error(
        "E693 cannot write {0}: {1}; nothing was stimulated; choose another --out, or correct the \
         cause"
    )]
    Closed(PathBuf, std::io::Error),
    /// No electrode is complete, so no wearer file was written (E694). The values are the reason
    /// and advice.
    #[error("E694 the calibration has no result: {0}; no wearer file was written; {1}")]
    Nothing(String, &'static str),
    /// The wearer file is that of a simulated wearer and the device has a person, or the reverse
    /// (E695). The values are the path, the file's `evidence`, and the kind of the device's wearer.
    #[error(
        "E695 {0} has `evidence = \"{1}\"`, but this device's wearer is {2}, so nothing was \
         stimulated; give the wearer file of this device's wearer, or choose another --device"
    )]
    Another(PathBuf, &'static str, &'static str),
    /// The tolerance is so large that every threshold would be accepted (E696). The values are the
    /// tolerance, the channel and its threshold.
    #[error(
        "E696 --tolerance {0} is at least half the threshold of channel {1} ({2}), so any \
         threshold would pass; choose a smaller tolerance"
    )]
    Loose(super::Level, u8, super::Level),
    /// The device ended stimulation by itself (E677). The values are the event, the place in the
    /// calibration, and advice.
    #[error("E677 the device ended stimulation ({0}) at {1}; {2}, then continue with --resume")]
    Ended(String, String, &'static str),
    /// This computer stalls repeatedly (E697). The values are the number of stalls within a minute,
    /// the length of the last one in ms, and the place in the calibration.
    #[error(
        "E697 this computer stalled {0} times within a minute, the last time for {1} ms, at {2}; \
         each time the device ended stimulation; close other programs, or use another computer, \
         then continue with --resume"
    )]
    Stalls(usize, u32, String),
    /// The instrument's reading stays at this value under stimulation, N, so it is at the end of
    /// its range (E680).
    #[error(
        "E680 the instrument saturates: its reading stays at {0:.3} N during stimulation; lower \
         its gain or its preload, then continue with --resume"
    )]
    Saturates(f64),
    /// The instrument has the wrong sign: its reading changes by this negative value when the
    /// muscle pulls, N (E681).
    #[error(
        "E681 the instrument is upside down: it reads {0:.3} N when the muscle pulls; turn it \
         around or change the sign of its signal, then continue with --resume"
    )]
    UpsideDown(f64),
    /// Thresholds are lower than the tolerance allows, or were not found (E682). The value lists
    /// them.
    #[error(
        "E682 the thresholds have drifted: {0}; calibrate again, or check electrodes and skin \
         and repeat the check"
    )]
    Drifted(String),
    /// The operator ended the calibration (E683). The value is the place in the calibration.
    #[error("E683 the operator ended the calibration at {0}; continue with --resume")]
    Aborted(String),
    /// No more commands can come from the operator (E684). The values are the reason and the place
    /// in the calibration.
    #[error(
        "E684 the calibration ended at {1}, because no more orders can arrive ({0}); continue \
         with --resume"
    )]
    Gone(OperatorLoss, String),
    /// The text that would be written is not a valid wearer file, for the given reason (E687).
    #[error(
        "E687 the results do not make a valid wearer file {0}: {1}; nothing was written; the \
         journal keeps the results"
    )]
    Wrong(PathBuf, String),
    /// The result of a drift check could not be added to the wearer file, for the given reason
    /// (E689).
    #[error(
        "E689 the check is lost, because it could not be added to the wearer file: {0}; remove the cause and check again (stimulation has ended)"
    )]
    Store(String),
    /// The standard input is not a terminal, so that no operator can answer (E688).
    #[error(
        "E688 this command needs a terminal, because an operator must order each raise; use \
         --json for another program, or --auto on a simulator"
    )]
    Nobody,
    /// A command cannot be carried out.
    #[error(transparent)]
    Refused(#[from] Refusal),
    /// The device cannot be opened.
    #[error(transparent)]
    Open(#[from] OpenError),
    /// The simulated wearer has impossible parameters.
    #[error(transparent)]
    Wearer(#[from] InvalidBench),
    /// The connection to the device failed, or a signal interrupted the calibration.
    #[error(transparent)]
    Link(#[from] Error),
}
