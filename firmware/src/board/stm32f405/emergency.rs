//! Last actions when the program can no longer be trusted: disconnects the outputs, writes the
//! fault record to the backup registers, and resets.

use super::pac::{PWR, RCC};
use super::{memory, record, tape, timebase};
use crate::safety::{Fault, FaultRecord};
use core::panic::PanicInfo;
use cortex_m::peripheral::SCB;
use cortex_m_rt::{ExceptionFrame, exception};

/// Disconnects the outputs, records `fault` with `detail`, and resets.
pub fn reset_with(fault: Fault, detail: u32) -> ! {
    isolate_and_record(fault, detail);
    SCB::sys_reset()
}

/// Disconnects the outputs and records `fault`. The residual charge of truncated pulses is unknown
/// here and is recorded as zero.
fn isolate_and_record(fault: Fault, detail: u32) {
    cortex_m::interrupt::disable();
    tape::stop();
    record::keep(&FaultRecord {
        detail,
        ..FaultRecord::new(fault, timebase::now())
    });
}

/// The recorded detail of a panic is its line number.
#[expect(
    unused_attributes,
    reason = "inlined, no message is read, and what writes it stays out"
)]
#[inline(always)]
#[panic_handler]
fn panic(info: &PanicInfo<'_>) -> ! {
    let line = info.location().map_or(0, |l| l.line());
    isolate_and_record(Fault::Panic, line);
    let file = info.location().map_or("?", |l| l.file());
    defmt::error!("panic at {=str}:{=u32}", file, line);
    SCB::sys_reset()
}

// SAFETY: the state of the program is unknown at entry; this touches registers only, and never
// returns.
#[exception]
unsafe fn HardFault(frame: &ExceptionFrame) -> ! {
    tape::stop();
    // SAFETY: this only reads the fault status of this core.
    let (status, address) = unsafe { ((*SCB::PTR).cfsr.read(), (*SCB::PTR).mmfar.read()) };
    // ARMv7-M B3.2.15: faults while the core stacks registers have no address. An overflowing stack
    // hits its guard either that way or by an ordinary access.
    let is_guard = status & MMARVALID != 0 && memory::is_guard(address);
    if status & (MSTKERR | MLSPERR) != 0 || is_guard {
        reset_with(Fault::StackGuard, status)
    }
    if status & MEMORY_OR_BUS != 0 {
        reset_with(Fault::Access, frame.pc())
    }
    reset_with(Fault::Panic, frame.pc())
}

const MSTKERR: u32 = 1 << 4;
const MLSPERR: u32 = 1 << 5;
const MMARVALID: u32 = 1 << 7;
/// Bits of CFSR that form MMFSR and BFSR.
const MEMORY_OR_BUS: u32 = 0xFFFF;

// SAFETY: as for HardFault.
#[exception]
unsafe fn DefaultHandler(number: i16) {
    reset_with(Fault::Panic, u32::from(number.cast_unsigned()))
}

/// The clock security system is the only enabled source of NMI: HSE failed, and the core now runs
/// from HSI (RM0090 section 7.2.7). The clock that TIM1 counts would make pulses ten times too
/// long, so the outputs stop as well.
// SAFETY: as for HardFault.
#[exception]
unsafe fn NonMaskableInt() {
    tape::stop();
    RCC.cir().modify(|w| w.set_cssc(true));
    reset_with(Fault::ClockFailure, 0)
}

/// Handles a supply below the threshold, some hundred µs before 0 V.
pub fn supply_fell() -> ! {
    reset_with(Fault::BrownOut, PWR.csr1().read().0)
}
