//! Against the Arm ARM's pseudo-code, by hand.

use super::divide::cycles;
use super::{Op, decode, execute};
use crate::chip::cpu::Registers;
use crate::chip::cpu::registers::flag;

/// Encodings with Rd = R0, Rn = R1, Rm = R2, and R3 as accumulator or lower
/// word, as the assembler gives them.
fn run(code: u32, n: u32, m: u32, registers: Registers) -> Registers {
    let op = decode((code >> 16) as u16, code as u16).unwrap_or_else(|| panic!("{code:#010x}"));
    let mut registers = registers;
    (registers.r[1], registers.r[2]) = (n, m);
    execute(op, &mut registers);
    registers
}

/// R0 after `code`.
fn result(code: u32, n: u32, m: u32) -> u32 {
    run(code, n, m, Registers::default()).r[0]
}

/// R0 and Q after `code` with R3.
fn with_accumulator(code: u32, n: u32, m: u32, a: u32) -> (u32, bool) {
    let mut before = Registers::default();
    before.r[3] = a;
    let after = run(code, n, m, before);
    (after.r[0], after.apsr & flag::Q != 0)
}

/// R3 and R0 as one, after `code`, starting from `old`.
fn long(code: u32, n: u32, m: u32, old: u64) -> u64 {
    let mut before = Registers::default();
    before.r[3] = old as u32;
    before.r[0] = (old >> 32) as u32;
    let after = run(code, n, m, before);
    u64::from(after.r[0]) << 32 | u64::from(after.r[3])
}

#[test]
fn shifts_by_more_than_a_word() {
    let flags = |code, n, m, carry| {
        let apsr = if carry { flag::C } else { 0 };
        let before = Registers {
            apsr,
            ..Registers::default()
        };
        let after = run(code, n, m, before);
        (after.r[0], after.apsr)
    };
    let (lsl, lsr, asr, ror) = (0xFA11_F002, 0xFA31_F002, 0xFA51_F002, 0xFA71_F002);
    assert_eq!(flags(lsl, 1, 32, false), (0, flag::Z | flag::C));
    assert_eq!(flags(lsl, 1, 33, true), (0, flag::Z));
    assert_eq!(flags(lsl, 1, 0x100, true), (1, flag::C)); // the lowest byte counts
    assert_eq!(flags(lsr, 1 << 31, 32, false), (0, flag::Z | flag::C));
    assert_eq!(flags(lsr, 1 << 31, 31, true), (1, 0));
    let expected = (u32::MAX, flag::N | flag::C);
    assert_eq!(flags(asr, 1 << 31, 200, false), expected);
    assert_eq!(flags(asr, 0x4000_0000, 40, true), (0, flag::Z));
    assert_eq!(flags(ror, 1, 1, false), (1 << 31, flag::N | flag::C));
    assert_eq!(flags(ror, 1 << 31, 32, false), (1 << 31, flag::N | flag::C));
    assert_eq!(flags(ror, 2, 0, false), (2, 0));
    // Without S the flags stay.
    assert_eq!(flags(0xFA01_F002, 1, 32, true), (0, flag::C));
}

#[test]
fn extensions() {
    assert_eq!(result(0xFA4F_F092, 0, 0x0000_8000), 0xFFFF_FF80); // sxtb r0, r2, ror #8
    assert_eq!(result(0xFA1F_F0A2, 0, 0x8765_4321), 0x8765); // uxth ror #16
    assert_eq!(result(0xFA1F_F0B2, 0, 0x8765_4321), 0x2187); // uxth ror #24
    assert_eq!(result(0xFA01_F082, 1, 0xFFFF), 0); // sxtah
    assert_eq!(result(0xFA2F_F082, 0, 0x0080_007F), 0xFF80_007F); // sxtb16
    // The halves add apart.
    assert_eq!(result(0xFA31_F082, 0xFFFF_FFFF, 0x0001_0001), 0); // uxtab16
}

/// Text, code, operands, result, GE.
#[rustfmt::skip]
const PARALLEL: &[(&str, u32, u32, u32, u32, u32)] = &[
    ("sadd16", 0xFA91_F002, 0x7FFF_FFFF, 0x0001_0001, 0x8000_0000, 0b1111),
    ("uadd16", 0xFA91_F042, 0x7FFF_FFFF, 0x0001_0001, 0x8000_0000, 0b0011),
    ("sadd8", 0xFA81_F002, 0x80FF_0001, 0xFF01_0001, 0x7F00_0002, 0b0111),
    ("usub8", 0xFAC1_F042, 0x0102_0304, 0x0201_0403, 0xFF01_FF01, 0b0101),
    // Top adds the other's bottom; bottom subtracts the other's top.
    ("uasx", 0xFAA1_F042, 0xFFFF_0001, 0x0002_0001, 0x0000_FFFF, 0b1100),
    ("ssax", 0xFAE1_F002, 0x0001_0001, 0xFFFE_0002, 0xFFFF_FFFF, 0),
    ("qadd16", 0xFA91_F012, 0x7FFF_8000, 0x0001_FFFF, 0x7FFF_8000, 0),
    ("uqsub16", 0xFAD1_F052, 0x0001_FFFF, 0x0002_0001, 0x0000_FFFE, 0),
    ("uqadd8", 0xFA81_F052, 0xFF80_0102, 0x0180_0101, 0xFFFF_0203, 0),
    ("shadd16", 0xFA91_F022, 0x7FFF_8000, 0x7FFF_8000, 0x7FFF_8000, 0),
    ("uhsub8", 0xFAC1_F062, 0x0000_0005, 0x0000_0102, 0x0000_FF01, 0),
];

#[test]
fn parallel_sums_set_ge_saturate_and_halve() {
    for &(name, code, n, m, expected, ge) in PARALLEL {
        let after = run(code, n, m, Registers::default());
        let found = (after.r[0], (after.apsr & flag::GE) >> 16);
        assert_eq!(found, (expected, ge), "{name}");
    }
}

#[test]
fn saturation_sets_q() {
    let q = |code, n, m| with_accumulator(code, n, m, 0);
    let max = i32::MAX as u32;
    assert_eq!(q(0xFA81_F082, 1, max), (max, true)); // qadd
    assert_eq!(q(0xFA81_F082, 1, max - 1), (max, false));
    // Doubling saturates by itself: -1 + sat(2 × 2^30).
    assert_eq!(q(0xFA81_F092, 1 << 30, u32::MAX), (max - 1, true)); // qdadd
    assert_eq!(q(0xFA81_F0A2, 1, 1 << 31), (1 << 31, true)); // qsub
    assert_eq!(q(0xFA81_F0B2, 1, 5), (3, false)); // qdsub
}

#[test]
fn bits_and_bytes() {
    assert_eq!(result(0xFA92_F082, 0, 0x0102_0380), 0x8003_0201); // rev
    assert_eq!(result(0xFA92_F092, 0, 0x0102_0380), 0x0201_8003); // rev16
    assert_eq!(result(0xFA92_F0A2, 0, 0x0000_0001), 0x8000_0000); // rbit
    assert_eq!(result(0xFA92_F0B2, 0, 0x0102_0380), 0xFFFF_8003); // revsh
    assert_eq!(result(0xFAB2_F082, 0, 0), 32); // clz
    let before = Registers {
        apsr: 0b0110 << 16,
        ..Registers::default()
    };
    let selected = run(0xFAA1_F082, 0x1111_1111, 0x2222_2222, before);
    assert_eq!(selected.r[0], 0x2211_1122); // sel
}

#[test]
fn short_multiplications() {
    let minimum = 1 << 31;
    assert_eq!(with_accumulator(0xFB01_3002, 3, 5, 2), (17, false)); // mla
    let expected = (-13_i32 as u32, false);
    assert_eq!(with_accumulator(0xFB01_3012, 3, 5, 2), expected); // mls
    assert_eq!(result(0xFB11_F032, 0xFFFF_0000, 0x0003_0000), -3_i32 as u32); // smultt
    let max = i32::MAX as u32;
    assert_eq!(with_accumulator(0xFB11_3002, 1, 1, max), (minimum, true)); // smlabb
    assert_eq!(result(0xFB31_F002, minimum, 0x8000), 0x4000_0000); // smulwb
    assert_eq!(result(0xFB31_F002, u32::MAX, 1), u32::MAX); // floors
    // -2^15 squared twice: 2^31 does not fit.
    let expected = (minimum, true);
    assert_eq!(
        with_accumulator(0xFB21_F002, 0x8000_8000, 0x8000_8000, 0),
        expected
    );
    assert_eq!(result(0xFB21_F012, 0x0002_0003, 0x0005_0007), 29); // smuadx: 3×5 + 2×7
    assert_eq!(result(0xFB41_F002, 0x0002_0003, 0x0005_0007), 11); // smusd: 3×7 - 2×5
    assert_eq!(result(0xFB51_F002, 1 << 30, 3), 0); // smmul
    assert_eq!(result(0xFB51_F012, 1 << 30, 3), 1); // smmulr
    assert_eq!(with_accumulator(0xFB61_3002, 1, 1, 1), (0, false)); // smmls
    let expected = (265, false);
    assert_eq!(
        with_accumulator(0xFB71_3002, 0x01FF_0005, 0x0200_0003, 7),
        expected
    ); // usada8
}

#[test]
fn long_multiplications() {
    let all = u32::MAX;
    assert_eq!(long(0xFB81_3002, all, 2, 0), -2_i64 as u64); // smull
    assert_eq!(long(0xFBA1_3002, all, all, 0), 0xFFFF_FFFE_0000_0001); // umull
    assert_eq!(long(0xFBC1_3002, all, 1, 0), u64::MAX); // smlal
    assert_eq!(long(0xFBE1_3002, all, all, u64::MAX), 0xFFFF_FFFE_0000_0000); // umlal wraps
    assert_eq!(long(0xFBE1_3062, all, all, u64::MAX), u64::MAX); // umaal
    assert_eq!(long(0xFBC1_30B2, 0x8000_0000, 0x8000_0000, 1), 0x4000_0001); // smlaltt
    assert_eq!(long(0xFBC1_30C2, 0x8000_8000, 0x8000_8000, 0), 1 << 31); // smlald
    assert_eq!(long(0xFBD1_30D2, 0x0002_0003, 0x0005_0007, 0), 1); // smlsldx: 3×5 - 2×7
}

#[test]
fn divisions() {
    let (sdiv, udiv) = (0xFB91_F0F2, 0xFBB1_F0F2);
    let minimum = 1 << 31;
    assert_eq!(result(sdiv, -7_i32 as u32, 2), -3_i32 as u32);
    assert_eq!(result(sdiv, minimum, u32::MAX), minimum);
    assert_eq!(result(sdiv, 5, 0), 0);
    assert_eq!(result(udiv, u32::MAX, 2), i32::MAX as u32);
    assert_eq!(result(udiv, 5, 0), 0);
}

#[test]
fn divisions_take_2_to_12_cycles() {
    assert_eq!(cycles(u32::MAX, 1), 12);
    assert_eq!(cycles(0, 5), 2);
    assert_eq!(cycles(5, 0), 2);
    assert_eq!(cycles(1, 2), 3);
    assert_eq!(cycles(100, 10), 5);
}

#[test]
fn multiplications_take_one_cycle() {
    let take = |code: u32| {
        let op = decode((code >> 16) as u16, code as u16).unwrap();
        execute(op, &mut Registers::default())
    };
    assert_eq!(take(0xFB01_F002), 1); // mul
    assert_eq!(take(0xFB01_3002), 1); // mla
    assert_eq!(take(0xFB01_3012), 1); // mls
    assert_eq!(take(0xFBE1_3002), 1); // umlal
}

#[test]
fn unpredictable_and_undefined_are_refused() {
    for code in [
        0xFA01_F00D_u32, // shift by SP
        0xFA91_F083,     // rev with two operands
        0xFB01_F012,     // mls without accumulator
        0xFB81_0002,     // both words of the result in one register
        0xFAD1_F0F2,     // nothing
        0xFB91_30F2,     // sdiv with bits that must be one
    ] {
        let op: Option<Op> = decode((code >> 16) as u16, code as u16);
        assert_eq!(op, None, "{code:#010x}");
    }
}
