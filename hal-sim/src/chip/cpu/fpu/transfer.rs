//! VLDR, VLDM, VPOP, VSTR, VSTM, VPUSH: consecutive words and S registers.

use crate::chip::cpu::{Bus, Cpu, Fault, Size, TrapResult};

/// What becomes of the base register.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Writeback {
    /// It stays.
    None,
    /// It goes up by the size of what is transferred.
    Up,
    /// It goes down by that.
    Down,
}

/// Registers `s`, `s` + 1, … from or to words at `n` + `offset` on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Transfer {
    /// First S register.
    pub s: u8,
    /// How many.
    pub count: u8,
    /// Base register; 15 is the instruction's address + 4, aligned.
    pub n: u8,
    /// What becomes of it.
    pub writeback: Writeback,
    /// Bytes from the base to the first word.
    pub offset: i16,
}

impl Transfer {
    fn registers(self) -> impl Iterator<Item = usize> {
        (self.s..self.s + self.count).map(|s| usize::from(s & 31))
    }
}

impl Cpu {
    /// Loads; 1 cycle and 1 a word (TRM table 7-1).
    pub(super) fn load_singles(&mut self, bus: &mut impl Bus, x: Transfer) -> TrapResult<u32> {
        let mut address = self.first_word(x)?;
        for s in x.registers() {
            self.registers.s[s] = self.load(bus, address, Size::Word)?;
            address = address.wrapping_add(4);
        }
        self.write_base(x);
        Ok(1 + u32::from(x.count))
    }

    /// Stores; 1 cycle and 1 a word (TRM table 7-1).
    pub(super) fn store_singles(&mut self, bus: &mut impl Bus, x: Transfer) -> TrapResult<u32> {
        let mut address = self.first_word(x)?;
        for s in x.registers() {
            self.store(bus, address, Size::Word, self.registers.s[s])?;
            address = address.wrapping_add(4);
        }
        self.write_base(x);
        Ok(1 + u32::from(x.count))
    }

    /// Unaligned addresses always fault.
    fn first_word(&self, x: Transfer) -> TrapResult<u32> {
        let base = self.registers.r[usize::from(x.n & 15)];
        let base = if x.n == 15 {
            base.wrapping_add(4) & !3
        } else {
            base
        };
        let address = base.wrapping_add_signed(x.offset.into());
        if address & 3 == 0 {
            Ok(address)
        } else {
            Err(Fault::Unaligned.into())
        }
    }

    fn write_base(&mut self, x: Transfer) {
        let size = u32::from(x.count) * 4;
        let base = &mut self.registers.r[usize::from(x.n & 15)];
        *base = match x.writeback {
            Writeback::None => *base,
            Writeback::Up => base.wrapping_add(size),
            Writeback::Down => base.wrapping_sub(size),
        };
    }
}
