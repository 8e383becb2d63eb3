//! Operators of a calibration: a person at the terminal, or a substitute for simulators.

use super::CalibrateArgs;
use super::ordered::Task;
use super::work::run_task;
use crate::cli::Bar;
use crate::live::{RawTerminal, ScreenState, SharedTerminal, TerminalOperator};
use host_core::calibration::{
    Auto, CalibrationOutcome, Operator, OperatorLoss, OperatorNotice, Order, View,
};
use host_core::link::Interruption;
use std::sync::Mutex;

/// Stands in for the operator on a simulator: answers automatically, and advances the progress bar.
pub struct ProgressOperator<'a> {
    bar: &'a Bar,
}

impl<'a> ProgressOperator<'a> {
    pub const fn new(bar: &'a Bar) -> Self {
        Self { bar }
    }
}

impl Operator for ProgressOperator<'_> {
    fn orders(&mut self, view: &View) -> Result<Vec<Order>, OperatorLoss> {
        Auto.orders(view)
    }

    fn notify(&mut self, _told: OperatorNotice<'_>, view: &View) {
        let before = view.electrode.saturating_sub(1) as f64;
        self.bar.set(before / view.of.max(1) as f64);
    }
}

/// Calibrates with orders from a person at the terminal. One thread draws; another reads keys and
/// talks to the device, so that a slow terminal never delays the device.
///
/// # Errors
/// Returns the errors of [`run_task`], or fails if the terminal cannot be used.
pub fn calibrate_at_terminal(
    args: &CalibrateArgs,
    task: &Task,
    interruption: &Interruption,
) -> anyhow::Result<CalibrationOutcome> {
    let sitting = Mutex::new(SharedTerminal::new(ScreenState {
        wearer: task.wearer().to_owned(),
        device: args.device.to_string(),
        ..ScreenState::default()
    }));
    let mut seat = RawTerminal::open()?;
    let (seated, worked) = std::thread::scope(|scope| {
        let sitting = &sitting;
        let worker = scope.spawn(move || {
            let interruption = interruption.clone();
            let mut operator = TerminalOperator {
                sitting,
                interruption: interruption.clone(),
            };
            run_task(args, task, &interruption, &mut operator)
        });
        (
            seat.draw_until(sitting, || worker.is_finished()),
            worker.join(),
        )
    });
    drop(seat);
    let worked = worked.unwrap_or_else(|panic| std::panic::resume_unwind(panic))?;
    seated?;
    Ok(worked)
}
