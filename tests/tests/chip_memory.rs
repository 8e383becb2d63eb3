//! Memory protection of the flashed image: a program with a wrong address disconnects the outputs
//! and resets with the cause named.

use crate::chip_faults::Bench;
use firmware::link::message::ResetCause;
use firmware::safety::Fault;

/// `str r0, [r1]` and `ldr r0, [r1]`.
const STORE: u16 = 0x6008;
const LOAD: u16 = 0x6808;

/// Executes `instruction` in the thread during a pulse, with `address` in R1.
fn accesses(instruction: u16, address: u32) {
    println!("{instruction:#06x} at {address:#010x}");
    let (mut bench, at) = Bench::stimulating_in_pulse();
    let pc = bench.find_code([instruction]);
    bench.send_thread_to(pc, [(0, 0x1234_5678), (1, address)]);
    bench.expect_isolated(at, 5);
    bench.recovers_after(ResetCause::Software, Fault::Access);
}

/// Sets the thread's stack to `address` during a pulse, and runs until the core stacks registers
/// there, at most a window later.
fn stacks(address: u32, fault: Fault) {
    println!("stack at {address:#010x}");
    let (mut bench, at) = Bench::stimulating_in_pulse();
    let pc = bench.board.cpu.registers.r[15];
    bench.send_thread_to(pc, [(13, address)]);
    bench.expect_isolated(at, 260);
    bench.recovers_after(ResetCause::Software, fault);
}

/// Continues the thread at `address` during a pulse.
fn goes_to(address: u32) {
    println!("to {address:#010x}");
    let (mut bench, at) = Bench::stimulating_in_pulse();
    bench.send_thread_to(address, []);
    bench.expect_isolated(at, 5);
    bench.recovers_after(ResetCause::Software, Fault::Access);
}

#[test]
fn flash_cannot_be_written() {
    // Vectors, code, the stage table.
    for address in [0x0800_0000, 0x0800_4000, 0x080C_0000] {
        accesses(STORE, address);
    }
}

#[test]
fn data_and_registers_cannot_be_executed() {
    // Statics, the stack, the tape, CCM, GPIOA, OTG_FS.
    for address in [
        0x2000_0100,
        0x2001_BF00,
        0x2001_C000,
        0x1000_0000,
        0x4002_0000,
        0x5000_0000,
    ] {
        goes_to(address);
    }
}

#[test]
fn what_is_not_the_programs_cannot_be_reached() {
    // A null pointer (an alias of flash), CCM, the loader in ROM, SRAM2 beyond the tape and at its
    // end, after SRAM2, a bit-band alias, after AHB1, external memory.
    for address in [
        0,
        0x1000_0000,
        0x1FFF_0000,
        0x2001_D000,
        0x2001_FFFC,
        0x2002_0000,
        0x2200_0000,
        0x4008_0000,
        0x6000_0000,
    ] {
        accesses(LOAD, address);
        accesses(STORE, address);
    }
}

#[test]
fn the_tape_is_written_by_its_painter_alone() {
    // The tape's first word, a word of port C, and the last of its 4 KiB.
    for address in [0x2001_C000, 0x2001_C800, 0x2001_CFFC] {
        accesses(STORE, address);
    }
}

#[test]
fn a_lost_stack_is_not_played() {
    // On the tape, directly above it, and further beyond.
    for address in [
        0x2001_C400,
        0x2001_C810,
        0x2001_D000,
        0x2001_D370,
        0x2001_FF00,
    ] {
        stacks(address, Fault::StackGuard);
    }
}
