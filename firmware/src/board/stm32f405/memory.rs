//! What the program may do with memory, held by the MPU (ARMv7-M B3.5): without a
//! region, nothing. Constants and code cannot be written, data and registers cannot be
//! executed, and a stray pointer meets a fault, not a register.
//!
//! Vectors and the private bus (NVIC, SCB, DBGMCU) keep the default map; so does
//! `HardFault`, which runs without the MPU (HFNMIENA = 0) and so has a stack for its few
//! words; one that is lost on the tape has them on the lines for the microsecond until it
//! isolates.

use core::sync::atomic::{Ordering, compiler_fence};
use cortex_m::asm::{dsb, isb};
use cortex_m::peripheral::MPU;

/// MPU_RASR (ARMv7-M B3.5.9): execute never.
const NO_EXECUTE: u32 = 1 << 28;
/// AP: read and write; read only.
const READ_WRITE: u32 = 0b011 << 24;
const READ_ONLY: u32 = 0b110 << 24;
/// TEX, C, B as the default map has them (B3.1): flash write-through, RAM write-back and
/// not shared, as exclusive accesses want it, registers device memory.
const FLASH: u32 = 0b10 << 16;
const RAM: u32 = 0b1 << 19 | 0b11 << 16;
const DEVICE: u32 = 0b01 << 16;
/// SRD: the region leaves its last eighth to others.
const LAST_EIGHTH_OFF: u32 = 1 << 15;
const ENABLE: u32 = 1;

/// Base, log2 of the bytes, and what MPU_RASR says beside (RM0090 section 2.3).
const REGIONS: [(u32, u32, u32); 5] = [
    // Code, constants and the stage table, 1 MiB.
    (0x0800_0000, 20, READ_ONLY | FLASH),
    // SRAM1, 112 KiB: seven eighths of 128.
    (
        0x2000_0000,
        17,
        READ_WRITE | NO_EXECUTE | RAM | LAST_EIGHTH_OFF,
    ),
    // APB1, APB2, and of AHB1 what lies below OTG_HS, 256 KiB.
    (0x4000_0000, 18, READ_WRITE | NO_EXECUTE | DEVICE),
    // OTG_FS, 256 KiB.
    (0x5000_0000, 18, READ_WRITE | NO_EXECUTE | DEVICE),
    // The chip's number (section 39.1), which system memory surrounds.
    (0x1FFF_7A00, 5, READ_ONLY | NO_EXECUTE | FLASH),
];

/// The tape (memory.x); the other 12 KiB of SRAM2 are nobody's. Only who has
/// [`writable_tape`] writes here: what a lost pointer or stack wrote would be played.
const TAPE: (u32, u32, u32) = (0x2001_C000, 12, READ_ONLY | NO_EXECUTE | RAM);

/// Bytes of the stack guard, as log2.
const GUARD: u32 = 5;

/// Puts the regions in force. The last, which goes before the others, denies all access to
/// the 32 bytes above the statics, where an overflowing stack arrives first.
pub fn protect(mpu: &mut MPU) {
    let guard = (guard(), GUARD, NO_EXECUTE);
    let regions = REGIONS.into_iter().chain([TAPE, guard]);
    for (number, (base, log2_bytes, attributes)) in (0..).zip(regions) {
        // SAFETY: the regions allow what the program does: no reference points above the
        // statics except the stack, whose use of the guard is what must fault, and to the tape.
        unsafe {
            mpu.rnr.write(number);
            mpu.rbar.write(base);
            mpu.rasr.write(attributes | size(log2_bytes));
        }
    }
    // The tape's stays selected. PRIVDEFENA = 0.
    // SAFETY: as above.
    unsafe {
        mpu.rnr.write(REGIONS.len() as u32); // 5
        mpu.ctrl.write(ENABLE);
    }
    dsb();
    isb();
}

/// SIZE of MPU_RASR, and that the region is in force.
const fn size(log2_bytes: u32) -> u32 {
    (log2_bytes - 1) << 1 | ENABLE // 5 to 20
}

/// The tape can be written as long as this lives.
pub struct WritableTape(());

/// Lets the tape be written.
///
/// # Safety
/// The caller must not be preempted by another that asks, and [`protect`] must have been.
pub unsafe fn writable_tape() -> WritableTape {
    // SAFETY: the caller's promise.
    unsafe { set_tape(READ_WRITE) };
    dsb();
    isb();
    WritableTape(())
}

impl Drop for WritableTape {
    fn drop(&mut self) {
        compiler_fence(Ordering::SeqCst);
        // SAFETY: as it was before; in force at the interrupt's end at the latest.
        unsafe { set_tape(READ_ONLY) };
    }
}

/// # Safety
/// As of [`writable_tape`].
unsafe fn set_tape(access: u32) {
    let (_, log2_bytes, _) = TAPE;
    let attributes = access | NO_EXECUTE | RAM | size(log2_bytes);
    // SAFETY: a register of this core, of the region that `protect` left selected.
    unsafe { (*MPU::PTR).rasr.write(attributes) };
}

/// Takes them out of force, for what writes flash and runs from RAM.
///
/// # Safety
/// A reset must follow.
pub unsafe fn open() {
    // SAFETY: a register of this core.
    unsafe { (*MPU::PTR).ctrl.write(0) };
    dsb();
    isb();
}

/// Whether `address` lies in the stack guard.
pub fn is_guard(address: u32) -> bool {
    address.wrapping_sub(guard()) < 1 << GUARD
}

/// The first boundary of the guard's size at or above the end of the statics.
fn guard() -> u32 {
    unsafe extern "C" {
        static __sheap: u32;
    }
    ((&raw const __sheap) as u32).next_multiple_of(1 << GUARD)
}
