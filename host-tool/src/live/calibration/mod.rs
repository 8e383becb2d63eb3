//! The calibration's screen: what the operator sees, and the keys that order.
//!
//! In: views and what was recorded, from the thread at the device. Out: orders, one a
//! key. Not here: what an order does (`host_core::calibration`).

mod digits;
mod keys;
mod sight;
mod terminal;
mod view;

pub use keys::order as calibration_order;
pub use sight::{Behind, Sight};
pub use terminal::sit;
pub use view::draw as draw_calibration;
