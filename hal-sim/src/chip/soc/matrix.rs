//! Models the bus matrix (RM0090 2.1): which master waits for which, and for how long.
//!
//! Each slave serves one access at a time and stays granted to its last master. Exact according to
//! the manuals: different slaves never delay one another, AHB slaves answer without wait states,
//! masters take turns (RM0090 2.1.10), and a change of master costs one cycle (AN4031 tables 4 and
//! 5, bus matrix arbitration). Approximate: an APB access costs one cycle into the bridge, then two
//! APB cycles from the next APB clock edge (AN4031 table 4; the phase of the APB clocks is unknown
//! and assumed to start at cycle 0), a write costs as much as a read, and the bridge occupies the
//! whole AHB1 slave meanwhile.

use crate::chip::Cycle;

/// Bus master that requests an access.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Master {
    /// D-bus or S-bus of the core.
    Core,
    /// Memory port of DMA2.
    Dma2Memory,
    /// Peripheral port of DMA2.
    Dma2Peripheral,
}

/// Bus slave that answers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Slave {
    /// SRAM1, 112 KiB.
    Sram1,
    /// SRAM2, 16 KiB.
    Sram2,
    /// AHB1 peripherals: GPIO, DMA, RCC. The APB bridges are connected here too.
    Ahb1,
}

/// Bridge through which the core reaches a block on the AHB1 slave.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Bridge {
    /// No bridge: the block is on AHB1 itself.
    None,
    /// Bridge to the peripherals on APB1.
    Apb1,
    /// Bridge to the peripherals on APB2.
    Apb2,
}

#[derive(Clone, Copy, PartialEq, Debug)]
struct State {
    /// First cycle in which the slave can begin an access.
    free: Cycle,
    owner: Master,
}

/// Bus matrix: the slaves that both the core and DMA2 access in the images, with the use of each.
#[derive(Clone, PartialEq, Debug)]
pub struct Matrix {
    slaves: [State; 3],
    /// HCLK cycles per APB1 and APB2 cycle.
    apb: [u32; 2],
}

impl Default for Matrix {
    fn default() -> Self {
        Self {
            slaves: [State {
                free: 0,
                owner: Master::Core,
            }; 3],
            apb: [1; 2],
        }
    }
}

impl Matrix {
    /// Sets the HCLK cycles per APB1 and APB2 cycle: 1, 2, 4, 8, 16 (RCC_CFGR PPRE).
    pub fn set_apb(&mut self, apb1: u32, apb2: u32) {
        self.apb = [apb1.max(1), apb2.max(1)];
    }

    /// Removes the traces of accesses that ended by `at`. They can no longer delay others, and
    /// without them the states of two chips can be compared.
    pub fn forget(&mut self, at: Cycle) {
        for slave in &mut self.slaves {
            slave.free = slave.free.max(at);
        }
    }

    /// Returns the first cycle from `want` on in which `slave` can begin an access.
    #[inline]
    pub fn ready_at(&self, slave: Slave, want: Cycle) -> Cycle {
        want.max(self.slaves[slave as usize].free)
    }

    /// Returns the last master of `slave`. It has to wait if another master requests the slave in
    /// the same cycle.
    #[inline]
    pub fn last_master(&self, slave: Slave) -> Master {
        self.slaves[slave as usize].owner
    }

    /// Grants `slave` to `master` for one cycle, at `want` or as soon as the slave is free. Returns
    /// the cycle from which the access is complete.
    #[inline]
    pub fn grant(&mut self, slave: Slave, master: Master, want: Cycle) -> Cycle {
        let state = &mut self.slaves[slave as usize];
        let start = want.max(state.free) + Cycle::from(state.owner != master);
        *state = State {
            free: start + 1,
            owner: master,
        };
        start + 1
    }

    /// Grants the core an access to `slave` through `bridge`, at `want` or as soon as the slave is
    /// free. Returns the cycle from which the access is complete.
    pub fn grant_core(&mut self, slave: Slave, bridge: Bridge, want: Cycle) -> Cycle {
        let done = self.grant(slave, Master::Core, want);
        let divider = match bridge {
            Bridge::None => return done,
            Bridge::Apb1 => self.apb[0],
            Bridge::Apb2 => self.apb[1],
        };
        // A power of two, like all prescalers of RCC_CFGR.
        let divider = Cycle::from(divider);
        let done = ((done + divider - 1) & !(divider - 1)) + 2 * divider;
        self.slaves[slave as usize].free = done;
        done
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_master_that_stays_waits_for_nothing() {
        let mut matrix = Matrix::default();
        assert_eq!(matrix.grant(Slave::Sram2, Master::Core, 10), 11);
        assert_eq!(matrix.grant(Slave::Sram2, Master::Core, 11), 12);
    }

    #[test]
    fn a_change_of_master_costs_a_cycle_and_a_busy_slave_more() {
        let mut matrix = Matrix::default();
        assert_eq!(matrix.grant(Slave::Sram2, Master::Dma2Memory, 10), 12);
        assert_eq!(matrix.grant(Slave::Sram2, Master::Dma2Memory, 12), 13);
        assert_eq!(matrix.grant(Slave::Sram2, Master::Core, 12), 15);
        assert_eq!(matrix.grant(Slave::Ahb1, Master::Core, 12), 13);
    }

    #[test]
    fn a_bridge_holds_ahb1_for_two_apb_cycles_from_an_apb_edge() {
        let mut matrix = Matrix::default();
        matrix.set_apb(4, 2);
        assert_eq!(matrix.grant_core(Slave::Ahb1, Bridge::Apb1, 0), 4 + 8);
        assert_eq!(matrix.grant_core(Slave::Ahb1, Bridge::Apb2, 12), 14 + 4);
        // DMA waits for the bridge, then for the change of master.
        assert_eq!(matrix.grant(Slave::Ahb1, Master::Dma2Peripheral, 13), 20);
    }
}
