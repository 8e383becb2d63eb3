//! A refused file: its errors with their places, for people and for machines.

use std::fmt;
use std::sync::Arc;

use super::error::{MOST, Place, Problem};
use super::visible::escape_control_chars;
use miette::{Diagnostic, LabeledSpan, NamedSource, Severity, SourceCode};
use serde_json::{Value, json};

/// Length of a line, in bytes, above which the lines around an error are not shown.
const LONGEST_LINE: usize = 1_000;
/// The errors for which a session or wearer file is refused: the first one, with its file and
/// place, and all further ones.
///
/// `miette` renders all of them. [`fmt::Display`] gives only the message of the first.
#[derive(Clone)]
pub struct SessionError(Box<Inner>);

#[derive(Clone)]
struct Inner {
    problem: Problem,
    place: Place,
    code: String,
    file: Option<NamedSource<Arc<str>>>,
    label: Option<LabeledSpan>,
    /// Further errors of the same file; empty in the further errors themselves.
    further: Vec<SessionError>,
}

impl SessionError {
    /// Returns the error for a problem at a place of the file called `name`, whose text is `text`.
    pub(crate) fn at(problem: Problem, name: &str, text: &Arc<str>, place: Place) -> Self {
        let label = Some(problem.label());
        let mut error = Self::without_place(problem);
        error.0.label = Some(LabeledSpan::new_primary_with_span(
            label,
            place.span.clone(),
        ));
        error.0.file = Some(NamedSource::new(name, Arc::clone(text)));
        error.0.place = place;
        error
    }

    /// Combines all errors of a file, sorted by their place, into one value; `None` if there are
    /// none. Only the first [`MOST`] are kept, and the others are counted.
    pub(crate) fn combine(mut errors: Vec<Self>) -> Option<Self> {
        errors.sort_by_key(Self::offset);
        let count = errors.len().saturating_sub(MOST);
        errors.truncate(MOST);
        if count > 0 {
            errors.push(Self::without_place(Problem::More { count }));
        }
        let mut errors = errors.into_iter();
        let mut first = errors.next()?;
        first.0.further = errors.collect();
        Some(first)
    }

    /// Splits the value into its errors, each without further ones.
    pub(crate) fn into_errors(mut self) -> impl Iterator<Item = Self> {
        let further = std::mem::take(&mut self.0.further);
        std::iter::once(self).chain(further)
    }

    /// Returns the byte of the file at which the error is; the largest number for an error without
    /// a place.
    pub(crate) fn offset(&self) -> usize {
        self.0
            .label
            .as_ref()
            .map_or(usize::MAX, LabeledSpan::offset)
    }

    /// Returns all errors, this one first.
    pub fn errors(&self) -> impl Iterator<Item = &Self> {
        std::iter::once(self).chain(&self.0.further)
    }

    /// Returns the error for a problem that does not belong to a place in a file.
    pub(crate) fn without_place(problem: Problem) -> Self {
        Self(Box::new(Inner {
            code: format!("E{}", problem.number()),
            file: None,
            label: None,
            further: Vec::new(),
            place: Place::default(),
            problem,
        }))
    }

    /// Returns the line and the column of the error in the file, both from 1, or `None` for an
    /// error without a place.
    #[must_use]
    pub fn line_and_column(&self) -> Option<(usize, usize)> {
        let (file, label) = self.0.file.as_ref().zip(self.0.label.as_ref())?;
        let before = file.inner().get(..label.offset()).unwrap_or_default();
        let line = before.bytes().filter(|&byte| byte == b'\n').count() + 1;
        let column = before.chars().rev().take_while(|&c| c != '\n').count() + 1;
        Some((line, column))
    }

    /// Returns whether the lines around the error are short enough to be shown.
    fn can_show_source(&self) -> bool {
        let text = self.0.file.as_ref().map(|file| &**file.inner());
        let lines = text.unwrap_or_default().lines();
        let line = self.line_and_column().map_or(0, |(line, _)| line);
        // One line of context before and after, and one for the end of the place itself.
        let about = lines.skip(line.saturating_sub(2)).take(4);
        about.map(str::len).max().unwrap_or(0) <= LONGEST_LINE
    }

    /// Returns this error, without the further ones, as one line for programs: error number, file,
    /// line, column, message and remedy.
    #[must_use]
    pub fn one_line(&self) -> String {
        let place = self.0.file.as_ref().zip(self.line_and_column());
        let place =
            place.map(|(file, (line, column))| format!("{}:{line}:{column}: ", file.name()));
        self.format_at(&place.unwrap_or_default())
    }

    /// Returns this error, without the further ones, as one line without its place: error number,
    /// message and remedy. It is for texts that a program wrote, in which a line number does not
    /// help.
    #[must_use]
    pub fn summary(&self) -> String {
        self.format_at("")
    }

    fn format_at(&self, place: &str) -> String {
        let Inner { problem, code, .. } = &*self.0;
        let help = problem.help().map(|help| format!("; {help}"));
        format!("{code} {place}{self}{}", help.unwrap_or_default())
    }

    /// Returns all errors as text, one line each.
    #[must_use]
    pub fn lines(&self) -> String {
        let lines: Vec<String> = self.errors().map(Self::one_line).collect();
        lines.join("\n")
    }

    /// Returns number, place, message and help of each error, as programs read them.
    #[must_use]
    pub fn to_json(&self) -> Vec<Value> {
        let errors = self.errors().map(|error| {
            let (line, column) = error.line_and_column().unzip();
            json!({
                "number": error.0.code,
                "line": line,
                "column": column,
                "message": error.to_string(),
                "help": Diagnostic::help(error).map(|help| help.to_string()),
            })
        });
        errors.collect()
    }

    /// Returns the path of the field with the error, for example "channel.train.width_us"; an empty
    /// text for an error without a field.
    #[must_use]
    pub fn field(&self) -> &str {
        &self.0.place.field
    }

    /// Returns the text of the field's value in the file; an empty text for an error without a
    /// field.
    #[must_use]
    pub fn given(&self) -> &str {
        &self.0.place.given
    }

    /// Returns the values that the field may have, if the error is about its range.
    #[must_use]
    pub fn allowed(&self) -> Option<&str> {
        self.0.problem.allowed()
    }

    /// Returns what the user should do about the error; `None` if the message says so.
    #[must_use]
    pub fn remedy(&self) -> Option<String> {
        self.0.problem.help()
    }

    /// Returns the problem of this error, without those of the further ones.
    #[must_use]
    pub fn problem(&self) -> &Problem {
        &self.0.problem
    }
}

impl fmt::Display for SessionError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&escape_control_chars(
            &self.0.problem.message(&self.0.place),
        ))
    }
}

impl fmt::Debug for SessionError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {:?}", self.0.code, self.0.problem)
    }
}

impl std::error::Error for SessionError {}

impl Diagnostic for SessionError {
    fn code(&self) -> Option<Box<dyn fmt::Display + '_>> {
        Some(Box::new(&self.0.code))
    }

    fn severity(&self) -> Option<Severity> {
        Some(Severity::Error)
    }

    fn help(&self) -> Option<Box<dyn fmt::Display + '_>> {
        let help = self.0.problem.help();
        let place = self.line_and_column().filter(|_| !self.can_show_source());
        let place = place.map(|(line, column)| format!("line {line}, column {column}"));
        let parts: Vec<String> = place.into_iter().chain(help).collect();
        (!parts.is_empty()).then(|| Box::new(parts.join("; ")) as Box<_>)
    }

    fn related<'a>(&'a self) -> Option<Box<dyn Iterator<Item = &'a dyn Diagnostic> + 'a>> {
        let further = self.0.further.iter().map(|e| e as &dyn Diagnostic);
        (!self.0.further.is_empty()).then(|| Box::new(further) as Box<_>)
    }

    fn source_code(&self) -> Option<&dyn SourceCode> {
        let file = self.0.file.as_ref().filter(|_| self.can_show_source());
        file.map(|file| file as &dyn SourceCode)
    }

    fn labels(&self) -> Option<Box<dyn Iterator<Item = LabeledSpan> + '_>> {
        let label = self.0.label.clone().filter(|_| self.can_show_source())?;
        Some(Box::new(std::iter::once(label)))
    }
}
