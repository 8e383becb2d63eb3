//! A sweep on disk: `sweep.json`, `declaration.toml` and `draws.csv`, to which whole
//! units are appended in order.

use super::Sweep;
use crate::laboratory::draw::Unit;
use crate::laboratory::error::LaboratoryError;
use crate::laboratory::experiment::{Experiment, Measured};
use std::collections::BTreeMap;
use std::fs::{self, File, OpenOptions};
use std::io::Write;
use std::path::Path;

/// The open `draws.csv`.
pub(super) struct Folder {
    name: String,
    rows: File,
}

/// What each unit did, by its index.
type Units = BTreeMap<u64, Vec<Measured>>;

impl Folder {
    /// Begins `sweep` in `dir`, or goes on: what was written only in part is cut off.
    ///
    /// # Errors
    /// It holds something else, or the file system.
    pub(super) fn open(
        dir: &Path,
        sweep: &Sweep,
        experiment: &Experiment,
    ) -> Result<(Self, Units), LaboratoryError> {
        fs::create_dir_all(dir).map_err(failed(dir))?;
        let (about, rows) = (dir.join("sweep.json"), dir.join("draws.csv"));
        let mut known = Units::new();
        let mut text = header(experiment);
        if about.is_file() {
            let found = about_of(&about)?;
            if found != *sweep {
                return Err(LaboratoryError::Other {
                    folder: dir.display().to_string(),
                    found: found.in_words(),
                    wanted: sweep.in_words(),
                });
            }
            if rows.is_file() {
                (known, text) = whole_rows(&rows, sweep, experiment)?;
            }
        } else {
            refuse_foreign(dir, sweep)?;
        }
        write(&dir.join("declaration.toml"), &experiment.text)?;
        write(&rows, &text)?;
        begin(dir, sweep)?;
        let append = OpenOptions::new().append(true).open(&rows);
        let folder = Self {
            name: rows.display().to_string(),
            rows: append.map_err(failed(&rows))?,
        };
        Ok((folder, known))
    }

    /// Appends a unit in one write, so that a program killed at any moment leaves
    /// whole units but for the last.
    pub(super) fn append(
        &mut self,
        experiment: &Experiment,
        unit: &Unit,
        measured: &[Measured],
    ) -> Result<(), LaboratoryError> {
        let mut text = String::new();
        for (condition, measured) in experiment.conditions.iter().zip(measured) {
            let numbers = measured.iter();
            let numbers = numbers.map(|it| it.map_or(String::new(), |it| it.to_string()));
            let numbers: String = numbers.map(|number| format!(",{number}")).collect();
            text += &format!("{}{numbers}\n", begins(unit, &condition.name()));
        }
        let written = self.rows.write_all(text.as_bytes());
        written.map_err(|error| LaboratoryError::File(self.name.clone(), error))
    }
}

/// A folder that holds something that is no sweep is left alone.
fn refuse_foreign(dir: &Path, sweep: &Sweep) -> Result<(), LaboratoryError> {
    let entries = fs::read_dir(dir).map_err(failed(dir))?;
    // The lock of whoever writes here.
    let mut entries = entries
        .flatten()
        .filter(|entry| entry.file_name() != ".lock");
    match entries.next() {
        None => Ok(()),
        Some(_) => Err(LaboratoryError::Other {
            folder: dir.display().to_string(),
            found: "something that is no sweep".to_owned(),
            wanted: sweep.in_words(),
        }),
    }
}

/// The whole units of a sweep's folder, finished or not.
///
/// # Errors
/// It is none.
pub(super) fn units(
    dir: &Path,
    sweep: &Sweep,
    experiment: &Experiment,
) -> Result<Units, LaboratoryError> {
    let (units, _) = whole_rows(&dir.join("draws.csv"), sweep, experiment)?;
    Ok(units)
}

/// What a folder's `sweep.json` says.
pub(super) fn about_of(path: &Path) -> Result<Sweep, LaboratoryError> {
    let text = fs::read_to_string(path).map_err(failed(path))?;
    serde_json::from_str(&text).map_err(|error| LaboratoryError::Damaged {
        file: path.display().to_string(),
        reason: error.to_string(),
    })
}

/// Writes what the sweep in `dir` is.
pub(super) fn begin(dir: &Path, sweep: &Sweep) -> Result<(), LaboratoryError> {
    write(&dir.join("sweep.json"), &json(sweep))
}

fn json(sweep: &Sweep) -> String {
    // Strings and numbers only.
    serde_json::to_string_pretty(sweep).unwrap_or_default() + "\n"
}

/// Replaces a file as a whole.
fn write(path: &Path, text: &str) -> Result<(), LaboratoryError> {
    let written = host_core::record::replace_file(path, text.as_bytes());
    written.map_err(LaboratoryError::from)
}

fn failed(path: &Path) -> impl FnOnce(std::io::Error) -> LaboratoryError {
    let name = path.display().to_string();
    |error| LaboratoryError::File(name, error)
}

fn header(experiment: &Experiment) -> String {
    let unit = experiment.unit(0, 1, 0);
    let fields = unit.fields.iter().map(|(field, _)| field.clone());
    let measures = experiment.measures().map(|measure| measure.id.to_owned());
    let mut names = vec!["unit".to_owned(), "wearer".to_owned()];
    names.extend(fields);
    names.push("condition".to_owned());
    names.extend(measures);
    names.join(",") + "\n"
}

/// A name as a CSV field.
fn quoted(name: &str) -> String {
    format!("\"{}\"", name.replace('"', "\"\""))
}

/// A row up to its measures: the unit and what was drawn for it, and the condition.
fn begins(unit: &Unit, condition: &str) -> String {
    let fields = unit.fields.iter().map(|(_, value)| format!(",{value}"));
    let fields: String = fields.collect();
    let condition = quoted(condition);
    format!("{},{}{fields},{condition}", unit.index, unit.wearer)
}

/// The whole units of `draws.csv`, and the text of those alone.
fn whole_rows(
    path: &Path,
    sweep: &Sweep,
    experiment: &Experiment,
) -> Result<(Units, String), LaboratoryError> {
    let text = fs::read_to_string(path).map_err(failed(path))?;
    let damaged = |reason: String| LaboratoryError::Damaged {
        file: path.display().to_string(),
        reason,
    };
    let head = header(experiment);
    let Some(body) = text.strip_prefix(&head) else {
        return Err(damaged(
            "other columns than the declaration's: take the folder away, the command begins it anew"
                .to_owned(),
        ));
    };
    let mut units = Units::new();
    let mut whole = head;
    let lines: Vec<&str> = body.split_inclusive('\n').collect();
    let of_unit = experiment.conditions.len().max(1);
    // The header is line 1.
    for (lines, first) in lines.chunks(of_unit).zip((2..).step_by(of_unit)) {
        let is_whole = lines.len() == experiment.conditions.len();
        if !is_whole || lines.last().is_some_and(|line| !line.ends_with('\n')) {
            break; // the program was killed here
        }
        let (index, measured) = unit_of(lines, first, (sweep, experiment)).map_err(damaged)?;
        if units.insert(index, measured).is_some() {
            return Err(damaged(format!(
                "line {first}: unit {index} stands there twice"
            )));
        }
        whole.extend(lines.iter().copied());
    }
    Ok((units, whole))
}

/// The unit that these lines are of, one for each condition; `first` is the number of
/// the first. Of every line but its measures is known what it must say.
fn unit_of(
    lines: &[&str],
    first: usize,
    (sweep, experiment): (&Sweep, &Experiment),
) -> Result<(u64, Vec<Measured>), String> {
    let index = lines.first().and_then(|line| line.split(',').next());
    let index = index.and_then(|field| field.parse().ok());
    let index: u64 = index.ok_or_else(|| format!("line {first}: a row without its unit"))?;
    if index >= experiment.units(sweep.draws) || !sweep.shard.has(index) {
        return Err(format!("line {first}: unit {index} is none of this sweep"));
    }
    let unit = experiment.unit(sweep.seed, sweep.draws, index);
    let measures = experiment.measures().count();
    let rows = lines.iter().zip(&experiment.conditions).zip(first..);
    let rows = rows.map(|((line, condition), number)| {
        let wanted = begins(&unit, &condition.name());
        let rest = line.strip_prefix(&wanted).ok_or_else(|| {
            format!(
                "line {number}: it is not unit {index} in its turn, as seed {} draws it; wanted \
                 is `{wanted},…`",
                sweep.seed
            )
        })?;
        let fields: Vec<&str> = rest.trim_end().split(',').collect();
        match fields.split_first() {
            Some((&"", fields)) if fields.len() == measures => {
                let numbers = fields.iter().map(|field| number_of(field));
                let numbers: Result<_, String> = numbers.collect();
                numbers.map_err(|what| format!("line {number}: {what}"))
            }
            _ => Err(format!("line {number}: not a number for each measure")),
        }
    });
    Ok((index, rows.collect::<Result<_, _>>()?))
}

/// A measure; none where the trial had none.
fn number_of(field: &str) -> Result<Option<f64>, String> {
    match (field, field.parse::<f64>()) {
        ("", _) => Ok(None),
        (_, Ok(number)) if number.is_finite() => Ok(Some(number)),
        _ => Err(format!("`{field}` is no finite number")),
    }
}
