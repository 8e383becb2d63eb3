//! Crosses the levels of all factors to conditions, and builds their sessions.

use super::declaration::{Declaration, Level};
use super::draw::crossed;
use super::error::{LaboratoryError, describe_mistakes};
use host_core::run::SessionFile;
use host_core::session::{set_field, unreadable_wearer, unset_field};
use host_core::wearer::Wearer;
use std::collections::BTreeMap;
use std::path::{Component, Path, PathBuf};
use toml::{Table, Value};

/// A condition of an experiment: one level of each factor, with the session that results.
#[derive(Clone, Debug)]
pub struct Condition {
    /// Names of the levels, in the order of the declaration's factors.
    pub levels: Vec<String>,
    /// Session file after the changes of all levels, before the values of a wearer are set.
    base: Table,
    /// Path of the session that the levels changed, as the declaration writes it.
    session: String,
    /// Name and text of the wearer file that the session uses, if it uses one.
    worn: Option<(String, String)>,
}

/// Function that returns the text of a session or wearer file, given its path as the declaration
/// writes it.
pub type Texts<'a> = &'a dyn Fn(&str) -> Result<String, LaboratoryError>;

/// Indices of a factor and of its level, and a message about a change that this level cannot make.
pub(super) type IneffectiveLevel = ((usize, usize), String);

impl Condition {
    /// Returns all conditions: every combination of the factors' levels, the last factor changing
    /// fastest. `sessions` contains every session that the declaration names.
    ///
    /// # Errors
    /// Returns every field that a level cannot change.
    pub(super) fn all(
        d: &Declaration,
        sessions: &BTreeMap<&str, Table>,
    ) -> Result<Vec<Self>, Vec<IneffectiveLevel>> {
        let count: usize = d.factors.iter().map(|factor| factor.levels.len()).product();
        let places = d.factors.iter().enumerate().map(|(f, factor)| {
            let levels = factor.levels.iter().enumerate();
            levels.map(|(l, level)| ((f, l), level)).collect()
        });
        let places: Vec<Vec<((usize, usize), &Level)>> = places.collect();
        let mut refused = Vec::new();
        let mut conditions = Vec::new();
        for index in 0..count as u64 {
            let levels = crossed(index, places.iter().map(|levels| &**levels));
            let other = levels
                .iter()
                .find_map(|(_, level)| level.session.as_deref());
            let session = other.unwrap_or(&d.session).to_owned();
            let mut base = sessions.get(&*session).cloned().unwrap_or_default();
            for (place, level) in &levels {
                let reasons = level.change(&mut base).into_iter();
                refused.extend(reasons.map(|reason| (*place, reason)));
            }
            let levels = levels.iter().map(|(_, level)| level.name.clone()).collect();
            conditions.push(Self {
                levels,
                base,
                session,
                worn: None,
            });
        }
        refused.sort();
        refused.dedup();
        match refused.is_empty() {
            true => Ok(conditions),
            false => Err(refused),
        }
    }

    /// Returns the names of the condition's levels, for example "pre-wall, 15 °/s".
    #[must_use]
    pub fn name(&self) -> String {
        condition_name(&self.levels)
    }

    /// Returns the session with these fields set to the values of a wearer, or the reason why the
    /// session is then invalid.
    pub(super) fn session_with(&self, fields: &[(String, Value)]) -> Result<SessionFile, String> {
        let mut table = self.base.clone();
        for (field, value) in fields {
            set_field(&mut table, field, value.clone())?;
        }
        let file = format!("{}.toml", self.name());
        let texts = |asked: &str| match &self.worn {
            Some((file, text)) if file == asked => Ok(text.clone()),
            _ => Err(unreadable_wearer(
                asked,
                "no session of the declaration names this file",
            )),
        };
        let read = SessionFile::parse_with_wearers(&file, &table.to_string(), &texts);
        read.map_err(|error| describe_mistakes(&error))
    }

    /// Replaces the wearer file of the session. Returns the fields of a simulated elbow that the
    /// new file determines, which therefore are no longer random.
    ///
    /// # Errors
    /// Fails if the session names no wearer file, or has an elbow that the file does not describe.
    pub(super) fn change_wearer(
        &mut self,
        (file, text): (&str, &str),
        wearer: &Wearer,
    ) -> Result<Vec<&'static str>, String> {
        let own = self.base.get_mut("wearer").and_then(Value::as_table_mut);
        let Some(own) = own.filter(|own| own.contains_key("file")) else {
            let name = self.name();
            return Err(format!("the session of `{name}` names no wearer file"));
        };
        own.insert("file".to_owned(), file.into());
        own.remove("name");
        self.worn = Some((file.to_owned(), text.to_owned()));
        let body = self.base.get_mut("body").and_then(Value::as_table_mut);
        let elbow = |body: &&mut Table| body.get("kind").and_then(Value::as_str) == Some("elbow");
        match body.filter(elbow) {
            Some(body) => known_elbow(wearer, body),
            None => Ok(Vec::new()),
        }
    }

    /// Loads the wearer file that the session names, and returns its path as the declaration would
    /// write it, with its text. Returns `None` if the session names none or the file cannot be
    /// read; parsing the session reports that error later.
    pub(super) fn load_wearer(&mut self, texts: Texts<'_>) -> Option<(String, String)> {
        let wearer = self.base.get("wearer")?;
        let file = wearer.get("file").and_then(Value::as_str)?.to_owned();
        let name = relative_to_session(&self.session, &file);
        let text = texts(&name).ok()?;
        self.worn = Some((file, text.clone()));
        Some((name, text))
    }
}

/// Sets the fields of a simulated elbow that the wearer file determines, and returns their names:
/// the threshold of each muscle at its electrode's pulse width, and its torque if the file states
/// it. The saturation current stays unchanged, because it lies above the wearer's limit and the
/// file does not contain it.
fn known_elbow(wearer: &Wearer, body: &mut Table) -> Result<Vec<&'static str>, String> {
    let elbow = wearer.elbow.ok_or("the wearer file has no `[elbow]`")?;
    let muscles = [
        (
            (elbow.triceps, elbow.triceps_nm),
            ["triceps", "triceps_threshold_ma", "triceps_nm"],
            ["body.triceps_threshold_ma", "body.triceps_nm"],
        ),
        (
            (elbow.biceps, elbow.biceps_nm),
            ["biceps", "biceps_threshold_ma", "biceps_nm"],
            ["body.biceps_threshold_ma", "body.biceps_nm"],
        ),
    ];
    let mut known = Vec::new();
    for ((channel, torque_nm), [site, threshold, nm], [at_threshold, at_nm]) in muscles {
        let electrode = wearer.electrode(channel);
        let electrode =
            electrode.ok_or("the wearer file lacks an electrode that `[elbow]` names")?;
        if body.get(site).and_then(Value::as_integer) != Some(channel.into()) {
            return Err(format!(
                "the wearer file has the {site} on channel {channel}, the session on another"
            ));
        }
        let threshold_ma = f64::from(electrode.motor_threshold.get()) / 1e3;
        body.insert(threshold.to_owned(), threshold_ma.into());
        known.push(at_threshold);
        if let Some(torque_nm) = torque_nm {
            body.insert(nm.to_owned(), torque_nm.into());
            known.push(at_nm);
        }
    }
    Ok(known)
}

/// Returns the path of `file`, which `session` states relative to itself, relative to the
/// declaration.
pub(super) fn relative_to_session(session: &str, file: &str) -> String {
    let folder = Path::new(session).parent().unwrap_or(Path::new(""));
    let mut path = PathBuf::new();
    for part in folder.join(file).components() {
        let last = path.components().next_back();
        match (part, last) {
            (Component::ParentDir, Some(Component::Normal(_))) => {
                path.pop();
            }
            (Component::CurDir, _) => {}
            (part, _) => path.push(part),
        }
    }
    path.display().to_string()
}

/// Returns the readable name of a condition: the names of its levels, separated by commas.
pub(super) fn condition_name(levels: &[String]) -> String {
    match levels.is_empty() {
        true => "the session".to_owned(),
        false => levels.join(", "),
    }
}

impl Level {
    /// Makes the changes of this level in a session. Returns a message for every field that cannot
    /// be changed.
    fn change(&self, session: &mut Table) -> Vec<String> {
        let unset = self.unset.iter().map(|field| unset_field(session, field));
        let mut reasons: Vec<String> = unset.filter_map(Result::err).collect();
        let set = self
            .set
            .iter()
            .map(|pair| set_field(session, pair.0, pair.1.clone()));
        reasons.extend(set.filter_map(Result::err));
        reasons
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_wearer_lies_where_its_session_says() {
        let wall = "../sessions/harris_wall/1.toml";
        let cases = [
            (wall, "../../wearers/P.toml", "../wearers/P.toml"),
            ("it.toml", "P.toml", "P.toml"),
            ("it.toml", "./../w/P.toml", "../w/P.toml"),
            ("a/it.toml", "/w/P.toml", "/w/P.toml"),
        ];
        for (session, file, name) in cases {
            assert_eq!(relative_to_session(session, file), name);
        }
    }
}
