//! What runs when the program can no longer be trusted: outputs safe first,
//! then the record in the backup registers, then a reset.

use super::pac::{PWR, RCC};
use super::{record, tape, timebase};
use crate::safety::{Fault, FaultRecord};
use core::panic::PanicInfo;
use cortex_m::peripheral::{MPU, SCB};
use cortex_m_rt::{ExceptionFrame, exception};

/// Isolates, records `fault` with `detail`, resets.
pub fn reset_with(fault: Fault, detail: u32) -> ! {
    isolate_and_record(fault, detail);
    SCB::sys_reset()
}

/// The residual charge of truncated pulses is unknown here, recorded as zero.
fn isolate_and_record(fault: Fault, detail: u32) {
    cortex_m::interrupt::disable();
    tape::stop();
    record::keep(&FaultRecord::new(fault, timebase::now()), detail);
}

/// A panic's detail is its line.
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

// SAFETY: entered with the state of the program unknown; touches registers
// only, and never returns.
#[exception]
unsafe fn HardFault(frame: &ExceptionFrame) -> ! {
    tape::stop();
    // SAFETY: reading the fault status of this core.
    let status = unsafe { (*SCB::PTR).cfsr.read() };
    // MLSPERR, MSTKERR, DACCVIOL (ARMv7-M B3.2.15): the only region that denies
    // access is the stack guard.
    if status & 0b11_0010 != 0 {
        reset_with(Fault::StackGuard, status)
    }
    reset_with(Fault::Panic, frame.pc())
}

// SAFETY: as HardFault.
#[exception]
unsafe fn DefaultHandler(number: i16) {
    reset_with(Fault::Panic, u32::from(number.cast_unsigned()))
}

/// The only source of NMI enabled here is clock security: HSE failed, the
/// core now runs from HSI (RM0090 section 7.2.7). Also a stop of the clock
/// that TIM1 counts, so pulses would be ten times too long.
// SAFETY: as HardFault.
#[exception]
unsafe fn NonMaskableInt() {
    tape::stop();
    RCC.cir().modify(|w| w.set_cssc(true));
    reset_with(Fault::ClockFailure, 0)
}

/// The supply fell below the threshold; 0 V is some hundred µs away.
pub fn supply_fell() -> ! {
    reset_with(Fault::BrownOut, PWR.csr1().read().0)
}

/// Denies every access to the 32 bytes above the statics, where an overflowing
/// stack arrives first. Faults escalate to `HardFault`, which runs without the
/// MPU (HFNMIENA = 0) and so has a stack for its few words.
pub fn guard_stack(mpu: &mut MPU) {
    unsafe extern "C" {
        static __sheap: u32;
    }
    // The first 32-byte boundary at or above the end of the statics.
    let base = ((&raw const __sheap) as u32).next_multiple_of(32);
    // ARMv7-M B3.5: region 0, execute never, no access, size 2^(4+1), enable;
    // PRIVDEFENA leaves the default map in force elsewhere.
    // SAFETY: no reference points above the statics except the stack, whose
    // use of this region is what must fault.
    unsafe {
        mpu.rnr.write(0);
        mpu.rbar.write(base);
        mpu.rasr.write(1 << 28 | 4 << 1 | 1);
        mpu.ctrl.write(1 << 2 | 1);
    }
    cortex_m::asm::dsb();
    cortex_m::asm::isb();
}
