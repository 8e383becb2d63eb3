//! The session of a random wearer of a study, from a row of its `draws.csv`.
//!
//! It is written with a table or a channel per header, as people write sessions. The crate toml would
//! add 10 kB to the module.

use crate::error::CallError;
use host_core::session::{noise_seed, set_field};
use serde::Deserialize;
use serde_json::{Value, json};
use toml::Table;

/// A row of `draws.csv`, and the session of its condition.
#[derive(Deserialize, Debug)]
#[serde(deny_unknown_fields)]
pub struct Draw {
    /// Session file that a recorded trial of the condition keeps.
    text: String,
    /// Fields of the wearer with their values, as the file has them.
    fields: Vec<(String, String)>,
    /// Seed of the study; a text, because it may be larger than a JavaScript number holds.
    seed: String,
    /// Number of the wearer, from 0.
    wearer: String,
}

/// Returns the session with the wearer's values, and the seed of the wearer's noise as a text.
///
/// # Errors
/// A number cannot be read, or the session lacks a field.
pub fn replay(draw: &Draw) -> Result<Value, CallError> {
    let [study, wearer] = [&draw.seed, &draw.wearer].map(|text| text.parse::<u64>());
    let (Ok(study), Ok(wearer)) = (study, wearer) else {
        return Err(CallError::new(
            "E816 seed and wearer must be whole numbers of at most 64 bits",
        ));
    };
    let mut table: Table = draw.text.parse().map_err(CallError::new)?;
    for (field, text) in &draw.fields {
        set_field(&mut table, field, value(text)).map_err(CallError::new)?;
    }
    let seed = noise_seed(study, wearer);
    Ok(json!({ "text": text(&table), "seed": seed.to_string() }))
}

/// Returns the value of a cell: a whole number, another number, or a word.
fn value(text: &str) -> toml::Value {
    if let Ok(whole) = text.parse::<i64>() {
        return whole.into();
    }
    match text.parse::<f64>() {
        Ok(number) => number.into(),
        Err(_) => text.into(),
    }
}

/// Returns a session file with these tables.
fn text(session: &Table) -> String {
    let mut single = String::new();
    let mut headed = String::new();
    for (key, value) in session {
        match value {
            toml::Value::Table(table) => section(&format!("[{}]", quoted(key)), table, &mut headed),
            toml::Value::Array(items) if items.first().is_some_and(toml::Value::is_table) => {
                let tables = items.iter().filter_map(toml::Value::as_table);
                tables
                    .for_each(|table| section(&format!("[[{}]]", quoted(key)), table, &mut headed));
            }
            value => single += &format!("{} = {}\n", quoted(key), inline(value)),
        }
    }
    single + &headed
}

fn section(header: &str, table: &Table, out: &mut String) {
    *out += &format!("\n{header}\n");
    for (key, value) in table {
        *out += &format!("{} = {}\n", quoted(key), inline(value));
    }
}

/// Returns a value on one line.
fn inline(value: &toml::Value) -> String {
    match value {
        toml::Value::Integer(whole) => whole.to_string(),
        toml::Value::Float(number) => format!("{number:?}"),
        toml::Value::Boolean(flag) => flag.to_string(),
        toml::Value::String(text) => json!(text).to_string(), // escapes are the same
        toml::Value::Datetime(_) => "\"\"".to_owned(),        // no field of a session
        toml::Value::Array(items) => {
            let items: Vec<String> = items.iter().map(inline).collect();
            format!("[{}]", items.join(", "))
        }
        toml::Value::Table(table) => {
            let pairs = table.iter();
            let pairs = pairs.map(|(key, value)| format!("{} = {}", quoted(key), inline(value)));
            format!("{{ {} }}", pairs.collect::<Vec<_>>().join(", "))
        }
    }
}

/// Returns a key, in quotes unless it is a bare one.
fn quoted(key: &str) -> String {
    let is_bare = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
    match key.is_empty() || !key.chars().all(is_bare) {
        true => json!(key).to_string(),
        false => key.to_owned(),
    }
}
