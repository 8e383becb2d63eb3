//! Executes parallel addition and subtraction of two half-words or four bytes (Arm ARM A7.7, SADD16
//! … UHSUB8).

/// Interpretation of the lanes (bytes or half-words) of a parallel operation, and treatment of
/// their results. Named after the prefix of the instruction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Prefix {
    Signed,             // S: wraps, sets GE
    SignedSaturating,   // Q: saturates
    SignedHalving,      // SH: halves
    Unsigned,           // U: wraps, sets GE
    UnsignedSaturating, // UQ: saturates
    UnsignedHalving,    // UH: halves
}

/// Operation of a parallel instruction on each lane, a byte or half-word of the operands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Lanes {
    AddHalves, // ADD16
    // ASX: top adds the other operand's bottom, bottom subtracts the other's top
    AddSubtractExchanged,
    // SAX: top subtracts the other operand's bottom, bottom adds the other's top
    SubtractAddExchanged,
    SubtractHalves, // SUB16
    AddBytes,       // ADD8
    SubtractBytes,  // SUB8
}

/// Returns the result of a parallel operation on `a` and `b`, and the four GE bits if the operation
/// sets them.
pub(super) fn compute(prefix: Prefix, lanes: Lanes, a: u32, b: u32) -> (u32, Option<u32>) {
    let (result, ge) = match lanes {
        Lanes::AddBytes => lane_by_lane::<8>(prefix, a, b, 0),
        Lanes::SubtractBytes => lane_by_lane::<8>(prefix, a, b, 0b1111),
        Lanes::AddHalves => lane_by_lane::<16>(prefix, a, b, 0),
        Lanes::SubtractHalves => lane_by_lane::<16>(prefix, a, b, 0b11),
        Lanes::AddSubtractExchanged => lane_by_lane::<16>(prefix, a, b.rotate_left(16), 0b01),
        Lanes::SubtractAddExchanged => lane_by_lane::<16>(prefix, a, b.rotate_left(16), 0b10),
    };
    let sets_ge = matches!(prefix, Prefix::Signed | Prefix::Unsigned);
    (result, sets_ge.then_some(ge))
}

/// Computes the result and the GE bits of all lanes. Bit n of `subtract` makes lane n subtract.
#[inline]
fn lane_by_lane<const BITS: u32>(prefix: Prefix, a: u32, b: u32, subtract: u32) -> (u32, u32) {
    let (mut result, mut ge) = (0, 0);
    let mask = (1 << BITS) - 1;
    let lane_ge = (1 << (BITS / 8)) - 1;
    for lane in 0..32 / BITS {
        let at = lane * BITS;
        let subtracts = subtract >> lane & 1 != 0;
        let (value, greater) =
            lane_result::<BITS>(prefix, a >> at & mask, b >> at & mask, subtracts);
        result |= (value as u32 & mask) << at;
        ge |= if greater { lane_ge << (at / 8) } else { 0 };
    }
    (result, ge)
}

/// Computes one lane of `BITS` bits: its result, and its GE bit. GE means a sum or difference that
/// is not negative (signed), a carry (unsigned sum) or no borrow (unsigned difference).
#[inline]
fn lane_result<const BITS: u32>(prefix: Prefix, a: u32, b: u32, subtracts: bool) -> (i32, bool) {
    let is_signed = matches!(
        prefix,
        Prefix::Signed | Prefix::SignedSaturating | Prefix::SignedHalving
    );
    let widen = |x: u32| {
        if is_signed {
            (x as i32) << (32 - BITS) >> (32 - BITS)
        } else {
            x as i32
        }
    };
    let (a, b) = (widen(a), widen(b));
    let exact = if subtracts { a - b } else { a + b };
    let half = 1 << (BITS - 1);
    match prefix {
        Prefix::Signed => (exact, exact >= 0),
        Prefix::Unsigned if subtracts => (exact, exact >= 0),
        Prefix::Unsigned => (exact, exact >= 2 * half),
        Prefix::SignedSaturating => (exact.clamp(-half, half - 1), false),
        Prefix::UnsignedSaturating => (exact.clamp(0, 2 * half - 1), false),
        Prefix::SignedHalving | Prefix::UnsignedHalving => (exact >> 1, false),
    }
}

/// Returns a mask of the bytes whose GE bit is set.
pub(super) const fn byte_mask(ge: u32) -> u32 {
    (ge & 1 | (ge & 2) << 7 | (ge & 4) << 14 | (ge & 8) << 21) * 0xFF
}
