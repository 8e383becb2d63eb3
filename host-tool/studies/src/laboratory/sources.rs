//! Reads the sessions that a declaration names, each of them once.

use super::condition::{Texts, relative_to_session};
use super::declaration::Declaration;
use super::error::{LaboratoryError, Mistake};
use super::written::DeclarationText;
use host_core::run::SessionFile;
use host_core::session::unreadable_wearer;
use std::cell::RefCell;
use std::collections::BTreeMap;
use toml::Table;

/// Returns path and text of each session that the declaration names, in its order, and a mistake
/// for each session that cannot be read.
pub(super) fn sessions(
    d: &Declaration,
    text: &str,
    texts: Texts<'_>,
) -> (Vec<(String, String)>, Vec<Mistake>) {
    let (mut pairs, mut mistakes) = (Vec::new(), Vec::new());
    for (session, level) in d.sessions() {
        match texts(session) {
            Ok(own) if is_session(&own) => pairs.push((session.to_owned(), own)),
            // The message must not show the contents of an unrelated file.
            Ok(_) => {
                let why = "it has neither `channel` nor `setpoints`, so it is not a session";
                mistakes.push(missing_session(d, text, (session, level), why));
            }
            Err(error) => {
                mistakes.push(missing_session(d, text, (session, level), &error.reason()))
            }
        }
    }
    (pairs, mistakes)
}

/// Returns whether a text looks like a session file, because it has a channel or setpoints.
fn is_session(text: &str) -> bool {
    let (root, _) = toml::de::DeTable::parse_recoverable(text);
    let has = |field: &&str| root.get_ref().contains_key(*field);
    ["channel", "setpoints"].iter().any(has)
}

/// Creates the mistake for a session that cannot be read, with the reason `why` and the level that
/// names the session.
fn missing_session(
    d: &Declaration,
    text: &str,
    (session, level): (&str, Option<(usize, usize)>),
    why: &str,
) -> Mistake {
    let written = DeclarationText::new(text);
    let line = match level {
        None => written.line_of("session"),
        Some((factor, level)) => written.line_of_level(factor, level),
    };
    let of_level = level.and_then(|(f, l)| {
        let factor = d.factors.get(f)?;
        let level = factor.levels.get(l)?;
        Some(format!(
            " of level `{}` of factor `{}`",
            level.name, factor.name
        ))
    });
    let of_level = of_level.unwrap_or_default();
    let message = format!(
        "the session `{session}`{of_level} cannot be read: {why}; its path is relative to the \
         declaration's folder"
    );
    Mistake::at(line, &message)
}

/// Returns the text of the file `name` from the cache `before`, or reads it and adds it to the
/// cache.
pub(super) fn read_cached(
    before: &RefCell<BTreeMap<String, String>>,
    name: &str,
    texts: Texts<'_>,
) -> Result<String, LaboratoryError> {
    if let Some(text) = before.borrow().get(name) {
        return Ok(text.clone());
    }
    let text = texts(name)?;
    before.borrow_mut().insert(name.to_owned(), text.clone());
    Ok(text)
}

/// Parses each session into a table that the conditions can change; returns the tables by the path
/// of their session.
pub(super) fn tables<'s>(
    sessions: &'s [(String, String)],
    texts: Texts<'_>,
) -> Result<BTreeMap<&'s str, Table>, LaboratoryError> {
    let table = |(name, text): &(String, String)| -> Result<Table, LaboratoryError> {
        // The session parser reports all its mistakes.
        SessionFile::parse_with_wearers(name, text, &|file| {
            let text = texts(&relative_to_session(name, file));
            text.map_err(|error| unreadable_wearer(file, &error.reason()))
        })?;
        Ok(text.parse().unwrap_or_default())
    };
    let pairs = sessions.iter();
    pairs.map(|pair| Ok((&*pair.0, table(pair)?))).collect()
}
