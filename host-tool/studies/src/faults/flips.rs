//! Fault campaign: one bit of memory flips.

use super::Draws;
use super::case::{Case, CaseEnd, CaseResult};
use super::declaration::Declaration;
use super::error::FaultsError;
use super::first_use::{Refills, WatchedByte, first_uses};
use super::stem::ForkSource;
use super::strata::{self, SRAM1, Stratum};
use hal_sim::chip::Cycle;
use hal_sim::chip::board::{Board, CYCLES_PER_US};
use hal_sim::chip::cpu::Size;
use hal_sim::chip::image::Image;
use hal_sim::chip::soc::watch::FirstAccess;
use hal_sim::random::{Random, word};
use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};

/// Random stream of this fault class; every class has its own, so that their random numbers are
/// independent.
const STREAM: u64 = 0xF11B;
/// Number of cases whose first memory accesses are determined together, in one undisturbed run.
const BLOCK: u64 = 2_000;
/// Addresses of the main flash.
const FLASH: std::ops::Range<u32> = 0x0800_0000..0x0810_0000;
/// Addresses of SRAM2, which contains the pulse tape.
const SRAM2: std::ops::Range<u32> = 0x2001_C000..0x2002_0000;

/// Byte address and first access of each case in a block of [`BLOCK`] cases; `None` if the stack
/// was empty.
type Block = Arc<Vec<Option<(u32, FirstAccess)>>>;

/// Campaign in which one bit of memory flips: the undisturbed run from which cases start, the
/// memory areas, and the first access to each byte as far as it is known.
pub(super) struct Flips {
    stem: ForkSource,
    seed: u64,
    strata: Vec<Stratum>,
    refills: Refills,
    /// Whether every case runs to its configured end, even if its result is certain earlier.
    to_the_end: bool,
    blocks: Mutex<BTreeMap<u64, Block>>,
}

/// A bit to flip, and the cycle at which it flips.
struct FlipCase<'a> {
    stratum: &'a Stratum,
    cycle: Cycle,
    part: f64,
    bit: u32,
}

impl Flips {
    pub fn new(seed: u64, declaration: &Declaration, image: &Image) -> Result<Self, FaultsError> {
        let written = &declaration.of.strata;
        // Fails early if the image lacks a configured variable.
        strata::locate_strata(written, image, SRAM1.start)?;
        let stem = ForkSource::record(declaration, image)?;
        let deepest = stem.deepest_stack().unwrap_or(SRAM1.start);
        Ok(Self {
            refills: Refills::in_window(&stem)?,
            stem,
            seed,
            strata: strata::locate_strata(written, image, deepest)?,
            to_the_end: declaration.to_the_end,
            blocks: Mutex::default(),
        })
    }

    /// Returns the memory area of case `index`. The areas alternate, so that any number of first
    /// cases has nearly their configured proportions.
    fn stratum(&self, index: u64) -> Result<&Stratum, FaultsError> {
        let total = self.strata.iter().map(|stratum| stratum.count).sum::<u64>();
        let none = || FaultsError::Declaration("flips.toml: there is no stratum".into());
        let mut place = spread(index % total.max(1), total);
        for stratum in &self.strata {
            if place < stratum.count {
                return Ok(stratum);
            }
            place -= stratum.count;
        }
        Err(none())
    }

    fn draw(&self, index: u64) -> Result<FlipCase<'_>, FaultsError> {
        let mut random = Random::new(word(word(self.seed, STREAM), index));
        let stratum = self.stratum(index)?;
        Ok(FlipCase {
            stratum,
            cycle: self.refills.cycle(random.unit(), stratum.in_refill),
            part: random.unit(),
            bit: random.below(8) as u32,
        })
    }

    /// Returns the address of the byte that case `index` flips and the first access to it; `None`
    /// if the stack is empty at that moment.
    fn first_use(&self, index: u64) -> Result<Option<(u32, FirstAccess)>, FaultsError> {
        let number = index / BLOCK;
        // Holding the lock makes other threads wait, which need the same block.
        let mut blocks = self.blocks.lock().unwrap_or_else(PoisonError::into_inner);
        let block = match blocks.get(&number) {
            Some(block) => block.clone(),
            None => {
                let block = Arc::new(self.block(number)?);
                blocks.insert(number, block.clone());
                block
            }
        };
        drop(blocks);
        Ok(block[(index % BLOCK) as usize])
    }

    fn block(&self, number: u64) -> Result<Vec<Option<(u32, FirstAccess)>>, FaultsError> {
        let cases = number * BLOCK..(number + 1) * BLOCK;
        let drawn: Result<Vec<_>, _> = cases.map(|index| self.draw(index)).collect();
        let drawn = drawn?;
        let byte = |draw: &FlipCase<'_>| {
            let (area, part) = (draw.stratum.area.clone(), draw.part);
            move |msp: u32| area.byte(part, msp)
        };
        let bytes: Vec<_> = drawn.iter().map(byte).collect();
        let wanted: Vec<_> = std::iter::zip(&drawn, &bytes)
            .map(|(draw, byte)| WatchedByte {
                cycle: draw.cycle,
                byte,
            })
            .collect();
        first_uses(&self.stem, &wanted)
    }

    /// Returns the result of a flip that no instruction reads, or `None` if the case must be
    /// simulated.
    fn result_if_unread(&self, byte: u32, first: FirstAccess) -> Option<CaseResult> {
        // Only SRAM1 qualifies: DMA reads the tape, and accesses to flash are not observed.
        let ended = match first {
            _ if self.to_the_end || !SRAM1.contains(&byte) => return None,
            FirstAccess::Untouched => CaseEnd::Untouched,
            FirstAccess::Written => CaseEnd::Overwritten,
            FirstAccess::Read => return None,
        };
        Some(CaseResult {
            ended,
            ..CaseResult::default()
        })
    }

    fn play(
        &self,
        drawn: &FlipCase<'_>,
        byte: u32,
        moment_us: u64,
    ) -> Result<CaseResult, FaultsError> {
        let mut fork = self.stem.fork_at(drawn.cycle)?;
        flip(&mut fork.device, byte, drawn.bit)?;
        let mut fate = self.stem.play_and_judge_shown(fork, moment_us);
        if SRAM2.contains(&byte) {
            // One slot of the tape is over before the firmware can check it.
            let is_short = fate.shown_us.is_some_and(|us| us <= 1);
            fate.must_find = fate.found || fate.must_find && !is_short;
        } else {
            fate.shown_us = None;
        }
        Ok(fate)
    }
}

/// Permutes the numbers below `total` so that neighbouring indices get distant numbers.
fn spread(index: u64, total: u64) -> u64 {
    const fn gcd(a: u64, b: u64) -> u64 {
        if b == 0 { a } else { gcd(b, a % b) }
    }
    // The integer closest to the golden section that is coprime to `total`.
    let near = (total as f64 * 0.618_033_988_75) as u64;
    let step = (near.max(1)..)
        .find(|&index| gcd(index, total) == 1)
        .unwrap_or(1);
    index * step % total.max(1)
}

impl Draws for Flips {
    fn case(&self, index: u64) -> Result<Case, FaultsError> {
        let drawn = self.draw(index)?;
        let (origin, _) = self.stem.cycles();
        let moment_us = drawn.cycle.saturating_sub(origin) / CYCLES_PER_US;
        let kind = &drawn.stratum.kind;
        let Some((byte, first)) = self.first_use(index)? else {
            let description = format!("{kind}: the stack is empty");
            let fate = CaseResult {
                ended: CaseEnd::Untouched,
                ..CaseResult::default()
            };
            return Ok(Case {
                index,
                moment_us,
                what: description,
                fate,
            });
        };
        let fate = match self.result_if_unread(byte, first) {
            Some(fate) => fate,
            None => self.play(&drawn, byte, moment_us)?,
        };
        let (cycle, bit) = (drawn.cycle, drawn.bit);
        Ok(Case {
            index,
            moment_us,
            what: format!("{kind}: {byte:#010x} bit {bit}, cycle {cycle}"),
            fate,
        })
    }

    fn notes(&self) -> Vec<String> {
        let strata = self.strata.iter();
        let mut notes: Vec<_> = strata
            .map(|stratum| format!("{}: {}.", stratum.kind, stratum.area.in_words()))
            .collect();
        let share = 100.0 * self.refills.share();
        notes.push(format!("Refills take {share:.1} % of the time."));
        notes
    }
}

/// Flips bit `bit`, 0 to 7, of the byte at address `byte` in flash or RAM.
fn flip(board: &mut Board<()>, byte: u32, bit: u32) -> Result<(), FaultsError> {
    let soc = &mut board.around.soc;
    if FLASH.contains(&byte) {
        let old = soc.flash.peek(byte, Size::Byte) as u8;
        let done = soc.flash.load(byte, &[old ^ 1 << bit]);
        return done.map_err(|e| FaultsError::Declaration(e.to_string()));
    }
    // All symbols lie in RAM. A flip outside of memory would have no effect, and no test would
    // notice it.
    let old = soc.ram.read(byte, Size::Byte);
    let done = old.and_then(|old| soc.ram.write(byte, Size::Byte, old ^ 1 << bit));
    done.ok_or_else(|| FaultsError::Declaration(format!("no memory at {byte:#010x}")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_place_is_met_once_and_any_first_ones_are_spread() {
        for total in [1, 2, 7, 10_000] {
            let mut places: Vec<_> = (0..total).map(|k| spread(k, total)).collect();
            let early = places
                .iter()
                .take(100)
                .filter(|place| **place < total / 2)
                .count();
            assert!(total < 100 || (45..56).contains(&early), "{early}");
            places.sort_unstable();
            assert!(places.into_iter().eq(0..total));
        }
    }
}
