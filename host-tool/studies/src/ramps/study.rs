//! The study as it is asked for.

use super::declared::Declared;
use super::error::RampsError;
use super::found::{Found, Pulses};
use super::test::{Stimulation, stimulations};
use host_core::run::DeviceName;

/// What a command calls it.
pub const NAME: &str = "harris-ramps";
/// The paper's participants: the first persons drawn.
pub(super) const PARTICIPANTS: u64 = 2;

/// The study.
#[derive(Clone, Debug)]
pub struct Study {
    pub(super) declared: Declared,
    /// Of everybody's draws.
    pub(super) seed: u64,
    /// Persons.
    pub(super) draws: u64,
    pub(super) device: DeviceName,
}

impl Study {
    /// With this seed and so many persons; the declaration's own without.
    ///
    /// # Errors
    /// E690: the declaration cannot be read.
    pub fn asked(
        (seed, draws): (Option<u64>, Option<u64>),
        device: DeviceName,
    ) -> Result<Self, RampsError> {
        let declared = Declared::own()?;
        Ok(Self {
            seed: seed.unwrap_or(declared.seed),
            draws: draws.unwrap_or(declared.draws),
            declared,
            device,
        })
    }

    /// Persons that are computed: the two participants are always shown.
    #[must_use]
    pub fn persons(&self) -> u64 {
        self.draws.max(PARTICIPANTS)
    }

    /// Persons drawn, as asked.
    #[must_use]
    pub const fn draws(&self) -> u64 {
        self.draws
    }

    /// What was declared.
    #[must_use]
    pub const fn declared(&self) -> &Declared {
        &self.declared
    }

    /// The pulses of every stimulation as they are meant.
    #[must_use]
    pub fn meant(&self) -> Pulses {
        let protocol = &self.declared.protocol;
        let all = stimulations(protocol).into_iter();
        all.chain([Stimulation::Biceps])
            .map(|it| (it, it.meant(protocol)))
            .collect()
    }

    /// What comes of person `index` under these pulses.
    ///
    /// # Errors
    /// E690, E691: a declaration or a bench that cannot be.
    pub fn part(&self, index: u64, pulses: &Pulses) -> Result<Found, RampsError> {
        let is_shown = index < PARTICIPANTS;
        Found::of(&self.declared, (self.seed, index), pulses, is_shown)
    }
}
