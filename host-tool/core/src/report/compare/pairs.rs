//! Matching of the trials of several records.

use super::{ComparedRecord, ComparedTrial};
use std::collections::HashMap;

/// Trials of several records that correspond to each other and are compared.
pub(super) struct Group<'a> {
    /// Name of the group, which is the name of its first trial.
    pub name: &'a str,
    /// The trials, each with the number of its record, from 1; at most one trial of each record.
    pub trials: Vec<(usize, &'a ComparedTrial)>,
}

impl Group<'_> {
    /// Returns whether the doses of any trial differ from those of the first.
    pub(super) fn differs(&self) -> bool {
        let channels = |n: usize| &self.trials[n].1.row.channels;
        (1..self.trials.len()).any(|n| channels(n) != channels(0))
    }
}

/// Groups the trials of the records. Trials with the same name belong together; if a record has
/// several trials of one name, its n-th of them belongs to the n-th of the other records. Trials at
/// the same position belong together instead if each record has one trial, or if no name occurs in
/// two records.
pub(super) fn groups(records: &[ComparedRecord]) -> Vec<Group<'_>> {
    let are_single = records.iter().all(|compared| compared.trials.len() == 1);
    let by_name = match are_single {
        true => Vec::new(),
        false => group_by_key(records, name_key),
    };
    match by_name.iter().any(|group| group.trials.len() > 1) {
        true => by_name,
        false => group_by_key(records, |_, place| ("", place)),
    }
}

/// Returns the key by which a trial is grouped: its name, and how many earlier trials of the record
/// have that name.
fn name_key(compared: &ComparedRecord, place: usize) -> (&str, usize) {
    let name = |kept: &ComparedTrial| kept.row.trial == compared.trials[place].row.trial;
    let before = compared.trials[..place].iter().filter(|kept| name(kept));
    (&compared.trials[place].row.trial, before.count())
}

/// Groups the trials whose `key` is equal. A key must occur at most once in each record.
fn group_by_key<'a>(
    records: &'a [ComparedRecord],
    key: fn(&'a ComparedRecord, usize) -> (&'a str, usize),
) -> Vec<Group<'a>> {
    let mut groups: Vec<Group<'a>> = Vec::new();
    let mut places: HashMap<(&str, usize), usize> = HashMap::new();
    for (position, compared) in records.iter().enumerate() {
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
