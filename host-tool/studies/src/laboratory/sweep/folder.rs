//! Stores a sweep on disk: `sweep.json`, `declaration.toml` and the file of a [`Drawing`], to which
//! complete units are appended in order.

use super::Sweep;
use super::drawing::Drawing;
use crate::laboratory::error::LaboratoryError;
use hal_sim::input;
use std::collections::BTreeMap;
use std::fs::{self, File, OpenOptions};
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};

/// The folder of a sweep, whose file of units is open for appending.
pub(super) struct Folder {
    name: String,
    rows: File,
}

/// Results of units, by index of the unit.
type Units<D> = BTreeMap<u64, <D as Drawing>::Unit>;

impl Folder {
    /// Starts `sweep` in `dir`, or continues it, and returns the units that exist. A unit that was
    /// written only in part is removed.
    ///
    /// # Errors
    /// Fails if the folder contains anything but an earlier part of this sweep, or if a file cannot
    /// be read or written.
    pub(super) fn open<D: Drawing>(
        dir: &Path,
        sweep: &Sweep,
        drawing: &D,
    ) -> Result<(Self, Units<D>), LaboratoryError> {
        fs::create_dir_all(dir).map_err(failed(dir))?;
        refuse_other(dir, sweep, drawing.is_extensible())?;
        let rows = dir.join(drawing.file());
        let (known, text) = match sweep_file(dir).exists() && rows.exists() {
            true => whole_rows(&rows, sweep, drawing)?,
            false => (BTreeMap::new(), header(drawing)),
        };
        // Written first, so that the folder describes itself even if the program ends now.
        write_sweep(dir, sweep)?;
        write(&dir.join("declaration.toml"), drawing.declaration())?;
        write(&rows, &text)?;
        let append = OpenOptions::new().append(true).open(&rows);
        let folder = Self {
            name: rows.display().to_string(),
            rows: append.map_err(failed(&rows))?,
        };
        Ok((folder, known))
    }

    /// Appends a unit in a single write, so that a program that is killed leaves at most this unit
    /// incomplete.
    pub(super) fn append<D: Drawing>(
        &mut self,
        drawing: &D,
        sweep: &Sweep,
        (index, unit): (u64, &D::Unit),
    ) -> Result<(), LaboratoryError> {
        let begins = drawing.row_prefixes(sweep, index).into_iter();
        let rows = begins.zip(drawing.row_suffixes(unit));
        let text: String = rows
            .map(|(begin, rest)| format!("{begin},{rest}\n"))
            .collect();
        let written = self.rows.write_all(text.as_bytes());
        written.map_err(|error| LaboratoryError::File(self.name.clone(), error))
    }
}

/// Fails if the folder contains anything but this sweep. With `grows`, the same sweep with fewer
/// draws is accepted, too.
pub(super) fn refuse_other(dir: &Path, sweep: &Sweep, grows: bool) -> Result<(), LaboratoryError> {
    let other = |found: String, wanted: String| {
        let folder = dir.display().to_string();
        Err(LaboratoryError::Other {
            folder,
            found,
            wanted,
        })
    };
    if sweep_file(dir).exists() {
        let found = read_sweep(dir)?;
        let (there, here) = (found.in_words(), sweep.in_words());
        let draws = match grows {
            true => sweep.draws.max(found.draws),
            false => found.draws,
        };
        let is_begun = *sweep
            == Sweep {
                draws,
                ..found.clone()
            };
        return match is_begun {
            true => Ok(()),
            false if there == here => {
                other(there, format!("the same with {}", sweep.difference(&found)))
            }
            false => other(there, here),
        };
    }
    // Files of the process that writes here, or of one that ended before it wrote a sweep.
    let passes = [".lock", "sweep.json.partial"];
    let entries = fs::read_dir(dir).map_err(failed(dir))?;
    let mut entries = entries
        .flatten()
        .filter(|entry| passes.iter().all(|pass| entry.file_name() != *pass));
    match entries.next() {
        None => Ok(()),
        Some(_) => other("files that are not a sweep".to_owned(), sweep.in_words()),
    }
}

/// Returns the complete units in the folder of a sweep, whether the sweep has finished or not;
/// empty for a new sweep.
///
/// # Errors
/// Fails if the folder contains no valid sweep.
pub(super) fn units<D: Drawing>(
    dir: &Path,
    sweep: &Sweep,
    drawing: &D,
) -> Result<Units<D>, LaboratoryError> {
    let rows = dir.join(drawing.file());
    if !rows.exists() {
        return Ok(BTreeMap::new());
    }
    let (units, _) = whole_rows(&rows, sweep, drawing)?;
    Ok(units)
}

/// Returns the path of `sweep.json` in `dir`, which describes the sweep.
pub(super) fn sweep_file(dir: &Path) -> PathBuf {
    dir.join("sweep.json")
}

/// Reads `sweep.json` in `dir`.
pub(super) fn read_sweep(dir: &Path) -> Result<Sweep, LaboratoryError> {
    let path = sweep_file(dir);
    let text = input::read_text(&path, input::LONGEST_DOCUMENT).map_err(failed(&path))?;
    serde_json::from_str(&text).map_err(|error| LaboratoryError::Damaged {
        file: path.display().to_string(),
        reason: format!("{error}; start the sweep again in another folder"),
    })
}

/// Writes `sweep.json` in `dir`.
pub(super) fn write_sweep(dir: &Path, sweep: &Sweep) -> Result<(), LaboratoryError> {
    write(&sweep_file(dir), &json(sweep))
}

fn json(sweep: &Sweep) -> String {
    // Cannot fail: the sweep has only strings and numbers.
    serde_json::to_string_pretty(sweep).unwrap_or_default() + "\n"
}

/// Replaces the content of a file atomically: after a crash the file has the old or the new
/// content.
pub(super) fn write(path: &Path, text: &str) -> Result<(), LaboratoryError> {
    let written = host_core::record::replace_file(path, text.as_bytes());
    written.map_err(LaboratoryError::from)
}

fn failed(path: &Path) -> impl FnOnce(std::io::Error) -> LaboratoryError {
    let name = path.display().to_string();
    |error| LaboratoryError::File(name, error)
}

fn header(drawing: &impl Drawing) -> String {
    match &drawing.columns()[..] {
        [] => String::new(),
        columns => columns.join(",") + "\n",
    }
}

/// Advice in the error about a file with rows that no sweep wrote.
const CUT: &str = "delete this line and all lines after it; the same command then continues there";

/// Returns the complete units in a file, and the text of the file up to the end of the last one.
fn whole_rows<D: Drawing>(
    path: &Path,
    sweep: &Sweep,
    drawing: &D,
) -> Result<(Units<D>, String), LaboratoryError> {
    let damaged = |reason: String| LaboratoryError::Damaged {
        file: path.display().to_string(),
        reason,
    };
    let text =
        input::read_text(path, input::LONGEST_TABLE).map_err(|error| match error.kind() {
            ErrorKind::InvalidData => damaged("it is not text".to_owned()),
            _ => failed(path)(error),
        })?;
    let head = header(drawing);
    let Some(body) = text.strip_prefix(&head) else {
        return Err(damaged(
            "its columns are not the declaration's; remove the folder, and the command starts again"
                .to_owned(),
        ));
    };
    let mut units = BTreeMap::new();
    let mut kept_text = head;
    let lines: Vec<&str> = body.split_inclusive('\n').collect();
    let of_unit = drawing.rows_per_unit().max(1);
    let first = 1 + usize::from(!kept_text.is_empty()); // the header is line 1
    for (lines, first) in lines.chunks(of_unit).zip((first..).step_by(of_unit)) {
        let is_whole = lines.len() == drawing.rows_per_unit();
        if !is_whole || lines.last().is_some_and(|line| !line.ends_with('\n')) {
            break; // the program was killed while it wrote this unit
        }
        let at = |(row, problem): (usize, String)| {
            damaged(format!("line {}: {problem}; {CUT}", first + row))
        };
        let (index, unit) = unit_of(lines, (sweep, drawing)).map_err(at)?;
        if units.insert(index, unit).is_some() {
            return Err(at((0, format!("unit {index} appears twice"))));
        }
        kept_text.extend(lines.iter().copied());
    }
    Ok((units, kept_text))
}

/// Parses the unit in these lines. Every line must begin as [`Drawing::row_prefixes`] says. On
/// failure, returns the index of the wrong line, from 0, and the reason.
fn unit_of<D: Drawing>(
    lines: &[&str],
    (sweep, drawing): (&Sweep, &D),
) -> Result<(u64, D::Unit), (usize, String)> {
    let index = lines.first().and_then(|line| drawing.index_of(line));
    let index: u64 = index.ok_or_else(|| (0, "the row has no unit number".to_owned()))?;
    if index >= drawing.units(sweep.draws) || !sweep.shard.has(index) {
        return Err((0, format!("unit {index} is not in this sweep")));
    }
    let begins = drawing.row_prefixes(sweep, index);
    let rest = |(row, (line, wanted)): (usize, (&&'_ str, &String))| {
        let rest = line.strip_prefix(wanted.as_str());
        let rest = rest.and_then(|rest| rest.strip_prefix(','));
        rest.map(|rest| rest.trim_end().to_owned()).ok_or_else(|| {
            let message = format!(
                "the row of unit {index} does not begin as seed {} gives it, `{wanted},…`",
                sweep.seed
            );
            (row, message)
        })
    };
    let rests = lines.iter().zip(&begins).enumerate().map(rest);
    let rests: Vec<String> = rests.collect::<Result<_, _>>()?;
    let borrowed: Vec<&str> = rests.iter().map(String::as_str).collect();
    let unit = drawing.parse_unit(&borrowed)?;
    let written = drawing.row_suffixes(&unit);
    let differs = rests.iter().zip(&written).position(|(is, own)| is != own);
    match differs.and_then(|row| Some((row, written.get(row)?))) {
        None => Ok((index, unit)),
        Some((row, own)) => Err((row, format!("its numbers should be written as `…,{own}`"))),
    }
}
