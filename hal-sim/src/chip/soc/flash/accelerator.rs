//! Timing of flash reads: wait states, line buffers, caches and prefetch (RM0090 section 3.5).
//!
//! The flash array delivers 128 bits (one line) per read, one read at a time. A read takes
//! LATENCY + 1 cycles and is never aborted. The instruction port holds the current line, so
//! the array or a cache is accessed only when the line changes.
//!
//! The manual specifies:
//! - there are 64 instruction and 8 data cache lines, and the least recently used line is
//!   replaced;
//! - a line is copied into the instruction cache if it was neither current, nor prefetched,
//!   nor cached;
//! - a cache hit takes no extra cycles;
//! - data reads have priority over instruction reads;
//! - the prefetch reads the next sequential line while the current one is in use.
//!
//! The manual contradicts itself on whether a prefetched line that is used enters the cache;
//! [`Prefetched`] selects the reading.
//!
//! The manual leaves the following open, and this model assumes:
//! - both caches are fully associative;
//! - the prefetch of line n + 1 starts when line n is delivered and the array is free, unless
//!   the cache holds line n + 1;
//! - a line that is requested while its prefetch is in progress arrives when the prefetch ends;
//! - a prefetch that is in progress when a branch leaves the line completes and occupies the
//!   array until then. Its line is kept until the next prefetch. A prefetch that has not
//!   started is cancelled;
//! - with DCEN off, every data read accesses the array;
//! - the caches keep their lines while they are switched off.

use super::Prefetched;
use super::lines::{Lines, NONE};
use crate::chip::Cycle;

/// Bits of FLASH_ACR.
mod acr {
    pub const LATENCY: u32 = 7;
    pub const PRFTEN: u32 = 1 << 8;
    pub const ICEN: u32 = 1 << 9;
    pub const DCEN: u32 = 1 << 10;
    pub const ICRST: u32 = 1 << 11;
    pub const DCRST: u32 = 1 << 12;
}

/// Prefetch of the line that follows the current one: scheduled, in progress or complete.
#[derive(Clone, Copy, PartialEq, Debug)]
struct Prefetch {
    /// Number of the line; [`NONE`] if nothing is prefetched.
    line: u32,
    /// First cycle of the read.
    start: Cycle,
    /// First cycle after the read.
    end: Cycle,
}

impl Prefetch {
    const NONE: Self = Self {
        line: NONE,
        start: 0,
        end: 0,
    };
}

/// The flash interface: wait states, and the caches and prefetch that hide them.
#[derive(Clone, PartialEq, Debug)]
pub(super) struct Accelerator {
    acr: u32,
    /// LATENCY of FLASH_ACR: the number of wait states, 0 to 7.
    pub(crate) latency: u32,
    prefetches: bool,
    caches_code: bool,
    caches_data: bool,
    /// First cycle after the latest requested read, programming or erasure. A prefetch counts
    /// only once its line has been requested.
    busy_until: Cycle,
    /// Line that the instruction port holds; [`NONE`] if it holds none.
    current: u32,
    prefetch: Prefetch,
    code: Lines<64>,
    data: Lines<8>,
    /// Whether the cache has delivered code that the flash no longer contains.
    pub(crate) delivered_stale: bool,
    prefetched: Prefetched,
    /// Whether all reads take no wait states, regardless of FLASH_ACR. No real chip does this.
    ideal: bool,
}

impl Accelerator {
    /// Creates the interface in its reset state, with empty caches.
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

    /// Resets everything except the choices made with [`Self::set_prefetched`] and
    /// [`Self::never_wait`].
    pub(super) fn reset(&mut self) {
        *self = Self {
            prefetched: self.prefetched,
            ideal: self.ideal,
            ..Self::new()
        };
    }

    /// Returns FLASH_ACR as last written, without reserved bits.
    pub(super) const fn acr(&self) -> u32 {
        self.acr
    }

    /// Selects whether prefetched lines enter the instruction cache when they are used.
    pub(super) const fn set_prefetched(&mut self, prefetched: Prefetched) {
        self.prefetched = prefetched;
    }

    /// Removes all wait states from now on, to measure how much depends on them.
    pub(super) const fn never_wait(&mut self) {
        self.ideal = true;
    }

    /// Writes FLASH_ACR. Returns `None` if `value` resets a cache that it enables, which the
    /// manual does not allow.
    pub(super) fn set_acr(&mut self, value: u32) -> Option<()> {
        let value = value & 0x1F07;
        let is_set = |bit: u32| value & bit != 0;
        if is_set(acr::ICRST) && is_set(acr::ICEN) || is_set(acr::DCRST) && is_set(acr::DCEN) {
            return None;
        }
        if is_set(acr::ICRST) {
            self.code.clear();
        }
        if is_set(acr::DCRST) {
            self.data.clear();
        }
        self.acr = value;
        self.latency = value & acr::LATENCY;
        self.prefetches = is_set(acr::PRFTEN);
        self.caches_code = is_set(acr::ICEN);
        self.caches_data = is_set(acr::DCEN);
        Some(())
    }

    /// Fetches code from `line` (0–65535) at cycle `at`, and returns the number of wait states.
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
        self.fetch_uncached(line, at)
    }

    /// Fetches code from a line that is neither current nor cached, and returns the number of
    /// wait states.
    #[inline(never)]
    fn fetch_uncached(&mut self, line: u32, at: Cycle) -> u32 {
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
                self.prefetch = Prefetch::NONE; // it had not started
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

    /// Reads data from `line` at cycle `at`, and returns the number of wait states.
    ///
    /// Returns `None` if the cache would deliver data that the flash no longer contains.
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

    /// Reads data from the array at cycle `at`, past the caches, and returns the number of wait
    /// states. A prefetch that would have started meanwhile is postponed.
    pub(super) fn read_array(&mut self, at: Cycle) -> u32 {
        let end = self.free_from(at) + u64::from(self.latency) + 1;
        self.busy_until = end;
        let prefetch = &mut self.prefetch;
        if prefetch.line != NONE && (at..end).contains(&prefetch.start) {
            prefetch.end += end - prefetch.start;
            prefetch.start = end;
        }
        wait(at, end)
    }

    /// Marks the array as busy with programming or erasing until cycle `end`.
    pub(super) fn occupy(&mut self, end: Cycle) {
        self.busy_until = self.busy_until.max(end);
    }

    /// Returns the first cycle, `at` or later, at which the array can begin a read.
    #[inline]
    fn free_from(&self, at: Cycle) -> Cycle {
        let prefetch_end = if self.prefetch.start < at {
            self.prefetch.end
        } else {
            0
        };
        at.max(self.busy_until).max(prefetch_end)
    }

    /// Schedules the prefetch of `line` for the first cycle, `from` or later, at which the array
    /// is free. Does nothing if `line` is already prefetched or beyond the flash.
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

    /// Marks cached copies of `lines` as outdated after the flash has changed.
    ///
    /// Programming also updates the data cache (RM0090 section 3.6), so data lines become
    /// outdated only if the flash was `erased`.
    pub(super) fn outdate(&mut self, lines: std::ops::Range<u32>, erased: bool) {
        self.code.outdate(lines.clone());
        if erased {
            self.data.outdate(lines);
        }
        self.current = NONE;
        self.prefetch = Prefetch::NONE;
    }

    /// Discards all lines, after a programmer has replaced the contents of the flash.
    pub(super) fn forget(&mut self) {
        self.code.clear();
        self.data.clear();
        self.current = NONE;
        self.prefetch = Prefetch::NONE;
    }

    /// Sets the end of the operation in progress to cycle `end`, after the core clock has
    /// changed.
    pub(super) fn occupy_until(&mut self, end: Cycle) {
        self.busy_until = end;
    }
}

/// Returns the number of wait states of an access at cycle `at` whose data the array delivers
/// at the end of the cycle before `end`.
fn wait(at: Cycle, end: Cycle) -> u32 {
    // Programming takes at most 4 s, which is less than 2^32 cycles.
    u32::try_from(end.saturating_sub(at).saturating_sub(1)).unwrap_or(u32::MAX)
}
