//! Drives the leads of a hand: plays the pulses of Hamana 2022, and grounds or disconnects the
//! other leads.

use crate::tracking::trial::{PULSE_EVERY_MS, PULSE_US};
use crate::tracking::wearer::Volts;
use hal_sim::body::hand::MovingHand;
use hal_sim::body::hand::spec::{A, B, E, RETURN};
use hal_sim::body::{Body, Drive, Lead};

/// Time at which the pulses of A, B and E start within a pulse period, ms. B follows 2 ms after A
/// (pattern 8 of figure 5). The extensor follows half a period after A, which is assumed, as in the
/// sessions of experiment 4.
const BEGINS_MS: [usize; RETURN] = [0, 2, 10];

/// Leads of the stimulation points in use. All other leads are disconnected.
///
/// Between pulses, a lead in use is grounded (figure 6). While one flexor lead pulses, the other is
/// grounded, because the pair is conducted. The flexor leads are disconnected during the pulses of
/// the extensor, and the reverse.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Leads {
    /// Whether the leads A, B and E are in use.
    pub used: [bool; RETURN],
}

impl Leads {
    /// Grounds all leads in use, at time 0.
    pub fn ground_used(self, hand: &mut MovingHand) {
        for channel in self.channels() {
            hand.set_lead(0, channel, Lead::Grounded);
        }
    }

    fn channels(self) -> impl Iterator<Item = usize> {
        [A, B, E].into_iter().filter(move |at| self.used[*at])
    }

    /// Plays the monophasic pulses that begin in millisecond `ms`, at these voltages.
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
