//! Execution context of the Controller: an executor in an interrupt that the refill triggers every
//! fourth window, independently of the async timer.

use super::InterruptPriority;
use super::pac::Interrupt;
use super::watchdog::{self, Owner};
use crate::device::{Controller, ControllerMail, MuscleTables};
use crate::units::Micros;
use cortex_m::peripheral::NVIC;
use embassy_executor::{InterruptExecutor, SpawnError};
use embassy_stm32::interrupt;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;

/// Inputs of a control tick.
#[derive(Clone, Copy, Debug)]
pub struct Tick {
    /// Device time of the refill that started the tick.
    pub now: Micros,
    /// Latest joint angle sampled since the last tick, in counts of the ADC.
    pub angle: Option<u16>,
}

/// Signal from the refill to the control tick. If a tick overruns, only the oldest signal is lost;
/// the watchdog detects ticks that stop.
pub static TICK: Signal<CriticalSectionRawMutex, Tick> = Signal::new();

/// Signal from the control tick to the session: the controller has posted its messages.
pub static TOLD: Signal<CriticalSectionRawMutex, ()> = Signal::new();

static EXECUTOR: InterruptExecutor = InterruptExecutor::new();

/// Starts `controller`, with its muscles' `tables`, in the interrupt of TIM7, a timer that is not otherwise used.
///
/// # Errors
/// Fails if the task exists already.
pub fn start(
    controller: &'static mut Controller,
    tables: &'static mut MuscleTables,
    mail: ControllerMail<'static>,
    nvic: &mut NVIC,
) -> Result<(), SpawnError> {
    // SAFETY: no critical section relies on this priority.
    unsafe { nvic.set_priority(Interrupt::TIM7, InterruptPriority::Control as u8) };
    EXECUTOR
        .start(Interrupt::TIM7)
        .spawn(run(controller, tables, mail)?);
    Ok(())
}

#[interrupt]
fn TIM7() {
    // SAFETY: this is the only call, and only `start` unmasks the interrupt.
    unsafe { EXECUTOR.on_interrupt() }
}

#[embassy_executor::task]
async fn run(
    controller: &'static mut Controller,
    tables: &'static mut MuscleTables,
    mut mail: ControllerMail<'static>,
) {
    loop {
        let tick = TICK.wait().await;
        controller.tick(tick.now, tick.angle, tables, &mut mail);
        watchdog::check_in(Owner::Controller);
        TOLD.signal(());
    }
}
