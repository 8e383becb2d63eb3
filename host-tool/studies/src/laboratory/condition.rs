//! Conditions crossed with conditions, and the sessions that they make.

use super::declaration::Declaration;
use super::draw::crossed;
use super::error::LaboratoryError;
use host_core::run::SessionFile;
use toml::{Table, Value};

/// One level of each factor.
#[derive(Clone, Debug)]
pub struct Condition {
    /// The levels, in the order of the declaration's factors.
    pub levels: Vec<String>,
    /// The session, before a wearer is put into it.
    base: Table,
}

/// A session's text by the name that a declaration gives it.
pub type Texts<'a> = &'a dyn Fn(&str) -> Result<String, LaboratoryError>;

impl Condition {
    /// Every level of each factor with each of the others, the last factor
    /// changing first.
    ///
    /// # Errors
    /// A session is not there, or a field cannot be set.
    pub fn all(d: &Declaration, texts: Texts<'_>) -> Result<Vec<Self>, LaboratoryError> {
        let count: usize = d.factors.iter().map(|factor| factor.levels.len()).product();
        let nth = |index: u64| {
            let levels = crossed(index, d.factors.iter().map(|factor| &*factor.levels));
            let other = levels.iter().find_map(|level| level.session.as_deref());
            let mut base = table(other.unwrap_or(&d.session), texts)?;
            for level in &levels {
                for field in &level.unset {
                    unset(&mut base, field)?;
                }
                for (field, value) in &level.set {
                    set(&mut base, field, value.clone())?;
                }
            }
            let levels = levels.iter().map(|level| level.name.clone()).collect();
            Ok(Self { levels, base })
        };
        (0..count as u64).map(nth).collect()
    }

    /// For people: "pre-wall, 15 °/s".
    #[must_use]
    pub fn name(&self) -> String {
        named(&self.levels)
    }

    /// The session with these fields of a wearer.
    ///
    /// # Errors
    /// A field cannot be set, or no device would arm what comes of it.
    pub fn session(&self, wearer: &[(String, Value)]) -> Result<SessionFile, LaboratoryError> {
        let mut table = self.base.clone();
        for (field, value) in wearer {
            set(&mut table, field, value.clone())?;
        }
        let name = self.name();
        let text = table.to_string();
        SessionFile::parse(&format!("{name}.toml"), &text).map_err(|error| {
            LaboratoryError::Condition {
                condition: name,
                error: Box::new(error),
            }
        })
    }
}

/// A condition's name by its levels.
pub(super) fn named(levels: &[String]) -> String {
    match levels.is_empty() {
        true => "the session".to_owned(),
        false => levels.join(", "),
    }
}

fn table(session: &str, texts: Texts<'_>) -> Result<Table, LaboratoryError> {
    let text = texts(session)?;
    // Whatever is wrong with it is told by those who know sessions.
    SessionFile::parse(session, &text)?;
    text.parse().map_err(|error: toml::de::Error| {
        let (field, reason) = (session.to_owned(), error.message().to_owned());
        LaboratoryError::Field { field, reason }
    })
}

/// The table that holds the last part of `field`, and that part.
fn parent<'t, 'f>(
    root: &'t mut Table,
    field: &'f str,
) -> Result<(&'t mut Table, &'f str), LaboratoryError> {
    let refuse = |reason: String| LaboratoryError::Field {
        field: field.to_owned(),
        reason,
    };
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
                let has_number = |item: &&mut Value| {
                    let number = item.get("number").and_then(Value::as_integer);
                    number.is_some_and(|number| number.to_string() == wanted)
                };
                let item = list.iter_mut().find(has_number);
                let item = item.and_then(Value::as_table_mut);
                item.ok_or_else(|| refuse(format!("no `{part}` has the number {wanted}")))?
            }
            _ => return Err(refuse(format!("`{part}` is no table"))),
        };
    }
    Ok((at, last))
}

fn set(root: &mut Table, field: &str, value: Value) -> Result<(), LaboratoryError> {
    let (table, last) = parent(root, field)?;
    table.insert(last.to_owned(), value);
    Ok(())
}

fn unset(root: &mut Table, field: &str) -> Result<(), LaboratoryError> {
    let (table, last) = parent(root, field)?;
    match table.remove(last) {
        Some(_) => Ok(()),
        None => Err(LaboratoryError::Field {
            field: field.to_owned(),
            reason: "the session does not have it, so it cannot be taken out".to_owned(),
        }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_go_through_tables_and_numbered_lists() {
        let text = "a = 1\n[b]\nc = 2\n[[channel]]\nnumber = 3\nlimit = 4.0\n";
        let mut table: Table = text.parse().unwrap();
        set(&mut table, "b.c", Value::from(5)).unwrap();
        set(&mut table, "channel.3.limit", Value::from(6.5)).unwrap();
        unset(&mut table, "a").unwrap();
        assert_eq!(table["b"]["c"].as_integer(), Some(5));
        assert_eq!(table["channel"][0]["limit"].as_float(), Some(6.5));
        assert!(!table.contains_key("a"));
        for field in ["x.y", "channel.4.limit", "b.c.d"] {
            let refused = set(&mut table, field, Value::from(0)).unwrap_err();
            assert!(refused.to_string().starts_with("E602"), "{refused}");
        }
        assert!(unset(&mut table, "a").is_err());
    }
}
