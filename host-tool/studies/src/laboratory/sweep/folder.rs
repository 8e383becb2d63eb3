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
                (known, text) = whole_rows(&rows, experiment)?;
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
        let fields = unit.fields.iter().map(|(_, value)| value.to_string());
        let fields: String = fields.map(|value| format!(",{value}")).collect();
        let mut text = String::new();
        for (condition, measured) in experiment.conditions.iter().zip(measured) {
            let numbers = measured.iter();
            let numbers = numbers.map(|it| it.map_or(String::new(), |it| it.to_string()));
            let numbers: String = numbers.map(|number| format!(",{number}")).collect();
            let name = quoted(&condition.name());
            text += &format!("{},{}{fields},{name}{numbers}\n", unit.index, unit.wearer);
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
pub(super) fn units(dir: &Path, experiment: &Experiment) -> Result<Units, LaboratoryError> {
    let (units, _) = whole_rows(&dir.join("draws.csv"), experiment)?;
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

/// The whole units of `draws.csv`, and the text of those alone.
fn whole_rows(path: &Path, experiment: &Experiment) -> Result<(Units, String), LaboratoryError> {
    let text = fs::read_to_string(path).map_err(failed(path))?;
    let damaged = |reason: String| LaboratoryError::Damaged {
        file: path.display().to_string(),
        reason,
    };
    let head = header(experiment);
    let Some(body) = text.strip_prefix(&head) else {
        return Err(damaged("other columns than the declaration's".to_owned()));
    };
    let mut units = Units::new();
    let mut whole = head;
    let lines: Vec<&str> = body.split_inclusive('\n').collect();
    for lines in lines.chunks(experiment.conditions.len().max(1)) {
        let is_whole = lines.len() == experiment.conditions.len();
        if !is_whole || lines.last().is_some_and(|line| !line.ends_with('\n')) {
            break; // the program was killed here
        }
        let some = lines.concat();
        let (index, measured) = unit_of(&some, experiment).map_err(damaged)?;
        if units.insert(index, measured).is_some() {
            return Err(damaged(format!("unit {index} stands there twice")));
        }
        whole += &some;
    }
    Ok((units, whole))
}

/// The unit that these lines are of, one for each condition.
fn unit_of(lines: &str, experiment: &Experiment) -> Result<(u64, Vec<Measured>), String> {
    let mut reader = csv::ReaderBuilder::new();
    let mut reader = reader.has_headers(false).from_reader(lines.as_bytes());
    let (mut index, mut all) = (None, Vec::new());
    let measures = experiment.measures().count();
    for (row, condition) in reader.records().zip(&experiment.conditions) {
        let row = row.map_err(|error| error.to_string())?;
        let number = row.get(0).and_then(|field| field.parse().ok());
        let number: u64 = number.ok_or("a row without its unit")?;
        let at = row
            .len()
            .checked_sub(measures + 1)
            .ok_or("a row too short")?;
        if row.get(at) != Some(&condition.name()) || *index.get_or_insert(number) != number {
            return Err(format!("unit {number} has not each condition in its turn"));
        }
        let parse = |field: &str| match field {
            "" => Ok(None),
            number => number
                .parse()
                .map(Some)
                .map_err(|_| format!("`{number}` is no number")),
        };
        all.push(
            row.iter()
                .skip(at + 1)
                .map(parse)
                .collect::<Result<_, _>>()?,
        );
    }
    Ok((index.ok_or("no row")?, all))
}
