//! Fault campaign: an interrupt handler hangs and an erase stream is disabled. Neither fault alone
//! lets a pulse be repeated.

use super::Draws;
use super::case::{Case, CaseResult};
use super::declaration::Declaration;
use super::error::{FaultsError, never_runs};
use super::freeze::{Owner, freeze};
use super::kinds::Kinds;
use super::stem::{Chip, ForkSource};
use super::streams::{ERASE, switch_off};
use hal_sim::chip::image::Image;

/// Random stream of this fault class; every class has its own, so that their random numbers are
/// independent.
const STREAM: u64 = 0x9A14;
/// Upper bound of the random number of instructions that the interrupt handler executes before it
/// hangs.
const INSTRUCTIONS: u64 = 300;
/// Range of the random time between both faults, µs, uniform in the logarithm.
const APART_US: (f64, f64) = (1.0, 1e6);

/// Campaign in which each case has two faults, a hanging handler and a disabled stream: the
/// undisturbed run from which cases start, and the kinds of pair.
pub(super) struct Pairs {
    stem: ForkSource,
    kinds: Kinds,
}

impl Pairs {
    pub fn new(seed: u64, declaration: &Declaration, image: &Image) -> Result<Self, FaultsError> {
        Ok(Self {
            stem: ForkSource::record(declaration, image)?,
            kinds: Kinds::new(declaration, image, seed, STREAM),
        })
    }
}

impl Draws for Pairs {
    fn case(&self, index: u64) -> Result<Case, FaultsError> {
        let (kind, mut random) = self.kinds.draw(index)?;
        let owner = Owner::from_kind(kind)?;
        let stream = ERASE[random.below(2) as usize];
        let after_us = random.log_between(APART_US.0, APART_US.1) as u64;
        let instructions = random.below(INSTRUCTIONS);
        let erasing_first = random.below(2) == 0;
        let mut fork = self.stem.instant(random.unit(), &mut random)?;
        let strike = |fork: &mut Chip, erasing: bool| match erasing {
            true => switch_off(&mut fork.device, stream).map(|_| true),
            false => freeze(fork, owner, instructions),
        };
        let first = strike(&mut fork, erasing_first);
        let moment_us = fork.device_us();
        let first = first?;
        let struck = match fork.run_to(moment_us + after_us) {
            Ok(()) => strike(&mut fork, !erasing_first),
            Err(lost) => Err(never_runs(lost)),
        };
        let second = matches!(struck, Ok(true));
        let frozen = if erasing_first { second } else { first };
        let order = match (erasing_first, frozen) {
            (_, false) => "erasing off, never ran again",
            (true, true) => "erasing off, frozen",
            (false, true) => "frozen, erasing off",
        };
        Ok(Case {
            index,
            moment_us,
            what: format!("{kind}: {order} after {after_us} us, stream {stream}"),
            fate: match struck {
                Ok(_) => self.stem.play_and_judge(fork, moment_us),
                Err(why) => CaseResult::stopped(why),
            },
        })
    }

    fn notes(&self) -> Vec<String> {
        let kinds = self.kinds.in_words();
        vec![format!(
            "Injected at random: {kinds} frozen and an erase stream switched off, in either order."
        )]
    }
}
