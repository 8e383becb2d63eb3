//! Cycles of short sequences, worked out by hand from the Cortex-M4 technical
//! reference manual (Arm DDI 0439) for memory without wait states: an
//! independent check of `chip::cpu`, written without looking at it.
//!
//! Each row runs from aligned code in flash with NOPs around it; what it took
//! is the time until two NOPs later, less those two. Where the manual gives a
//! range (pipeline refill, division) so does the row.

mod rows;

use hal_sim::chip::cpu::flat::Flat;
use hal_sim::chip::cpu::{Cpu, Size};

/// One sequence.
pub struct Row {
    pub name: &'static str,
    /// In unified syntax; branch targets relative to the instruction + 4.
    pub assembly: &'static str,
    /// As llvm-mc encodes it.
    pub code: &'static [u16],
    /// Instructions executed: less than written where it branches away.
    pub steps: u32,
    pub cycles: Cycles,
    pub rule: Rule,
}

/// In a table: name, assembly, code, steps, cycles, rule.
const fn row(
    name: &'static str,
    assembly: &'static str,
    code: &'static [u16],
    steps: u32,
    cycles: Cycles,
    rule: Rule,
) -> Row {
    Row {
        name,
        assembly,
        code,
        steps,
        cycles,
        rule,
    }
}

/// Fewest and most cycles by the manual.
#[derive(Clone, Copy, Debug)]
pub struct Cycles(pub u64, pub u64);

pub const fn exactly(n: u64) -> Cycles {
    Cycles(n, n)
}

pub const fn between(low: u64, high: u64) -> Cycles {
    Cycles(low, high)
}

/// What in the manual a row rests on.
#[derive(Clone, Copy, Debug)]
pub enum Rule {
    /// Table 3-1: cycles of the instructions, added up.
    Table,
    /// Table 3-2: every DSP instruction takes one.
    Dsp,
    /// Table 3-1: 2 to 12, by leading zeros and ones of the operands.
    Divide,
    /// 3.3.3: a literal's load may meet a fetch.
    Literal,
    /// 3.3.3: a load or store right after a load is one cycle shorter,
    /// unless its address needs what was loaded.
    Pipelined,
    /// Not said whether a base written back counts as loaded.
    Writeback,
    /// 3.3.3: one cycle more on a half-word or byte-aligned half-word, two
    /// on a byte-aligned word.
    Unaligned,
    /// 3.3.3: a store with an immediate offset takes one.
    Store,
    /// 3.3.3: nothing is pipelined after a store.
    AfterStore,
    /// Not said whether such a store waits for its address.
    StoreThrough,
    /// Both said: more cycles for unaligned stores, and that the write
    /// buffer hides them.
    UnalignedStore,
    /// 3.3.3: an address made by the data processing instruction right
    /// before costs a cycle.
    Address,
    /// 3.3.3: two words together take three; not pipelined around.
    Double,
    /// Table 3-1: 1 + N; 3.3.3: not pipelined around.
    Multiple,
    /// Table 3-1: a branch that is not taken takes one.
    NotTaken,
    /// Table 3-1: P, a pipeline refill, is 1 to 3.
    Refill,
    /// 3.3.3: two for the load and three for the refill.
    LoadPc,
    /// 3.3.3: two for the load, one for the sum, three for the refill.
    TableBranch,
    /// Table 3-1: DMB and DSB need not wait, ISB refills.
    Barrier,
    /// Table 3-1: 1 or 2.
    Special,
    /// Table 3-1: IT takes one or is folded; what is not done takes one.
    It,
    /// Table 7-1: cycles of the instructions, added up.
    Fpu,
    /// 7.2.3: arithmetic, multiply-accumulate and conversion take one more
    /// if the next instruction consumes the result; nothing else does.
    Consumed,
    /// 7.2.3: a multiply-accumulate needs its addend one cycle later.
    Addend,
    /// Table 7-1 says 3; not said whether integer instructions after it wait.
    MacAlone,
    /// 7.2.3: VDIV and VSQRT take one cycle until the next floating-point
    /// instruction, which waits for their 14.
    OutOfOrder,
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

/// What `row` takes here.
fn measure(row: &Row) -> Result<u64, String> {
    let (mut cpu, mut bus) = (core(), memory(row.code));
    let mut steps = |n| {
        for _ in 0..n {
            cpu.step(&mut bus).map_err(|stop| stop.to_string())?;
        }
        Ok::<_, String>(cpu.cycle)
    };
    let begin = steps(NOPS)?;
    let end = steps(row.steps + NOPS)?;
    Ok(end - begin - u64::from(NOPS))
}

/// Where `chip::cpu` and the manual, as read here, disagree today: the row's
/// name and what the core takes. Not accepted, only known: the test fails when
/// a row joins or leaves, so that this list can only shrink on purpose.
const DISPUTED: &[(&str, u64)] = &[];

#[test]
fn every_sequence_takes_what_the_manual_says() {
    let (mut exact, mut ranges) = (0, 0);
    let (mut wrong, mut disputed) = (Vec::new(), Vec::new());
    for row in rows::ROWS {
        let Cycles(low, high) = row.cycles;
        let about = format!("{}: {} ({:?})", row.name, row.assembly, row.rule);
        let cycles = measure(row).unwrap_or_else(|stop| panic!("{about}: {stop}"));
        if low == high {
            exact += 1;
        } else {
            ranges += 1;
            println!("{cycles} of {low}..={high}: {about}");
        }
        if DISPUTED.contains(&(row.name, cycles)) {
            println!("DISPUTED: {cycles}, by the manual {low}: {about}");
            disputed.push((row.name, cycles));
        } else if !(low..=high).contains(&cycles) {
            wrong.push(format!("{cycles}, not {low}..={high}: {about}"));
        }
    }
    println!(
        "{exact} exact sequences, {ranges} ranges, {} disputed",
        disputed.len()
    );
    assert!(exact - disputed.len() >= 100, "{exact}");
    assert!(
        wrong.is_empty(),
        "{} wrong:\n{}",
        wrong.len(),
        wrong.join("\n")
    );
    let settled: Vec<_> = DISPUTED.iter().filter(|d| !disputed.contains(d)).collect();
    assert!(
        settled.is_empty(),
        "settled, take out of DISPUTED: {settled:?}"
    );
}
