//! IT blocks and conditions.

use super::{CODE, Machine, run};

#[test]
fn then_and_else_take_turns() {
    let code = &[0xBF0C, 0x2001, 0x2002, 0xBF00] /* ite eq; moveq r0,#1; movne r0,#2; nop */;
    for (apsr, r0) in [(1 << 30, 1), (0, 2)] {
        let mut machine = Machine::new(code);
        machine.cpu.registers.apsr = apsr;
        machine.steps(3);
        assert_eq!((machine.r(0), machine.cpu.registers.it), (r0, 0));
        assert_eq!(machine.cpu.registers.apsr, apsr);
    }
}

#[test]
fn sixteen_bit_instructions_leave_the_flags_alone() {
    let code = &[0xBFE1, 0x1840, 0x0040, 0x4008, 0x3801, 0x2200] /* itttt al; addal r0,r0,r1; lslal r0,r0,#1; andal r0,r1; subal r0,#1; movs r2,#0 */;
    let mut machine = Machine::new(code).with(&[(0, 0xFFFF_FFFF), (1, 1)]);
    machine.cpu.registers.apsr = 0xB << 28;
    machine.steps(5);
    let expected = (0xFFFF_FFFF, 0xB << 28);
    assert_eq!((machine.r(0), machine.cpu.registers.apsr), expected);
    machine.steps(1);
    assert_eq!(machine.cpu.registers.apsr, 0x7 << 28);
}

#[test]
fn comparisons_and_wide_forms_set_flags_inside() {
    // The second comparison runs, its result decides on the third.
    let code = &[0xBF02, 0x2801, 0xF111, 0x0101, 0x2207] /* ittt eq; cmpeq r0,#1; addseq.w r1,r1,#1; moveq r2,#7 */;
    let mut machine = Machine::new(code).with(&[(0, 1), (1, 0xFFFF_FFFF)]);
    machine.cpu.registers.apsr = 1 << 30;
    machine.steps(4);
    assert_eq!((machine.r(1), machine.r(2)), (0, 7));
    let mut machine = Machine::new(code).with(&[(0, 0)]);
    machine.cpu.registers.apsr = 1 << 30;
    machine.steps(4);
    assert_eq!((machine.r(1), machine.r(2)), (0, 0));
}

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
            assert_eq!(
                machine.r(0) == 1,
                holds,
                "condition {condition}, flags {flags:04b}"
            );
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
    // ITSTATE 0000_1000: condition EQ, one left.
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
