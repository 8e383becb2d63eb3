//! March test of all of SRAM1, SRAM2 and CCM at each reset, before any variable is initialised: March C−
//! (van de Goor 1991), {⇕(w0); ⇑(r0,w1); ⇑(r1,w0); ⇓(r0,w1); ⇓(r1,w0); ⇕(r0)}, by words. It finds
//! stuck cells, cells that cannot change, wrong address decoding, and coupling between words. It
//! does not find coupling between the bits of one word, which would take five more backgrounds, or
//! data loss over time.
//!
//! The test uses registers only, no stack and no variables. Afterwards RAM is all 0. On a failure
//! the program ends here: no pin was ever configured, so the outputs are disconnected as after
//! reset. The fault is recorded with a stack in the memory that did not fail.

use super::bring_up::{self, Failure};
use super::{pins, record};
use crate::board::wiring::BOARD;
use crate::safety::{Fault, FaultRecord};
use crate::units::Micros;
use core::arch::global_asm;

// cortex-m-rt calls `__pre_init` first; LR holds the return address.
global_asm!(
    ".section .text.__pre_init,\"ax\",%progbits",
    ".global __pre_init",
    ".type __pre_init,%function",
    ".thumb_func",
    "__pre_init:",
    "mov r12, lr",
    // A boot loader may have started the image with the PLL on, or with other memory at 0: resets
    // once more, so that the image always starts from the reset state. RCC_CFGR.SWS (RM0090 section
    // 7.3.3), SYSCFG_MEMRMP.MEM_MODE (section 9.2.1).
    "movw r0, #0x3800",
    "movt r0, #0x4002",
    "ldr r1, [r0, #0x08]",
    "tst r1, #0xC",
    "bne 8f",
    "ldr r1, [r0, #0x44]",
    "orr r2, r1, #0x4000", // APB2ENR.SYSCFGEN
    "str r2, [r0, #0x44]",
    "ldr r2, [r0, #0x44]", // ES0182: delay after clock enabling
    "movw r2, #0x3800",
    "movt r2, #0x4001",
    "ldr r3, [r2]",
    "str r1, [r0, #0x44]",
    "tst r3, #3",
    "bne 8f",
    #[cfg(feature = "breadboard")]
    "bl enter_boot_loader",
    "mov r4, #0x20000000", // SRAM1 and SRAM2: 128 KiB (RM0090 section 2.3.1)
    "add r5, r4, #0x20000",
    "movs r8, #0",
    "mvn r9, r8",
    // Upwards: write 0.
    "6: mov r0, r4",
    "0: .rept 8",
    "str r8, [r0], #4",
    ".endr",
    "cmp r0, r5",
    "bne 0b",
    "mov r6, r8",
    "mov r7, r9",
    "bl 1f", // upwards: read 0, write 1
    "mov r6, r9",
    "mov r7, r8",
    "bl 1f", // upwards: read 1, write 0
    "mov r6, r8",
    "mov r7, r9",
    "bl 3f", // downwards: read 0, write 1
    "mov r6, r9",
    "mov r7, r8",
    "bl 3f", // downwards: read 1, write 0
    "mov r6, r8",
    "mov r7, r8",
    "bl 1f", // upwards: read 0
    "cmp r4, #0x10000000",
    "it eq",
    "bxeq r12",
    "mov r4, #0x10000000", // CCM: 64 KiB, whose clock is on after reset (section 7.3.10)
    "add r5, r4, #0x10000",
    "b 6b",
    // Upwards: compares with R6, writes R7.
    "1: mov r0, r4",
    "2: .rept 8",
    "ldr r1, [r0]",
    "cmp r1, r6",
    "bne 5f",
    "str r7, [r0], #4",
    ".endr",
    "cmp r0, r5",
    "bne 2b",
    "bx lr",
    // Downwards: compares with R6, writes R7.
    "3: mov r0, r5",
    "4: .rept 8",
    "ldr r1, [r0, #-4]!",
    "cmp r1, r6",
    "bne 5f",
    "str r7, [r0]",
    ".endr",
    "cmp r0, r4",
    "bne 4b",
    "bx lr",
    // R0 holds the address of the failure. The compiler may use the FPU, so this enables it: CPACR
    // (ARMv7-M B3.2.20).
    "5: movw r2, #0xED88",
    "movt r2, #0xE000",
    "ldr r3, [r2]",
    "orr r3, r3, #0xF00000",
    "str r3, [r2]",
    "dsb",
    "isb",
    // The stack: CCM, or, if the failure is there, SRAM1.
    "tst r0, #0x20000000",
    "ite ne",
    "movne r2, #0x10000000",
    "moveq r2, #0x20000000",
    "add r2, #0x10000",
    "mov sp, r2",
    "b {failed}",
    // AIRCR: VECTKEY, SYSRESETREQ (ARMv7-M B3.2.6).
    "8: movw r0, #0xED0C",
    "movt r0, #0xE000",
    "movw r1, #4",
    "movt r1, #0x05FA",
    "dsb",
    "str r1, [r0]",
    "dsb",
    "9: b 9b",
    ".size __pre_init, . - __pre_init",
    failed = sym failed,
);

/// Records that the word at `address` does not keep its value, and stops. Only a power cycle or the
/// reset pin starts the chip again.
extern "C" fn failed(address: u32) -> ! {
    record::keep(&FaultRecord {
        detail: address,
        ..FaultRecord::new(Fault::Ram, Micros::new(0))
    });
    if BOARD.breadboard.is_some() {
        pins::init_inputs();
        bring_up::blink(Failure::Ram);
    }
    loop {
        cortex_m::asm::wfi();
    }
}
