//! The kinds of fault that a class draws from.

use super::declaration::Declaration;
use super::error::FaultsError;
use super::simulated::Boards;
use hal_sim::random::{Random, word};

/// Kinds that the boards of a campaign can have, and where their draws begin.
pub(super) struct Kinds {
    names: Vec<String>,
    /// What all cases from a number on are.
    later: Option<(u64, String)>,
    seed: u64,
}

impl Kinds {
    /// `stream` tells the draws of one class from another's.
    pub fn new(declaration: &Declaration, boards: &impl Boards, seed: u64, stream: u64) -> Self {
        let of = &declaration.of;
        let names = boards.select(&*of.kinds, &*of.native_kinds).to_vec();
        let later = of.later.as_ref();
        let later = later.map(|later| {
            (
                *boards.select(&later.from, &later.native_from),
                later.kind.clone(),
            )
        });
        let seed = word(seed, stream);
        Self { names, later, seed }
    }

    /// The kind of case `index`, and what else it is to draw from.
    ///
    /// # Errors
    /// The declaration has none.
    pub fn draw(&self, index: u64) -> Result<(&str, Random), FaultsError> {
        let mut random = Random::new(word(self.seed, index));
        let kind = random.below(self.names.len().max(1) as u64) as usize;
        let later = self.later.as_ref().filter(|(from, _)| *from <= index);
        match later.map(|(_, kind)| kind).or(self.names.get(kind)) {
            Some(kind) => Ok((kind, random)),
            None => Err(FaultsError::Declaration("no kinds".into())),
        }
    }

    /// All of them, told apart by commas.
    pub fn in_words(&self) -> String {
        let later = self.later.iter();
        let later = later.map(|(from, kind)| format!("{kind} from case {from} on"));
        let all: Vec<_> = self.names.iter().cloned().chain(later).collect();
        all.join(", ")
    }
}
