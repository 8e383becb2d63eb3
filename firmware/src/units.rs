//! Physical quantities as types. No arithmetic between different quantities
//! is possible without naming it. Nothing here knows a channel or a board.
//!
//! Amplitudes are integers (µA, mV, DAC codes) because limits, charges and
//! acknowledgements must be exact; what a filter or a control law works on is
//! binary fixed point from the `fixed` crate.

use core::ops::{Add, Sub};
use fixed::types::I16F16;
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

/// A point in device time: microseconds since boot, modulo 2^32 (71.6 min).
///
/// Two instants can be compared when they are less than 2^31 µs (35.8 min)
/// apart; every schedule, timeout and staleness check here is far shorter.
///
/// ```
/// use firmware::units::Micros;
///
/// let before = Micros(u32::MAX - 9); // the clock wraps in 10 µs
/// let after = before.plus(25);
/// assert_eq!(after, Micros(15));
/// assert!(after.has_reached(before));
/// assert_eq!(after.since(before), 25);
/// ```
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Serialize, Deserialize, Schema)]
pub struct Micros(pub u32);

impl Micros {
    /// The instant `us` microseconds later, wrapping.
    #[must_use]
    pub const fn plus(self, us: u32) -> Self {
        Self(self.0.wrapping_add(us))
    }

    /// The instant `us` microseconds earlier, wrapping.
    #[must_use]
    pub const fn minus(self, us: u32) -> Self {
        Self(self.0.wrapping_sub(us))
    }

    /// Signed microseconds from `earlier` to `self`.
    #[must_use]
    pub const fn since(self, earlier: Self) -> i32 {
        self.0.wrapping_sub(earlier.0).cast_signed()
    }

    /// Whether `self` comes strictly before `other`.
    #[must_use]
    pub const fn is_before(self, other: Self) -> bool {
        self.since(other) < 0
    }

    /// Whether `self` is `other` or later.
    #[must_use]
    pub const fn has_reached(self, other: Self) -> bool {
        self.since(other) >= 0
    }

    /// Unsigned microseconds from `earlier`, 0 if `earlier` is in the future.
    #[must_use]
    pub const fn elapsed_since(self, earlier: Self) -> u32 {
        let signed = self.since(earlier);
        if signed < 0 {
            0
        } else {
            signed.cast_unsigned()
        }
    }
}

/// A stimulation amplitude in thousandths of the stage's own unit: µA on a
/// current-controlled stage, mV on a voltage-controlled one. Always positive;
/// polarity belongs to the pulse shape.
#[derive(
    Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Default, Serialize, Deserialize, Schema,
)]
pub struct Amplitude(pub u32);

impl Amplitude {
    /// No stimulation.
    pub const ZERO: Self = Self(0);
}

/// What the DAC gets: 0…65535 over the stage's full scale, rounded down so
/// that an output never exceeds what was asked.
#[derive(
    Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Default, Serialize, Deserialize, Schema,
)]
pub struct DacCode(pub u16);

/// Quantities in Q15.16 with the operators that are sound: sums and differences of
/// the same quantity, which saturate.
macro_rules! quantities {
    ($($(#[$doc:meta])* $name:ident;)*) => {$(
        $(#[$doc])*
        #[derive(Clone, Copy, PartialEq, PartialOrd, Debug, Default)]
        pub struct $name(I16F16);

        impl $name {
            /// From its number, in its unit.
            #[must_use]
            pub const fn new(number: I16F16) -> Self {
                Self(number)
            }

            /// Its number, in its unit.
            #[must_use]
            pub const fn get(self) -> I16F16 {
                self.0
            }
        }

        impl Add for $name {
            type Output = Self;
            #[inline]
            fn add(self, other: Self) -> Self {
                Self(self.0.saturating_add(other.0))
            }
        }

        impl Sub for $name {
            type Output = Self;
            #[inline]
            fn sub(self, other: Self) -> Self {
                Self(self.0.saturating_sub(other.0))
            }
        }
    )*};
}

quantities! {
    /// A joint angle in degrees, flexion positive. Q15.16: ±32768°, 1.5e-5°.
    ///
    /// ```
    /// use firmware::units::Angle;
    ///
    /// let (bent, straight) = (Angle::from_centideg(9_050), Angle::from_centideg(-50));
    /// assert_eq!((bent - straight).to_centideg(), 9_100);
    /// assert_eq!(bent.to_millideg(), 90_500);
    /// ```
    Angle;
    /// An angular rate in degrees per second. Q15.16: ±32768 °/s, 1.5e-5 °/s.
    AngularRate;
    /// A force in newtons. Q15.16: ±32768 N, 1.5e-5 N.
    Force;
    /// A change of force in newtons per second. Q15.16: ±32768 N/s, 1.5e-5 N/s.
    ForceRate;
}

impl Angle {
    /// From hundredths of a degree, the link's unit. Exact to half an LSB.
    #[must_use]
    pub fn from_centideg(c: i16) -> Self {
        // |c| <= 32768, times 2^16 fits i64; the quotient fits i32.
        Self(I16F16::from_bits((i64::from(c) * 65_536 / 100) as i32))
    }

    /// From thousandths of a degree, saturating; within one bit, rounded
    /// towards 0.
    #[must_use]
    pub fn from_millideg(m: i32) -> Self {
        // |m| <= 2^31: |m| · 2^16 / 1000 < 2^38.
        let bits = i64::from(m) * 65_536 / 1000;
        Self(I16F16::from_bits(
            bits.clamp(i32::MIN.into(), i32::MAX.into()) as i32,
        ))
    }

    /// To thousandths of a degree, rounded to nearest.
    #[must_use]
    pub fn to_millideg(self) -> i32 {
        // 2^31 · 1000 / 2^16 < 2^25.
        ((i64::from(self.0.to_bits()) * 1000 + 32_768) >> 16) as i32
    }

    /// To hundredths of a degree, saturating at the link's range (±327.67°).
    #[must_use]
    pub fn to_centideg(self) -> i16 {
        let c = (i64::from(self.0.to_bits()) * 100 + 32_768) >> 16;
        c.clamp(i64::from(i16::MIN), i64::from(i16::MAX)) as i16
    }
}

impl Force {
    /// From millinewtons, rounded down, saturating at 32,767 N.
    #[must_use]
    pub fn from_millinewton(mn: u32) -> Self {
        // At most 2^31 · 2^16 / 10^3, which fits 31 bits.
        let mn = u64::from(mn.min(32_767_000));
        Self(I16F16::from_bits(((mn << 16) / 1000) as i32))
    }

    /// To the nearest millinewton, which gives back what
    /// [`Self::from_millinewton`] took; 0 for negative forces.
    #[must_use]
    pub fn to_nearest_millinewton(self) -> u32 {
        // At most 2^31 · 1000 / 2^16. Rounding down lost less than 2^-16 N, and
        // half a millinewton is 32 times that.
        let bits = u64::from(self.0.to_bits().max(0).cast_unsigned());
        ((bits * 1000 + 32_768) >> 16) as u32
    }

    /// To millinewtons, rounded down; 0 for negative forces.
    #[must_use]
    pub fn to_millinewton(self) -> u32 {
        // At most 2^31 · 1000 / 2^16.
        ((u64::from(self.0.to_bits().max(0).cast_unsigned()) * 1000) >> 16) as u32
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn comparisons_survive_the_wrap() {
        let before = Micros(u32::MAX - 9);
        let after = before.plus(20);
        assert_eq!(after, Micros(10));
        assert_eq!(after.since(before), 20);
        assert!(before.is_before(after));
        assert!(after.has_reached(before));
        assert_eq!(before.elapsed_since(after), 0);
    }

    #[test]
    fn centidegrees_round_trip() {
        for c in i16::MIN..=i16::MAX {
            assert_eq!(Angle::from_centideg(c).to_centideg(), c);
        }
    }

    #[test]
    fn millinewtons_round_trip() {
        let all = (0..=100_000).chain(32_700_000..=32_767_000);
        for mn in all {
            assert_eq!(Force::from_millinewton(mn).to_nearest_millinewton(), mn);
        }
        let negative = Force(I16F16::from_bits(-65_536));
        assert_eq!(negative.to_nearest_millinewton(), 0);
    }
}
