//! Against the Arm ARM's pseudo-code, by hand, and against the host's
//! arithmetic where that is exact.

use super::convert::{half_to_single, single_to_half};
use super::fpscr::{AHP, DN, DZC, FZ, IDC, IOC, IXC, OFC, UFC};
use super::operations::{add, compare, divide, multiply, multiply_add, square_root, subtract};
use super::{Arithmetic, Fixed, Op, Registers, Transfer, Unary, Writeback, decode, execute};

const UP: u32 = 1 << 22;
const DOWN: u32 = 2 << 22;
const ZERO: u32 = 3 << 22;
const ONE: u32 = 0x3F80_0000;
const INFINITY: u32 = 0x7F80_0000;
const GREATEST: u32 = 0x7F7F_FFFF;
const LEAST_NORMAL: u32 = 0x0080_0000;
const MINUS: u32 = 1 << 31;
const DEFAULT: u32 = 0x7FC0_0000;

/// Result and flags of `f` under `mode`.
fn under(mode: u32, f: impl Fn(&mut u32) -> u32) -> (u32, u32) {
    let mut fpscr = mode;
    let result = f(&mut fpscr);
    assert_eq!(fpscr & !0x9F, mode & !0x9F, "only flags may change");
    (result, fpscr & 0x9F)
}

#[test]
fn addition_rounds_as_asked() {
    // 1 + 2^-24 is half way between 1 and its successor.
    let tiny = 0x3380_0000;
    let sum = |mode| under(mode, |f| add(ONE, tiny, f));
    assert_eq!(sum(0), (ONE, IXC));
    assert_eq!(sum(UP), (ONE + 1, IXC));
    assert_eq!(sum(DOWN), (ONE, IXC));
    assert_eq!(sum(ZERO), (ONE, IXC));
    // The successor of 1 plus the same is half way, too: to even, upwards.
    assert_eq!(under(0, |f| add(ONE + 1, tiny, f)), (ONE + 2, IXC));
    // Far below the last bit, it still sticks.
    assert_eq!(under(UP, |f| add(ONE, 1, f)), (ONE + 1, IXC));
    assert_eq!(under(DOWN, |f| subtract(ONE, 1, f)), (ONE - 1, IXC));
}

#[test]
fn zeros_have_the_sign_of_the_mode() {
    assert_eq!(under(0, |f| subtract(ONE, ONE, f)), (0, 0));
    assert_eq!(under(DOWN, |f| subtract(ONE, ONE, f)), (MINUS, 0));
    assert_eq!(under(0, |f| add(MINUS, MINUS, f)), (MINUS, 0));
    assert_eq!(under(DOWN, |f| add(0, 0, f)), (0, 0));
    assert_eq!(under(DOWN, |f| add(0, MINUS, f)), (MINUS, 0));
}

#[test]
fn overflow_depends_on_mode_and_sign() {
    let double = |x, mode| under(mode, |f| add(x, x, f));
    assert_eq!(double(GREATEST, 0), (INFINITY, OFC | IXC));
    assert_eq!(double(GREATEST, ZERO), (GREATEST, OFC | IXC));
    assert_eq!(double(GREATEST | MINUS, UP), (GREATEST | MINUS, OFC | IXC));
    let expected = (INFINITY | MINUS, OFC | IXC);
    assert_eq!(double(GREATEST | MINUS, DOWN), expected);
}

#[test]
fn tininess_is_found_before_rounding() {
    // (1 - 2^-24) × 2^-126 rounds up to the least normal number, and is tiny.
    let below_one = ONE - 1;
    let product = |mode| under(mode, |f| multiply(below_one, LEAST_NORMAL, f));
    assert_eq!(product(0), (LEAST_NORMAL, UFC | IXC));
    assert_eq!(product(DOWN), (LEAST_NORMAL - 1, UFC | IXC));
    // Flushed: no inexact.
    assert_eq!(product(FZ), (0, UFC));
    // A denormal that is exact underflows nothing.
    let half = 0x3F00_0000;
    let expected = (LEAST_NORMAL / 2, 0);
    assert_eq!(under(0, |f| multiply(half, LEAST_NORMAL, f)), expected);
    // Less than half of the least denormal.
    assert_eq!(under(0, |f| multiply(1, 1, f)), (0, UFC | IXC));
    assert_eq!(under(UP, |f| multiply(1, 1, f)), (1, UFC | IXC));
}

#[test]
fn denormal_inputs_are_flushed_under_fz() {
    assert_eq!(under(FZ, |f| add(1, MINUS | 1, f)), (0, IDC));
    assert_eq!(under(FZ, |f| add(ONE, 1, f)), (ONE, IDC));
    assert_eq!(under(0, |f| add(1, 1, f)), (2, 0));
    assert_eq!(under(FZ, |f| compare(1, 0, false, f)), (0x6000_0000, IDC));
    assert_eq!(under(FZ, |f| divide(ONE, 1, f)), (INFINITY, DZC | IDC));
}

#[test]
fn nans_are_quieted_in_order() {
    let (first, second) = (0x7F80_0001, 0xFFA0_0002);
    let (quiet_1, quiet_2) = (0x7FC0_0003, 0xFFC0_0004);
    assert_eq!(under(0, |f| add(first, second, f)), (0x7FC0_0001, IOC));
    assert_eq!(under(0, |f| add(quiet_1, second, f)), (0xFFE0_0002, IOC));
    assert_eq!(under(0, |f| add(quiet_1, quiet_2, f)), (quiet_1, 0));
    assert_eq!(under(DN, |f| add(quiet_2, quiet_1, f)), (DEFAULT, 0));
    // VSUB does not change a NaN's sign.
    assert_eq!(under(0, |f| subtract(ONE, quiet_2, f)), (quiet_2, 0));
    let fused = |a, b, c| under(0, |f| multiply_add(a, b, c, f));
    assert_eq!(fused(quiet_1, first, ONE), (0x7FC0_0001, IOC));
    assert_eq!(fused(ONE, quiet_2, quiet_1), (quiet_2, 0));
    // Infinity times zero hides a quiet addend, not a signalling one.
    assert_eq!(fused(quiet_1, INFINITY, 0), (DEFAULT, IOC));
    assert_eq!(fused(second, INFINITY, 0), (0xFFE0_0002, IOC));
}

#[test]
fn invalid_operations_give_the_default_nan() {
    let bad = (DEFAULT, IOC);
    assert_eq!(under(0, |f| subtract(INFINITY, INFINITY, f)), bad);
    assert_eq!(under(0, |f| multiply(INFINITY | MINUS, 0, f)), bad);
    assert_eq!(under(0, |f| divide(0, 0, f)), bad);
    assert_eq!(under(0, |f| divide(INFINITY, INFINITY, f)), bad);
    assert_eq!(under(0, |f| square_root(ONE | MINUS, f)), bad);
    assert_eq!(under(0, |f| square_root(MINUS, f)), (MINUS, 0));
    let expected = (INFINITY | MINUS, DZC);
    assert_eq!(under(0, |f| divide(ONE | MINUS, 0, f)), expected);
    let cancels = |f: &mut u32| multiply_add(INFINITY | MINUS, INFINITY, ONE, f);
    assert_eq!(under(0, cancels), bad);
}

#[test]
fn fused_rounds_once() {
    // (1 + 2^-23)(1 - 2^-23) - 1 = -2^-46; rounded twice it would be 0.
    let (a, b) = (ONE + 1, ONE - 2);
    let expected = (0x2880_0000 | MINUS, 0);
    assert_eq!(under(0, |f| multiply_add(ONE | MINUS, a, b, f)), expected);
    assert_eq!(under(0, |f| multiply(a, b, f)), (ONE, IXC));
}

#[test]
fn division_and_root() {
    let (two, three) = (0x4000_0000, 0x4040_0000);
    assert_eq!(under(0, |f| divide(ONE, three, f)), (0x3EAA_AAAB, IXC));
    assert_eq!(under(ZERO, |f| divide(ONE, three, f)), (0x3EAA_AAAA, IXC));
    assert_eq!(under(0, |f| square_root(two, f)), (0x3FB5_04F3, IXC));
    assert_eq!(under(UP, |f| square_root(two, f)), (0x3FB5_04F4, IXC));
    assert_eq!(under(0, |f| square_root(0x4110_0000, f)), (three, 0)); // 9
}

#[test]
fn comparisons_signal_as_asked() {
    let quiet = DEFAULT;
    assert_eq!(under(0, |f| compare(ONE, quiet, false, f)), (3 << 28, 0));
    assert_eq!(under(0, |f| compare(ONE, quiet, true, f)), (3 << 28, IOC));
    let expected = (3 << 28, IOC);
    assert_eq!(under(0, |f| compare(0x7F80_0001, 0, false, f)), expected);
    assert_eq!(under(0, |f| compare(0, MINUS, true, f)), (6 << 28, 0));
    let expected = (8 << 28, 0);
    assert_eq!(under(0, |f| compare(ONE | MINUS, ONE, true, f)), expected);
    assert_eq!(under(0, |f| compare(INFINITY, ONE, true, f)), (2 << 28, 0));
}

/// One unary operation on S1, into S0, which holds `old`.
fn unary(kind: Unary, x: u32, old: u32, mode: u32) -> (u32, u32) {
    let mut registers = Registers {
        fpscr: mode,
        ..Registers::default()
    };
    registers.s[0] = old;
    registers.s[1] = x;
    assert_eq!(execute(Op::Unary(kind, 0, 1), &mut registers), 1);
    (registers.s[0], registers.fpscr & 0x9F)
}

#[test]
fn integers_saturate_and_round() {
    let to = |x: f32, signed, truncate, mode| {
        unary(Unary::ToInteger { signed, truncate }, x.to_bits(), 0, mode)
    };
    assert_eq!(to(-1.5, true, true, 0), (-1_i32 as u32, IXC));
    assert_eq!(to(-1.5, true, false, 0), (-2_i32 as u32, IXC));
    assert_eq!(to(2.5, true, false, 0), (2, IXC));
    assert_eq!(to(2.5, true, false, UP), (3, IXC));
    assert_eq!(to(-0.5, false, false, 0), (0, IXC));
    assert_eq!(to(-0.5, false, false, DOWN), (0, IOC));
    assert_eq!(to(f32::NAN, true, true, 0), (0, IOC));
    assert_eq!(to(f32::INFINITY, true, true, 0), (i32::MAX as u32, IOC));
    assert_eq!(to(4_294_967_296.0, false, true, 0), (u32::MAX, IOC));
    assert_eq!(to(-2_147_483_648.0, true, true, 0), (1 << 31, 0));
    assert_eq!(to(f32::from_bits(1), false, false, UP), (1, IXC));
    let from = |x, signed, mode| unary(Unary::FromInteger { signed }, x, 0, mode);
    assert_eq!(from(u32::MAX, true, 0), (ONE | MINUS, 0));
    assert_eq!(from(u32::MAX, false, 0), (0x4F80_0000, IXC));
    assert_eq!(from(u32::MAX, false, ZERO), (0x4F7F_FFFF, IXC));
    assert_eq!(from(0, true, DOWN), (0, 0));
}

#[test]
fn fixed_point() {
    let q = |half_word, signed, fraction| Fixed {
        signed,
        half_word,
        fraction,
    };
    let to = |x: f32, fixed| unary(Unary::ToFixed(fixed), x.to_bits(), 0, 0);
    assert_eq!(to(1.5, q(false, true, 16)), (0x1_8000, 0));
    assert_eq!(to(-1.0, q(true, true, 15)), (0xFFFF_8000, 0));
    assert_eq!(to(1.0, q(true, true, 15)), (0x7FFF, IOC));
    assert_eq!(to(-1.0 / 3.0, q(true, true, 8)), (-85_i32 as u32, IXC));
    assert_eq!(to(0.0, q(false, false, 32)), (0, 0));
    let from = |x, fixed| unary(Unary::FromFixed(fixed), x, 0, UP);
    assert_eq!(from(0xABCD_8000, q(true, true, 15)), (ONE | MINUS, 0));
    assert_eq!(from(0x8000, q(true, false, 15)), (ONE, 0));
    // To nearest, though FPSCR says up.
    assert_eq!(from(0x0100_0001, q(false, true, 24)), (ONE, IXC));
}

#[test]
fn half_precision() {
    let half = |x: u32, mode| under(mode, |f| half_to_single(x, f));
    assert_eq!(half(0x3C00, 0), (ONE, 0));
    assert_eq!(half(0x0001, FZ), (0x3380_0000, 0)); // 2^-24
    assert_eq!(half(0xFC00, 0), (INFINITY | MINUS, 0));
    assert_eq!(half(0x7C01, 0), (0x7FC0_2000, IOC));
    assert_eq!(half(0x7FFF, AHP), (0x47FF_E000, 0)); // 131008
    let single = |x: f32, mode| under(mode, |f| single_to_half(x.to_bits(), f));
    assert_eq!(single(65_520.0, 0), (0x7C00, OFC | IXC));
    assert_eq!(single(65_519.0, 0), (0x7BFF, IXC));
    assert_eq!(single(65_536.0, AHP), (0x7C00, 0));
    assert_eq!(single(1e6, AHP), (0x7FFF, IOC));
    assert_eq!(single(f32::NEG_INFINITY, AHP), (0xFFFF, IOC));
    assert_eq!(single(f32::NAN, AHP), (0, IOC));
    assert_eq!(single(3e-8, FZ), (0x0001, UFC | IXC));
    let kept = unary(Unary::ToHalf { top: true }, ONE, 0x1234_5678, 0);
    assert_eq!(kept, (0x3C00_5678, 0));
}

#[test]
fn decodes_what_the_assembler_encodes() {
    let at = |code: u32| decode((code >> 16) as u16, code as u16);
    let sum = Arithmetic::Add;
    assert_eq!(at(0xEE30_0A81), Some(Op::Arithmetic(sum, 0, 1, 2))); // vadd.f32 s0, s1, s2
    let fnms = Arithmetic::Fused {
        minus_product: false,
        minus_addend: true,
    };
    assert_eq!(at(0xEE90_0A81), Some(Op::Arithmetic(fnms, 0, 1, 2))); // vfnms.f32
    assert_eq!(at(0xEEB7_0A00), Some(Op::Constant(0, ONE))); // vmov.f32 s0, #1
    assert_eq!(at(0xEEF1_FA10), Some(Op::ReadFlags)); // vmrs APSR_nzcv, fpscr
    assert_eq!(at(0xEE30_0B01), None); // vadd.f64: not here
    let push = Transfer {
        s: 16,
        count: 4,
        n: 13,
        writeback: Writeback::Down,
        offset: -16,
    };
    assert_eq!(at(0xED2D_8B04), Some(Op::Store(push))); // vpush {d8, d9}
}

/// Numbers of every kind, from a fixed seed.
fn numbers() -> impl Iterator<Item = u32> {
    let mut state = 0x1234_5678_9ABC_DEF1_u64;
    std::iter::from_fn(move || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        let bits = (state >> 32) as u32;
        // Every fourth near 1, so that sums cancel; every eighth denormal.
        Some(match state & 7 {
            0 | 1 => bits & 0x83FF_FFFF | 0x3C00_0000,
            2 => bits & 0x80FF_FFFF,
            _ => bits,
        })
    })
}

#[test]
fn the_integer_core_agrees_with_the_host() {
    let mut source = numbers();
    for _ in 0..200_000 {
        let [a, b, c] = std::array::from_fn(|_| source.next().unwrap());
        let (x, y, z) = (f32::from_bits(a), f32::from_bits(b), f32::from_bits(c));
        let same = |host: f32, (ours, _): (u32, u32)| {
            assert!(
                host.to_bits() == ours || host.is_nan() && f32::from_bits(ours).is_nan(),
                "{a:#010x} {b:#010x} {c:#010x}: {ours:#010x}, host {host:e}"
            );
        };
        // IXC is clear, so that the host is not asked.
        same(x + y, under(0, |f| add(a, b, f)));
        same(x - y, under(0, |f| subtract(a, b, f)));
        same(x * y, under(0, |f| multiply(a, b, f)));
        same(x / y, under(0, |f| divide(a, b, f)));
        same(x.sqrt(), under(0, |f| square_root(a, f)));
        same(y.mul_add(z, x), under(0, |f| multiply_add(a, b, c, f)));
        // With IXC set it may be; the bits and flags must not change by it.
        for mode in [0, UP, DOWN, ZERO, FZ, DN] {
            let plain = under(mode, |f| multiply(a, b, f));
            let fast = under(mode | IXC, |f| multiply(a, b, f));
            assert_eq!(fast, (plain.0, plain.1 | IXC), "{a:#x} {b:#x} {mode:#x}");
            let plain = under(mode, |f| add(a, b, f));
            let fast = under(mode | IXC, |f| add(a, b, f));
            assert_eq!(fast, (plain.0, plain.1 | IXC), "{a:#x} {b:#x} {mode:#x}");
        }
    }
}
