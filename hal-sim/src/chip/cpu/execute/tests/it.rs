//! Tests IT blocks: conditions, faults, branches. `qemu_instructions` tests the instructions in
//! them.

use super::{CODE, Machine, run};

#[test]
fn every_condition_is_the_manuals() {
    for condition in 0..15u16 {
        for flags in 0..16u32 {
            let (n, z) = (flags & 8 != 0, flags & 4 != 0);
            let (c, v) = (flags & 2 != 0, flags & 1 != 0);
            let holds = match condition {
                0 => z,
                1 => !z,
                2 => c,
                3 => !c,
                4 => n,
                5 => !n,
                6 => v,
                7 => !v,
                8 => c && !z,
                9 => !c || z,
                10 => n == v,
                11 => n != v,
                12 => !z && n == v,
                13 => z || n != v,
                _ => true,
            };
            // it <condition>; mov r0,#1
            let mut machine = Machine::new(&[0xBF08 | condition << 4, 0x2001]);
            machine.cpu.registers.apsr = flags << 28;
            machine.steps(2);
            assert_eq!(machine.r(0) == 1, holds, "{condition}, {flags:04b}");
        }
    }
}

#[test]
fn a_fault_stacks_the_state_of_its_instruction() {
    let code = &[0xBF04, 0x2001, 0x6808] /* itt eq; moveq r0,#1; ldreq r0,[r1] */;
    let mut machine = Machine::new(code).with(&[(1, 0x6000_0000)]);
    machine.cpu.registers.apsr = 1 << 30;
    machine.steps(3);
    assert_eq!(machine.cpu.registers.exception, 3);
    let xpsr = machine.word(machine.r(13) + 0x1C);
    // ITSTATE 0000_1000: condition EQ, one instruction left.
    assert_eq!((xpsr >> 8 & 0xFC) | (xpsr >> 25 & 3), 0x08);
}

#[test]
fn branches_end_blocks() {
    let code = &[0xBF08, 0x4708] /* it eq; bxeq r1 */;
    let mut machine = run(code, 0, &[(1, CODE + 0x11)]);
    machine.cpu.registers.apsr = 1 << 30;
    machine.steps(2);
    assert_eq!((machine.r(15), machine.cpu.registers.it), (CODE + 0x10, 0));
}
