//! Cycle counts of short sequences, worked out by hand from the Cortex-M4 technical reference
//! manual (Arm DDI 0439) for memory without wait states. They are an independent check of
//! `chip::cpu`, written without looking at that code.
//!
//! Each row runs from aligned code in flash between NOPs; its count is the time until two NOPs
//! later, minus those two. Where the manual gives a range (pipeline refill, division), so does the
//! row.

mod rows;

use hal_sim::chip::cpu::flat::Flat;
use hal_sim::chip::cpu::{Cpu, Size, Stop};
use std::ops::RangeInclusive;

/// One sequence: name; assembly in unified syntax, with branch targets relative to 4 bytes after the
/// instruction; the encoding by llvm-mc; the number of executed instructions, smaller than the
/// number written if it branches away; cycles by the manual; and the rule that they rest on.
pub type Row = (
    &'static str,
    &'static str,
    &'static [u16],
    u32,
    RangeInclusive<u64>,
    Rule,
);

/// Rule of the manual on which a row rests.
#[derive(Clone, Copy, Debug)]
#[rustfmt::skip]
pub enum Rule {
    Table, // Table 3-1: sum of the instructions' cycles
    Dsp, // Table 3-2: every DSP instruction takes one cycle
    Divide, // Table 3-1: 2 to 12, by leading zeros and ones of the operands
    Literal, // 3.3.3: a literal's load may coincide with a fetch
    // 3.3.3: a load after a load takes one less, unless its address needs the loaded value
    Pipelined,
    Writeback, // Not specified whether a base written back counts as loaded
    // 3.3.3: one more for a half-word or byte-aligned half-word, two for a byte-aligned word
    Unaligned,
    Store, // 3.3.3: a store with an immediate offset takes one
    AfterStore, // 3.3.3: nothing is pipelined after a store
    StoreThrough, // Not specified whether such a store waits for its address
    // The manual says both that unaligned stores take more cycles and that the write buffer hides
    // them
    UnalignedStore,
    // 3.3.3: an address computed by the preceding data processing instruction costs a cycle
    Address,
    Double, // 3.3.3: two words together take three cycles; not pipelined with neighbours
    Multiple, // Table 3-1: 1 + N; 3.3.3: not pipelined with neighbours
    NotTaken, // Table 3-1: a branch that is not taken takes one cycle
    Refill, // Table 3-1: P, a pipeline refill, is 1 to 3
    LoadPc, // 3.3.3: two cycles for the load and three for the refill
    TableBranch, // 3.3.3: two cycles for the load, one for the sum, three for the refill
    Barrier, // Table 3-1: DMB and DSB need not wait, ISB refills
    Special, // Table 3-1: 1 or 2
    It, // Table 3-1: IT takes one cycle or is folded; a skipped instruction takes one
    Fpu, // Table 7-1: sum of the instructions' cycles
    Consumed, // 7.2.3: arithmetic takes one more if the next instruction uses the result
    Addend, // 7.2.3: a multiply-accumulate needs its addend one cycle later
    MacAlone, // Table 7-1 says 3; not specified whether integer instructions after it wait
    OutOfOrder, // 7.2.3: VDIV and VSQRT take one until the next floating-point instruction, which waits for their 14
}

const CODE: u32 = Flat::FLASH + 0x100;
/// Target address of `lr` and of popped and loaded PCs, with aligned NOPs.
const ELSEWHERE: u32 = Flat::FLASH + 0x400;
const NOP: u16 = 0xBF00;
const NOPS: u32 = 2;

/// Returns a memory with the code at [`CODE`] between NOPs, and the words that loads read.
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
        (Flat::SRAM + 0x8000 + 16, ELSEWHERE | 1), // sp: the same after four words
    ] {
        assert!(bus.load(address, &word.to_le_bytes()));
    }
    bus
}

/// Returns a core about to execute at [`CODE`], with the FPU enabled and in use.
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

/// Returns the cycles that the simulated core needs for `code`.
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
