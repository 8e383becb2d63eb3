//! Matching of the trials of several records.

use super::{ComparedRecord, ComparedTrial};
use std::collections::HashMap;

/// Trials of several records that are compared with each other.
pub(super) struct Group<'a> {
    /// Name of the first trial.
    pub name: &'a str,
    /// Number of the record, from 1, and its trial; at most one trial of each record.
    pub trials: Vec<(usize, &'a ComparedTrial)>,
}

impl Group<'_> {
    /// Returns whether the output of channels differs between any two trials.
    pub(super) fn differs(&self) -> bool {
        let channels = |n: usize| &self.trials[n].1.row.channels;
        (1..self.trials.len()).any(|n| channels(n) != channels(0))
    }
}

/// Returns the groups of trials with the same name, matched in the order in which they occur: the
/// first of a name with the first, and so on. If each record has one trial, or if no name occurs in
/// two records, trials at the same position are matched.
pub(super) fn groups(all: &[ComparedRecord]) -> Vec<Group<'_>> {
    let are_single = all.iter().all(|compared| compared.trials.len() == 1);
    let by_name = match are_single {
        true => Vec::new(),
        false => group_by_key(all, name_key),
    };
    match by_name.iter().any(|group| group.trials.len() > 1) {
        true => by_name,
        false => group_by_key(all, |_, place| ("", place)),
    }
}

/// Returns the name of a trial, and the number of trials of that name before it.
fn name_key(compared: &ComparedRecord, place: usize) -> (&str, usize) {
    let name = |kept: &ComparedTrial| kept.row.trial == compared.trials[place].row.trial;
    let before = compared.trials[..place].iter().filter(|kept| name(kept));
    (&compared.trials[place].row.trial, before.count())
}

/// Returns the groups of trials with the same key, with at most one trial of each record.
fn group_by_key<'a>(
    all: &'a [ComparedRecord],
    key: fn(&'a ComparedRecord, usize) -> (&'a str, usize),
) -> Vec<Group<'a>> {
    let mut groups: Vec<Group<'a>> = Vec::new();
    let mut places: HashMap<(&str, usize), usize> = HashMap::new();
    for (position, compared) in all.iter().enumerate() {
        for (place, kept) in compared.trials.iter().enumerate() {
            let own = *places.entry(key(compared, place)).or_insert_with(|| {
                groups.push(Group {
                    name: &kept.row.trial,
                    trials: Vec::new(),
                });
                groups.len() - 1
            });
            groups[own].trials.push((position + 1, kept));
        }
    }
    groups
}
