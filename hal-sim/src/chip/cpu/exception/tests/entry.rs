//! Tests exception entry: frame, stack pointers, cycles, late arrival, latency.

use super::*;
use crate::chip::cpu::registers::{control, flag};

#[test]
fn the_frame_is_what_the_manual_draws() {
    let (mut cpu, mut bus) = machine();
    for (index, register) in (0..13).zip(&mut cpu.registers.r) {
        *register = 0x100 + index;
    }
    cpu.registers.r[14] = 0x0800_1235;
    cpu.registers.apsr = flag::N | flag::C | flag::Q | 0xA << 16;
    cpu.registers.it = 0b1010_0110;
    pend(&mut cpu, 3, 0x40);
    assert_eq!(take(&mut cpu, &mut bus), Some(12));
    let frame = STACK - 0x20;
    assert_eq!(cpu.registers.r[13], frame);
    let words: Vec<u32> = (0..8).filter_map(|n| bus.word(frame + 4 * n)).collect();
    // ITSTATE 7:2 in bits 15:10, 1:0 in 26:25; the Thumb bit.
    let xpsr = 0xA80A_0000 | 0b10_1001 << 10 | 0b10 << 25 | 1 << 24;
    let expected = [0x100, 0x101, 0x102, 0x103, 0x10C, 0x0800_1235, MAIN, xpsr];
    assert_eq!(words, expected);
    assert_eq!(cpu.registers.r[14], 0xFFFF_FFF9);
    assert_eq!(cpu.registers.r[15], handler(19));
    assert_eq!((cpu.registers.exception, cpu.registers.it), (19, 0));
    assert!(cpu.system.event);
    // The return restores everything.
    let before = (cpu.registers.r, cpu.registers.apsr);
    cpu.registers.r = [7; 16];
    cpu.registers.r[13] = frame;
    cpu.registers.r[14] = 0xFFFF_FFF9;
    cpu.registers.apsr = 0;
    assert_eq!(leave(&mut cpu, &mut bus), 12);
    assert_eq!(cpu.registers.r[..4], before.0[..4]);
    assert_eq!(cpu.registers.r[4..12], [7; 8]);
    assert_eq!(cpu.registers.r[12], 0x10C);
    let expected = [STACK, 0x0800_1235, MAIN];
    assert_eq!(cpu.registers.r[13..], expected, "SP, LR, PC");
    assert_eq!(cpu.registers.apsr, before.1);
    let expected = (0b1010_0110, 0);
    assert_eq!((cpu.registers.it, cpu.registers.exception), expected);
}

#[test]
fn the_stack_is_aligned_to_eight_bytes_if_ccr_says_so() {
    for (stkalign, sp, frame, bit_9) in [
        (true, STACK, STACK - 0x20, 0),
        (true, STACK + 4, STACK + 4 - 0x24, 1),
        (false, STACK + 4, STACK + 4 - 0x20, 0),
    ] {
        let (mut cpu, mut bus) = machine();
        set(&mut cpu, 0xE000_ED14, u32::from(stkalign) << 9);
        cpu.registers.r[13] = sp;
        pend(&mut cpu, 0, 0);
        assert_eq!(take(&mut cpu, &mut bus), Some(12));
        assert_eq!(cpu.registers.r[13], frame);
        let xpsr = bus.word(frame + 0x1C).unwrap_or(0);
        assert_eq!(xpsr >> 9 & 1, bit_9);
        leave(&mut cpu, &mut bus);
        assert_eq!(cpu.registers.r[13], sp);
    }
}

#[test]
fn thread_mode_on_the_process_stack() {
    let (mut cpu, mut bus) = machine();
    cpu.registers.other_sp = STACK - 0x400;
    cpu.write_special(20, 2, 0b10);
    assert_eq!(cpu.registers.r[13], STACK - 0x400);
    pend(&mut cpu, 0, 0x40);
    take(&mut cpu, &mut bus);
    assert_eq!(cpu.registers.r[14], 0xFFFF_FFFD);
    assert_eq!(cpu.registers.r[13], STACK, "the main stack is untouched");
    assert_eq!(cpu.registers.psp(), STACK - 0x420);
    assert_eq!(cpu.read_special(20), 0, "SPSEL reads 0 in handler mode");
    // A nested exception uses the main stack, and EXC_RETURN shows it.
    pend(&mut cpu, 1, 0x10);
    take(&mut cpu, &mut bus);
    assert_eq!(cpu.registers.r[14], 0xFFFF_FFF1);
    assert_eq!(cpu.registers.r[13], STACK - 0x20);
    assert_eq!(leave(&mut cpu, &mut bus), 12);
    assert_eq!(cpu.registers.exception, 16);
    assert_eq!(leave(&mut cpu, &mut bus), 12);
    assert_eq!(cpu.registers.r[13], STACK - 0x400);
    assert_eq!(cpu.registers.msp(), STACK);
    assert_eq!(cpu.read_special(20), u32::from(control::SPSEL));
}

#[test]
fn wait_states_of_the_stack_delay_and_those_of_code_hide_behind_it() {
    // Eight words with one or two wait states each.
    for (ram_wait, line_wait, cycles) in [
        (1, 0, 20),
        (2, 0, 28),
        // The vector takes 2 + w, then the handler 4 + w, in parallel with 12 until w is 4.
        (0, 3, 12),
        (0, 5, 16),
        (1, 5, 20),
    ] {
        let (mut cpu, mut bus) = machine();
        bus.ram_wait = ram_wait;
        bus.line_wait = line_wait;
        pend(&mut cpu, 0, 0);
        let expected = Some(cycles);
        assert_eq!(
            take(&mut cpu, &mut bus),
            expected,
            "{ram_wait}, {line_wait}"
        );
    }
}

#[test]
fn a_later_but_more_urgent_one_takes_the_entry_over() {
    // Line 1 rises `after` cycles after line 0 was taken. Its handler begins when stacking is done
    // (12), or 6 cycles after its rise if that is later.
    for (after, cycles) in [(1, 12), (6, 12), (8, 14), (11, 17)] {
        let (mut cpu, mut bus) = machine();
        cpu.cycle = 100;
        cpu.system.nvic.set_priority(17, 0x10);
        pend(&mut cpu, 0, 0x40);
        bus.schedule.push_back((100 + after, [0b10, 0, 0]));
        assert_eq!(take(&mut cpu, &mut bus), Some(cycles), "{after}");
        assert_eq!(cpu.registers.exception, 17);
        assert_eq!(cpu.registers.r[13], STACK - 0x20, "one frame");
        bus.lines = [0; 3];
        assert_eq!(leave(&mut cpu, &mut bus), 6, "tail-chained to the first");
        assert_eq!(cpu.registers.exception, 16);
        assert_eq!(leave(&mut cpu, &mut bus), 12);
    }
}

#[test]
fn a_later_one_of_the_same_priority_waits() {
    let (mut cpu, mut bus) = machine();
    pend(&mut cpu, 5, 0x40);
    cpu.system.nvic.set_priority(22, 0x40);
    bus.schedule.push_back((4, [1 << 6, 0, 0]));
    assert_eq!(take(&mut cpu, &mut bus), Some(12));
    assert_eq!(cpu.registers.exception, 21);
    assert_eq!(take(&mut cpu, &mut bus), None);
}

#[test]
fn latency_counts_from_the_rise_of_the_line() {
    let (mut cpu, mut bus) = machine();
    // The line rises 7 cycles into an operation that lasts 10.
    bus.schedule.push_back((1007, [1 << 9, 0, 0]));
    cpu.cycle = 1010;
    assert_eq!(take(&mut cpu, &mut bus), Some(12));
    let found: Vec<_> = cpu.system.latencies.entered().collect();
    assert_eq!(found.len(), 1);
    let (number, latency) = found[0];
    assert_eq!((number, latency.count, latency.worst), (25, 1, 15));
    assert_eq!((latency.worst_at, latency.behind), (1022, 0));
    assert_eq!(cpu.system.deepest_msp, Some(STACK - 0x20));
    // The next exception waits for the handler: from its rise to the handler's end.
    cpu.system.nvic.set_priority(26, 0x0);
    bus.lines = [0; 3];
    bus.schedule.push_back((1030, [1 << 10, 0, 0]));
    cpu.cycle = 1100;
    assert_eq!(take(&mut cpu, &mut bus), None);
    assert_eq!(leave(&mut cpu, &mut bus), 6);
    let found: Vec<_> = cpu.system.latencies.entered().collect();
    assert_eq!((found[1].0, found[1].1.worst), (26, 76));
    assert_eq!(found[1].1.behind, 25);
}

#[test]
fn a_program_is_interrupted_where_it_is() {
    let (mut cpu, mut bus) = machine();
    let counter = Flat::SRAM + 0x100;
    // Counts in r0's memory: ldr r0, [pc, #4]; ldr r1, [r0]; adds r1, #1; str r1, [r0]; bx lr
    code(
        &mut bus,
        handler(16),
        &[0x4802, 0x6801, 0x3101, 0x6001, 0x4770, 0xBF00],
    );
    let literal = handler(16) + 12;
    assert!(bus.load(literal, &counter.to_le_bytes()));
    for n in 0..5 {
        bus.schedule.push_back((cpu.cycle + 50, [1, 0, 0]));
        let until = cpu.cycle + 60;
        assert_eq!(run(&mut cpu, &mut bus, until), Ok(()));
        bus.lines = [0; 3];
        let until = cpu.cycle + 100;
        assert_eq!(run(&mut cpu, &mut bus, until), Ok(()));
        assert_eq!(bus.word(counter), Some(n + 1));
        assert_eq!((cpu.registers.exception, cpu.registers.r[15]), (0, MAIN));
    }
}
