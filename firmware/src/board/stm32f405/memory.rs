//! Memory protection: the regions of the MPU (ARMv7-M B3.5).
//!
//! The program has no access to an address outside every region. Code and constants
//! cannot be written, and data and registers cannot be executed. An access through a stray
//! pointer causes a fault instead of changing a register.
//!
//! Vector reads and the private peripheral bus (NVIC, SCB, DBGMCU) use the default memory
//! map. So does `HardFault`, which runs with the MPU off (HFNMIENA = 0): it can stack a few
//! words even after a stack overflow. If the stack pointer has strayed into the
//! pulse tape, those words appear on the output lines for the microsecond until the handler
//! disconnects the outputs.

use crate::device::MuscleTables;
use core::sync::atomic::{Ordering, compiler_fence};
use cortex_m::asm::{dsb, isb};
use cortex_m::peripheral::MPU;

/// XN in MPU_RASR (ARMv7-M B3.5.9): the region cannot be executed.
const NO_EXECUTE: u32 = 1 << 28;
/// AP in MPU_RASR: reads and writes are allowed.
const READ_WRITE: u32 = 0b011 << 24;
/// AP in MPU_RASR: only reads are allowed.
const READ_ONLY: u32 = 0b110 << 24;
/// TEX, C and B of flash, as in the default map (B3.1): write-through.
const FLASH: u32 = 0b10 << 16;
/// TEX, C and B of RAM, as in the default map: write-back, and not shared, which exclusive
/// accesses require.
const RAM: u32 = 0b1 << 19 | 0b11 << 16;
/// TEX, C and B of registers, as in the default map: device memory.
const DEVICE: u32 = 0b01 << 16;
/// SRD in MPU_RASR: the last eighth of the addresses does not belong to the region.
const LAST_EIGHTH_OFF: u32 = 1 << 15;
/// The same of the last three eighths.
const LAST_THREE_EIGHTHS_OFF: u32 = 0b111 << 13;
/// ENABLE in MPU_RASR (this region) and in MPU_CTRL (the whole MPU).
const ENABLE: u32 = 1;

/// Base address, log2 of the size in bytes, and attributes for MPU_RASR of each fixed region
/// (memory map: RM0090 section 2.3).
const REGIONS: [(u32, u32, u32); 6] = [
    // Code, constants and the stage table, 1 MiB.
    (0x0800_0000, 20, READ_ONLY | FLASH),
    // SRAM1, 112 KiB: seven eighths of 128 KiB.
    (
        0x2000_0000,
        17,
        READ_WRITE | NO_EXECUTE | RAM | LAST_EIGHTH_OFF,
    ),
    // The part of CCM with the muscles' tables, 40 KiB: five eighths of 64 KiB.
    (
        0x1000_0000,
        16,
        READ_WRITE | NO_EXECUTE | RAM | LAST_THREE_EIGHTHS_OFF,
    ),
    // APB1, APB2, and AHB1 up to OTG_HS, 256 KiB.
    (0x4000_0000, 18, READ_WRITE | NO_EXECUTE | DEVICE),
    // OTG_FS, 256 KiB.
    (0x5000_0000, 18, READ_WRITE | NO_EXECUTE | DEVICE),
    // The unique device ID (section 39.1), 32 bytes within system memory.
    (0x1FFF_7A00, 5, READ_ONLY | NO_EXECUTE | FLASH),
];

// Nothing else is in CCM.
const _: () = assert!(size_of::<MuscleTables>() <= 40 * 1024);

/// Region of the pulse tape (memory.x), in the form of [`REGIONS`].
///
/// The tape is read-only unless a [`WritableTape`] exists, because DMA would output any word
/// that a stray pointer or stack wrote there. No region covers the other 12 KiB of SRAM2.
const TAPE: (u32, u32, u32) = (0x2001_C000, 12, READ_ONLY | NO_EXECUTE | RAM);

/// Size of the stack guard in bytes, as log2.
const GUARD: u32 = 5;

/// Configures the regions and enables the MPU.
///
/// The last region is the stack guard. It takes precedence over the others and denies all
/// access to 32 bytes above the statics, which an overflowing stack reaches first.
pub fn protect(mpu: &mut MPU) {
    let guard = (guard(), GUARD, NO_EXECUTE);
    let regions = REGIONS.into_iter().chain([TAPE, guard]);
    for (number, (base, log2_bytes, attributes)) in (0..).zip(regions) {
        // SAFETY: the regions allow every access of the program. Above the statics, only
        // references to the stack and to the tape exist, and an access of the stack to the
        // guard must fault.
        unsafe {
            mpu.rnr.write(number);
            mpu.rbar.write(base);
            mpu.rasr.write(attributes | size(log2_bytes));
        }
    }
    // Region 6, the tape's, stays selected for `set_tape`. PRIVDEFENA is 0.
    // SAFETY: as above.
    unsafe {
        mpu.rnr.write(REGIONS.len() as u32); // the tape's region
        mpu.ctrl.write(ENABLE);
    }
    dsb();
    isb();
}

/// SIZE and ENABLE fields of MPU_RASR for a region of 2^`log2_bytes` bytes.
const fn size(log2_bytes: u32) -> u32 {
    (log2_bytes - 1) << 1 | ENABLE // log2_bytes is 5 to 20
}

/// Guard during whose lifetime the pulse tape can be written; see [`writable_tape`].
pub struct WritableTape(());

/// Makes the pulse tape writable until the returned guard is dropped.
///
/// # Safety
/// [`protect`] must have been called before, and no other caller of this function may preempt
/// the current one.
pub unsafe fn writable_tape() -> WritableTape {
    // SAFETY: guaranteed by the caller.
    unsafe { set_tape(READ_WRITE) };
    dsb();
    isb();
    WritableTape(())
}

impl Drop for WritableTape {
    fn drop(&mut self) {
        compiler_fence(Ordering::SeqCst);
        // SAFETY: this restores the access rights that `protect` set. They take effect at the end
        // of the interrupt at the latest.
        unsafe { set_tape(READ_ONLY) };
    }
}

/// Sets the access to the pulse tape, [`READ_WRITE`] or [`READ_ONLY`].
///
/// # Safety
/// The conditions of [`writable_tape`] apply.
unsafe fn set_tape(access: u32) {
    let (_, log2_bytes, _) = TAPE;
    let attributes = access | NO_EXECUTE | RAM | size(log2_bytes);
    // SAFETY: this register belongs to this core and applies to the region that `protect`
    // left selected, the tape's.
    unsafe { (*MPU::PTR).rasr.write(attributes) };
}

/// Disables the MPU, so that a function in RAM can write to flash.
///
/// # Safety
/// The caller must reset the chip afterwards.
#[cfg(not(feature = "breadboard"))]
pub unsafe fn open() {
    // SAFETY: this register belongs to this core.
    unsafe { (*MPU::PTR).ctrl.write(0) };
    dsb();
    isb();
}

/// Returns whether `address` is within the 32 bytes of the stack guard.
pub fn is_guard(address: u32) -> bool {
    address.wrapping_sub(guard()) < 1 << GUARD
}

/// Address of the stack guard: the end of the statics, rounded up to the guard's size.
fn guard() -> u32 {
    unsafe extern "C" {
        static __sheap: u32;
    }
    ((&raw const __sheap) as u32).next_multiple_of(1 << GUARD)
}
