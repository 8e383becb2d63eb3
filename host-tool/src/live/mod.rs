//! A terminal dashboard of a device, with or without a running session.
//!
//! Contains the known state ([`Model`]), its layout ([`draw`], [`line`]), the keys, the screen of
//! the calibration, and the thread that talks to the device ([`work`]). Another thread draws, so
//! that a slow terminal never delays a setpoint. Receives the observations of a run; returns
//! frames, lines and orders. Other modules run sessions (`run`), speak the protocol (`link`) and
//! draw figures (`report`).

mod calibration;
mod channels;
mod chart;
mod hands;
mod keys;
mod line;
mod lines;
mod model;
mod screen;
mod shared;
mod stream;
mod view;
mod work;

pub use calibration::{
    InputLimiter, RawTerminal, ScreenState, SharedTerminal, State, TerminalOperator,
    calibration_order, draw_calibration, early_refusal, select_orders,
};
pub use hands::{Act, Hands};
pub use keys::{Order, order_for_key};
pub use line::{status_json, status_text};
pub use lines::write_lines;
pub use model::{Channel, Model, Note};
pub use screen::run_screen;
pub use shared::{Shared, Watch};
pub use stream::{AT_ONCE, discard_unread_output, write_available};
pub use view::draw;
pub use work::{Plan, run_plan};
