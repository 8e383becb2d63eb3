//! A TOML table that remembers where it stands: fields by name and type, each
//! mistake with its place. It knows types and units, not what a field means.

use std::cell::RefCell;
use std::ops::Range;
use std::sync::Arc;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::decimal::{Decimal, in_units};
use super::error::{Problem, SessionError};

/// The text of a session file.
pub(super) struct Document {
    pub(super) name: String,
    pub(super) text: Arc<str>,
    /// The first number too large for its field on the link: see [`Table::whole`].
    misfit: RefCell<Option<SessionError>>,
}

impl Document {
    pub(super) fn new(name: &str, text: &str) -> Self {
        Self {
            name: name.into(),
            text: text.into(),
            misfit: RefCell::new(None),
        }
    }

    pub(super) fn error(&self, problem: Problem, span: Range<usize>) -> SessionError {
        SessionError::at(problem, &self.name, &self.text, span)
    }

    /// Refuses a number too large for the link that no validator caught.
    pub(super) fn finish(self) -> Result<(), SessionError> {
        self.misfit.into_inner().map_or(Ok(()), Err)
    }

    /// What the file says at `span`, at most one line.
    fn given(&self, span: &Range<usize>) -> String {
        let text = self.text.get(span.clone()).unwrap_or_default();
        text.lines().next().unwrap_or_default().trim().into()
    }
}

/// An integer type of the link.
pub(super) trait Whole: TryFrom<i64> {
    /// Smallest and largest value.
    const RANGE: (i64, i64);
    /// The largest value.
    const TOP: Self;
}

macro_rules! whole {
    ($($t:ty),*) => {$(
        impl Whole for $t {
            const RANGE: (i64, i64) = (<$t>::MIN as i64, <$t>::MAX as i64);
            const TOP: Self = <$t>::MAX;
        }
    )*};
}
whole!(u8, u16, u32, i16, i32, i64);

/// One table of the file.
#[derive(Clone)]
pub(super) struct Table<'a> {
    doc: &'a Document,
    path: String,
    span: Range<usize>,
    entries: &'a DeTable<'a>,
}

/// A field that was looked for.
pub(super) struct Field<T> {
    value: Option<T>,
    missing: Box<dyn FnOnce() -> SessionError>,
}

impl<T> Field<T> {
    pub(super) fn required(self) -> Result<T, SessionError> {
        self.value.ok_or_else(self.missing)
    }

    pub(super) fn or(self, default: T) -> T {
        self.value.unwrap_or(default)
    }

    pub(super) fn optional(self) -> Option<T> {
        self.value
    }
}

type Read<T> = Result<Field<T>, SessionError>;

impl<'a> Table<'a> {
    pub(super) fn root(doc: &'a Document, root: &'a Spanned<DeTable<'a>>) -> Self {
        Self {
            doc,
            path: String::new(),
            span: 0..0,
            entries: root.get_ref(),
        }
    }

    /// Refuses fields that are not `known`.
    pub(super) fn only(&self, known: &[&str]) -> Result<(), SessionError> {
        for key in self.entries.keys() {
            let name = key.get_ref().as_ref();
            if !known.contains(&name) {
                let problem = Problem::UnknownField {
                    field: self.path_of(name),
                    close: closest(name, known.iter().copied()),
                    known: known.join(", "),
                };
                return Err(self.doc.error(problem, key.span()));
            }
        }
        Ok(())
    }

    pub(super) fn has(&self, name: &str) -> bool {
        self.entries.contains_key(name)
    }

    /// The field's path in the file.
    pub(super) fn path_of(&self, name: &str) -> String {
        if self.path.is_empty() {
            name.into()
        } else {
            format!("{}.{name}", self.path)
        }
    }

    /// What the file says in this field; empty if it says nothing.
    pub(super) fn given(&self, name: &str) -> String {
        let value = self.entries.get(name);
        value.map_or_else(String::new, |v| self.doc.given(&v.span()))
    }

    /// A problem at this field, or at the table if the field is left out.
    pub(super) fn error(&self, name: &str, problem: Problem) -> SessionError {
        let value = self.entries.get(name);
        let span = value.map_or_else(|| self.span.clone(), Spanned::span);
        self.doc.error(problem, span)
    }

    /// The field is outside what is allowed.
    pub(super) fn out_of_range(&self, name: &str, allowed: String) -> SessionError {
        let given = self.given(name);
        let given = if given.is_empty() {
            "left out".into()
        } else {
            given
        };
        let field = self.path_of(name);
        self.error(
            name,
            Problem::OutOfRange {
                field,
                given,
                allowed,
            },
        )
    }

    /// The field is outside `min`–`max`, both in 10^−`places` of its unit.
    pub(super) fn not_within(&self, name: &str, min: i64, max: i64, places: i32) -> SessionError {
        let (min, max) = (in_units(min, places), in_units(max, places));
        self.out_of_range(name, format!("{min} to {max}"))
    }

    fn get<T>(
        &self,
        name: &str,
        expected: &'static str,
        read: impl FnOnce(&'a Spanned<DeValue<'a>>) -> Option<Result<T, SessionError>>,
    ) -> Read<T> {
        let value = match self.entries.get(name) {
            None => None,
            Some(found) => Some(read(found).unwrap_or_else(|| {
                let problem = Problem::WrongType {
                    field: self.path_of(name),
                    expected,
                    given: kind(found.get_ref()),
                };
                Err(self.error(name, problem))
            })?),
        };
        let problem = Problem::MissingField {
            field: self.path_of(name),
        };
        let error = self.error(name, problem);
        Ok(Field {
            value,
            missing: Box::new(move || error),
        })
    }

    /// A string.
    pub(super) fn text(&self, name: &str) -> Read<&'a str> {
        self.get(name, "text", |v| v.get_ref().as_str().map(Ok))
    }

    /// A truth value.
    pub(super) fn flag(&self, name: &str) -> Read<bool> {
        self.get(name, "true or false", |v| v.get_ref().as_bool().map(Ok))
    }

    /// One of the named values.
    pub(super) fn choice<T: Copy>(&self, name: &str, choices: &[(&str, T)]) -> Read<T> {
        self.get(name, "text", |v| {
            let given = v.get_ref().as_str()?;
            let found = choices.iter().find(|(choice, _)| *choice == given);
            Some(found.map(|&(_, value)| value).ok_or_else(|| {
                let names = choices.iter().map(|&(choice, _)| choice);
                let problem = Problem::UnknownChoice {
                    field: self.path_of(name),
                    given: self.given(name),
                    close: closest(given, names.clone()),
                    known: names.collect::<Vec<_>>().join(", "),
                };
                self.error(name, problem)
            }))
        })
    }

    /// A finite number.
    pub(super) fn real(&self, name: &str) -> Read<f64> {
        self.get(name, "a number", |v| {
            let real = match v.get_ref() {
                DeValue::Float(float) => float.as_str().replace('_', "").parse().ok()?,
                DeValue::Integer(integer) => {
                    i128::from_str_radix(integer.as_str(), integer.radix()).ok()? as f64
                }
                _ => return None,
            };
            Some(self.finite(name, f64::is_finite(real).then_some(real)))
        })
    }

    /// The number in this field times 10^`places`, which must be whole.
    ///
    /// A number that is not finite or does not fit `T` becomes `T`'s largest value,
    /// so that the firmware's validator refuses it with the range that it allows;
    /// where it allows all of `T`, [`Document::finish`] refuses.
    pub(super) fn whole<T: Whole>(&self, name: &str, places: i32) -> Read<T> {
        self.get(name, "a number", |v| {
            let decimal = decimal(v.get_ref())?;
            let misfit = |error| {
                self.doc.misfit.borrow_mut().get_or_insert(error);
                T::TOP
            };
            let decimal = match self.finite(name, decimal) {
                Ok(decimal) => decimal,
                // Of an i64 no validator of the firmware knows the range.
                Err(error) if T::RANGE.1 == i64::MAX => return Some(Err(error)),
                Err(error) => return Some(Ok(misfit(error))),
            };
            let Some(scaled) = decimal.scaled(places) else {
                let problem = Problem::NotExact {
                    field: self.path_of(name),
                    given: self.given(name),
                    step: in_units(1, places),
                };
                return Some(Err(self.error(name, problem)));
            };
            let not_within = |_| self.not_within(name, T::RANGE.0, T::RANGE.1, places);
            Some(Ok(T::try_from(scaled)
                .map_err(not_within)
                .unwrap_or_else(misfit)))
        })
    }

    fn finite<T>(&self, name: &str, value: Option<T>) -> Result<T, SessionError> {
        value.ok_or_else(|| {
            let (field, given) = (self.path_of(name), self.given(name));
            self.error(name, Problem::NotFinite { field, given })
        })
    }

    /// A whole number within `min`–`max`, both in 10^−`places` of its unit.
    pub(super) fn within(&self, name: &str, places: i32, min: i64, max: i64) -> Read<i64> {
        let field = self.whole::<i64>(name, places)?;
        match field.value {
            Some(value) if !(min..=max).contains(&value) => {
                Err(self.not_within(name, min, max, places))
            }
            _ => Ok(field),
        }
    }

    /// A list of numbers, each whole and within `min`–`max`, both in 10^−`places`
    /// of its unit.
    pub(super) fn list_within(
        &self,
        name: &str,
        places: i32,
        min: i64,
        max: i64,
    ) -> Read<Vec<i64>> {
        self.get(name, "a list of numbers", |v| {
            let one = |item: &Spanned<DeValue<'a>>| {
                let decimal = decimal(item.get_ref())?;
                let (field, given) = (self.path_of(name), self.doc.given(&item.span()));
                let problem = match decimal.map(|d| d.scaled(places)) {
                    None => Problem::NotFinite { field, given },
                    Some(None) => Problem::NotExact {
                        field,
                        given,
                        step: in_units(1, places),
                    },
                    Some(Some(value)) if (min..=max).contains(&value) => return Some(Ok(value)),
                    Some(Some(_)) => Problem::OutOfRange {
                        field,
                        given,
                        allowed: format!("{} to {}", in_units(min, places), in_units(max, places)),
                    },
                };
                Some(Err(self.doc.error(problem, item.span())))
            };
            v.get_ref().as_array()?.iter().map(one).collect()
        })
    }

    /// A channel's number in the file, 1–10.
    pub(super) fn channel(&self, name: &str) -> Read<u8> {
        let Field { value, missing } = self.within(name, 0, 1, 10)?;
        let value = value.map(|number| number as u8); // 1–10
        Ok(Field { value, missing })
    }

    /// A list of channel numbers, 1–10.
    pub(super) fn channels(&self, name: &str) -> Read<Vec<u8>> {
        const WHAT: &str = "a list of channel numbers";
        self.get(name, WHAT, |v| {
            let list = v.get_ref().as_array()?;
            let number = |item: &Spanned<DeValue<'a>>| {
                let digits = item.get_ref().as_integer()?;
                let number = i64::from_str_radix(digits.as_str(), digits.radix()).ok()?;
                if (1..=10).contains(&number) {
                    return Some(Ok(number as u8));
                }
                let problem = Problem::OutOfRange {
                    field: self.path_of(name),
                    given: number.to_string(),
                    allowed: "1 to 10".into(),
                };
                Some(Err(self.doc.error(problem, item.span())))
            };
            list.iter().map(number).collect()
        })
    }

    fn inner(&self, name: &str, value: &'a Spanned<DeValue<'a>>) -> Option<Self> {
        Some(Self {
            doc: self.doc,
            path: self.path_of(name),
            span: value.span(),
            entries: value.get_ref().as_table()?,
        })
    }

    /// A table in this one.
    pub(super) fn table(&self, name: &str) -> Read<Self> {
        self.get(name, "a table", |v| self.inner(name, v).map(Ok))
    }

    /// A list of tables in this one.
    pub(super) fn tables(&self, name: &str) -> Read<Vec<Self>> {
        self.get(name, "a list of tables", |v| {
            let list = v.get_ref().as_array()?;
            let tables: Option<Vec<_>> = list.iter().map(|v| self.inner(name, v)).collect();
            tables.map(Ok)
        })
    }
}

/// A number's digits: `None` if it is none, inside if it is not finite or too
/// long.
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

/// The candidate that `name` is most likely a slip of the pen of.
fn closest<'n>(name: &str, candidates: impl Iterator<Item = &'n str>) -> Option<String> {
    let likeness = |candidate: &str| strsim::jaro_winkler(name, candidate);
    candidates
        .filter(|candidate| likeness(candidate) > 0.8)
        .max_by(|a, b| likeness(a).total_cmp(&likeness(b)))
        .map(Into::into)
}
