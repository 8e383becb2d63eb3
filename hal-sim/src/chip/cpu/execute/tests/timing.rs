//! Tests cycles of short sequences where the TRM (table 3-1, section 3.3.2) gives a range or
//! nothing, with the assumptions made, and wait states. `tests/chip_cycles` tests the rest.

use super::{CODE, Machine, RAM};
use crate::chip::cpu::{Bus, Size};

/// Text, code, instructions executed, wait states of RAM and of a new line, cycles, reason.
type Case = (
    &'static str,
    &'static [u16],
    usize,
    [u32; 2],
    u64,
    &'static str,
);

#[rustfmt::skip]
const CASES: &[Case] = &[
    ("ldr r0,[r8],#4; ldr r1,[r9],#4", &[0xF858, 0x0B04, 0xF859, 0x1B04], 2, [0, 0], 3, "other base moved"),
    ("ldr r0,[r8],#4; ldr r1,[r8],#4", &[0xF858, 0x0B04, 0xF858, 0x1B04], 2, [0, 0], 4, "same base moved"),
    ("str.w r0,[r8,r2]; str.w r0,[r8,r2]", &[0xF848, 0x0002, 0xF848, 0x0002], 2, [0, 0], 4, "nothing is pipelined after a store"),
    ("ldr r0,[r8]; str r0,[r9]; ldr r1,[r8]", &[0xF8D8, 0x0000, 0xF8C9, 0x0000, 0xF8D8, 0x1000], 3, [0, 0], 5, "a store in between"),
    ("str r0,[r8,#4]!", &[0xF848, 0x0F04], 1, [0, 0], 1, "store that moves its base"),
    ("mul r2,r3,r3; ldr.w r0,[r8,r2]", &[0xFB03, 0xF203, 0xF858, 0x0002], 2, [0, 0], 4, "a product as an offset"),
    ("ldrex r0,[r8]; add r0,r0,#1; strex r1,r0,[r8]", &[0xE858, 0x0F00, 0xF100, 0x0001, 0xE848, 0x0100], 3, [0, 0], 5, "atomic increment"),
    ("ldrh r0,[r11,#2]", &[0xF8BB, 0x0002], 1, [0, 0], 2, "aligned"),
    ("str r0,[r11,#1]", &[0xF8CB, 0x0001], 1, [0, 0], 1, "the write buffer hides it"),
    ("str r0,[r11,#1]; ldr r1,[r8]", &[0xF8CB, 0x0001, 0xF8D8, 0x1000], 2, [0, 0], 5, "but the next access waits"),
    ("str r0,[r11,#1]; nop; nop; ldr r1,[r8]", &[0xF8CB, 0x0001, 0xBF00, 0xBF00, 0xF8D8, 0x1000], 4, [0, 0], 5, "unless it comes later"),
    ("b.n 1f; nop; 1: nop", &[0xE000, 0xBF00, 0xBF00], 2, [0, 0], 3, "P = 1: the target is known early"),
    ("nop; b.n 1f; nop; 1: mov.w r0,r1", &[0xBF00, 0xE000, 0xBF00, 0xEA4F, 0x0001], 3, [0, 0], 5, "a 32-bit target across words"),
    ("b.n 1f; nop; 1: mov.w r0,r1", &[0xE000, 0xBF00, 0xEA4F, 0x0001], 2, [0, 0], 3, "an aligned one"),
    ("bne.n 1f; nop; 1: nop", &[0xD100, 0xBF00, 0xBF00], 2, [0, 0], 3, "taken"),
    ("bl 1f; 1: nop", &[0xF000, 0xF800, 0xBF00], 2, [0, 0], 3, "call"),
    ("cbnz r0,1f; nop; 1: nop", &[0xB900, 0xBF00, 0xBF00], 2, [0, 0], 3, "taken"),
    ("bx r12; nop; nop", &[0x4760, 0xBF00, 0xBF00], 2, [0, 0], 4, "P = 2: the register is read later"),
    ("blx r12; nop; nop", &[0x47E0, 0xBF00, 0xBF00], 2, [0, 0], 4, "likewise"),
    ("mov pc,r12; nop; nop", &[0x46E7, 0xBF00, 0xBF00], 2, [0, 0], 4, "likewise"),
    ("movs r1,#1; it ne; addne r0,#1", &[0x2101, 0xBF18, 0x3001], 3, [0, 0], 2, "IT folded onto a 16-bit instruction"),
    ("mov.w r1,#1; it ne; addne r0,#1", &[0xF04F, 0x0101, 0xBF18, 0x3001], 3, [0, 0], 3, "not onto a 32-bit one"),
    ("movs r1,#1; it eq; addeq r0,#1", &[0x2101, 0xBF08, 0x3001], 3, [0, 0], 2, "a failed condition takes its cycle"),
    ("it ne; ldrne r0,[r8]", &[0xBF18, 0xF8D8, 0x0000], 2, [0, 0], 3, "first instruction: not folded"),
    ("dsb; dmb", &[0xF3BF, 0x8F4F, 0xF3BF, 0x8F5F], 2, [0, 0], 2, "nothing to wait for"),
    ("isb; nop", &[0xF3BF, 0x8F6F, 0xBF00], 2, [0, 0], 4, "refill"),
    ("mrs r0,primask; msr primask,r0; cpsid i; cpsie i", &[0xF3EF, 0x8010, 0xF380, 0x8810, 0xB672, 0xB662], 4, [0, 0], 8, "'1 or 2': 2"),
    ("sdiv r0,r6,r1", &[0xFB96, 0xF0F1], 1, [0, 0], 2, "least: nothing to divide"),
    ("udiv r0,r5,r12", &[0xFBB5, 0xF0FC], 1, [0, 0], 3, "divisor longer than dividend"),
    ("str.w r0,[r8]", &[0xF8C8, 0x0000], 1, [2, 0], 1, "its data phase, cycles 1 to 4, stalls the next access only"),
    ("str.w r0,[r8]; ldr.w r1,[r9]", &[0xF8C8, 0x0000, 0xF8D9, 0x1000], 2, [2, 0], 7, "the load's would begin at 2, begins at 4"),
    ("str.w r0,[r8]; nop; nop; ldr.w r1,[r9]", &[0xF8C8, 0x0000, 0xBF00, 0xBF00, 0xF8D9, 0x1000], 4, [2, 0], 7, "two instructions hide two cycles"),
    ("str.w r0,[r8]; str.w r0,[r8]", &[0xF8C8, 0x0000, 0xF8C8, 0x0000], 2, [2, 0], 4, "one entry: the second waits for the first"),
    ("str.w r0,[r8]; dsb", &[0xF8C8, 0x0000, 0xF3BF, 0x8F4F], 2, [2, 0], 4, "DSB waits for the buffer"),
    ("ldr.w r0,[r8]; ldr.w r1,[r9]", &[0xF8D8, 0x0000, 0xF8D9, 0x1000], 2, [1, 0], 5, "loads wait each time"),
    ("ldm.w r8,{r0-r3}", &[0xE898, 0x000F], 1, [2, 0], 5 + 4 * 2, "loads wait each time"),
    // The next line is requested when the fourth of eight 16-bit instructions begins (10 bytes
    // ahead reach it): cycle 3. It arrives 2 + 5 later, at 10.
    ("8 × nop", &[0xBF00; 9], 8, [0, 5], 8, "the second line is not needed"),
    ("9 × nop", &[0xBF00; 9], 9, [0, 5], 11, "it was needed at 8"),
    ("9 × nop", &[0xBF00; 9], 9, [0, 3], 9, "two wait states are hidden altogether"),
    ("b . + 32", &[0xE00E], 1, [0, 5], 7, "a branch waits for its line"),
    ("b .", &[0xE7FE], 1, [0, 5], 2, "not for the one fetched last"),
];

/// R1 = 1, R2 = 8, R5 = 4, R0 = R6 = 0 unless listed; R8–R11 are addresses, R12 is an address in
/// code.
#[rustfmt::skip]
const REGISTERS: &[(usize, u32)] = &[
    (0, 5), (1, 1), (2, 8), (5, 4), (8, RAM), (9, RAM + 0x100), (10, RAM + 0x200), (11, RAM + 0x300), (12, CODE + 5),
];

fn machine(code: &[u16]) -> Machine {
    let mut machine = Machine::new(code).with(REGISTERS);
    machine.poke(RAM + 0x200, &[RAM, 0, CODE + 5]);
    machine
}

#[test]
fn sequences_take_the_cycles_worked_out() {
    for (name, code, count, [ram, line], cycles, why) in CASES {
        let mut machine = machine(code);
        (machine.bus.ram_wait, machine.bus.line_wait) = (*ram, *line);
        machine.bus.fetch(CODE >> 4, 0);
        machine.steps(*count);
        assert_eq!(machine.cpu.cycle, *cycles, "{name} ({why})");
        assert_eq!(machine.cpu.registers.exception, 0, "{name}");
    }
}

#[test]
fn actlr_switches_folding_and_the_write_buffer_off() {
    let cycles = |code: &[u16], count, actlr| {
        let mut machine = machine(code);
        let written = machine.cpu.system.write(0xE000_E008, Size::Word, actlr, 0);
        assert!(written.is_ok());
        machine.bus.ram_wait = 2;
        machine.steps(count);
        machine.cpu.cycle
    };
    let folded = &[0x2101, 0xBF18, 0x3001]; // movs r1,#1; it ne; addne r0,#1
    assert_eq!([0, 1 << 2].map(|actlr| cycles(folded, 3, actlr)), [2, 3]);
    let store = &[0xF8C8, 0x0000]; // str.w r0,[r8]
    assert_eq!([0, 1 << 1].map(|actlr| cycles(store, 1, actlr)), [1, 3]);
}
