//! Fault campaigns: injects random faults into the simulated device and judges whether any output
//! becomes dangerous.
//!
//! Contains the preregistered number and kind of faults ([`Declaration`]), a board and its host
//! that can be forked ([`bench`](self)), one file per fault class, and the resulting tables and
//! files ([`Run`]). The rules for severe output are in `hal_sim::trace::judge`, which shares
//! nothing with `firmware`; storing and resuming cases in `laboratory`; the command in `cli`. Takes
//! a class, a seed and an image; returns [`Case`]s and their [`Outcome`].

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

/// Generates and plays the cases of a fault class.
trait Draws: Sync {
    /// Generates and plays case `index`, which depends only on the seed and this number.
    fn case(&self, index: u64) -> Result<Case, FaultsError>;

    /// Returns notes that the reader needs to interpret the numbers.
    fn notes(&self) -> Vec<String>;
}

/// A campaign of one fault class that is ready to run its cases.
pub struct Campaign {
    draws: Box<dyn Draws + Send>,
}

impl Campaign {
    /// Prepares the class of `declaration` on the chip simulator, with `image` in its flash.
    ///
    /// # Errors
    /// Fails if the board does not stimulate without a fault, or if the image lacks what the class
    /// breaks.
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

    /// Prepares the class of `declaration` on the native backend.
    ///
    /// # Errors
    /// Fails if the native backend cannot simulate this class.
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

    /// Returns notes that the reader needs to interpret the numbers.
    #[must_use]
    pub fn notes(&self) -> Vec<String> {
        self.draws.notes()
    }

    /// Plays the single case `index`.
    ///
    /// # Errors
    /// Fails if the case cannot be set up, before any fault is injected.
    pub fn case(&self, index: u64) -> Result<Case, FaultsError> {
        self.draws.case(index)
    }
}
