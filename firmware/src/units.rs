//! Types of physical quantities. Arithmetic between different quantities needs an explicit
//! conversion. The types know neither channels nor boards.
//!
//! Amplitudes are integers (µA, mV, DAC codes), because limits, charges and acknowledgements must
//! be exact. Filters and controllers use binary fixed point from the `fixed` crate.

use core::ops::{Add, AddAssign, Sub};
use fixed::types::I16F16;
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

/// A point in device time: microseconds since boot, modulo 2^32 (71.6 min).
///
/// Two instants can be compared if they are less than 2^31 µs (35.8 min) apart; every schedule,
/// timeout and age limit of the device is far shorter.
///
/// ```
/// use firmware::units::{Micros, us};
///
/// let before = Micros::new(u32::MAX - 9); // the clock wraps in 10 µs
/// let after = before + us(25);
/// assert_eq!(after, Micros::new(15));
/// assert!(after.has_reached(before));
/// assert_eq!(after - before, us(25));
/// ```
///
/// Two instants have no sum:
///
/// ```compile_fail
/// use firmware::units::Micros;
///
/// let sum = Micros::new(1) + Micros::new(2);
/// ```
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug, Default, Serialize, Deserialize, Schema)]
pub struct Micros(u32);

/// Time from one instant to another, µs, negative if the second instant comes first: up to 2^31 µs
/// (35.8 min) either way.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Default)]
pub struct Duration(i32);

/// Creates a duration of `number` microseconds.
#[inline]
#[must_use]
pub const fn us(number: u32) -> Duration {
    Duration(number.cast_signed())
}

impl Duration {
    /// Returns the number of microseconds.
    #[inline]
    #[must_use]
    pub const fn us(self) -> i32 {
        self.0
    }
}

impl Micros {
    /// Creates an instant from the clock's count, µs.
    #[must_use]
    pub const fn new(us: u32) -> Self {
        Self(us)
    }

    /// Returns the clock's count, µs.
    #[must_use]
    pub const fn get(self) -> u32 {
        self.0
    }

    /// Returns whether `self` comes strictly before `other`.
    #[must_use]
    pub const fn is_before(self, other: Self) -> bool {
        self.0.wrapping_sub(other.0).cast_signed() < 0
    }

    /// Returns whether `self` is `other` or later.
    #[must_use]
    pub const fn has_reached(self, other: Self) -> bool {
        !self.is_before(other)
    }

    /// Returns the microseconds from `earlier`, or 0 if `earlier` is in the future.
    #[must_use]
    pub const fn elapsed_since(self, earlier: Self) -> u32 {
        if self.is_before(earlier) {
            0
        } else {
            self.0.wrapping_sub(earlier.0)
        }
    }
}

impl Add<Duration> for Micros {
    type Output = Self;
    #[inline]
    fn add(self, length: Duration) -> Self {
        Self(self.0.wrapping_add_signed(length.0))
    }
}

impl AddAssign<Duration> for Micros {
    #[inline]
    fn add_assign(&mut self, length: Duration) {
        *self = *self + length;
    }
}

impl Sub<Duration> for Micros {
    type Output = Self;
    #[inline]
    fn sub(self, length: Duration) -> Self {
        Self(self.0.wrapping_sub(length.0.cast_unsigned()))
    }
}

impl Sub for Micros {
    type Output = Duration;
    #[inline]
    fn sub(self, earlier: Self) -> Duration {
        Duration(self.0.wrapping_sub(earlier.0).cast_signed())
    }
}

/// Defines types for whole numbers in a unit. Numbers of different units, and bare numbers, do not
/// mix.
macro_rules! counts {
    ($($(#[$doc:meta])* $name:ident($number:ident);)*) => {$(
        $(#[$doc])*
        #[derive(Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Debug, Default)]
        #[derive(Serialize, Deserialize, Schema)]
        pub struct $name($number);

        impl $name {
            /// Creates the quantity from a number in its unit.
            #[must_use]
            pub const fn new(number: $number) -> Self {
                Self(number)
            }

            /// Returns the number in the quantity's unit.
            #[must_use]
            pub const fn get(self) -> $number {
                self.0
            }
        }
    )*};
}

counts! {
    /// A stimulation amplitude in thousandths of the stage's own unit: µA on a current-controlled
    /// stage, mV on a voltage-controlled stage. Always positive; the polarity belongs to the pulse
    /// shape. Only the stage determines the unit
    /// ([`Stage::current`](crate::safety::Stage::current)), so an amplitude cannot be compared with
    /// a current or a voltage:
    ///
    /// ```compile_fail
    /// use firmware::units::{Amplitude, MicroAmps};
    ///
    /// let is_allowed = Amplitude::new(20_000) <= MicroAmps::new(20_000);
    /// ```
    Amplitude(u32);
    /// A current in µA.
    MicroAmps(u32);
    /// A voltage in mV.
    MilliVolts(u32);
    /// Code for the DAC: 0…65535 over the stage's full scale, rounded down so that an output never
    /// exceeds the requested amplitude.
    DacCode(u16);
}

impl MilliVolts {
    /// Returns the current through a load of `ohm`, rounded up, saturating; 0 Ω counts as 1 Ω.
    #[must_use]
    pub fn current_through(self, ohm: u32) -> MicroAmps {
        // The product fits u64.
        let ua = (u64::from(self.0) * 1000).div_ceil(u64::from(ohm.max(1)));
        MicroAmps(u32::try_from(ua).unwrap_or(u32::MAX))
    }
}

impl Amplitude {
    /// Amplitude zero, no stimulation.
    pub const ZERO: Self = Self(0);
}

/// Defines types for quantities in Q15.16 with the operators that are meaningful: sums and
/// differences of the same quantity, which saturate.
macro_rules! quantities {
    ($($(#[$doc:meta])* $name:ident;)*) => {$(
        $(#[$doc])*
        #[derive(Clone, Copy, PartialEq, PartialOrd, Debug, Default)]
        pub struct $name(I16F16);

        impl $name {
            /// Creates the quantity from a number in its unit.
            #[must_use]
            pub const fn new(number: I16F16) -> Self {
                Self(number)
            }

            /// Returns the number in the quantity's unit.
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
    /// Converts hundredths of a degree, the link's unit. Exact to half an LSB.
    #[must_use]
    pub fn from_centideg(c: i16) -> Self {
        // |c| <= 32768, times 2^16 fits i64; the quotient fits i32.
        Self(I16F16::from_bits((i64::from(c) * 65_536 / 100) as i32))
    }

    /// Converts thousandths of a degree, saturating; exact within one bit, rounded towards 0.
    #[must_use]
    pub fn from_millideg(m: i32) -> Self {
        // |m| <= 2^31: |m| · 2^16 / 1000 < 2^38.
        let bits = i64::from(m) * 65_536 / 1000;
        Self(I16F16::from_bits(
            bits.clamp(i32::MIN.into(), i32::MAX.into()) as i32,
        ))
    }

    /// Returns the angle in thousandths of a degree, rounded to nearest.
    #[must_use]
    pub fn to_millideg(self) -> i32 {
        // 2^31 · 1000 / 2^16 < 2^25.
        ((i64::from(self.0.to_bits()) * 1000 + 32_768) >> 16) as i32
    }

    /// Returns the angle in hundredths of a degree, saturating at the link's range (±327.67°).
    #[must_use]
    pub fn to_centideg(self) -> i16 {
        let c = (i64::from(self.0.to_bits()) * 100 + 32_768) >> 16;
        c.clamp(i64::from(i16::MIN), i64::from(i16::MAX)) as i16
    }
}

impl Force {
    /// Converts millinewtons, rounded down, saturating at 32,767 N.
    #[must_use]
    pub fn from_millinewton(mn: u32) -> Self {
        // At most 2^31 · 2^16 / 10^3, which fits 31 bits.
        let mn = u64::from(mn.min(32_767_000));
        Self(I16F16::from_bits(((mn << 16) / 1000) as i32))
    }

    /// Returns the force in mN, rounded to nearest, which inverts [`Self::from_millinewton`]; 0 for
    /// negative forces.
    #[must_use]
    pub fn to_nearest_millinewton(self) -> u32 {
        // At most 2^31 · 1000 / 2^16. Rounding down lost less than 2^-16 N, and half a millinewton
        // is 32 times that.
        let bits = u64::from(self.0.to_bits().max(0).cast_unsigned());
        ((bits * 1000 + 32_768) >> 16) as u32
    }

    /// Returns the force in mN, rounded down; 0 for negative forces.
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
        let before = Micros::new(u32::MAX - 9);
        let after = before + us(20);
        assert_eq!((after, after - us(20)), (Micros::new(10), before));
        assert_eq!((after - before, (before - after).us()), (us(20), -20));
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
        let millinewtons = (0..=100_000).chain(32_700_000..=32_767_000);
        for mn in millinewtons {
            assert_eq!(Force::from_millinewton(mn).to_nearest_millinewton(), mn);
        }
        let negative = Force(I16F16::from_bits(-65_536));
        assert_eq!(negative.to_nearest_millinewton(), 0);
    }
}
