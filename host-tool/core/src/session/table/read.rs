//! Holds a TOML table against its declared fields.

use std::collections::BTreeMap;
use std::ops::Range;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::super::decimal::{Decimal, in_units};
use super::super::error::Problem;
use super::super::field::{Field, Kind, Need, Number, Section, When};
use super::{Document, Entry, Table, Value};

impl<'a> Table<'a> {
    /// The file itself.
    pub(in super::super) fn root(
        doc: &'a Document,
        root: &'a Spanned<DeTable<'a>>,
        section: &'static Section,
    ) -> Self {
        Self::read(doc, String::new(), 0..0, root.get_ref(), section)
    }

    /// Holds a table against its fields, and tells what is wrong with each.
    fn read(
        doc: &'a Document,
        path: String,
        span: Range<usize>,
        file: &'a DeTable<'a>,
        section: &'static Section,
    ) -> Self {
        let mut table = Self {
            doc,
            path,
            span,
            section,
            entries: BTreeMap::new(),
            sound: true,
        };
        // Words first: they decide which other fields there are.
        let (words, others): (Vec<_>, Vec<_>) = section
            .iter()
            .partition(|f| matches!(f.kind, Kind::Choice(_)));
        for field in words.into_iter().chain(others) {
            table.read_field(field, file);
        }
        let mut meant = Vec::new();
        for key in file.keys() {
            let name = key.get_ref().as_ref();
            if section.iter().all(|field| field.name != name) {
                let (problem, close) = table.unknown(name);
                meant.extend(close);
                table.wrong(problem, key.span());
            }
        }
        // A slip of the pen leaves nothing out.
        let required = |f: &&Field| matches!(f.need, Need::Required) && !meant.contains(&f.name);
        for field in section.iter().filter(required) {
            if !file.contains_key(field.name) && table.may_have(field, file) == Some(true) {
                let field = table.path_of(field.name);
                table.wrong(Problem::MissingField { field }, table.span.clone());
            }
        }
        table
    }

    /// Reads a field, if the file has it.
    fn read_field(&mut self, field: &'static Field, file: &'a DeTable<'a>) {
        let Some((key, found)) = file.get_key_value(field.name) else {
            return;
        };
        let applies = self.may_have(field, file);
        if applies == Some(false) {
            // Another declaration of this name may apply.
            let mut same = self.section.iter().filter(|f| f.name == field.name);
            if same.all(|f| self.may_have(f, file) == Some(false)) {
                self.misplaced(field, key.span(), found.span(), file);
            }
            return;
        }
        let value = applies.and_then(|_| self.value(field, found));
        self.sound &= value.is_some();
        let span = found.span();
        self.entries.insert(field.name, Entry { span, value });
    }

    /// Whether the file may have this field; nothing if that cannot be told.
    fn may_have(&self, field: &Field, file: &DeTable<'_>) -> Option<bool> {
        match field.when {
            None => Some(true),
            Some(When::Without(other)) => Some(!file.contains_key(other)),
            Some(When::Is(tag, words)) => match self.entries.get(tag) {
                Some(Entry { value: None, .. }) => None,
                _ => self.word_of(tag).map(|word| words.contains(&word)),
            },
        }
    }

    /// Tells of a field that another one rules out.
    fn misplaced(
        &mut self,
        field: &Field,
        key: Range<usize>,
        span: Range<usize>,
        file: &DeTable<'_>,
    ) {
        match field.when {
            Some(When::Without(first)) => {
                let (said, other) = (self.path_of(first), self.path_of(field.name));
                let place = file.get(first).map_or(span, Spanned::span);
                self.wrong(Problem::SaidTwice { field: said, other }, place);
            }
            // What the first field says is what the table is.
            Some(When::Is(tag, _)) if self.section.first().is_some_and(|f| f.name == tag) => {
                let (problem, _) = self.unknown(field.name);
                self.wrong(problem, key);
            }
            Some(When::Is(tag, _)) => {
                let word = self.word_of(tag).unwrap_or_default();
                let problem = Problem::OutOfRange {
                    field: self.path_of(field.name),
                    given: self.doc.given(&span),
                    allowed: format!("none with {tag} = \"{word}\""),
                };
                self.wrong(problem, span);
            }
            None => {}
        }
    }

    fn wrong(&mut self, problem: Problem, span: Range<usize>) {
        self.sound = false;
        self.doc.say(problem, span);
    }

    /// That there is no such field here, and which one is meant.
    fn unknown(&self, name: &str) -> (Problem, Option<&'static str>) {
        let mut known: Vec<&str> = Vec::new();
        for field in self.section {
            if self.applies(field) && !known.contains(&field.name) {
                known.push(field.name);
            }
        }
        let close = closest(name, known.iter().copied());
        let problem = Problem::UnknownField {
            field: self.path_of(name),
            close: close.map(Into::into),
            known: known.join(", "),
        };
        (problem, close)
    }

    fn value(&self, field: &'static Field, found: &'a Spanned<DeValue<'a>>) -> Option<Value<'a>> {
        let read = match &field.kind {
            Kind::Text(longest) => found.get_ref().as_str().map(|text| {
                let fits = |most: usize| !text.trim().is_empty() && text.chars().count() <= most;
                if let Some(most) = longest.filter(|most| !fits(*most)) {
                    let allowed = format!("1 to {most} characters");
                    return self.refuse_value(field, found.span(), allowed);
                }
                Some(Value::Text(text))
            }),
            Kind::Flag => found.get_ref().as_bool().map(|is| Some(Value::Flag(is))),
            Kind::Choice(words) => found.get_ref().as_str().map(|given| {
                let word = words.iter().find(|word| **word == given);
                if word.is_none() {
                    let problem = Problem::UnknownChoice {
                        field: self.path_of(field.name),
                        given: self.doc.given(&found.span()),
                        close: closest(given, words.iter().copied()).map(Into::into),
                        known: words.join(", "),
                    };
                    self.doc.say(problem, found.span());
                }
                word.map(|word| Value::Word(word))
            }),
            Kind::Whole(number) => self
                .whole_value(field, number, found)
                .map(|it| it.map(Value::Whole)),
            Kind::Real(number) => self
                .real_value(field, number, found)
                .map(|it| it.map(Value::Real)),
            Kind::Wholes(number, _) => found.get_ref().as_array().and_then(|list| {
                let each = list.iter().map(|item| {
                    let read = self.whole_value(field, number, item);
                    read.map(|value| value.map(|value| (value, item.span())))
                });
                let each: Vec<Option<_>> = each.collect::<Option<_>>()?;
                Some(each.into_iter().collect::<Option<_>>().map(Value::Wholes))
            }),
            Kind::Table(section) => self
                .inner(field, found, section)
                .map(|t| Some(Value::Table(t))),
            Kind::Tables(section, count) => found.get_ref().as_array().and_then(|list| {
                let each = list.iter().map(|item| self.inner(field, item, section));
                let tables: Vec<_> = each.collect::<Option<_>>()?;
                let most = count.most.unwrap_or(usize::MAX);
                if !(count.least..=most).contains(&tables.len()) {
                    return Some(self.refuse_value(field, found.span(), count.allowed()));
                }
                Some(Some(Value::Tables(tables)))
            }),
        };
        read.unwrap_or_else(|| {
            let problem = Problem::WrongType {
                field: self.path_of(field.name),
                expected: field.kind.expected(),
                given: kind(found.get_ref()),
            };
            self.doc.say(problem, found.span());
            None
        })
    }

    fn inner(
        &self,
        field: &Field,
        found: &'a Spanned<DeValue<'a>>,
        section: &'static Section,
    ) -> Option<Self> {
        let file = found.get_ref().as_table()?;
        Some(Self::read(
            self.doc,
            self.path_of(field.name),
            found.span(),
            file,
            section,
        ))
    }

    fn refuse_value<T>(&self, field: &Field, span: Range<usize>, allowed: String) -> Option<T> {
        let problem = Problem::OutOfRange {
            field: self.path_of(field.name),
            given: self.doc.given(&span),
            allowed,
        };
        self.doc.say(problem, span);
        None
    }

    /// The number here in its field's steps, which must be whole; nothing if it is
    /// no number, inside nothing if it is a wrong one.
    fn whole_value(
        &self,
        field: &Field,
        number: &Number,
        found: &Spanned<DeValue<'_>>,
    ) -> Option<Option<i64>> {
        let decimal = decimal(found.get_ref())?;
        let name = self.path_of(field.name);
        let Some(decimal) = decimal else {
            self.not_finite(name, number, found.span());
            return Some(None);
        };
        let Some(value) = decimal.scaled(number.places) else {
            let problem = Problem::NotExact {
                field: name,
                given: self.doc.given(&found.span()),
                step: in_units(1, number.places),
            };
            self.doc.say(problem, found.span());
            return Some(None);
        };
        let fits = number
            .range
            .is_none_or(|(min, max)| (min..=max).contains(&value));
        Some(self.fitting(number, fits, value, name, found.span()))
    }

    fn not_finite(&self, field: String, number: &Number, span: Range<usize>) {
        let given = self.doc.given(&span);
        let allowed = number.allowed();
        let problem = Problem::NotFinite {
            field,
            given,
            allowed,
        };
        self.doc.say(problem, span);
    }

    /// A number that need not be whole, likewise.
    fn real_value(
        &self,
        field: &Field,
        number: &Number,
        found: &Spanned<DeValue<'_>>,
    ) -> Option<Option<f64>> {
        let value = match found.get_ref() {
            DeValue::Float(float) => float.as_str().replace('_', "").parse().ok()?,
            DeValue::Integer(integer) => i128::from_str_radix(integer.as_str(), integer.radix())
                .map_or(f64::INFINITY, |whole| whole as f64),
            _ => return None,
        };
        let name = self.path_of(field.name);
        if !f64::is_finite(value) {
            self.not_finite(name, number, found.span());
            return Some(None);
        }
        let steps = 10_f64.powi(number.places);
        let fits = number
            .range
            .is_none_or(|(min, max)| (min as f64 / steps..=max as f64 / steps).contains(&value));
        Some(self.fitting(number, fits, value, name, found.span()))
    }

    /// `value`, if it fits or if what other fields leave of the range decides.
    fn fitting<T>(
        &self,
        number: &Number,
        fits: bool,
        value: T,
        field: String,
        span: Range<usize>,
    ) -> Option<T> {
        if fits {
            return Some(value);
        }
        let allowed = number.allowed().unwrap_or_default();
        let given = self.doc.given(&span);
        if number.bound.is_empty() {
            self.doc.say(
                Problem::OutOfRange {
                    field,
                    given,
                    allowed,
                },
                span,
            );
            return None;
        }
        let allowed = format!("{allowed}, {}", number.bound);
        self.doc.doubt(
            Problem::OutOfRange {
                field,
                given,
                allowed,
            },
            span,
        );
        Some(value)
    }
}

/// A number's digits: nothing if it is none, inside nothing if it is not finite or
/// too long.
fn decimal(value: &DeValue<'_>) -> Option<Option<Decimal>> {
    match value {
        DeValue::Float(float) => Some(Decimal::parse(float.as_str())),
        DeValue::Integer(integer) => {
            let digits = i128::from_str_radix(integer.as_str(), integer.radix());
            Some(digits.ok().map(Decimal::of))
        }
        _ => None,
    }
}

/// What a value is, for people.
fn kind(value: &DeValue<'_>) -> &'static str {
    match value {
        DeValue::String(_) => "text",
        DeValue::Integer(_) | DeValue::Float(_) => "a number",
        DeValue::Boolean(_) => "a truth value",
        DeValue::Datetime(_) => "a date",
        DeValue::Array(_) => "a list",
        DeValue::Table(_) => "a table",
    }
}

/// The candidate that `name` is most likely a slip of the pen of. A name longer than
/// any field is none.
fn closest<'n>(name: &str, candidates: impl Iterator<Item = &'n str>) -> Option<&'n str> {
    let likeness = |candidate: &str| strsim::jaro_winkler(name, candidate);
    candidates
        .filter(|_| name.len() < 100)
        .filter(|candidate| likeness(candidate) > 0.8)
        .max_by(|a, b| likeness(a).total_cmp(&likeness(b)))
}
