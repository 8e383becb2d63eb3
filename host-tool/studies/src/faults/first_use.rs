//! Determines, in an undisturbed run, the first access to each byte that will be flipped, and the
//! times of the refills. A bit that is overwritten first, or never accessed, needs no run of its
//! own.

use super::error::FaultsError;
use super::stem::ForkSource;
use hal_sim::chip::Cycle;
use hal_sim::chip::cpu::Observer;
use hal_sim::chip::cpu::run::Context;
use hal_sim::chip::soc::watch::FirstAccess;
use std::ops::Range;

/// Exception number of TIM2, whose interrupt handler runs the refill: 16 plus the interrupt's
/// number (RM0090 table 62).
const REFILL: u16 = 44;

/// Time ranges in which the refill's interrupt handler runs, and those between them.
#[derive(Clone, Debug, Default)]
pub(super) struct Refills {
    /// Ranges in which the handler runs, ascending.
    inside: Vec<Range<Cycle>>,
    outside: Vec<Range<Cycle>>,
}

/// Simulator observer that records when the refill's interrupt handler starts and ends.
#[derive(Clone, Debug, Default)]
struct Handlers {
    begun: Option<Cycle>,
    done: Vec<Range<Cycle>>,
}

impl Observer for Handlers {
    fn context(&mut self, context: Context, at: Cycle) {
        if context.number == REFILL {
            self.begun.get_or_insert(at);
        } else if let Some(begun) = self.begun.take() {
            self.done.push(begun..at);
        }
    }
}

impl Refills {
    /// Records when the refill runs within the time in which faults are injected.
    pub fn in_window(stem: &ForkSource) -> Result<Self, FaultsError> {
        let (_, window) = stem.cycles();
        let watched = stem.run_with_observer(Handlers::default(), &[], &mut |_| ())?;
        let mut refills = Self::default();
        let mut from = window.start;
        let ranges = watched.device.observer.done.into_iter();
        for item in ranges.filter(|range| window.contains(&range.start) && range.end <= window.end)
        {
            refills.outside.push(from..item.start);
            from = item.end;
            refills.inside.push(item);
        }
        refills.outside.push(from..window.end);
        Ok(refills)
    }

    /// Returns the cycle at the fraction `part`, 0 to 1, of the total time within refills if
    /// `in_refill`, otherwise of the total time between refills.
    pub fn cycle(&self, part: f64, in_refill: bool) -> Cycle {
        let ranges = if in_refill {
            &self.inside
        } else {
            &self.outside
        };
        let length = |range: &Range<Cycle>| range.end - range.start;
        let mut left = (part * ranges.iter().map(length).sum::<Cycle>() as f64) as Cycle;
        for range in ranges {
            if left < length(range) {
                return range.start + left;
            }
            left -= length(range);
        }
        ranges.last().map_or(0, |range| range.end)
    }

    /// Returns the share of time that refills take, 0 to 1.
    pub fn share(&self) -> f64 {
        let sum = |ranges: &[Range<Cycle>]| {
            ranges
                .iter()
                .map(|range| range.end - range.start)
                .sum::<Cycle>()
        };
        let (inside, outside) = (sum(&self.inside), sum(&self.outside));
        inside as f64 / (inside + outside).max(1) as f64
    }
}

/// A byte to flip: the cycle of the flip, and a function that returns its address for the main
/// stack pointer at that cycle, or `None` if the stack is empty then.
pub(super) struct WatchedByte<'a> {
    pub cycle: Cycle,
    pub byte: &'a (dyn Fn(u32) -> Option<u32> + Sync),
}

/// Returns for each byte in `wanted` its address and how it is first accessed after the flip, from
/// one undisturbed run that ends with a silent host. Returns `None` for a byte of an empty stack.
pub(super) fn first_uses(
    stem: &ForkSource,
    wanted: &[WatchedByte<'_>],
) -> Result<Vec<Option<(u32, FirstAccess)>>, FaultsError> {
    let mut order: Vec<usize> = (0..wanted.len()).collect();
    order.sort_by_key(|&k| wanted[k].cycle);
    let cycles: Vec<Cycle> = order.iter().map(|&k| wanted[k].cycle).collect();
    let mut numbers = vec![None; wanted.len()];
    let mut next = order.iter();
    let watched = stem.run_with_observer((), &cycles, &mut |board| {
        let Some(&k) = next.next() else { return };
        let byte = (wanted[k].byte)(board.cpu.registers.msp());
        let watch = board.around.soc.watch.get_or_insert_default();
        numbers[k] = byte.map(|byte| (byte, watch.watch_address(byte)));
    })?;
    let watch = watched.device.around.soc.watch.unwrap_or_default();
    let first = |number: usize| {
        watch
            .first_accesses()
            .get(number)
            .copied()
            .unwrap_or(FirstAccess::Read)
    };
    let first_access =
        |pair: Option<(u32, usize)>| pair.map(|(byte, number)| (byte, first(number)));
    Ok(numbers.into_iter().map(first_access).collect())
}
