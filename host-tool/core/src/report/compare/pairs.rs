//! Which trials of several records belong together.

use super::{Compared, Kept};

/// Trials of several records that are held against each other.
pub(super) struct Group<'a> {
    /// Name of the first.
    pub name: &'a str,
    /// Number of the record, from 1, and its trial; of each record one at most.
    pub trials: Vec<(usize, &'a Kept)>,
}

impl Group<'_> {
    /// Whether the channels of any two put out something else.
    pub(super) fn differs(&self) -> bool {
        let channels = |n: usize| &self.trials[n].1.row.channels;
        (1..self.trials.len()).any(|n| channels(n) != channels(0))
    }
}

/// Trials of the same name, the first of a name with the first and so on, in the order in
/// which they come; where each record has one trial, those, whatever they are called.
pub(super) fn groups(all: &[Compared]) -> Vec<Group<'_>> {
    let are_single = all.iter().all(|compared| compared.trials.len() == 1);
    let mut groups: Vec<((&str, usize), Group<'_>)> = Vec::new();
    for (position, compared) in all.iter().enumerate() {
        for (place, kept) in compared.trials.iter().enumerate() {
            let name = kept.row.trial.as_str();
            let before = &compared.trials[..place];
            let key = match are_single {
                true => ("", 0),
                false => (
                    name,
                    before.iter().filter(|it| it.row.trial == name).count(),
                ),
            };
            let member = (position + 1, kept);
            match groups.iter_mut().find(|(known, _)| *known == key) {
                Some((_, group)) => group.trials.push(member),
                None => groups.push((
                    key,
                    Group {
                        name,
                        trials: vec![member],
                    },
                )),
            }
        }
    }
    groups.into_iter().map(|(_, group)| group).collect()
}
