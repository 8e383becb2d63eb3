//! Decodes the image's log: bytes that the image writes to RAM (SEGGER RTT), decoded with the defmt
//! table of its ELF.
//!
//! In: an image, the chip's RAM. Out: lines with the image's own time stamps, as a debug probe shows
//! them. Draining takes no time on the chip, as with a probe.

use super::board::Surroundings;
use super::cpu::Size;
use super::image::{Image, ImageError};
use super::soc::Ram;
use crate::input;
use crate::lockstep::{Device, Output};
use defmt_decoder::{DecodeError, StreamDecoder, Table};
use firmware::lockstep::{Sensors, Sink};
use firmware::units::Micros;
use std::io::{self, Write};

/// Symbol of the control block in the ELF.
const SYMBOL: &str = "_SEGGER_RTT";
/// Offset in the control block of the first up channel's buffer address. The block has 16 bytes of
/// name and the numbers of up and down channels, then for each channel its name, buffer, size,
/// write position, read position and flags.
const BUFFER: u32 = 24 + 4;
/// Offset of the first up channel's buffer size.
const SIZE: u32 = 24 + 8;
/// Offset of the first up channel's write position.
const WRITE: u32 = 24 + 12;
/// Offset of the first up channel's read position.
const READ: u32 = 24 + 16;

/// The first up channel (program to debugger) of the control block at address `block`.
#[derive(Clone, Copy, Debug)]
struct Channel {
    block: u32,
}

impl Channel {
    fn word(self, ram: &Ram, offset: u32) -> Option<u32> {
        ram.read(self.block.wrapping_add(offset), Size::Word)
    }

    /// Takes the bytes that the program has written since the last call. Returns no bytes if the
    /// control block is not set up or is corrupt.
    fn drain(self, ram: &mut Ram) -> Vec<u8> {
        self.take(ram).unwrap_or_default()
    }

    fn take(self, ram: &mut Ram) -> Option<Vec<u8>> {
        // The program's start-up code writes the name; before that, there is no control block.
        if self.word(ram, 0)?.to_le_bytes() != *b"SEGG" {
            return None;
        }
        let [buffer, size] = [BUFFER, SIZE].map(|offset| self.word(ram, offset));
        let (buffer, size) = (buffer?, size?);
        let (write, mut read) = (self.word(ram, WRITE)?, self.word(ram, READ)?);
        if write >= size || read >= size {
            return None;
        }
        let mut bytes = Vec::new();
        while read != write {
            bytes.push(ram.read(buffer.wrapping_add(read), Size::Byte)? as u8);
            read = (read + 1) % size;
        }
        ram.write(self.block.wrapping_add(READ), Size::Word, read)?;
        Some(bytes)
    }
}

/// Reason why a log cannot be decoded.
#[derive(Debug, thiserror::Error)]
pub enum LogError {
    /// The image has no defmt table.
    #[error(transparent)]
    Image(#[from] ImageError),
    /// The defmt table cannot be read or has an unsupported version.
    #[error("E548 the defmt table of {path} cannot be used: {why}; leave out --log")]
    Table {
        /// Path of the image.
        path: std::path::PathBuf,
        /// Description of the problem.
        why: String,
    },
}

/// Decoder of the defmt log of one image, and the output to which its lines go.
pub struct Log {
    channel: Channel,
    decoder: Box<dyn StreamDecoder + Send + Sync>,
    out: Box<dyn Write + Send>,
}

impl Log {
    /// Creates the decoder for `image`; lines go to `out`. The decoded table stays in memory until
    /// the process ends.
    pub fn new(image: &Image, out: Box<dyn Write + Send>) -> Result<Self, LogError> {
        image.require_defmt()?;
        let path = image.path();
        let elf = input::read(path, input::LONGEST_DOCUMENT);
        let elf = elf.map_err(|why| ImageError::Unreadable(path.to_owned(), why))?;
        let unusable = |why: String| LogError::Table {
            path: path.to_owned(),
            why,
        };
        let table = Table::parse(&elf).map_err(|why| unusable(format!("{why:#}")))?;
        let table = table.ok_or_else(|| unusable("the table is empty".into()))?;
        let block = image.symbols.find(SYMBOL);
        let block = block.ok_or_else(|| unusable(format!("the image has no symbol {SYMBOL}")))?;
        // The decoder borrows the table, and both live as long as the log.
        let table: &'static Table = Box::leak(Box::new(table));
        Ok(Self {
            channel: Channel {
                block: block.address,
            },
            decoder: table.new_stream_decoder(),
            out,
        })
    }

    /// Writes the log lines since the last call to the output, each with its time stamp, s.
    ///
    /// # Errors
    /// Fails if the output cannot be written.
    pub fn drain(&mut self, ram: &mut Ram) -> io::Result<()> {
        let bytes = self.channel.drain(ram);
        if bytes.is_empty() {
            return Ok(());
        }
        self.decoder.received(&bytes);
        loop {
            match self.decoder.decode() {
                Ok(frame) => {
                    let level = frame.level().map_or("-", |level| level.as_str());
                    let text = frame.display_message();
                    let stamp = frame.display_timestamp();
                    let time = stamp.map_or("-".into(), |stamp| stamp.to_string());
                    writeln!(self.out, "{time:>12} {level:<5} {text}")?;
                }
                Err(DecodeError::Malformed) => writeln!(self.out, "{:>12} (a damaged line)", "-")?,
                Err(DecodeError::UnexpectedEof) => return self.out.flush(),
            }
        }
    }
}

/// A board whose log is written while it runs.
pub struct Logged<D> {
    device: D,
    log: Log,
}

impl<D: Device + AsMut<Surroundings>> Logged<D> {
    /// Wraps `device` so that its log goes to `log`.
    pub const fn new(device: D, log: Log) -> Self {
        Self { device, log }
    }
}

impl<D: Device + AsMut<Surroundings>> Device for Logged<D> {
    fn receive(
        &mut self,
        at: Micros,
        bytes: &[u8],
        sensors: &Sensors,
        sink: &mut dyn Sink,
    ) -> io::Result<()> {
        self.device.receive(at, bytes, sensors, sink)
    }

    fn advance(&mut self, to: Micros, sensors: &Sensors, sink: &mut dyn Sink) -> io::Result<()> {
        let done = self.device.advance(to, sensors, sink);
        // The log from before the stop is of most interest, so it is written in any case.
        let written = self.log.drain(&mut self.device.as_mut().soc.ram);
        written.and(done)
    }

    fn output(&self, channel: usize) -> Option<Output> {
        self.device.output(channel)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BLOCK: u32 = 0x2000_0100;

    fn ram() -> Ram {
        let mut ram = Ram::new(0x2000_0000, 0x1000);
        let name = u32::from_le_bytes(*b"SEGG");
        let words = [
            (0, name),
            (BUFFER, 0x2000_0200),
            (SIZE, 8),
            (WRITE, 2),
            (READ, 6),
        ];
        for (offset, word) in words {
            ram.write(BLOCK + offset, Size::Word, word).unwrap();
        }
        for (at, byte) in [(6, 1), (7, 2), (0, 3), (1, 4)] {
            ram.write(0x2000_0200 + at, Size::Byte, byte).unwrap();
        }
        ram
    }

    #[test]
    fn a_channel_is_drained_around_its_end_and_once() {
        let (mut ram, channel) = (ram(), Channel { block: BLOCK });
        assert_eq!(channel.drain(&mut ram), [1, 2, 3, 4]);
        assert!(channel.drain(&mut ram).is_empty());
        assert_eq!(ram.read(BLOCK + READ, Size::Word), Some(2));
    }

    #[test]
    fn a_block_that_is_not_set_up_is_left_alone() {
        for (offset, word) in [(0, 0), (WRITE, 8), (READ, 9), (BUFFER, 0x4000_0000)] {
            let (mut ram, channel) = (ram(), Channel { block: BLOCK });
            ram.write(BLOCK + offset, Size::Word, word).unwrap();
            let before = ram.clone().bytes.to_vec();
            assert!(channel.drain(&mut ram).is_empty(), "{offset}");
            assert_eq!(ram.bytes, before);
        }
    }
}
