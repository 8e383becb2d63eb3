//! Differences between the session files of trials, and between their wearer files.

use super::ComparedRecord;
use super::files::FileDifference;
use super::pairs::{Group, groups};

/// Compares the session files and wearer files of corresponding trials. The files of the first
/// record that has the trial are compared with those of each other record.
#[must_use]
pub fn session_differences(records: &[ComparedRecord]) -> Vec<FileDifference> {
    groups(records).iter().flat_map(group_differences).collect()
}

/// Compares the session files and wearer files within one group of trials.
pub(super) fn group_differences(group: &Group<'_>) -> Vec<FileDifference> {
    let mut found: Vec<(&str, FileDifference)> = Vec::new();
    let Some(((from, first), others)) = group.trials.split_first() else {
        return Vec::new();
    };
    for (to, other) in others {
        let files = [
            ("session.toml", &first.session, &other.session),
            ("wearer.toml", &first.wearer, &other.wearer),
        ];
        // A session file that is missing, or is not the one that was run, is not compared.
        let is_usable = !first.session.is_empty() && !other.session.is_empty();
        for (file, first_text, another) in files.into_iter().skip(usize::from(!is_usable)) {
            let is_known = |(text, known): &&mut (&str, FileDifference)| {
                known.file == file && *text == another.as_str()
            };
            if let Some((_, known)) = found.iter_mut().find(is_known) {
                known.to.push(*to);
                continue;
            }
            let comparison =
                FileDifference::between((file, group.name), (*from, first_text), (*to, another));
            found.extend(comparison.map(|file_difference| (another.as_str(), file_difference)));
        }
    }
    found
        .into_iter()
        .map(|(_, difference)| difference)
        .collect()
}
