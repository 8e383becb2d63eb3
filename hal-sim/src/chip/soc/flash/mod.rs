//! The flash: 1 MiB, its accelerator, its programming (RM0090 chapter 3, F405).
//!
//! `lines` and `accelerator` are the wait states, `programming` erases and
//! writes, `registers` is the register block. In: fetches, reads, writes with
//! their cycle. Out: data, wait states, an interrupt line.

mod accelerator;
mod lines;
mod programming;
mod registers;
#[cfg(test)]
mod tests;

use super::clock::rescale;
use super::word::read_part;
use crate::chip::Cycle;
use crate::chip::cpu::Size;
use crate::chip::cpu::bus::{AccessError, Modelled, ReadResult, Unmodelled, refuse_if};
use crate::random;
use accelerator::Accelerator;
use programming::Programming;
pub use programming::SECTORS;
use std::sync::Arc;

/// Bytes of main memory.
pub const SIZE: usize = 1 << 20;
/// Address of main memory; also seen at 0 when booting from it.
pub const BASE: u32 = 0x0800_0000;

/// A program does not fit into the flash.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{length} bytes at {address:#010x} are not within the flash, 0x08000000-0x080fffff")]
pub struct OutsideFlash {
    /// Where it begins.
    pub address: u32,
    /// Its bytes.
    pub length: usize,
}

/// What becomes of a line that was prefetched, when the core uses it: RM0090
/// section 3.5.2 can be read in two ways, and no board has told which is right
/// (docs/chip.md, docs/hil.md). Comparing both shows how much hangs on it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Prefetched {
    /// It enters the instruction cache. Only so does the manual's sentence hold
    /// that CoreMark runs as without wait states, and only so does prefetch not
    /// slow loops down.
    #[default]
    Cached,
    /// It does not: the letter of the sentence on misses, which excepts it.
    NotCached,
}

impl Prefetched {
    /// Both readings, the default first.
    pub const ALL: [Self; 2] = [Self::Cached, Self::NotCached];
}

/// Flash memory and its interface.
#[derive(Clone, PartialEq, Debug)]
pub struct Flash {
    /// Forks share it until one of them writes.
    bytes: Arc<[u8]>,
    accelerator: Accelerator,
    programming: Programming,
    /// What was there before the operation under way: offset and bytes.
    before: (usize, Vec<u8>),
    /// Decides what a reset during an operation leaves.
    pub seed: u64,
    hz: u32,
    code_version: u32,
}

impl Default for Flash {
    /// Erased, registers at reset, core at 16 MHz.
    fn default() -> Self {
        Self {
            bytes: vec![0xFF; SIZE].into(),
            accelerator: Accelerator::new(),
            programming: Programming::new(),
            before: (0, Vec::new()),
            seed: 0,
            hz: super::rcc::HSI_HZ,
            code_version: 0,
        }
    }
}

impl Flash {
    /// Puts `bytes` at `address`, as a programmer would; no time passes.
    pub fn load(&mut self, address: u32, bytes: &[u8]) -> Result<(), OutsideFlash> {
        let outside = OutsideFlash {
            address,
            length: bytes.len(),
        };
        let start = address.checked_sub(BASE).ok_or(outside)? as usize;
        let end = start.checked_add(bytes.len()).ok_or(outside)?;
        let place = self.bytes_mut().get_mut(start..end).ok_or(outside)?;
        place.copy_from_slice(bytes);
        self.code_version = self.code_version.wrapping_add(1);
        Ok(())
    }

    /// [`Self::load`] into a chip that has run: its caches forget what they held.
    ///
    /// # Errors
    /// As there.
    pub fn replace(&mut self, address: u32, bytes: &[u8]) -> Result<(), OutsideFlash> {
        self.load(address, bytes)?;
        self.accelerator.forget();
        Ok(())
    }

    /// All bytes, for who writes: a fork has its own from then on.
    fn bytes_mut(&mut self) -> &mut [u8] {
        Arc::make_mut(&mut self.bytes)
    }

    /// System reset: the memory stays. An operation under way is cut off: what it
    /// changes is undefined then (RM0090 section 3.6.1). Taken: each bit that was
    /// to change has or has not, as `seed` and the moment have it.
    pub fn reset(&mut self, at: Cycle) {
        let (offset, before) = std::mem::take(&mut self.before);
        if self.programming.is_busy(at) {
            let seed = random::word(self.seed, at);
            let places = self.bytes_mut().iter_mut().skip(offset);
            for (index, (place, before)) in (0..).zip(places.zip(before)) {
                let changed = random::word(seed, index) as u8;
                *place = before ^ (before ^ *place) & changed;
            }
            self.code_version = self.code_version.wrapping_add(1);
        }
        self.programming.reset();
        self.accelerator.reset();
    }

    /// OPTCR: the option bytes.
    pub(super) const fn options(&self) -> u32 {
        self.programming.option_control()
    }

    /// How the manual is read from now on; kept over resets.
    pub const fn set_prefetched(&mut self, prefetched: Prefetched) {
        self.accelerator.set_prefetched(prefetched);
    }

    /// As fast as the core from now on, whatever the program sets; kept over
    /// resets. To see what hangs on wait states: no board's.
    pub const fn never_wait(&mut self) {
        self.accelerator.never_wait();
    }

    /// From cycle `at` on the core runs at `hz`.
    pub fn set_hz(&mut self, hz: u32, at: Cycle) {
        if self.programming.is_busy(at) {
            let end = rescale(self.programming.end(), at, self.hz, hz);
            self.programming.end_at(end);
            self.accelerator.occupy_until(end);
        }
        self.hz = hz;
    }

    /// Turns `bits` of ACR by itself at a supply of `supply_mv`. `false` if `offset` is
    /// another register's.
    ///
    /// # Errors
    /// As [`Self::check_known`].
    pub fn upset(&mut self, offset: u32, bits: u32, supply_mv: u32) -> Modelled<bool> {
        if offset != 0 {
            return Ok(false);
        }
        self.set_acr(self.accelerator.acr() ^ bits)?;
        self.check_known(supply_mv)?;
        Ok(true)
    }

    /// Whether LATENCY suffices by what is known to read right where the data sheet is left.
    /// Betaflight runs this chip at 240 MHz with 5 wait states: assumed, a read takes the
    /// array no more than those 25 ns from 2.7 V on.
    ///
    /// # Errors
    /// It does not: the flash would deliver wrong code.
    pub fn check_known(&self, supply_mv: u32) -> Modelled {
        const PER_S: u64 = 40_000_000;
        let reads = u64::from(self.accelerator.latency + 1) * PER_S;
        match supply_mv >= 2700 && u64::from(self.hz) <= reads {
            true => Ok(()),
            false => self.check_wait_states(supply_mv),
        }
    }

    /// Whether LATENCY suffices for the core clock at a supply of `supply_mv`
    /// (RM0090 table 10).
    ///
    /// # Errors
    /// It does not: the flash would deliver wrong code.
    pub fn check_wait_states(&self, supply_mv: u32) -> Modelled {
        let step_hz = match supply_mv {
            2700.. => 30_000_000,
            2400.. => 24_000_000,
            2100.. => 22_000_000,
            _ => 20_000_000,
        };
        refuse_if(
            self.accelerator.latency < self.hz.div_ceil(step_hz).saturating_sub(1),
            "FLASH_ACR: too few wait states for this clock and supply",
        )?;
        Ok(())
    }

    /// The core needs code of the 16-byte line at `line` (its address / 16, by
    /// either alias) at `at`; gives the wait states.
    #[inline(always)]
    pub fn fetch(&mut self, line: u32, at: Cycle) -> u32 {
        self.accelerator.fetch(line & (lines::COUNT as u32 - 1), at)
    }

    /// A data read of `size` at `address` (by either alias, naturally aligned).
    ///
    /// # Errors
    /// The data cache still holds what was there before an erasure.
    #[inline]
    pub fn read(&mut self, address: u32, size: Size, at: Cycle) -> Result<ReadResult, AccessError> {
        let offset = address & (SIZE as u32 - 1);
        let wait = self
            .accelerator
            .read(offset >> 4, at)
            .ok_or(Unmodelled("FLASH: data cached before an erasure"))?;
        let value = self.word(offset & !3);
        Ok(ReadResult {
            value: read_part(value, offset, size),
            wait,
        })
    }

    /// What is at `address`; no time passes. For decoding and debuggers.
    pub fn peek(&self, address: u32, size: Size) -> u32 {
        let offset = address & (SIZE as u32 - 1);
        read_part(self.word(offset & !3), offset, size)
    }

    /// A read from the information block, which no cache holds: number, flash
    /// size, option bytes; `None` for what nobody models.
    pub fn read_information(
        &mut self,
        signature: &super::uid::Signature,
        address: u32,
        size: Size,
        at: Cycle,
    ) -> Option<ReadResult> {
        let value = signature
            .read(address, size)
            .or_else(|| self.programming.option_byte(address, size))?;
        let wait = self.accelerator.read_array(at);
        Some(ReadResult { value, wait })
    }

    /// Counts up when the memory changed: decoded code is stale.
    pub const fn code_version(&self) -> u32 {
        self.code_version
    }

    /// Level of the FLASH interrupt, line 4.
    pub const fn interrupt(&self) -> bool {
        self.programming.interrupt()
    }

    /// The word at `offset`, a multiple of 4 below [`SIZE`].
    #[inline]
    fn word(&self, offset: u32) -> u32 {
        self.bytes
            .get(offset as usize..)
            .and_then(|bytes| bytes.first_chunk())
            .map_or(u32::MAX, |bytes| u32::from_le_bytes(*bytes))
    }
}
