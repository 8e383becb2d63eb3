//! Tests edge cases that random numbers rarely reach, derived by hand from the Arm ARM's
//! pseudo-code, and that the host's results equal the integer computation. `qemu_instructions`
//! tests every operation with its flags and modes.

use super::convert::{half_to_single, single_to_half};
use super::fpscr::{AHP, DN, FZ, IOC, IXC, OFC, UFC};
use super::operations::{add, divide, multiply, multiply_add, square_root, subtract};

const UP: u32 = 1 << 22;
const DOWN: u32 = 2 << 22;
const ZERO: u32 = 3 << 22;
const ONE: u32 = 0x3F80_0000;
const INFINITY: u32 = 0x7F80_0000;
const LEAST_NORMAL: u32 = 0x0080_0000;
const MINUS: u32 = 1 << 31;
const DEFAULT: u32 = 0x7FC0_0000;

/// Returns the result and the flags of `f` with `mode` in FPSCR.
fn under(mode: u32, f: impl Fn(&mut u32) -> u32) -> (u32, u32) {
    let mut fpscr = mode;
    let result = f(&mut fpscr);
    assert_eq!(fpscr & !0x9F, mode & !0x9F, "only flags may change");
    (result, fpscr & 0x9F)
}

#[test]
fn tininess_is_found_before_rounding() {
    // (1 - 2^-24) × 2^-126 rounds up to the smallest normal number, and is tiny.
    let below_one = ONE - 1;
    let product = |mode| under(mode, |f| multiply(below_one, LEAST_NORMAL, f));
    assert_eq!(product(0), (LEAST_NORMAL, UFC | IXC));
    assert_eq!(product(DOWN), (LEAST_NORMAL - 1, UFC | IXC));
    // Flushed results are not inexact.
    assert_eq!(product(FZ), (0, UFC));
    // An exact denormal is no underflow.
    let half = 0x3F00_0000;
    let expected = (LEAST_NORMAL / 2, 0);
    assert_eq!(under(0, |f| multiply(half, LEAST_NORMAL, f)), expected);
    // Less than half of the smallest denormal.
    assert_eq!(under(0, |f| multiply(1, 1, f)), (0, UFC | IXC));
    assert_eq!(under(UP, |f| multiply(1, 1, f)), (1, UFC | IXC));
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
    // Infinity times zero replaces a quiet addend, not a signalling one.
    assert_eq!(fused(quiet_1, INFINITY, 0), (DEFAULT, IOC));
    assert_eq!(fused(second, INFINITY, 0), (0xFFE0_0002, IOC));
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
}

/// Generates numbers of every kind from a fixed seed.
fn numbers() -> impl Iterator<Item = u32> {
    let mut state = 0x1234_5678_9ABC_DEF1_u64;
    std::iter::from_fn(move || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        let bits = (state >> 32) as u32;
        // Every fourth is near 1, so that sums cancel; every eighth is denormal.
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
        // IXC is clear, so that the host does not compute.
        same(x + y, under(0, |f| add(a, b, f)));
        same(x - y, under(0, |f| subtract(a, b, f)));
        same(x * y, under(0, |f| multiply(a, b, f)));
        same(x / y, under(0, |f| divide(a, b, f)));
        same(x.sqrt(), under(0, |f| square_root(a, f)));
        same(y.mul_add(z, x), under(0, |f| multiply_add(a, b, c, f)));
        // With IXC set the host may compute; bits and flags must be the same.
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
