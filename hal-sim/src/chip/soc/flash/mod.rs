//! Models the flash: 1 MiB, its accelerator, its programming (RM0090 chapter 3, F405).
//!
//! `lines` and `accelerator` compute the wait states, `programming` erases and writes, `registers`
//! is the register block. In: fetches, reads and writes with their cycle. Out: data, wait states,
//! an interrupt line.

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

/// Length of main memory, bytes.
pub const SIZE: usize = 1 << 20;
/// Address of main memory, which is also mapped at 0 when the chip boots from it.
pub const BASE: u32 = 0x0800_0000;

/// Error for a program that does not fit into the flash.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{length} bytes at {address:#010x} are not within the flash, 0x08000000-0x080fffff")]
pub struct OutsideFlash {
    /// First address of the program.
    pub address: u32,
    /// Length of the program in bytes.
    pub length: usize,
}

/// Whether a prefetched line enters the instruction cache when it is used. RM0090 section 3.5.2 can
/// be read in two ways, and no board has shown which is right (docs/how/chip.md, docs/evidence/hil.md).
/// Comparing both shows how much depends on it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Prefetched {
    /// The line enters the instruction cache. Only this reading agrees with the manual's statement
    /// that CoreMark runs as without wait states, and only with it does prefetch not slow loops
    /// down.
    #[default]
    Cached,
    /// The line does not enter the cache: the literal meaning of the sentence on misses, which
    /// excludes prefetched lines.
    NotCached,
}

impl Prefetched {
    /// Both readings, the default first.
    pub const ALL: [Self; 2] = [Self::Cached, Self::NotCached];
}

/// Flash memory and its interface.
#[derive(Clone, PartialEq, Debug)]
pub struct Flash {
    /// Contents. Clones of the chip share them until one of the clones writes.
    bytes: Arc<[u8]>,
    accelerator: Accelerator,
    programming: Programming,
    /// Contents before the operation in progress: offset and bytes.
    before: (usize, Vec<u8>),
    /// Seed of the random contents that a reset during programming or erasing leaves.
    pub seed: u64,
    hz: u32,
    code_version: u32,
}

impl Default for Flash {
    /// Returns an erased flash with registers in their reset state and a core clock of 16 MHz.
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
    /// Writes `bytes` at `address`, as a programmer would; takes no simulated time.
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

    /// Writes like [`Self::load`] into a chip that has already run: its caches are cleared.
    ///
    /// # Errors
    /// Fails like [`Self::load`].
    pub fn replace(&mut self, address: u32, bytes: &[u8]) -> Result<(), OutsideFlash> {
        self.load(address, bytes)?;
        self.accelerator.forget();
        Ok(())
    }

    /// Returns all bytes for writing; copies them first if clones of the chip share them.
    fn bytes_mut(&mut self) -> &mut [u8] {
        Arc::make_mut(&mut self.bytes)
    }

    /// Resets the interface; the memory stays. An operation in progress is aborted, and the bytes
    /// that it was changing are then undefined (RM0090 section 3.6.1). Assumed: each bit that was
    /// to change has changed or not, depending on `seed` and the time.
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

    /// Returns OPTCR: the option bytes.
    pub(super) const fn options(&self) -> u32 {
        self.programming.option_control()
    }

    /// Selects whether prefetched lines enter the instruction cache, about which the manual is
    /// ambiguous. The choice is kept over resets.
    pub const fn set_prefetched(&mut self, prefetched: Prefetched) {
        self.accelerator.set_prefetched(prefetched);
    }

    /// Removes all wait states from now on, regardless of the program's settings; kept over resets.
    /// Shows how much depends on wait states; no real board does this.
    pub const fn never_wait(&mut self) {
        self.accelerator.never_wait();
    }

    /// Sets the core clock to `hz` from cycle `at` on.
    pub fn set_hz(&mut self, hz: u32, at: Cycle) {
        if self.programming.is_busy(at) {
            let end = rescale(self.programming.end(), at, self.hz, hz);
            self.programming.end_at(end);
            self.accelerator.occupy_until(end);
        }
        self.hz = hz;
    }

    /// Inverts `bits` of ACR as a fault would, at a supply of `supply_mv`. Returns `false` if
    /// `offset` is another register.
    ///
    /// # Errors
    /// Fails like [`Self::check_known`].
    pub fn upset(&mut self, offset: u32, bits: u32, supply_mv: u32) -> Modelled<bool> {
        if offset != 0 {
            return Ok(false);
        }
        self.set_acr(self.accelerator.acr() ^ bits)?;
        self.check_known(supply_mv)?;
        Ok(true)
    }

    /// Checks whether LATENCY suffices in practice, outside the data sheet's limits. Assumed: with
    /// a supply of 2.7 V or more a read takes at most 25 ns, because Betaflight runs this chip at
    /// 240 MHz with 5 wait states.
    ///
    /// # Errors
    /// Fails if LATENCY is too small: the flash would deliver wrong code.
    pub fn check_known(&self, supply_mv: u32) -> Modelled {
        const PER_S: u64 = 40_000_000;
        let reads = u64::from(self.accelerator.latency + 1) * PER_S;
        match supply_mv >= 2700 && u64::from(self.hz) <= reads {
            true => Ok(()),
            false => self.check_wait_states(supply_mv),
        }
    }

    /// Checks whether LATENCY suffices for the core clock at a supply of `supply_mv` (RM0090 table
    /// 10).
    ///
    /// # Errors
    /// Fails if LATENCY is too small: the flash would deliver wrong code.
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

    /// Fetches code from the 16-byte line `line` at `at`, and returns the wait states. `line` is
    /// the address / 16, where the flash begins at 0 or at [`BASE`].
    #[inline(always)]
    pub fn fetch(&mut self, line: u32, at: Cycle) -> u32 {
        self.accelerator.fetch(line & (lines::COUNT as u32 - 1), at)
    }

    /// Reads data of `size` at `address`, which must be naturally aligned. The flash begins at 0
    /// and at [`BASE`].
    ///
    /// # Errors
    /// Fails if the data cache still holds the contents from before an erasure.
    #[inline]
    pub fn read(&mut self, address: u32, size: Size, at: Cycle) -> Result<ReadResult, AccessError> {
        let offset = address & (SIZE as u32 - 1);
        let wait = self.accelerator.read(offset >> 4, at).ok_or(Unmodelled(
            "FLASH: reading data that was cached before an erase",
        ))?;
        let value = self.word(offset & !3);
        Ok(ReadResult {
            value: read_part(value, offset, size),
            wait,
        })
    }

    /// Returns the contents at `address` for decoders and debuggers; takes no simulated time.
    pub fn peek(&self, address: u32, size: Size) -> u32 {
        let offset = address & (SIZE as u32 - 1);
        read_part(self.word(offset & !3), offset, size)
    }

    /// Reads from the information block, which is never cached: unique number, flash size, option
    /// bytes. Returns `None` for addresses that are not modelled.
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

    /// Returns a counter that grows with each change of the contents. Code that was decoded at
    /// another count is outdated.
    pub const fn code_version(&self) -> u32 {
        self.code_version
    }

    /// Returns the level of the FLASH interrupt, line 4.
    pub const fn interrupt(&self) -> bool {
        self.programming.interrupt()
    }

    /// Returns the word at `offset`, a multiple of 4 below [`SIZE`].
    #[inline]
    fn word(&self, offset: u32) -> u32 {
        self.bytes
            .get(offset as usize..)
            .and_then(|bytes| bytes.first_chunk())
            .map_or(u32::MAX, |bytes| u32::from_le_bytes(*bytes))
    }
}
