//! CSV of samples and edges. Numbers are written so that they read back exactly.

use super::{ChannelInfo, Edge, RecordError, Sample, State, columns};
use std::io::{self, Write};
use std::path::Path;
use std::str::FromStr;

/// Columns every sample has, units in their names.
const FIXED: [&str; 6] = [
    "t_s",
    "target_deg",
    "measured_deg",
    "true_deg",
    "effort",
    "limiting",
];
const AMPLITUDE: &str = "amplitude_";
const FORCE: &str = "force_";
const WANTED: &str = "wanted_";
const RATE: &str = "rate_";

/// Writes the header of `samples.csv`.
pub(super) fn write_sample_header(
    out: &mut impl Write,
    channels: &[ChannelInfo],
) -> io::Result<()> {
    writeln!(out, "{}", columns::header(&columns::SAMPLES, channels))
}

/// Writes one row. Missing amplitudes or forces become empty fields, surplus
/// ones have no column and are left out.
pub(super) fn write_sample(
    out: &mut impl Write,
    sample: &Sample,
    channels: &[ChannelInfo],
) -> io::Result<()> {
    let predicted = channels.iter().filter(|c| c.muscle).count();
    let controlled = channels.iter().filter(|c| c.force).count();
    write!(
        out,
        "{},{},{},",
        sample.t_s, sample.target_deg, sample.measured_deg
    )?;
    if let Some(angle) = sample.true_deg {
        write!(out, "{angle}")?;
    }
    write!(out, ",{},{}", sample.effort, u8::from(sample.limiting))?;
    for (values, columns) in [
        (&sample.amplitudes, channels.len()),
        (&sample.forces_n, predicted),
        (&sample.wanted_n, controlled),
        (&sample.rates_hz, controlled),
    ] {
        for column in 0..columns {
            match values.get(column) {
                Some(value) => write!(out, ",{value}")?,
                None => write!(out, ",")?,
            }
        }
    }
    writeln!(out)
}

/// Writes samples with their header.
pub fn write_samples(
    out: &mut impl Write,
    channels: &[ChannelInfo],
    samples: &[Sample],
) -> io::Result<()> {
    write_sample_header(out, channels)?;
    for sample in samples {
        write_sample(out, sample, channels)?;
    }
    Ok(())
}

/// Writes edges as `t_us,channel,state,dac_code`, the columns of `flexor edges`.
pub fn write_edges(out: &mut impl Write, edges: &[Edge]) -> io::Result<()> {
    writeln!(out, "{}", columns::header(&columns::EDGES, &[]))?;
    for edge in edges {
        let state = state_name(edge.state);
        writeln!(
            out,
            "{},{},{state},{}",
            edge.t_us, edge.channel, edge.dac_code
        )?;
    }
    Ok(())
}

/// Reads `samples.csv`. A last line without its end was cut by a crash and is
/// dropped; anything else that does not fit is an error with its line.
pub fn read_samples(path: &Path) -> Result<Vec<Sample>, RecordError> {
    let rows = Rows::open(path)?;
    if rows.text.is_empty() {
        return Ok(Vec::new()); // not even its header was whole
    }
    let columns = |prefix: &str| -> Vec<usize> {
        let named = rows.header.iter().enumerate();
        named
            .filter(|(_, name)| name.starts_with(prefix))
            .map(|(column, _)| column)
            .collect()
    };
    let (amplitudes, forces) = (columns(AMPLITUDE), columns(FORCE));
    let (wanted, rates) = (columns(WANTED), columns(RATE));
    let fixed = FIXED.map(|name| rows.column(name));
    let [t, target, measured, truth, effort, limiting] = fixed;
    let (t, target, measured) = (t?, target?, measured?);
    let (truth, effort, limiting) = (truth?, effort?, limiting?);
    rows.map(|row| {
        let list = |columns: &[usize]| -> Result<Vec<f64>, RecordError> {
            let fields = columns.iter().map(|&column| row.optional(column));
            fields.filter_map(Result::transpose).collect()
        };
        Ok(Sample {
            t_s: row.get(t)?,
            target_deg: row.get(target)?,
            measured_deg: row.get(measured)?,
            true_deg: row.optional(truth)?,
            effort: row.get(effort)?,
            limiting: row.get::<u8>(limiting)? != 0,
            amplitudes: list(&amplitudes)?,
            forces_n: list(&forces)?,
            wanted_n: list(&wanted)?,
            rates_hz: list(&rates)?,
        })
    })
}

/// Reads `edges.csv`; errors as [`read_samples`].
pub fn read_edges(path: &Path) -> Result<Vec<Edge>, RecordError> {
    let rows = Rows::open(path)?;
    let (t, channel) = (rows.column("t_us")?, rows.column("channel")?);
    let (state, code) = (rows.column("state")?, rows.column("dac_code")?);
    rows.map(|row| {
        Ok(Edge {
            t_us: row.get(t)?,
            channel: row.get(channel)?,
            state: match row.text(state) {
                "isolated" => State::Isolated,
                "anodic" => State::Anodic,
                "cathodic" => State::Cathodic,
                "grounded" => State::Grounded,
                _ => return Err(row.error(state)),
            },
            dac_code: row.get(code)?,
        })
    })
}

/// The word for a state in `edges.csv`.
fn state_name(state: State) -> &'static str {
    match state {
        State::Isolated => "isolated",
        State::Anodic => "anodic",
        State::Cathodic => "cathodic",
        State::Grounded => "grounded",
    }
}

/// The complete lines of a CSV file.
struct Rows<'a> {
    path: &'a Path,
    header: Vec<String>,
    text: String,
}

impl<'a> Rows<'a> {
    fn open(path: &'a Path) -> Result<Self, RecordError> {
        let mut text = std::fs::read_to_string(path).map_err(RecordError::io(path))?;
        text.truncate(text.rfind('\n').map_or(0, |end| end + 1));
        let header = text.lines().next().unwrap_or_default();
        let header = header.split(',').map(str::to_owned).collect();
        Ok(Rows { path, header, text })
    }

    fn column(&self, name: &str) -> Result<usize, RecordError> {
        let found = self.header.iter().position(|column| column == name);
        found.ok_or_else(|| RecordError::Format {
            path: self.path.to_owned(),
            line: 1,
            what: format!("the column {name} is missing"),
        })
    }

    fn map<T>(
        &self,
        parse: impl Fn(&Row) -> Result<T, RecordError>,
    ) -> Result<Vec<T>, RecordError> {
        let mut reader = csv::Reader::from_reader(self.text.as_bytes());
        let records = reader.records().enumerate();
        let rows = records.map(|(row, record)| {
            let line = row + 2;
            let record = record.map_err(|error| RecordError::Format {
                path: self.path.to_owned(),
                line,
                what: error.to_string(),
            })?;
            parse(&Row {
                rows: self,
                record,
                line,
            })
        });
        rows.collect()
    }
}

struct Row<'a> {
    rows: &'a Rows<'a>,
    record: csv::StringRecord,
    line: usize,
}

impl Row<'_> {
    fn text(&self, column: usize) -> &str {
        self.record.get(column).unwrap_or_default()
    }

    fn get<T: FromStr>(&self, column: usize) -> Result<T, RecordError> {
        self.text(column).parse().map_err(|_| self.error(column))
    }

    fn optional(&self, column: usize) -> Result<Option<f64>, RecordError> {
        match self.text(column) {
            "" => Ok(None),
            _ => self.get(column).map(Some),
        }
    }

    fn error(&self, column: usize) -> RecordError {
        RecordError::Format {
            path: self.rows.path.to_owned(),
            line: self.line,
            what: format!(
                "{}: \"{}\" is not a value of this column",
                self.rows.header[column],
                self.text(column)
            ),
        }
    }
}
