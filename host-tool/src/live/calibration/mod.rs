//! The calibration's screen: what the operator sees, and the keys that order.
//!
//! In: views and what was recorded, from the thread at the device. Out: orders, one a
//! key. Not here: what an order does (`host_core::calibration`).

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
