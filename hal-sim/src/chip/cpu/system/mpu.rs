//! Models memory protection (Arm ARM B3.5): eight regions over the default map.

use std::ops::Range;

const REGIONS: usize = 8;
const ENABLE: u32 = 1;
const HFNMIENA: u32 = 1 << 1;
const PRIVDEFENA: u32 = 1 << 2;

/// Value of MPU_TYPE: eight unified regions.
const TYPE: u32 = (REGIONS as u32) << 8;

/// Kind of an access to memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AccessKind {
    /// A load of data.
    Read,
    /// A store of data.
    Write,
    /// A fetch of an instruction.
    Execute,
}

#[derive(Clone, Copy, PartialEq, Debug, Default)]
struct Region {
    base: u32,
    attributes: u32,
}

impl Region {
    const fn is_enabled(self) -> bool {
        self.attributes & 1 != 0
    }

    /// Returns the log2 of the region's size in bytes.
    const fn log2_bytes(self) -> u32 {
        (self.attributes >> 1 & 0x1F) + 1
    }

    const fn first(self) -> u64 {
        let log2 = self.log2_bytes();
        (self.base as u64) >> log2 << log2
    }

    const fn end(self) -> u64 {
        self.first() + (1 << self.log2_bytes())
    }

    /// Returns whether the region is enabled and `address` is in a sub-region that is not disabled.
    const fn contains(self, address: u32) -> bool {
        let address = address as u64;
        let log2 = self.log2_bytes();
        if !self.is_enabled() || address < self.first() || address >= self.end() {
            return false;
        }
        if log2 < 8 {
            return true;
        }
        let sub = (address - self.first()) >> (log2 - 3);
        self.attributes >> (8 + sub) & 1 == 0
    }

    /// Returns whether the region's permission allows the access (Arm ARM table B3-15); the
    /// reserved code 4 denies it.
    const fn allows(self, access: AccessKind, privileged: bool) -> bool {
        let permission = self.attributes >> 24 & 7;
        let read = match permission {
            1 | 5 => privileged,
            2 | 3 | 6 | 7 => true,
            _ => false,
        };
        match access {
            AccessKind::Read => read,
            AccessKind::Write => match permission {
                1 | 2 => privileged,
                3 => true,
                _ => false,
            },
            AccessKind::Execute => read && self.attributes >> 28 & 1 == 0,
        }
    }
}

/// State of the memory protection unit, with a cache of accessible memory.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Mpu {
    control: u32,
    number: usize,
    regions: [Region; REGIONS],
    /// Whether the execution priority is negative; HFNMIENA then decides whether the MPU is on.
    negative_priority: bool,
    /// Memory that privileged code may access without a look-up of regions. An access is compared
    /// with these ranges one after the other.
    open: [Open; OPEN],
    is_on: bool,
    /// Setting of the MPU before the present one, with its ranges, so that a switch back needs no
    /// look-up.
    before: Option<([Region; REGIONS], u32, [Open; OPEN])>,
    /// Setting of the MPU (regions and control register) from which `open` was computed.
    prepared: ([Region; REGIONS], u32),
}

/// Number of ranges that an access is compared with before regions are looked up.
const OPEN: usize = 6;

/// Range of memory in which privileged code may read data, or read and write them.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
struct Open {
    first: u32,
    bytes: u64,
    is_writable: bool,
}

impl Mpu {
    /// Returns whether the MPU allows a data access at `address`; `write` selects a store.
    #[inline]
    pub fn may_access(&self, address: u32, write: bool, privileged: bool) -> bool {
        if !self.is_on {
            return true;
        }
        for open in &self.open {
            if privileged
                && u64::from(address.wrapping_sub(open.first)) < open.bytes
                && (open.is_writable || !write)
            {
                return true;
            }
        }
        let access = if write {
            AccessKind::Write
        } else {
            AccessKind::Read
        };
        self.look_up(address, access, privileged)
    }

    /// Returns whether the MPU and the memory map allow fetching code at `address`.
    pub fn may_execute(&self, address: u32, privileged: bool) -> bool {
        let by_map = !matches!(address >> 29, 2 | 5..);
        by_map && (!self.is_on || self.look_up(address, AccessKind::Execute, privileged))
    }

    #[cold]
    fn look_up(&self, address: u32, access: AccessKind, privileged: bool) -> bool {
        // The private bus keeps its default map.
        if address >> 20 == 0xE00 {
            return true;
        }
        let regions = self.regions.iter().rev();
        match regions.into_iter().find(|region| region.contains(address)) {
            Some(region) => region.allows(access, privileged),
            None => privileged && self.control & PRIVDEFENA != 0,
        }
    }

    /// Notes that the execution priority became negative, or no longer is.
    pub fn set_negative_priority(&mut self, negative: bool) {
        if negative != self.negative_priority {
            self.negative_priority = negative;
            self.prepare();
        }
    }

    fn prepare(&mut self) {
        self.is_on =
            self.control & ENABLE != 0 && (!self.negative_priority || self.control & HFNMIENA != 0);
        if !self.is_on || self.prepared == (self.regions, self.control) {
            return;
        }
        let (regions, control) = self.prepared;
        let last = Some((regions, control, self.open));
        match std::mem::replace(&mut self.before, last) {
            Some((regions, control, open))
                if (regions, control) == (self.regions, self.control) =>
            {
                self.open = open;
            }
            _ => self.find_uniform_ranges(),
        }
        self.prepared = (self.regions, self.control);
    }

    /// Returns the range of addresses of the region with the highest number, among the regions that
    /// deny all access; `None` if no region does.
    pub fn denied_range(&self) -> Option<Range<u64>> {
        let is_denied = |region: &&Region| {
            let denies =
                !region.allows(AccessKind::Read, true) && !region.allows(AccessKind::Write, true);
            region.is_enabled() && denies
        };
        let region = self.regions.iter().rev().find(is_denied)?;
        Some(region.first()..region.end())
    }

    /// Computes `open`. Between two neighbouring bounds of regions, all addresses have the same
    /// permission. The largest ranges are kept; addresses outside them are looked up.
    fn find_uniform_ranges(&mut self) {
        let mut bounds = vec![0, 0xE000_0000, 0xE010_0000, 1 << 32];
        for region in self.regions.iter().filter(|region| region.is_enabled()) {
            let (first, eighth) = (region.first(), (region.end() - region.first()) / 8);
            bounds.extend((0..=8).map(|n| first + n * eighth));
        }
        self.open = [Open::default(); OPEN];
        bounds.sort_unstable();
        bounds.dedup();
        let mut open: Vec<Open> = Vec::new();
        for pair in bounds.windows(2) {
            let (first, bytes) = (pair[0] as u32, pair[1] - pair[0]);
            let may = |access| self.look_up(first, access, true);
            let is_writable = may(AccessKind::Write);
            match open.last_mut() {
                _ if !may(AccessKind::Read) => {}
                Some(last)
                    if u64::from(last.first) + last.bytes == pair[0]
                        && last.is_writable == is_writable =>
                {
                    last.bytes += bytes;
                }
                _ => open.push(Open {
                    first,
                    bytes,
                    is_writable,
                }),
            }
        }
        open.sort_by_key(|open| std::cmp::Reverse((open.bytes, open.first)));
        open.truncate(OPEN);
        // RAM comes before registers, and the stack, which is above the statics, first.
        open.sort_by_key(|open| (open.first >= 0x2002_0000, std::cmp::Reverse(open.first)));
        for (to, from) in self.open.iter_mut().zip(open) {
            *to = from;
        }
    }

    /// Reads the register at `offset` from 0xE000_ED90.
    pub fn read(&self, offset: u32) -> u32 {
        match offset {
            0x00 => TYPE,
            0x04 => self.control,
            0x08 => self.number as u32,
            _ if offset & 4 != 0 => self.region().base | self.number as u32,
            _ => self.region().attributes,
        }
    }

    fn region(&self) -> Region {
        self.regions.get(self.number).copied().unwrap_or_default()
    }

    /// Writes the register at `offset` from 0xE000_ED90.
    pub fn write(&mut self, offset: u32, value: u32) {
        match offset {
            0x00 => {}
            0x04 => self.control = value & (ENABLE | HFNMIENA | PRIVDEFENA),
            0x08 => self.number = (value & 7) as usize,
            _ if offset & 4 != 0 => {
                if value & 1 << 4 != 0 {
                    self.number = (value & 7) as usize;
                }
                if let Some(region) = self.regions.get_mut(self.number) {
                    region.base = value & !0x1F;
                }
            }
            _ => {
                if let Some(region) = self.regions.get_mut(self.number) {
                    region.attributes = value & 0x173F_FF3F;
                }
            }
        }
        self.prepare();
    }
}
