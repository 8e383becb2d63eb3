//! The log: time stamps, and the lines about what a host asked for. A debug probe reads it (`cargo
//! program`), and so does the chip simulator (`--log`).
//!
//! Writing a line masks every interrupt for some microseconds, so nothing is logged while trains
//! play.

use super::pac::{RCC, TIM2};
use super::{clock, timebase};
use crate::board::wiring::BOARD;
use crate::device::Session;
use crate::link::message::ResetCause;
use crate::safety::{FaultRecord, State};
use core::sync::atomic::{AtomicU32, Ordering};
use cortex_m::peripheral::DWT;

defmt::timestamp!("{=u32:us}", time_us());

/// Core cycle at which the PLL began to clock the core; 0 before that.
static PLL_CYCLE: AtomicU32 = AtomicU32::new(0);

/// Logs the board and the `cause` of the last reset.
pub fn note_reset(cause: ResetCause) {
    let cause = match cause {
        ResetCause::PowerOn => "power on",
        ResetCause::BrownOut => "brown-out",
        ResetCause::Watchdog => "watchdog",
        ResetCause::Software => "software",
        ResetCause::Pin => "pin",
    };
    defmt::info!("{=str}: reset cause {=str}", BOARD.name, cause);
}

/// Notes that the PLL clocks the core from now on.
pub fn note_clock() {
    PLL_CYCLE.store(DWT::cycle_count(), Ordering::Relaxed);
    let mhz = timebase::CYCLES_PER_US;
    defmt::info!("the core runs at {=u32} MHz", mhz);
}

/// Logs the start of device time and the fault found at reset, if there is one.
pub fn note_start(fault: Option<&FaultRecord>) {
    match fault {
        Some(record) if record.found_at_boot => defmt::error!("device time runs, but no tape"),
        _ => defmt::info!("device time and tape run"),
    }
    if let Some(record) = fault {
        log_fault(record);
    }
}

/// Logs the record of a fault (docs/reference/errors.md lists the numbers, `detail.rs` the details).
fn log_fault(record: &FaultRecord) {
    defmt::error!(
        "fault {=u16}, detail {=u32:#x}, at {=u32:us}",
        record.fault.number(),
        record.detail,
        record.at.get()
    );
}

/// Returns the time of a line, µs: device time once it runs, which wraps after 71 minutes, and
/// before that the time since the reset handler enabled the cycle counter.
fn time_us() -> u32 {
    // TIM2 has no clock before device time starts.
    if RCC.apb1enr().read().tim2en() && TIM2.cr1().read().cen() {
        return timebase::now().get();
    }
    let (now, pll) = (DWT::cycle_count(), PLL_CYCLE.load(Ordering::Relaxed));
    let hsi_mhz = clock::HSI_HZ / 1_000_000;
    match pll {
        0 => now / hsi_mhz,
        // The sum of two quotients of 32-bit numbers by 16 and more fits.
        _ => pll / hsi_mhz + now.wrapping_sub(pll) / timebase::CYCLES_PER_US,
    }
}

/// Logs changes of the state, with the record of a fault, and refusals.
pub struct SessionLog {
    state: State,
}

impl SessionLog {
    /// Starts with the state that a log of the boot already shows.
    pub fn new(session: &Session) -> Self {
        Self {
            state: session.state(),
        }
    }

    /// Logs what has changed in `session` since the last call.
    pub fn look(&mut self, session: &mut Session) {
        let (state, refusal) = (session.state(), session.take_refusal());
        if matches!(state, State::Stimulating | State::Stopping) {
            self.state = state;
            return;
        }
        if let Some(refusal) = refusal {
            defmt::info!("refused with {=u16}: {=str}", refusal.code, refusal.field);
        }
        if state == self.state {
            return;
        }
        self.state = state;
        match (state, session.last_fault()) {
            (State::Fault, Some(record)) => log_fault(&record),
            (State::Armed, _) => defmt::info!("armed"),
            _ => defmt::info!("idle"),
        }
    }
}
