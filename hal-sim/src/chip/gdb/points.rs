//! Manages breakpoints and watchpoints of a debugger.
//!
//! The limits are those of the chip: six hardware breakpoints, which compare addresses of code
//! below 0x2000_0000 (Arm ARM C1.11, FPB version 1; TRM 9.1), and four comparators of data (TRM
//! 8.1). Software breakpoints have no limit: no instruction is replaced, so flash may have any
//! number, as with the "flash breakpoints" of probes.

use super::refused::GdbRefusal;
use crate::chip::cpu::Observer;
use crate::chip::cpu::system::{System, WatchedAccess};

/// Number of instruction comparators of the FPB (flash patch and breakpoint unit; TRM 9.1), one for
/// each hardware breakpoint.
const HARDWARE: usize = 6;
/// End of the addresses that the FPB's comparators can compare.
const CODE_END: u32 = 0x2000_0000;
/// The log2 of the largest number of bytes that one data comparator covers (DDI 0337, 11.6: MASK
/// has four bits).
const WIDEST: u32 = 15;

/// Kind of the breakpoint that stops the core.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StopReason {
    /// Software breakpoint, set by `Z0`.
    Software,
    /// Hardware breakpoint, set by `Z1`.
    Hardware,
}

/// Breakpoints of the core, and its state after a resume.
#[derive(Clone, Debug, Default)]
pub struct Points {
    at: Vec<(u32, StopReason)>,
    /// Whether the core was resumed and has not executed an instruction since. A breakpoint at its
    /// present address is then the one that stopped the core, and must not stop it again.
    pub(super) leaves: bool,
}

impl Observer for Points {
    #[inline]
    fn stops_before(&mut self, pc: u32) -> bool {
        !self.at.is_empty() && self.at.iter().any(|&(at, _)| at == pc)
    }
}

impl Points {
    /// Sets a breakpoint of kind `by` at `address`; does nothing if it is already set.
    ///
    /// # Errors
    /// Fails for a seventh hardware breakpoint, or one outside code.
    pub fn add(&mut self, address: u32, by: StopReason) -> Result<(), GdbRefusal> {
        let point = (address & !1, by);
        if self.at.contains(&point) {
            return Ok(());
        }
        let is_hardware = |point: &&(u32, StopReason)| point.1 == StopReason::Hardware;
        if by == StopReason::Hardware && address >= CODE_END {
            return Err(GdbRefusal::Address(
                "hardware breakpoints (FPB) work below 0x20000000 only",
            ));
        }
        if by == StopReason::Hardware && self.at.iter().filter(is_hardware).count() == HARDWARE {
            return Err(GdbRefusal::Full(
                "all six breakpoint comparators are in use",
            ));
        }
        self.at.push(point);
        Ok(())
    }

    /// Removes the breakpoint of kind `by` at `address`, if it is set.
    pub fn remove(&mut self, address: u32, by: StopReason) {
        self.at.retain(|&point| point != (address & !1, by));
    }

    /// Returns the kind of the breakpoint at `address`, if there is one.
    pub fn at(&self, address: u32) -> Option<StopReason> {
        let found = self.at.iter().find(|point| point.0 == address);
        found.map(|point| point.1)
    }

    /// Removes all breakpoints.
    pub fn clear(&mut self) {
        *self = Self::default();
    }
}

/// Watches accesses of kind `access` to `bytes` bytes from `address` on, with as many comparators as
/// needed; does nothing if they are already watched.
///
/// # Errors
/// Fails if too few comparators are free.
pub fn watch(
    system: &mut System,
    address: u32,
    bytes: u32,
    access: WatchedAccess,
) -> Result<(), GdbRefusal> {
    match system.add_watchpoint(&parts(address, bytes)?, access) {
        true => Ok(()),
        false => Err(GdbRefusal::Full(
            "not enough of the four DWT comparators are free",
        )),
    }
}

/// Removes the watchpoint on accesses of kind `access` to `bytes` bytes from `address` on.
///
/// # Errors
/// Fails if the range is empty or extends beyond the address space.
pub fn unwatch(
    system: &mut System,
    address: u32,
    bytes: u32,
    access: WatchedAccess,
) -> Result<(), GdbRefusal> {
    system.remove_watchpoint(&parts(address, bytes)?, access);
    Ok(())
}

/// Splits a range into parts that one comparator each can watch: aligned powers of two, given as
/// address and log2 of the length. More parts than there are comparators mean that the range is too
/// large.
fn parts(address: u32, bytes: u32) -> Result<Vec<(u32, u32)>, GdbRefusal> {
    let last = bytes.checked_sub(1).ok_or(GdbRefusal::Malformed)?;
    let last = address.checked_add(last);
    let last = last.ok_or(GdbRefusal::Address(
        "the range extends beyond the end of the address space",
    ))?;
    let (mut from, mut parts) = (address, Vec::new());
    while parts.len() <= System::COMPARATORS {
        let log2 = from.trailing_zeros().min(WIDEST);
        let left = (last - from).saturating_add(1);
        let log2 = log2.min(left.ilog2()); // at least 1 byte is left
        parts.push((from, log2));
        match from.checked_add(1 << log2) {
            Some(next) if next <= last => from = next,
            _ => break,
        }
    }
    Ok(parts)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_range_is_covered_by_aligned_powers_of_two() {
        for (address, bytes, wanted) in [
            (0x2000_0000, 4, vec![(0x2000_0000, 2)]),
            (0x2000_0003, 1, vec![(0x2000_0003, 0)]),
            (0x2000_0004, 8, vec![(0x2000_0004, 2), (0x2000_0008, 2)]),
            (
                0x2000_0001,
                4,
                vec![(0x2000_0001, 0), (0x2000_0002, 1), (0x2000_0004, 0)],
            ),
            (0x2000_0000, 0x8000, vec![(0x2000_0000, 15)]),
            (
                0x2000_0000,
                0x1_0000,
                vec![(0x2000_0000, 15), (0x2000_8000, 15)],
            ),
            (u32::MAX, 1, vec![(u32::MAX, 0)]),
        ] {
            assert_eq!(parts(address, bytes), Ok(wanted), "{address:#x} {bytes}");
        }
        assert_eq!(parts(0, u32::MAX).unwrap().len(), System::COMPARATORS + 1);
        assert_eq!(parts(0, 0), Err(GdbRefusal::Malformed));
        assert!(parts(u32::MAX, 2).is_err());
    }

    #[test]
    fn there_are_six_hardware_breakpoints_for_code_and_any_number_of_others() {
        let mut points = Points::default();
        for n in 0..6 {
            points
                .add(0x0800_0000 + 2 * n, StopReason::Hardware)
                .unwrap();
        }
        points.add(0x0800_0001, StopReason::Hardware).unwrap(); // is already set
        assert!(matches!(
            points.add(0x0800_0100, StopReason::Hardware),
            Err(GdbRefusal::Full(_))
        ));
        assert!(matches!(
            points.add(0x2000_0000, StopReason::Hardware),
            Err(GdbRefusal::Address(_))
        ));
        for n in 0..100 {
            points
                .add(0x0800_1000 + 2 * n, StopReason::Software)
                .unwrap();
        }
        points.remove(0x0800_0002, StopReason::Hardware);
        points.remove(0x0800_0002, StopReason::Hardware);
        points.add(0x0800_0100, StopReason::Hardware).unwrap();
        assert_eq!(points.at(0x0800_0100), Some(StopReason::Hardware));
        assert_eq!(
            (points.at(0x0800_1000), points.at(0x0800_0002)),
            (Some(StopReason::Software), None)
        );
        assert!(points.stops_before(0x0800_1000) && !points.stops_before(0x0800_0002));
    }
}
