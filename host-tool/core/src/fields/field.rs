//! Declarations of the fields of a file. The reader, the JSON schema and the tables of
//! docs/reference/sessions.md all use these declarations and nothing else.

use firmware::range::Range;

use super::decimal::{format_range, format_scaled};

/// The fields of a table, in the order in which documents list them.
pub(crate) type Section = Vec<Field>;

/// Declaration of one field of a table.
#[derive(Debug)]
pub(crate) struct Field {
    pub(crate) name: &'static str,
    pub(crate) kind: Kind,
    pub(crate) need: Need,
    /// Explanation of the field in docs/reference/sessions.md and in editors.
    pub(crate) meaning: &'static str,
    /// Condition under which the file may have the field; `None` if it always may.
    pub(crate) when: Option<Condition>,
}

/// Type of a field's value, with its range.
#[derive(Debug)]
pub(crate) enum Kind {
    /// A text of 1 to this many characters, or of any length with `None`.
    Text(Option<usize>),
    /// A list of texts, each of 1 to this many characters.
    Texts(usize),
    /// A truth value, true or false.
    Flag,
    /// One of these words.
    Choice(Vec<&'static str>),
    /// A number that must be a whole number of steps of 10^−`places` in its unit, because the
    /// device counts in these steps.
    Whole(Number),
    /// A number of any precision.
    Real(Number),
    /// A list of numbers that must be whole numbers of steps. The text describes the list in
    /// messages.
    Wholes(Number, &'static str),
    /// A list of this many pairs of numbers. The text describes the list in messages.
    Pairs(Number, usize, &'static str),
    /// A table with these fields.
    Table(Section),
    /// A list of tables with these fields.
    Tables(Section, Count),
}

/// Allowed number of tables in a list, from `least` to `most`. The plural `of` names the tables in
/// messages.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Count {
    pub(crate) least: usize,
    pub(crate) most: Option<usize>,
    pub(crate) of: &'static str,
}

/// Declaration of a number: its unit in the file, and its range in steps of 10^−`places` of that
/// unit.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Number {
    pub(crate) unit: &'static str,
    pub(crate) places: i32,
    /// Name of the quantity in the firmware, by which the firmware's refusals find the field; empty
    /// if the firmware does not have it.
    pub(crate) device: &'static str,
    pub(crate) range: Option<(i64, i64)>,
    /// Description of how other fields restrict the range further; empty if they do not.
    pub(crate) bound: &'static str,
    /// Whether the number is a rate of which the firmware has the reciprocal, a period in µs.
    pub(crate) is_rate: bool,
}

/// Whether a file must have a field, and which default the field has.
#[derive(Debug)]
pub(crate) enum Need {
    Required,
    /// Required, unless the table has the field of this name instead.
    RequiredWithout(&'static str),
    /// Required, unless the wearer file gives the value. The code that reads the value checks this.
    OrFile,
    /// Optional, without a default.
    Optional,
    /// Optional, with this number of steps of 10^−`places` as the default.
    Or(i64),
    /// Optional, with this word, or "true" or "false", as the default.
    OrWord(&'static str),
    /// Optional, with a default that depends on other fields; the text describes the default.
    OrTold(String),
}

/// Condition under which a file may have a field of this declaration.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Condition {
    /// The field named first has one of these words as its value.
    Is(&'static str, &'static [&'static str]),
    /// The table does not have the field of this name.
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

    /// Allows the field only if the field `tag` of the same table has one of `words` as its value.
    pub(crate) fn when(mut self, tag: &'static str, words: &'static [&'static str]) -> Self {
        self.when = Some(Condition::Is(tag, words));
        self
    }

    /// Allows the field only if the same table does not have the field `other`.
    pub(crate) fn without(mut self, other: &'static str) -> Self {
        self.when = Some(Condition::Without(other));
        self
    }

    /// Returns the description that editors show: unit, restrictions and meaning of the field.
    pub(crate) fn description(&self) -> String {
        let number = self.number().filter(|number| !number.unit.is_empty());
        let unit = number.map(|number| match number.bound {
            "" => format!("{}: ", number.unit),
            bound => format!("{}, {bound}: ", number.unit),
        });
        format!("{}{}", unit.unwrap_or_default(), self.meaning)
    }

    /// Returns the number of decimal places of the device's step in the field's unit; 0 if the
    /// field holds no number.
    pub(crate) fn places(&self) -> i32 {
        self.number().map_or(0, |number| number.places)
    }

    /// Returns the declaration of the field's number or numbers; `None` if the field holds none.
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
    /// Returns the name of the expected type for messages, for example "a list of texts".
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
    /// Returns a number in a `range` that the firmware declares, in steps of 10^−`places` of the
    /// file's `unit`.
    pub(crate) fn from_range(unit: &'static str, places: i32, range: Range) -> Self {
        Self {
            device: range.field,
            ..Self::within(unit, places, range.min.into(), range.max.into())
        }
    }

    /// Returns a number in a range that only the host declares, from `min` to `max` in steps of
    /// 10^−`places` of `unit`.
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

    /// Returns a number without a range of its own. `bound` describes how other fields restrict it.
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

    /// Returns a pulse rate in Hz with three places. Its range follows from `period_us`, the
    /// firmware's range of the period, and `device` is the firmware's name of the period.
    pub(crate) fn rate_from_period(device: &'static str, period_us: Range) -> Self {
        let mhz = |us: i32| 1_000_000_000 / i64::from(us.max(1));
        Self {
            device,
            is_rate: true,
            ..Self::within("Hz", 3, mhz(period_us.max), mhz(period_us.min))
        }
    }

    /// Adds a description of how other fields restrict the range further.
    pub(crate) const fn bound(mut self, bound: &'static str) -> Self {
        self.bound = bound;
        self
    }

    /// Formats bounds that the firmware reports in its own steps, in the unit of the file, for
    /// example "0.5 to 200".
    pub(crate) fn format_bounds(&self, min: i64, max: i64) -> String {
        match self.is_rate {
            true => format!("{} to {}", 1e6 / max as f64, 1e6 / min as f64),
            false => format_range(min, max, self.places),
        }
    }

    /// Formats the range with its unit, for example "0.5 to 200 mA". Returns `None` if the number
    /// has no range of its own.
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

    /// Returns the unit for messages: both of an amplitude if the unit depends on the output stage.
    /// It is empty if the number has no unit.
    pub(crate) fn display_unit(&self) -> &'static str {
        match self.unit.strip_prefix(UNIT) {
            Some("") => "mA or V",
            Some(_) => "",
            None => self.unit,
        }
    }

    /// Returns a suggestion for a `value` that seems to be in SI base units although the field has
    /// smaller ones, for example `; did you mean 200 µs?` for 0.0002. Returns an empty text if the
    /// suggested value would not be allowed either.
    pub(crate) fn unit_suggestion(&self, value: f64) -> String {
        let is_smaller = self.unit.starts_with(['m', 'µ']) && self.unit != "m";
        let Some((min, max)) = self.range.filter(|_| is_smaller) else {
            return String::new();
        };
        let steps = 10_f64.powi(self.places);
        let is_allowed = |value: &f64| {
            let nearest = (value * steps).round();
            (value * steps - nearest).abs() < 1e-6 && (min as f64..=max as f64).contains(&nearest)
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

/// Placeholder for the unit of an amplitude, mA or V, which depends on the channel's output stage.
pub(crate) const UNIT: &str = "unit";

/// Declares a field that a file may have in any case, without a condition.
pub(crate) fn field(name: &'static str, kind: Kind, need: Need, meaning: &'static str) -> Field {
    Field::new(name, kind, need, meaning)
}

/// Returns the kind of a field with a number of whole steps in a `range` that the firmware
/// declares.
pub(crate) fn number_in(unit: &'static str, places: i32, range: Range) -> Kind {
    Kind::Whole(Number::from_range(unit, places, range))
}

/// Returns the kind of a field with a number of whole steps in a `range` that the firmware
/// declares. `bound` describes how other fields restrict the range further.
pub(crate) fn bounded_number(
    unit: &'static str,
    places: i32,
    range: Range,
    bound: &'static str,
) -> Kind {
    Kind::Whole(Number::from_range(unit, places, range).bound(bound))
}

/// Returns the kind of a list of `least` to `most` tables with `fields`. The plural `plural` names the
/// tables in messages.
pub(crate) fn list(
    fields: Section,
    least: usize,
    most: Option<usize>,
    plural: &'static str,
) -> Kind {
    Kind::Tables(
        fields,
        Count {
            least,
            most,
            of: plural,
        },
    )
}

/// Returns the kind of a field whose value is one of the words of `choices`.
pub(crate) fn one_of<T>(choices: &[(&'static str, T)]) -> Kind {
    Kind::Choice(choices.iter().map(|(word, _)| *word).collect())
}

/// Returns the kind of a field that holds a channel number, 1 to 10.
pub(crate) fn channel_number() -> Kind {
    Kind::Whole(CHANNEL)
}

/// Declaration of a channel number, which counts from 1 in files.
pub(crate) const CHANNEL: Number = Number::within("", 0, 1, firmware::pulse::CHANNELS as i64);

/// Greatest length of most texts in a file, characters.
pub const LONGEST: usize = 200;
/// Greatest length of notes in a file, characters.
pub(crate) const LONGEST_NOTES: usize = 4000;

/// Names of model levels that no longer exist, because the better level that replaced them costs
/// less.
const DROPPED: [&str; 2] = ["static", "lag"];
/// Returns the word that replaced the former word `given`, or `None` if it is no former word or if
/// the replacement is not among `words`.
pub(super) fn replacement_word(given: &str, words: &[&'static str]) -> Option<&'static str> {
    let is_dropped = DROPPED.contains(&given);
    let mut words = words.iter().copied();
    words.find(|word| is_dropped && *word == "calcium-force")
}
