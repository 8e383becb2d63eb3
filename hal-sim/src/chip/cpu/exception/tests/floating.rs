//! Tests the floating-point context: lazy saving, FPCA, CPACR (Arm ARM B1.5.7).

use super::*;
use crate::chip::cpu::registers::control;
use crate::chip::cpu::system::number;
use crate::chip::cpu::{Fault, Trap};

const FPCCR: u32 = 0xE000_EF34;
const ASPEN: u32 = 1 << 31;
const LSPEN: u32 = 1 << 30;

/// Returns a core whose thread has used floating point: S0–S31 are 1.0, 2.0, ….
fn with_context(fpccr: u32) -> (Cpu, Flat) {
    let (mut cpu, mut bus) = machine();
    set(&mut cpu, 0xE000_ED88, 0xF << 20);
    set(&mut cpu, FPCCR, fpccr);
    assert_eq!(cpu.prepare_fp(&mut bus), Ok(()));
    for (n, s) in (1_u8..).zip(&mut cpu.registers.s) {
        *s = f32::from(n).to_bits();
    }
    cpu.registers.fpscr = 0x8000_0010;
    (cpu, bus)
}

fn saved(bus: &Flat, frame: u32) -> Vec<u32> {
    (0..17)
        .filter_map(|n| bus.word(frame + 0x20 + 4 * n))
        .collect()
}

#[test]
fn cpacr_decides() {
    for (cpacr, privileged, unprivileged) in [
        (0b00, false, false),
        (0b01, true, false),
        (0b10, false, false),
        (0b11, true, true),
    ] {
        let (mut cpu, mut bus) = machine();
        set(&mut cpu, 0xE000_ED88, cpacr << 20 | cpacr << 22);
        let denied = Err(Trap::Fault(Fault::NoCoprocessor));
        let expected = |allowed| if allowed { Ok(()) } else { denied };
        assert_eq!(cpu.prepare_fp(&mut bus), expected(privileged));
        cpu.write_special(20, 2, 1);
        assert_eq!(cpu.prepare_fp(&mut bus), expected(unprivileged));
    }
}

#[test]
fn the_first_instruction_begins_a_context() {
    let (mut cpu, mut bus) = machine();
    set(&mut cpu, 0xE000_ED88, 0xF << 20);
    set(&mut cpu, 0xE000_EF3C, 0xFFFF_FFFF);
    cpu.registers.fpscr = 0xF000_009F;
    assert_eq!(cpu.prepare_fp(&mut bus), Ok(()));
    assert_eq!(cpu.registers.control, control::FPCA);
    assert_eq!(cpu.registers.fpscr, 0xF7C0_009F, "FPDSCR's five bits");
    assert!(cpu.system.fp_is_ready);
    cpu.registers.fpscr = 0;
    assert_eq!(cpu.prepare_fp(&mut bus), Ok(()));
    assert_eq!(cpu.registers.fpscr, 0, "the second does not");
}

#[test]
fn neither_aspen_off_nor_disfpca_begin_one() {
    let (mut cpu, mut bus) = machine();
    set(&mut cpu, 0xE000_ED88, 0xF << 20);
    set(&mut cpu, FPCCR, 0);
    assert_eq!(cpu.prepare_fp(&mut bus), Ok(()));
    assert_eq!(cpu.registers.control, 0);
    set(&mut cpu, FPCCR, ASPEN | LSPEN);
    set(&mut cpu, 0xE000_E008, 1 << 8);
    assert_eq!(cpu.prepare_fp(&mut bus), Ok(()));
    assert_eq!(cpu.registers.control, 0, "ACTLR.DISFPCA");
    set(&mut cpu, 0xE000_E008, 0);
    assert_eq!(cpu.prepare_fp(&mut bus), Ok(()));
    assert_eq!(cpu.registers.control, control::FPCA);
}

#[test]
fn a_lazy_entry_leaves_room_and_time() {
    let (mut cpu, mut bus) = with_context(ASPEN | LSPEN);
    pend(&mut cpu, 0, 0x40);
    assert_eq!(take(&mut cpu, &mut bus), Some(12));
    let frame = STACK - 0x68;
    assert_eq!(cpu.registers.r[13], frame);
    assert_eq!(cpu.registers.r[14], 0xFFFF_FFE9);
    assert_eq!(cpu.registers.control, 0, "FPCA is cleared");
    assert_eq!(get(&mut cpu, 0xE000_EF38), frame + 0x20, "FPCAR");
    // LSPACT, THREAD, HFRDY; the fault exceptions are disabled.
    assert_eq!(get(&mut cpu, FPCCR), ASPEN | LSPEN | 1 | 1 << 3 | 1 << 4);
    assert_eq!(saved(&bus, frame), [0; 17], "nothing is stacked");
    // A handler without floating point returns as fast as it was entered.
    assert_eq!(leave(&mut cpu, &mut bus), 12);
    assert_eq!(cpu.registers.r[13], STACK);
    assert_eq!(cpu.registers.control, control::FPCA);
    assert_eq!(get(&mut cpu, FPCCR) & 1, 0, "LSPACT");
    assert_eq!(cpu.registers.s[3], 4_f32.to_bits());
}

#[test]
fn the_first_instruction_of_the_handler_pays_seventeen_words() {
    let (mut cpu, mut bus) = with_context(ASPEN | LSPEN);
    pend(&mut cpu, 0, 0x40);
    take(&mut cpu, &mut bus);
    let frame = STACK - 0x68;
    let before = cpu.cycle;
    assert_eq!(cpu.prepare_fp(&mut bus), Ok(()));
    assert_eq!(cpu.cycle - before, 17);
    let mut expected: Vec<u32> = (1..=16_u8).map(|n| f32::from(n).to_bits()).collect();
    expected.push(0x8000_0010);
    assert_eq!(saved(&bus, frame), expected);
    assert_eq!(cpu.prepare_fp(&mut bus), Ok(()));
    assert_eq!(cpu.cycle - before, 17, "once");
    cpu.registers.s = [0; 32];
    cpu.registers.fpscr = 0;
    assert_eq!(leave(&mut cpu, &mut bus), 12 + 17);
    assert_eq!(cpu.registers.s[..16], expected[..16]);
    assert_eq!(cpu.registers.s[16..], [0; 16], "S16–S31 are the program's");
    assert_eq!(cpu.registers.fpscr, 0x8000_0010);
}

#[test]
fn without_lspen_entry_stacks_all() {
    let (mut cpu, mut bus) = with_context(ASPEN);
    pend(&mut cpu, 0, 0x40);
    assert_eq!(take(&mut cpu, &mut bus), Some(29));
    assert_eq!(saved(&bus, STACK - 0x68)[15], 16_f32.to_bits());
    assert_eq!(leave(&mut cpu, &mut bus), 29);
}

#[test]
fn a_nested_handler_saves_what_the_thread_owes() {
    let (mut cpu, mut bus) = with_context(ASPEN | LSPEN);
    pend(&mut cpu, 0, 0x80);
    take(&mut cpu, &mut bus);
    pend(&mut cpu, 1, 0x40);
    assert_eq!(take(&mut cpu, &mut bus), Some(12));
    assert_eq!(cpu.registers.r[14], 0xFFFF_FFF1, "a basic frame");
    assert_eq!(cpu.prepare_fp(&mut bus), Ok(()));
    assert_eq!(saved(&bus, STACK - 0x68)[0], 1_f32.to_bits());
    cpu.registers.s[0] = 0;
    assert_eq!(leave(&mut cpu, &mut bus), 12);
    assert_eq!(cpu.registers.control, 0);
    assert_eq!(leave(&mut cpu, &mut bus), 29);
    assert_eq!(cpu.registers.s[0], 1_f32.to_bits());
}

#[test]
fn tail_chaining_keeps_owing() {
    let (mut cpu, mut bus) = with_context(ASPEN | LSPEN);
    pend(&mut cpu, 0, 0x80);
    take(&mut cpu, &mut bus);
    pend(&mut cpu, 1, 0x80);
    assert_eq!(leave(&mut cpu, &mut bus), 6);
    assert_eq!(get(&mut cpu, FPCCR) & 1, 1);
    assert_eq!(cpu.prepare_fp(&mut bus), Ok(()));
    assert_eq!(leave(&mut cpu, &mut bus), 29);
}

#[test]
fn a_lazy_save_into_the_guard_is_a_hard_fault() {
    let (mut cpu, mut bus) = with_context(ASPEN | LSPEN);
    pend(&mut cpu, 0, 0x80);
    take(&mut cpu, &mut bus);
    let frame = cpu.registers.r[13];
    set(&mut cpu, 0xE000_ED9C, (frame + 0x20) & !0x1F | 1 << 4);
    set(&mut cpu, 0xE000_EDA0, 1 << 28 | 4 << 1 | 1);
    set(&mut cpu, 0xE000_ED94, 0b101);
    cpu.registers.r[13] = frame - 0x40;
    code(&mut bus, handler(16), &[0xEE30, 0x0A20]); // vadd.f32 s0, s0, s1
    assert_eq!(cpu.step(&mut bus), Ok(()));
    assert_eq!(cpu.registers.exception, number::HARD_FAULT);
    assert_eq!(get(&mut cpu, 0xE000_ED28), 1 << 5, "MLSPERR");
    assert_eq!(get(&mut cpu, FPCCR) & 1, 1, "still owed");
}
