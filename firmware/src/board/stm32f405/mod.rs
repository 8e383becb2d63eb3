//! Register code for stimulator boards with an STM32F405; pins, clocks and streams come from
//! [`super::wiring::BOARD`].
//!
//! `refill`, `control` and `session` are the contexts of the three owners. `tape` and `timebase`
//! play pulses; `overdue` checks that refills come in time, and `crystal` and `usb_clock` check the
//! clock. `pins`, `dac`, `adc`, `clock` and `watchdog` drive the peripherals they are named after.
//! `march` and `self_test` test the chip at boot, and `memory` sets up the MPU. `record` and
//! `emergency` handle faults, and `backup` stores the used part of a wearer's allowance. In:
//! interrupts, bytes. Out: port words, DAC codes, bytes. RM0090 is the reference manual, DS8626 the
//! data sheet, ES0182 the errata sheet.

mod adc;
mod backup;
#[cfg(feature = "breadboard")]
mod boot_loader;
mod bring_up;
mod clock;
mod control;
mod crystal;
mod dac;
mod detail;
mod emergency;
mod image_record;
mod led;
mod log;
mod march;
mod memory;
#[cfg(not(feature = "breadboard"))]
mod output_stage;
mod overdue;
mod pace;
mod pins;
mod record;
mod refill;
mod registers;
mod self_test;
mod session;
#[cfg(feature = "breadboard")]
mod simulated_stage;
#[cfg(not(feature = "breadboard"))]
mod stages;
mod tape;
mod timebase;
mod usb_bus;
mod usb_clock;
mod usb_driver;
mod wait;
mod watchdog;

use crate::board::wiring::BOARD;
use crate::device::{Controller, Identity, Mailboxes, MuscleTables, Session, first_session_number};
use crate::link::message::{OptionBytes, ResetCause};
use crate::safety::{Fault, FaultRecord};
use crate::units::Micros;
use embassy_executor::Spawner;
use embassy_stm32::pac::{self, Interrupt};
#[cfg(not(feature = "breadboard"))]
use output_stage as front_end;
use session::Port;
#[cfg(feature = "breadboard")]
use simulated_stage as front_end;
use static_cell::{ConstStaticCell, StaticCell};

/// Interrupt priorities in the NVIC, which uses the upper four bits (RM0090 section 12.1.1).
#[derive(Clone, Copy)]
#[repr(u8)]
enum InterruptPriority {
    /// Refill, over-current and supply: one priority, so that none preempts another.
    Refill = 0,
    /// The control tick.
    Control = 4 << 4,
    /// USB and the async timer.
    Bytes = 8 << 4,
}

/// Starts the board and runs the three owners forever. Faults found on the way are reported over
/// USB, with the outputs disconnected; without a clock for USB, [`bring_up`] does not return.
///
/// # Panics
/// Panics when called twice: every `expect` and static here is taken once.
pub async fn run(spawner: Spawner) -> ! {
    // Proof: only this line takes them, and `run` is called once.
    let mut core = cortex_m::Peripherals::take().expect("taken here only");
    memory::protect(&mut core.MPU);
    clock::keep_debug_bits(); // waits count cycles
    pins::init_inputs();
    let mut found_now = front_end::find_other_board();
    led::set(false);
    if found_now.is_none() {
        pins::init_outputs(); // on another board, every output stays an input
    }
    if !pins::lock() {
        found_now = found_now.or(Some((Fault::Registers, detail::NOT_LOCKED)));
    }
    let cause = record::read_reset_cause();
    log::note_reset(cause);
    let latched = latched_fault(cause);
    let (backup, used) = backup::open(cause);
    record::forget_reset_cause();
    let crystal_hz = bring_up::start_crystal();
    let peripherals = embassy_stm32::init(clock::config());
    log::note_clock();
    clock::harden(bring_up::wait_for_supply);
    for line in [Interrupt::OTG_FS, Interrupt::TIM5] {
        // SAFETY: no critical section relies on a priority.
        unsafe { core.NVIC.set_priority(line, InterruptPriority::Bytes as u8) };
    }
    // A failure found now takes precedence over a fault from an earlier run, which stays recorded.
    let found_now = found_now.map(|(fault, detail)| record::keep_found_at_boot(fault, detail));
    let latched = found_now.or_else(self_test::failure).or(latched);
    dac::init();
    adc::init();
    static MAILBOXES: ConstStaticCell<Mailboxes> = ConstStaticCell::new(Mailboxes::new());
    let (pulser_mail, controller_mail, session_mail) = MAILBOXES.take().split();
    // The owners live in statics. As arguments of tasks they would occupy memory twice, and the
    // stack on the way there.
    static CONTROLLER: StaticCell<Controller> = StaticCell::new();
    let controller = CONTROLLER.init_with(Controller::new);
    // SAFETY: only statics whose bits are all zero are in this section, and the RAM test at boot has
    // left it zero.
    #[unsafe(link_section = ".ccm")]
    static TABLES: ConstStaticCell<MuscleTables> = ConstStaticCell::new(MuscleTables::NONE);
    let tables = TABLES.take();
    let started = control::start(controller, tables, controller_mail, &mut core.NVIC);
    // Proof: the task's one slot is free, because nothing else spawns the task.
    started.expect("spawned here only");
    // SAFETY: this runs once, and no other context touches tape or pins.
    let latched = unsafe { refill::start(latched, used, pulser_mail, &mut core.NVIC, core.SYST) };
    log::note_start(latched.as_ref());
    led::set(true);
    let port = Port {
        usb: peripherals.USB_OTG_FS,
        dp: peripherals.PA12,
        dm: peripherals.PA11,
    };
    let unique_id = record::unique_id();
    let [a, b, c] = unique_id;
    // The cycle count depends on the start-up times of crystal and PLL.
    let cycles = cortex_m::peripheral::DWT::cycle_count();
    let identity = Identity {
        kind: front_end::KIND,
        unique_id,
        reset: cause,
        last_fault: latched,
        first_session: first_session_number(&[a, b, c, cycles]),
        stages: front_end::stages(unique_id),
        option_bytes: Some(OptionBytes::from_optcr(pac::FLASH.optcr().read().0)),
        board: BOARD.name,
        crystal_hz,
        has_boot_loader: front_end::HAS_BOOT_LOADER,
    };
    static SESSION: StaticCell<Session> = StaticCell::new();
    let session = SESSION.init_with(|| Session::new(identity));
    match session::serve(spawner, session, session_mail, backup, port).await {}
}

/// Returns the fault that the last run left in the backup registers, or a watchdog reset, which no
/// code could record. Not inlined, for the same reason as [`self_test::failure`].
#[inline(never)]
fn latched_fault(cause: ResetCause) -> Option<FaultRecord> {
    record::unlock();
    if cause == ResetCause::Watchdog {
        record::keep(&FaultRecord::new(Fault::Watchdog, Micros::new(0)));
    }
    record::note_boot(matches!(cause, ResetCause::PowerOn | ResetCause::BrownOut));
    record::load()
}
