//! Edge files: CSV with the columns `t_us,channel,state,dac_code`.
//!
//! Channels count from 1; rows are ordered by time, then channel; lines end in a single line feed.
//! Equal traces give equal bytes, so files can be compared as a whole.

use std::io::{self, Read, Write};
use std::str::FromStr;

use super::edges::Edge;
use super::levels::CHANNELS;

const HEADER: [&str; 4] = ["t_us", "channel", "state", "dac_code"];

/// Reason why an edge file cannot be read, with the place of the error.
#[derive(Debug, thiserror::Error)]
pub enum EdgeFileError {
    /// The text is not CSV, a row has a wrong number of fields, or reading failed.
    #[error("edge file: {0}")]
    Csv(csv::Error),
    /// The first line does not name the four columns in order.
    #[error("edge file: the first line must be `t_us,channel,state,dac_code`")]
    Header,
    /// A cell does not hold what its column allows, for example an unknown state.
    #[error("edge file, line {line}: {column} cannot be `{value}`; allowed: {allowed}")]
    Field {
        /// Line number in the file, from 1.
        line: u64,
        /// Name of the column.
        column: &'static str,
        /// Text of the field.
        value: String,
        /// Description of the allowed values.
        allowed: &'static str,
    },
    /// Rows are not ordered by time, then channel.
    #[error("edge file, line {line}: rows must be ordered by t_us, then channel")]
    Order {
        /// Line number of the row, from 1.
        line: u64,
    },
}

impl From<csv::Error> for EdgeFileError {
    fn from(error: csv::Error) -> Self {
        Self::Csv(error)
    }
}

/// Writes edges, which must be ordered by time, then channel, like those of
/// [`super::Trace::edges`].
pub fn write_csv(out: impl Write, edges: impl IntoIterator<Item = Edge>) -> io::Result<()> {
    let mut out = io::BufWriter::new(out);
    writeln!(out, "{}", HEADER.join(","))?;
    for edge in edges {
        let (channel, code) = (edge.channel + 1, edge.dac_code);
        writeln!(out, "{},{channel},{},{code}", edge.t_us, edge.state)?;
    }
    out.flush()
}

/// Reads the edges of an edge file.
///
/// # Errors
/// Returns an [`EdgeFileError`] with the line and the allowed values if the file is malformed.
pub fn read_csv(input: impl Read) -> Result<Vec<Edge>, EdgeFileError> {
    let mut reader = csv::Reader::from_reader(input);
    if reader.headers()? != HEADER.as_slice() {
        return Err(EdgeFileError::Header);
    }
    let mut edges: Vec<Edge> = Vec::new();
    for record in reader.records() {
        let record = record?;
        let edge = read_row(&record)?;
        let place = |edge: &Edge| (edge.t_us, edge.channel);
        if edges.last().is_some_and(|last| place(last) >= place(&edge)) {
            let line = line(&record);
            return Err(EdgeFileError::Order { line });
        }
        edges.push(edge);
    }
    Ok(edges)
}

fn read_row(record: &csv::StringRecord) -> Result<Edge, EdgeFileError> {
    let channel: u8 = field(record, 1, "1 to 10")?;
    if channel == 0 || usize::from(channel) > CHANNELS {
        return Err(bad_field(record, 1, "1 to 10"));
    }
    Ok(Edge {
        t_us: field(record, 0, "a whole number of microseconds")?,
        channel: channel - 1,
        state: field(record, 2, "isolated, anodic, cathodic, grounded")?,
        dac_code: field(record, 3, "0 to 65535")?,
    })
}

fn field<T: FromStr>(
    record: &csv::StringRecord,
    column: usize,
    allowed: &'static str,
) -> Result<T, EdgeFileError> {
    let value = record[column].parse();
    value.map_err(|_| bad_field(record, column, allowed))
}

fn bad_field(record: &csv::StringRecord, column: usize, allowed: &'static str) -> EdgeFileError {
    EdgeFileError::Field {
        line: line(record),
        column: HEADER[column],
        value: record[column].to_string(),
        allowed,
    }
}

fn line(record: &csv::StringRecord) -> u64 {
    record.position().map_or(0, csv::Position::line)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::trace::{Levels, State, Trace};

    #[test]
    fn text_is_exact_and_reads_back() {
        let mut trace = Trace::default();
        trace.record_dac(1, 9, 65_535);
        let levels = Levels::ISOLATED.with_channel(9, State::Anodic);
        trace.record_levels(50, levels.with_channel(0, State::Grounded));
        trace.record_levels(60, levels);
        let mut bytes = Vec::new();
        write_csv(&mut bytes, trace.edges()).expect("a Vec takes all bytes");
        assert_eq!(
            String::from_utf8_lossy(&bytes),
            "t_us,channel,state,dac_code\n50,1,grounded,0\n50,10,anodic,65535\n60,1,isolated,0\n"
        );
        let read = read_csv(bytes.as_slice()).expect("own output");
        assert_eq!(read, trace.edges().collect::<Vec<_>>());
    }

    #[test]
    fn errors_say_where_and_what_is_allowed() {
        let message = |body: &str| {
            let text = format!("t_us,channel,state,dac_code\n1,1,anodic,0\n{body}");
            read_csv(text.as_bytes()).expect_err(body).to_string()
        };
        assert_eq!(
            message("2,11,anodic,0\n"),
            "edge file, line 3: channel cannot be `11`; allowed: 1 to 10"
        );
        assert!(message("2,0,anodic,0\n").contains("`0`"));
        assert!(message("2,1,on,0\n").contains("isolated, anodic"));
        assert!(message("2.5,1,anodic,0\n").contains("whole number"));
        assert!(message("2,1,anodic,65536\n").contains("0 to 65535"));
        assert!(message("0,1,isolated,0\n").contains("ordered"));
        assert!(message("2,1,anodic\n").contains("line: 3"));
        assert!(read_csv("time,channel,state,code\n".as_bytes()).is_err());
    }
}
