//! Tests special registers, hints, SVC, sleep, and interrupts between instructions.

use super::{CODE, Machine, run};
use crate::chip::cpu::Size;

/// Enables interrupt line `n` in the NVIC.
fn enable(machine: &mut Machine, n: u32) {
    let (address, bit) = (0xE000_E100 + n / 32 * 4, 1 << (n % 32));
    let written = machine.cpu.system.write(address, Size::Word, bit, 0);
    assert_eq!(written, Ok(()));
}

#[test]
fn svc_returns_behind_itself() {
    let mut machine = run(&[0xBF00, 0xDF05, 0xBF00] /* nop; svc 5; nop */, 2, &[]);
    assert_eq!(machine.cpu.registers.exception, 0);
    machine.steps(1);
    assert_eq!(machine.cpu.registers.exception, 11);
    assert_eq!(machine.word(machine.r(13) + 0x18), CODE + 4);
}

#[test]
fn an_interrupt_comes_between_instructions_and_bx_lr_returns() {
    let mut machine = Machine::new(&[0x3001; 64]); // adds r0,#1
    let handler = super::bytes(&[0x4770] /* bx lr */);
    assert!(machine.bus.load(CODE + 0x9000, &handler));
    enable(&mut machine, 5);
    machine.bus.schedule.push_back((20, [1 << 5, 0, 0]));
    assert_eq!(machine.cpu.run(&mut machine.bus, 25), Ok(()));
    assert_eq!(machine.cpu.registers.exception, 21);
    machine.bus.lines[0] = 0;
    machine.steps(1);
    assert_eq!(machine.cpu.registers.exception, 0);
    let (pc, done) = (machine.r(15), machine.r(0));
    assert_eq!(pc, CODE + 2 * done);
    assert!((20..25).contains(&done), "{done}");
}

#[test]
fn wfi_sleeps_until_an_interrupt_even_a_masked_one() {
    let code = &[0xB672, 0xBF30, 0x2001, 0xE7FE] /* cpsid i; wfi; movs r0,#1; b . */;
    let mut machine = Machine::new(code);
    enable(&mut machine, 40);
    machine.bus.schedule.push_back((5_000, [0, 1 << 8, 0]));
    assert_eq!(machine.cpu.run(&mut machine.bus, 4_000), Ok(()));
    assert!(machine.cpu.is_asleep());
    assert_eq!((machine.cpu.cycle, machine.cpu.instructions), (4_000, 2));
    assert_eq!(machine.cpu.run(&mut machine.bus, 5_010), Ok(()));
    assert!(!machine.cpu.is_asleep());
    assert_eq!((machine.r(0), machine.cpu.registers.exception), (1, 0));
}

#[test]
fn the_cycle_counter_stands_in_a_sleep_without_clock() {
    for (stops_in_sleep, counted) in [(false, 5_000), (true, 1_000)] {
        let code = &[0xBF30, 0x2001, 0xE7FE] /* wfi; movs r0,#1; b . */;
        let mut machine = Machine::new(code);
        let system = &mut machine.cpu.system;
        for (address, value) in [(0xE000_EDFC, 1 << 24), (0xE000_1000, 1)] {
            assert_eq!(system.write(address, Size::Word, value, 0), Ok(()));
        }
        enable(&mut machine, 40);
        machine.bus.schedule.push_back((4_000, [0, 1 << 8, 0]));
        machine.bus.stops_in_sleep = stops_in_sleep;
        assert_eq!(machine.cpu.run(&mut machine.bus, 5_000), Ok(()));
        let at = machine.cpu.cycle;
        let read = machine.cpu.system.read(0xE000_1004, Size::Word, at);
        let count = read.unwrap();
        assert!(
            (counted..counted + 20).contains(&count),
            "{stops_in_sleep}: {count}"
        );
    }
}

#[test]
fn wfe_takes_the_event_that_sev_left() {
    let code = &[0xBF40, 0xBF20, 0xBF20, 0x2001] /* sev; wfe; wfe; movs r0,#1 */;
    let mut machine = Machine::new(code);
    assert_eq!(machine.cpu.run(&mut machine.bus, 1_000), Ok(()));
    assert!(machine.cpu.is_asleep());
    assert_eq!((machine.cpu.instructions, machine.r(0)), (3, 0));
}

#[test]
fn hints_do_nothing() {
    for code in [
        &[0xBF00][..],     /* nop */
        &[0xF3AF, 0x8000], /* nop.w */
        &[0xBF10],         /* yield */
        &[0xF890, 0xF000], /* pld [r0] */
        &[0xF89F, 0xF004], /* pld [pc,#4] */
        &[0xF3BF, 0x8F4F], /* dsb */
        &[0xF3BF, 0x8F5F], /* dmb */
        &[0xF3BF, 0x8F6F], /* isb */
    ] {
        let mut machine = Machine::new(code);
        let mut before = machine.cpu.registers.r;
        machine.steps(1);
        before[15] += 2 * code.len() as u32;
        assert_eq!(machine.cpu.registers.r, before, "{code:04X?}");
    }
}
