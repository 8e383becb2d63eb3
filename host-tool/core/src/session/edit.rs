//! Changes single fields of a session file by their paths, as declarations and rows of `draws.csv` name
//! them, and the noise of a study's random wearers.

use hal_sim::random::word;
use toml::{Table, Value};

/// Random stream of the noise of a study's wearers.
const NOISE: u64 = 0x1AB1;

/// Returns the seed of the noise of random wearer `wearer` (from 0) in a study with this seed.
#[must_use]
pub const fn noise_seed(study: u64, wearer: u64) -> u64 {
    word(word(study, NOISE), wearer)
}

/// Returns the table that contains the field with the dotted path `field`, and the last part of
/// that path.
fn parent<'t, 'f>(root: &'t mut Table, field: &'f str) -> Result<(&'t mut Table, &'f str), String> {
    let refuse = |reason: String| format!("`{field}` cannot be set: {reason}");
    let (path, last) = field.rsplit_once('.').unwrap_or(("", field));
    let mut at = root;
    let mut parts = path.split('.').filter(|part| !part.is_empty());
    while let Some(part) = parts.next() {
        let value = at.get_mut(part);
        let value = value.ok_or_else(|| refuse(format!("the session has no `{part}`")))?;
        at = match value {
            Value::Table(table) => table,
            Value::Array(list) => {
                let wanted = parts.next().unwrap_or_default();
                // Channels have numbers of their own; the position of a program is its number.
                let number = |(place, item): (usize, &Value)| {
                    let own = item.get("number").and_then(Value::as_integer);
                    own.map_or_else(|| (place + 1).to_string(), |own| own.to_string())
                };
                let numbers: Vec<String> = list.iter().enumerate().map(number).collect();
                let place = numbers.iter().position(|number| number == wanted);
                let item = place.and_then(|place| list.get_mut(place));
                let item = item.and_then(Value::as_table_mut);
                item.ok_or_else(|| {
                    let first = numbers.first().map_or("1", String::as_str);
                    let known = numbers.join(", ");
                    refuse(match wanted.is_empty() {
                        true => format!("write its number, as in `{part}.{first}.{last}`"),
                        false => format!("no `{part}` has the number {wanted}, only {known}"),
                    })
                })?
            }
            _ => return Err(refuse(format!("`{part}` is not a table"))),
        };
    }
    Ok((at, last))
}

/// Sets the field with the dotted path `field` in the tables of a session file, such as
/// `channel.3.limit`: channels go by their own numbers, other lists by position, from 1.
///
/// # Errors
/// The session has no table of this path; the message names the field.
pub fn set_field(root: &mut Table, field: &str, value: Value) -> Result<(), String> {
    let (table, last) = parent(root, field)?;
    table.insert(last.to_owned(), value);
    Ok(())
}

/// Removes the field with the dotted path `field`, written as for [`set_field`].
///
/// # Errors
/// The session does not have the field.
pub fn unset_field(root: &mut Table, field: &str) -> Result<(), String> {
    let (table, last) = parent(root, field)?;
    match table.remove(last) {
        Some(_) => Ok(()),
        None => Err(format!(
            "`{field}` cannot be removed: the session does not have this field"
        )),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Channels go by their own numbers, programs by their position.
    #[test]
    fn a_path_names_a_channel_or_a_program_by_its_number() {
        let text = "[[channel]]\nnumber = 8\n[[program]]\nvalue = 1.0\n[[program]]\nvalue = 2.0\n";
        let mut session: Table = text.parse().unwrap();
        set_field(&mut session, "program.2.value", 3.0.into()).unwrap();
        set_field(&mut session, "channel.8.limit", 9.0.into()).unwrap();
        assert_eq!(session["program"][1]["value"], Value::from(3.0));
        assert_eq!(session["channel"][0]["limit"], Value::from(9.0));
        for (field, reason) in [
            (
                "program.3.value",
                "no `program` has the number 3, only 1, 2",
            ),
            ("program.value", "write its number, as in `program.1.value`"),
            ("channel.1.limit", "no `channel` has the number 1, only 8"),
        ] {
            let error = set_field(&mut session, field, 0.0.into()).unwrap_err();
            assert!(error.contains(reason), "{error}");
        }
    }

    #[test]
    fn paths_go_through_tables_and_numbered_lists() {
        let text = "a = 1\n[b]\nc = 2\n[[channel]]\nnumber = 3\nlimit = 4.0\n";
        let mut table: Table = text.parse().unwrap();
        set_field(&mut table, "b.c", Value::from(5)).unwrap();
        set_field(&mut table, "channel.3.limit", Value::from(6.5)).unwrap();
        unset_field(&mut table, "a").unwrap();
        assert_eq!(table["b"]["c"].as_integer(), Some(5));
        assert_eq!(table["channel"][0]["limit"].as_float(), Some(6.5));
        assert!(!table.contains_key("a"));
        for field in ["x.y", "channel.4.limit", "b.c.d"] {
            let refused = set_field(&mut table, field, Value::from(0)).unwrap_err();
            assert!(
                refused.starts_with(&format!("`{field}` cannot")),
                "{refused}"
            );
        }
        assert!(unset_field(&mut table, "a").is_err());
    }
}
