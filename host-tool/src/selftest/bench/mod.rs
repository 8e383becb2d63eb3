//! Bench test of a real board on dummy loads, measured by a person with an oscilloscope.
//!
//! Contains the measurements and their bounds ([`Step`]), the parser of typed values
//! ([`read_value`]), the file ([`Sheet`]), and the pattern that a board plays ([`Bench`]). Receives
//! typed values; writes a file with the values, the operator and the device. `cli` asks the
//! questions.

mod board;
mod sheet;
mod step;

pub use board::{Bench, BoardActivity, Pattern};
pub use sheet::{Answer, Sheet, SheetError, Verdict};
pub use step::{Step, ValueError, read_value, steps};
