//! Tests edge cases that random operands rarely reach, derived by hand from the Arm ARM's
//! pseudo-code, the cycles of divisions, and refused encodings. `qemu_instructions` tests every
//! operation.

use super::divide::cycles;
use super::{decode, execute};
use crate::chip::cpu::Registers;
use crate::chip::cpu::registers::flag;

/// Text, code with Rn = R1 and Rm = R2, its operands, R3 and R0 before and after, Q after.
type Corner = (&'static str, u32, [u32; 2], [u32; 2], [u32; 2], bool);

const MOST: u32 = 0x7FFF_FFFF;
const LEAST: u32 = 0x8000_0000;
const ALL: u32 = u32::MAX;

#[rustfmt::skip]
const CORNERS: &[Corner] = &[
    ("lsl: the lowest byte counts", 0xFA01_F002, [1, 0x100], [0, 0], [0, 1], false),
    ("lsl by 33", 0xFA01_F002, [1, 33], [0, 0], [0, 0], false),
    ("asr by 200", 0xFA41_F002, [LEAST, 200], [0, 0], [0, ALL], false),
    ("ror by 32", 0xFA61_F002, [LEAST, 32], [0, 0], [0, LEAST], false),
    ("qadd", 0xFA81_F082, [1, MOST], [0, 0], [0, MOST], true),
    ("qadd, not quite", 0xFA81_F082, [1, MOST - 1], [0, 0], [0, MOST], false),
    ("qdadd: doubling saturates by itself", 0xFA81_F092, [1 << 30, ALL], [0, 0], [0, MOST - 1], true),
    ("qsub", 0xFA81_F0A2, [1, LEAST], [0, 0], [0, LEAST], true),
    ("clz of nothing", 0xFAB2_F082, [0, 0], [0, 0], [0, 32], false),
    ("smlabb", 0xFB11_3002, [1, 1], [MOST, 0], [MOST, LEAST], true),
    ("smuad: -2^15 squared twice", 0xFB21_F002, [0x8000_8000; 2], [0, 0], [0, LEAST], true),
    ("smulwb floors", 0xFB31_F002, [ALL, 1], [0, 0], [0, ALL], false),
    ("smmulr", 0xFB51_F012, [1 << 30, 3], [0, 0], [0, 1], false),
    ("smmls", 0xFB61_3002, [1, 1], [1, 0], [1, 0], false),
    ("umull", 0xFBA1_3002, [ALL, ALL], [0, 0], [1, ALL - 1], false),
    ("umlal wraps", 0xFBE1_3002, [ALL, ALL], [ALL, ALL], [0, ALL - 1], false),
    ("umaal fits", 0xFBE1_3062, [ALL, ALL], [ALL, ALL], [ALL, ALL], false),
    ("smlald", 0xFBC1_30C2, [0x8000_8000; 2], [0, 0], [LEAST, 0], false),
    ("sdiv to zero", 0xFB91_F0F2, [7_u32.wrapping_neg(), 2], [0, 0], [0, 3_u32.wrapping_neg()], false),
    ("sdiv without a quotient", 0xFB91_F0F2, [LEAST, ALL], [0, 0], [0, LEAST], false),
    ("sdiv by 0", 0xFB91_F0F2, [5, 0], [0, 9], [0, 0], false),
    ("udiv by 0", 0xFBB1_F0F2, [5, 0], [0, 9], [0, 0], false),
];

#[test]
fn corners_are_the_manuals() {
    for &(name, code, [n, m], [r3, r0], after, q) in CORNERS {
        let op = decode((code >> 16) as u16, code as u16).unwrap();
        let mut registers = Registers::default();
        registers.r[..4].copy_from_slice(&[r0, n, m, r3]);
        execute(op, &mut registers);
        let found = [registers.r[3], registers.r[0]];
        assert_eq!((found, registers.apsr == flag::Q), (after, q), "{name}");
    }
}

#[test]
fn divisions_take_2_to_12_cycles() {
    let cases = [(u32::MAX, 1), (0, 5), (5, 0), (1, 2), (100, 10)];
    assert_eq!(cases.map(|(n, m)| cycles(n, m)), [12, 2, 2, 3, 5]);
}

#[test]
fn unpredictable_and_undefined_are_refused() {
    for code in [
        0xFA01_F00D_u32, // shift by SP
        0xFA91_F083,     // rev with two different operands
        0xFB01_F012,     // mls without accumulator
        0xFB81_0002,     // both words of the result in one register
        0xFAD1_F0F2,     // unallocated
        0xFB91_30F2,     // sdiv with bits that must be one
    ] {
        assert_eq!(
            decode((code >> 16) as u16, code as u16),
            None,
            "{code:#010x}"
        );
    }
}
