//! The kinds of fault that a class draws from.

use super::declaration::Declaration;
use super::error::FaultsError;
use super::simulated::Boards;
use hal_sim::random::{Random, word};

/// Kinds that the boards of a campaign can have, and where their draws begin.
pub(super) struct Kinds {
    names: Vec<String>,
    seed: u64,
}

impl Kinds {
    /// `stream` tells the draws of one class from another's.
    pub fn of(declaration: &Declaration, boards: &impl Boards, seed: u64, stream: u64) -> Self {
        let of = &declaration.of;
        let names = boards.kinds(&of.kinds, &of.native_kinds).to_vec();
        let seed = word(seed, stream);
        Self { names, seed }
    }

    /// The kind of case `index`, and what else it is to draw from.
    ///
    /// # Errors
    /// The declaration has none.
    pub fn draw(&self, index: u64) -> Result<(&str, Random), FaultsError> {
        let mut random = Random::new(word(self.seed, index));
        let kind = random.below(self.names.len().max(1) as u64) as usize;
        match self.names.get(kind) {
            Some(kind) => Ok((kind, random)),
            None => Err(FaultsError::Declaration("no kinds".into())),
        }
    }

    /// All of them, told apart by commas.
    pub fn in_words(&self) -> String {
        self.names.join(", ")
    }
}
