//! Tests that interrupts at random times have no effect on the interrupted program.

use super::*;
use std::collections::VecDeque;

/// Integer and floating-point arithmetic on R4, R5 and S0, with an IT block, a division, stack and
/// flags; 1024 rounds.
#[rustfmt::skip]
const PROGRAM: &[u16] = &[
    0x2400, // movs r4, #0
    0x2501, // movs r5, #1
    0xEE00, 0x4A10, // vmov s0, r4
    // loop:
    0x3401, // adds r4, #1
    0xEB05, 0x05C4, // add.w r5, r5, r4, lsl #3
    0xEA85, 0x0504, // eor.w r5, r5, r4
    0xFB05, 0xF604, // mul r6, r5, r4
    0xF016, 0x0F04, // tst.w r6, #4
    0xBF0C, // ite eq
    0x3507, // addeq r5, #7
    0x3D03, // subne r5, #3
    0xB430, // push {r4, r5}
    0xBCC0, // pop {r6, r7}
    0xFBA7, 0x0106, // umull r0, r1, r7, r6
    0x182D, // adds r5, r5, r0
    0xEB45, 0x0501, // adc.w r5, r5, r1
    0xFBB5, 0xF2F4, // udiv r2, r5, r4
    0x4415, // add r5, r2
    0xEE01, 0x5A90, // vmov s3, r5
    0xEEF8, 0x1A61, // vcvt.f32.u32 s3, s3
    0xEE30, 0x0A21, // vadd.f32 s0, s0, s3
    0xEE10, 0x3A10, // vmov r3, s0
    0x405D, // eors r5, r3
    0xF5B4, 0x6F80, // cmp.w r4, #1024
    0xD1DD, // bne loop
    0xE7FE, // b .
];

/// Increments the word at 0x2000_8000 + 4 · its number; handlers of odd numbers also overwrite S0,
/// S1, S3 and FPSCR.
#[rustfmt::skip]
const HANDLER: &[u16] = &[
    0xF248, 0x0100, // movw r1, #32768
    0xF2C2, 0x0100, // movt r1, #8192
    0xF3EF, 0x8005, // mrs r0, ipsr
    0xF851, 0x2020, // ldr.w r2, [r1, r0, lsl #2]
    0x3201, // adds r2, #1
    0xF841, 0x2020, // str.w r2, [r1, r0, lsl #2]
    0xEA6F, 0x0C00, // mvn.w r12, r0
    0x07C3, // lsls r3, r0, #31
    0xD507, // bpl skip
    0xEE00, 0xCA10, // vmov s0, r12
    0xEE70, 0x0A00, // vadd.f32 s1, s0, s0
    0xEEE1, 0xCA10, // vmsr fpscr, r12
    0xEE01, 0xCA90, // vmov s3, r12
    0x4298, // skip: cmp r0, r3
    0x4770, // bx lr
];

/// The 32-bit generator of Numerical Recipes; the upper bits are used.
struct Random(u32);

impl Random {
    fn below(&mut self, end: u32) -> u32 {
        self.0 = self.0.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        ((u64::from(self.0) * u64::from(end)) >> 32) as u32
    }
}

const LINES: u32 = 6;
const SYSTICK_PERIOD: u32 = 1999;

/// Schedules pulses of 1–8 cycles at random times, at least 600 cycles apart, for each line.
/// Returns the edges, and the number of pulses of each line.
fn schedule(random: &mut Random, until: Cycle) -> (VecDeque<(Cycle, [u32; 3])>, [u32; 6]) {
    let mut edges = vec![];
    let mut pulses = [0; 6];
    for line in 0..LINES {
        let mut at = Cycle::from(50 + random.below(600));
        while at < until {
            edges.push((at, 1 << line, true));
            edges.push((at + 1 + Cycle::from(random.below(8)), 1 << line, false));
            pulses[line as usize] += 1;
            at += Cycle::from(600 + random.below(600));
        }
    }
    edges.sort_unstable();
    let mut level = 0;
    let mut schedule = VecDeque::new();
    for (at, line, up) in edges {
        level = if up { level | line } else { level & !line };
        schedule.push_back((at, [level, 0, 0]));
    }
    (schedule, pulses)
}

fn prepared(random: &mut Random) -> (Cpu, Flat) {
    let (mut cpu, mut flat) = machine();
    code(&mut flat, MAIN, PROGRAM);
    for number in 15..32 {
        code(&mut flat, handler(number), HANDLER);
    }
    flat.ram_wait = random.below(3);
    flat.line_wait = random.below(7);
    set(&mut cpu, 0xE000_ED88, 0xF << 20);
    set(&mut cpu, 0xE000_EF34, 1 << 31 | random.below(2) << 30);
    set(&mut cpu, 0xE000_ED0C, 0x05FA_0000 | random.below(8) << 8);
    cpu.registers.r[13] -= 4 * random.below(2);
    (cpu, flat)
}

#[test]
fn random_interrupts_change_nothing_and_none_is_lost() {
    let mut total = 0;
    for seed in 0..60 {
        total += soak(seed);
    }
    assert!(total > 10_000, "{total} interrupts");
}

/// Compares a run without interrupts with a run that has them; returns the number of interrupts
/// taken.
fn soak(seed: u32) -> u32 {
    let mut random = Random(seed);
    let (mut alone, mut bus) = prepared(&mut random);
    assert_eq!(run(&mut alone, &mut bus, 200_000), Ok(()));
    let mut random = Random(seed);
    let (mut cpu, mut bus) = prepared(&mut random);
    for number in 15..22 {
        let priority = (random.below(4) << 6) as u8;
        cpu.system.nvic.set_priority(number, priority);
    }
    set(&mut cpu, 0xE000_E014, SYSTICK_PERIOD - 1);
    set(&mut cpu, 0xE000_E010, 0b111);
    let (schedule, pulses) = schedule(&mut random, 195_000);
    bus.schedule = schedule;
    assert_eq!(run(&mut cpu, &mut bus, 199_800), Ok(()));

    let [now, then] = [&cpu.registers, &alone.registers];
    assert_eq!(now.r, then.r, "seed {seed}");
    let expected = (then.apsr, then.s, then.fpscr);
    assert_eq!((now.apsr, now.s, now.fpscr), expected);
    assert_eq!((now.control, now.exception, now.it), (then.control, 0, 0));
    assert_eq!(cpu.system.active().count(), 0);
    let count = |number: u32| bus.word(0x2000_8000 + 4 * number).unwrap_or(0);
    for (number, pulses) in (16..).zip(pulses) {
        assert_eq!(count(number), pulses, "seed {seed}, exception {number}");
    }
    assert_eq!(count(15), 199_800 / SYSTICK_PERIOD, "seed {seed}, SysTick");
    for (_, latency) in cpu.system.latencies.entered() {
        assert!(latency.worst >= 12);
    }
    (15..22).map(count).sum()
}
