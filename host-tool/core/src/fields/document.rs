//! The text of a session or wearer file, and everything that is wrong with it.

use std::cell::RefCell;
use std::collections::HashSet;
use std::ops::Range;
use std::sync::Arc;

use toml::de::DeTable;

use super::error::{MOST, Place, Problem, SessionError};
use super::field::Section;
use super::table::Table;
use super::visible::{blanked, visible};

/// What a message quotes at most of a value, characters.
const LONGEST_GIVEN: usize = 100;

/// The text of a session file, and what is wrong with it.
pub(crate) struct Document {
    name: String,
    pub(crate) text: Arc<str>,
    told: RefCell<Vec<SessionError>>,
    /// Numbers beyond all that their field may be: told unless a rule between
    /// fields refuses them more precisely.
    doubts: RefCell<Vec<SessionError>>,
}

impl Document {
    pub(crate) fn new(name: &str, text: &str) -> Self {
        Self {
            name: visible(name),
            text: blanked(text).into(),
            told: RefCell::default(),
            doubts: RefCell::default(),
        }
    }

    /// Holds a text against the fields of `section`, and gives it to `read`, which makes
    /// of it what it is, or tells what is wrong; of a text that is no TOML nothing is read.
    ///
    /// # Errors
    /// Everything that is wrong, once.
    pub(crate) fn parse<T>(
        name: &str,
        text: &str,
        section: &'static Section,
        read: impl FnOnce(&Self, &Table<'_>) -> Option<T>,
    ) -> Result<T, SessionError> {
        let doc = Self::new(name, text);
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
                let reason = e.message().into();
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

    /// Tells everything that is wrong with another file.
    pub(crate) fn tell(&self, e: SessionError) {
        self.told.borrow_mut().extend(e.each());
    }

    /// Tells a problem at a place.
    pub(crate) fn say(&self, problem: Problem, place: Place) {
        let error = SessionError::at(problem, &self.name, &self.text, place);
        self.told.borrow_mut().push(error);
    }

    pub(crate) fn doubt(&self, problem: Problem, place: Place) {
        let error = SessionError::at(problem, &self.name, &self.text, place);
        self.doubts.borrow_mut().push(error);
    }

    /// Whether nothing is wrong so far.
    pub(crate) fn is_sound(&self) -> bool {
        self.told.borrow().is_empty() && self.doubts.borrow().is_empty()
    }

    /// Everything that is wrong, once.
    pub(crate) fn finish(self) -> Option<SessionError> {
        let mut told = self.told.into_inner();
        let mut seen = HashSet::new();
        told.retain(|e| seen.insert((e.offset(), e.to_string())));
        let places: HashSet<usize> = told.iter().map(SessionError::offset).collect();
        let doubts = self.doubts.into_inner().into_iter();
        told.extend(doubts.filter(|doubt| !places.contains(&doubt.offset())));
        SessionError::all_of(told)
    }

    /// What the file says at `span`, at most one line and [`LONGEST_GIVEN`] characters.
    pub(crate) fn given(&self, span: &Range<usize>) -> String {
        let text = self.text.get(span.clone()).unwrap_or_default();
        let line = text.lines().next().unwrap_or_default().trim();
        match line.char_indices().nth(LONGEST_GIVEN) {
            Some((end, _)) => format!("{}…", line.get(..end).unwrap_or_default()),
            None => line.into(),
        }
    }
}
