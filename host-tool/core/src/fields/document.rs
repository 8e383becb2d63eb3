//! The text of a session or wearer file, and all errors in it.

use std::cell::RefCell;
use std::collections::HashSet;
use std::ops::Range;
use std::sync::Arc;

use super::error::{Place, Problem};
use super::refused::SessionError;
use super::visible::{blank_control_chars, escape_control_chars};

/// Length at which the quotation of a value in a message is cut off, characters.
const LONGEST_GIVEN: usize = 100;

/// The text of a session or wearer file, with the errors that were found in it so far.
pub(crate) struct Document {
    name: String,
    pub(crate) text: Arc<str>,
    told: RefCell<Vec<SessionError>>,
    /// Errors about numbers outside the range of their field. Each is reported in the end, unless
    /// another error at the same place says more precisely what is allowed.
    doubts: RefCell<Vec<SessionError>>,
}

impl Document {
    pub(crate) fn new(name: &str, text: &str) -> Self {
        Self {
            name: escape_control_chars(name),
            text: blank_control_chars(text).into(),
            told: RefCell::default(),
            doubts: RefCell::default(),
        }
    }

    /// Adds all errors of another file, for example those of the wearer file that a session names.
    pub(crate) fn report_all(&self, e: SessionError) {
        self.told.borrow_mut().extend(e.into_errors());
    }

    /// Adds an error at a place of this file. All errors are reported together when the file has
    /// been read.
    pub(crate) fn report(&self, problem: Problem, place: Place) {
        let error = SessionError::at(problem, &self.name, &self.text, place);
        self.told.borrow_mut().push(error);
    }

    pub(crate) fn report_tentatively(&self, problem: Problem, place: Place) {
        let error = SessionError::at(problem, &self.name, &self.text, place);
        self.doubts.borrow_mut().push(error);
    }

    /// Returns whether no error has been found so far.
    pub(crate) fn is_valid(&self) -> bool {
        self.told.borrow().is_empty() && self.doubts.borrow().is_empty()
    }

    /// Returns all errors, each once, or `None` if there are none.
    pub(crate) fn into_error(self) -> Option<SessionError> {
        let mut errors = self.told.into_inner();
        let mut seen = HashSet::new();
        errors.retain(|e| seen.insert((e.offset(), e.to_string())));
        let places: HashSet<usize> = errors.iter().map(SessionError::offset).collect();
        let doubts = self.doubts.into_inner().into_iter();
        errors.extend(doubts.filter(|doubt| !places.contains(&doubt.offset())));
        SessionError::combine(errors)
    }

    /// Returns the text of the file at `span` as a quotation: its first line, cut off after
    /// [`LONGEST_GIVEN`] characters.
    pub(crate) fn excerpt(&self, span: &Range<usize>) -> String {
        let text = self.text.get(span.clone()).unwrap_or_default();
        let line = text.lines().next().unwrap_or_default().trim();
        match line.char_indices().nth(LONGEST_GIVEN) {
            Some((end, _)) => format!("{}…", line.get(..end).unwrap_or_default()),
            None => line.into(),
        }
    }
}
