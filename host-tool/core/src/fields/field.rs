//! Declarations of the fields of a file. The reader, the JSON schema and the tables of
//! docs/sessions.md all use these declarations and nothing else.

use firmware::range::Range;

use super::decimal::{format_range, format_scaled};

/// The fields of a table, in the order in which documents list them.
pub(crate) type Section = Vec<Field>;

/// One field of a table.
#[derive(Debug)]
pub(crate) struct Field {
    pub(crate) name: &'static str,
    pub(crate) kind: Kind,
    pub(crate) need: Need,
    /// Meaning of the field, for docs/sessions.md and for editors.
    pub(crate) meaning: &'static str,
    /// Condition under which the file may have the field; `None` if it always may.
    pub(crate) when: Option<Condition>,
}

/// Type and range of the value in a field.
#[derive(Debug)]
pub(crate) enum Kind {
    /// A text of 1 to this many characters.
    Text(Option<usize>),
    /// A list of texts, each of 1 to this many characters.
    Texts(usize),
    /// A truth value, true or false.
    Flag,
    /// A choice of one of these words.
    Choice(Vec<&'static str>),
    /// A number that the device counts in whole steps.
    Whole(Number),
    /// A number that need not be a whole number of steps.
    Real(Number),
    /// A list of numbers, and a description of the list for messages.
    Wholes(Number, &'static str),
    /// A list of this many pairs of numbers, and a description of the list for messages.
    Pairs(Number, usize, &'static str),
    /// A table with these fields.
    Table(Section),
    /// A list of tables with these fields.
    Tables(Section, Count),
}

/// Allowed number of tables in a list, and their name in the plural for messages.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Count {
    pub(crate) least: usize,
    pub(crate) most: Option<usize>,
    pub(crate) of: &'static str,
}

/// A number: its unit for people, and its range in 10^−`places` of that unit.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Number {
    pub(crate) unit: &'static str,
    pub(crate) places: i32,
    /// Name of the quantity in the firmware; empty if the firmware does not know it.
    pub(crate) device: &'static str,
    pub(crate) range: Option<(i64, i64)>,
    /// Restriction of the range by other fields, for people; empty if the range is the whole rule.
    pub(crate) bound: &'static str,
    /// Whether the number is a rate, for which the firmware has the period in µs.
    pub(crate) is_rate: bool,
}

/// Whether a field is required, and its default.
#[derive(Debug)]
pub(crate) enum Need {
    Required,
    /// Required unless this other field of the table is present.
    RequiredWithout(&'static str),
    /// Required unless the wearer file has the value; the reader checks this.
    OrFile,
    /// Optional, without a default.
    Optional,
    /// Optional, with this number as default, in the device's steps.
    Or(i64),
    /// Optional, with this word or truth value as default.
    OrWord(&'static str),
    /// Optional, with a default that depends on other fields, described for people.
    OrTold(String),
}

/// Condition under which a file may have a field.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Condition {
    /// Another field of the table has one of these words.
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

    /// Allows the field only where `tag` is one of `words`.
    pub(crate) fn when(mut self, tag: &'static str, words: &'static [&'static str]) -> Self {
        self.when = Some(Condition::Is(tag, words));
        self
    }

    /// Allows the field only where `other` is left out.
    pub(crate) fn without(mut self, other: &'static str) -> Self {
        self.when = Some(Condition::Without(other));
        self
    }

    /// Returns the unit and meaning of the field, for editors.
    pub(crate) fn description(&self) -> String {
        let number = self.number().filter(|number| !number.unit.is_empty());
        let unit = number.map(|number| match number.bound {
            "" => format!("{}: ", number.unit),
            bound => format!("{}, {bound}: ", number.unit),
        });
        format!("{}{}", unit.unwrap_or_default(), self.meaning)
    }

    /// Returns the power of ten between the field's unit and the device's.
    pub(crate) fn places(&self) -> i32 {
        self.number().map_or(0, |number| number.places)
    }

    /// Returns the number declaration of the field, if its value consists of numbers.
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
    /// Returns the description of the expected type, for messages.
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
    /// Returns a number in a range that the firmware declares, in 10^−`places` of the file's unit.
    pub(crate) fn from_range(unit: &'static str, places: i32, range: Range) -> Self {
        Self {
            device: range.field,
            ..Self::within(unit, places, range.min.into(), range.max.into())
        }
    }

    /// Returns a number in a range that the host declares.
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

    /// Returns a number without a range of its own; `bound` describes the restriction by other
    /// fields.
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

    /// Returns the rate, in mHz, for which `device` is the period in the firmware, in µs.
    pub(crate) fn rate_from_period(device: &'static str, period_us: Range) -> Self {
        let mhz = |us: i32| 1_000_000_000 / i64::from(us.max(1));
        Self {
            device,
            is_rate: true,
            ..Self::within("Hz", 3, mhz(period_us.max), mhz(period_us.min))
        }
    }

    /// Adds a restriction of the range by other fields, described for people.
    pub(crate) const fn bound(mut self, bound: &'static str) -> Self {
        self.bound = bound;
        self
    }

    /// Formats bounds that the firmware reports in the unit of the file, for example "0.5 to 200".
    pub(crate) fn format_bounds(&self, min: i64, max: i64) -> String {
        match self.is_rate {
            true => format!("{} to {}", 1e6 / max as f64, 1e6 / min as f64),
            false => format_range(min, max, self.places),
        }
    }

    /// Formats the range of the number, for example "0.5 to 200", or returns `None` without a
    /// range.
    pub(crate) fn format_range(&self) -> Option<String> {
        let range = self
            .range
            .map(|(min, max)| format_range(min, max, self.places));
        range.map(|range| {
            format!("{range} {}", self.display_unit())
                .trim_end()
                .to_owned()
        })
    }

    /// The unit for people; empty if there is none or another field decides it.
    pub(crate) fn display_unit(&self) -> &'static str {
        if self.unit.starts_with(UNIT) {
            ""
        } else {
            self.unit
        }
    }

    /// What was probably meant by a `value` in SI base units where the field has smaller ones:
    /// `; did you mean 200 µs?` of 0.0002. Empty if that is not allowed either.
    pub(crate) fn unit_suggestion(&self, value: f64) -> String {
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
            let value = format_scaled((value * steps).round() as i64, self.places);
            format!("; did you mean {value} {}?", self.unit)
        })
    }
}

impl Count {
    /// Formats the allowed number of tables, for example "1 to 2 points".
    pub(crate) fn format_count(self) -> String {
        let Self { least, most, of } = self;
        match most {
            None => format!("{least} or more {of}"),
            Some(most) if least == 0 => format!("at most {most} {of}"),
            Some(most) => format!("{least} to {most} {of}"),
        }
    }
}

/// Placeholder for the unit that the channel's output stage determines, mA or V.
pub(crate) const UNIT: &str = "unit";

/// Declares a field that the file may always have.
pub(crate) fn field(name: &'static str, kind: Kind, need: Need, meaning: &'static str) -> Field {
    Field::new(name, kind, need, meaning)
}

/// Returns the kind of a whole number in a range of the firmware.
pub(crate) fn number_in(unit: &'static str, places: i32, range: Range) -> Kind {
    Kind::Whole(Number::from_range(unit, places, range))
}

/// Returns the kind of a whole number in a range of the firmware that other fields restrict
/// further; `bound` describes the restriction.
pub(crate) fn bounded_number(
    unit: &'static str,
    places: i32,
    range: Range,
    bound: &'static str,
) -> Kind {
    Kind::Whole(Number::from_range(unit, places, range).bound(bound))
}

/// Returns the kind of a list of tables with `fields`; `from_range` names them in the plural.
pub(crate) fn list(fields: Section, least: usize, most: Option<usize>, of: &'static str) -> Kind {
    Kind::Tables(fields, Count { least, most, of })
}

/// Returns the kind of a choice between the words of `choices`.
pub(crate) fn one_of<T>(choices: &[(&'static str, T)]) -> Kind {
    Kind::Choice(choices.iter().map(|(word, _)| *word).collect())
}

/// Returns the kind of a channel number in the file.
pub(crate) fn channel_number() -> Kind {
    Kind::Whole(CHANNEL)
}

/// Number of a channel; channels count from 1 in files.
pub(crate) const CHANNEL: Number = Number::within("", 0, 1, firmware::pulse::CHANNELS as i64);

/// Longest text of a field, and longest notes, characters.
pub const LONGEST: usize = 200;
pub(crate) const LONGEST_NOTES: usize = 4000;

/// Names of former model levels, which were removed because they cost more than the better level
/// that replaces them.
const DROPPED: [&str; 2] = ["static", "lag"];
/// Returns the word that replaces a former word, if it is one of `words`.
pub(super) fn replacement_word(given: &str, words: &[&'static str]) -> Option<&'static str> {
    let is_dropped = DROPPED.contains(&given);
    let mut words = words.iter().copied();
    words.find(|word| is_dropped && *word == "calcium-force")
}
