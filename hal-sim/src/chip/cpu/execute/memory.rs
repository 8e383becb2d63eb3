//! Executes single and exclusive loads and stores (Arm ARM A7.7); cycles follow TRM 3.3.2.

use crate::chip::Cycle;
use crate::chip::cpu::instruction::{Index, Load, Reg};
use crate::chip::cpu::timing::{PipelineState, REFILL_LOAD, depends_on_last};
use crate::chip::cpu::{Bus, Cpu, Size, TrapResult};

/// Address of an access: base register, use of the offset, offset.
type Indexed = (Reg, Index, u32);

impl Load {
    const fn size(self) -> Size {
        match self {
            Self::Word => Size::Word,
            Self::Half | Self::SignedHalf => Size::Half,
            Self::Byte | Self::SignedByte => Size::Byte,
        }
    }

    /// Extends `value`, read from memory and zero-extended, by its sign if the load requires that.
    const fn extend(self, value: u32) -> u32 {
        match self {
            Self::SignedHalf => ((value << 16).cast_signed() >> 16).cast_unsigned(),
            Self::SignedByte => ((value << 24).cast_signed() >> 24).cast_unsigned(),
            _ => value,
        }
    }
}

impl Index {
    /// Returns the address of the access, and the new value of the base.
    pub const fn apply(self, base: u32, offset: u32) -> (u32, u32) {
        let moved = base.wrapping_add(offset);
        match self {
            Self::Offset => (moved, base),
            Self::Pre => (moved, moved),
            Self::Post => (base, moved),
        }
    }
}

impl Cpu {
    /// Sets the cycle of the first data phase of a load, and returns the number of cycles of the
    /// load. It takes two cycles; one less directly after another load; one more if the instruction
    /// before produced the address. After a load that produced the address both cancel out: the
    /// second load is just not pipelined.
    #[inline(always)]
    pub(super) fn begin_load(&mut self, last: PipelineState, hazard: u16) -> Cycle {
        let cycles = (2 + Cycle::from(hazard)).wrapping_sub(last.load().into());
        self.pipeline.phase = cycles.wrapping_sub(1);
        cycles
    }

    /// Sets the data phase of a store with a constant offset, which begins when the instruction is
    /// over. Returns the number of cycles of the store: one, plus a stall if data processing has
    /// just produced the address.
    #[inline(always)]
    fn begin_store(&mut self, last: PipelineState, hazard: u16) -> Cycle {
        let cycles = 1 + Cycle::from(hazard & !u16::from(last.load()));
        self.pipeline.phase = cycles;
        cycles
    }

    /// Executes a load with a constant offset into R0–R12 or R14.
    #[inline(always)]
    pub(super) fn load_simple(
        &mut self,
        bus: &mut impl Bus,
        last: PipelineState,
        t: Reg,
        n: Reg,
        imm: u32,
        size: Size,
    ) -> TrapResult {
        let cycles = self.begin_load(last, depends_on_last(last, n));
        let address = self.reg(n).wrapping_add(imm);
        let value = self.load(bus, address, size)?;
        self.set(t, value);
        self.advance_by(cycles);
        Ok(())
    }

    #[inline(always)]
    pub(super) fn store_simple(
        &mut self,
        bus: &mut impl Bus,
        last: PipelineState,
        t: Reg,
        n: Reg,
        imm: u32,
        size: Size,
    ) -> TrapResult {
        let cycles = self.begin_store(last, depends_on_last(last, n));
        let address = self.reg(n).wrapping_add(imm);
        self.store(bus, address, size, self.reg(t))?;
        self.advance_by(cycles);
        Ok(())
    }

    /// Executes a load from `address` into any register.
    #[allow(clippy::too_many_arguments)] // the fields of one encoding
    pub(super) fn load_single(
        &mut self,
        bus: &mut impl Bus,
        last: PipelineState,
        hazard: u16,
        kind: Load,
        t: Reg,
        address: u32,
        next: u32,
    ) -> TrapResult<u32> {
        let cycles = self.begin_load(last, hazard);
        let value = self.load(bus, address, kind.size())?;
        self.advance_by(cycles);
        if t == 15 {
            return self.load_to_pc(bus, value);
        }
        self.set_any(t, kind.extend(value));
        Ok(next)
    }

    /// Branches to the address that a load into R15 gives (LoadWritePC).
    pub(super) fn load_to_pc(&mut self, bus: &mut impl Bus, value: u32) -> TrapResult<u32> {
        self.interwork(bus, value, 0, REFILL_LOAD)
    }

    pub(super) fn load_indexed(
        &mut self,
        bus: &mut impl Bus,
        last: PipelineState,
        kind: Load,
        t: Reg,
        (n, index, imm): Indexed,
        next: u32,
    ) -> TrapResult<u32> {
        let (address, base) = index.apply(self.reg(n), imm);
        let cycles = self.begin_load(last, depends_on_last(last, n));
        let value = self.load(bus, address, kind.size())?;
        self.advance_by(cycles);
        self.set_any(n, base);
        if t == 15 {
            return self.load_to_pc(bus, value);
        }
        self.set_any(t, kind.extend(value));
        Ok(next)
    }

    /// Executes a store with a register offset: the address takes a cycle of its own, except
    /// directly after a load.
    pub(super) fn store_register(
        &mut self,
        bus: &mut impl Bus,
        last: PipelineState,
        size: Size,
        t: Reg,
        (n, m, shift): (Reg, Reg, u8),
        next: u32,
    ) -> TrapResult<u32> {
        let cycles = self.begin_load(last, depends_on_last(last, n) | depends_on_last(last, m));
        self.pipeline.phase = cycles;
        let address = self.reg(n).wrapping_add(self.reg(m) << (shift & 3));
        self.store(bus, address, size, self.reg(t))?;
        self.advance_by(cycles);
        Ok(next)
    }

    pub(super) fn store_indexed(
        &mut self,
        bus: &mut impl Bus,
        last: PipelineState,
        size: Size,
        t: Reg,
        (n, index, imm): Indexed,
        next: u32,
    ) -> TrapResult<u32> {
        let (address, base) = index.apply(self.reg(n), imm);
        let cycles = self.begin_store(last, depends_on_last(last, n));
        self.store(bus, address, size, self.reg(t))?;
        self.advance_by(cycles);
        self.set_any(n, base);
        Ok(next)
    }

    pub(super) fn load_unprivileged(
        &mut self,
        bus: &mut impl Bus,
        last: PipelineState,
        kind: Load,
        t: Reg,
        n: Reg,
        imm: u8,
    ) -> TrapResult {
        let cycles = self.begin_load(last, depends_on_last(last, n));
        let address = self.reg(n).wrapping_add(u32::from(imm));
        let value = self.load_as(bus, address, kind.size(), false)?;
        self.advance_by(cycles);
        self.set(t, kind.extend(value));
        Ok(())
    }

    pub(super) fn store_unprivileged(
        &mut self,
        bus: &mut impl Bus,
        last: PipelineState,
        size: Size,
        t: Reg,
        n: Reg,
        imm: u8,
    ) -> TrapResult {
        let cycles = self.begin_store(last, depends_on_last(last, n));
        let address = self.reg(n).wrapping_add(u32::from(imm));
        self.store_as(bus, address, size, self.reg(t), false)?;
        self.advance_by(cycles);
        Ok(())
    }

    /// Executes LDREX. The exclusive monitor, which it sets, covers all addresses (TRM 3.6).
    pub(super) fn load_exclusive(
        &mut self,
        bus: &mut impl Bus,
        last: PipelineState,
        size: Size,
        t: Reg,
        n: Reg,
        imm: u16,
    ) -> TrapResult {
        let cycles = self.begin_load(last, depends_on_last(last, n));
        let address = self.reg(n).wrapping_add(u32::from(imm));
        self.check_exclusive(address, size)?;
        let value = self.load_aligned(bus, address, size)?;
        self.advance_by(cycles);
        self.exclusive = true;
        self.set(t, value);
        Ok(())
    }

    /// Executes STREX, which stores only if the exclusive monitor is set. Takes as long as a load
    /// (TRM 3.3.2).
    pub(super) fn store_exclusive(
        &mut self,
        bus: &mut impl Bus,
        last: PipelineState,
        size: Size,
        d: Reg,
        t: Reg,
        (n, imm): (Reg, u16),
    ) -> TrapResult {
        let cycles = self.begin_load(last, depends_on_last(last, n));
        let address = self.reg(n).wrapping_add(u32::from(imm));
        self.check_exclusive(address, size)?;
        if self.exclusive {
            self.store_aligned(bus, address, size, self.reg(t))?;
        } else {
            Self::check_aligned(address, size)?;
        }
        self.advance_by(cycles);
        self.set(d, u32::from(!self.exclusive));
        self.exclusive = false;
        Ok(())
    }
}
