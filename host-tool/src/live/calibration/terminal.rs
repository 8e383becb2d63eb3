//! The thread at the terminal: frames out, keys in.

use super::{Sight, calibration_order, draw_calibration};
use crate::live::screen::{FRAME, Screen, has_panicked};
use crossterm::event::{self, Event};
use host_core::calibration::Order;
use std::io;
use std::sync::mpsc::Sender;
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

/// Draws and takes keys until `is_over`; every key is an order of its own.
///
/// # Errors
/// The terminal fails.
pub fn sit(
    sight: &Mutex<Sight>,
    orders: &Sender<Order>,
    is_over: impl Fn() -> bool,
) -> io::Result<()> {
    let mut screen = Screen::open()?;
    while !is_over() && !has_panicked() {
        let seen = {
            let sight = sight.lock().unwrap_or_else(PoisonError::into_inner);
            sight.clone()
        };
        screen.0.draw(|frame| draw_calibration(frame, &seen))?;
        let next = Instant::now() + FRAME;
        while event::poll(next.saturating_duration_since(Instant::now()))? {
            if let Event::Key(key) = event::read()? {
                let mut sight = sight.lock().unwrap_or_else(PoisonError::into_inner);
                let view = sight.view.clone().unwrap_or_default();
                if let Some(order) = calibration_order(key, &view, &mut sight.typed) {
                    let _ = orders.send(order); // the work is over
                }
            }
        }
    }
    Ok(())
}
