//! A file as a whole: its text from disk, and held against its fields.

use hal_sim::input;
use std::path::Path;

use toml::de::DeTable;

use super::document::Document;
use super::error::{MOST, Place, Problem};
use super::field::Section;
use super::refused::SessionError;
use super::table::Table;

/// Holds a text against the fields of `section`, and gives it to `read`, which makes
/// of it what it is, or tells what is wrong; of a text that is no TOML nothing is read.
///
/// # Errors
/// Everything that is wrong, once.
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
        // A second table or field takes nothing from the first.
        is_broken |= !e.message().contains("duplicate key");
        // What follows on the line is a consequence.
        if told.replace(line(span.start)) != Some(line(span.start)) {
            let reason = e.message().to_owned() + decimal_comma(text, span.start);
            let place = Place {
                span,
                ..Place::default()
            };
            doc.say(Problem::Syntax { reason }, place);
        }
    }
    let it = (!is_broken).then(|| read(&doc, &Table::root(&doc, &root, section)));
    match (doc.finish(), it.flatten()) {
        (Some(e), _) => Err(e),
        (None, Some(it)) => Ok(it),
        (None, None) => unreachable!("a file is read, or something is told"),
    }
}

/// What to do about a comma between digits at `at`, where TOML expects the end of the value.
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

/// The text of a session or wearer file, or why there is none.
pub(crate) fn text_of(path: &Path) -> Result<String, String> {
    let text = input::read_text(path, input::LONGEST_TYPED);
    text.map_err(|why| format!("{}: {why}", path.display()))
}
