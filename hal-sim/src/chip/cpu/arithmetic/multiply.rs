//! Executes multiplications (Arm ARM A7.7), one cycle each (TRM table 3-1).

use super::{ThreeRegisters, get, get_or_zero, set, set_q_flag};
use crate::chip::cpu::Registers;

/// A multiplication whose result is one register; the accumulator, if there is one, is added.
/// `n_top` and `m_top` select the upper half of a factor, `exchange` swaps the halves of the second
/// factor, and `round` rounds instead of truncating.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[rustfmt::skip]
pub enum Multiply {
    Low, // MUL, MLA
    Subtract, // MLS: the product is subtracted
    Halves { n_top: bool, m_top: bool }, // SMULxy, SMLAxy
    WordByHalf { m_top: bool }, // SMULWy, SMLAWy: the upper 32 of 48 bits
    DualAdd { exchange: bool }, // SMUAD, SMLAD
    DualSubtract { exchange: bool }, // SMUSD, SMLSD
    High { round: bool }, // SMMUL, SMMLA: the upper 32 of 64 bits
    HighSubtract { round: bool }, // SMMLS
    AbsoluteDifferences, // USAD8, USADA8
}

/// A multiplication whose result is two registers; the fields are those of [`Multiply`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[rustfmt::skip]
pub enum LongMultiply {
    Signed, // SMULL
    Unsigned, // UMULL
    SignedAccumulate, // SMLAL
    UnsignedAccumulate, // UMLAL
    UnsignedDoubleAccumulate, // UMAAL: both words of the destination are added separately
    Halves { n_top: bool, m_top: bool }, // SMLALxy
    DualAdd { exchange: bool }, // SMLALD
    DualSubtract { exchange: bool }, // SMLSLD
}

/// Returns the upper (`top`) or lower half-word of `x`, sign-extended.
const fn half(x: u32, top: bool) -> i64 {
    (if top { x >> 16 } else { x }) as u16 as i16 as i64
}

/// Returns the product of the lower half-words and that of the upper half-words of `n` and `m`,
/// whose halves are first swapped if `exchange`.
const fn dual_products(n: u32, m: u32, exchange: bool) -> (i64, i64) {
    let m = if exchange { m.rotate_left(16) } else { m };
    (
        half(n, false) * half(m, false),
        half(n, true) * half(m, true),
    )
}

const fn signed_product(n: u32, m: u32) -> i64 {
    n as i32 as i64 * m as i32 as i64
}

/// Returns the upper word of `a`:0 plus `product`, rounded if `round`.
const fn high(a: u32, product: i64, round: bool) -> u32 {
    let sum = ((a as i64) << 32).wrapping_add(product);
    let sum = if round {
        sum.wrapping_add(1 << 31)
    } else {
        sum
    };
    (sum >> 32) as u32
}

pub(super) fn short(kind: Multiply, x: ThreeRegisters, a: u8, registers: &mut Registers) -> u32 {
    let (n, m) = (get(registers, x.n), get(registers, x.m));
    let addend = get_or_zero(registers, a);
    // These sums set Q if they overflow; none needs more than 34 bits.
    let with_q = |product: i64| i64::from(addend as i32) + product;
    let sum = match kind {
        Multiply::Low | Multiply::Subtract => {
            let product = n.wrapping_mul(m);
            let subtracts = kind == Multiply::Subtract;
            let sum = if subtracts {
                addend.wrapping_sub(product)
            } else {
                addend.wrapping_add(product)
            };
            i64::from(sum as i32)
        }
        Multiply::Halves { n_top, m_top } => with_q(half(n, n_top) * half(m, m_top)),
        Multiply::WordByHalf { m_top } => {
            let product = i64::from(n as i32) * half(m, m_top);
            with_q(product >> 16)
        }
        Multiply::DualAdd { exchange } => {
            let (low, high) = dual_products(n, m, exchange);
            with_q(low + high)
        }
        Multiply::DualSubtract { exchange } => {
            let (low, high) = dual_products(n, m, exchange);
            with_q(low - high)
        }
        Multiply::High { round } => {
            let word = high(addend, signed_product(n, m), round);
            i64::from(word as i32)
        }
        Multiply::HighSubtract { round } => {
            // The negative of -2^31 squared still fits.
            let word = high(addend, -signed_product(n, m), round);
            i64::from(word as i32)
        }
        Multiply::AbsoluteDifferences => {
            let sum = addend.wrapping_add(absolute_differences(n, m));
            i64::from(sum as i32)
        }
    };
    set(registers, x.d, sum as u32);
    set_q_flag(registers, i64::from(sum as i32) != sum);
    1
}

fn absolute_differences(n: u32, m: u32) -> u32 {
    let pairs = n.to_le_bytes().into_iter().zip(m.to_le_bytes());
    pairs.map(|(n, m)| u32::from(n.abs_diff(m))).sum()
}

pub(super) fn long(kind: LongMultiply, x: ThreeRegisters, low: u8, registers: &mut Registers) {
    let (n, m) = (get(registers, x.n), get(registers, x.m));
    let (old_low, old_high) = (get(registers, low), get(registers, x.d));
    let old = u64::from(old_high) << 32 | u64::from(old_low);
    let unsigned = u64::from(n) * u64::from(m);
    let add = |product: i64| old.wrapping_add(product as u64);
    let result = match kind {
        LongMultiply::Signed => signed_product(n, m) as u64,
        LongMultiply::Unsigned => unsigned,
        LongMultiply::SignedAccumulate => add(signed_product(n, m)),
        LongMultiply::UnsignedAccumulate => old.wrapping_add(unsigned),
        // (2^32 - 1)^2 + 2 (2^32 - 1) = 2^64 - 1, so the sum fits.
        LongMultiply::UnsignedDoubleAccumulate => {
            unsigned + u64::from(old_low) + u64::from(old_high)
        }
        LongMultiply::Halves { n_top, m_top } => add(half(n, n_top) * half(m, m_top)),
        LongMultiply::DualAdd { exchange } => {
            let (bottom, top) = dual_products(n, m, exchange);
            add(bottom + top)
        }
        LongMultiply::DualSubtract { exchange } => {
            let (bottom, top) = dual_products(n, m, exchange);
            add(bottom - top)
        }
    };
    set(registers, low, result as u32);
    set(registers, x.d, (result >> 32) as u32);
}
