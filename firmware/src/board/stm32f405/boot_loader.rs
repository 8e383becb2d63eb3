//! Entry into the chip's boot loader, which writes another image by USB DFU (AN2606).
//!
//! A running program cannot jump there: the MPU forbids it, pins are locked, and nothing stops the
//! watchdog. So a request is one word in a backup register, followed by a reset. The reset handler
//! clears the word in any case, and enters the boot loader only after a reset by software, before
//! it touches RAM, MPU or pins: the boot loader finds the chip as after reset.
//!
//! Only a breadboard has this module.

use super::record;
use core::arch::global_asm;

/// "BOOT": enter the boot loader.
const WORD: u32 = u32::from_be_bytes(*b"BOOT");

/// Asks the next boot to enter the boot loader, if it follows a reset by software.
pub fn request() {
    record::unlock();
    record::write(record::REQUEST, WORD);
}

// Called with `bl` by `__pre_init`; uses R0 to R4 and no stack.
global_asm!(
    ".section .text.enter_boot_loader,\"ax\",%progbits",
    ".global enter_boot_loader",
    ".type enter_boot_loader,%function",
    ".thumb_func",
    "enter_boot_loader:",
    "movw r0, #0x3800", // RCC
    "movt r0, #0x4002",
    "ldr r1, [r0, #0x40]", // APB1ENR.PWREN, for the backup registers (RM0090 section 7.3.13)
    "orr r2, r1, #0x10000000",
    "str r2, [r0, #0x40]",
    "ldr r2, [r0, #0x40]", // ES0182: delay after clock enabling
    "movw r2, #{request}",
    "movt r2, #0x4000",
    "ldr r3, [r2]",
    "movw r4, #{low}",
    "movt r4, #{high}",
    "cmp r3, r4",
    "bne 1f",
    "movw r3, #0x7000", // PWR_CR.DBP
    "movt r3, #0x4000",
    "ldr r4, [r3]",
    "orr r4, r4, #0x100",
    "str r4, [r3]",
    "ldr r4, [r3]",
    "movs r4, #0",
    "str r4, [r2]", // clears the word, whatever follows
    "ldr r4, [r2]",
    "ldr r4, [r3]",
    "bic r4, r4, #0x100",
    "str r4, [r3]",
    "str r1, [r0, #0x40]",
    "ldr r1, [r0, #0x74]", // CSR: SFTRSTF, and no other cause but the pin (section 7.3.21)
    "lsrs r1, r1, #25",
    "bic r1, r1, #2", // PINRSTF comes with every reset
    "cmp r1, #8",
    "bne 2f",
    "ldr r1, [r0, #0x44]", // SYSCFG_MEMRMP: system memory at 0, where its vectors are expected
    "orr r1, r1, #0x4000",
    "str r1, [r0, #0x44]",
    "ldr r1, [r0, #0x44]",
    "movw r1, #0x3800",
    "movt r1, #0x4001",
    "movs r2, #1",
    "str r2, [r1]",
    "movw r1, #0xED08", // VTOR, which cortex-m-rt has set (ARMv7-M B3.2.5)
    "movt r1, #0xE000",
    "movs r2, #0",
    "str r2, [r1]",
    "dsb",
    "isb",
    "movw r0, #0", // system memory (section 2.4)
    "movt r0, #0x1FFF",
    "ldr r1, [r0]",
    "msr msp, r1",
    "ldr r0, [r0, #4]",
    "bx r0",
    "1: str r1, [r0, #0x40]",
    "2: bx lr",
    ".size enter_boot_loader, . - enter_boot_loader",
    request = const 0x2850 + 4 * record::REQUEST, // RTC_BKP0R is at 0x4000_2850
    low = const WORD & 0xFFFF,
    high = const WORD >> 16,
);
