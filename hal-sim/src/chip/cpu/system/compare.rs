//! Models the comparators of the DWT that watch data (Arm ARM C1.8; TRM 8.1), which a debugger uses
//! to stop the core.
//!
//! In: the addresses of instructions' data accesses. Out: the first match since the last call.
//! Stacking by exceptions and DMA are not watched. Watching takes no time.

use crate::chip::cpu::Size;
use crate::chip::cpu::bus::{Modelled, Unmodelled};

/// Number of comparators of the DWT (data watchpoint and trace unit).
pub const COMPARATORS: usize = 4;

/// Bit MATCHED of FUNCTION.
const MATCHED: u32 = 1 << 24;

/// Kind of accesses that a comparator watches; the value is that of FUNCTION.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WatchedAccess {
    /// Loads only.
    Reads = 5,
    /// Stores only.
    Writes = 6,
    /// Loads and stores.
    Accesses = 7,
}

impl WatchedAccess {
    const fn has(self, is_write: bool) -> bool {
        match self {
            Self::Reads => !is_write,
            Self::Writes => is_write,
            Self::Accesses => true,
        }
    }
}

/// An access that matched a watchpoint.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct WatchpointHit {
    /// Address of the first byte that was both accessed and watched.
    pub address: u32,
    /// Kind of accesses that the comparator watches.
    pub what: WatchedAccess,
}

#[derive(Clone, Copy, PartialEq, Debug, Default)]
struct Comparator {
    /// Register COMP: start of the watched range.
    address: u32,
    /// Register MASK: log2 of the number of bytes watched.
    log2_bytes: u32,
    /// Kind of watched accesses in register FUNCTION; `None` if the comparator is off.
    what: Option<WatchedAccess>,
    is_matched: bool,
}

impl Comparator {
    /// Returns the first watched byte among the `bytes` accessed from `address` on, if there is
    /// one: "to enable matching an address wherever it appears on a bus" (DDI 0337, 11.6); a word's
    /// access has four bytes.
    const fn first_in(&self, address: u32, bytes: u32) -> Option<u32> {
        let start = self.address >> self.log2_bytes << self.log2_bytes;
        let before = start.wrapping_sub(address);
        if before < bytes {
            return Some(start);
        }
        let within = address.wrapping_sub(start);
        if within >> self.log2_bytes == 0 {
            return Some(address);
        }
        None
    }
}

/// All comparators of the DWT, and the first match. A system reset does not change them.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Comparators {
    comparators: [Comparator; COMPARATORS],
    hit: Option<WatchpointHit>,
}

impl Comparators {
    /// Returns whether any comparator watches accesses.
    pub fn has_watchpoints(&self) -> bool {
        self.comparators
            .iter()
            .any(|comparator| comparator.what.is_some())
    }

    /// Checks an instruction's access of `size` at `address`; returns whether it is watched.
    pub fn check_access(&mut self, address: u32, size: Size, is_write: bool) -> bool {
        let mut is_watched = false;
        for comparator in &mut self.comparators {
            let Some(what) = comparator.what.filter(|what| what.has(is_write)) else {
                continue;
            };
            if let Some(address) = comparator.first_in(address, size.bytes()) {
                comparator.is_matched = true;
                is_watched = true;
                self.hit.get_or_insert(WatchpointHit { address, what });
            }
        }
        is_watched
    }

    /// Takes the first match since the last call.
    pub const fn take_hit(&mut self) -> Option<WatchpointHit> {
        self.hit.take()
    }

    /// Uses one free comparator for each of `parts`, an address and the log2 of a number of bytes,
    /// unless that part is already watched. Returns `false` and changes nothing if too few are
    /// free.
    pub fn add(&mut self, parts: &[(u32, u32)], access: WatchedAccess) -> bool {
        let mut comparators = self.comparators;
        for &part in parts {
            if comparators
                .iter()
                .any(|comparator| comparator.is_of(part, access))
            {
                continue;
            }
            let free = comparators
                .iter_mut()
                .find(|comparator| comparator.what.is_none());
            let Some(free) = free else {
                return false;
            };
            *free = Comparator {
                address: part.0,
                log2_bytes: part.1,
                what: Some(access),
                is_matched: false,
            };
        }
        self.comparators = comparators;
        true
    }

    /// Frees the comparators that watch accesses of kind `access` to `parts`.
    pub fn remove(&mut self, parts: &[(u32, u32)], access: WatchedAccess) {
        for comparator in &mut self.comparators {
            if parts.iter().any(|&part| comparator.is_of(part, access)) {
                *comparator = Comparator::default();
            }
        }
    }

    /// Frees all comparators, and drops a match that was not taken.
    pub fn clear(&mut self) {
        *self = Self::default();
    }

    /// Reads the comparator register at `offset` from COMP0; returns `None` if there is none.
    /// Reading FUNCTION clears its bit MATCHED.
    pub fn read(&mut self, offset: u32) -> Option<u32> {
        let comparator = self.comparators.get_mut(offset as usize / 16)?;
        match offset & 0xF {
            0 => Some(comparator.address),
            4 => Some(comparator.log2_bytes),
            8 => {
                let matched = u32::from(std::mem::take(&mut comparator.is_matched)) * MATCHED;
                Some(matched | comparator.what.map_or(0, |what| what as u32))
            }
            _ => None,
        }
    }

    /// Writes the comparator register at `offset` from COMP0; returns `None` if there is none.
    pub fn write(&mut self, offset: u32, value: u32) -> Option<Modelled> {
        let comparator = self.comparators.get_mut(offset as usize / 16)?;
        match offset & 0xF {
            0 => comparator.address = value,
            4 => comparator.log2_bytes = value & 0xF,
            8 => {
                comparator.what = match value {
                    0 => None,
                    5 => Some(WatchedAccess::Reads),
                    6 => Some(WatchedAccess::Writes),
                    7 => Some(WatchedAccess::Accesses),
                    _ => {
                        return Some(Err(Unmodelled(
                            "a DWT_FUNCTION other than data watchpoints",
                        )));
                    }
                };
            }
            _ => return None,
        }
        Some(Ok(()))
    }
}

impl Comparator {
    fn is_of(&self, (address, log2_bytes): (u32, u32), access: WatchedAccess) -> bool {
        (self.address, self.log2_bytes) == (address, log2_bytes) && self.what == Some(access)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_access_is_watched_if_it_shares_a_byte() {
        let mut comparators = Comparators::default();
        assert!(comparators.add(&[(0x2000_0006, 1)], WatchedAccess::Writes));
        for (address, size, hit) in [
            (0x2000_0004, Size::Word, Some(0x2000_0006)),
            (0x2000_0006, Size::Half, Some(0x2000_0006)),
            (0x2000_0007, Size::Byte, Some(0x2000_0007)),
            (0x2000_0004, Size::Half, None),
            (0x2000_0005, Size::Byte, None),
            (0x2000_0008, Size::Word, None),
            (0x1FFF_FFFC, Size::Word, None),
        ] {
            assert_eq!(
                comparators.check_access(address, size, true),
                hit.is_some(),
                "{address:#x}"
            );
            assert_eq!(
                comparators.take_hit().map(|hit| hit.address),
                hit,
                "{address:#x}"
            );
            assert!(!comparators.check_access(address, size, false), "a read");
        }
        // The end of memory, and a large block.
        assert!(comparators.add(&[(u32::MAX, 0), (0x2001_8000, 15)], WatchedAccess::Reads));
        assert!(comparators.check_access(u32::MAX - 3, Size::Word, false));
        assert!(comparators.check_access(0x2001_FFFF, Size::Byte, false));
        assert!(!comparators.check_access(0x2002_0000, Size::Byte, false));
        let first = WatchpointHit {
            address: u32::MAX,
            what: WatchedAccess::Reads,
        };
        assert_eq!(
            (comparators.take_hit(), comparators.take_hit()),
            (Some(first), None)
        );
    }

    #[test]
    fn there_are_four() {
        let mut comparators = Comparators::default();
        let parts = [0, 4, 8, 12].map(|offset| (0x2000_0000 + offset, 2));
        assert!(comparators.add(&parts[..3], WatchedAccess::Accesses));
        assert!(!comparators.add(&[parts[3], (0x2000_0010, 2)], WatchedAccess::Accesses));
        assert!(
            comparators.add(&parts, WatchedAccess::Accesses),
            "three are watched already"
        );
        assert!(!comparators.add(&parts[..1], WatchedAccess::Reads));
        comparators.remove(&parts[1..2], WatchedAccess::Writes);
        assert!(!comparators.add(&parts[..1], WatchedAccess::Reads));
        comparators.remove(&parts[1..2], WatchedAccess::Accesses);
        assert!(comparators.add(&parts[..1], WatchedAccess::Reads));
        comparators.clear();
        assert!(!comparators.has_watchpoints());
    }

    #[test]
    fn the_registers_show_and_set_them() {
        let mut comparators = Comparators::default();
        assert!(comparators.add(&[(0x2000_0000, 2)], WatchedAccess::Writes));
        assert_eq!(
            [0, 4, 8].map(|at| comparators.read(at)),
            [Some(0x2000_0000), Some(2), Some(6)]
        );
        assert!(comparators.check_access(0x2000_0000, Size::Word, true));
        assert_eq!(comparators.take_hit().unwrap().address, 0x2000_0000);
        assert_eq!(
            [8, 8].map(|at| comparators.read(at)),
            [Some(6 | MATCHED), Some(6)]
        );
        for (offset, value) in [(0x30, 0x2000_0104), (0x34, 3), (0x38, 5)] {
            assert_eq!(comparators.write(offset, value), Some(Ok(())));
        }
        // Address bits below the mask do not count.
        assert!(comparators.check_access(0x2000_0100, Size::Byte, false));
        assert_eq!(comparators.take_hit().unwrap().address, 0x2000_0100);
        assert!(comparators.write(0x38, 4).unwrap().is_err());
        assert_eq!(
            (
                comparators.write(0x3C, 0),
                comparators.write(0x40, 0),
                comparators.read(0x3C)
            ),
            (None, None, None)
        );
    }
}
