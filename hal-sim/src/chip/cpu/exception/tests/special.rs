//! Tests special registers, masks, sleep and semihosting.

use super::*;
use crate::chip::cpu::registers::flag;
use crate::chip::cpu::semihosting::Semihosting;
use crate::chip::cpu::system::number;

#[test]
fn flags_are_written_by_mask() {
    for (mask, written) in [
        (0b10, 0xF800_0000),
        (0b01, 0x000F_0000),
        (0b11, 0xF80F_0000),
    ] {
        let (mut cpu, _) = machine();
        cpu.write_special(0, mask, u32::MAX);
        assert_eq!(cpu.registers.apsr, written);
        assert_eq!(cpu.read_special(0), written);
        assert_eq!(cpu.read_special(3), written, "xPSR: EPSR reads 0");
        assert_eq!(cpu.read_special(5), 0, "IPSR");
    }
}

#[test]
fn handlers_see_their_number() {
    let (mut cpu, mut bus) = machine();
    cpu.registers.apsr = flag::Z;
    pend(&mut cpu, 81, 0);
    take(&mut cpu, &mut bus);
    assert_eq!(cpu.read_special(5), 97);
    assert_eq!(cpu.read_special(1), 97 | flag::Z);
    assert_eq!(cpu.read_special(7), 97, "IEPSR has no flags");
}

#[test]
fn masks_stack_pointers_and_control_with_privilege() {
    let (mut cpu, _) = machine();
    for (sysm, value, read) in [
        (8, 0x2000_0807, 0x2000_0804),
        (9, 0x2000_0503, 0x2000_0500),
        (16, 3, 1),
        (17, 0x57, 0x50),
        (18, 0x60, 0x50), // BASEPRI_MAX can only mask more
        (18, 0x00, 0x50),
        (18, 0x40, 0x40),
        (19, 1, 1),
        (20, 0b110, 0b110),
    ] {
        cpu.write_special(sysm, 2, value);
        assert_eq!(cpu.read_special(sysm), read, "register {sysm}");
    }
    assert_eq!(cpu.registers.r[13], 0x2000_0500, "SPSEL");
    assert_eq!(cpu.registers.other_sp, 0x2000_0804);
    cpu.write_special(8, 2, 0x2000_0900);
    assert_eq!(cpu.registers.other_sp, 0x2000_0900);
}

#[test]
fn without_privilege_only_flags_and_control_show() {
    let (mut cpu, _) = machine();
    cpu.write_special(17, 2, 0x80);
    cpu.write_special(20, 2, 1);
    for (sysm, value) in [(8, 0), (9, 0), (16, 0), (17, 0), (19, 0), (20, 1)] {
        cpu.write_special(sysm, 2, 0x2000_0010);
        assert_eq!(cpu.read_special(sysm), value, "register {sysm}");
    }
    assert_eq!(cpu.registers.msp(), STACK);
    assert_eq!(cpu.registers.basepri, 0x80);
    cpu.write_special(0, 2, u32::MAX);
    assert_eq!(cpu.read_special(0), 0xF800_0000);
}

#[test]
fn faultmask_cannot_be_set_in_hard_fault() {
    let (mut cpu, mut bus) = machine();
    set(&mut cpu, 0xE000_ED04, 1 << 31);
    take(&mut cpu, &mut bus);
    assert_eq!(cpu.registers.exception, number::NMI);
    cpu.write_special(19, 2, 1);
    assert!(!cpu.registers.faultmask);
}

#[test]
fn an_interrupt_wakes_wfi_under_primask_and_waits_for_cpsie() {
    let (mut cpu, mut bus) = machine();
    // cpsid i; wfi; movs r0, #1; cpsie i; b .
    code(&mut bus, MAIN, &[0xB672, 0xBF30, 0x2001, 0xB662, 0xE7FE]);
    bus.schedule.push_back((500, [1, 0, 0]));
    code(&mut bus, handler(16), &[0xE7FE]);
    assert_eq!(run(&mut cpu, &mut bus, 490), Ok(()));
    assert!(cpu.is_asleep());
    assert_eq!(cpu.registers.r[0], 0);
    assert_eq!(run(&mut cpu, &mut bus, 540), Ok(()));
    assert_eq!((cpu.registers.r[0], cpu.registers.exception), (1, 16));
    assert_eq!(bus.word(STACK - 8), Some(MAIN + 8), "after CPSIE");
}

#[test]
fn basepri_holds_wfi_back() {
    let (mut cpu, mut bus) = machine();
    code(&mut bus, MAIN, &[0xBF30, 0xE7FE]); // wfi; b .
    cpu.write_special(17, 2, 0x40);
    cpu.system.nvic.set_priority(16, 0x40);
    bus.schedule.push_back((50, [1, 0, 0]));
    assert_eq!(run(&mut cpu, &mut bus, 100), Ok(()));
    assert!(cpu.is_asleep());
}

#[test]
fn events_and_wfe() {
    let (mut cpu, mut bus) = machine();
    // sev; wfe; movs r0, #1; wfe; movs r0, #2; b .
    code(
        &mut bus,
        MAIN,
        &[0xBF40, 0xBF20, 0x2001, 0xBF20, 0x2002, 0xE7FE],
    );
    assert_eq!(run(&mut cpu, &mut bus, 100), Ok(()));
    assert!(cpu.is_asleep(), "the first WFE found the event of SEV");
    assert_eq!(cpu.registers.r[0], 1);
    // A masked interrupt wakes the core only with SEVONPEND.
    cpu.registers.primask = true;
    set(&mut cpu, 0xE000_EF00, 5);
    assert_eq!(run(&mut cpu, &mut bus, 200), Ok(()));
    assert!(cpu.is_asleep());
    set(&mut cpu, 0xE000_E280, 1 << 5);
    set(&mut cpu, 0xE000_ED10, 1 << 4);
    set(&mut cpu, 0xE000_E180, 1 << 5);
    set(&mut cpu, 0xE000_EF00, 5);
    assert_eq!(run(&mut cpu, &mut bus, 300), Ok(()));
    assert!(!cpu.is_asleep(), "even a disabled one");
    assert_eq!(cpu.registers.r[0], 2);
}

#[test]
fn systick_wakes_the_core_on_its_cycle() {
    let (mut cpu, mut bus) = machine();
    code(&mut bus, MAIN, &[0xBF30, 0xE7FD]); // wfi; b main
    code(&mut bus, handler(15), &[0x3601, 0x4770]); // adds r6, #1; bx lr
    set(&mut cpu, 0xE000_E014, 999);
    set(&mut cpu, 0xE000_E010, 0b111);
    assert_eq!(run(&mut cpu, &mut bus, 100_500), Ok(()));
    assert_eq!(cpu.registers.r[6], 100);
    let found: Vec<_> = cpu.system.latencies.entered().collect();
    assert_eq!(found.len(), 1);
    assert_eq!((found[0].1.count, found[0].1.worst), (100, 12));
}

/// Executes the BKPT at MAIN; returns the result, R0 afterwards, and the host's state.
fn call(number: u32, block: &[u32]) -> (Result<(), Stop>, u32, Semihosting) {
    let (mut cpu, mut bus) = machine();
    cpu.system.semihosting = Some(Semihosting::default());
    code(&mut bus, MAIN, &[0xBEAB, 0xE7FE]);
    let at = Flat::SRAM + 0x200;
    for (index, word) in (0..).zip(block) {
        assert!(bus.load(at + 4 * index, &word.to_le_bytes()));
    }
    assert!(bus.load(Flat::SRAM, b":tt\0hello\0"));
    cpu.registers.r[0] = number;
    cpu.registers.r[1] = at;
    let stepped = cpu.step(&mut bus);
    let host = cpu.system.semihosting.take().unwrap_or_default();
    (stepped, cpu.registers.r[0], host)
}

#[test]
fn semihosting_answers() {
    let tt = Flat::SRAM;
    assert_eq!(call(1, &[tt, 4, 3]).1, 1, "OPEN :tt");
    assert_eq!(call(1, &[tt + 4, 0, 5]).1, u32::MAX, "nothing to read");
    let (_, handle, host) = call(1, &[tt + 4, 4, 5]);
    assert_eq!(handle, 1);
    assert!(host.files.contains_key("hello"));
    assert_eq!(call(5, &[9, tt, 3]).1, 3, "WRITE to no handle");
    assert_eq!(call(2, &[9]).1, u32::MAX, "CLOSE of no handle");
    assert_eq!(call(3, &[u32::from(b'x')]).2.console, b"x");
    let exit = |number, block: &[u32]| call(number, block).0;
    assert_eq!(exit(0x20, &[0x2_0026, 7]), Err(Stop::Exit(7)));
    assert_eq!(exit(0x20, &[0x2_0023, 0]), Err(Stop::Exit(1)));
    assert!(matches!(exit(0x30, &[]), Err(Stop::Instruction { .. })));
    assert!(matches!(
        exit(5, &[1, 0x3000_0000, 1]),
        Err(Stop::Access { access, .. }) if access.address == 0x3000_0000
    ));
}

#[test]
fn a_program_prints_and_ends() {
    let (mut cpu, mut bus) = machine();
    cpu.system.semihosting = Some(Semihosting::default());
    let block = Flat::SRAM + 0x200;
    assert!(bus.load(Flat::SRAM, b":tt\0hello\0"));
    let words = [Flat::SRAM, 4, 3, 1, Flat::SRAM + 4, 5, 0x2_0026];
    for (index, word) in (0..).zip(words) {
        assert!(bus.load(block + 4 * index, &word.to_le_bytes()));
    }
    // r1 = block: OPEN; r1 = block + 12: WRITE; r1 = "hello": WRITE0; EXIT.
    code(
        &mut bus,
        MAIN,
        &[
            0x2001, 0xBEAB, // movs r0, #1; bkpt
            0x310C, 0x2005, 0xBEAB, // adds r1, #12; movs r0, #5; bkpt
            0x6849, 0x2004, 0xBEAB, // ldr r1, [r1, #4]; movs r0, #4; bkpt
            0x0011, 0x2018, 0xBEAB, // movs r1, r2; movs r0, #0x18; bkpt
        ],
    );
    cpu.registers.r[1] = block;
    cpu.registers.r[2] = 0x2_0026;
    assert_eq!(run(&mut cpu, &mut bus, 1000), Err(Stop::Exit(0)));
    let host = cpu.system.semihosting.take().unwrap_or_default();
    assert_eq!(host.console, b"hellohello");
}
