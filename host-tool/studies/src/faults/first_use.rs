//! What the unbroken board does first with a byte that is to be flipped, and when its
//! refills are: nothing need be played of a bit that is written again, or never touched.

use super::error::FaultsError;
use super::stem::ForkSource;
use hal_sim::chip::Cycle;
use hal_sim::chip::cpu::Observer;
use hal_sim::chip::cpu::run::Context;
use hal_sim::chip::soc::watch::FirstAccess;
use std::ops::Range;

/// 16 and the interrupt's number (RM0090 table 62) of TIM2: the refill.
const REFILL: u16 = 44;

/// When the refill's handler runs, and when not.
#[derive(Clone, Debug, Default)]
pub(super) struct Refills {
    /// Ascending.
    inside: Vec<Range<Cycle>>,
    outside: Vec<Range<Cycle>>,
}

/// Notes when a handler begins and ends.
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
    /// Those of the window.
    pub fn in_window(stem: &ForkSource) -> Result<Self, FaultsError> {
        let (_, window) = stem.cycles();
        let watched = stem.run_with_observer(Handlers::default(), &[], &mut |_| ())?;
        let mut refills = Self::default();
        let mut from = window.start;
        let all = watched.device.observer.done.into_iter();
        for item in all.filter(|range| window.contains(&range.start) && range.end <= window.end) {
            refills.outside.push(from..item.start);
            from = item.end;
            refills.inside.push(item);
        }
        refills.outside.push(from..window.end);
        Ok(refills)
    }

    /// The cycle at which the part `part` (0 to 1) of all time in a refill, or of all other
    /// time, has gone by.
    pub fn cycle(&self, part: f64, in_refill: bool) -> Cycle {
        let all = if in_refill {
            &self.inside
        } else {
            &self.outside
        };
        let length = |range: &Range<Cycle>| range.end - range.start;
        let mut left = (part * all.iter().map(length).sum::<Cycle>() as f64) as Cycle;
        for range in all {
            if left < length(range) {
                return range.start + left;
            }
            left -= length(range);
        }
        all.last().map_or(0, |range| range.end)
    }

    /// The share of time in which one is under way.
    pub fn share(&self) -> f64 {
        let sum = |all: &[Range<Cycle>]| {
            all.iter()
                .map(|range| range.end - range.start)
                .sum::<Cycle>()
        };
        let (inside, outside) = (sum(&self.inside), sum(&self.outside));
        inside as f64 / (inside + outside).max(1) as f64
    }
}

/// A byte that is to be flipped: when, and which it is while the main stack pointer is the
/// one told.
pub(super) struct WatchedByte<'a> {
    pub cycle: Cycle,
    pub byte: &'a (dyn Fn(u32) -> Option<u32> + Sync),
}

/// Of each of `wanted`, its address and what comes first there; to the end of a reference
/// whose host falls silent.
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
    let told = |pair: Option<(u32, usize)>| pair.map(|(byte, number)| (byte, first(number)));
    Ok(numbers.into_iter().map(told).collect())
}
