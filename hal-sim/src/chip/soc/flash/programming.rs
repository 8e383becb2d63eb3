//! Erasing and programming of the flash (RM0090 sections 3.6, 3.9; times: DS8626, flash memory
//! programming, the maxima).
//!
//! During an operation every read of the array waits for its end; lines in the caches are still
//! delivered. The core cannot see written data before the end, so the contents change at once.

use super::Flash;
use crate::chip::Cycle;
use crate::chip::cpu::Size;
use crate::chip::cpu::bus::{AccessError, Modelled, Unmodelled, refuse_if};
use crate::chip::soc::clock::cycles_in;
use crate::chip::soc::word::read_part;
use std::ops::Range;

pub(super) mod sr {
    pub const EOP: u32 = 1;
    pub const OPERR: u32 = 1 << 1;
    pub const WRPERR: u32 = 1 << 4;
    pub const PGPERR: u32 = 1 << 6;
    pub const PGSERR: u32 = 1 << 7;
    pub const FLAGS: u32 = 0xF3;
    pub const BSY: u32 = 1 << 16;
}

pub(super) mod cr {
    pub const PG: u32 = 1;
    pub const SER: u32 = 1 << 1;
    pub const MER: u32 = 1 << 2;
    pub const SNB: u32 = 0xF << 3;
    pub const PSIZE: u32 = 3 << 8;
    pub const STRT: u32 = 1 << 16;
    pub const EOPIE: u32 = 1 << 24;
    pub const ERRIE: u32 = 1 << 25;
    pub const LOCK: u32 = 1 << 31;
}

const KEYS: [u32; 2] = [0x4567_0123, 0xCDEF_89AB];
/// OPTCR on delivery: no protection, brown-out level off, watchdog by software.
const OPTCR: u32 = 0x0FFF_AAED;
/// Time to program one byte, half-word or word, ns.
const PROGRAM_NS: u64 = 100_000;

/// Offsets of the first byte of sectors 0–11 and of the end of the last (RM0090 table 5).
pub const SECTORS: [u32; 13] = [
    0x0_0000, 0x0_4000, 0x0_8000, 0x0_C000, 0x1_0000, 0x2_0000, 0x4_0000, 0x6_0000, 0x8_0000,
    0xA_0000, 0xC_0000, 0xE_0000, 0x10_0000,
];

/// Returns the offsets of the bytes of `sector`, 0–11; `None` if there is no such sector.
fn sector(sector: usize) -> Option<Range<u32>> {
    Some(*SECTORS.get(sector)?..*SECTORS.get(sector + 1)?)
}

/// Returns the time to erase a sector of `bytes` bytes, ns. `psize` is the parallelism: 0 for x8, 1
/// for x16, 2 for x32.
fn erase_ns(bytes: u32, psize: u32) -> u64 {
    let ms = match bytes {
        0x4000 => [800, 600, 500],
        0x1_0000 => [2400, 1400, 1100],
        _ => [4000, 2600, 2000],
    };
    ms[psize as usize] * 1_000_000 // 0–2: checked by the callers
}

#[derive(Clone, PartialEq, Debug)]
pub(super) struct Programming {
    pub(super) cr: u32,
    flags: u32,
    /// Cycle at which the operation in progress ends; `None` if there is none.
    end: Option<Cycle>,
    /// Number of keys written so far; `None` after a wrong key, until reset.
    keys: Option<usize>,
    /// Value of OPTCR: the option bytes as they were programmed before the simulation.
    options: u32,
}

impl Programming {
    pub(super) const fn new() -> Self {
        Self {
            cr: cr::LOCK,
            flags: 0,
            end: None,
            keys: Some(0),
            options: OPTCR,
        }
    }

    pub(super) fn reset(&mut self) {
        *self = Self {
            options: self.options,
            ..Self::new()
        };
    }

    pub(super) fn is_busy(&self, at: Cycle) -> bool {
        self.end.is_some_and(|end| at < end)
    }

    /// Returns the end of the operation in progress; `Cycle::MAX` if there is none.
    pub(super) fn end(&self) -> Cycle {
        self.end.unwrap_or(Cycle::MAX)
    }

    pub(super) fn end_at(&mut self, end: Cycle) {
        self.end = Some(end);
    }

    pub(super) fn advance(&mut self, to: Cycle) {
        if self.end.is_some_and(|end| end <= to) {
            self.end = None;
            if self.cr & cr::EOPIE != 0 {
                self.flags |= sr::EOP;
            }
            self.cr &= !cr::STRT;
        }
    }

    pub(super) const fn interrupt(&self) -> bool {
        self.cr & cr::EOPIE != 0 && self.flags & sr::EOP != 0
            || self.cr & cr::ERRIE != 0 && self.flags & sr::OPERR != 0
    }

    pub(super) fn status(&self) -> u32 {
        self.flags | if self.end.is_some() { sr::BSY } else { 0 }
    }

    pub(super) fn clear(&mut self, flags: u32) {
        self.flags &= !(flags & sr::FLAGS);
    }

    pub(super) const fn option_control(&self) -> u32 {
        self.options
    }

    /// Returns whether a sector's nWRP option bit is 0.
    const fn is_protected(&self, sector: u32) -> bool {
        self.options & 1 << (16 + sector) == 0
    }

    pub(super) fn write_key(&mut self, key: u32) -> Modelled {
        let written = self.keys.filter(|n| KEYS.get(*n) == Some(&key));
        self.keys = written.map(|n| n + 1);
        match self.keys {
            None => Err(Unmodelled(
                "FLASH_KEYR: a wrong key, which causes a bus error and locks the flash until reset",
            )),
            Some(2) => {
                self.cr &= !cr::LOCK;
                self.keys = Some(0);
                Ok(())
            }
            Some(_) => Ok(()),
        }
    }

    pub(super) fn option_byte(&self, address: u32, size: Size) -> Option<u32> {
        let word = match address & !3 {
            0x1FFF_C000 => 0xFFFF_0003 | self.option_control() & 0xFFFC,
            0x1FFF_C008 => 0xFFFF_F000 | self.option_control() >> 16 & 0x0FFF,
            0x1FFF_C004 | 0x1FFF_C00C => u32::MAX,
            _ => return None,
        };
        Some(read_part(word, address, size))
    }

    fn fail(&mut self, flag: u32) {
        self.flags |= flag;
        if flag != sr::PGSERR && self.cr & cr::ERRIE != 0 {
            self.flags |= sr::OPERR;
        }
    }
}

impl Flash {
    /// Write-protects the sectors whose bit is set in `sectors`, as if the option bytes had been
    /// programmed before.
    pub fn protect(&mut self, sectors: u16) {
        self.programming.options |= 0x0FFF << 16;
        self.programming.options &= !(u32::from(sectors & 0x0FFF) << 16);
    }

    /// Sets the option bytes that OPTCR shows. Their effects are not modelled.
    pub const fn set_options(&mut self, optcr: u32) {
        self.programming.options = optcr;
    }

    /// Writes data of `size` at `address`, and returns the wait states. The write programs the
    /// flash if FLASH_CR allows it, otherwise it sets an error flag.
    pub fn write(
        &mut self,
        address: u32,
        size: Size,
        value: u32,
        at: Cycle,
    ) -> Result<u32, AccessError> {
        let programming = &mut self.programming;
        let begin = if programming.is_busy(at) {
            programming.end()
        } else {
            at
        };
        programming.advance(begin);
        let wait = u32::try_from(begin - at).unwrap_or(u32::MAX);
        let offset = address & (super::SIZE as u32 - 1);
        // the first sector starts at 0
        let number = SECTORS.partition_point(|start| *start <= offset) - 1;
        if programming.cr & (cr::PG | cr::SER | cr::LOCK) != cr::PG {
            programming.fail(sr::PGSERR);
        } else if programming.cr & cr::PSIZE != (size as u32) << 8 {
            programming.fail(sr::PGPERR);
        } else if programming.is_protected(number as u32) {
            programming.fail(sr::WRPERR);
        } else {
            let bytes = value.to_le_bytes();
            self.save_contents(offset..offset + size.bytes());
            let places = self.bytes_mut().iter_mut().skip(offset as usize);
            for (place, byte) in places.zip(&bytes[..size.bytes() as usize]) {
                *place &= byte; // programming only clears bits
            }
            self.mark_changed(offset >> 4..(offset >> 4) + 1, false);
            self.occupy(begin, PROGRAM_NS);
        }
        Ok(wait)
    }

    pub(super) fn write_cr(&mut self, value: u32, at: Cycle) -> Modelled {
        let programming = &mut self.programming;
        if programming.cr & cr::LOCK != 0 {
            return Ok(()); // section 3.9.6: not accessible while locked
        }
        refuse_if(
            programming.end.is_some(),
            "FLASH_CR: written while the flash is busy",
        )?;
        if value & cr::MER != 0 || value & cr::PSIZE == cr::PSIZE {
            return Err(Unmodelled("FLASH_CR: mass erase or x64"));
        }
        let fields =
            cr::PG | cr::SER | cr::SNB | cr::PSIZE | cr::STRT | cr::EOPIE | cr::ERRIE | cr::LOCK;
        programming.cr = value & fields;
        if value & cr::STRT == 0 {
            return Ok(());
        }
        refuse_if(
            value & (cr::SER | cr::PG) != cr::SER,
            "FLASH_CR: STRT without SER alone",
        )?;
        let number = (value & cr::SNB) >> 3;
        let sector = sector(number as usize).ok_or(Unmodelled("FLASH_CR: SNB above 11"))?;
        if programming.is_protected(number) {
            programming.cr &= !cr::STRT;
            programming.fail(sr::WRPERR);
            return Ok(());
        }
        self.save_contents(sector.clone());
        if let Some(bytes) = self
            .bytes_mut()
            .get_mut(sector.start as usize..sector.end as usize)
        {
            bytes.fill(0xFF);
        }
        self.mark_changed(sector.start >> 4..sector.end >> 4, true);
        let psize = (value & cr::PSIZE) >> 8;
        self.occupy(at, erase_ns(sector.end - sector.start, psize));
        Ok(())
    }

    /// Saves the contents at `offsets`, for a reset that aborts their change.
    fn save_contents(&mut self, offsets: Range<u32>) {
        let (start, end) = (offsets.start as usize, offsets.end as usize);
        let before = self.bytes.get(start..end).unwrap_or_default();
        self.before = (start, before.to_vec());
    }

    fn mark_changed(&mut self, lines: Range<u32>, erased: bool) {
        self.accelerator.outdate(lines, erased);
        self.code_version = self.code_version.wrapping_add(1);
    }

    fn occupy(&mut self, begin: Cycle, ns: u64) {
        let end = begin.saturating_add(cycles_in(ns, self.hz));
        self.programming.end_at(end);
        self.accelerator.occupy(end);
    }
}
