//! CSV files of samples and edges. Numbers are written so that reading them gives the same values.

use super::{ChannelInfo, DeviceState, Edge, RecordError, Sample, Samples, State, columns};
use crate::number;
use hal_sim::input;
use std::fs::File;
use std::io::{self, BufRead, BufReader, Read, Seek, Write};
use std::path::Path;
use std::str::FromStr;

/// Columns that every `samples.csv` has; the units are parts of their names.
const FIXED: [&str; 7] = [
    "t_s",
    "target_deg",
    "measured_deg",
    "true_deg",
    "effort",
    "limiting",
    "state",
];

/// Columns of the wanted force at the hand: backward, to the right and upward.
const HAND: [&str; 3] = ["hand_x_n", "hand_y_n", "hand_z_n"];
/// Columns of the true force at a simulated wearer's hand, in the same directions.
const HAND_TRUE: [&str; 3] = ["hand_fx_n", "hand_fy_n", "hand_fz_n"];

/// Appends the header of `samples.csv` to `text`.
pub(super) fn push_sample_header(text: &mut Vec<u8>, channels: &[ChannelInfo]) {
    text.extend_from_slice(columns::header(&columns::SAMPLES, channels).as_bytes());
    text.push(b'\n');
}

/// Value of one field of a row of `samples.csv`.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Field {
    /// Time in s, written with six decimals.
    Time(f64),
    /// Number; `None` for a missing or unknown value, whose field is empty.
    Number(Option<f64>),
    /// Word from a fixed list.
    Word(&'static str),
}

/// Returns the names of the columns of `samples.csv` in a trial with these channels, from left to
/// right.
#[must_use]
pub fn sample_columns(channels: &[ChannelInfo]) -> Vec<String> {
    let header = columns::header(&columns::SAMPLES, channels);
    header.split(',').map(str::to_owned).collect()
}

/// Hands the fields of a row to `receive`, in the order of [`sample_columns`]. Amplitudes or forces
/// for which `channels` has no column are left out.
pub fn visit_sample(sample: &Sample, channels: &[ChannelInfo], mut receive: impl FnMut(Field)) {
    let predicted = channels.iter().filter(|c| c.muscle).count();
    let live = channels.iter().filter(|c| c.live_width).count();
    let controlled = channels.iter().filter(|c| c.force).count();
    receive(Field::Time(sample.t_s));
    let mut number = |value| receive(Field::Number(value));
    for value in [sample.target_deg, sample.measured_deg, sample.true_deg] {
        number(value);
    }
    number(sample.effort);
    number(Some(f64::from(u8::from(sample.limiting))));
    receive(Field::Word(state_word(&DEVICE_STATES, sample.state)));
    let mut list = |values: &[Option<f64>], count| {
        for column in 0..count {
            receive(Field::Number(values.get(column).copied().flatten()));
        }
    };
    list(&sample.amplitudes, channels.len());
    list(&sample.widths_us, live);
    list(&sample.forces_n, predicted);
    for values in [
        &sample.wanted_n,
        &sample.rates_hz,
        &sample.below_n,
        &sample.above_n,
    ] {
        list(values, controlled);
    }
    if channels.iter().any(|channel| channel.line) {
        list(&sample.hand_n, 3);
        list(&[sample.hand_made], 1);
        list(&sample.hand_true_n, 3);
    }
    let joints = columns::joints(channels).count();
    if joints > 0 {
        list(&[sample.held], 1);
        for values in [&sample.joint_deg, &sample.phase] {
            list(values, joints);
        }
    }
}

/// Appends a row to `text`. A missing or unknown value becomes an empty field, never a zero.
pub(super) fn push_sample(text: &mut Vec<u8>, sample: &Sample, channels: &[ChannelInfo]) {
    let begin = text.len();
    visit_sample(sample, channels, |field| {
        if text.len() > begin {
            text.push(b',');
        }
        match field {
            Field::Time(seconds) => number::push_micros(text, seconds),
            Field::Number(Some(value)) => number::push(text, value),
            Field::Number(None) => {}
            Field::Word(word) => text.extend_from_slice(word.as_bytes()),
        }
    });
    text.push(b'\n');
}

/// Writes a complete `samples.csv`, header included.
pub fn write_samples(
    out: &mut impl Write,
    channels: &[ChannelInfo],
    samples: &Samples,
) -> io::Result<()> {
    let mut text = Vec::new();
    push_sample_header(&mut text, channels);
    let mut samples = samples.reader();
    while let Some(sample) = samples.next_sample() {
        push_sample(&mut text, sample, channels);
    }
    out.write_all(&text)
}

/// Writes a complete `edges.csv`. `flexor edges` prints the same columns,
/// `t_us,channel,state,dac_code`.
pub fn write_edges(out: &mut impl Write, edges: &[Edge]) -> io::Result<()> {
    writeln!(out, "{}", columns::header(&columns::EDGES, &[]))?;
    for edge in edges {
        let (state, code) = (state_word(&STATES, edge.state), edge.dac_code);
        writeln!(out, "{},{},{state},{code}", edge.t_us, edge.channel)?;
    }
    Ok(())
}

/// Reads `samples.csv`. An incomplete last line, as a crash leaves it, is dropped. Anything else
/// that this program does not write is an error, with the number of its line.
pub fn read_samples(path: &Path) -> Result<Samples, RecordError> {
    let rows = Rows::open(path)?;
    if rows.is_empty {
        return Ok(Samples::default()); // not even its header was whole
    }
    let columns = |kind: &str| -> Vec<usize> {
        let named = rows.header.iter().enumerate();
        let entries = named.filter(|(_, name)| name.starts_with(kind));
        entries.map(|(column, _)| column).collect()
    };
    let lists = [
        "amplitude_",
        "width_",
        "force_",
        "wanted_",
        "rate_",
        "below_",
        "above_",
        "angle_",
        "phase_",
    ]
    .map(columns);
    let [
        amplitudes,
        widths,
        forces,
        wanted,
        rates,
        below,
        above,
        angles,
        phases,
    ] = lists;
    // Columns for an arm; the true forces were added in a later version than the others.
    let column = |name: &str| rows.header.iter().position(|header| header == name);
    let [hand, truly] = [HAND, HAND_TRUE].map(|names| names.into_iter().filter_map(column));
    let (hand, truly): (Vec<_>, Vec<_>) = (hand.collect(), truly.collect());
    let (made, held) = (column("hand_made"), column("held"));
    let fixed = FIXED.map(|name| rows.column(name));
    let [t, target, measured, truth, effort, limiting, state] = fixed;
    let (t, target, measured) = (t?, target?, measured?);
    let (truth, effort, limiting, state) = (truth?, effort?, limiting?, state?);
    rows.map(|row| {
        // An empty field keeps its position in the list.
        let list = |columns: &[usize]| -> Result<Vec<Option<f64>>, RecordError> {
            columns.iter().map(|&column| row.optional(column)).collect()
        };
        Ok(Sample {
            t_s: row.get(t)?,
            target_deg: row.optional(target)?,
            measured_deg: row.optional(measured)?,
            true_deg: row.optional(truth)?,
            effort: row.optional(effort)?,
            limiting: row.get::<u8>(limiting)? != 0,
            state: row.state(&DEVICE_STATES, state)?,
            amplitudes: list(&amplitudes)?,
            widths_us: list(&widths)?,
            forces_n: list(&forces)?,
            wanted_n: list(&wanted)?,
            rates_hz: list(&rates)?,
            below_n: list(&below)?,
            above_n: list(&above)?,
            held: held.map_or(Ok(None), |held| row.optional(held))?,
            joint_deg: list(&angles)?,
            phase: list(&phases)?,
            hand_n: empty_if_unknown(list(&hand)?),
            hand_made: made.map_or(Ok(None), |made| row.optional(made))?,
            hand_true_n: empty_if_unknown(list(&truly)?),
        })
    })
}

/// Returns the components of a force; an empty list if all of them are unknown.
fn empty_if_unknown(force: Vec<Option<f64>>) -> Vec<Option<f64>> {
    match force.iter().all(Option::is_none) {
        true => Vec::new(),
        false => force,
    }
}

/// Reads `edges.csv`. An incomplete last line is dropped, and other deviations are errors, as in
/// [`read_samples`].
pub fn read_edges(path: &Path) -> Result<Vec<Edge>, RecordError> {
    let rows = Rows::open(path)?;
    let (t, channel) = (rows.column("t_us")?, rows.column("channel")?);
    let (state, code) = (rows.column("state")?, rows.column("dac_code")?);
    rows.map(|row| {
        Ok(Edge {
            t_us: row.get(t)?,
            channel: row.get(channel)?,
            state: row.state(&STATES, state)?,
            dac_code: row.get(code)?,
        })
    })
}

/// States of the output switches, with their words in `edges.csv`.
const STATES: [(State, &str); 4] = [
    (State::Isolated, "isolated"),
    (State::Anodic, "anodic"),
    (State::Cathodic, "cathodic"),
    (State::Grounded, "grounded"),
];

/// States of the device, with their words in `samples.csv`.
const DEVICE_STATES: [(DeviceState, &str); 6] = [
    (DeviceState::Boot, "boot"),
    (DeviceState::Idle, "idle"),
    (DeviceState::Armed, "armed"),
    (DeviceState::Stimulating, "stimulating"),
    (DeviceState::Stopping, "stopping"),
    (DeviceState::Fault, "fault"),
];

/// Returns the word for `state` in `words`, which must have an entry for it.
fn state_word<S: PartialEq>(words: &[(S, &'static str)], state: S) -> &'static str {
    let found = words.iter().find(|(word, _)| *word == state);
    found.map_or("", |(_, word)| word)
}

/// Reads the complete lines of a CSV file row by row, because the file may be larger than the
/// computer's memory.
pub(super) struct Rows<'a> {
    path: &'a Path,
    header: Vec<String>,
    is_empty: bool,
    file: File,
    /// Length of the file without an incomplete last line, bytes.
    whole: u64,
}

impl<'a> Rows<'a> {
    pub(super) fn open(path: &'a Path) -> Result<Self, RecordError> {
        let opened = || -> io::Result<Self> {
            let mut file = input::open(path)?;
            let length = whole_lines(&mut file)?;
            let mut header = String::new();
            BufReader::new((&file).take(length)).read_line(&mut header)?;
            file.rewind()?;
            let names = header.trim_end_matches(['\n', '\r']).split(',');
            Ok(Rows {
                path,
                header: names.map(str::to_owned).collect(),
                is_empty: length == 0,
                file,
                whole: length,
            })
        };
        opened().map_err(RecordError::io(path))
    }

    /// Returns whether the file has no complete line, not even a header.
    pub(super) const fn is_empty(&self) -> bool {
        self.is_empty
    }

    pub(super) fn column(&self, name: &str) -> Result<usize, RecordError> {
        let found = self.header.iter().position(|column| column == name);
        found.ok_or_else(|| self.error(1, format!("the column {name} is missing")))
    }

    pub(super) fn map<T, C: FromIterator<T>>(
        &self,
        parse: impl Fn(&Row) -> Result<T, RecordError>,
    ) -> Result<C, RecordError> {
        let mut reader = csv::Reader::from_reader((&self.file).take(self.whole));
        let records = reader.records().enumerate();
        let rows = records.map(|(row, record)| {
            let line = row + 2;
            let record = record.map_err(|why| self.error(line, why.to_string()))?;
            let rows = self;
            parse(&Row { rows, record, line })
        });
        rows.collect()
    }

    fn error(&self, line: usize, message: String) -> RecordError {
        RecordError::Format(self.path.to_owned(), line, message)
    }
}

/// Returns the length of `file` without an incomplete last line, bytes. The next read starts at the
/// beginning of the file.
///
/// # Errors
/// The file cannot be read, or is not text.
fn whole_lines(file: &mut File) -> io::Result<u64> {
    let (mut line, mut length) = (Vec::new(), 0);
    let mut lines = BufReader::with_capacity(1 << 16, &mut *file);
    while lines.read_until(b'\n', &mut line)? > 0 {
        let text = std::str::from_utf8(&line).map_err(io::Error::other)?;
        length += if text.ends_with('\n') {
            line.len() as u64
        } else {
            0
        };
        line.clear();
    }
    file.rewind()?;
    Ok(length)
}

pub(super) struct Row<'a> {
    rows: &'a Rows<'a>,
    record: csv::StringRecord,
    line: usize,
}

impl Row<'_> {
    pub(super) fn text(&self, column: usize) -> &str {
        self.record.get(column).unwrap_or_default()
    }

    pub(super) fn get<T: FromStr>(&self, column: usize) -> Result<T, RecordError> {
        self.text(column).parse().map_err(|_| self.error(column))
    }

    pub(super) fn optional<T: FromStr>(&self, column: usize) -> Result<Option<T>, RecordError> {
        match self.text(column) {
            "" => Ok(None),
            _ => self.get(column).map(Some),
        }
    }

    pub(super) fn state<S: Copy>(
        &self,
        words: &[(S, &str)],
        column: usize,
    ) -> Result<S, RecordError> {
        let found = words.iter().find(|(_, word)| *word == self.text(column));
        found
            .map(|(state, _)| *state)
            .ok_or_else(|| self.error(column))
    }

    fn error(&self, column: usize) -> RecordError {
        let (name, text) = (&self.rows.header[column], self.text(column));
        let message = format!("{name}: \"{text}\" is not a value of this column");
        self.rows.error(self.line, message)
    }
}
