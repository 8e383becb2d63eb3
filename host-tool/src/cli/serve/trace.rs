//! File of a served board's output and input, in device time, for tests of a client.

use firmware::link::{Decoder, Request, ToDevice};
use hal_sim::trace::Trace;
use hal_sim::world::World;
use serde::Serialize;
use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::Path;
use std::time::{SystemTime, UNIX_EPOCH};

/// Writer of a trace: JSON objects, one a line.
pub(super) struct TraceFile {
    to: BufWriter<File>,
    from_host: Decoder,
    /// Requests that arrived since the last line.
    requests: Vec<Request>,
    /// Device time of the last line, µs.
    last_us: u64,
}

/// One line of the file: what the board received at `device_us`, and its output since the line
/// before.
#[derive(Serialize)]
struct Line<'a> {
    device_us: u64,
    /// Wall-clock time at which the line was written, µs after 1970.
    unix_us: u64,
    #[serde(skip_serializing_if = "<[_]>::is_empty")]
    requests: &'a [Request],
    #[serde(skip_serializing_if = "Option::is_none")]
    output: Option<&'a Trace>,
}

impl TraceFile {
    /// Longest time between two lines, µs, so that wall-clock times can be converted.
    const EVERY_US: u64 = 1_000;

    /// Creates the file, which must not exist.
    pub(super) fn create(path: &Path) -> io::Result<Self> {
        Ok(Self {
            to: BufWriter::new(File::create_new(path)?),
            from_host: Decoder::default(),
            requests: Vec::new(),
            last_us: 0,
        })
    }

    /// Records bytes that the board receives now.
    pub(super) fn note_received(&mut self, bytes: &[u8]) {
        let mut rest = bytes;
        while !rest.is_empty() {
            let Some(message) = self.from_host.push_until_delimiter(&mut rest) else {
                continue;
            };
            let frame: Option<ToDevice> = message
                .ok()
                .and_then(|message| postcard::from_bytes(message).ok());
            self.from_host.clear();
            self.requests.extend(frame.map(|frame| frame.request));
        }
    }

    /// Writes a line if there is something to write, and takes the output from `world`.
    pub(super) fn write_line(&mut self, world: &mut World) -> io::Result<()> {
        let device_us = world.now_us();
        let output = world.recorder.trace.take(device_us);
        let has_output =
            !(output.levels.is_empty() && output.dac.is_empty() && output.trips.is_empty());
        if self.requests.is_empty() && !has_output && device_us < self.last_us + Self::EVERY_US {
            return Ok(());
        }
        let unix = SystemTime::now().duration_since(UNIX_EPOCH);
        let line = Line {
            device_us,
            unix_us: unix.map_or(0, |since| since.as_micros() as u64), // fits for 500 000 years
            requests: &self.requests,
            output: has_output.then_some(&output),
        };
        serde_json::to_writer(&mut self.to, &line)?;
        self.requests.clear();
        self.last_us = device_us;
        self.to.write_all(b"\n")
    }
}
