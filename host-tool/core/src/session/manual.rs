//! Tables of session fields in docs/sessions.md.

use super::fields::FILE;
use crate::fields::fields_as_markdown;

/// Returns the fields of the table at `path` as a Markdown table, or `None` if there is no such
/// table. Each part of a path is the name of a field, followed by `=` and a word if the field is
/// declared several times.
#[must_use]
pub fn manual(path: &str) -> Option<String> {
    fields_as_markdown(&FILE, path)
}
