//! What a field of a session file may be. The reader, the JSON schema and the
//! tables of docs/sessions.md all ask these declarations, and nothing else.

use firmware::range::Range;

use super::decimal::{between, in_units};

/// A table of the file: its fields, in the order in which they are told.
pub(crate) type Section = Vec<Field>;

/// One field of a table.
#[derive(Debug)]
pub(crate) struct Field {
    pub(crate) name: &'static str,
    pub(crate) kind: Kind,
    pub(crate) need: Need,
    /// What it means, for docs/sessions.md and for editors.
    pub(crate) meaning: &'static str,
    /// When the file may have it; always if none.
    pub(crate) when: Option<When>,
}

/// What stands in a field.
#[derive(Debug)]
pub(crate) enum Kind {
    /// A text, of 1 to so many characters.
    Text(Option<usize>),
    /// A list of texts, each of 1 to so many characters.
    Texts(usize),
    /// True or false.
    Flag,
    /// One of these words.
    Choice(Vec<&'static str>),
    /// A number that the device counts in steps.
    Whole(Number),
    /// Any number.
    Real(Number),
    /// A list of numbers, and what they are.
    Wholes(Number, &'static str),
    /// A list of so many pairs of any numbers, and what they are.
    Pairs(Number, usize, &'static str),
    /// A table.
    Table(Section),
    /// A list of tables.
    Tables(Section, Count),
}

/// How many tables a list may have, and what they are.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Count {
    pub(crate) least: usize,
    pub(crate) most: Option<usize>,
    pub(crate) of: &'static str,
}

/// A number: its unit for people, its range in 10^−`places` of that.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Number {
    pub(crate) unit: &'static str,
    pub(crate) places: i32,
    /// What the firmware calls it; empty if it does not know it.
    pub(crate) device: &'static str,
    pub(crate) range: Option<(i64, i64)>,
    /// What other fields leave of the range, for people; if nothing, the range
    /// is the whole rule.
    pub(crate) bound: &'static str,
    /// Whether it is the rate of what the firmware has the period of, µs.
    pub(crate) is_rate: bool,
}

/// Whether a field must be there.
#[derive(Debug)]
pub(crate) enum Need {
    Required,
    /// Unless another field of the table is there.
    RequiredWithout(&'static str),
    /// Without a wearer file that says it: the reader knows.
    OrFile,
    /// There is nothing without it.
    Optional,
    /// A number instead, in the device's steps.
    Or(i64),
    /// A word or a truth value instead.
    OrWord(&'static str),
    /// What other fields decide, for people.
    OrTold(String),
}

/// When a file may have a field.
#[derive(Clone, Copy, Debug)]
pub(crate) enum When {
    /// Another field of the table is one of these words.
    Is(&'static str, &'static [&'static str]),
    /// Another field of the table is left out.
    Without(&'static str),
}

impl Field {
    pub(crate) fn new(name: &'static str, kind: Kind, need: Need, meaning: &'static str) -> Self {
        let when = None;
        Self {
            name,
            kind,
            need,
            meaning,
            when,
        }
    }

    /// Only where `tag` is one of `words`.
    pub(crate) fn when(mut self, tag: &'static str, words: &'static [&'static str]) -> Self {
        self.when = Some(When::Is(tag, words));
        self
    }

    /// Only where `other` is left out.
    pub(crate) fn without(mut self, other: &'static str) -> Self {
        self.when = Some(When::Without(other));
        self
    }

    /// Its unit and meaning, for editors.
    pub(crate) fn description(&self) -> String {
        let number = self.number().filter(|number| !number.unit.is_empty());
        let unit = number.map(|number| match number.bound {
            "" => format!("{}: ", number.unit),
            bound => format!("{}, {bound}: ", number.unit),
        });
        format!("{}{}", unit.unwrap_or_default(), self.meaning)
    }

    /// The power of ten between its unit and the device's.
    pub(crate) fn places(&self) -> i32 {
        self.number().map_or(0, |number| number.places)
    }

    /// Its number, if it is one.
    pub(crate) const fn number(&self) -> Option<&Number> {
        match &self.kind {
            Kind::Whole(number)
            | Kind::Real(number)
            | Kind::Wholes(number, _)
            | Kind::Pairs(number, ..) => Some(number),
            _ => None,
        }
    }
}

impl Kind {
    /// What a reader expects here, for people.
    pub(crate) const fn expected(&self) -> &'static str {
        match self {
            Self::Text(_) | Self::Choice(_) => "text",
            Self::Texts(_) => "a list of texts",
            Self::Flag => "true or false",
            Self::Whole(_) | Self::Real(_) => "a number",
            Self::Wholes(_, what) | Self::Pairs(_, _, what) => what,
            Self::Table(_) => "a table",
            Self::Tables(..) => "a list of tables",
        }
    }
}

impl Number {
    /// A range that the firmware declares, in 10^−`places` of the file's unit.
    pub(crate) fn of(unit: &'static str, places: i32, range: Range) -> Self {
        Self {
            device: range.field,
            ..Self::within(unit, places, range.min.into(), range.max.into())
        }
    }

    /// A range of the host's own.
    pub(crate) const fn within(unit: &'static str, places: i32, min: i64, max: i64) -> Self {
        Self {
            unit,
            places,
            device: "",
            range: Some((min, max)),
            bound: "",
            is_rate: false,
        }
    }

    /// Of no range that is its own.
    pub(crate) const fn any(unit: &'static str, places: i32, bound: &'static str) -> Self {
        Self {
            unit,
            places,
            device: "",
            range: None,
            bound,
            is_rate: false,
        }
    }

    /// The rate, in mHz, of what `device` is the period of, in µs.
    pub(crate) fn rate_of(device: &'static str, period_us: Range) -> Self {
        let mhz = |us: i32| 1_000_000_000 / i64::from(us.max(1));
        Self {
            device,
            is_rate: true,
            ..Self::within("Hz", 3, mhz(period_us.max), mhz(period_us.min))
        }
    }

    /// What other fields leave of it.
    pub(crate) const fn bound(mut self, bound: &'static str) -> Self {
        self.bound = bound;
        self
    }

    /// "0.5 to 200", of bounds that the firmware names.
    pub(crate) fn told(&self, min: i64, max: i64) -> String {
        match self.is_rate {
            true => format!("{} to {}", 1e6 / max as f64, 1e6 / min as f64),
            false => between(min, max, self.places),
        }
    }

    /// "0.5 to 200", of its own range.
    pub(crate) fn allowed(&self) -> Option<String> {
        let range = self.range.map(|(min, max)| between(min, max, self.places));
        range.map(|range| {
            format!("{range} {}", self.shown_unit())
                .trim_end()
                .to_owned()
        })
    }

    /// The unit for people; empty if there is none or another field decides it.
    pub(crate) fn shown_unit(&self) -> &'static str {
        if self.unit.starts_with(UNIT) {
            ""
        } else {
            self.unit
        }
    }

    /// What was probably meant by a `value` in SI base units where the field has smaller ones:
    /// `; did you mean 200 µs?` of 0.0002. Empty if that is not allowed either.
    pub(crate) fn meant(&self, value: f64) -> String {
        let is_smaller = self.unit.starts_with(['m', 'µ']) && self.unit != "m";
        let Some((min, max)) = self.range.filter(|_| is_smaller) else {
            return String::new();
        };
        let steps = 10_f64.powi(self.places);
        let is_allowed = |value: &f64| {
            let whole = (value * steps).round();
            (value * steps - whole).abs() < 1e-6 && (min as f64..=max as f64).contains(&whole)
        };
        let mut scaled = [1e3, 1e6].into_iter().map(|factor| value * factor);
        scaled.find(is_allowed).map_or_else(String::new, |value| {
            let value = in_units((value * steps).round() as i64, self.places);
            format!("; did you mean {value} {}?", self.unit)
        })
    }
}

impl Count {
    /// "1 to 2 points".
    pub(crate) fn allowed(self) -> String {
        let Self { least, most, of } = self;
        match most {
            None => format!("{least} or more {of}"),
            Some(most) if least == 0 => format!("at most {most} {of}"),
            Some(most) => format!("{least} to {most} {of}"),
        }
    }
}

/// A unit that a channel's stage decides.
pub(crate) const UNIT: &str = "unit";

/// A field.
pub(crate) fn f(name: &'static str, kind: Kind, need: Need, meaning: &'static str) -> Field {
    Field::new(name, kind, need, meaning)
}

/// A whole number in a range of the firmware.
pub(crate) fn n(unit: &'static str, places: i32, range: Range) -> Kind {
    Kind::Whole(Number::of(unit, places, range))
}

/// The same where other fields leave less of it.
pub(crate) fn nb(unit: &'static str, places: i32, range: Range, bound: &'static str) -> Kind {
    Kind::Whole(Number::of(unit, places, range).bound(bound))
}

/// A list of tables.
pub(crate) fn list(fields: Section, least: usize, most: Option<usize>, of: &'static str) -> Kind {
    Kind::Tables(fields, Count { least, most, of })
}

/// The words of a choice.
pub(crate) fn one_of<T>(choices: &[(&'static str, T)]) -> Kind {
    Kind::Choice(choices.iter().map(|(word, _)| *word).collect())
}

/// A number of a channel in the file.
pub(crate) fn channel() -> Kind {
    Kind::Whole(CHANNEL)
}

/// Channels count from 1 in files.
pub(crate) const CHANNEL: Number = Number::within("", 0, 1, firmware::pulse::CHANNELS as i64);

/// Longest text of a field, characters; of the notes.
pub const LONGEST: usize = 200;
pub(crate) const LONGEST_NOTES: usize = 4000;

/// Rungs that there were: they cost more than the better one that stands for them.
const DROPPED: [&str; 2] = ["static", "lag"];
/// What a word that there was has become, where it is one of `words`.
pub(super) fn instead(given: &str, words: &[&'static str]) -> Option<&'static str> {
    let is_dropped = DROPPED.contains(&given);
    let mut words = words.iter().copied();
    words.find(|word| is_dropped && *word == "calcium-force")
}
