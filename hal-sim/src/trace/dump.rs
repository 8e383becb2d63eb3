//! Value change dump (IEEE 1364-2001 §18) of any lines, in nanoseconds.

use std::io::{self, Write};
use vcd::{IdCode, TimescaleUnit, Writer};

/// A dump of named lines with 1 ns time steps, written piece by piece. Time never goes back: a
/// change with an earlier time gets the time of the last change.
pub struct Dump<W: Write> {
    out: Writer<io::BufWriter<W>>,
    lines: Vec<IdCode>,
    ns: u64,
}

impl<W: Write> Dump<W> {
    /// Writes the header, and the lines with their names and levels at time 0.
    ///
    /// # Errors
    /// Fails if `out` cannot be written.
    pub fn begin<'a>(out: W, lines: impl IntoIterator<Item = (&'a str, bool)>) -> io::Result<Self> {
        let mut out = Writer::new(io::BufWriter::new(out));
        out.timescale(1, TimescaleUnit::NS)?;
        out.add_module("chip")?;
        let mut known = Vec::new();
        for (name, high) in lines {
            known.push((out.add_wire(1, name)?, high));
        }
        out.upscope()?;
        out.enddefinitions()?;
        out.timestamp(0)?;
        for (line, high) in &known {
            out.change_scalar(*line, *high)?;
        }
        let lines = known.into_iter().map(|(line, _)| line).collect();
        Ok(Self { out, lines, ns: 0 })
    }

    /// Records that line `index`, in the order of [`Self::begin`], becomes `high` at `ns`. An
    /// `index` that does not exist is ignored.
    ///
    /// # Errors
    /// Fails if the dump cannot be written.
    pub fn change(&mut self, ns: u64, index: usize, high: bool) -> io::Result<()> {
        self.advance_to(ns)?;
        match self.lines.get(index) {
            Some(&line) => self.out.change_scalar(line, high),
            None => Ok(()),
        }
    }

    /// Ends the dump with the time stamp `ns`, up to which nothing changes any more.
    ///
    /// # Errors
    /// Fails if the dump cannot be written.
    pub fn end(mut self, ns: u64) -> io::Result<()> {
        self.advance_to(ns)?;
        self.out.flush()
    }

    fn advance_to(&mut self, ns: u64) -> io::Result<()> {
        if ns > self.ns {
            self.out.timestamp(ns)?;
            self.ns = ns;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use vcd::{Command, Parser, Value};

    #[test]
    fn changes_are_read_back_with_their_time() {
        let mut bytes = Vec::new();
        let mut dump = Dump::begin(&mut bytes, [("PA0", false), ("PA1", true)]).unwrap();
        dump.change(1_250, 0, true).unwrap();
        dump.change(1_250, 1, false).unwrap();
        dump.change(9, 7, true).unwrap();
        dump.end(5_000).unwrap();
        let mut parser = Parser::new(bytes.as_slice());
        let header = parser.parse_header().unwrap();
        assert_eq!(header.timescale, Some((1, TimescaleUnit::NS)));
        let code = |name| header.find_var(&["chip", name]).unwrap().code;
        let commands: Vec<Command> = parser.map(Result::unwrap).collect();
        let expected = [
            Command::Timestamp(0),
            Command::ChangeScalar(code("PA0"), Value::V0),
            Command::ChangeScalar(code("PA1"), Value::V1),
            Command::Timestamp(1_250),
            Command::ChangeScalar(code("PA0"), Value::V1),
            Command::ChangeScalar(code("PA1"), Value::V0),
            Command::Timestamp(5_000),
        ];
        assert_eq!(commands, expected);
    }
}
