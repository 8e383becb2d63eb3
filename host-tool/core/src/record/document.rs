//! The text of docs/reference/record.md, whose tables are generated from the declared columns.

use super::columns::{EDGES, MARKERS, SAMPLES, to_markdown};

/// Returns the text of docs/reference/record.md, with tables that are generated from the column descriptions.
#[must_use]
pub fn document() -> String {
    include_str!("record.md")
        .replace("{samples}", to_markdown(&SAMPLES).trim_end())
        .replace("{edges}", to_markdown(&EDGES).trim_end())
        .replace("{markers}", to_markdown(&MARKERS).trim_end())
}
