//! What a read of the flash costs: wait states, line buffers, caches, prefetch
//! (RM0090 section 3.5).
//!
//! The array delivers 128 bits per read, one read at a time. A read takes
//! LATENCY + 1 cycles and is never aborted. The instruction port holds the line
//! in use, so that only a change of line asks for anything.
//!
//! Said by the manual: 64 instruction and 8 data lines, least recently used
//! replaced; a line is copied into the instruction cache when it was neither in
//! use, nor prefetched, nor cached; a hit costs nothing; data reads go before
//! instruction reads; the prefetch reads the next sequential line while the
//! present one is being used. Whether a prefetched line that is used enters the
//! cache after all is [`Prefetched`], which see.
//!
//! Left open there, and taken here:
//! - both caches are fully associative;
//! - the prefetch of line n + 1 starts when line n is delivered and the array is
//!   free; none starts for a line that the cache holds;
//! - a line asked for while its prefetch is under way comes when that ends;
//! - a prefetch under way when a branch leaves ends first and occupies the
//!   array; its line stays until another is prefetched. One that has not
//!   started is dropped;
//! - with DCEN off every data read is one of the array;
//! - caches keep their lines while switched off.

use super::Prefetched;
use super::lines::{Lines, NONE};
use crate::chip::Cycle;

mod acr {
    pub const LATENCY: u32 = 7;
    pub const PRFTEN: u32 = 1 << 8;
    pub const ICEN: u32 = 1 << 9;
    pub const DCEN: u32 = 1 << 10;
    pub const ICRST: u32 = 1 << 11;
    pub const DCRST: u32 = 1 << 12;
}

/// The line after the one in use.
#[derive(Clone, Copy, PartialEq, Debug)]
struct Prefetch {
    /// [`NONE`] if there is none.
    line: u32,
    start: Cycle,
    /// First cycle after its read.
    end: Cycle,
}

impl Prefetch {
    const NONE: Self = Self {
        line: NONE,
        start: 0,
        end: 0,
    };
}

/// Wait states and what hides them.
#[derive(Clone, PartialEq, Debug)]
pub(super) struct Accelerator {
    acr: u32,
    pub(crate) latency: u32,
    prefetches: bool,
    caches_code: bool,
    caches_data: bool,
    /// First cycle after the latest read (or programming) that was asked for;
    /// of prefetches, only those that turned out to be needed.
    busy_until: Cycle,
    current: u32,
    prefetch: Prefetch,
    code: Lines<64>,
    data: Lines<8>,
    /// Code was delivered that the flash no longer holds.
    pub(crate) delivered_stale: bool,
    prefetched: Prefetched,
    /// Nothing waits, whatever the program sets: no board's.
    ideal: bool,
}

impl Accelerator {
    pub(super) fn new() -> Self {
        Self {
            acr: 0,
            latency: 0,
            prefetches: false,
            caches_code: false,
            caches_data: false,
            busy_until: 0,
            current: NONE,
            prefetch: Prefetch::NONE,
            code: Lines::new(),
            data: Lines::new(),
            delivered_stale: false,
            prefetched: Prefetched::Cached,
            ideal: false,
        }
    }

    pub(super) fn reset(&mut self) {
        *self = Self {
            prefetched: self.prefetched,
            ideal: self.ideal,
            ..Self::new()
        };
    }

    pub(super) const fn acr(&self) -> u32 {
        self.acr
    }

    pub(super) const fn set_prefetched(&mut self, prefetched: Prefetched) {
        self.prefetched = prefetched;
    }

    pub(super) const fn never_wait(&mut self) {
        self.ideal = true;
    }

    /// Writes FLASH_ACR. `None` for a reset of a cache that is on, which the
    /// manual does not allow.
    pub(super) fn set_acr(&mut self, value: u32) -> Option<()> {
        let value = value & 0x1F07;
        let on = |bit: u32| value & bit != 0;
        if on(acr::ICRST) && on(acr::ICEN) || on(acr::DCRST) && on(acr::DCEN) {
            return None;
        }
        if on(acr::ICRST) {
            self.code.clear();
        }
        if on(acr::DCRST) {
            self.data.clear();
        }
        self.acr = value;
        self.latency = value & acr::LATENCY;
        self.prefetches = on(acr::PRFTEN);
        self.caches_code = on(acr::ICEN);
        self.caches_data = on(acr::DCEN);
        Some(())
    }

    /// The core needs code of `line` (0–65535) at `at`; gives the wait states.
    #[inline(always)]
    pub(super) fn fetch(&mut self, line: u32, at: Cycle) -> u32 {
        if line == self.current || self.ideal {
            return 0;
        }
        if self.caches_code && self.code.hit(line) {
            self.current = line;
            if self.prefetches && !self.code.holds(line + 1) {
                self.start_prefetch(line + 1, at);
            }
            return 0;
        }
        self.fetch_beyond_cache(line, at)
    }

    #[inline(never)]
    fn fetch_beyond_cache(&mut self, line: u32, at: Cycle) -> u32 {
        self.delivered_stale |= self.caches_code && self.code.is_stale(line);
        let end = if self.prefetch.line == line {
            self.prefetch.line = NONE;
            if self.caches_code && self.prefetched == Prefetched::Cached {
                self.code.insert(line);
            }
            self.prefetch.end
        } else {
            if self.caches_code {
                self.code.insert(line);
            }
            let start = self.free_from(at);
            if self.prefetch.start >= at {
                self.prefetch = Prefetch::NONE; // it did not start
            }
            start + u64::from(self.latency) + 1
        };
        self.busy_until = self.busy_until.max(end);
        self.current = line;
        if self.prefetches && !(self.caches_code && self.code.holds(line + 1)) {
            self.start_prefetch(line + 1, end.max(at));
        }
        wait(at, end)
    }

    /// A data read in `line` at `at`: its wait states; `None` if the cache would
    /// deliver what the flash no longer holds.
    #[inline]
    pub(super) fn read(&mut self, line: u32, at: Cycle) -> Option<u32> {
        if self.ideal || self.caches_data && self.data.hit(line) {
            return Some(0);
        }
        if self.caches_data {
            if self.data.is_stale(line) {
                return None;
            }
            self.data.insert(line);
        }
        Some(self.read_array(at))
    }

    /// A read that no cache holds.
    pub(super) fn read_array(&mut self, at: Cycle) -> u32 {
        let end = self.free_from(at) + u64::from(self.latency) + 1;
        self.busy_until = end;
        let later = &mut self.prefetch;
        if later.line != NONE && (at..end).contains(&later.start) {
            later.end += end - later.start;
            later.start = end;
        }
        wait(at, end)
    }

    /// The array is programmed or erased up to `end`.
    pub(super) fn occupy(&mut self, end: Cycle) {
        self.busy_until = self.busy_until.max(end);
    }

    /// First cycle from `at` on at which the array can begin a read.
    #[inline]
    fn free_from(&self, at: Cycle) -> Cycle {
        let prefetch_end = if self.prefetch.start < at {
            self.prefetch.end
        } else {
            0
        };
        at.max(self.busy_until).max(prefetch_end)
    }

    #[inline]
    fn start_prefetch(&mut self, line: u32, from: Cycle) {
        if self.prefetch.line == line || line as usize >= super::lines::COUNT {
            return;
        }
        let start = self.free_from(from);
        self.prefetch = Prefetch {
            line,
            start,
            end: start + u64::from(self.latency) + 1,
        };
    }

    /// The flash changed under `lines`: by an erasure, or by programming, which
    /// also changes what the data cache holds (RM0090 section 3.6).
    pub(super) fn outdate(&mut self, lines: std::ops::Range<u32>, erased: bool) {
        self.code.outdate(lines.clone());
        if erased {
            self.data.outdate(lines);
        }
        self.current = NONE;
        self.prefetch = Prefetch::NONE;
    }

    /// A programmer replaced what lies in the flash: no line is held.
    pub(super) fn forget(&mut self) {
        self.code.clear();
        self.data.clear();
        self.current = NONE;
        self.prefetch = Prefetch::NONE;
    }

    /// The operation under way ends at `end`, since the core clock changed.
    pub(super) fn occupy_until(&mut self, end: Cycle) {
        self.busy_until = end;
    }
}

/// Wait states of an access at `at` whose data the array holds at the end of
/// the cycle before `end`.
fn wait(at: Cycle, end: Cycle) -> u32 {
    // Programming takes at most 4 s, fewer than 2^32 cycles.
    u32::try_from(end.saturating_sub(at).saturating_sub(1)).unwrap_or(u32::MAX)
}
