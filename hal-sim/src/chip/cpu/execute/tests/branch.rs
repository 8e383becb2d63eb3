//! Tests the range of branches, and interworking. `qemu_instructions` tests short branches, calls,
//! tables and pops.

use super::{CODE, Machine, RAM, run};

/// Text, code, target minus the instruction's address; Z is set, R2 is 1.
#[rustfmt::skip]
const TARGETS: &[(&str, &[u16], i32)] = &[
    ("b, to itself", &[0xE7FE], 0),
    ("b, lowest", &[0xE400], 4 - 0x800),
    ("b, highest", &[0xE3FF], 4 + 0x7FE),
    ("b.w . - 0x100", &[0xF7FF, 0xBF7E], -0x100),
    ("b.w . + 0x100000", &[0xF0FF, 0xBFFE], 0x10_0000),
    ("bl, lowest", &[0xF400, 0xD000], 4 - 0x100_0000),
    ("bl, highest", &[0xF3FF, 0xD7FF], 4 + 0xFF_FFFE),
    ("beq, highest", &[0xD07F], 4 + 0xFE),
    ("beq, lowest", &[0xD080], 4 - 0x100),
    ("beq.w, to itself", &[0xF43F, 0xAFFE], 0),
    ("beq.w, lowest", &[0xF400, 0x8000], 4 - 0x10_0000),
    ("beq.w, highest", &[0xF03F, 0xAFFF], 4 + 0xF_FFFE),
    ("cbz r0, highest", &[0xB3F8], 4 + 126),
    ("cbnz r2", &[0xB912], 8),
];

#[test]
fn targets_are_relative_to_pc_plus_4() {
    for (name, code, target) in TARGETS {
        let mut machine = Machine::new(code).with(&[(2, 1)]);
        machine.cpu.registers.apsr = 1 << 30;
        machine.steps(1);
        assert_eq!(machine.r(15), CODE.wrapping_add_signed(*target), "{name}");
    }
}

#[test]
fn registers_and_memory_give_targets() {
    for code in [
        &[0xF8D2, 0xF000][..], /* ldr.w pc,[r2] */
        &[0xF852, 0xFB04],     /* ldr pc,[r2],#4 */
        &[0xE892, 0x8008],     /* ldm r2,{r3,pc} */
        &[0xF852, 0xF020],     /* ldr.w pc,[r2,r0,lsl #2] */
    ] {
        let mut machine = Machine::new(code).with(&[(0, 0), (1, CODE + 0x31), (2, RAM)]);
        machine.poke(RAM, &[CODE + 0x31, CODE + 0x31]);
        machine.steps(1);
        assert_eq!(machine.r(15), CODE + 0x30, "{code:04X?}");
    }
    let machine = run(&[0x448F] /* add pc, r1 */, 1, &[(1, 0x10)]);
    assert_eq!(machine.r(15), CODE + 0x14);
}

#[test]
fn arm_state_is_an_invalid_state_at_the_target() {
    for code in [
        &[0x4708][..],     /* bx r1 */
        &[0x4788],         /* blx r1 */
        &[0xF8D2, 0xF000], /* ldr.w pc,[r2] */
    ] {
        let mut machine = Machine::new(code).with(&[(1, CODE + 0x30), (2, RAM)]);
        machine.poke(RAM, &[CODE + 0x30]);
        machine.steps(1);
        assert_eq!(machine.cpu.registers.exception, 3);
        assert_eq!(machine.word(machine.r(13) + 0x18), CODE + 0x30);
    }
}

#[test]
fn code_in_ram_is_decoded_each_time() {
    // Stores NOP over the second instruction, then executes it.
    let code = &[0x8008, 0x3201, 0xF7FF, 0xBFFC] /* strh r0,[r1]; adds r2,#1; b . - 4 */;
    let mut machine = Machine::new(&[0]).with(&[(0, 0xBF00), (1, RAM + 0x102), (15, RAM + 0x100)]);
    assert!(machine.bus.load(RAM + 0x100, &super::bytes(code)));
    machine.steps(2);
    assert_eq!(machine.r(2), 0);
}

#[test]
fn programmed_flash_is_decoded_again() {
    let mut machine = Machine::new(&[0x2001, 0xF7FF, 0xBFFD] /* movs r0,#1; b . - 2 */);
    machine.steps(2);
    let code = super::bytes(&[0x2002] /* movs r0,#2 */);
    assert!(machine.bus.load(CODE, &code));
    machine.steps(1);
    assert_eq!(machine.r(0), 2);
}
