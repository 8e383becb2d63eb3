//! Tests accesses of instructions to bit-band aliases (TRM 3.7).

use super::{Machine, RAM};
use crate::chip::cpu::{Size, Stop};

/// Returns the alias of bit `number` of the byte at `address` of SRAM.
const fn alias(address: u32, number: u32) -> u32 {
    0x2200_0000 + (address - RAM) * 32 + number * 4
}

/// Executes one instruction with `value` in R0 and the alias in R1; returns R0 and the word at `RAM
/// + 4`.
fn one(code: &[u16], value: u32, alias: u32) -> [u32; 2] {
    let mut machine = Machine::new(code).with(&[(0, value), (1, alias)]);
    machine.poke(RAM, &[0x8182_8384, 0x0102_0304]);
    machine.steps(1);
    assert_eq!(machine.cpu.registers.exception, 0, "{code:04X?}");
    [machine.r(0), machine.word(RAM + 4)]
}

const LDR: [u16; 1] = [0x6808];
const LDRH: [u16; 1] = [0x8808];
const LDRB: [u16; 1] = [0x7808];
const STR: [u16; 1] = [0x6008];
const STRH: [u16; 1] = [0x8008];
const STRB: [u16; 1] = [0x7008];

#[test]
fn a_bit_reads_as_0_or_1_in_each_width() {
    for load in [LDR, LDRH, LDRB] {
        for number in 0..32 {
            let [read, _] = one(&load, 7, alias(RAM + 4, number));
            assert_eq!(read, 0x0102_0304 >> number & 1, "{number}");
            // The same bit through the byte that contains it.
            let byte = alias(RAM + 4 + number / 8, number % 8);
            assert_eq!(one(&load, 7, byte)[0], read, "{number}");
        }
    }
    let signed = [0xF991, 0x0000]; // ldrsb.w r0,[r1]
    assert_eq!(one(&signed, 7, alias(RAM + 4, 2))[0], 1);
}

#[test]
fn bit_0_of_what_is_written_counts_and_no_other_bit_changes() {
    for store in [STR, STRH, STRB] {
        for number in 0..32 {
            for value in [0x01, 0xFF, 0xFFFF_FFFF, 0x00, 0x0E, 0xFFFF_FFFE] {
                let [_, word] = one(&store, value, alias(RAM + 4, number));
                let rest = 0x0102_0304 & !(1 << number);
                assert_eq!(word, rest | (value & 1) << number, "{number} {value:#x}");
            }
        }
    }
}

#[test]
fn the_word_of_several_registers_is_a_bit_each() {
    let mut machine = Machine::new(&[0xC91C]).with(&[(1, alias(RAM, 1))]); // ldm r1!,{r2-r4}
    machine.poke(RAM, &[0b1010]);
    machine.steps(1);
    assert_eq!([2, 3, 4].map(|n| machine.r(n)), [1, 0, 1]);
}

fn cfsr(machine: &mut Machine) -> u32 {
    let system = &mut machine.cpu.system;
    system.read(0xE000_ED28, Size::Word, 0).unwrap()
}

#[test]
fn an_alias_of_no_memory_and_what_is_not_aligned_to_words_are_bus_errors() {
    // Beyond SRAM; of a peripheral, which `Flat` lacks; not at a word; across two words.
    for (address, code) in [
        (alias(RAM + 0x2_0000, 0), &LDR),
        (0x4247_0060, &LDR),
        (alias(RAM, 0) + 1, &LDRB),
        (alias(RAM, 0) + 2, &LDRH),
        (alias(RAM, 0) + 2, &LDR),
        (alias(RAM, 0) - 2, &LDR),
    ] {
        let mut machine = Machine::new(code).with(&[(0, 7), (1, address)]);
        machine.steps(1);
        assert_eq!(machine.cpu.registers.exception, 3, "{address:#x}");
        assert_eq!(cfsr(&mut machine), 0x8200, "BFARVALID, PRECISERR");
        let bfar = machine.cpu.system.read(0xE000_ED38, Size::Word, 0);
        assert_eq!(bfar, Ok(address), "the alias's own address");
        assert_eq!(machine.r(0), 7);
    }
    let mut machine = Machine::new(&STR).with(&[(1, alias(RAM + 0x2_0000, 0))]);
    machine.steps(1);
    assert_eq!(cfsr(&mut machine), 0x0400, "IMPRECISERR: it was buffered");
}

#[test]
fn code_is_not_fetched_through_an_alias() {
    let mut machine = Machine::new(&[0x4708]).with(&[(1, alias(RAM, 0) | 1)]); // bx r1
    machine.steps(2);
    assert_eq!(machine.cpu.registers.exception, 3);
    assert_eq!(cfsr(&mut machine), 0x0100, "IBUSERR");
}

#[test]
fn exclusive_accesses_to_an_alias_are_refused() {
    for code in [[0xE851, 0x0F00], [0xE841, 0x2000]] {
        // ldrex r0,[r1]; strex r0,r2,[r1]
        let mut machine = Machine::new(&code).with(&[(1, alias(RAM, 0))]);
        let stop = machine.stop();
        let Some(Stop::Access { what, .. }) = stop else {
            panic!("{stop:?}")
        };
        assert!(what.contains("exclusive"), "{what}");
    }
}

/// Checks TRM 3.7: the core waits only if it accesses the bus meanwhile. A read-modify-write is two
/// accesses.
#[test]
fn a_store_to_an_alias_occupies_the_bus_for_two_accesses() {
    // str r0,[r1]; nop; nop; nop, and str r0,[r1]; ldr r2,[r3]
    let cycles = |code: &[u16], address| {
        let mut machine = Machine::new(code).with(&[(1, address), (3, RAM)]);
        machine.steps(1);
        let begin = machine.cpu.cycle;
        machine.steps(code.len() - 1);
        machine.cpu.cycle - begin
    };
    let [plain, banded] = [RAM, alias(RAM, 0)];
    let nops = [0x6008, 0xBF00, 0xBF00, 0xBF00];
    assert_eq!(cycles(&nops, banded), cycles(&nops, plain));
    let load = [0x6008, 0x681A];
    assert_eq!(cycles(&load, banded), cycles(&load, plain) + 1);
}
