//! Checks that UNDEFINED encodings fault, UNPREDICTABLE encodings stop the run by name, and no
//! encoding causes a panic.

use super::{CODE, Machine};
use crate::chip::cpu::Stop;
use crate::chip::cpu::decode::decode;
use crate::chip::cpu::instruction::Op;

#[test]
fn undefined_is_a_usage_fault() {
    for code in [
        &[0xDE01][..],     /* udf #1 */
        &[0xF7F0, 0xA001], /* udf.w #1 */
        &[0xB650],         // SETEND does not exist in M-profile
        &[0xBA80],
        &[0xF000, 0xC000], // BLX to Arm state
        &[0xF800, 0x0800], // STRB without a valid addressing mode
    ] {
        let mut machine = Machine::new(code);
        machine.steps(1);
        assert_eq!(machine.cpu.registers.exception, 3, "{code:04X?}");
    }
}

#[test]
fn a_coprocessor_that_is_not_there_is_a_usage_fault() {
    // mcr p5, 0, r0, c0, c0
    let mut machine = Machine::new(&[0xEE00, 0x0510]);
    machine.steps(1);
    assert_eq!(machine.cpu.registers.exception, 3);
}

#[test]
fn unpredictable_stops_the_run() {
    for (code, instruction) in [
        (&[0xBF00, 0xE8BD, 0x2001][..], 0xE8BD_2001), // pop {r0,sp}
        (&[0xBF00, 0xBC00], 0xBC00),                  // pop {}
        (&[0xBF00, 0x4778], 0x4778),                  // bx pc
        (&[0xBF00, 0xF8C0, 0xF000], 0xF8C0_F000),     // str pc,[r0]
        (&[0xBF00, 0xF04F, 0x0D00], 0xF04F_0D00),     // mov sp, #0
        (&[0xBF00, 0xBFF8], 0xBFF8),                  // it <15>
    ] {
        let mut machine = Machine::new(code);
        machine.steps(1);
        let stop = machine.stop();
        let Some(Stop::Instruction {
            instruction: named,
            pc,
            ..
        }) = stop
        else {
            panic!("{code:04X?}: {stop:?}");
        };
        assert_eq!((named, pc), (instruction, CODE + 2));
    }
}

#[test]
fn nothing_panics() {
    let mut machine = Machine::new(&[0; 2]);
    for first in 0..=0xFFFFu16 {
        // All 16-bit encodings; for 32-bit encodings, evenly spread second halves.
        let step = if first >= 0xE800 { 0x0651 } else { 0x1_0000 };
        for second in (0..0x1_0000u32).step_by(step) {
            let second = (second & 0xFFFF) as u16;
            assert!(machine.bus.load(CODE, &super::bytes(&[first, second])));
            let entry = decode(&mut machine.bus, CODE).expect("code is there");
            assert!(entry.op != Op::Missing);
            // Executing must not panic either; stops are allowed.
            let registers = &mut machine.cpu.registers;
            *registers = crate::chip::cpu::Registers::default();
            registers.r = [CODE + 0x100; 16];
            registers.r[13] = super::RAM + 0x1000;
            registers.r[15] = CODE;
            let _ = machine.cpu.step(&mut machine.bus);
        }
    }
}
