//! Flash of the simulated chip: erasing sets bytes to 0xFF, programming only clears bits.

use crate::chip::{Chip, Sector};
use hal_sim::random::Sequence;

/// Point at which programming stops when the supply is cut.
#[derive(Debug)]
pub enum Stop<'a> {
    /// At a random byte or word, of which random bits are programmed.
    Random(&'a mut Sequence),
    /// At this byte of the block, of which the bits that are set in `left` are not programmed.
    AtByte {
        /// Number of the byte, from 0.
        byte: usize,
        /// Bits that are not programmed yet.
        left: u8,
    },
}

/// Flash memory of one chip.
#[derive(Debug, Clone)]
pub struct Memory {
    chip: Chip,
    bytes: Vec<u8>,
    /// Numbers of the sectors that ignore erasing and programming.
    pub write_protected: Vec<u8>,
}

impl Memory {
    /// Creates erased flash.
    #[must_use]
    pub fn new(chip: Chip) -> Self {
        let size: u32 = chip.sectors().map(|sector| sector.size).sum();
        Self {
            chip,
            bytes: vec![0xFF; size as usize],
            write_protected: Vec::new(),
        }
    }

    /// Returns all bytes, from the first address on.
    #[must_use]
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    /// Sets the contents from `address` on, without the rules of programming. Bytes behind the
    /// end are dropped.
    pub fn preset(&mut self, address: u32, data: &[u8]) {
        let start = address.saturating_sub(self.chip.origin) as usize;
        let target = self.bytes.iter_mut().skip(start);
        target.zip(data).for_each(|(byte, &value)| *byte = value);
    }

    /// Bytes at `address`; `None` if they are not all in flash.
    #[must_use]
    pub fn read(&self, address: u32, length: usize) -> Option<&[u8]> {
        let start = address.checked_sub(self.chip.origin)? as usize;
        self.bytes.get(start..start.checked_add(length)?)
    }

    /// Sector that contains `address`.
    #[must_use]
    pub fn sector(&self, address: u32) -> Option<Sector> {
        let contains = |sector: &Sector| (sector.address..sector.end()).contains(&address);
        self.chip.sectors().find(contains)
    }

    /// Erases a sector, or with `cut` stops at a random point of the operation.
    pub fn erase(&mut self, sector: &Sector, cut: Option<&mut Sequence>) {
        if self.write_protected.contains(&sector.number) {
            return;
        }
        let start = sector.address.saturating_sub(self.chip.origin) as usize;
        let bytes = self.bytes.iter_mut().skip(start).take(sector.size as usize);
        let Some(random) = cut else {
            bytes.for_each(|byte| *byte = 0xFF);
            return;
        };
        let kind = random.below(5);
        let size = u64::from(sector.size);
        let (begin, end) = (random.below(size), random.below(size));
        for (index, byte) in bytes.enumerate() {
            let index = index as u64;
            let noise = random.byte();
            *byte = match kind {
                // The start is erased.
                0 if index < begin => 0xFF,
                // The end is erased.
                1 if index >= begin => 0xFF,
                // Every bit has risen or not.
                2 => *byte | noise,
                // The bits are undefined.
                3 => noise,
                // The start is erased and the part behind it undefined.
                4 if index < begin.min(end) => 0xFF,
                4 if index < begin.max(end) => noise,
                _ => *byte,
            };
        }
    }

    /// Programs `data` at `address`, up to `stop` if there is one. Bytes outside flash and in
    /// write-protected sectors are ignored.
    pub fn program(&mut self, address: u32, data: &[u8], stop: Option<Stop<'_>>) {
        let protected = self
            .sector(address)
            .is_some_and(|sector| self.write_protected.contains(&sector.number));
        if protected {
            return;
        }
        let start = address.saturating_sub(self.chip.origin) as usize;
        let target = self.bytes.iter_mut().skip(start).zip(data);
        let random = match stop {
            None => {
                target.for_each(|(byte, &value)| *byte &= value);
                return;
            }
            Some(Stop::AtByte { byte: last, left }) => {
                for (index, (byte, &value)) in target.take(last.saturating_add(1)).enumerate() {
                    *byte &= if index < last { value } else { value | left };
                }
                return;
            }
            Some(Stop::Random(random)) => random,
        };
        // The flash programs 1 or 4 bytes at a time, depending on the parallelism.
        let width = if random.below(2) == 0 { 1 } else { 4 };
        let stop = random.below((data.len() / width).max(1) as u64);
        for (index, (byte, &value)) in target.enumerate() {
            match ((index / width) as u64).cmp(&stop) {
                std::cmp::Ordering::Less => *byte &= value,
                std::cmp::Ordering::Equal => *byte &= value | random.byte(),
                std::cmp::Ordering::Greater => {}
            }
        }
    }
}
