//! Boards of the chip simulator whose core is controlled by a debugger.

use super::{ChipError, ChipOptions, LogFile, failed_boot, power_on_as};
use crate::session::Session;
use firmware::lockstep::Sensors;
use hal_sim::chip::gdb::{Debugger, Points};
use hal_sim::chip::image::Image;
use hal_sim::lockstep::Device;
use std::net::TcpListener;

/// Waits for gdb and lets it control the core while the board boots. Returns the board, and the
/// device time at the end of its boot, µs.
pub(super) fn boot_under_gdb(
    session: &Session,
    image: &Image,
    options: &ChipOptions,
    log: LogFile,
) -> Result<(Box<dyn Device>, u64), ChipError> {
    let outside = ChipError::Outside;
    let board = power_on_as(options.board, session, image, Points::default())?;
    let port = options.gdb.unwrap_or_default(); // 0: any that is free
    let listener = TcpListener::bind(("127.0.0.1", port)).map_err(outside)?;
    let at = listener.local_addr().map_err(outside)?;
    eprintln!("the core is halted at reset; in gdb: target remote {at}");
    let mut debugger = Debugger::new(listener, board, options.outlives);
    if let Err(error) = debugger.boot(&Sensors::default()) {
        return Err(failed_boot::explain(error, debugger.as_mut(), image, log));
    }
    let boot_us = debugger.board().now_us();
    Ok((log.attach(debugger), boot_us))
}
