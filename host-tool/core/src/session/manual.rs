//! Tables of session fields in docs/reference/sessions.md.

use super::fields::FILE;
use crate::fields::fields_as_markdown;

/// Returns the fields of the table at `path` as a Markdown table, or `None` if there is no such
/// table. In `path`, dots separate the names of the fields that lead to the table. If a field is
/// declared several times, `=` and the word that selects the declaration follow the name.
#[must_use]
pub fn manual(path: &str) -> Option<String> {
    fields_as_markdown(&FILE, path)
}
