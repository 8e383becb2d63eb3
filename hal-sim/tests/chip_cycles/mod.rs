//! Cycles of short sequences, worked out by hand from the Cortex-M4 technical
//! reference manual (Arm DDI 0439) for memory without wait states: an
//! independent check of `chip::cpu`, written without looking at it.
//!
//! Each row runs from aligned code in flash with NOPs around it; what it took
//! is the time until two NOPs later, less those two. Where the manual gives a
//! range (pipeline refill, division) so does the row.

mod rows;

use hal_sim::chip::cpu::flat::Flat;
use hal_sim::chip::cpu::{Cpu, Size, Stop};
use std::ops::RangeInclusive;

/// One sequence: name; assembly in unified syntax, branch targets relative to the
/// instruction + 4; as llvm-mc encodes it; instructions executed, less than
/// written where it branches away; cycles by the manual; what they rest on.
pub type Row = (
    &'static str,
    &'static str,
    &'static [u16],
    u32,
    RangeInclusive<u64>,
    Rule,
);

/// What in the manual a row rests on.
#[derive(Clone, Copy, Debug)]
#[rustfmt::skip]
pub enum Rule {
    Table, // Table 3-1: cycles of the instructions, added up
    Dsp, // Table 3-2: every DSP instruction takes one
    Divide, // Table 3-1: 2 to 12, by leading zeros and ones of the operands
    Literal, // 3.3.3: a literal's load may meet a fetch
    Pipelined, // 3.3.3: right after a load one less, unless its address needs what was loaded
    Writeback, // Not said whether a base written back counts as loaded
    Unaligned, // 3.3.3: one more on a half-word or byte-aligned half-word, two on a byte-aligned word
    Store, // 3.3.3: a store with an immediate offset takes one
    AfterStore, // 3.3.3: nothing is pipelined after a store
    StoreThrough, // Not said whether such a store waits for its address
    UnalignedStore, // Both said: more cycles for unaligned stores, and that the write buffer hides them
    Address, // 3.3.3: an address made by the data processing instruction right before costs a cycle
    Double, // 3.3.3: two words together take three; not pipelined around
    Multiple, // Table 3-1: 1 + N; 3.3.3: not pipelined around
    NotTaken, // Table 3-1: a branch that is not taken takes one
    Refill, // Table 3-1: P, a pipeline refill, is 1 to 3
    LoadPc, // 3.3.3: two for the load and three for the refill
    TableBranch, // 3.3.3: two for the load, one for the sum, three for the refill
    Barrier, // Table 3-1: DMB and DSB need not wait, ISB refills
    Special, // Table 3-1: 1 or 2
    It, // Table 3-1: IT takes one or is folded; what is not done takes one
    Fpu, // Table 7-1: cycles of the instructions, added up
    Consumed, // 7.2.3: arithmetic takes one more if the next instruction consumes the result
    Addend, // 7.2.3: a multiply-accumulate needs its addend one cycle later
    MacAlone, // Table 7-1 says 3; not said whether integer instructions after it wait
    OutOfOrder, // 7.2.3: VDIV and VSQRT take one until the next floating-point instruction, which waits for their 14
}

const CODE: u32 = Flat::FLASH + 0x100;
/// Where `lr`, a popped and a loaded PC point: NOPs, aligned.
const ELSEWHERE: u32 = Flat::FLASH + 0x400;
const NOP: u16 = 0xBF00;
const NOPS: u32 = 2;

/// Code at [`CODE`] between NOPs, and the words that loads find.
fn memory(code: &[u16]) -> Flat {
    let mut bus = Flat::default();
    let mut flash = vec![NOP; 0x1000];
    let at = (CODE - Flat::FLASH) as usize / 2;
    flash[at..at + code.len()].copy_from_slice(code);
    let bytes: Vec<u8> = flash.iter().flat_map(|h| h.to_le_bytes()).collect();
    assert!(bus.load(Flat::FLASH, &bytes));
    for (address, word) in [
        (Flat::SRAM + 0x1000 + 16, ELSEWHERE | 1), // r1: a new PC
        (Flat::SRAM + 0x2000, 4),                  // r2: an index
        (Flat::SRAM + 0x2000 + 8, 6),              // r2: table of bytes
        (Flat::SRAM + 0x2000 + 16, 6),             // r2: table of half-words
        (Flat::SRAM + 0x3000, Flat::SRAM + 0x40),  // r3: a pointer
        (Flat::SRAM + 0x8000, ELSEWHERE | 1),      // sp: a popped PC
        (Flat::SRAM + 0x8000 + 16, ELSEWHERE | 1), // sp: the same behind four
    ] {
        assert!(bus.load(address, &word.to_le_bytes()));
    }
    bus
}

/// A core about to execute at [`CODE`], floating point on and in use.
fn core() -> Cpu {
    let mut cpu = Cpu::default();
    // CPACR: full access to CP10 and CP11.
    let written = cpu.system.write(0xE000_ED88, Size::Word, 0xF << 20, 0);
    written.unwrap();
    let r = &mut cpu.registers.r;
    r[0] = Flat::SRAM;
    r[1] = Flat::SRAM + 0x1000;
    r[2] = Flat::SRAM + 0x2000;
    r[3] = Flat::SRAM + 0x3000;
    (r[4], r[5], r[6], r[7]) = (8, 0x55, 0x1234_5678, 3);
    r[8] = Flat::SRAM + 0x4000;
    (r[9], r[10], r[11], r[12]) = (9, 16, 11, 0);
    r[13] = Flat::SRAM + 0x8000;
    r[14] = ELSEWHERE | 1;
    r[15] = CODE - 2 * NOPS;
    cpu.registers.s = std::array::from_fn(|n| (1.0 + n as f32).to_bits());
    cpu
}

/// What `code` takes here.
fn measure(code: &[u16], count: u32) -> Result<u64, Stop> {
    let (mut cpu, mut bus) = (core(), memory(code));
    let mut steps = |n| {
        (0..n)
            .try_for_each(|_| cpu.step(&mut bus))
            .map(|()| cpu.cycle)
    };
    let begin = steps(NOPS)?;
    let end = steps(count + NOPS)?;
    Ok(end - begin - u64::from(NOPS))
}

#[test]
fn every_sequence_takes_what_the_manual_says() {
    let mut exact = 0;
    let mut wrong = Vec::new();
    for (name, assembly, code, steps, cycles, rule) in rows::ROWS {
        let about = format!("{name}: {assembly} ({rule:?})");
        let found = measure(code, *steps).unwrap_or_else(|stop| panic!("{about}: {stop}"));
        if cycles.start() == cycles.end() {
            exact += 1;
        } else {
            println!("{found} of {cycles:?}: {about}");
        }
        if !cycles.contains(&found) {
            wrong.push(format!("{found}, not {cycles:?}: {about}"));
        }
    }
    println!(
        "{exact} exact sequences, {} ranges",
        rows::ROWS.len() - exact
    );
    assert!(exact >= 100, "{exact}");
    assert!(
        wrong.is_empty(),
        "{} wrong:\n{}",
        wrong.len(),
        wrong.join("\n")
    );
}
