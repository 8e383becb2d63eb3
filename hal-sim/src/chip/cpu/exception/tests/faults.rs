//! Tests faults: escalation, lock-up, and faults during entry and return.

use super::*;
use crate::chip::cpu::system::number;
use crate::chip::cpu::{Fault, Open};

/// SHCSR with MemManage, BusFault and UsageFault enabled.
const ALL_FAULTS: u32 = 7 << 16;
const CFSR: u32 = 0xE000_ED28;
const HFSR: u32 = 0xE000_ED2C;

#[test]
fn a_fault_goes_to_its_exception_or_escalates() {
    for (fault, own) in [
        (Fault::Undefined, number::USAGE_FAULT),
        (Fault::DataBus(4), number::BUS_FAULT),
        (Fault::DataAccess(4), number::MEM_MANAGE),
    ] {
        let (mut cpu, mut bus) = machine();
        set(&mut cpu, 0xE000_ED24, ALL_FAULTS);
        assert_eq!(cpu.take_fault(&mut bus, fault), Ok(()));
        assert_eq!(cpu.registers.exception, own);
        assert_eq!(bus.word(STACK - 8), Some(MAIN), "the instruction itself");
        assert_eq!(get(&mut cpu, HFSR), 0);
        // Again in its own handler: cannot pre-empt, so it becomes a hard fault.
        assert_eq!(cpu.take_fault(&mut bus, fault), Ok(()));
        assert_eq!(cpu.registers.exception, number::HARD_FAULT);
        assert_eq!(get(&mut cpu, HFSR), 1 << 30);
        // In the hard fault handler, no escalation is left.
        let pc = cpu.registers.r[15];
        assert_eq!(cpu.take_fault(&mut bus, fault), Err(Stop::LockUp { pc }));
    }
}

#[test]
fn a_fault_under_primask_or_basepri_escalates() {
    for sysm in [16, 17] {
        let (mut cpu, mut bus) = machine();
        set(&mut cpu, 0xE000_ED24, ALL_FAULTS);
        cpu.system.nvic.set_priority(number::USAGE_FAULT, 0x40);
        cpu.write_special(sysm, 2, if sysm == 16 { 1 } else { 0x40 });
        assert_eq!(cpu.take_fault(&mut bus, Fault::DivideByZero), Ok(()));
        assert_eq!(cpu.registers.exception, number::HARD_FAULT);
    }
}

#[test]
fn a_fault_under_faultmask_locks_up() {
    let (mut cpu, mut bus) = machine();
    cpu.write_special(19, 2, 1);
    let taken = cpu.take_fault(&mut bus, Fault::Undefined);
    assert_eq!(taken, Err(Stop::LockUp { pc: MAIN }));
}

#[test]
fn a_breakpoint_without_a_debugger_is_a_hard_fault() {
    let (mut cpu, mut bus) = machine();
    code(&mut bus, MAIN, &[0xBEAB]);
    assert_eq!(cpu.step(&mut bus), Ok(()));
    assert_eq!(cpu.registers.exception, number::HARD_FAULT);
    assert_eq!(get(&mut cpu, HFSR), 1 << 31, "DEBUGEVT");
    assert_eq!(get(&mut cpu, 0xE000_ED30), 1 << 1, "BKPT");
    assert_eq!(bus.word(STACK - 8), Some(MAIN));
}

#[test]
fn supervisor_calls() {
    let (mut cpu, mut bus) = machine();
    code(&mut bus, MAIN, &[0xDF07, 0xE7FE]);
    assert_eq!(run(&mut cpu, &mut bus, 5), Ok(()));
    assert_eq!(cpu.registers.exception, number::SV_CALL);
    assert_eq!(bus.word(STACK - 8), Some(MAIN + 2), "the next instruction");
    // Masked, so it becomes a hard fault.
    let (mut cpu, mut bus) = machine();
    code(&mut bus, MAIN, &[0xDF07, 0xE7FE]);
    cpu.registers.primask = true;
    assert_eq!(run(&mut cpu, &mut bus, 5), Ok(()));
    assert_eq!(cpu.registers.exception, number::HARD_FAULT);
    assert_eq!(get(&mut cpu, HFSR), 1 << 30);
}

/// Sets up the image's guard region of 32 bytes at `base`.
fn guard(cpu: &mut Cpu, base: u32) {
    set(cpu, 0xE000_ED9C, base | 1 << 4);
    set(cpu, 0xE000_EDA0, 1 << 28 | 4 << 1 | 1);
    set(cpu, 0xE000_ED94, 0b101);
}

#[test]
fn an_interrupt_that_stacks_into_the_guard_becomes_a_hard_fault() {
    let (mut cpu, mut bus) = machine();
    guard(&mut cpu, STACK - 0x20);
    pend(&mut cpu, 0, 0x40);
    assert_eq!(take(&mut cpu, &mut bus), Some(12));
    assert_eq!(cpu.registers.exception, number::HARD_FAULT);
    assert_eq!(get(&mut cpu, CFSR), 1 << 4, "MSTKERR");
    assert_eq!(get(&mut cpu, HFSR), 1 << 30);
    assert_eq!(cpu.registers.r[13], STACK - 0x20);
    assert_eq!(bus.word(STACK - 8), Some(0), "nothing was written");
    assert_eq!(cpu.system.nvic.pending, 1 << 16, "the interrupt waits");
    // The handler may use the stack that the guard denies to others.
    assert!(cpu.system.may_access(STACK - 0x20, true, true));
}

#[test]
fn a_push_into_the_guard_is_a_hard_fault_with_both_causes() {
    let (mut cpu, mut bus) = machine();
    guard(&mut cpu, STACK - 0x40);
    cpu.registers.r[13] = STACK - 0x20;
    code(&mut bus, MAIN, &[0xB401]); // push {r0}
    assert_eq!(cpu.step(&mut bus), Ok(()));
    assert_eq!(cpu.registers.exception, number::HARD_FAULT);
    // DACCVIOL with its address, and MSTKERR of the entry.
    assert_eq!(get(&mut cpu, CFSR), 1 << 1 | 1 << 7 | 1 << 4);
    assert_eq!(get(&mut cpu, 0xE000_ED34), STACK - 0x24);
}

#[test]
fn stacking_outside_memory_is_a_bus_fault() {
    let (mut cpu, mut bus) = machine();
    set(&mut cpu, 0xE000_ED24, ALL_FAULTS);
    cpu.registers.r[13] = 0x3000_0000;
    cpu.system.nvic.set_priority(number::BUS_FAULT, 0x80);
    pend(&mut cpu, 0, 0x40);
    assert_eq!(take(&mut cpu, &mut bus), Some(12));
    // The interrupt has higher priority; the bus fault stays pending.
    assert_eq!(cpu.registers.exception, 16);
    assert_eq!(get(&mut cpu, CFSR), 1 << 12, "STKERR");
    assert_eq!(cpu.system.nvic.pending, 1 << number::BUS_FAULT);
}

#[test]
fn unstacking_outside_memory_tail_chains_to_a_bus_fault() {
    let (mut cpu, mut bus) = machine();
    pend(&mut cpu, 0, 0x40);
    take(&mut cpu, &mut bus);
    cpu.registers.r[13] = 0x3000_0000;
    leave(&mut cpu, &mut bus);
    assert_eq!(cpu.registers.exception, number::HARD_FAULT);
    assert_eq!(get(&mut cpu, CFSR), 1 << 11, "UNSTKERR");
    assert_eq!(cpu.registers.r[13], 0x3000_0000);
    assert_eq!(cpu.registers.r[14], 0xFFFF_FFF9);
}

#[test]
fn a_vector_that_cannot_be_read_is_a_hard_fault() {
    let (mut cpu, mut bus) = machine();
    // All vectors except the last lie beyond the end of SRAM.
    set(&mut cpu, 0xE000_ED08, Flat::SRAM + Flat::SRAM_BYTES - 0x80);
    let hard_fault = Flat::SRAM + Flat::SRAM_BYTES - 0x80 + 12;
    assert!(bus.load(hard_fault, &(handler(3) | 1).to_le_bytes()));
    pend(&mut cpu, 60, 0);
    assert!(take(&mut cpu, &mut bus).is_some());
    assert_eq!(cpu.registers.exception, number::HARD_FAULT);
    assert_eq!(cpu.registers.r[15], handler(3));
    assert_eq!(get(&mut cpu, HFSR), 1 << 1, "VECTTBL");
}

#[test]
fn without_a_vector_of_hard_fault_the_core_locks_up() {
    let (mut cpu, mut bus) = machine();
    set(&mut cpu, 0xE000_ED08, 0x3000_0000);
    let taken = cpu.take_fault(&mut bus, Fault::Undefined);
    assert_eq!(taken, Err(Stop::LockUp { pc: MAIN }));
}

#[test]
fn a_vector_without_its_thumb_bit_faults_in_the_handler() {
    let (mut cpu, mut bus) = machine();
    assert!(bus.load(Flat::FLASH + 4 * 16, &handler(16).to_le_bytes()));
    pend(&mut cpu, 0, 0x40);
    assert_eq!(take(&mut cpu, &mut bus), Some(24));
    assert_eq!(cpu.registers.exception, number::HARD_FAULT);
    assert_eq!(get(&mut cpu, CFSR), 1 << 17, "INVSTATE");
    assert_eq!(bus.word(STACK - 0x28), Some(handler(16)));
}

#[test]
fn a_reset_request_reaches_the_bus() {
    let (mut cpu, mut bus) = machine();
    cpu.cycle = 55;
    set(&mut cpu, 0xE000_ED0C, 0x05FA_0004);
    assert_eq!(take(&mut cpu, &mut bus), None);
    assert_eq!(bus.reset_requested, Some(55));
    assert_eq!(cpu.reset(&mut bus), Ok(()));
    assert_eq!((cpu.registers.r[13], cpu.registers.r[15]), (STACK, MAIN));
    assert_eq!(get(&mut cpu, 0xE000_E100), 0);
}

#[test]
fn without_a_vector_table_there_is_no_reset() {
    let mut bus = Flat::default();
    let mut cpu = Cpu::default();
    let none = Stop::Outside {
        pc: 0,
        what: "no vector table at address 0",
    };
    assert_eq!(cpu.reset(&mut bus), Err(none));
}

/// ldr r0, =0x3000_0000; str r0, [r0]; movs r1, #1; movs r1, #2; b .
const STORE_TO_NOWHERE: [u16; 6] = [0x2030, 0x0600, 0x6000, 0x2101, 0x2102, 0xE7FE];

#[test]
fn a_buffered_store_faults_after_its_instruction() {
    let (mut cpu, mut bus) = machine();
    set(&mut cpu, 0xE000_ED24, ALL_FAULTS);
    code(&mut bus, MAIN, &STORE_TO_NOWHERE);
    assert_eq!(run(&mut cpu, &mut bus, 10), Ok(()));
    assert_eq!(cpu.registers.exception, number::BUS_FAULT);
    assert_eq!(get(&mut cpu, CFSR), 1 << 10, "IMPRECISERR, no address");
    assert_eq!(bus.word(STACK - 8), Some(MAIN + 6), "the next instruction");
    // The fault stays pending until its priority suffices.
    let (mut cpu, mut bus) = machine();
    set(&mut cpu, 0xE000_ED24, ALL_FAULTS);
    cpu.registers.primask = true;
    code(&mut bus, MAIN, &STORE_TO_NOWHERE);
    assert_eq!(run(&mut cpu, &mut bus, 20), Ok(()));
    assert_eq!((cpu.registers.exception, cpu.registers.r[1]), (0, 2));
    assert_eq!(cpu.system.nvic.pending, 1 << number::BUS_FAULT);
}

#[test]
fn without_the_write_buffer_the_store_itself_faults() {
    let (mut cpu, mut bus) = machine();
    set(&mut cpu, 0xE000_ED24, ALL_FAULTS);
    set(&mut cpu, 0xE000_E008, 1 << 1); // ACTLR.DISDEFWBUF
    code(&mut bus, MAIN, &STORE_TO_NOWHERE);
    assert_eq!(run(&mut cpu, &mut bus, 10), Ok(()));
    assert_eq!(cpu.registers.exception, number::BUS_FAULT);
    let expected = 1 << 9 | 1 << 15;
    assert_eq!(get(&mut cpu, CFSR), expected, "PRECISERR, BFARVALID");
    assert_eq!(get(&mut cpu, 0xE000_ED38), 0x3000_0000);
    assert_eq!(bus.word(STACK - 8), Some(MAIN + 4), "the store");
}

/// Checks that UDF with faults masked locks up: the run ends, or the core stands until a reset.
#[test]
fn a_core_that_locked_up_stands_until_a_reset() {
    let (mut cpu, mut bus) = machine();
    code(&mut bus, MAIN, &[0xDE00]); // udf
    cpu.registers.faultmask = true;
    let pc = MAIN;
    assert_eq!(cpu.run(&mut bus, 1_000), Err(Stop::LockUp { pc }));
    cpu.open = Open::Undefined;
    assert_eq!(cpu.run(&mut bus, 1_000), Ok(()));
    let (cycle, done) = (cpu.cycle, cpu.instructions);
    assert_eq!(cpu.run(&mut bus, 5_000), Ok(()));
    assert!(cycle >= 1_000 && cpu.cycle >= 5_000);
    assert_eq!((cpu.instructions, cpu.registers.r[15]), (done, pc));
    code(&mut bus, MAIN, &[0xE7FE]); // b .
    assert_eq!(cpu.reset(&mut bus), Ok(()));
    let until = cpu.cycle + 100;
    assert_eq!(cpu.run(&mut bus, until), Ok(()));
    assert!(cpu.instructions > done);
}

#[test]
fn a_halted_core_does_nothing_and_its_systick_stands() {
    let (mut cpu, mut bus) = machine();
    set(&mut cpu, 0xE000_E014, 999);
    set(&mut cpu, 0xE000_E018, 0);
    set(&mut cpu, 0xE000_E010, 7);
    cpu.run(&mut bus, 100).unwrap();
    cpu.set_halted(true);
    let done = cpu.instructions;
    cpu.run(&mut bus, 10_000).unwrap();
    assert_eq!(cpu.instructions, done);
    cpu.set_halted(false);
    let next = cpu.system.next_event();
    assert!((10_800..11_000).contains(&next), "{next}");
    cpu.run(&mut bus, next - 5).unwrap();
    while cpu.registers.exception == 0 && cpu.cycle < next + 20 {
        cpu.step(&mut bus).unwrap();
    }
    assert_eq!(cpu.registers.exception, 15);
}

#[test]
fn a_jump_without_the_thumb_bit_is_a_fault() {
    let (mut cpu, mut bus) = machine();
    assert_eq!(cpu.jump(&mut bus, (MAIN + 4) | 1), Ok(()));
    assert_eq!(cpu.registers.r[15], MAIN + 4);
    assert_eq!(cpu.jump(&mut bus, MAIN + 4), Ok(()));
    assert_eq!(cpu.registers.exception, 3);
}

/// Checks the choices for IT with the condition 1111, which is UNPREDICTABLE.
#[test]
fn what_is_left_open_does_what_was_chosen() {
    for (open, exception) in [(Open::Undefined, 3), (Open::Nothing, 0)] {
        let (mut cpu, mut bus) = machine();
        code(&mut bus, MAIN, &[0xBFF8, 0xE7FE]);
        assert!(cpu.run(&mut bus, 50).is_err());
        cpu.open = open;
        cpu.step(&mut bus).unwrap();
        assert_eq!(cpu.registers.exception, exception);
    }
}
