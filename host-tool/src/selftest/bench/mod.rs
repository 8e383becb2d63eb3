//! A real board on dummy loads, measured by a person with an oscilloscope.
//!
//! Lives here: what is measured and what passes ([`Step`]), what is typed ([`read_value`]),
//! the file ([`Sheet`]), the pattern that a board plays ([`Bench`]). Not here: who asks
//! (`cli`). In: typed values. Out: a file that says what was measured, by whom, on what.

mod board;
mod sheet;
mod step;

pub use board::{Bench, BoardActivity, Pattern};
pub use sheet::{Answer, Sheet, SheetError, Verdict};
pub use step::{Step, ValueError, read_value, steps};
