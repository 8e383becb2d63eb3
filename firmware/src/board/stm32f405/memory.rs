//! What the program may do with memory, held by the MPU (ARMv7-M B3.5): without a
//! region, nothing. Constants and code cannot be written, data and registers cannot be
//! executed, and a stray pointer meets a fault, not a register.
//!
//! Vectors and the private bus (NVIC, SCB, DBGMCU) keep the default map; so does
//! `HardFault`, which runs without the MPU (HFNMIENA = 0) and so has a stack for its few
//! words.

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
const ENABLE: u32 = 1;

/// Base, log2 of the bytes, and what MPU_RASR says beside (RM0090 section 2.3).
const REGIONS: [(u32, u32, u32); 5] = [
    // Code, constants and the stage table, 1 MiB.
    (0x0800_0000, 20, READ_ONLY | FLASH),
    // SRAM1 and SRAM2, 128 KiB.
    (0x2000_0000, 17, READ_WRITE | NO_EXECUTE | RAM),
    // APB1, APB2, and of AHB1 what lies below OTG_HS, 256 KiB.
    (0x4000_0000, 18, READ_WRITE | NO_EXECUTE | DEVICE),
    // OTG_FS, 256 KiB.
    (0x5000_0000, 18, READ_WRITE | NO_EXECUTE | DEVICE),
    // The chip's number (section 39.1), which system memory surrounds.
    (0x1FFF_7A00, 5, READ_ONLY | NO_EXECUTE | FLASH),
];

/// Bytes of the stack guard, as log2.
const GUARD: u32 = 5;

/// Puts the regions in force. The last, which goes before the others, denies all access to
/// the 32 bytes above the statics, where an overflowing stack arrives first.
pub fn protect(mpu: &mut MPU) {
    let guard = (guard(), GUARD, NO_EXECUTE);
    let regions = REGIONS.into_iter().chain([guard]);
    for (number, (base, log2_bytes, attributes)) in (0..).zip(regions) {
        // SAFETY: the regions allow what the program does: no reference points above the
        // statics except the stack, whose use of the guard is what must fault.
        unsafe {
            mpu.rnr.write(number);
            mpu.rbar.write(base);
            mpu.rasr.write(attributes | (log2_bytes - 1) << 1 | ENABLE);
        }
    }
    // PRIVDEFENA = 0.
    // SAFETY: as above.
    unsafe { mpu.ctrl.write(ENABLE) };
    dsb();
    isb();
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
