//! Models DMA2 and DMA1 (RM0090 chapter 10): registers, flags, streams.
//!
//! Modelled for DMA2: TIM1's requests, direct mode, words, memory increment, circular or not,
//! memory to GPIOx_BSRR, and SRAM to SRAM through the peripheral port; and the effect of inverted
//! bits in the registers of such a stream. TEIF (a bus error) and DMEIF (no memory increment) are
//! never set. DMA1 answers accesses, but none of its streams may be enabled. This module holds the
//! state and the effect of a single access; `playback` determines when accesses happen.

mod registers;
mod stream;

use crate::chip::Cycle;
#[cfg(test)]
pub(crate) use registers::offset;
pub use registers::stream_offset;
pub(crate) use stream::bit;
pub use stream::{Stream, Target};

/// Number of streams of a controller.
pub const STREAMS: usize = 8;

/// Number of TIM1 events that request DMA2. In a mask of events, bit 0 is the update and bits 1–4
/// are channels 1–4.
pub const EVENTS: usize = 5;

/// One DMA controller: its streams and their interrupt flags.
#[derive(Clone, PartialEq, Debug)]
pub struct Dma {
    /// Number of the controller: 1 or 2.
    number: u8,
    streams: [Stream; STREAMS],
    /// Registers LISR and HISR.
    flags: [u32; 2],
    /// Streams with an enabled interrupt, bit n is stream n.
    asking: u8,
}

impl Dma {
    /// Creates controller `number`, 1 or 2, in its reset state.
    pub fn new(number: u8) -> Self {
        Self {
            number,
            streams: std::array::from_fn(|_| Stream::new()),
            flags: [0; 2],
            asking: 0,
        }
    }

    /// Returns stream `index`, 0–7, with its registers and position.
    #[inline]
    pub fn stream(&self, index: usize) -> &Stream {
        &self.streams[index]
    }

    /// Returns stream `index`, 0–7, for changes of its registers and position.
    #[inline]
    pub fn stream_mut(&mut self, index: usize) -> &mut Stream {
        &mut self.streams[index]
    }

    /// Returns the enabled streams, bit n is stream n.
    pub fn enabled(&self) -> u8 {
        (0..STREAMS).fold(0, |bits, n| {
            bits | u8::from(self.streams[n].is_enabled()) << n
        })
    }

    /// Sets the flags `flag` of stream `index`: a combination of `bit::FEIF`, `bit::HTIF` and
    /// `bit::TCIF`.
    #[inline]
    pub fn raise(&mut self, index: usize, flag: u32) {
        self.flags[index / 4] |= flag << SHIFTS[index % 4];
    }

    /// Returns the streams that request an interrupt, bit n is stream n: those with a set flag
    /// whose interrupt is enabled (RM0090 10.4).
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

    /// Returns the stream among `candidates` (bit n is stream n) that a port's arbiter chooses: the
    /// highest priority level, then the lowest number (RM0090 10.3.4). Returns `None` without
    /// candidates.
    #[inline]
    pub fn arbitrate(&self, candidates: u8) -> Option<usize> {
        if candidates & candidates.wrapping_sub(1) == 0 {
            return (candidates != 0).then_some(candidates.trailing_zeros() as usize);
        }
        (0..STREAMS)
            .filter(|n| candidates >> n & 1 != 0)
            .min_by_key(|&n| (3 - self.streams[n].priority(), n))
    }

    /// Counts one item over the peripheral port of stream `index`, sets the flags for half and
    /// complete transfers, and returns whether more items follow.
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

    /// Switches stream `index` off (RM0090 10.3.17), which sets its TCIF flag.
    pub fn switch_off(&mut self, index: usize) {
        self.streams[index].switch_off();
        self.raise(index, bit::TCIF);
    }
}

/// Lowest bit of the flags of each of four streams in LISR (streams 0–3) or HISR (streams 4–7).
const SHIFTS: [u32; 4] = [0, 6, 16, 22];

/// Returns a mask of the TIM1 events that request `channel` of `stream` on DMA2, or `None` if the
/// channel belongs to another peripheral (RM0090 table 43). TIM1_TRIG and COM never request here.
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

/// Cycle of an event that has not been scheduled.
pub const NEVER: Cycle = Cycle::MAX;

#[cfg(test)]
mod tests;
