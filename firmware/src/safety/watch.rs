//! The watch on one channel's electrodes while it stimulates: readings of both phases
//! against the amplitude, against the load at arming and against one another.

use super::check::{Electrode, Load, SLACK_UA, is_above_limit, judge};
use super::{Channel, Fault, Reading, limits};
use crate::units::{Amplitude, MicroAmps};
use core::hash::{Hash, Hasher};

/// Readings in a row without current that are a lost phase, or of both phases a lost
/// electrode.
const TO_FAULT: u8 = 3;

/// What an odd reading adds to the account of a load that wanders, what a good one
/// takes off it, and where it is full: three odd readings in a row, or more than one in
/// five for a while.
const ODD: u8 = 4;
const FULL: u8 = TO_FAULT * ODD;

/// How many times the load at arming, taken at the smallest amplitude, is too much.
/// Where an electrode peels, load grows as its area shrinks, and with it the current
/// density; of an electrode that holds, load falls with amplitude
/// (docs/hardware.md, what the readings show).
const RISEN: u32 = 4;

/// How many times the load of the reading before is a jump.
const JUMP: u32 = 2;

/// Part of a current, less two counts, at which it is reached; sense and stage agree
/// within 1 % (docs/hardware.md).
const REACHED_PERCENT: u32 = 98;

/// Readings of one phase.
#[derive(Clone, Copy, Default, Debug, PartialEq, Eq)]
struct Phase {
    /// Without current, in a row.
    off: u8,
    /// Whether the latest had current.
    flows: bool,
}

/// What is kept of one channel's readings.
#[derive(Clone, Copy, Default, Debug, PartialEq, Eq)]
pub(super) struct Watch {
    first: Phase,
    second: Phase,
    /// Account of odd readings.
    odd: u8,
    /// The latest reading that was no jump; none without an amplitude.
    last: Load,
}

impl Watch {
    /// Takes a reading of the electrode check's last amplitude: of both phases, what
    /// carried more is the load.
    pub(super) fn probe(&mut self, reading: Reading, applied: Amplitude) {
        let now = Load::of(reading, applied);
        let raw = self.last.raw.max(now.raw);
        self.last = Load { raw, applied };
    }

    /// The load that the check found; the watch begins anew.
    pub(super) fn take_load(&mut self) -> Load {
        core::mem::take(self).last
    }

    /// After a reading of a channel in force at `amplitude`, armed with `load`; no current
    /// above `max` may flow.
    ///
    /// # Errors
    /// What it shows, alone or with those before.
    pub(super) fn after(
        mut self,
        reading: Reading,
        channel: &Channel,
        load: Load,
        (amplitude, max): (Amplitude, MicroAmps),
    ) -> Result<Self, Fault> {
        let electrode = judge(reading, &channel.stage, amplitude);
        if electrode == Electrode::Short || is_above_limit(reading, max) {
            return Err(Fault::OverCurrent);
        }
        let is_off = electrode == Electrode::Off;
        self.count_off(is_off, reading.second)?;
        let is_odd = is_off
            || if channel.stage.is_current() {
                // Its load asks for more than its compliance.
                !reaches(reading, amplitude.get())
            } else {
                let now = Load::of(reading, amplitude);
                now.is_above(RISEN, load) || is_limited(reading, now, load) || self.jumps(now)
            };
        self.odd = if is_odd {
            self.odd.saturating_add(ODD)
        } else {
            self.odd.saturating_sub(1)
        };
        if self.odd >= FULL {
            return Err(Fault::LoadWanders);
        }
        Ok(self)
    }

    /// Whether `now` is far from the reading before at about the same amplitude. That
    /// one is kept, so that a load which jumps and stays there is odd again.
    fn jumps(&mut self, now: Load) -> bool {
        let last = self.last;
        let is_far = now.is_above(JUMP, last) || last.is_above(JUMP, now);
        let jumps = is_far && now.is_near(last);
        if !jumps {
            self.last = now;
        }
        jumps
    }

    /// Counts readings without current, phase by phase.
    fn count_off(&mut self, is_off: bool, second: bool) -> Result<(), Fault> {
        let (this, other) = if second {
            (&mut self.second, self.first)
        } else {
            (&mut self.first, self.second)
        };
        this.flows = !is_off;
        if !is_off {
            this.off = 0;
            return Ok(());
        }
        this.off = this.off.saturating_add(1);
        if other.flows && this.off >= TO_FAULT {
            return Err(Fault::PhaseLost);
        }
        if !other.flows && this.off.saturating_add(other.off) >= TO_FAULT {
            return Err(Fault::ElectrodeOff);
        }
        Ok(())
    }
}

/// In two words, for it is summed with every burst.
impl Hash for Watch {
    fn hash<H: Hasher>(&self, state: &mut H) {
        let phase = |phase: Phase| u32::from(phase.off) << 1 | u32::from(phase.flows);
        let odd = u32::from(self.odd);
        state.write_u32(phase(self.first) | phase(self.second) << 9 | odd << 18);
        state.write_u32(self.last.word());
    }
}

/// Whether a voltage stage's limiter holds its current, and not what load it was armed
/// with: an electrode that is shorted, or skin that broke down.
fn is_limited(reading: Reading, now: Load, load: Load) -> bool {
    load.is_above(1, now) && reaches(reading, limits::VOLTAGE_STAGE_LIMITER.get())
}

/// Whether a reading is `ua`, at most 150 000, or above.
fn reaches(reading: Reading, ua: u32) -> bool {
    // At most 150 000 · 100: nothing wraps.
    let reached = (reading.current().get() + SLACK_UA).wrapping_mul(100);
    reached >= ua.wrapping_mul(REACHED_PERCENT)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::seal::Seal;

    /// Of counts as large as they get.
    #[test]
    fn every_bit_of_a_watch_is_summed() {
        let flips: [fn(&mut Watch, u8); 3] = [
            |watch, bit| watch.first.off ^= bit,
            |watch, bit| watch.second.off ^= bit,
            |watch, bit| watch.odd ^= bit,
        ];
        let watch = Watch::default();
        for (place, flip) in flips.iter().enumerate() {
            for bit in 0..8 {
                let mut flipped = watch;
                flip(&mut flipped, 1 << bit);
                assert!(!Seal::of(&watch).holds(&flipped), "{place}: {bit}");
            }
        }
        for second in [false, true] {
            let mut flipped = watch;
            if second {
                flipped.second.flows = true;
            } else {
                flipped.first.flows = true;
            }
            assert!(!Seal::of(&watch).holds(&flipped), "{second}");
        }
    }
}
