//! Campaigns of faults: what gets past the device, drawn by seed and judged.
//!
//! Lives here: what is broken how often and when ([`Declaration`], committed before it
//! was judged), a board and its host that can be forked ([`bench`](self)), one file per
//! class of faults, the table and the files that come of it ([`Run`]). Not here: what is
//! severe (`hal_sim::trace::judge`, which shares nothing with `firmware`), how cases are kept
//! and go on (`laboratory`), the command (`cli`).
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
mod kinds;
mod link;
mod measured;
mod orders;
mod outcome;
mod pairs;
mod played_on;
mod published;
mod registers;
mod run;
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

pub use case::{Case, CaseEnd, CaseResult};
pub use declaration::{Class, Declaration, FILES};
pub use error::FaultsError;
pub use outcome::Outcome;
pub use run::Run;
pub use table::csv;
pub use truth::declared_truth;

use allowance::AllowanceAttack;
use cpu::Core;
use declared::DeclarationFaults;
use electrode::Electrode;
use flips::Flips;
use hal_sim::chip::image::Image;
use link::Link;
use pairs::Pairs;
use registers::Registers;
use sensor::Sensor;
use simulated::Native;
use streams::Streams;
use supply::Supply;

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
            Class::Declarations => {
                Box::new(DeclarationFaults::new(seed, declaration, image.clone())?)
            }
            Class::Electrode => Box::new(Electrode::new(seed, declaration, image.clone())?),
            Class::Link => Box::new(Link::new(seed, declaration, image.clone())?),
            Class::Sensor => Box::new(Sensor::new(seed, declaration, image.clone())?),
            Class::Streams => Box::new(Streams::new(seed, declaration, image)?),
            Class::Cpu => Box::new(Core::new(seed, declaration, image)?),
            Class::Supply => Box::new(Supply::new(seed, declaration, image)?),
            Class::Pairs => Box::new(Pairs::new(seed, declaration, image)?),
            Class::Allowance => Box::new(AllowanceAttack::new(seed, declaration, image.clone())?),
        };
        Ok(Self { draws })
    }

    /// The same on the native simulator.
    ///
    /// # Errors
    /// It has nothing that this class breaks.
    pub fn native(seed: u64, declaration: &Declaration) -> Result<Self, FaultsError> {
        let draws: Box<dyn Draws + Send> = match declaration.class {
            Class::Declarations => Box::new(DeclarationFaults::new(seed, declaration, Native)?),
            Class::Electrode => Box::new(Electrode::new(seed, declaration, Native)?),
            Class::Link => Box::new(Link::new(seed, declaration, Native)?),
            Class::Sensor => Box::new(Sensor::new(seed, declaration, Native)?),
            Class::Allowance => Box::new(AllowanceAttack::new(seed, declaration, Native)?),
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
    /// It could not be set up: nothing was broken in it yet.
    pub fn case(&self, index: u64) -> Result<Case, FaultsError> {
        self.draws.case(index)
    }
}
