//! The kinds of fault that a class chooses from.

use super::declaration::Declaration;
use super::error::FaultsError;
use super::simulated::Boards;
use hal_sim::random::{Random, word};

/// Kinds of fault that this campaign's boards can have, with the seed from which cases choose.
pub(super) struct Kinds {
    names: Vec<String>,
    /// Number of the first case with the kind that was added later, and the name of that kind.
    later: Option<(u64, String)>,
    seed: u64,
}

impl Kinds {
    /// Collects the kinds of the declaration that `boards` can simulate. `stream` makes the random
    /// numbers of this class independent of those of other classes.
    pub fn new(declaration: &Declaration, boards: &impl Boards, seed: u64, stream: u64) -> Self {
        let campaign = &declaration.of;
        let names = boards
            .select(&*campaign.kinds, &*campaign.native_kinds)
            .to_vec();
        let later = campaign.later.as_ref();
        let later = later.map(|later| {
            (
                *boards.select(&later.from, &later.native_from),
                later.kind.clone(),
            )
        });
        let seed = word(seed, stream);
        Self { names, later, seed }
    }

    /// Returns the randomly chosen kind of case `index`, and a generator for its random details.
    ///
    /// # Errors
    /// Fails if the declaration has no kinds.
    pub fn draw(&self, index: u64) -> Result<(&str, Random), FaultsError> {
        let mut random = Random::new(word(self.seed, index));
        let kind = random.below(self.names.len().max(1) as u64) as usize;
        let later = self.later.as_ref().filter(|(from, _)| *from <= index);
        match later.map(|(_, kind)| kind).or(self.names.get(kind)) {
            Some(kind) => Ok((kind, random)),
            None => Err(FaultsError::Declaration("the class has no kinds".into())),
        }
    }

    /// Lists all kinds, separated by commas.
    pub fn in_words(&self) -> String {
        let later = self.later.iter();
        let later = later.map(|(from, kind)| format!("{kind} from case {from} on"));
        let kinds: Vec<_> = self.names.iter().cloned().chain(later).collect();
        kinds.join(", ")
    }
}
