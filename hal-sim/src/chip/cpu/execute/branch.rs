//! Executes branches to addresses from registers or memory (Arm ARM A2.3.1, A7.7).

use crate::chip::Cycle;
use crate::chip::cpu::instruction::Reg;
use crate::chip::cpu::timing::{PipelineState, REFILL_LOAD, REFILL_REGISTER, depends_on_last};
use crate::chip::cpu::{Bus, Cpu, Fault, Size, TrapResult};

impl Cpu {
    /// Branches to `value`, whose bit 0 must be the Thumb bit, after `before` cycles and a refill.
    /// In a handler, a value of 0xF… returns from the exception instead (BXWritePC).
    pub(super) fn interwork(
        &mut self,
        bus: &mut impl Bus,
        value: u32,
        before: u8,
        refill: u8,
    ) -> TrapResult<u32> {
        if value >> 28 == 0xF && self.registers.exception != 0 {
            self.cycle += Cycle::from(before);
            return self.leave_handler(bus, value);
        }
        let target = self.branch_far(bus, value & !1, before, refill);
        if value & 1 == 0 {
            self.registers.r[15] = target;
            return Err(Fault::InvalidState.into());
        }
        Ok(target)
    }

    fn leave_handler(&mut self, bus: &mut impl Bus, value: u32) -> TrapResult<u32> {
        self.return_from_exception(bus, value)?;
        self.exclusive = false;
        self.deadline = 0;
        Ok(self.registers.r[15])
    }

    pub(in crate::chip::cpu) fn branch_exchange(
        &mut self,
        bus: &mut impl Bus,
        value: u32,
    ) -> TrapResult<u32> {
        self.interwork(bus, value, 1, REFILL_REGISTER)
    }

    pub(super) fn branch_link_exchange(
        &mut self,
        bus: &mut impl Bus,
        value: u32,
        next: u32,
    ) -> TrapResult<u32> {
        self.set(14, next | 1);
        let target = self.branch_far(bus, value & !1, 1, REFILL_REGISTER);
        if value & 1 == 0 {
            self.registers.r[15] = target;
            return Err(Fault::InvalidState.into());
        }
        Ok(target)
    }

    /// Branches to `value`, whose bit 0 is ignored (BranchWritePC).
    pub(super) fn branch_register(&mut self, bus: &mut impl Bus, value: u32) -> u32 {
        self.branch_far(bus, value & !1, 1, REFILL_REGISTER)
    }

    /// Executes TBB and TBH: two cycles to load, one to add, three to refill (TRM 3.3.2).
    pub(super) fn table_branch(
        &mut self,
        bus: &mut impl Bus,
        last: PipelineState,
        n: Reg,
        m: Reg,
        half: bool,
    ) -> TrapResult<u32> {
        let pc = self.registers.r[15].wrapping_add(4);
        let base = if n == 15 { pc } else { self.reg(n) };
        let index = self.reg(m);
        let hazard = depends_on_last(last, n) | depends_on_last(last, m);
        let cycles = self.begin_load(last, hazard);
        let entry = if half {
            self.load(bus, base.wrapping_add(index << 1), Size::Half)?
        } else {
            self.load(bus, base.wrapping_add(index), Size::Byte)?
        };
        self.cycle += cycles;
        Ok(self.branch_far(bus, pc.wrapping_add(2 * entry), 1, REFILL_LOAD))
    }
}
