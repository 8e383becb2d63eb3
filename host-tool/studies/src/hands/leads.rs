//! What the leads of a hand do: Hamana 2022's pulses, and what is grounded or floats
//! beside them.

use crate::tracking::trial::{PULSE_EVERY_MS, PULSE_US};
use crate::tracking::wearer::Volts;
use hal_sim::body::hand::MovingHand;
use hal_sim::body::hand::spec::{A, B, E, RETURN};
use hal_sim::body::{Body, Drive, Lead};

/// When in a period the pulses of A, B and E begin, ms: B 2 ms after A (pattern 8 of
/// figure 5), the extensor half a period after A (assumed, as in the sessions of
/// experiment 4).
const BEGINS_MS: [usize; RETURN] = [0, 2, 10];

/// The leads of points that are used; all others float.
///
/// Between pulses a used point is grounded (figure 6). While a flexor pulses, the other
/// is grounded, for the pair is conducted; flexors and extensor isolate each other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Leads {
    /// Of A, B and E.
    pub used: [bool; RETURN],
}

impl Leads {
    /// Grounds what is used, from the start on.
    pub fn ground_used(self, hand: &mut MovingHand) {
        for channel in self.channels() {
            hand.set_lead(0, channel, Lead::Grounded);
        }
    }

    fn channels(self) -> impl Iterator<Item = usize> {
        [A, B, E].into_iter().filter(move |at| self.used[*at])
    }

    /// The pulses that begin in millisecond `ms`, monophasic, at these volts.
    pub fn pulse(self, hand: &mut MovingHand, ms: usize, volts: Volts) {
        let now_us = ms as u64 * 1000;
        for channel in self.channels() {
            if ms % PULSE_EVERY_MS != BEGINS_MS[channel] || volts[channel] <= 0.0 {
                continue;
            }
            let isolated = |other: &usize| *other != channel && (*other == E || channel == E);
            for other in self.channels().filter(isolated) {
                hand.set_lead(now_us, other, Lead::Floating);
            }
            hand.set_lead(
                now_us,
                channel,
                Lead::Cathodic(Drive::Volts(volts[channel])),
            );
            for other in self.channels() {
                hand.set_lead(now_us + u64::from(PULSE_US), other, Lead::Grounded);
            }
        }
    }
}
