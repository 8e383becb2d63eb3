//! Description of the link protocol for programs: types with units and ranges, refusals, and test
//! vectors.
//!
//! Names, types and numbers come from the code, units, ranges and meanings from `fields.toml`, and
//! vectors from docs/protocol_vectors.json, which a test compares with the code. The tables of
//! docs/protocol.md are generated from it.

mod schema;

use firmware::link::{Code, MAX_MESSAGE, Response, SCHEMA, ToDevice};
use host_core::link::{advice, meaning};
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::collections::BTreeMap;
use std::fmt::Write;

/// Text of the file with units, ranges and meanings.
const FIELDS: &str = include_str!("fields.toml");

/// Text of the file with the vectors.
const VECTORS: &str = include_str!("../../../docs/protocol_vectors.json");

/// The protocol as `flexor protocol --json` prints it.
#[derive(Clone, Debug, Serialize)]
pub struct Protocol {
    /// Hash over the schemas of all messages, which `Hello` carries, as a hexadecimal number.
    pub schema: String,
    /// Version of Flexor.
    pub version: &'static str,
    /// Largest length of a message without its checksum, bytes.
    pub max_message_bytes: usize,
    /// Names of the types of a message to the device and of one to the host.
    pub messages: [String; 2],
    /// All structs and enums, by name.
    pub types: BTreeMap<String, TypeDescription>,
    /// Codes of refusals.
    pub refusals: Vec<RefusalDescription>,
    /// Test vectors: messages, their encoding and their frames.
    pub vectors: Value,
    /// Test vectors of the checksum over a setup.
    pub setup_sums: Value,
}

/// A struct or an enum of the protocol.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum TypeDescription {
    /// Fields in the order of their encoding.
    Struct(Vec<Field>),
    /// Variants in the order of their numbers.
    Enum(Vec<Variant>),
}

/// A field of a struct. A struct around a single value has one field of the name `newtype`.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Field {
    /// Name as it stands in a message's JSON.
    pub name: String,
    /// Type, as docs/protocol.md writes it.
    #[serde(rename = "type")]
    pub ty: String,
    /// Unit, range and meaning.
    #[serde(flatten)]
    pub about: Explanation,
}

/// A variant of an enum.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Variant {
    /// Number on the wire.
    pub number: usize,
    /// Name as it stands in a message's JSON.
    pub name: String,
    /// Type of its content; `None` if it has none or named parts.
    #[serde(rename = "type", skip_serializing_if = "Option::is_none")]
    pub ty: Option<String>,
    /// Named parts of its content: name and type.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub parts: Vec<(String, String)>,
    /// Meaning.
    #[serde(flatten)]
    pub about: Explanation,
}

/// Unit, range and meaning of a field or variant.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Explanation {
    /// Unit; `None` without one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub unit: Option<String>,
    /// Range in words; `None` if the type's own.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub range: Option<String>,
    /// Smallest value, if the range consists of numbers.
    #[serde(skip_deserializing, skip_serializing_if = "Option::is_none")]
    pub min: Option<i64>,
    /// Largest value, if the range consists of numbers.
    #[serde(skip_deserializing, skip_serializing_if = "Option::is_none")]
    pub max: Option<i64>,
    /// Meaning, with links into docs/protocol.md.
    #[serde(default)]
    pub meaning: String,
}

/// Code of a refusal.
#[derive(Clone, Debug, Serialize)]
pub struct RefusalDescription {
    /// Number on the wire.
    pub code: u16,
    /// Name in docs/protocol.md.
    pub name: String,
    /// Reason, as a phrase.
    pub meaning: &'static str,
    /// Advice to a user.
    pub advice: &'static str,
}

/// Units, ranges and meanings, by type and name.
type Words = BTreeMap<String, BTreeMap<String, Explanation>>;

/// Vectors of docs/protocol_vectors.json.
#[derive(Deserialize)]
struct Vectors {
    vectors: Value,
    setup_sums: Value,
}

/// Describes the protocol of this program.
///
/// # Errors
/// Fails if a file of the program cannot be read, or describes no field or variant of the protocol.
pub fn describe() -> anyhow::Result<Protocol> {
    let mut words: Words = toml::from_str(FIELDS)?;
    let mut types = BTreeMap::new();
    let messages = [ToDevice::SCHEMA, <Response<'static> as Schema>::SCHEMA];
    for message in messages {
        schema::collect(message, &mut words, &mut types)?;
    }
    if let Some((name, rest)) = words.iter().find(|(_, rest)| !rest.is_empty()) {
        let names: Vec<&str> = rest.keys().map(String::as_str).collect();
        anyhow::bail!("fields.toml describes what {name} does not have: {names:?}");
    }
    let vectors: Vectors = serde_json::from_str(VECTORS)?;
    Ok(Protocol {
        schema: format!("{SCHEMA:#018x}"),
        version: env!("CARGO_PKG_VERSION"),
        max_message_bytes: MAX_MESSAGE,
        messages: messages.map(schema::name),
        types,
        refusals: Code::ALL
            .iter()
            .map(|code| RefusalDescription {
                code: *code as u16,
                name: format!("{code:?}"),
                meaning: meaning(*code),
                advice: advice(*code),
            })
            .collect(),
        vectors: vectors.vectors,
        setup_sums: vectors.setup_sums,
    })
}

impl TypeDescription {
    /// Returns the table of this type in docs/protocol.md.
    #[must_use]
    pub fn to_markdown(&self) -> String {
        let mut text = String::new();
        match self {
            Self::Struct(fields) => {
                text += "| Field | Type | Unit, range | Meaning |\n|---|---|---|---|\n";
                for Field { name, ty, about } in fields {
                    let (unit, meaning) = (about.unit_and_range(), &about.meaning);
                    let _ = writeln!(text, "| `{name}` | `{ty}` | {unit} | {meaning} |");
                }
            }
            Self::Enum(variants) => {
                text += "| No. | Variant | Carries | Meaning |\n|---|---|---|---|\n";
                for variant in variants {
                    let (number, name) = (variant.number, &variant.name);
                    let (carries, meaning) = (variant.carries(), &variant.about.meaning);
                    let _ = writeln!(text, "| {number} | `{name}` | {carries} | {meaning} |");
                }
            }
        }
        text.replace("|  |", "| |")
    }
}

impl Variant {
    /// Returns the content in words of docs/protocol.md: a type, named parts, or a dash.
    #[must_use]
    pub fn carries(&self) -> String {
        let parts = self.parts.iter();
        let parts = parts.map(|(name, ty)| format!("{name}: {ty}"));
        match (&self.ty, parts.collect::<Vec<_>>()) {
            (Some(ty), _) => format!("`{ty}`"),
            (None, parts) if parts.is_empty() => "–".to_owned(),
            (None, parts) => format!("`{}`", parts.join(", ")),
        }
    }
}

impl Explanation {
    fn unit_and_range(&self) -> String {
        let both = [self.unit.as_deref(), self.range.as_deref()];
        both.into_iter().flatten().collect::<Vec<_>>().join(", ")
    }

    /// Reads smallest and largest value from a range of two numbers.
    fn with_bounds(mut self) -> Self {
        if let Some((min, max)) = self.range.as_deref().and_then(bounds) {
            (self.min, self.max) = (Some(min), Some(max));
        }
        self
    }
}

/// Returns the numbers of a range such as "1–40 000" or "±180 000".
fn bounds(range: &str) -> Option<(i64, i64)> {
    let number = |text: &str| {
        let digits = text.replace('−', "-").replace(' ', "");
        digits.parse::<i64>().ok()
    };
    if let Some(both) = range.strip_prefix('±').and_then(number) {
        return Some((-both, both));
    }
    let (min, max) = range.split_once('–')?;
    number(min).zip(number(max))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_of_numbers_have_bounds() {
        assert_eq!(bounds("1–40 000"), Some((1, 40_000)));
        assert_eq!(bounds("±180 000"), Some((-180_000, 180_000)));
        assert_eq!(bounds("−180 000–179 999"), Some((-180_000, 179_999)));
        assert_eq!(bounds("0–`limit`"), None);
        assert_eq!(bounds("1000–20 000, or 0"), None);
    }

    /// Every type, field and variant is described, and no other.
    #[test]
    fn the_whole_protocol_is_described() {
        let protocol = describe().unwrap();
        assert!(protocol.types.len() > 60, "{}", protocol.types.len());
        let TypeDescription::Struct(fields) = &protocol.types["WearerSpec"] else {
            panic!("no struct");
        };
        let current = &fields[0];
        assert_eq!(
            (current.name.as_str(), current.ty.as_str()),
            ("max_current_ua", "u32")
        );
        assert_eq!(current.about.unit.as_deref(), Some("µA"));
        assert_eq!(
            (current.about.min, current.about.max),
            (Some(100), Some(100_000))
        );
        let sums = protocol.setup_sums.as_array().unwrap();
        assert!(sums.len() >= 8, "{}", sums.len());
    }
}
