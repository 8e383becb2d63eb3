//! The choice of the pulse that the current sense samples, and the check that its readings arrive.

use super::Pulser;
use crate::pulse::{PulseStart, Sample, WINDOW_US, WindowPlan};
use crate::safety::{Fault, Inputs};
use crate::units::{Micros, us};

/// First slot of a window in which a sample can be taken: the board's refill arms the sample in the
/// window's first microseconds.
const FIRST_SLOT: u32 = 12;
/// Last slot of a window in which a sample can be taken: the next refill receives the reading.
const LAST_SLOT: u32 = 240;
const _: () = assert!(LAST_SLOT + 10 <= WINDOW_US);

/// Time after an edge at which a phase's current has settled, µs (docs/reference/hardware.md).
const SETTLED_US: u32 = 10;

/// Period below which a channel counts as fast and is sampled less often, µs: 50 readings per
/// second are sufficient.
const SLOW_US: u32 = 20_000;

/// Number of samples without a reading that is a fault. At most two are in progress.
const MISSING_TO_FAULT: u8 = 6;

impl Pulser {
    /// Returns whether so many readings are missing that it is a fault.
    pub(super) const fn misses_readings(&self) -> bool {
        self.owed >= MISSING_TO_FAULT
    }

    /// Chooses the middle of a phase to sample in this window. All stages share one sense
    /// resistor, in which their currents add up, so only a channel that drives alone at that time
    /// can be judged.
    pub(super) fn schedule_sample(&mut self, plan: &mut WindowPlan) {
        for pulse in &plan.pulses {
            self.note_middle(pulse, plan.start);
        }
        if !self.phases.is_empty() {
            self.pick_sample(plan);
        }
    }

    /// Notes the middle of a phase of `pulse`. Consecutive pulses of a channel alternate between
    /// first and second phase; a fast channel is sampled in two of four pulses, because each
    /// reading takes time.
    fn note_middle(&mut self, pulse: &PulseStart, start: Micros) {
        let bit = 1u16.checked_shl(pulse.channel.into()).unwrap_or(0);
        let is_second = self.second & bit != 0;
        let pauses = self.pausing & bit != 0;
        self.second ^= bit;
        self.pausing ^= if is_second { bit } else { 0 };
        let Some(middle) = self.scheduler.phase_middle(pulse.channel, is_second) else {
            return;
        };
        if pauses && middle.period_us < SLOW_US && self.arming.is_none() {
            return;
        }
        let slot = (pulse.at - start).us().cast_unsigned() + middle.after_us; // below 1500
        let (windows, slot) = (slot / WINDOW_US, slot % WINDOW_US);
        // The slot moves away from the middle only as far as the current is still settled.
        let slack = middle.half_us.saturating_sub(SETTLED_US);
        let slot = if slot < FIRST_SLOT {
            FIRST_SLOT.min(slot + slack)
        } else {
            slot.min(LAST_SLOT.max(slot.saturating_sub(slack)))
        };
        if (FIRST_SLOT..=LAST_SLOT).contains(&slot) {
            let _ = self.phases.push(Sample {
                channel: pulse.channel,
                second: middle.second,
                at: start + us(windows * WINDOW_US + slot),
            }); // as many slots
        }
    }

    /// Chooses, among the noted middles in this window, that of the channel whose turn it is.
    fn pick_sample(&mut self, plan: &mut WindowPlan) {
        let last = self.sampled;
        let turn = |channel: u8| channel.wrapping_sub(last).wrapping_sub(1) % 16;
        self.phases.retain(|sample| {
            let slot = (sample.at - plan.start).us();
            let Some(slot) = u8::try_from(slot)
                .ok()
                .filter(|&s| u32::from(s) < WINDOW_US)
            else {
                return slot > 0;
            };
            let is_sooner = |best: Sample| turn(sample.channel) < turn(best.channel);
            if plan.drives_alone(sample.channel, slot) {
                let beaten = if plan.sample.is_none_or(is_sooner) {
                    plan.sample.replace(*sample)
                } else {
                    Some(*sample)
                };
                // The channel has not had its turn, so it samples the same phase again.
                let bit = beaten.map_or(0, |b| 1u16.checked_shl(b.channel.into()).unwrap_or(0));
                self.second ^= bit;
            }
            false
        });
        if let Some(sample) = plan.sample {
            self.sampled = sample.channel;
            self.owed = self.owed.saturating_add(1);
        }
    }

    /// Counts readings against samples taken.
    ///
    /// # Errors
    /// [`Fault::ReadingMissing`] if too many readings are missing.
    pub(super) const fn expect_reading(&mut self, inputs: &Inputs) -> Result<(), Fault> {
        if inputs.reading.is_some() {
            self.owed = 0;
        }
        if !self.misses_readings() {
            return Ok(());
        }
        self.owed = 0;
        Err(Fault::ReadingMissing)
    }
}
