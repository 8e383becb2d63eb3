//! A terminal dashboard of a device, with or without a running session.
//!
//! Lives here: what is known ([`Model`]), how it looks ([`draw`], [`line`]),
//! keys, and the thread that talks to the device ([`work`]) apart from the one
//! that draws: a slow terminal never delays a setpoint; the calibration's screen.
//! Not here: running a session (`run`), the link (`link`), pictures on paper
//! (`report`). In: what `run` lets an observer see. Out: frames, lines, orders.

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
