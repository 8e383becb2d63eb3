//! The Controller's context: an executor in an interrupt that the refill
//! wakes every fourth window. It does not run on the async timer.

use super::InterruptPriority;
use super::pac::Interrupt;
use super::watchdog::{self, Owner};
use crate::device::{Controller, ControllerMail};
use crate::units::Micros;
use cortex_m::peripheral::NVIC;
use embassy_executor::{InterruptExecutor, SpawnError};
use embassy_stm32::interrupt;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;

/// What a tick starts with.
#[derive(Clone, Copy, Debug)]
pub struct Tick {
    /// Device time of the refill that started it.
    pub now: Micros,
    /// Latest joint angle sampled since the last tick.
    pub angle: Option<u16>,
}

/// Refill → tick. A tick that overruns loses none but the oldest: the watchdog
/// sees to ticks that stop.
pub static TICK: Signal<CriticalSectionRawMutex, Tick> = Signal::new();

/// Tick → session: the controller has told what it has to tell.
pub static TOLD: Signal<CriticalSectionRawMutex, ()> = Signal::new();

static EXECUTOR: InterruptExecutor = InterruptExecutor::new();

/// Hands `controller` to its interrupt: TIM7's, a timer nothing here uses.
///
/// # Errors
/// The task exists already.
pub fn start(
    controller: &'static mut Controller,
    mail: ControllerMail<'static>,
    nvic: &mut NVIC,
) -> Result<(), SpawnError> {
    // SAFETY: no critical section relies on this priority.
    unsafe { nvic.set_priority(Interrupt::TIM7, InterruptPriority::Control as u8) };
    EXECUTOR
        .start(Interrupt::TIM7)
        .spawn(run(controller, mail)?);
    Ok(())
}

#[interrupt]
fn TIM7() {
    // SAFETY: only here, and only unmasked by `start`.
    unsafe { EXECUTOR.on_interrupt() }
}

#[embassy_executor::task]
async fn run(controller: &'static mut Controller, mut mail: ControllerMail<'static>) {
    loop {
        let tick = TICK.wait().await;
        controller.tick(tick.now, tick.angle, &mut mail);
        watchdog::check_in(Owner::Controller);
        TOLD.signal(());
    }
}
