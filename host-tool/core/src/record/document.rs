//! docs/record.md, with its tables made from the columns themselves.

use super::columns::{EDGES, MARKERS, SAMPLES, in_markdown};

/// The text of docs/record.md.
#[must_use]
pub fn document() -> String {
    include_str!("record.md")
        .replace("{samples}", in_markdown(&SAMPLES).trim_end())
        .replace("{edges}", in_markdown(&EDGES).trim_end())
        .replace("{markers}", in_markdown(&MARKERS).trim_end())
}
