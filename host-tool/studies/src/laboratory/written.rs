//! Parses a declaration piece by piece, so that all mistakes are found at once, and finds the lines
//! of its parts.

use super::declaration::Declaration;
use super::error::Mistake;
use serde::de::DeserializeOwned;
use toml::Spanned;
use toml::de::{DeTable, DeValue, Error, ValueDeserializer};

/// The text of a declaration, with the TOML tables parsed from it.
pub(super) struct DeclarationText<'t> {
    text: &'t str,
    root: Spanned<DeTable<'t>>,
    /// Errors in the TOML syntax of the text.
    broken: Vec<Error>,
    /// List elements that could not be parsed: name of the list, and index of the element.
    unread: Vec<(&'static str, usize)>,
}

impl<'t> DeclarationText<'t> {
    pub(super) fn new(text: &'t str) -> Self {
        let (root, broken) = DeTable::parse_recoverable(text);
        Self {
            text,
            root,
            broken,
            unread: Vec::new(),
        }
    }

    /// Returns the line, from 1, of `field` in element `nth` of `list`, or the line of the element
    /// if it has no such field. Elements that could not be parsed are not counted.
    pub(super) fn line(&self, list: &str, nth: usize, field: &str) -> Option<usize> {
        let is_read = |place: &usize| {
            let mut unread = self.unread.iter();
            !unread.any(|(name, other)| *name == list && other == place)
        };
        let place = (0..).filter(is_read).nth(nth)?;
        let element = self.root.get_ref().get(list)?.get_ref().get(place)?;
        let part = element.get_ref().get(field).unwrap_or(element);
        Some(self.line_at(part.span().start))
    }

    /// Returns the line, from 1, of a top-level field.
    pub(super) fn line_of(&self, field: &str) -> Option<usize> {
        let part = self.root.get_ref().get(field)?;
        Some(self.line_at(part.span().start))
    }

    /// Returns the line, from 1, of a level of a factor, given both indices.
    pub(super) fn line_of_level(&self, factor: usize, level: usize) -> Option<usize> {
        let factor = self.root.get_ref().get("factor")?.get_ref().get(factor)?;
        let level = factor.get_ref().get("level")?.get_ref().get(level)?;
        Some(self.line_at(level.span().start))
    }

    /// Returns whether the file contains the subtable `field` of `table`, and it is empty.
    pub(super) fn is_empty(&self, table: &str, field: &str) -> bool {
        let table = self.root.get_ref().get(table).map(Spanned::get_ref);
        let own = table.and_then(|table| table.get(field));
        let own = own.and_then(|own| own.get_ref().as_table());
        own.is_some_and(|own| own.is_empty())
    }

    /// Returns whether the file contains a claim with this identifier that could not be parsed.
    pub(super) fn is_unread_claim(&self, id: &str) -> bool {
        let claims = self.root.get_ref().get("claim").map(Spanned::get_ref);
        let mut unread = self.unread.iter().filter(|(list, _)| *list == "claim");
        unread.any(|(_, place)| {
            let claim = claims.and_then(|claims| claims.get(*place));
            let own = claim.and_then(|claim| claim.get_ref().get("id"));
            own.and_then(|own| own.get_ref().as_str()) == Some(id)
        })
    }

    fn line_at(&self, offset: usize) -> usize {
        let before = self.text.get(..offset).unwrap_or(self.text);
        before.matches('\n').count() + 1
    }

    /// Parses the declaration piece by piece, so that one mistake does not hide the next. Returns
    /// every mistake. The declaration is `None` if too much depends on the wrong parts.
    pub(super) fn read(&mut self) -> (Option<Declaration>, Vec<Mistake>) {
        let broken = std::mem::take(&mut self.broken);
        if !broken.is_empty() {
            let mistakes = broken.iter().map(|error| self.mistake_at(error, 0));
            return (None, mistakes.collect());
        }
        if self.root.get_ref().contains_key("channel") {
            let message = "this is a session file, not a declaration; play it with `flexor run`";
            return (None, vec![Mistake::at(self.line_of("channel"), message)]);
        }
        let mut root = self.root.clone();
        let table = root.get_mut();
        let mut errors = Vec::new();
        let factors = self.read_list(table, "factor", &mut errors);
        let has_factors = errors.is_empty();
        let drawn = self.read_list(table, "draw", &mut errors);
        let grid = self.read_list(table, "grid", &mut errors);
        let claims = self.read_list(table, "claim", &mut errors);
        let printed = self.read_list(table, "printed", &mut errors);
        let rest: Option<Declaration> = self.read_table(root.into_inner(), 0, &mut errors);
        let declaration = rest.filter(|_| has_factors).map(|rest| Declaration {
            factors,
            drawn,
            grid,
            claims,
            printed,
            ..rest
        });
        (declaration, errors)
    }

    /// Removes the list `list` from `table` and parses each of its elements; adds a mistake for
    /// each that fails.
    fn read_list<T: DeserializeOwned>(
        &mut self,
        table: &mut DeTable<'_>,
        list: &'static str,
        errors: &mut Vec<Mistake>,
    ) -> Vec<T> {
        let Some(DeValue::Array(elements)) = table.get(list).map(Spanned::get_ref) else {
            return Vec::new(); // parsing the rest reports a value that is no list
        };
        let mut values = Vec::new();
        for (place, element) in elements.iter().enumerate() {
            let at = element.span().start;
            let read = match element.get_ref() {
                DeValue::Table(table) => self.read_table(table.clone(), at, errors),
                _ => self.read_value(element.clone(), at, errors),
            };
            match read {
                Some(value) => values.push(value),
                None => self.unread.push((list, place)),
            }
        }
        table.remove(list);
        values
    }

    /// Parses a table that starts at byte `at` of the text. Each part that fails is reported and
    /// removed, and the rest is parsed again. If a removed field is then reported as missing, that
    /// error is dropped and `None` is returned.
    fn read_table<T: DeserializeOwned>(
        &self,
        mut table: DeTable<'_>,
        at: usize,
        errors: &mut Vec<Mistake>,
    ) -> Option<T> {
        let mut taken: Vec<String> = Vec::new();
        loop {
            let value = Spanned::new(at..at, DeValue::Table(table.clone()));
            let error = match read(ValueDeserializer::from(value)) {
                Ok(parsed) => return taken.is_empty().then_some(parsed),
                Err(error) => error,
            };
            let lacks = |field: &String| error.message() == format!("missing field `{field}`");
            let is_told = taken.iter().any(lacks);
            if !is_told {
                errors.push(self.mistake_at(&error, at));
            }
            let offset = error.span().map_or(at, |span| span.start);
            taken.push(remove_at(&mut table, offset, !is_told)?);
        }
    }

    /// Parses a list element that is not a table, at byte `at` of the text.
    fn read_value<T: DeserializeOwned>(
        &self,
        value: Spanned<DeValue<'_>>,
        at: usize,
        errors: &mut Vec<Mistake>,
    ) -> Option<T> {
        let read = read(ValueDeserializer::from(value));
        read.map_err(|error| errors.push(self.mistake_at(&error, at)))
            .ok()
    }

    /// Creates the mistake for a parser error at its position, or at byte `piece` if the error has
    /// none.
    fn mistake_at(&self, error: &Error, piece: usize) -> Mistake {
        let offset = error.span().map_or(piece, |span| span.start);
        Mistake::at(Some(self.line_at(offset)), error.message())
    }
}

/// Removes the entry of a table that is at byte `offset` of the text; with `deep`, a field of a
/// nested table. Returns the name of the entry, or `None` if there is none.
fn remove_at(table: &mut DeTable<'_>, offset: usize, deep: bool) -> Option<String> {
    let fields = table.iter().map(|(key, _)| key);
    let before = fields.filter(|key| key.span().start <= offset);
    let name = before.max_by_key(|key| key.span().start)?;
    let name = name.get_ref().to_string();
    let value = table.get_mut(&*name)?.get_mut();
    let within = match value {
        DeValue::Table(inner) if deep => remove_at(inner, offset, deep),
        DeValue::Array(list) if deep => {
            let before = list
                .iter_mut()
                .filter(|element| element.span().start <= offset);
            before.last().and_then(|element| match element.get_mut() {
                DeValue::Table(inner) => remove_at(inner, offset, deep),
                _ => None,
            })
        }
        _ => None,
    };
    if within.is_none() {
        table.remove(&*name);
    }
    within.or(Some(name))
}

fn read<'t, T: DeserializeOwned>(
    from: impl serde::Deserializer<'t, Error = Error>,
) -> Result<T, Error> {
    T::deserialize(from)
}
