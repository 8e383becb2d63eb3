//! Tests exception return: tail-chaining, pre-emption of a pop, integrity.

use super::*;
use crate::chip::cpu::system::number;

#[test]
fn tail_chaining_takes_six_cycles_and_no_stack() {
    let (mut cpu, mut bus) = machine();
    pend(&mut cpu, 1, 0x40);
    take(&mut cpu, &mut bus);
    pend(&mut cpu, 2, 0x40);
    assert_eq!(take(&mut cpu, &mut bus), None);
    let sp = cpu.registers.r[13];
    assert_eq!(leave(&mut cpu, &mut bus), 6);
    assert_eq!(cpu.registers.exception, 18);
    assert_eq!(cpu.registers.r[13], sp);
    assert_eq!(cpu.registers.r[14], 0xFFFF_FFF9);
    assert_eq!(leave(&mut cpu, &mut bus), 12);
    assert_eq!((cpu.registers.exception, cpu.registers.r[15]), (0, MAIN));
}

#[test]
fn a_nested_return_tail_chains_only_to_what_beats_the_handler_below() {
    let (mut cpu, mut bus) = machine();
    pend(&mut cpu, 1, 0x80);
    take(&mut cpu, &mut bus);
    pend(&mut cpu, 2, 0x40);
    take(&mut cpu, &mut bus);
    pend(&mut cpu, 3, 0x80);
    assert_eq!(leave(&mut cpu, &mut bus), 12, "line 3 waits for line 1");
    assert_eq!(cpu.registers.exception, 17);
    assert_eq!(leave(&mut cpu, &mut bus), 6);
    assert_eq!(cpu.registers.exception, 19);
}

#[test]
fn a_line_that_is_still_high_comes_again() {
    let (mut cpu, mut bus) = machine();
    bus.lines = [1, 0, 0];
    assert_eq!(take(&mut cpu, &mut bus), Some(12));
    assert_eq!(leave(&mut cpu, &mut bus), 6);
    assert_eq!(cpu.registers.exception, 16);
    bus.lines = [0; 3];
    assert_eq!(leave(&mut cpu, &mut bus), 12);
}

#[test]
fn unstacking_is_given_up_for_an_exception() {
    // Line 1 rises `after` cycles into the return: the pop is abandoned at the next word, and
    // tail-chaining takes six cycles from there.
    for (after, cycles) in [(2, 8), (5, 11), (8, 14)] {
        let (mut cpu, mut bus) = machine();
        pend(&mut cpu, 0, 0x40);
        take(&mut cpu, &mut bus);
        let sp = cpu.registers.r[13];
        cpu.registers.r[0] = 0xAAAA;
        bus.schedule.push_back((cpu.cycle + after, [0b10, 0, 0]));
        assert_eq!(leave(&mut cpu, &mut bus), cycles, "{after}");
        assert_eq!(cpu.registers.exception, 17);
        assert_eq!(cpu.registers.r[13], sp, "the frame is still there");
        assert_eq!(cpu.registers.r[0], 0xAAAA, "nothing was restored");
        bus.lines = [0; 3];
        assert_eq!(leave(&mut cpu, &mut bus), 12);
        assert_eq!(cpu.registers.r[15], MAIN);
    }
}

#[test]
fn wait_states_delay_the_return() {
    for (ram_wait, line_wait, cycles) in [(1, 0, 20), (0, 5, 12), (0, 12, 16)] {
        let (mut cpu, mut bus) = machine();
        pend(&mut cpu, 0, 0);
        take(&mut cpu, &mut bus);
        bus.ram_wait = ram_wait;
        bus.line_wait = line_wait;
        assert_eq!(leave(&mut cpu, &mut bus), cycles, "{ram_wait}, {line_wait}");
    }
}

/// Returns a core in line 0's handler with usage faults enabled; if `nested`, another handler is
/// active below.
fn in_handler(nested: bool) -> (Cpu, Flat) {
    let (mut cpu, mut bus) = machine();
    set(&mut cpu, 0xE000_ED24, 1 << 18);
    if nested {
        pend(&mut cpu, 1, 0x80);
        take(&mut cpu, &mut bus);
    }
    pend(&mut cpu, 0, 0x40);
    take(&mut cpu, &mut bus);
    (cpu, bus)
}

#[test]
fn illegal_returns_are_usage_faults() {
    for (nested, exc_return) in [
        (false, 0xFFFF_FFF1), // to a handler that is not active
        (true, 0xFFFF_FFF9),  // to thread mode over an active handler
        (true, 0xFFFF_FFFD),
        (false, 0xFFFF_FFF0), // no valid value
        (false, 0xFFFF_FFF5),
        (false, 0xFFFF_FFFB),
        (false, 0xFFFF_FF99), // bits 27:5 are not all ones
        (false, 0xF000_0009),
    ] {
        let (mut cpu, mut bus) = in_handler(nested);
        let before = cpu.registers.r[13];
        let returned = cpu.return_from_exception(&mut bus, exc_return);
        assert_eq!(returned, Ok(()));
        assert_eq!(cpu.registers.exception, number::USAGE_FAULT);
        assert_eq!(get(&mut cpu, 0xE000_ED28), 1 << 18, "INVPC");
        assert_eq!(cpu.registers.r[13], before, "no second frame");
        assert_eq!(cpu.registers.r[14], exc_return);
        let active: Vec<u16> = cpu.system.active().collect();
        let below: &[u16] = if nested { &[6, 17] } else { &[6] };
        assert_eq!(active, below, "line 0 is over");
    }
}

#[test]
fn ccr_allows_thread_mode_over_a_handler() {
    let (mut cpu, mut bus) = in_handler(true);
    set(&mut cpu, 0xE000_ED14, 0x201);
    // The frame says handler 17; patch it to thread mode.
    let frame = cpu.registers.r[13];
    assert!(bus.load(frame + 0x1C, &0x0100_0000_u32.to_le_bytes()));
    let returned = cpu.return_from_exception(&mut bus, 0xFFFF_FFF9);
    assert_eq!((returned, cpu.registers.exception), (Ok(()), 0));
}

#[test]
fn the_frame_must_agree_with_the_mode() {
    // Thread mode in the frame, handler mode in EXC_RETURN.
    let (mut cpu, mut bus) = in_handler(true);
    let frame = cpu.registers.r[13];
    assert!(bus.load(frame + 0x1C, &0x0100_0000_u32.to_le_bytes()));
    leave(&mut cpu, &mut bus);
    assert_eq!(cpu.registers.exception, number::USAGE_FAULT);
    assert_eq!(get(&mut cpu, 0xE000_ED28), 1 << 18);
}

#[test]
fn a_frame_without_thumb_state_is_a_fault_where_it_returns() {
    let (mut cpu, mut bus) = in_handler(false);
    let frame = cpu.registers.r[13];
    assert!(bus.load(frame + 0x1C, &[0; 4]));
    assert_eq!(leave(&mut cpu, &mut bus), 24);
    assert_eq!(cpu.registers.exception, number::USAGE_FAULT);
    assert_eq!(get(&mut cpu, 0xE000_ED28), 1 << 17, "INVSTATE");
    assert_eq!(bus.word(frame + 0x18), Some(MAIN));
}

#[test]
fn faultmask_ends_with_the_handler_but_not_with_nmi() {
    let (mut cpu, mut bus) = in_handler(false);
    cpu.write_special(19, 2, 1);
    assert!(cpu.registers.faultmask);
    leave(&mut cpu, &mut bus);
    assert!(!cpu.registers.faultmask);
    let (mut cpu, mut bus) = machine();
    cpu.write_special(19, 2, 1);
    set(&mut cpu, 0xE000_ED04, 1 << 31);
    take(&mut cpu, &mut bus);
    assert_eq!(cpu.registers.exception, number::NMI);
    leave(&mut cpu, &mut bus);
    assert!(cpu.registers.faultmask);
}

#[test]
fn sleep_on_exit() {
    let (mut cpu, mut bus) = machine();
    set(&mut cpu, 0xE000_ED10, 1 << 1);
    bus.schedule.push_back((20, [1, 0, 0]));
    code(&mut bus, handler(16), &[0x4770]);
    assert_eq!(run(&mut cpu, &mut bus, 40), Ok(()));
    bus.lines = [0; 3];
    assert_eq!(run(&mut cpu, &mut bus, 1000), Ok(()));
    assert!(cpu.is_asleep());
    assert_eq!((cpu.cycle, cpu.registers.r[15]), (1000, MAIN));
}
