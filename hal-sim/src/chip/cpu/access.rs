//! Performs data accesses of instructions: checks alignment and the MPU, then uses the private bus,
//! a bit-band alias or the `Bus`.

use super::bit_band::Bit;
use super::bus::{AccessError, Unmodelled};
use super::system::{actlr, ccr};
use super::{Access, Bus, Cpu, Fault, Size, Trap, TrapResult};
use crate::chip::Cycle;

/// Start of the peripheral regions. An access to this address or above can cause an event.
const PERIPHERALS: u32 = 0x4000_0000;
/// End of the code memory, which stores do not change directly: only flash programming does.
const RAM: u32 = 0x1000_0000;
const EXCLUSIVE: AccessError =
    AccessError::Unmodelled(Unmodelled("an exclusive access to a bit-band alias"));
/// Upper 12 bits of the private peripheral bus, 0xE000_0000–0xE00F_FFFF.
const PRIVATE: u32 = 0xE00;

/// Returns whether `address` is on the core's private peripheral bus. The chip's debug support
/// (RM0090 table 1) is outside the core.
pub(in crate::chip) const fn is_private(address: u32) -> bool {
    address >> 20 == PRIVATE && address >> 12 != 0xE_0042
}

impl Cpu {
    /// Loads from `address`, and adds the wait states to `cycle`. Words and half-words may be
    /// unaligned (Arm ARM A3.2.1).
    #[inline(always)]
    pub(super) fn load(&mut self, bus: &mut impl Bus, address: u32, size: Size) -> TrapResult<u32> {
        self.load_as(bus, address, size, self.registers.is_privileged())
    }

    /// Stores to `address`, which may be unaligned. Wait states delay only the next access to the
    /// bus (one buffered store, TRM 3.5).
    #[inline(always)]
    pub(super) fn store(
        &mut self,
        bus: &mut impl Bus,
        address: u32,
        size: Size,
        value: u32,
    ) -> TrapResult {
        let privileged = self.registers.is_privileged();
        self.store_as(bus, address, size, value, privileged)
    }

    /// Loads from `address` like [`Self::load`], but faults if the address is unaligned, as LDM,
    /// LDRD, LDREX and VLDR do.
    #[inline(always)]
    pub(super) fn load_aligned(
        &mut self,
        bus: &mut impl Bus,
        address: u32,
        size: Size,
    ) -> TrapResult<u32> {
        Self::check_aligned(address, size)?;
        self.load_unsplit(bus, address, size, self.registers.is_privileged())
    }

    /// Stores to `address` like [`Self::store`], but faults if the address is unaligned.
    #[inline(always)]
    pub(super) fn store_aligned(
        &mut self,
        bus: &mut impl Bus,
        address: u32,
        size: Size,
        value: u32,
    ) -> TrapResult {
        Self::check_aligned(address, size)?;
        let privileged = self.registers.is_privileged();
        self.store_unsplit(bus, address, size, value, privileged)
    }

    #[inline(always)]
    fn load_unsplit(
        &mut self,
        bus: &mut impl Bus,
        address: u32,
        size: Size,
        privileged: bool,
    ) -> TrapResult<u32> {
        if !self.system.may_access(address, false, privileged) {
            return Err(Fault::DataAccess(address).into());
        }
        if self.system.is_watching() {
            self.check_watchpoints(address, size, false);
        }
        let start = self.cycle.wrapping_add(self.pipeline.phase);
        let at = start.max(self.pipeline.buffer);
        self.pipeline.phase = self.pipeline.phase.wrapping_add(1);
        if address >= PERIPHERALS {
            if is_private(address) {
                self.advance_by(at.wrapping_sub(start));
                return self.load_private(address, size, at, privileged);
            }
            self.deadline = 0;
        }
        if let Some(value) = bus.read_without_wait(address, size) {
            self.advance_by(at.wrapping_sub(start));
            return Ok(value);
        }
        let bit = Bit::from_alias(address, size);
        match bus.read(bit.map_or(address, |bit| bit.address), size, at) {
            Ok(read) => {
                self.advance_by(at.wrapping_sub(start).wrapping_add(read.wait.into()));
                Ok(bit.map_or(read.value, |bit| bit.read_from(read.value)))
            }
            Err(denied) => Err(self.trap_for_denied(denied, address, size, None)),
        }
    }

    /// Returns the fault or stop that follows from a failed access.
    #[cold]
    fn trap_for_denied(
        &self,
        denied: AccessError,
        address: u32,
        size: Size,
        written: Option<u32>,
    ) -> Trap {
        let access = Access {
            address,
            size,
            written,
        };
        Trap::from_data_access(denied, access, self.registers.r[15])
    }

    #[inline(always)]
    fn store_unsplit(
        &mut self,
        bus: &mut impl Bus,
        address: u32,
        size: Size,
        value: u32,
        privileged: bool,
    ) -> TrapResult {
        if !self.system.may_access(address, true, privileged) {
            return Err(Fault::DataAccess(address).into());
        }
        if self.system.is_watching() {
            self.check_watchpoints(address, size, true);
        }
        let start = self.cycle.wrapping_add(self.pipeline.phase);
        let at = start.max(self.pipeline.buffer);
        self.pipeline.phase = self.pipeline.phase.wrapping_add(1);
        self.advance_by(at.wrapping_sub(start));
        if !(RAM..PERIPHERALS).contains(&address) {
            self.deadline = 0;
            if is_private(address) {
                return self.store_private(address, size, value, at, privileged);
            }
        }
        if bus.write_without_wait(address, size, value) {
            self.pipeline.buffer = at.wrapping_add(1);
            return Ok(());
        }
        let written = match Bit::from_alias(address, size) {
            Some(bit) => bit.write(bus, size, value, at),
            None => bus.write(address, size, value, at),
        };
        match written {
            Ok(wait) => {
                let wait = Cycle::from(wait);
                self.pipeline.buffer = at.wrapping_add(1 + wait);
                if wait != 0 && self.system.disables(actlr::WRITE_BUFFER) {
                    self.cycle += wait;
                }
                Ok(())
            }
            Err(AccessError::Error) if !self.system.disables(actlr::WRITE_BUFFER) => {
                self.deadline = 0;
                Ok(self.imprecise_fault()?)
            }
            Err(denied) => Err(self.trap_for_denied(denied, address, size, Some(value))),
        }
    }

    /// Checks an access against the watchpoints of a debugger. A match ends the run after the
    /// present instruction.
    #[cold]
    #[inline(never)]
    fn check_watchpoints(&mut self, address: u32, size: Size, is_write: bool) {
        if self.system.check_access(address, size, is_write) {
            self.deadline = 0;
        }
    }

    #[inline(never)]
    fn load_private(
        &mut self,
        address: u32,
        size: Size,
        at: Cycle,
        privileged: bool,
    ) -> TrapResult<u32> {
        if !privileged {
            return Err(Fault::DataBus(address).into());
        }
        let read = self.system.read(address, size, at);
        read.map_err(|feature| self.trap_for_denied(feature.into(), address, size, None))
    }

    #[inline(never)]
    fn store_private(
        &mut self,
        address: u32,
        size: Size,
        value: u32,
        at: Cycle,
        privileged: bool,
    ) -> TrapResult {
        if !privileged && !self.system.may_write_unprivileged(address) {
            return Err(Fault::DataBus(address).into());
        }
        let written = self.system.write(address, size, value, at);
        written.map_err(|feature| self.trap_for_denied(feature.into(), address, size, Some(value)))
    }

    /// Returns the sizes of the aligned accesses that replace an unaligned one (TRM 3.3.2): a
    /// half-word becomes bytes; a word becomes half-words, or byte, half-word, byte.
    fn split_sizes(address: u32, size: Size) -> &'static [Size] {
        match (size, address & 1) {
            (Size::Word, 0) => &[Size::Half, Size::Half],
            (Size::Word, _) => &[Size::Byte, Size::Half, Size::Byte],
            _ => &[Size::Byte, Size::Byte],
        }
    }

    /// Refuses an exclusive access to a bit-band alias, which the core does not support (TRM 3.6).
    pub(super) fn check_exclusive(&self, address: u32, size: Size) -> TrapResult {
        match Bit::from_alias(address, size) {
            Some(_) => Err(self.trap_for_denied(EXCLUSIVE, address, size, None)),
            None => Ok(()),
        }
    }

    /// Returns a fault if the address is unaligned.
    pub(super) fn check_aligned(address: u32, size: Size) -> TrapResult {
        if address & (size.bytes() - 1) != 0 {
            return Err(Fault::Unaligned.into());
        }
        Ok(())
    }

    fn check_unaligned(&self, address: u32) -> TrapResult {
        // The private bus has no unaligned accesses (TRM 3.4.2).
        if self.system.is_configured(ccr::UNALIGNED_TRAP) || address >> 20 == PRIVATE {
            return Err(Fault::Unaligned.into());
        }
        Ok(())
    }

    /// Loads like [`Self::load`] with the rights of `privileged` or unprivileged code, for LDRT and
    /// similar instructions.
    #[inline(always)]
    pub(super) fn load_as(
        &mut self,
        bus: &mut impl Bus,
        address: u32,
        size: Size,
        privileged: bool,
    ) -> TrapResult<u32> {
        if address & (size.bytes() - 1) != 0 {
            return self.load_unaligned(bus, address, size, privileged);
        }
        self.load_unsplit(bus, address, size, privileged)
    }

    /// Stores like [`Self::store`] with the rights of `privileged` or unprivileged code, for STRT
    /// and similar instructions.
    #[inline(always)]
    pub(super) fn store_as(
        &mut self,
        bus: &mut impl Bus,
        address: u32,
        size: Size,
        value: u32,
        privileged: bool,
    ) -> TrapResult {
        if address & (size.bytes() - 1) != 0 {
            return self.store_unaligned(bus, address, size, value, privileged);
        }
        self.store_unsplit(bus, address, size, value, privileged)
    }

    #[inline(never)]
    fn load_unaligned(
        &mut self,
        bus: &mut impl Bus,
        address: u32,
        size: Size,
        privileged: bool,
    ) -> TrapResult<u32> {
        self.check_unaligned(address)?;
        let (mut value, mut shift) = (0, 0);
        let pieces = Self::split_sizes(address, size);
        for piece in pieces {
            let at = address.wrapping_add(shift / 8);
            value |= self.load_unsplit(bus, at, *piece, privileged)? << shift;
            shift += 8 * piece.bytes();
        }
        self.cycle += pieces.len() as Cycle - 1;
        self.pipeline.phase -= pieces.len() as Cycle - 1;
        Ok(value)
    }

    #[inline(never)]
    fn store_unaligned(
        &mut self,
        bus: &mut impl Bus,
        address: u32,
        size: Size,
        value: u32,
        privileged: bool,
    ) -> TrapResult {
        self.check_unaligned(address)?;
        let mut shift = 0;
        for piece in Self::split_sizes(address, size) {
            let at = address.wrapping_add(shift / 8);
            self.store_unsplit(bus, at, *piece, value >> shift, privileged)?;
            shift += 8 * piece.bytes();
        }
        // The write buffer hides the parts. A part that waits delays the next one and thus the
        // core, whereas a real core would continue.
        Ok(())
    }
}
