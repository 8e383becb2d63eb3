//! Campaigns of faults: what gets past the device, drawn by seed and judged.
//!
//! Lives here: what is broken how often and when ([`Declaration`], committed before it
//! was judged), a board and its host that can be forked ([`bench`](self)), one file per
//! class of faults, the table and the files that come of it. Not here: what is severe
//! (`hal_sim::trace::judge`, which shares nothing with `firmware`), the command (`cli`).
//! In: a class, a seed, an image. Out: [`Case`]s and what they come to ([`Outcome`]).

mod allowance;
mod assumed;
mod bench;
mod broken_angle;
mod case;
mod cpu;
mod cut_off;
mod declaration;
mod declared;
mod electrode;
mod error;
mod first_use;
mod flips;
mod freeze;
mod journal;
mod kinds;
mod link;
mod measured;
mod orders;
mod outcome;
mod pairs;
mod played_on;
mod published;
mod registers;
mod script;
mod sensor;
mod simulated;
mod spent;
mod stem;
mod strata;
mod streams;
mod supply;
mod table;
mod truth;
mod worn;

pub use case::{Case, Ended, Fate};
pub use declaration::{Class, Declaration, FILES};
pub use error::FaultsError;
pub use journal::{Identity, JOURNAL, Journal};
pub use outcome::Outcome;
pub use table::csv;
pub use truth::declared_truth;

use allowance::Evaded;
use cpu::Core;
use declared::Declared;
use electrode::Electrode;
use flips::Flips;
use hal_sim::chip::image::Image;
use link::Link;
use pairs::Pairs;
use rayon::prelude::*;
use registers::Registers;
use sensor::Sensor;
use simulated::Native;
use streams::Streams;
use supply::Supply;

/// Cases computed between two questions whether to go on, for each core.
const AT_ONCE: usize = 4;

/// Hears the part done, 0 to 1, and cases in their order; says whether to go on.
pub type Take<'a> = dyn FnMut(f64, &[Case]) -> Result<bool, FaultsError> + 'a;

/// What draws and plays the cases of a class.
trait Draws: Sync {
    /// Case `index`, a function of the seed and this number alone.
    fn case(&self, index: u64) -> Result<Case, FaultsError>;

    /// What one must know to read its numbers.
    fn notes(&self) -> Vec<String>;
}

/// A class of faults, ready to be played.
pub struct Campaign {
    draws: Box<dyn Draws + Send>,
}

impl Campaign {
    /// Of the declaration's class on the chip simulator that `image` is flashed in.
    ///
    /// # Errors
    /// The board does not come to stimulate, or has not what is to be broken.
    pub fn on_chip(
        seed: u64,
        declaration: &Declaration,
        image: &Image,
    ) -> Result<Self, FaultsError> {
        let draws: Box<dyn Draws + Send> = match declaration.class {
            Class::Flips => Box::new(Flips::new(seed, declaration, image)?),
            Class::Registers => Box::new(Registers::new(seed, declaration, image)?),
            Class::Declarations => Box::new(Declared::new(seed, declaration, image.clone())?),
            Class::Electrode => Box::new(Electrode::new(seed, declaration, image.clone())?),
            Class::Link => Box::new(Link::new(seed, declaration, image.clone())?),
            Class::Sensor => Box::new(Sensor::new(seed, declaration, image.clone())?),
            Class::Streams => Box::new(Streams::new(seed, declaration, image)?),
            Class::Cpu => Box::new(Core::new(seed, declaration, image)?),
            Class::Supply => Box::new(Supply::new(seed, declaration, image)?),
            Class::Pairs => Box::new(Pairs::new(seed, declaration, image)?),
            Class::Allowance => Box::new(Evaded::new(seed, declaration, image.clone())?),
        };
        Ok(Self { draws })
    }

    /// The same on the native simulator.
    ///
    /// # Errors
    /// It has nothing that this class breaks.
    pub fn native(seed: u64, declaration: &Declaration) -> Result<Self, FaultsError> {
        let draws: Box<dyn Draws + Send> = match declaration.class {
            Class::Declarations => Box::new(Declared::new(seed, declaration, Native)?),
            Class::Electrode => Box::new(Electrode::new(seed, declaration, Native)?),
            Class::Link => Box::new(Link::new(seed, declaration, Native)?),
            Class::Sensor => Box::new(Sensor::new(seed, declaration, Native)?),
            Class::Allowance => Box::new(Evaded::new(seed, declaration, Native)?),
            class => return Err(FaultsError::ChipOnly(class.name())),
        };
        Ok(Self { draws })
    }

    /// What one must know to read its numbers.
    #[must_use]
    pub fn notes(&self) -> Vec<String> {
        self.draws.notes()
    }

    /// Case `index` alone.
    ///
    /// # Errors
    /// As [`Self::play`].
    pub fn case(&self, index: u64) -> Result<Case, FaultsError> {
        self.draws.case(index)
    }

    /// The first `count` cases, on all cores; the same ones on any number of them.
    /// `go_on` hears the part done, 0 to 1, and may say no: then fewer come back.
    ///
    /// # Errors
    /// A case could not be set up: nothing was broken in it yet.
    pub fn play(
        &self,
        count: u64,
        go_on: &mut dyn FnMut(f64) -> bool,
    ) -> Result<Vec<Case>, FaultsError> {
        let mut cases = Vec::new();
        self.play_from(0, count, &mut |part, some| {
            cases.extend_from_slice(some);
            Ok(go_on(part))
        })?;
        Ok(cases)
    }

    /// Cases `from` to `count`, given to `take` in their order, some at once, with the part
    /// done; `take` may say that it is enough.
    ///
    /// # Errors
    /// As [`Self::play`], and what `take` says.
    pub fn play_from(&self, from: u64, count: u64, take: &mut Take<'_>) -> Result<(), FaultsError> {
        let indices: Vec<u64> = (from..count).collect();
        let mut done = from;
        if !take(done as f64 / count as f64, &[])? {
            return Ok(());
        }
        for some in indices.chunks(AT_ONCE * rayon::current_num_threads()) {
            let cases: Result<Vec<_>, _> = some.par_iter().map(|k| self.case(*k)).collect();
            done += some.len() as u64;
            if !take(done as f64 / count as f64, &cases?)? {
                return Ok(());
            }
        }
        Ok(())
    }
}
