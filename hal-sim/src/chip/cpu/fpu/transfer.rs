//! Executes VLDR, VLDM, VPOP, VSTR, VSTM and VPUSH: transfers between consecutive words and S
//! registers.

use crate::chip::cpu::{Bus, Cpu, Fault, Size, TrapResult};

/// Change of the base register after a transfer of S registers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Writeback {
    /// The base register stays.
    None,
    /// The base register increases by the size of the transfer.
    Up,
    /// The base register decreases by the size of the transfer.
    Down,
}

/// Transfer between S registers `s`, `s` + 1, … and the words in memory from `n` + `offset` on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Transfer {
    /// Number of the first S register.
    pub s: u8,
    /// Number of S registers.
    pub count: u8,
    /// Base register; 15 is the instruction's address + 4, word-aligned.
    pub n: u8,
    /// Change of the base register after the transfer.
    pub writeback: Writeback,
    /// Offset from the base to the first word, bytes.
    pub offset: i16,
}

impl Transfer {
    fn registers(self) -> impl Iterator<Item = usize> {
        (self.s..self.s + self.count).map(|s| usize::from(s & 31))
    }
}

impl Cpu {
    /// Loads S registers; returns its cycles, 1 plus 1 per word (TRM table 7-1).
    pub(super) fn load_singles(&mut self, bus: &mut impl Bus, x: Transfer) -> TrapResult<u32> {
        let mut address = self.first_word(x)?;
        for s in x.registers() {
            self.registers.s[s] = self.load(bus, address, Size::Word)?;
            address = address.wrapping_add(4);
        }
        self.write_base(x);
        Ok(1 + u32::from(x.count))
    }

    /// Stores S registers; returns its cycles, 1 plus 1 per word (TRM table 7-1).
    pub(super) fn store_singles(&mut self, bus: &mut impl Bus, x: Transfer) -> TrapResult<u32> {
        let mut address = self.first_word(x)?;
        for s in x.registers() {
            self.store(bus, address, Size::Word, self.registers.s[s])?;
            address = address.wrapping_add(4);
        }
        self.write_base(x);
        Ok(1 + u32::from(x.count))
    }

    /// Returns the address of the first word; unaligned addresses always fault.
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
