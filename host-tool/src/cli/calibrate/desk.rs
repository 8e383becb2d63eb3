//! An operator at the terminal, or the one that stands in for them.

use super::CalibrateArgs;
use super::ordered::Task;
use super::work::{Worked, work};
use crate::cli::Bar;
use crate::live::{Behind, Sight, sit};
use host_core::calibration::{Auto, Gone, Operator, Order, OrderError, Told, View};
use host_core::link::Interruption;
use std::sync::Mutex;
use std::sync::mpsc::channel;

/// Stands in for a person, and moves the bar on.
pub struct Watched<'a> {
    bar: &'a Bar,
}

impl<'a> Watched<'a> {
    /// Of this bar.
    pub const fn new(bar: &'a Bar) -> Self {
        Self { bar }
    }
}

impl Operator for Watched<'_> {
    fn order(&mut self, view: &View) -> Result<Option<Result<Order, OrderError>>, Gone> {
        Auto.order(view)
    }

    fn tell(&mut self, _told: Told<'_>, view: &View) {
        let before = view.electrode.saturating_sub(1) as f64;
        self.bar.set(before / view.of.max(1) as f64);
    }
}

/// A person at the terminal orders: one thread draws and takes keys, another is at the
/// device, so that a slow terminal never keeps it waiting.
///
/// # Errors
/// As [`work`], or the terminal.
pub fn at_the_terminal(
    args: &CalibrateArgs,
    task: &Task,
    interruption: &Interruption,
) -> anyhow::Result<Worked> {
    let sight = Mutex::new(Sight {
        wearer: task.wearer().to_owned(),
        device: args.device.to_string(),
        ..Sight::default()
    });
    let (to, orders) = channel();
    let (seated, worked) = std::thread::scope(|scope| {
        let sight = &sight;
        let worker = scope.spawn(move || {
            let mut operator = Behind { sight, orders };
            work(args, task, interruption, &mut operator)
        });
        let seated = sit(sight, &to, || worker.is_finished());
        // Nobody orders any more: the device is stopped.
        drop(to);
        (seated, worker.join())
    });
    let worked = worked.unwrap_or_else(|panic| std::panic::resume_unwind(panic))?;
    seated?;
    Ok(worked)
}
