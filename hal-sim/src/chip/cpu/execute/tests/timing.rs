//! Cycles of short sequences, computed by hand from the TRM (table 3-1,
//! section 3.3.2), memory without wait states.

use super::{CODE, Machine, RAM};
use crate::chip::cpu::{Bus, Size};

/// Text, code, instructions executed, cycles, why.
type Case = (&'static str, &'static [u16], usize, u64, &'static str);

#[rustfmt::skip]
const CASES: &[Case] = &[
    ("nop", &[0xBF00], 1, 1, "data processing"),
    ("movs r0,#1; adds r1,r0,#1; mov r2,r1", &[0x2001, 0x1C41, 0x460A], 3, 3, "results are forwarded"),
    ("mul r0,r1,r2; mla r0,r1,r2,r0; smull r0,r1,r2,r3", &[0xFB01, 0xF002, 0xFB01, 0x0002, 0xFB82, 0x0103], 3, 3, "multiplications"),
    ("umlal r4,r5,r6,r7; smlal r4,r5,r6,r7; umaal r4,r5,r6,r7", &[0xFBE6, 0x4507, 0xFBC6, 0x4507, 0xFBE6, 0x4567], 3, 3, "long accumulations"),
    ("ssat r0,#8,r1; usat r0,#8,r1; ubfx r0,r1,#3,#4; bfi r0,r1,#1,#2", &[0xF301, 0x0007, 0xF381, 0x0008, 0xF3C1, 0x00C3, 0xF361, 0x0042], 4, 4, "saturation, bit fields"),
    ("ldr r0,[r8]", &[0xF8D8, 0x0000], 1, 2, "single load"),
    ("ldrb r0,[r8]; adds r0,#1", &[0xF898, 0x0000, 0x3001], 2, 3, "a result used at once costs nothing more"),
    ("ldr r0,[r8]; ldr r1,[r9]", &[0xF8D8, 0x0000, 0xF8D9, 0x1000], 2, 3, "TRM 3.3.2, first example"),
    ("ldr.w r0,[r8,r2]; str.w r0,[r9,#20]", &[0xF858, 0x0002, 0xF8C9, 0x0014], 2, 3, "TRM 3.3.2, second example"),
    ("ldr.w r0,[r8,r2]; str.w r1,[r9,r2]", &[0xF858, 0x0002, 0xF849, 0x1002], 2, 3, "TRM 3.3.2, third example"),
    ("ldr.w r0,[r8,r5]; ldr r1,[r9]; ldr r2,[r10,#4]", &[0xF858, 0x0005, 0xF8D9, 0x1000, 0xF8DA, 0x2004], 3, 4, "TRM 3.3.2, fourth example"),
    ("ldr r0,[r8]; nop; ldr r1,[r9]", &[0xF8D8, 0x0000, 0xBF00, 0xF8D9, 0x1000], 3, 5, "not neighbours"),
    ("ldr r7,[r10]; ldr r0,[r7]", &[0xF8DA, 0x7000, 0x6838], 2, 4, "address from the load: not pipelined"),
    ("ldr r7,[r10,#4]; ldr.w r0,[r8,r7]", &[0xF8DA, 0x7004, 0xF858, 0x0007], 2, 4, "offset from the load"),
    ("ldr r0,[r8],#4; ldr r1,[r9],#4", &[0xF858, 0x0B04, 0xF859, 0x1B04], 2, 3, "other base moved"),
    ("ldr r0,[r8],#4; ldr r1,[r8],#4", &[0xF858, 0x0B04, 0xF858, 0x1B04], 2, 4, "same base moved"),
    ("str r0,[r8]", &[0xF8C8, 0x0000], 1, 1, "store with constant offset"),
    ("strb r0,[r8]; strh r0,[r8,#2]; str r0,[r8,#4]", &[0xF888, 0x0000, 0xF8A8, 0x0002, 0xF8C8, 0x0004], 3, 3, "stores in a row"),
    ("str.w r0,[r8,r2]", &[0xF848, 0x0002], 1, 2, "store with register offset"),
    ("str.w r0,[r8,r2]; str.w r0,[r8,r2]", &[0xF848, 0x0002, 0xF848, 0x0002], 2, 4, "nothing is pipelined after a store"),
    ("str r0,[r8]; ldr r1,[r9]", &[0xF8C8, 0x0000, 0xF8D9, 0x1000], 2, 3, "nor after this one"),
    ("ldr r0,[r8]; str r0,[r9]; ldr r1,[r8]", &[0xF8D8, 0x0000, 0xF8C9, 0x0000, 0xF8D8, 0x1000], 3, 5, "a store in between"),
    ("str r0,[r8,#4]!", &[0xF848, 0x0F04], 1, 1, "store that moves its base"),
    ("adds r2,#4; ldr.w r0,[r8,r2]", &[0x3204, 0xF858, 0x0002], 2, 4, "address from data processing"),
    ("add.w r8,r8,#4; ldr.w r0,[r8]", &[0xF108, 0x0804, 0xF8D8, 0x0000], 2, 4, "base from data processing"),
    ("add.w r8,r8,#4; nop; ldr.w r0,[r8]", &[0xF108, 0x0804, 0xBF00, 0xF8D8, 0x0000], 3, 4, "the bank was updated meanwhile"),
    ("add.w r8,r8,#4; str.w r0,[r8]", &[0xF108, 0x0804, 0xF8C8, 0x0000], 2, 3, "store waits as well"),
    ("adds r0,#4; str.w r0,[r8]", &[0x3004, 0xF8C8, 0x0000], 2, 2, "the data does not wait"),
    ("mul r2,r3,r3; ldr.w r0,[r8,r2]", &[0xFB03, 0xF203, 0xF858, 0x0002], 2, 4, "a product as an offset"),
    ("sub sp,#8; str r0,[sp]", &[0xB082, 0x9000], 2, 3, "the stack pointer, too"),
    ("sub sp,#8; push {r0,r1}", &[0xB082, 0xB403], 2, 5, "and for several words"),
    ("push {r0}", &[0xB401], 1, 2, "1 + N"),
    ("push {r0-r7,lr}", &[0xB5FF], 1, 10, "1 + N"),
    ("push {r0,r1}; pop {r2,r3}", &[0xB403, 0xBC0C], 2, 6, "not pipelined"),
    ("ldm.w r8,{r0-r2}", &[0xE898, 0x0007], 1, 4, "three elements"),
    ("stm.w r8,{r0-r7}", &[0xE888, 0x00FF], 1, 9, "eight elements, TRM 3.3.2"),
    ("ldr r3,[r9]; ldm.w r8,{r0,r1}", &[0xF8D9, 0x3000, 0xE898, 0x0003], 2, 5, "nothing before it"),
    ("ldm.w r8,{r0,r1}; ldr r3,[r9]", &[0xE898, 0x0003, 0xF8D9, 0x3000], 2, 5, "nothing behind it"),
    ("ldrd r0,r1,[r8]", &[0xE9D8, 0x0100], 1, 3, "two words"),
    ("strd r0,r1,[r8]", &[0xE9C8, 0x0100], 1, 3, "two words"),
    ("ldrd r0,r1,[r8]; ldr r2,[r9]", &[0xE9D8, 0x0100, 0xF8D9, 0x2000], 2, 5, "not pipelined"),
    ("ldrex r0,[r8]; strex r1,r2,[r8]", &[0xE858, 0x0F00, 0xE848, 0x2100], 2, 3, "exclusives pipeline like loads"),
    ("ldrex r0,[r8]; add r0,r0,#1; strex r1,r0,[r8]", &[0xE858, 0x0F00, 0xF100, 0x0001, 0xE848, 0x0100], 3, 5, "atomic increment"),
    ("clrex", &[0xF3BF, 0x8F2F], 1, 1, "table 3-1"),
    ("ldr r0,[r11,#1]", &[0xF8DB, 0x0001], 1, 4, "byte, half-word, byte"),
    ("ldr r0,[r11,#2]", &[0xF8DB, 0x0002], 1, 3, "two half-words"),
    ("ldrh r0,[r11,#1]", &[0xF8BB, 0x0001], 1, 3, "two bytes"),
    ("ldrh r0,[r11,#2]", &[0xF8BB, 0x0002], 1, 2, "aligned"),
    ("str r0,[r11,#1]", &[0xF8CB, 0x0001], 1, 1, "the write buffer hides it"),
    ("str r0,[r11,#1]; ldr r1,[r8]", &[0xF8CB, 0x0001, 0xF8D8, 0x1000], 2, 5, "but the next access waits"),
    ("str r0,[r11,#1]; nop; nop; ldr r1,[r8]", &[0xF8CB, 0x0001, 0xBF00, 0xBF00, 0xF8D8, 0x1000], 4, 5, "unless it comes later"),
    ("b.n 1f; nop; 1: nop", &[0xE000, 0xBF00, 0xBF00], 2, 3, "P = 1: the target is known early"),
    ("nop; b.n 1f; nop; 1: mov.w r0,r1", &[0xBF00, 0xE000, 0xBF00, 0xEA4F, 0x0001], 3, 5, "a 32-bit target across words"),
    ("b.n 1f; nop; 1: mov.w r0,r1", &[0xE000, 0xBF00, 0xEA4F, 0x0001], 2, 3, "an aligned one"),
    ("beq.n 1f; 1: nop", &[0xD0FF, 0xBF00], 2, 2, "not taken"),
    ("bne.n 1f; nop; 1: nop", &[0xD100, 0xBF00, 0xBF00], 2, 3, "taken"),
    ("bl 1f; 1: nop", &[0xF000, 0xF800, 0xBF00], 2, 3, "call"),
    ("cbz r0,1f; nop; 1: nop", &[0xB100, 0xBF00, 0xBF00], 2, 2, "not taken"),
    ("cbnz r0,1f; nop; 1: nop", &[0xB900, 0xBF00, 0xBF00], 2, 3, "taken"),
    ("bx r12; nop; nop", &[0x4760, 0xBF00, 0xBF00], 2, 4, "P = 2: the register is read later"),
    ("blx r12; nop; nop", &[0x47E0, 0xBF00, 0xBF00], 2, 4, "likewise"),
    ("mov pc,r12; nop; nop", &[0x46E7, 0xBF00, 0xBF00], 2, 4, "likewise"),
    ("ldr pc,[r10,#8]; nop; nop", &[0xF8DA, 0xF008, 0xBF00, 0xBF00], 2, 6, "two and three, TRM 3.3.2"),
    ("tbb [pc,r6]; .byte 1,1; nop", &[0xE8DF, 0xF006, 0x0101, 0xBF00], 2, 7, "six, TRM 3.3.2"),
    ("tbh [pc,r6,lsl #1]; .hword 1; nop", &[0xE8DF, 0xF016, 0x0001, 0xBF00], 2, 7, "likewise"),
    ("movs r1,#1; it ne; addne r0,#1", &[0x2101, 0xBF18, 0x3001], 3, 2, "IT folded onto a 16-bit instruction"),
    ("mov.w r1,#1; it ne; addne r0,#1", &[0xF04F, 0x0101, 0xBF18, 0x3001], 3, 3, "not onto a 32-bit one"),
    ("movs r1,#1; it eq; addeq r0,#1", &[0x2101, 0xBF08, 0x3001], 3, 2, "a failed condition takes its cycle"),
    ("it ne; ldrne r0,[r8]", &[0xBF18, 0xF8D8, 0x0000], 2, 3, "first instruction: not folded"),
    ("dsb; dmb", &[0xF3BF, 0x8F4F, 0xF3BF, 0x8F5F], 2, 2, "nothing to wait for"),
    ("isb; nop", &[0xF3BF, 0x8F6F, 0xBF00], 2, 4, "refill"),
    ("mrs r0,primask; msr primask,r0; cpsid i; cpsie i", &[0xF3EF, 0x8010, 0xF380, 0x8810, 0xB672, 0xB662], 4, 8, "'1 or 2': 2"),
    ("sdiv r0,r6,r1", &[0xFB96, 0xF0F1], 1, 2, "least: nothing to divide"),
    ("udiv r0,r5,r12", &[0xFBB5, 0xF0FC], 1, 3, "divisor longer than dividend"),
];

/// R1 = 1, R2 = 8, R5 = 4, R0 = R6 = 0 unless listed; R8–R11 addresses, R12 code.
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
fn sequences_take_the_manuals_cycles() {
    for (name, code, count, cycles, why) in CASES {
        let mut machine = machine(code);
        machine.steps(*count);
        assert_eq!(machine.cpu.cycle, *cycles, "{name} ({why})");
        assert_eq!(machine.cpu.registers.exception, 0, "{name}");
    }
}

/// Text, code, instructions, wait states of RAM and of a new line, cycles, why.
type Waiting = (
    &'static str,
    &'static [u16],
    usize,
    [u32; 2],
    u64,
    &'static str,
);

#[rustfmt::skip]
const WAITING: &[Waiting] = &[
    ("str.w r0,[r8]", &[0xF8C8, 0x0000], 1, [2, 0], 1, "its data phase, cycles 1 to 4, stalls the next access only"),
    ("str.w r0,[r8]; ldr.w r1,[r9]", &[0xF8C8, 0x0000, 0xF8D9, 0x1000], 2, [2, 0], 7, "the load's would begin at 2, begins at 4"),
    ("str.w r0,[r8]; nop; nop; ldr.w r1,[r9]", &[0xF8C8, 0x0000, 0xBF00, 0xBF00, 0xF8D9, 0x1000], 4, [2, 0], 7, "two instructions hide two cycles"),
    ("str.w r0,[r8]; str.w r0,[r8]", &[0xF8C8, 0x0000, 0xF8C8, 0x0000], 2, [2, 0], 4, "one entry: the second waits for the first"),
    ("str.w r0,[r8]; dsb", &[0xF8C8, 0x0000, 0xF3BF, 0x8F4F], 2, [2, 0], 4, "DSB waits for the buffer"),
    ("ldr.w r0,[r8]; ldr.w r1,[r9]", &[0xF8D8, 0x0000, 0xF8D9, 0x1000], 2, [1, 0], 5, "loads wait each time"),
    ("ldm.w r8,{r0-r3}", &[0xE898, 0x000F], 1, [2, 0], 5 + 4 * 2, "loads wait each time"),
    // The line behind is asked for when the fourth of eight 16-bit instructions
    // begins (10 bytes ahead reach it): cycle 3. It is there 2 + 5 later, at 10.
    ("8 × nop", &[0xBF00; 9], 8, [0, 5], 8, "the second line is not needed"),
    ("9 × nop", &[0xBF00; 9], 9, [0, 5], 11, "it was needed at 8"),
    ("9 × nop", &[0xBF00; 9], 9, [0, 3], 9, "two wait states are hidden altogether"),
    ("b . + 32", &[0xE00E], 1, [0, 5], 7, "a branch waits for its line"),
    ("b .", &[0xE7FE], 1, [0, 5], 2, "not for the one fetched last"),
];

#[test]
fn wait_states_pass_where_they_must() {
    for (name, code, count, [ram, line], cycles, why) in WAITING {
        let mut machine = machine(code);
        (machine.bus.ram_wait, machine.bus.line_wait) = (*ram, *line);
        machine.bus.fetch(CODE >> 4, 0);
        machine.steps(*count);
        assert_eq!(machine.cpu.cycle, *cycles, "{name} ({why})");
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
