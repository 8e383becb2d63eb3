//! Memory protection of the flashed image: a program with a wrong address disconnects the outputs
//! and resets with the cause named.

use crate::chip_faults::Bench;
use firmware::link::Request;
use firmware::link::message::ResetCause;
use firmware::muscle::{CalciumForceSpec, MOST_ROWS, MuscleSpec, RecruitmentSpec};
use firmware::pulse::CHANNELS;
use firmware::safety::Fault;
use firmware::units::Amplitude;
use hal_sim::chip::cpu::{Bus, Size};

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
    // A null pointer (an alias of flash), CCM beyond the muscles' tables and at its end, the loader
    // in ROM, SRAM2 beyond the tape and at its end, after SRAM2, a bit-band alias, after AHB1,
    // external memory.
    for address in [
        0,
        0x1000_A000,
        0x1000_FFFC,
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

/// One changed bit in a row of a muscle's table is a fault, as soon as all rows have been checked.
#[test]
fn a_changed_bit_in_a_muscles_table_is_found() {
    const CCM: u32 = 0x1000_0000;
    let mut bench = Bench::idle();
    bench.send(Request::Muscle {
        channel: 0,
        spec: MuscleSpec::new(
            CalciumForceSpec {
                a_mn_per_s: 121_900,
                k_micro: 300_000,
                tau_c_us: 20_800,
                tau1_us: 33_100,
                tau2_us: 194_400,
            },
            RecruitmentSpec {
                motor_threshold: Amplitude::new(2_000),
                limit: Amplitude::new(18_000),
                reference: Amplitude::new(18_000),
                slope_micro: 250_000,
            },
        ),
    });
    bench.arm_and_start();
    bench.stimulate(100); // its rows are solved, one per tick
    let all_rows_ms = (CHANNELS * MOST_ROWS) as u64;
    let mut intact = bench.clone();
    intact.stimulate(all_rows_ms + 10);
    assert_eq!(intact.fault(), None);
    // The first and a later row of the first table, which lies at the beginning of CCM.
    for (word, bit) in [(3, 0), (200, 31)] {
        let mut bench = bench.clone();
        let (address, cycle) = (CCM + 4 * word, bench.board.cpu.cycle);
        let soc = &mut bench.board.around.soc;
        let value = soc.read(address, Size::Word, cycle).unwrap().value;
        assert_ne!(value, 0, "word {word} is in no row");
        let flipped = soc.write(address, Size::Word, value ^ 1 << bit, cycle);
        flipped.unwrap();
        // All rows within as many ticks, and then two windows.
        bench.stimulate(all_rows_ms + 10);
        assert_eq!(bench.fault(), Some(Fault::Ram), "word {word}, bit {bit}");
        assert!(!bench.drives_within(20));
    }
}
