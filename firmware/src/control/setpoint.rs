//! Track of timed setpoints, angles or forces, which gives the reference at any time.

use crate::arithmetic::division::quotient;
use crate::range::Range;
use crate::units::{Angle, AngularRate, Force, ForceRate, Micros};
use core::marker::PhantomData;
use fixed::types::I16F16;
use heapless::Deque;
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

/// Maximum number of setpoints that wait for their time: 90 ms of a 90 Hz stream.
const WAITING: usize = 8;
/// Largest distance of a setpoint's time from the present, ahead or back, µs. It lies far inside
/// the 35.8 min within which wrapped times can be compared.
pub const HORIZON_US: u32 = 1_000_000;
/// Largest rate, °/s (N/s), that is estimated from two setpoints. A faster change is a step of the
/// reference and is not extrapolated. Assumed: 50 °/s is the peak of 40° at 0.2 Hz, no finger task
/// asks for 1000, and no muscle of Lee 2020 rises faster.
pub const ESTIMATED_RATE_MAX: i16 = 1000;

/// Behaviour of a reference between and after setpoints.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize, Schema)]
pub enum HoldPolicy {
    /// Keeps the last value.
    Hold,
    /// Continues at the last rate for a limited time, then keeps the value reached.
    Extrapolate {
        /// Longest extrapolation, ms; 1…1000.
        max_ms: u16,
    },
}

impl HoldPolicy {
    /// Range of [`Self::Extrapolate::max_ms`].
    pub const MAX_MS: Range = Range::new("max_ms", 1, 1_000);
}

/// Reason why a setpoint was refused.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum SetpointError {
    /// The setpoint's time is more than [`HORIZON_US`] ahead.
    TooFarAhead,
    /// The setpoint's time is more than [`HORIZON_US`] in the past.
    TooOld,
    /// The track already has a setpoint for the same or a later time.
    OutOfOrder,
    /// The track is full of setpoints that wait for their time.
    TooManyWaiting,
    /// The angle is outside the joint's range.
    OutOfRange {
        /// Lowest angle allowed, m°.
        min_mdeg: i32,
        /// Highest angle allowed, m°.
        max_mdeg: i32,
    },
}

/// A quantity whose setpoints a track can store: a number in Q15.16 and its change per second.
pub trait Quantity: Copy {
    /// Type of the change per second.
    type Rate: Copy;
    /// Creates the quantity from a number in its unit.
    fn new(value: I16F16) -> Self;
    /// Returns the number in the quantity's unit.
    fn get(self) -> I16F16;
    /// Creates a rate from a number in the quantity's unit per second.
    fn rate(per_s: I16F16) -> Self::Rate;
    /// Returns a rate as a number in the quantity's unit per second.
    fn per_s(rate: Self::Rate) -> I16F16;
}

macro_rules! quantity {
    ($value:ident, $rate:ident) => {
        impl Quantity for $value {
            type Rate = $rate;
            fn new(value: I16F16) -> Self {
                Self::new(value)
            }
            fn get(self) -> I16F16 {
                self.get()
            }
            fn rate(per_s: I16F16) -> $rate {
                $rate::new(per_s)
            }
            fn per_s(rate: $rate) -> I16F16 {
                rate.get()
            }
        }
    };
}
quantity!(Angle, AngularRate);
quantity!(Force, ForceRate);

/// Setpoint with its time and the rate for extrapolation, per second.
#[derive(Clone, Copy, Debug)]
struct Timed {
    at: Micros,
    value: I16F16,
    rate: I16F16,
}

/// The latest setpoint that is due, and those that wait for their time.
#[derive(Clone, Debug)]
pub struct SetpointTrack<Q = Angle> {
    /// Latest due setpoint; `None` until the first is due.
    due: Option<DueSetpoint>,
    waiting: Deque<Timed, WAITING>,
    quantity: PhantomData<Q>,
}

impl<Q> Default for SetpointTrack<Q> {
    fn default() -> Self {
        Self {
            due: None,
            waiting: Deque::new(),
            quantity: PhantomData,
        }
    }
}

/// The latest due setpoint. Once its time is too old to matter, only the value is kept, so that the
/// value stays valid for hours while the clock wraps.
#[derive(Clone, Copy, Debug)]
enum DueSetpoint {
    Moving(Timed),
    Resting(I16F16),
}

impl<Q: Quantity> SetpointTrack<Q> {
    /// Accepts a setpoint valid from `at`. Without a rate, the rate is estimated from the previous
    /// setpoint, unless the difference is a step ([`ESTIMATED_RATE_MAX`]) or the previous setpoint
    /// no longer moves.
    ///
    /// # Errors
    /// Returns [`SetpointError`] if the setpoint is refused. The track is then unchanged.
    pub fn accept(
        &mut self,
        now: Micros,
        at: Micros,
        value: Q,
        rate: Option<Q::Rate>,
    ) -> Result<(), SetpointError> {
        let lead = (at - now).us();
        if lead > HORIZON_US.cast_signed() {
            return Err(SetpointError::TooFarAhead);
        }
        if lead < -HORIZON_US.cast_signed() {
            return Err(SetpointError::TooOld);
        }
        self.adopt_due_setpoints(now);
        let newest = self.waiting.back().copied().or(match self.due {
            Some(DueSetpoint::Moving(timed)) => Some(timed),
            _ => None,
        });
        if newest.is_some_and(|n| !n.at.is_before(at)) {
            return Err(SetpointError::OutOfOrder);
        }
        let value = value.get();
        let estimated = || newest.map_or(I16F16::ZERO, |n| slope(n, at, value));
        let rate = rate.map_or_else(estimated, Q::per_s);
        self.waiting
            .push_back(Timed { at, value, rate })
            .map_err(|_| SetpointError::TooManyWaiting)
    }

    /// Replaces the due setpoint by each waiting setpoint whose time has come, the latest last.
    fn adopt_due_setpoints(&mut self, now: Micros) {
        while self.waiting.front().is_some_and(|t| now.has_reached(t.at)) {
            self.due = self.waiting.pop_front().map(DueSetpoint::Moving);
        }
    }

    /// Returns the time from which the present setpoint is valid. Returns `None` before the first
    /// setpoint, and if the time is so old that it was dropped.
    pub const fn valid_since(&self) -> Option<Micros> {
        match self.due {
            Some(DueSetpoint::Moving(Timed { at, .. })) => Some(at),
            _ => None,
        }
    }

    /// Returns the reference at `now`, or `None` until the first setpoint is due. Call this
    /// function at least every 30 minutes; a control tick does so every millisecond.
    pub fn value_at(&mut self, now: Micros, policy: HoldPolicy) -> Option<Q> {
        self.motion_at(now, policy).map(|(value, _)| value)
    }

    /// Returns the reference at `now` as [`SetpointTrack::value_at`] does, and its present rate:
    /// that of the extrapolation while it lasts, otherwise 0.
    pub fn motion_at(&mut self, now: Micros, policy: HoldPolicy) -> Option<(Q, Q::Rate)> {
        self.adopt_due_setpoints(now);
        let (value, rate) = match self.due? {
            DueSetpoint::Resting(value) => (value, I16F16::ZERO),
            DueSetpoint::Moving(timed) => {
                let max_us = policy.max_us();
                let age = now.elapsed_since(timed.at);
                let value = extrapolate(timed, age.min(max_us));
                // The order can only be checked against a setpoint whose time is known, so drop the
                // time only when it is too old to matter.
                if age > max_us.max(HORIZON_US) {
                    self.due = Some(DueSetpoint::Resting(value));
                }
                let is_moving = age < max_us;
                (value, if is_moving { timed.rate } else { I16F16::ZERO })
            }
        };
        Some((Q::new(value), Q::rate(rate)))
    }
}

impl HoldPolicy {
    /// Returns the longest extrapolation, µs.
    const fn max_us(self) -> u32 {
        match self {
            Self::Hold => 0,
            Self::Extrapolate { max_ms } => max_ms as u32 * 1000,
        }
    }
}

/// Computes the rate per second from `before` to `value` at `at`, or 0 for a step.
fn slope(before: Timed, at: Micros, value: I16F16) -> I16F16 {
    const FASTEST: u32 = ESTIMATED_RATE_MAX.cast_unsigned() as u32 * (1 << 16);
    let us = at.elapsed_since(before.at).max(1);
    let (from, to) = (before.value.to_bits(), value.to_bits());
    // Below 2^32 · 1e6.
    let way = u64::from(to.abs_diff(from)) * 1_000_000;
    match quotient(way, us) {
        // At most 1000 · 2^16 < 2^31.
        Some(rate) if rate <= FASTEST => {
            let rate = rate.cast_signed();
            I16F16::from_bits(if to < from { -rate } else { rate })
        }
        _ => I16F16::ZERO,
    }
}

/// Adds the change of `us` microseconds at its rate to the value of `timed`; saturates.
fn extrapolate(timed: Timed, us: u32) -> I16F16 {
    let rate = timed.rate.to_bits();
    // us <= 1e6: below 2^51.
    let way = divide_by_million(u64::from(rate.unsigned_abs()) * u64::from(us.min(1_000_000)));
    let way = i64::from(way);
    let bits = i64::from(timed.value.to_bits()) + if rate < 0 { -way } else { way };
    I16F16::from_bits(bits.clamp(i32::MIN.into(), i32::MAX.into()) as i32)
}

/// Computes n / 1e6, rounded down, for n <= 2^31 · 1e6, in two digits, each of which needs only a
/// division by a constant within 32 bits.
const fn divide_by_million(n: u64) -> u32 {
    const ODD: u32 = 1_000_000 >> 6;
    let n = n >> 6; // <= 2^31 · 15 625 < 2^45
    let (high, low) = ((n >> 18) as u32, n as u32 & 0x3_FFFF);
    // high < 2^27, and its remainder is below 2^14, so the second dividend fits.
    let (upper, rest) = (high / ODD, high % ODD);
    (upper << 18) | ((rest << 18 | low) / ODD)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn millionths_are_exact(n in 0..=(1_000_000u64 << 31)) {
            prop_assert_eq!(u64::from(divide_by_million(n)), n / 1_000_000);
        }
    }
}
