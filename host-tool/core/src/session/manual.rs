//! The tables of docs/sessions.md.

use super::fields::FILE;
use crate::fields::manual_of;

/// The fields of the table at `path`, as a table of Markdown; nothing if there is no
/// such table. A part of a path is a field's name, with `=` and a word where several
/// are declared.
#[must_use]
pub fn manual(path: &str) -> Option<String> {
    manual_of(&FILE, path)
}
