//! A whole file: reads its text from disk and checks it against its declared fields.

use hal_sim::input;
use std::path::Path;

use toml::de::DeTable;

use super::document::Document;
use super::error::{MOST, Place, Problem};
use super::field::Section;
use super::refused::SessionError;
use super::table::Table;

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
    let mut told = None;
    for e in broken.iter().take(MOST) {
        let span = e.span().unwrap_or(0..0);
        // A duplicate table or field leaves the first one intact.
        is_broken |= !e.message().contains("duplicate key");
        // Further errors on the same line follow from the first.
        if told.replace(line(span.start)) != Some(line(span.start)) {
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
/// `at`, where TOML expects the end of the value.
fn decimal_comma(text: &str, at: usize) -> &'static str {
    let (before, after) = text.split_at_checked(at).unwrap_or(("", ""));
    let is_between = before.ends_with(|c: char| c.is_ascii_digit())
        && after
            .strip_prefix(',')
            .is_some_and(|after| after.starts_with(|c: char| c.is_ascii_digit()));
    match is_between {
        true => "; numbers have a decimal point, as in 8.5",
        false => "",
    }
}

/// Returns the text of the session or wearer file at `path`, or the reason why it cannot be read.
pub(crate) fn read_text(path: &Path) -> Result<String, String> {
    let text = input::read_text(path, input::LONGEST_TYPED);
    text.map_err(|why| format!("{}: {why}", path.display()))
}
