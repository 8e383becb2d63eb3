//! DMA2 and DMA1 (RM0090 chapter 10): registers, flags, streams.
//!
//! Modelled: DMA2, TIM1's requests, direct mode, words, memory increment,
//! circular or not, memory to GPIOx_BSRR, and SRAM to SRAM through the
//! peripheral port; and what becomes of that when a bit of a stream turns. TEIF
//! (a bus error) and DMEIF (no memory increment) never rise. DMA1 answers, but no
//! stream of it may be enabled. Here: state and what one access does to it. Not
//! here: when accesses happen (`playback`).

mod registers;
mod stream;

use crate::chip::Cycle;
#[cfg(test)]
pub(crate) use registers::offset;
pub use registers::stream_offset;
pub(crate) use stream::bit;
pub use stream::{Stream, Target};

/// Streams of a controller.
pub const STREAMS: usize = 8;

/// Events of TIM1 that ask DMA2, as bits: update, then channels 1–4.
pub const EVENTS: usize = 5;

/// One controller.
#[derive(Clone, PartialEq, Debug)]
pub struct Dma {
    /// 1 or 2.
    number: u8,
    streams: [Stream; STREAMS],
    /// LISR, HISR.
    flags: [u32; 2],
    /// Streams of which an interrupt is enabled.
    asking: u8,
}

impl Dma {
    /// Controller `number`, 1 or 2, as after reset.
    pub fn new(number: u8) -> Self {
        Self {
            number,
            streams: std::array::from_fn(|_| Stream::new()),
            flags: [0; 2],
            asking: 0,
        }
    }

    /// Stream `index`, 0–7.
    #[inline]
    pub fn stream(&self, index: usize) -> &Stream {
        &self.streams[index]
    }

    /// As [`Self::stream`].
    #[inline]
    pub fn stream_mut(&mut self, index: usize) -> &mut Stream {
        &mut self.streams[index]
    }

    /// Streams that are enabled, bit n is stream n.
    pub fn enabled(&self) -> u8 {
        (0..STREAMS).fold(0, |bits, n| {
            bits | u8::from(self.streams[n].is_enabled()) << n
        })
    }

    /// Raises flags `bit::*IF` of stream `index`.
    #[inline]
    pub fn raise(&mut self, index: usize, flag: u32) {
        self.flags[index / 4] |= flag << SHIFTS[index % 4];
    }

    /// Streams that ask for an interrupt: a flag is up whose enable is set (RM0090 10.4).
    #[inline]
    pub fn interrupts(&self) -> u8 {
        if self.asking == 0 {
            return 0;
        }
        (0..STREAMS).fold(0, |bits, n| {
            let up = self.flags[n / 4] >> SHIFTS[n % 4];
            bits | u8::from(up & self.streams[n].flags_enabled() != 0) << n
        })
    }

    /// The one of `candidates` (bits) that the arbiter of a port chooses: the
    /// highest priority level, then the lowest number (RM0090 10.3.4).
    #[inline]
    pub fn arbitrate(&self, candidates: u8) -> Option<usize> {
        if candidates & candidates.wrapping_sub(1) == 0 {
            return (candidates != 0).then_some(candidates.trailing_zeros() as usize);
        }
        (0..STREAMS)
            .filter(|n| candidates >> n & 1 != 0)
            .min_by_key(|&n| (3 - self.streams[n].priority(), n))
    }

    /// One item went over the peripheral port of stream `index`, complete from
    /// `done` on: counts it and raises half and whole. Gives whether more are
    /// to come.
    #[inline]
    pub fn count(&mut self, index: usize) -> bool {
        let stream = &mut self.streams[index];
        let left = stream.count();
        if left == 0 {
            self.raise(index, bit::TCIF);
        } else if left == stream.length / 2 {
            self.raise(index, bit::HTIF);
        }
        left != 0 || self.streams[index].is_circular()
    }

    /// Stream `index` is off (RM0090 10.3.17); says so by its flag.
    pub fn switch_off(&mut self, index: usize) {
        self.streams[index].switch_off();
        self.raise(index, bit::TCIF);
    }
}

/// Place of a stream's flags in LISR or HISR.
const SHIFTS: [u32; 4] = [0, 6, 16, 22];

/// TIM1 events that `channel` of `stream` listens to on DMA2, or `None` if it
/// is another peripheral's (RM0090 table 43). TIM1_TRIG and COM never ask here.
pub fn tim1_events(stream: usize, channel: u32) -> Option<u8> {
    Some(match (channel, stream) {
        (0, 6) => 0b01110,
        (6, 0) => 0,
        (6, 1 | 3) => 0b00010,
        (6, 2) => 0b00100,
        (6, 4) => 0b10000,
        (6, 5) => 0b00001,
        (6, 6) => 0b01000,
        _ => return None,
    })
}

/// A cycle that has not come, for times that wait for another event.
pub const NEVER: Cycle = Cycle::MAX;

#[cfg(test)]
mod tests;
