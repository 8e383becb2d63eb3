//! A track of timed setpoints, angles or forces: what is wanted now, from what
//! was said.

use crate::arithmetic::division::quotient;
use crate::range::Range;
use crate::units::{Angle, AngularRate, Force, ForceRate, Micros};
use core::marker::PhantomData;
use fixed::types::I16F16;
use heapless::Deque;
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

/// Setpoints that may wait for their time: 90 ms of a 90 Hz stream.
const WAITING: usize = 8;
/// A setpoint may lie at most this far ahead or back, µs. Far inside the
/// 35.8 min within which wrapped times compare.
pub const HORIZON_US: u32 = 1_000_000;
/// Fastest motion taken for one, °/s (N/s), when the rate is only estimated from
/// two setpoints. Anything faster is a step of the target and is not extrapolated.
/// Assumed: 50 °/s is the peak of 40° at 0.2 Hz, no finger task asks for 1000; no
/// muscle of Lee 2020 rises faster.
pub const ESTIMATED_RATE_MAX: i16 = 1000;

/// What to do between and after setpoints.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize, Schema)]
pub enum HoldPolicy {
    /// Keep the last angle.
    Hold,
    /// Go on at the last rate for this long, then keep the angle reached.
    Extrapolate {
        /// Longest extrapolation, ms; 1…1000.
        max_ms: u16,
    },
}

impl HoldPolicy {
    /// Of [`Self::Extrapolate::max_ms`].
    pub const MAX_MS: Range = Range::new("max_ms", 1, 1_000);
}

/// Why a setpoint was not taken.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum SetpointError {
    /// Its time is more than [`HORIZON_US`] ahead.
    TooFarAhead,
    /// Its time is more than [`HORIZON_US`] past.
    TooOld,
    /// A setpoint for the same or a later time was already taken.
    OutOfOrder,
    /// More setpoints wait for their time than the track holds.
    TooManyWaiting,
    /// The angle lies outside the joint's range.
    OutOfRange {
        /// Lowest angle allowed, m°.
        min_mdeg: i32,
        /// Highest angle allowed, m°.
        max_mdeg: i32,
    },
}

/// What a track can be of: a number in Q15.16, and its change in a second.
pub trait Quantity: Copy {
    /// Its change.
    type Rate: Copy;
    /// From its number.
    fn new(value: I16F16) -> Self;
    /// Its number.
    fn get(self) -> I16F16;
    /// A rate from its number.
    fn rate(per_s: I16F16) -> Self::Rate;
    /// A rate's number.
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

/// One setpoint with the rate to go on with.
#[derive(Clone, Copy, Debug)]
struct Timed {
    at: Micros,
    value: I16F16,
    rate: I16F16,
}

/// The last setpoint that is due, and those that wait.
#[derive(Clone, Debug)]
pub struct SetpointTrack<Q = Angle> {
    /// Where the track stands; `None` until the first setpoint is due.
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

/// A due setpoint is in motion until its extrapolation ends; afterwards it has
/// no time any more, so that it can be held for hours of a wrapping clock.
#[derive(Clone, Copy, Debug)]
enum DueSetpoint {
    Moving(Timed),
    Resting(I16F16),
}

impl<Q: Quantity> SetpointTrack<Q> {
    /// Takes a setpoint valid from `at`. Without a rate, the difference to the
    /// setpoint before gives one, unless that would be a step
    /// ([`ESTIMATED_RATE_MAX`]) or the setpoint before is no longer in motion.
    ///
    /// # Errors
    /// See [`SetpointError`]; the track is unchanged then.
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

    /// Takes over the setpoints whose time has come.
    fn adopt_due_setpoints(&mut self, now: Micros) {
        while self.waiting.front().is_some_and(|t| now.has_reached(t.at)) {
            self.due = self.waiting.pop_front().map(DueSetpoint::Moving);
        }
    }

    /// When the setpoint that stands became valid; `None` before the first, and of one
    /// that is too old for its time to matter.
    pub const fn valid_since(&self) -> Option<Micros> {
        match self.due {
            Some(DueSetpoint::Moving(Timed { at, .. })) => Some(at),
            _ => None,
        }
    }

    /// The value wanted at `now`; `None` until the first setpoint is due.
    /// Call it at least every 30 minutes; a control tick does, every millisecond.
    pub fn value_at(&mut self, now: Micros, policy: HoldPolicy) -> Option<Q> {
        self.motion_at(now, policy).map(|(value, _)| value)
    }

    /// [`SetpointTrack::value_at`] and the rate at which it moves now: that of
    /// the extrapolation while it lasts, else 0.
    pub fn motion_at(&mut self, now: Micros, policy: HoldPolicy) -> Option<(Q, Q::Rate)> {
        self.adopt_due_setpoints(now);
        let (value, rate) = match self.due? {
            DueSetpoint::Resting(value) => (value, I16F16::ZERO),
            DueSetpoint::Moving(timed) => {
                let max_us = policy.max_us();
                let age = now.elapsed_since(timed.at);
                let value = extrapolate(timed, age.min(max_us));
                // Out of order can only be judged against a setpoint whose time
                // is known: forget the time once it is too old to matter.
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
    /// Longest extrapolation, µs.
    const fn max_us(self) -> u32 {
        match self {
            Self::Hold => 0,
            Self::Extrapolate { max_ms } => max_ms as u32 * 1000,
        }
    }
}

/// The rate from `before` to `value` at `at`, 0 if it looks like a step.
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

/// `timed`'s value plus its rate for `us` microseconds, saturating.
fn extrapolate(timed: Timed, us: u32) -> I16F16 {
    let rate = timed.rate.to_bits();
    // us <= 1e6: below 2^51.
    let way = divide_by_million(u64::from(rate.unsigned_abs()) * u64::from(us.min(1_000_000)));
    let way = i64::from(way);
    let bits = i64::from(timed.value.to_bits()) + if rate < 0 { -way } else { way };
    I16F16::from_bits(bits.clamp(i32::MIN.into(), i32::MAX.into()) as i32)
}

/// n / 1e6, rounded down, for n <= 2^31 · 1e6: in two digits, each of which
/// divides by a constant within 32 bits.
const fn divide_by_million(n: u64) -> u32 {
    const ODD: u32 = 1_000_000 >> 6;
    let n = n >> 6; // <= 2^31 · 15 625 < 2^45
    let (high, low) = ((n >> 18) as u32, n as u32 & 0x3_FFFF);
    // high < 2^27; its rest is below 2^14, so the second dividend fits.
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
