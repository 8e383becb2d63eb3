//! A whole file: reads its text from disk and checks it against its declared fields.

use super::document::Document;
use super::error::{MOST, Place, Problem};
use super::field::Section;
use super::refused::SessionError;
use super::table::Table;
use hal_sim::input;
use std::collections::BTreeSet;
use std::path::Path;
use toml::de::DeTable;

/// Checks `text` against the fields of `section` and passes it to `read`, which returns the content
/// or reports errors. `name` is the file name in error messages. A text that is not valid TOML is
/// not passed to `read`.
///
/// # Errors
/// All errors of the text, each once.
pub(crate) fn parse<T>(
    name: &str,
    text: &str,
    section: &'static Section,
    read: impl FnOnce(&Document, &Table<'_>) -> Option<T>,
) -> Result<T, SessionError> {
    let doc = Document::new(name, text);
    let (root, broken) = DeTable::parse_recoverable(text);
    let mut is_broken = false;
    let line = |at: usize| text.get(..at).map(|before| before.matches('\n').count());
    let mut reported_lines = BTreeSet::new();
    for e in broken.iter().take(MOST) {
        let span = e.span().unwrap_or(0..0);
        // A duplicate table or field leaves the first one intact.
        is_broken |= !e.message().contains("duplicate key");
        // Further errors on the same line follow from the first.
        if reported_lines.insert(line(span.start)) {
            let reason = e.message().to_owned() + decimal_comma(text, span.start);
            let place = Place {
                span,
                ..Place::default()
            };
            doc.report(Problem::Syntax { reason }, place);
        }
    }
    let content = (!is_broken).then(|| read(&doc, &Table::root(&doc, &root, section)));
    match (doc.into_error(), content.flatten()) {
        (Some(e), _) => Err(e),
        (None, Some(content)) => Ok(content),
        (None, None) => unreachable!("a file is read, or a mistake is reported"),
    }
}

/// Returns advice about a decimal comma. It is empty unless there is a comma between two digits at
/// `at`, where TOML expects the end of the value, or just before it, where TOML expects a key of an
/// inline table.
fn decimal_comma(text: &str, at: usize) -> &'static str {
    let is_digit = |c: char| c.is_ascii_digit();
    let (before, after) = text.split_at_checked(at).unwrap_or(("", ""));
    let is_between = |before: &str, after: &str| {
        let fraction = after.strip_prefix(',');
        before.ends_with(is_digit) && fraction.is_some_and(|digits| digits.starts_with(is_digit))
    };
    let number = before.trim_end_matches(is_digit);
    let is_behind = number
        .strip_suffix(',')
        .is_some_and(|head| before.len() > number.len() && head.ends_with(is_digit));
    match is_between(before, after) || is_behind {
        true => "; numbers have a decimal point, as in 8.5",
        false => "",
    }
}

/// Returns the text of the session or wearer file at `path`, or the reason why it cannot be read.
pub(crate) fn read_text(path: &Path) -> Result<String, String> {
    let text = input::read_text(path, input::LONGEST_TYPED);
    text.map_err(|why| format!("{}: {why}", path.display()))
}
