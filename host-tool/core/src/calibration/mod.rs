//! Guided calibration: takes a person with electrodes to a finished wearer file.
//!
//! This module holds the plan (which electrodes, how far), the procedure as a pure state machine
//! (orders and time in, actions out), the journal from which it is continued, the instrument's
//! verdict, the operator that stands in for a person on simulators, and the course on a device.
//! Terminals and lines of JSON are part of the program, and the wearer file's format is in
//! `wearer`. The inputs are a [`Plan`], a port and an [`Operator`]; the outputs are a journal and a
//! wearer file. Every raise needs an order of its own: silence raises nothing.

mod auto;
mod check;
mod conduct;
mod course;
mod error;
mod found;
mod head;
mod instrument;
mod journal;
mod level;
mod machine;
mod open;
mod operator;
mod order;
mod outcome;
mod plan;
mod presentation;
mod setup;
mod simulated;
mod step;
mod unread;
mod view;
mod worn;

pub use auto::Auto;
pub use check::{CheckOrder, Drift, check};
pub use conduct::{OperatorStation, ProcedureCost};
pub use course::{Course, calibrate};
pub use error::{CalibrationError, OperatorLoss};
pub use found::{ElectrodeResult, Value};
pub use head::Head;
pub use instrument::MovementVerdict;
pub use journal::{
    Entry, Files, Journal, JournalContents, OnDisk, has_entries, journal_path, parse_journal, read,
};
pub use level::Level;
pub use machine::{Action, Machine};
pub use open::CalibrationDevice;
pub use operator::{Operator, OperatorNotice};
pub use order::{Order, OrderError, Refusal};
pub use outcome::{CalibrationOutcome, CalibrationResult};
pub use plan::{HOST_TIMEOUT_MS, Plan, PlannedElectrode};
pub use setup::board_session;
pub use simulated::SimulatedWearer;
pub use step::Step;
pub use unread::PartialLine;
pub use view::{Phase, View};
pub use worn::check_planned_wearer;
