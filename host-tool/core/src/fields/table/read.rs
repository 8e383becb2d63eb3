//! Checks a TOML table against its declared fields.

use std::collections::BTreeMap;
use std::ops::Range;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::super::decimal::{Decimal, format_scaled};
use super::super::document::Document;
use super::super::error::{Place, Problem};
use super::super::field::{Condition, Field, Kind, Need, Number, Section, replacement_word};
use super::{Entry, Table, Value};
use crate::suggestion::nearest;

impl<'a> Table<'a> {
    /// Checks and reads the top-level table of a file.
    pub(crate) fn root(
        doc: &'a Document,
        root: &'a Spanned<DeTable<'a>>,
        section: &'static Section,
    ) -> Self {
        Self::read(doc, String::new(), 0..0, root.get_ref(), section)
    }

    /// Checks a table of the file against the declared fields in `section`, and reports the errors
    /// of each field. `path` and `span` are the path and the place of the table.
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
        // Words are read first, because they determine which other fields are allowed.
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
                table.report_invalid(problem, table.place(name, key.span()));
            }
        }
        // A field with a misspelt name does not count as missing.
        let required = |f: &&Field| {
            let is_needed = match f.need {
                Need::Required => true,
                Need::RequiredWithout(other) => !file.contains_key(other),
                _ => false,
            };
            is_needed && !meant.contains(&f.name)
        };
        for field in section.iter().filter(required) {
            if !file.contains_key(field.name) && table.is_allowed(field, file) == Some(true) {
                let place = table.place(field.name, table.span.clone());
                table.report_invalid(Problem::MissingField {}, place);
            }
        }
        table
    }

    /// Reads `field` if the file has it and may have it. Reports a field that the file must not
    /// have.
    fn read_field(&mut self, field: &'static Field, file: &'a DeTable<'a>) {
        let Some((key, found)) = file.get_key_value(field.name) else {
            return;
        };
        let applies = self.is_allowed(field, file);
        if applies == Some(false) {
            // Another declaration of the same name may apply.
            let mut same = self.section.iter().filter(|f| f.name == field.name);
            if same.all(|f| self.is_allowed(f, file) == Some(false)) {
                self.report_misplaced(field, key.span(), found.span(), file);
            }
            return;
        }
        let value = applies.and_then(|_| self.read_value(field, found));
        self.sound &= value.is_some();
        let span = found.span();
        self.entries.insert(field.name, Entry { span, value });
    }

    /// Returns whether the condition of a field's declaration is met, so that the file may have it.
    /// Returns `None` if an error in another field leaves this open.
    fn is_allowed(&self, field: &Field, file: &DeTable<'_>) -> Option<bool> {
        match field.when {
            None => Some(true),
            Some(Condition::Without(other)) => Some(!file.contains_key(other)),
            Some(Condition::Is(tag, words)) => match self.entries.get(tag) {
                Some(Entry { value: None, .. }) => None,
                _ => self.word_of(tag).map(|word| words.contains(&word)),
            },
        }
    }

    /// Reports a field that the file must not have because of the value or the presence of another
    /// field.
    fn report_misplaced(
        &mut self,
        field: &Field,
        key: Range<usize>,
        span: Range<usize>,
        file: &DeTable<'_>,
    ) {
        match field.when {
            Some(Condition::Without(first)) => {
                let other = self.field_path(field.name);
                let place = self.place(first, file.get(first).map_or(span, Spanned::span));
                self.report_invalid(Problem::SaidTwice { other }, place);
            }
            // The first field of a table determines its type.
            Some(Condition::Is(tag, _)) if self.section.first().is_some_and(|f| f.name == tag) => {
                let (problem, _) = self.unknown(field.name);
                self.report_invalid(problem, self.place(field.name, key));
            }
            Some(Condition::Is(tag, _)) => {
                let word = self.word_of(tag).unwrap_or_default();
                let allowed = format!("no value with {tag} = \"{word}\"");
                self.report_invalid(
                    Problem::OutOfRange { allowed },
                    self.place(field.name, span),
                );
            }
            None => {}
        }
    }

    fn report_invalid(&mut self, problem: Problem, place: Place) {
        self.sound = false;
        self.doc.report(problem, place);
    }

    /// Returns the problem of a field name that is not declared, and the declared name that was
    /// probably meant.
    fn unknown(&self, name: &str) -> (Problem, Option<&'static str>) {
        let mut known: Vec<&str> = Vec::new();
        for field in self.section {
            if self.applies(field) && !known.contains(&field.name) {
                known.push(field.name);
            }
        }
        let close = nearest(name, known.iter().copied());
        let (known, likely) = (known.join(", "), close.map(Into::into));
        (
            Problem::UnknownField {
                close: likely,
                known,
            },
            close,
        )
    }

    /// Reads the value of a field. Returns `None` after reporting an error in it.
    fn read_value(
        &self,
        field: &'static Field,
        found: &'a Spanned<DeValue<'a>>,
    ) -> Option<Value<'a>> {
        let (file, place) = (found.get_ref(), self.place(field.name, found.span()));
        let wrong = |problem| {
            self.doc.report(problem, place.clone());
            None
        };
        let read = match &field.kind {
            Kind::Text(longest) => file.as_str().map(|text| {
                if let Some(most) = longest.filter(|most| !is_valid_text(text, *most)) {
                    let allowed = characters(most);
                    return wrong(Problem::OutOfRange { allowed });
                }
                if let Some(character) = forbidden_character(text) {
                    return wrong(Problem::ControlCharacter { character });
                }
                Some(Value::Text(text))
            }),
            Kind::Texts(most) => file.as_array().and_then(|list| {
                let texts = list.iter().map(|item| item.get_ref().as_str());
                let texts: Vec<&str> = texts.collect::<Option<_>>()?;
                if texts.iter().any(|text| !is_valid_text(text, *most)) {
                    let allowed = format!("texts of {}", characters(*most));
                    return Some(wrong(Problem::OutOfRange { allowed }));
                }
                if let Some(character) = texts.iter().find_map(|text| forbidden_character(text)) {
                    return Some(wrong(Problem::ControlCharacter { character }));
                }
                Some(Some(Value::Texts(texts)))
            }),
            Kind::Flag => file.as_bool().map(|is| Some(Value::Flag(is))),
            Kind::Choice(words) => file.as_str().map(|given| {
                let word = words.iter().find(|word| **word == given);
                let close = replacement_word(given, words).map(str::to_owned);
                let close = close.or_else(|| suggest_word(given, words));
                let known = words.join(", ");
                let unknown = || wrong(Problem::UnknownChoice { close, known });
                word.map_or_else(unknown, |word| Some(Value::Word(word)))
            }),
            Kind::Whole(number) => self
                .read_integer(number, file, place.clone())
                .map(|whole_value| whole_value.map(Value::Whole)),
            Kind::Real(number) => self
                .read_real(number, file, place.clone())
                .map(|real_value| real_value.map(Value::Real)),
            Kind::Wholes(number, _) => file.as_array().map(|list| {
                let numbers = list.iter().map(|item| {
                    let place = self.place(field.name, item.span());
                    let (value, expected) = (item.get_ref(), "a number in each place");
                    let read = self.read_integer(number, value, place.clone());
                    let read = read.unwrap_or_else(|| {
                        let found = kind(value);
                        self.doc
                            .report(Problem::WrongType { expected, found }, place);
                        None
                    });
                    read.map(|value| (value, item.span()))
                });
                let values: Vec<Option<_>> = numbers.collect(); // reports all mistakes
                values.into_iter().collect::<Option<_>>().map(Value::Wholes)
            }),
            Kind::Pairs(number, count, what) => file.as_array().and_then(|list| {
                let pairs = list.iter().map(|pair| self.read_pair(field, number, pair));
                let pairs: Vec<Option<_>> = pairs.collect::<Option<_>>()?;
                if pairs.len() != *count {
                    let allowed = (*what).to_owned();
                    return Some(wrong(Problem::OutOfRange { allowed }));
                }
                Some(pairs.into_iter().collect::<Option<_>>().map(Value::Pairs))
            }),
            Kind::Table(section) => self
                .inner(field, found, section)
                .map(|t| Some(Value::Table(t))),
            Kind::Tables(section, count) => file.as_array().and_then(|list| {
                let entries = list.iter().map(|item| self.inner(field, item, section));
                let tables: Vec<_> = entries.collect::<Option<_>>()?;
                let most = count.most.unwrap_or(usize::MAX);
                if !(count.least..=most).contains(&tables.len()) {
                    let allowed = count.format_count();
                    return Some(wrong(Problem::OutOfRange { allowed }));
                }
                Some(Some(Value::Tables(tables)))
            }),
        };
        read.unwrap_or_else(|| {
            let (expected, found) = (field.kind.expected(), kind(file));
            wrong(Problem::WrongType { expected, found })
        })
    }

    /// Reads a pair of numbers and returns the places of both in the text. Returns `None` if the
    /// value is not a pair, and `Some(None)` after reporting an error in one of the numbers.
    fn read_pair(
        &self,
        field: &Field,
        number: &Number,
        pair: &Spanned<DeValue<'_>>,
    ) -> Option<Option<[Range<usize>; 2]>> {
        let [one, two] = pair.get_ref().as_array()?.iter().as_slice() else {
            return None;
        };
        let read = |item: &Spanned<DeValue<'_>>| {
            let place = self.place(field.name, item.span());
            let read = self.read_real(number, item.get_ref(), place)?;
            Some(read.map(|_| item.span()))
        };
        let (first_span, second_span) = (read(one)?, read(two)?);
        Some(
            first_span
                .zip(second_span)
                .map(|(first, second)| [first, second]),
        )
    }

    fn inner(
        &self,
        field: &Field,
        found: &'a Spanned<DeValue<'a>>,
        section: &'static Section,
    ) -> Option<Self> {
        let (file, path) = (found.get_ref().as_table()?, self.field_path(field.name));
        Some(Self::read(self.doc, path, found.span(), file, section))
    }

    /// Reads a number that must be a whole number of its field's steps. Returns `None` if the value
    /// is not a number, and `Some(None)` after reporting an error in it.
    fn read_integer(
        &self,
        number: &Number,
        value: &DeValue<'_>,
        place: Place,
    ) -> Option<Option<i64>> {
        let Some(decimal) = decimal(value)? else {
            let allowed = number.format_range();
            self.doc.report(Problem::NotFinite { allowed }, place);
            return Some(None);
        };
        let Some(value) = decimal.scaled(number.places) else {
            let (step, unit) = (format_scaled(1, number.places), number.display_unit());
            let meant = number.unit_suggestion(decimal.value());
            let step = format!("{step} {unit}").trim_end().to_owned() + &meant;
            self.doc.report(Problem::NotExact { step }, place);
            return Some(None);
        };
        let fits = number
            .range
            .is_none_or(|(min, max)| (min..=max).contains(&value));
        Some(self.check_range(number, fits, value, place))
    }

    /// Reads a number of any precision. Returns `None` if the value is not a number, and
    /// `Some(None)` after reporting an error in it.
    fn read_real(&self, number: &Number, value: &DeValue<'_>, place: Place) -> Option<Option<f64>> {
        let value = match value {
            DeValue::Float(float) => float.as_str().replace('_', "").parse().ok()?,
            DeValue::Integer(integer) => i128::from_str_radix(integer.as_str(), integer.radix())
                .map_or(f64::INFINITY, |whole| whole as f64),
            _ => return None,
        };
        if !f64::is_finite(value) {
            let allowed = number.format_range();
            self.doc.report(Problem::NotFinite { allowed }, place);
            return Some(None);
        }
        let steps = 10_f64.powi(number.places);
        let fits = number
            .range
            .is_none_or(|(min, max)| (min as f64 / steps..=max as f64 / steps).contains(&value));
        Some(self.check_range(number, fits, value, place))
    }

    /// Returns `value` if it `fits` the range of its field. Otherwise reports it and returns
    /// `None`. If other fields restrict the range further, the error is only tentative, and `value`
    /// is returned so that the rule between the fields can report it more precisely.
    fn check_range<T>(&self, number: &Number, fits: bool, value: T, place: Place) -> Option<T> {
        if fits {
            return Some(value);
        }
        let allowed = number.format_range().unwrap_or_default();
        if number.bound.is_empty() {
            self.doc.report(Problem::OutOfRange { allowed }, place);
            return None;
        }
        let allowed = format!("{allowed}, {}", number.bound);
        self.doc
            .report_tentatively(Problem::OutOfRange { allowed }, place);
        Some(value)
    }
}

/// Returns a suggestion for the unknown word `given`: all words that continue it after a hyphen,
/// such as both polarities of `biphasic`, or else the most similar word.
fn suggest_word(given: &str, words: &[&'static str]) -> Option<String> {
    let longer = words.iter().filter(|word| {
        let rest = word.strip_prefix(given);
        rest.is_some_and(|rest| rest.starts_with('-'))
    });
    let longer: Vec<_> = longer.copied().collect();
    match longer.is_empty() {
        true => nearest(given, words.iter().copied()).map(str::to_owned),
        false => Some(longer.join("` or `")),
    }
}

/// Returns whether a text is more than white space and has at most `most` characters.
fn is_valid_text(text: &str, most: usize) -> bool {
    !text.trim().is_empty() && text.chars().count() <= most
}

/// Returns the first character of a text that reports and charts cannot contain or that a terminal
/// would execute, for example "U+001B". Tabs and line ends are allowed.
fn forbidden_character(text: &str) -> Option<String> {
    let is_such = |c: &char| match c {
        '\t' | '\n' | '\r' => false,
        _ => c.is_control() || ['\u{fffe}', '\u{ffff}'].contains(c),
    };
    let first = text.chars().find(is_such)?;
    Some(format!("U+{:04X}", u32::from(first)))
}

/// Formats the allowed length of a text, for example "1 to 200 characters".
fn characters(most: usize) -> String {
    format!("1 to {most} characters")
}

/// Returns the exact decimal of a TOML number. Returns `None` if the value is not a number, and
/// `Some(None)` if it is not finite or has too many digits.
fn decimal(value: &DeValue<'_>) -> Option<Option<Decimal>> {
    match value {
        DeValue::Float(float) => Some(Decimal::parse(float.as_str())),
        DeValue::Integer(integer) => {
            let digits = i128::from_str_radix(integer.as_str(), integer.radix());
            Some(digits.ok().map(Decimal::from_integer))
        }
        _ => None,
    }
}

/// Returns the name of a value's type for messages, for example "a truth value".
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
