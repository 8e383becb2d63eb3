//! Monitoring of one channel's electrodes while it stimulates: readings of both phases are
//! compared with the amplitude, with the load at arming and with one another.

use super::check::{Electrode, Load, SLACK_UA, is_above_limit, judge};
use super::{Channel, Fault, Reading, limits};
use crate::units::{Amplitude, MicroAmps};
use core::hash::{Hash, Hasher};

/// Number of consecutive readings without current that mean a lost phase; counted over both
/// phases, a lost electrode.
const TO_FAULT: u8 = 3;

/// Score that an odd reading adds to the count for [`Fault::LoadUnstable`]; each good reading
/// subtracts 1.
const ODD: u8 = 4;
/// Score at which [`Fault::LoadUnstable`] is raised: after three odd readings in a row, or after
/// more than one in five for a while.
const FULL: u8 = TO_FAULT * ODD;

/// Multiple of the load at arming from which on a load is too high. When an electrode peels off,
/// its load grows as its area shrinks, and with it the current density. The load at arming was
/// measured at the smallest amplitude, and while an electrode holds, its load falls with amplitude
/// (docs/reference/hardware.md, what the readings show).
const RISEN: u32 = 4;

/// Ratio between two consecutive loads that counts as a jump.
const JUMP: u32 = 2;

/// Percentage of a current that a reading, plus two counts, must reach to count as that current.
/// Sense and stage agree within 1 % (docs/reference/hardware.md).
const REACHED_PERCENT: u32 = 98;

/// Readings of one of the two phases of a channel's pulses.
#[derive(Clone, Copy, Default, Debug, PartialEq, Eq)]
struct Phase {
    /// Number of consecutive readings without current.
    off: u8,
    /// Whether the latest reading had current.
    flows: bool,
}

/// History of one channel's readings.
#[derive(Clone, Copy, Default, Debug, PartialEq, Eq)]
pub(super) struct Watch {
    first: Phase,
    second: Phase,
    /// Score of odd readings, 0 to [`FULL`].
    odd: u8,
    /// The latest reading that was not a jump; its amplitude is 0 before the first.
    last: Load,
}

impl Watch {
    /// Takes a reading at the electrode check's last amplitude. The larger current of the two
    /// phases is the load.
    pub(super) fn record_check_load(&mut self, reading: Reading, applied: Amplitude) {
        let now = Load::from_reading(reading, applied);
        let raw = self.last.raw.max(now.raw);
        self.last = Load { raw, applied };
    }

    /// Returns the load that the electrode check measured, and resets the history.
    pub(super) fn take_load(&mut self) -> Load {
        core::mem::take(self).last
    }

    /// Returns the history after a reading of a channel whose amplitude in force is `amplitude`
    /// and whose load at arming is `load`; no current above `max` may flow.
    ///
    /// # Errors
    /// Returns the fault that this reading shows, alone or together with earlier ones.
    pub(super) fn updated(
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
        self.count_missing_current(is_off, reading.second)?;
        let is_odd = is_off
            || if channel.stage.is_current() {
                // The load needs more voltage than the stage can supply.
                !reaches(reading, amplitude.get())
            } else {
                let now = Load::from_reading(reading, amplitude);
                now.is_above(RISEN, load) || is_limited(reading, now, load) || self.is_jump(now)
            };
        self.odd = if is_odd {
            self.odd.saturating_add(ODD)
        } else {
            self.odd.saturating_sub(1)
        };
        if self.odd >= FULL {
            return Err(Fault::LoadUnstable);
        }
        Ok(self)
    }

    /// Returns whether `now` differs strongly from the previous reading at about the same
    /// amplitude. In that case the previous reading is kept, so that a load that jumps and stays
    /// there is odd again.
    fn is_jump(&mut self, now: Load) -> bool {
        let last = self.last;
        let is_far = now.is_above(JUMP, last) || last.is_above(JUMP, now);
        let jumps = is_far && now.is_near(last);
        if !jumps {
            self.last = now;
        }
        jumps
    }

    /// Counts readings without current, separately for each phase.
    fn count_missing_current(&mut self, is_off: bool, second: bool) -> Result<(), Fault> {
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

/// Hashes two words, because the checksum over them is computed at every burst.
impl Hash for Watch {
    fn hash<H: Hasher>(&self, state: &mut H) {
        let phase = |phase: Phase| u32::from(phase.off) << 1 | u32::from(phase.flows);
        let odd = u32::from(self.odd);
        state.write_u32(phase(self.first) | phase(self.second) << 9 | odd << 18);
        state.write_u32(self.last.word());
    }
}

/// Returns whether the limiter of a voltage stage determines its current, and not the load at
/// arming: the electrode is shorted, or the skin broke down.
fn is_limited(reading: Reading, now: Load, load: Load) -> bool {
    load.is_above(1, now) && reaches(reading, limits::VOLTAGE_STAGE_LIMITER.get())
}

/// Returns whether a reading reaches `ua`, at most 150 000 µA, within the tolerance.
fn reaches(reading: Reading, ua: u32) -> bool {
    // At most 150 000 · 100: nothing wraps.
    let reached = (reading.current().get() + SLACK_UA).wrapping_mul(100);
    reached >= ua.wrapping_mul(REACHED_PERCENT)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::seal::Checksum;

    /// Counts at their maximum are included.
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
                assert!(!Checksum::of(&watch).matches(&flipped), "{place}: {bit}");
            }
        }
        for second in [false, true] {
            let mut flipped = watch;
            if second {
                flipped.second.flows = true;
            } else {
                flipped.first.flows = true;
            }
            assert!(!Checksum::of(&watch).matches(&flipped), "{second}");
        }
    }
}
