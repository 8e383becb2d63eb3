//! The text of a session or wearer file, and everything that is wrong with it.

use std::cell::RefCell;
use std::collections::HashSet;
use std::ops::Range;
use std::sync::Arc;

use super::error::{Place, Problem};
use super::refused::SessionError;
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
