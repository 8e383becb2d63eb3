//! Models the waits of floating-point instructions (TRM section 7.2.3).
//!
//! An arithmetic result can be used one cycle after its instruction is over, as an addend at once.
//! During VDIV and VSQRT, integer instructions continue; the next floating-point instruction waits
//! until they are over. Approximate: VLDR and VSTR are not pipelined with their neighbours, because
//! the manual's table of cycles has no such note.

use super::{PipelineState, depends_on_last};
use crate::chip::Cycle;
use crate::chip::cpu::fpu::{Arithmetic, Op, Transfer, Unary};
use crate::chip::cpu::system::actlr;
use crate::chip::cpu::{Bus, Cpu, TrapResult};

/// Timing state of the floating-point unit.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Floating {
    /// Cycle from which on the unit accepts the next instruction.
    free: Cycle,
    /// Number of the S register that the last arithmetic instruction computed.
    result: u8,
    /// Cycle from which on the register `result` can be used as an operand.
    ready: Cycle,
}

/// Returns the number of the S register that `op` computes by arithmetic. Conversions count, but
/// moves and changes of sign do not.
const fn result(op: &Op) -> Option<u8> {
    match *op {
        Op::Arithmetic(_, d, _, _) => Some(d),
        Op::Unary(Unary::Copy | Unary::Absolute | Unary::Negate, _, _) => None,
        Op::Unary(_, d, _) => Some(d),
        _ => None,
    }
}

/// Returns whether `op` needs S register `s` when it begins. An addend does not count, because it
/// is needed only a cycle later.
fn needs(op: &Op, s: u8) -> bool {
    match *op {
        Op::Arithmetic(_, _, n, m) => s == n || s == m,
        Op::Unary(_, _, m) => s == m,
        Op::Compare { d, m, .. } => s == d || m == Some(s),
        Op::ToCore { s: from, .. } => s == from,
        Op::ToCorePair { s: from, .. } => s == from || s == from + 1,
        Op::Store(Transfer { s: from, count, .. }) => s >= from && s - from < count,
        _ => false,
    }
}

/// Returns whether integer instructions can execute during `op`.
const fn is_long(op: &Op) -> bool {
    matches!(
        op,
        Op::Arithmetic(Arithmetic::Divide, ..) | Op::Unary(Unary::SquareRoot, ..)
    )
}

impl Cpu {
    /// Executes `op` once the unit and its operands are available.
    #[inline]
    pub(in crate::chip::cpu) fn execute_floating(
        &mut self,
        bus: &mut impl Bus,
        op: Op,
        last: PipelineState,
    ) -> TrapResult {
        let unit = &self.pipeline.floating;
        let mut start = self.cycle.max(unit.free);
        if start < unit.ready && needs(&op, unit.result) {
            start = unit.ready;
        }
        if let Op::Load(transfer) | Op::Store(transfer) = op {
            // Every load and store has the address stall (TRM 3.3.2).
            start += Cycle::from(depends_on_last(last, transfer.n) & !u16::from(last.load()));
        }
        self.cycle = start;
        self.pipeline.phase = 1;
        let cycles = Cycle::from(self.execute_fpu(bus, op)?);
        let over = self.cycle + cycles;
        self.cycle = over;
        let unit = &mut self.pipeline.floating;
        if let Some(result) = result(&op) {
            unit.result = result;
            unit.ready = over + 1;
        }
        if is_long(&op) && !self.system.disables(actlr::OUT_OF_ORDER_FP) {
            self.pipeline.floating.free = over;
            self.cycle = over - cycles + 1;
        }
        Ok(())
    }
}
