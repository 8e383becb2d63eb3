//! Executes LDM, STM, PUSH, POP, LDRD and STRD (Arm ARM A7.7): 1 + N cycles each.

use crate::chip::Cycle;
use crate::chip::cpu::instruction::{Index, Reg};
use crate::chip::cpu::timing::{PipelineState, depends_on_last};
use crate::chip::cpu::{Bus, Cpu, Size, TrapResult};

/// Returns the lowest address of the words that LDM or STM transfers for the registers in `list`
/// (bit n is Rn), and the new value of the base register.
#[inline(always)]
const fn span(base: u32, down: bool, list: u16) -> (u32, u32) {
    let bytes = 4 * list.count_ones();
    if down {
        (base.wrapping_sub(bytes), base.wrapping_sub(bytes))
    } else {
        (base, base.wrapping_add(bytes))
    }
}

impl Cpu {
    /// Sets the first data phase of a transfer of several words; returns the number of cycles
    /// before it: one, plus a stall if data processing has just produced the address. Such
    /// transfers are not pipelined.
    #[inline(always)]
    fn begin_several(&mut self, last: PipelineState, hazard: u16) -> Cycle {
        let before = 1 + Cycle::from(hazard & !u16::from(last.load()));
        self.pipeline.phase = before;
        before
    }

    /// Loads a word for each register in `list` (bit n is Rn). The registers are written when all
    /// words have arrived, so that a fault leaves them unchanged.
    #[allow(clippy::too_many_arguments)] // the fields of one encoding
    pub(super) fn load_multiple(
        &mut self,
        bus: &mut impl Bus,
        last: PipelineState,
        n: Reg,
        writeback: bool,
        down: bool,
        list: u16,
        next: u32,
    ) -> TrapResult<u32> {
        let before = self.begin_several(last, depends_on_last(last, n));
        let (mut address, moved) = span(self.reg(n), down, list);
        let mut values = [0; 16];
        let mut left = list;
        while left != 0 {
            let value = self.load_aligned(bus, address, Size::Word)?;
            values[left.trailing_zeros() as usize & 15] = value;
            address = address.wrapping_add(4);
            left &= left - 1;
        }
        if writeback {
            self.set_any(n, moved);
        }
        left = list & 0x7FFF;
        while left != 0 {
            let t = left.trailing_zeros() as usize & 15;
            self.registers.r[t] = values[t];
            left &= left - 1;
        }
        self.advance_by(before + Cycle::from(list.count_ones()));
        if list & 0x8000 != 0 {
            return self.load_to_pc(bus, values[15]);
        }
        Ok(next)
    }

    #[allow(clippy::too_many_arguments)] // the fields of one encoding
    pub(super) fn store_multiple(
        &mut self,
        bus: &mut impl Bus,
        last: PipelineState,
        n: Reg,
        writeback: bool,
        down: bool,
        list: u16,
        next: u32,
    ) -> TrapResult<u32> {
        let before = self.begin_several(last, depends_on_last(last, n));
        let (mut address, moved) = span(self.reg(n), down, list);
        let mut left = list;
        while left != 0 {
            let value = self.registers.r[left.trailing_zeros() as usize & 15];
            self.store_aligned(bus, address, Size::Word, value)?;
            address = address.wrapping_add(4);
            left &= left - 1;
        }
        if writeback {
            self.set_any(n, moved);
        }
        self.advance_by(before + Cycle::from(list.count_ones()));
        Ok(next)
    }

    pub(super) fn load_pair(
        &mut self,
        bus: &mut impl Bus,
        last: PipelineState,
        hazard: u16,
        (t, t2): (Reg, Reg),
        address: u32,
    ) -> TrapResult {
        let before = self.begin_several(last, hazard);
        let low = self.load_aligned(bus, address, Size::Word)?;
        let high = self.load_aligned(bus, address.wrapping_add(4), Size::Word)?;
        self.advance_by(before + 2);
        self.set(t, low);
        self.set(t2, high);
        Ok(())
    }

    pub(super) fn load_dual(
        &mut self,
        bus: &mut impl Bus,
        last: PipelineState,
        pair: (Reg, Reg),
        (n, index, imm): (Reg, Index, u32),
        next: u32,
    ) -> TrapResult<u32> {
        let (address, base) = index.apply(self.reg(n), imm);
        self.load_pair(bus, last, depends_on_last(last, n), pair, address)?;
        if index != Index::Offset {
            self.set_any(n, base);
        }
        Ok(next)
    }

    pub(super) fn store_dual(
        &mut self,
        bus: &mut impl Bus,
        last: PipelineState,
        (t, t2): (Reg, Reg),
        (n, index, imm): (Reg, Index, u32),
        next: u32,
    ) -> TrapResult<u32> {
        let (address, base) = index.apply(self.reg(n), imm);
        let before = self.begin_several(last, depends_on_last(last, n));
        self.store_aligned(bus, address, Size::Word, self.reg(t))?;
        self.store_aligned(bus, address.wrapping_add(4), Size::Word, self.reg(t2))?;
        self.advance_by(before + 2);
        if index != Index::Offset {
            self.set_any(n, base);
        }
        Ok(next)
    }
}
