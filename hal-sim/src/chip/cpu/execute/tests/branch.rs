//! Branches: targets, links, interworking.

use super::{CODE, Machine, RAM, run};

#[test]
fn targets_are_relative_to_pc_plus_4() {
    for (code, target) in [
        (&[0xE000][..], CODE + 4),
        (&[0xE7FE] /* b . */, CODE),
        (&[0xE400], CODE - 0x7FC), // b . - 0x7FC
        (&[0xE3FF], CODE + 0x802), // b . + 0x802
        (&[0xF7FF, 0xBF7E] /* b.w . - 0x100 */, CODE - 0x100),
        (
            &[0xF0FF, 0xBFFE], /* b.w . + 0x100000 */
            CODE + 0x10_0000,
        ),
        (&[0xF000, 0xFFFE] /* bl . + 0x1000 */, CODE + 0x1000),
        (
            &[0xF400, 0xD000],
            CODE.wrapping_add(4).wrapping_sub(0x100_0000),
        ), // lowest bl
        (&[0xF3FF, 0xD7FF], CODE + 4 + 0xFF_FFFE), // highest bl
        (&[0xD07F], CODE + 4 + 0xFE),              // beq, highest
        (&[0xD080], CODE + 4 - 0x100),             // beq, lowest
        (&[0xF000, 0x8000], CODE + 4),             // beq.w . + 4
        (&[0xF43F, 0xAFFE], CODE),                 // beq.w .
        (
            &[0xF400, 0x8000],
            CODE.wrapping_add(4).wrapping_sub(0x10_0000),
        ), // lowest beq.w
        (&[0xF03F, 0xAFFF], CODE + 4 + 0xF_FFFE),  // highest beq.w
        (&[0xB1F8], CODE + 66),                    // cbz r0, . + 66
        (&[0xB3F8], CODE + 130),                   // cbz r0, . + 130
        (&[0xB912], CODE + 8),                     // cbnz r2, . + 8
    ] {
        let mut machine = Machine::new(code).with(&[(2, 1)]);
        machine.cpu.registers.apsr = 1 << 30;
        machine.steps(1);
        assert_eq!(machine.r(15), target, "{code:04X?}");
    }
}

#[test]
fn conditions_not_met_go_on() {
    for code in [&[0xD1FE][..], &[0xF47F, 0xAFFE], &[0xB102], &[0xB900]] {
        // bne ., bne.w ., cbz r2, cbnz r0
        let mut machine = Machine::new(code).with(&[(2, 1)]);
        machine.cpu.registers.apsr = 1 << 30;
        machine.steps(1);
        assert_eq!(machine.r(15), CODE + 2 * code.len() as u32, "{code:04X?}");
    }
}

#[test]
fn calls_leave_the_return_address() {
    let machine = run(&[0xF000, 0xFFFE] /* bl . + 0x1000 */, 1, &[]);
    assert_eq!(machine.r(14), CODE + 5);
    let machine = run(&[0x4788] /* blx r1 */, 1, &[(1, CODE + 0x21)]);
    assert_eq!((machine.r(15), machine.r(14)), (CODE + 0x20, CODE + 3));
    // The target is read before the link register is written.
    let machine = run(&[0x47F0] /* blx lr */, 1, &[(14, CODE + 0x41)]);
    assert_eq!((machine.r(15), machine.r(14)), (CODE + 0x40, CODE + 3));
}

#[test]
fn registers_and_memory_give_targets() {
    for code in [
        &[0x4708][..],     /* bx r1 */
        &[0x468F],         /* mov pc, r1 */
        &[0xF8D2, 0xF000], /* ldr.w pc,[r2] */
        &[0xF852, 0xFB04], /* ldr pc,[r2],#4 */
        &[0xE892, 0x8008], /* ldm r2,{r3,pc} */
        &[0xF852, 0xF020], /* ldr.w pc,[r2,r0,lsl #2] */
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
fn pop_of_pc_returns() {
    let mut machine = Machine::new(&[0xBD11] /* pop {r0,r4,pc} */).with(&[(13, RAM)]);
    machine.poke(RAM, &[1, 2, CODE + 0x101]);
    machine.steps(1);
    let expected = [1, 2, RAM + 12, CODE + 0x100];
    assert_eq!([0, 4, 13, 15].map(|n| machine.r(n)), expected);
}

#[test]
fn tables_count_half_words_from_behind_the_instruction() {
    let code = &[0xE8DF, 0xF000, 0x0201, 0x04C8] /* tbb [pc,r0]; .byte 1, 2, 200, 4 */;
    for (index, target) in [(0, 6), (2, 404), (3, 12)] {
        assert_eq!(run(code, 1, &[(0, index)]).r(15), CODE + target);
    }
    let code = &[0xE8DF, 0xF010, 0x0001, 0x1234] /* tbh [pc,r0,lsl #1]; .hword 1, 0x1234 */;
    assert_eq!(run(code, 1, &[(0, 1)]).r(15), CODE + 4 + 0x2468);
    let mut machine = Machine::new(&[0xE8D1, 0xF000] /* tbb [r1,r0] */).with(&[(0, 1), (1, RAM)]);
    machine.poke(RAM, &[0x0000_0300]);
    machine.steps(1);
    assert_eq!(machine.r(15), CODE + 10);
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
    // Stores NOP over the second instruction, then runs it.
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
    assert!(
        machine
            .bus
            .load(CODE, &super::bytes(&[0x2002] /* movs r0,#2 */))
    );
    machine.steps(1);
    assert_eq!(machine.r(0), 2);
}
