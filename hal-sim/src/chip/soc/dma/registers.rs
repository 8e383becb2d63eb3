//! Register interface of a DMA controller (RM0090 10.5).

use super::{Dma, STREAMS, Stream, bit, tim1_events};
use crate::chip::Cycle;
use crate::chip::cpu::bus::{Modelled, Unmodelled, refuse_if};

/// Offsets of the registers from the base of a controller, or, from CR on, from the first register
/// of a stream.
pub(crate) mod offset {
    pub const LISR: u32 = 0x00; // Flags of streams 0–3
    pub const HISR: u32 = 0x04; // Flags of streams 4–7
    pub const LIFCR: u32 = 0x08; // Clears flags of streams 0–3
    pub const HIFCR: u32 = 0x0C; // Clears flags of streams 4–7
    pub const STREAM: u32 = 0x10; // First register of stream 0
    pub const CR: u32 = 0x00; // Within a stream: control
    pub const NDTR: u32 = 0x04; // Within a stream: items left
    pub const PAR: u32 = 0x08; // Within a stream: peripheral address
    pub const M0AR: u32 = 0x0C; // Within a stream: memory address
    pub const M1AR: u32 = 0x10; // Within a stream: second memory address
    pub const FCR: u32 = 0x14; // Within a stream: FIFO control
}

/// Length of the registers of one stream, bytes.
const STRIDE: u32 = 0x18;
/// FCR: direct mode disable and threshold.
const FCR_SETTINGS: u32 = 0b111;
/// FCR: direct mode disable.
const DMDIS: u32 = 1 << 2;

/// Returns the offset of `register` (such as CR) of `stream` within the
/// controller.
pub const fn stream_offset(stream: usize, register: u32) -> u32 {
    offset::STREAM + STRIDE * stream as u32 + register
}

impl Dma {
    /// Returns the register at `offset` from the controller's base. Reading has no side effects.
    pub fn read(&self, offset: u32) -> Modelled<u32> {
        if offset < offset::STREAM {
            return match offset {
                offset::LISR => Ok(self.flags[0]),
                offset::HISR => Ok(self.flags[1]),
                offset::LIFCR | offset::HIFCR => Ok(0),
                _ => Err(Unmodelled("a DMA register")),
            };
        }
        let (stream, register) = place(offset)?;
        let stream = &self.streams[stream];
        Ok(match register {
            offset::CR => stream.cr,
            offset::NDTR => stream.ndtr.into(),
            offset::PAR => stream.par,
            offset::M0AR => stream.m0ar,
            offset::M1AR => 0,
            offset::FCR => fcr(stream),
            _ => return Err(Unmodelled("a DMA register")),
        })
    }

    /// Writes the register at `offset`; the write is complete from `done` on. Clearing EN of a
    /// stream sets `stopping`; `playback`, which moves its items, then switches the stream off.
    pub fn write(&mut self, offset: u32, value: u32, done: Cycle) -> Modelled {
        match offset {
            offset::LISR | offset::HISR => return Ok(()), // read only
            offset::LIFCR => self.flags[0] &= !value,
            offset::HIFCR => self.flags[1] &= !value,
            _ => {
                let (stream, register) = place(offset)?;
                return self.write_stream(stream, register, value, done);
            }
        }
        Ok(())
    }

    /// Writes a register of stream `index`. Everything except EN is writable only while EN is 0
    /// (RM0090 10.5.5–10.5.10).
    fn write_stream(&mut self, index: usize, register: u32, value: u32, done: Cycle) -> Modelled {
        if register == offset::CR {
            return self.write_cr(index, value, done);
        }
        let stream = &mut self.streams[index];
        let writable = !stream.is_enabled();
        match register {
            offset::NDTR if writable => stream.ndtr = value as u16,
            offset::PAR if writable => stream.par = value,
            offset::M0AR if writable => stream.m0ar = value,
            offset::M1AR if value == 0 => (),
            offset::FCR if writable => stream.fcr = value & (FCR_SETTINGS | bit::FEIE),
            offset::NDTR => (), // ignored while enabled
            _ => {
                return Err(Unmodelled(
                    "a write to this DMA register, or to it while its stream is enabled",
                ));
            }
        }
        self.note_interrupts(index);
        Ok(())
    }

    fn note_interrupts(&mut self, index: usize) {
        let asks = self.streams[index].flags_enabled() != 0;
        self.asking = self.asking & !(1 << index) | u8::from(asks) << index;
    }

    /// Inverts `bits` of CR, PAR, M0AR or FCR of an enabled stream, where no write could change
    /// them. Returns `false` if `offset` is another register, or if a write could make the change:
    /// the stream is off, or the bits are EN or interrupt enables of CR.
    ///
    /// Items that the stream then moves to or from addresses outside ports and SRAM are lost. Other
    /// effects there, and bus errors, are not modelled.
    ///
    /// # Errors
    /// Fails like [`Stream::upset_cr`].
    pub fn upset(&mut self, offset: u32, bits: u32, at: Cycle) -> Modelled<bool> {
        let Ok((index, register)) = place(offset) else {
            return Ok(false);
        };
        let stream = &mut self.streams[index];
        if !stream.is_enabled() {
            return Ok(false);
        }
        match register {
            offset::PAR => stream.upset_par(bits),
            offset::M0AR => stream.upset_m0ar(bits),
            offset::CR if bits & (bit::EN | bit::INTERRUPTS) == 0 => stream.upset_cr(bits, at)?,
            // The threshold applies only to FIFO mode (RM0090 10.5.10).
            offset::FCR if bits & !(FCR_SETTINGS & !DMDIS | bit::FEIE) == 0 => stream.fcr ^= bits,
            _ => return Ok(false),
        }
        self.note_interrupts(index);
        Ok(true)
    }

    fn write_cr(&mut self, index: usize, value: u32, done: Cycle) -> Modelled {
        let enable = value & bit::EN != 0;
        let stream = &mut self.streams[index];
        if stream.is_enabled() {
            // The other bits are write-protected.
            stream.cr = stream.cr & !bit::INTERRUPTS | value & bit::INTERRUPTS;
            stream.stopping |= !enable;
            self.note_interrupts(index);
            return Ok(());
        }
        stream.cr = value & 0x0FEF_FFFE;
        self.note_interrupts(index);
        if !enable {
            return Ok(());
        }
        refuse_if(self.number == 1, "a DMA1 stream")?;
        let is_apb = matches!(self.streams[index].par, 0x4000_0000..0x4002_0000);
        refuse_if(
            is_apb && self.enabled() != 0,
            "DMA2 serves AHB and APB at once (ES0182)",
        )?;
        if tim1_events(index, self.streams[index].channel()).is_none() {
            return Err(Unmodelled("a DMA2 request other than TIM1's"));
        }
        self.streams[index].switch_on(done)
    }
}

fn place(offset: u32) -> Modelled<(usize, u32)> {
    let stream = (offset.wrapping_sub(offset::STREAM) / STRIDE) as usize;
    if stream < STREAMS {
        Ok((stream, (offset - offset::STREAM) % STRIDE))
    } else {
        Err(Unmodelled("a DMA register"))
    }
}

/// Returns SxFCR. Its FS field shows an empty FIFO or, with the one word of direct mode, a quarter.
fn fcr(stream: &Stream) -> u32 {
    let level = if stream.word.is_some() { 0b001 } else { 0b100 };
    stream.fcr | level << 3
}
