//! Executes IT, hints, barriers, special registers, SVC and BKPT (Arm ARM A7.7, B5.2).

use crate::chip::cpu::instruction::Op;
use crate::chip::cpu::system::actlr;
use crate::chip::cpu::timing::{PipelineState, REFILL_REGISTER};
use crate::chip::cpu::{Bus, Cpu, Fault, Open, TrapResult};

/// Cycles of CPS, MRS and MSR: "1 or 2" (TRM table 3-1, without a rule). The larger value avoids
/// underestimating the load.
const SPECIAL_CYCLES: u32 = 2;

impl Cpu {
    #[rustfmt::skip]
    pub(super) fn execute_control(
        &mut self,
        bus: &mut impl Bus,
        op: Op,
        last: PipelineState,
        next: u32,
    ) -> TrapResult<u32> {
        match op {
            Op::It { state } => {
                self.registers.it = state;
                if last.length() == 2 && !self.system.disables(actlr::FOLDING) {
                    // IT is folded onto a 16-bit instruction (TRM table 3-1, note d).
                    self.pipeline.last = last;
                    return Ok(next);
                }
            }
            Op::WaitForInterrupt => {
                self.system.wait_for_interrupt();
                self.sleep(bus)?;
            }
            Op::WaitForEvent if self.system.wait_for_event() => self.sleep(bus)?,
            Op::SendEvent => self.system.send_event(),
            Op::ClearExclusive => self.exclusive = false,
            Op::SupervisorCall => {
                self.supervisor_call()?;
                self.deadline = 0;
            }
            Op::Breakpoint { immediate } => {
                self.breakpoint(bus, immediate)?;
                self.deadline = 0;
            }
            Op::ChangeState { disable, primask, faultmask } => {
                self.change_masks(disable, primask, faultmask);
                self.deadline = 0;
                self.spend(SPECIAL_CYCLES - 1);
            }
            Op::ReadSpecial { d, sysm } => {
                let value = self.read_special(sysm);
                self.set(d, value);
                self.spend(SPECIAL_CYCLES - 1);
            }
            Op::WriteSpecial { n, sysm, mask } => {
                self.write_special(sysm, mask, self.reg(n));
                self.deadline = 0;
                self.spend(SPECIAL_CYCLES - 1);
            }
            Op::DataBarrier => {
                // Waits for the write buffer (TRM 3.5); otherwise takes no time.
                self.cycle = self.cycle.max(self.pipeline.buffer.saturating_sub(1));
            }
            Op::InstructionBarrier => return Ok(self.branch_far(bus, next, 1, REFILL_REGISTER)),
            Op::Undefined => return Err(Fault::Undefined.into()),
            Op::NoCoprocessor => return Err(Fault::NoCoprocessor.into()),
            Op::Unpredictable => match self.open {
                Open::Stops => return Err(self.refuse(bus, "UNPREDICTABLE or not modelled")),
                Open::Undefined => return Err(Fault::Undefined.into()),
                Open::Nothing => {}
            },
            _ => {} // hints, and WFE with an event
        }
        self.advance_by(1);
        Ok(next)
    }

    /// Puts the core to sleep before the next instruction.
    fn sleep(&mut self, bus: &mut impl Bus) -> TrapResult {
        if self.system.sleeps_deep() {
            return Err(self.refuse(bus, "deep sleep (SCR.SLEEPDEEP) is not modelled"));
        }
        self.asleep = true;
        self.deadline = 0;
        Ok(())
    }
}
