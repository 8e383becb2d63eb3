//! A march over all of SRAM1 and SRAM2 at each reset, before a variable has a value:
//! March C− (van de Goor 1991), {⇕(w0); ⇑(r0,w1); ⇑(r1,w0); ⇓(r0,w1); ⇓(r1,w0); ⇕(r0)},
//! by words. It finds cells that are stuck or do not turn, wrong address decoding, and
//! coupling between words; not coupling between the bits of one word, which would take
//! five more backgrounds, nor what fades with time.
//!
//! Registers only: no stack, no variables. RAM is all 0 after it. What fails ends here: no
//! pin was ever configured, so the outputs are isolated as reset leaves them. The record
//! of it is made on a stack in CCM, which nothing else uses.

use super::record;
use crate::safety::{Fault, FaultRecord};
use crate::units::Micros;
use core::arch::global_asm;

// cortex-m-rt calls `__pre_init` first of all; LR is where it goes on.
global_asm!(
    ".section .text.__pre_init,\"ax\",%progbits",
    ".global __pre_init",
    ".type __pre_init,%function",
    ".thumb_func",
    "__pre_init:",
    "mov r12, lr",
    "movs r4, #0x20000000", // SRAM1 and SRAM2: 128 KiB (RM0090 section 2.3.1)
    "add r5, r4, #0x20000",
    "movs r8, #0",
    "mvn r9, r8",
    // Upwards w0.
    "mov r0, r4",
    "0: .rept 8",
    "str r8, [r0], #4",
    ".endr",
    "cmp r0, r5",
    "bne 0b",
    "mov r6, r8",
    "mov r7, r9",
    "bl 1f", // upwards r0, w1
    "mov r6, r9",
    "mov r7, r8",
    "bl 1f", // upwards r1, w0
    "mov r6, r8",
    "mov r7, r9",
    "bl 3f", // downwards r0, w1
    "mov r6, r9",
    "mov r7, r8",
    "bl 3f", // downwards r1, w0
    "mov r6, r8",
    "mov r7, r8",
    "bl 1f", // upwards r0
    "bx r12",
    // Upwards: reads R6, writes R7.
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
    // Downwards.
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
    // R0 is where. The compiler may use the FPU: CPACR (ARMv7-M B3.2.20).
    "5: movw r2, #0xED88",
    "movt r2, #0xE000",
    "ldr r3, [r2]",
    "orr r3, r3, #0xF00000",
    "str r3, [r2]",
    "dsb",
    "isb",
    "movw r2, #0",
    "movt r2, #0x1001", // one past CCM, which reset leaves clocked (section 7.3.10)
    "mov sp, r2",
    "b {failed}",
    ".size __pre_init, . - __pre_init",
    failed = sym failed,
);

/// The word at `address` does not keep what is written. Only power, or the reset pin, tries
/// again.
extern "C" fn failed(address: u32) -> ! {
    record::keep(&FaultRecord::new(Fault::Ram, Micros::new(0)), address);
    loop {
        cortex_m::asm::wfi();
    }
}
