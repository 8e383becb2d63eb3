//! Bit flips in a lane, for tests.

use super::{Lane, Phase, PulsePart};
use crate::units::{DacCode, us};
use core::num::NonZeroU16;

impl Lane {
    /// Flips a bit of the lane's memory in the way with this number and returns its name; `None`
    /// after the last way.
    pub(in crate::pulse::scheduler) fn flip(&mut self, way: usize) -> Option<&'static str> {
        let stretch = |stretch: &mut Option<PulsePart>, bit: u16| {
            let length = &mut stretch.as_mut().unwrap().length_us;
            *length = NonZeroU16::new(length.get() ^ bit).unwrap();
        };
        Some(match way {
            0 => {
                stretch(&mut self.stretches[0], 1 << 9);
                "length of the first phase"
            }
            1 => {
                stretch(&mut self.stretches[2], 1);
                "length of the second phase"
            }
            2 => {
                self.stretches[2].as_mut().unwrap().shows.0 ^= 0b11;
                "lines of the second phase"
            }
            3 => {
                self.stretches[1].as_mut().unwrap().shows.0 ^= 0b100;
                "another channel's line in the gap"
            }
            4 => {
                self.period_us ^= 1 << 12;
                "period"
            }
            5 => {
                self.due = self.due.map(|due| due + us(16));
                "next edge"
            }
            6 => {
                self.burst_start += us(1 << 8);
                "start of the burst"
            }
            7 => {
                self.pulse ^= 1;
                "pulse of the burst"
            }
            8 => {
                self.code = Some(DacCode::new(40_000));
                "code of the burst"
            }
            9 => {
                self.stretch ^= 2;
                "stretch under way"
            }
            10 => {
                self.phase = Phase::Recovering;
                "phase"
            }
            11 => {
                self.bursts_left ^= 1;
                "bursts left"
            }
            12 => {
                self.tail_us ^= 1 << 4;
                "tail"
            }
            13 => {
                self.next_us ^= 1 << 10;
                "time to the next burst"
            }
            _ => return None,
        })
    }
}
