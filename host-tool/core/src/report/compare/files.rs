//! Differences between two files, by their keys and line by line.

use crate::html;
use crate::report::Html;
use serde::Serialize;
use similar::TextDiff;
use std::collections::{BTreeMap, BTreeSet};
use toml::Value;

/// Maximum number of lines of a file that is compared line by line. Of a longer file, only the keys
/// are compared.
const MOST_LINES: usize = 5_000;
/// Number of columns of the terminal for which texts are formatted.
const WIDE: usize = 80;
/// Maximum number of keys of a file that the terminal shows; the page shows all of them.
const MOST_KEYS: usize = 12;

/// How a TOML file of one record differs from the same file of other records.
#[derive(Clone, PartialEq, Eq, Debug, Serialize)]
pub struct FileDifference {
    /// Name of the file: `session.toml`, `wearer.toml` or the name of another file in the record.
    pub file: String,
    /// Name of the trial, or of the experiment, that the file belongs to.
    pub of: String,
    /// Number of the record that the others are compared with, from 1.
    pub from: usize,
    /// Numbers of the records whose file differs from that one in the same way.
    pub to: Vec<usize>,
    /// Keys whose values differ, in alphabetical order. Empty if only comments or layout differ, or
    /// if one of the files is not valid TOML.
    pub keys: Vec<KeyChange>,
    /// Both files as a unified diff with three lines of context; empty if one of them has more than
    /// 5000 lines.
    pub unified: String,
}

/// A key whose value differs between two files.
#[derive(Clone, PartialEq, Eq, PartialOrd, Ord, Debug, Serialize)]
pub struct KeyChange {
    /// Path of the key, for example `channel[2].limit`. A channel is identified by its number, any
    /// other table of a list by its position from 1.
    pub key: String,
    /// Value in the file of record [`FileDifference::from`]; `None` if that file does not have the
    /// key.
    pub from: Option<String>,
    /// Value in the file of the other records; `None` if that file does not have the key.
    pub to: Option<String>,
}

impl FileDifference {
    /// Compares a file of two records, `from` and `to`, which are given by number and text. `of` is
    /// the trial or experiment that the file belongs to. Returns `None` if the texts are the same.
    #[must_use]
    pub fn between(
        (file, of): (&str, &str),
        (from, one): (usize, &str),
        (to, another): (usize, &str),
    ) -> Option<Self> {
        (one != another).then(|| Self {
            file: file.to_owned(),
            of: of.to_owned(),
            from,
            to: vec![to],
            keys: changed_keys(one, another),
            unified: unified_diff((from, one), (to, another)),
        })
    }

    /// Returns a heading that names the file and the records whose files differ.
    fn heading(&self) -> String {
        let to: Vec<String> = self.to.iter().map(usize::to_string).collect();
        let (file, from, to, trial_name) = (&self.file, self.from, to.join(", "), &self.of);
        format!("{file} of record {from} -> {to}: {trial_name}")
    }

    /// Returns the differing keys for a terminal of 80 columns, one line for each key.
    #[must_use]
    pub fn text(&self) -> String {
        let mut text = format!("{}\n", truncate_line(&self.heading()));
        for KeyChange { key, from, to } in self.keys.iter().take(MOST_KEYS) {
            let value = |value: &Option<String>| value.clone().unwrap_or_else(|| "absent".into());
            let line = format!("    {key}: {} -> {}", value(from), value(to));
            text += &format!("{}\n", truncate_line(&line));
        }
        text + &match self.keys.len() {
            0 => "    no key differs in value: see the lines on the page\n".to_owned(),
            count if count > MOST_KEYS => {
                format!("    and {} more keys: see the page\n", count - MOST_KEYS)
            }
            _ => String::new(),
        }
    }

    /// Returns the differing keys as a table, followed by a line-by-line comparison of both files.
    #[must_use]
    pub fn html(&self) -> Html {
        let value = |value: &Option<String>| match value {
            Some(text) => html!("<td class=\"words\"><code>{}</code></td>", text),
            None => html!("<td class=\"words\">absent</td>"),
        };
        let rows = self.keys.iter().map(|change| {
            html!(
                "<tr><th scope=\"row\"><code>{}</code></th>{}{}</tr>\n",
                change.key,
                value(&change.from),
                value(&change.to)
            )
        });
        let rows: Html = rows.collect();
        let to: Vec<String> = self.to.iter().map(usize::to_string).collect();
        let keys = match rows.is_empty() {
            true => html!("<p>The keys have the same values; only other lines differ.</p>\n"),
            false => html!(
                "<table><thead><tr><th>Key</th><th class=\"words\">Record {}</th>\
                 <th class=\"words\">Record {}</th></tr></thead><tbody>\n{}</tbody></table>\n",
                self.from,
                to.join(", "),
                rows
            ),
        };
        let lines = match self.unified.is_empty() {
            true => Html::default(),
            false => html!("<pre>{}</pre>\n", self.unified),
        };
        html!("<h3>{}</h3>\n{}{}", self.heading(), keys, lines)
    }
}

/// Cuts a line to the width of the terminal.
pub(super) fn truncate_line(line: &str) -> String {
    match line.chars().count() <= WIDE {
        true => line.to_owned(),
        false => line.chars().take(WIDE - 1).chain(['…']).collect(),
    }
}

/// Returns a unified diff of two texts, each with the number of its record; an empty text if one of
/// them has too many lines.
fn unified_diff((from, one): (usize, &str), (to, another): (usize, &str)) -> String {
    if one.lines().count().max(another.lines().count()) > MOST_LINES {
        return String::new();
    }
    let diff = TextDiff::from_lines(one, another);
    let mut unified = diff.unified_diff();
    let heads = (format!("record {from}"), format!("record {to}"));
    unified.header(&heads.0, &heads.1).to_string()
}

/// Returns the keys whose values differ between two TOML texts.
fn changed_keys(first_text: &str, another: &str) -> Vec<KeyChange> {
    let (Some(first_values), Some(another)) = (values(first_text), values(another)) else {
        return Vec::new();
    };
    let keys: BTreeSet<&String> = first_values.keys().chain(another.keys()).collect();
    let changes = keys.into_iter().map(|key| KeyChange {
        key: key.clone(),
        from: first_values.get(key).cloned(),
        to: another.get(key).cloned(),
    });
    changes.filter(|change| change.from != change.to).collect()
}

/// Returns the values of a TOML text by the paths of their keys; `None` if the text is not valid
/// TOML.
fn values(text: &str) -> Option<BTreeMap<String, String>> {
    let table: toml::Table = text.parse().ok()?;
    let mut found = BTreeMap::new();
    collect("", &Value::Table(table), &mut found);
    Some(found)
}

fn collect(path: &str, value: &Value, found: &mut BTreeMap<String, String>) {
    match value {
        Value::Table(table) => {
            for (key, value) in table {
                let dot = if path.is_empty() { "" } else { "." };
                collect(&format!("{path}{dot}{key}"), value, found);
            }
        }
        Value::Array(list) if !list.is_empty() && list.iter().all(Value::is_table) => {
            for (label, value) in labels(list).into_iter().zip(list) {
                collect(&format!("{path}[{label}]"), value, found);
            }
        }
        value => drop(found.insert(path.to_owned(), value.to_string())),
    }
}

/// Returns a label for each table of a list: its `number`, else its `channel`, else its position
/// from 1.
fn labels(list: &[Value]) -> Vec<String> {
    let by = |key: &str| -> Option<Vec<String>> {
        let numbers = list.iter().map(|value| value.get(key)?.as_integer());
        let numbers: BTreeSet<i64> = numbers.collect::<Option<_>>()?;
        let word = if key == "number" { "" } else { "channel " };
        let label = |value: &Value| Some(format!("{word}{}", value.get(key)?.as_integer()?));
        (numbers.len() == list.len())
            .then(|| list.iter().map(label).collect::<Option<_>>())
            .flatten()
    };
    let places = || (1..=list.len()).map(|place| place.to_string()).collect();
    by("number")
        .or_else(|| by("channel"))
        .unwrap_or_else(places)
}

#[cfg(test)]
mod tests {
    use super::*;

    const ONE: &str = "title = \"a\"\n[[channel]]\nnumber = 2\nlimit = 28.0\n\
                       [setpoints]\nvalues = [{ channel = 2, value = 26.0 }]\n";

    fn change(key: &str, from: Option<&str>, to: Option<&str>) -> KeyChange {
        KeyChange {
            key: key.to_owned(),
            from: from.map(str::to_owned),
            to: to.map(str::to_owned),
        }
    }

    #[test]
    fn keys_are_named_by_their_channel() {
        let another = ONE.replace("28.0", "30.0").replace("26.0", "20.0") + "rate_hz = 20\n";
        let found = changed_keys(ONE, &another);
        let limit = change("channel[2].limit", Some("28.0"), Some("30.0"));
        let rate = change("setpoints.rate_hz", None, Some("20"));
        let key = "setpoints.values[channel 2].value";
        let value = change(key, Some("26.0"), Some("20.0"));
        assert_eq!(found, [limit, rate, value]);
    }

    #[test]
    fn comments_change_no_key_and_stand_in_the_unified_diff() {
        let another = format!("# for P07\n{ONE}");
        assert_eq!(changed_keys(ONE, &another), []);
        let text = unified_diff((1, ONE), (3, &another));
        let head = "--- record 1\n+++ record 3\n@@ -1,3 +1,4 @@\n+# for P07\n title = \"a\"\n";
        assert!(text.starts_with(head), "{text}");
    }

    #[test]
    fn what_is_no_toml_or_too_long_is_no_mistake() {
        assert_eq!(changed_keys(ONE, "["), []);
        let long = "a\n".repeat(MOST_LINES + 1);
        assert_eq!(unified_diff((1, ONE), (2, &long)), "");
    }
}
