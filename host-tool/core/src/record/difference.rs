//! Compares two runs row by row, to check that one repeats the other.

use super::{Run, Sample, Trial, table};
use std::fmt;

/// First place at which two runs differ.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Difference {
    /// Name of the trial; `None` for a file that belongs to no trial.
    pub trial: Option<String>,
    /// Name of the file that differs.
    pub file: &'static str,
    /// Number of the line that differs, from 1; 0 if the difference has no line.
    pub line: usize,
}

impl fmt::Display for Difference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { trial, file, line } = self;
        f.write_str(file)?;
        if let Some(trial) = trial {
            write!(f, " of {trial}")?;
        }
        match line {
            0 => Ok(()),
            _ => write!(f, ", line {line}"),
        }
    }
}

/// Compares the rows of the run `again` with those of `record`, and returns the first difference.
/// If `record` was cut short, its unfinished trials are compared as far as their rows go, whether
/// only the last trial is unfinished or several that ran in parallel. The data that a session
/// records at its end are not compared in this case.
#[must_use]
pub fn compare_rows(record: &Run, again: &Run) -> Option<Difference> {
    let is_cut = record.ending.is_incomplete();
    for (position, trial) in record.trials.iter().enumerate() {
        let difference = |file, line| {
            let trial = Some(trial.name.clone());
            Some(Difference { trial, file, line })
        };
        let Some(other) = again.trials.get(position) else {
            return difference("trial.json", 0);
        };
        let is_last = position + 1 == record.trials.len();
        let (rows, others) = (trial.samples.len() + 1, other.samples.len() + 1);
        let is_whole = rows == others && trial.events == other.events;
        let is_cut = is_cut && (is_last || !is_whole);
        // Rows after the request to stop do not belong to the session.
        let kept = if is_cut {
            lines_before_cut(trial)
        } else {
            rows.max(others)
        };
        let (mut rows, mut others) = (lines(trial), lines(other));
        if let Some(line) = (0..kept).find(|_| rows.next() != others.next()) {
            return difference("samples.csv", line + 1);
        }
        let (keys, repeated) = (&trial.markers, &other.markers);
        let repeated = match is_cut {
            true => &repeated[..repeated.len().min(keys.len())],
            false => repeated,
        };
        if keys != repeated {
            return difference("markers.csv", 0);
        }
        if is_cut {
            continue;
        }
        let edges = (0..trial.edges.len().max(other.edges.len()))
            .find(|&line| trial.edges.get(line) != other.edges.get(line));
        if let Some(line) = edges {
            return difference("edges.csv", line + 2);
        }
        let end_data = |trial: &Trial| {
            let identity = trial.identity.clone();
            (identity, trial.counters.clone(), trial.events.clone())
        };
        if end_data(trial) != end_data(other) {
            return difference("trial.json", 0);
        }
    }
    None
}

/// Returns the lines of `samples.csv` one at a time, so that the text of a long file is never in
/// memory as a whole.
fn lines(trial: &Trial) -> impl Iterator<Item = Vec<u8>> {
    let mut header = Vec::new();
    table::push_sample_header(&mut header, &trial.channels);
    let row = |sample: &Sample| {
        let mut row = Vec::new();
        table::push_sample(&mut row, sample, &trial.channels);
        row
    };
    std::iter::once(header).chain(trial.samples.map_each(row))
}

/// Returns the number of lines of `samples.csv`, header included, before the earliest event of a
/// trial that was cut short. Without any event, returns the number of all its lines.
fn lines_before_cut(trial: &Trial) -> usize {
    let times = trial.events.iter().map(|(t_s, _)| *t_s);
    let cut = times.fold(f64::NAN, f64::min);
    let times = trial.samples.map_each(|sample| sample.t_s);
    let before = times.take_while(|t_s| cut.is_nan() || *t_s < cut);
    before.count() + 1
}
