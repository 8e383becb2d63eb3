//! The calibration's screen and its keys.
//!
//! Receives views and recorded entries from the thread at the device, and returns at most one order
//! for each key. `host_core::calibration` carries the orders out.

mod asked;
mod digits;
mod keys;
mod sight;
mod sitting;
mod terminal;
mod typed;
mod view;

pub use asked::{InputLimiter, State, early_refusal, select_orders};
pub use keys::order as calibration_order;
pub use sight::ScreenState;
pub use sitting::{SharedTerminal, TerminalOperator};
pub use terminal::RawTerminal;
pub use view::draw as draw_calibration;
