//! Writer of sigrok session files.

use std::fmt::Write as _;
use std::io::{Seek, Write};
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, DateTime, ZipWriter};

use super::{Capture, CaptureError};

/// Bytes of samples per chunk: as libsigrok reads them.
const CHUNK: usize = 4 << 20;

/// Writes a capture as a sigrok session file of version 2.
///
/// Equal captures give equal bytes: the entries have the date 1 January 1980. The probes must
/// start at bit 0 to give the smallest samples; unused bits are zero.
///
/// # Errors
/// Returns [`CaptureError::NoProbes`] and [`CaptureError::Empty`] for a capture without probes or
/// samples, and [`CaptureError::Io`] or [`CaptureError::Archive`] if writing fails.
pub fn write(out: impl Write + Seek, capture: &Capture) -> Result<(), CaptureError> {
    let highest = capture.probes().iter().map(|probe| probe.bit).max();
    let probes = usize::from(highest.ok_or(CaptureError::NoProbes)?) + 1;
    if capture.samples() == 0 {
        return Err(CaptureError::Empty);
    }
    let unitsize = probes.div_ceil(8);
    let mut archive = Archive {
        zip: ZipWriter::new(out),
        unitsize,
        buffer: Vec::with_capacity(CHUNK),
        chunks: 0,
    };
    archive.entry("version", b"2")?;
    archive.entry("metadata", metadata(capture, probes, unitsize).as_bytes())?;
    let mask = capture
        .probes()
        .iter()
        .fold(0, |m, probe| m | 1 << probe.bit);
    let (mut sample, mut levels) = (0, capture.first());
    for transition in capture.transitions() {
        archive.samples(levels & mask, transition.sample - sample)?;
        (sample, levels) = (transition.sample, transition.levels);
    }
    archive.samples(levels & mask, capture.samples() - sample)?;
    archive.finish()
}

fn metadata(capture: &Capture, probes: usize, unitsize: usize) -> String {
    let mut text = format!(
        "[global]\nsigrok version=0.5.2 (flexor)\n\n[device 1]\ncapturefile=logic-1\n\
         total probes={probes}\nsamplerate={}\ntotal analog=0\n",
        rate_text(capture.samplerate_hz())
    );
    for probe in capture.probes() {
        // Writing to a String cannot fail.
        let _ = writeln!(text, "probe{}={}", u16::from(probe.bit) + 1, probe.name);
    }
    let _ = writeln!(text, "unitsize={unitsize}");
    text
}

fn rate_text(rate_hz: u64) -> String {
    let units = [(1_000_000_000, "GHz"), (1_000_000, "MHz"), (1_000, "kHz")];
    let unit = units
        .into_iter()
        .find(|unit| rate_hz.is_multiple_of(unit.0));
    let (scale, name) = unit.unwrap_or((1, "Hz"));
    format!("{} {name}", rate_hz / scale)
}

struct Archive<W: Write + Seek> {
    zip: ZipWriter<W>,
    unitsize: usize,
    buffer: Vec<u8>,
    chunks: u64,
}

impl<W: Write + Seek> Archive<W> {
    fn entry(&mut self, name: &str, bytes: &[u8]) -> Result<(), CaptureError> {
        let options = SimpleFileOptions::default()
            .compression_method(CompressionMethod::Deflated)
            .compression_level(Some(1))
            .last_modified_time(DateTime::default());
        let started = self.zip.start_file(name, options);
        started.map_err(CaptureError::Archive)?;
        self.zip
            .write_all(bytes)
            .map_err(|source| CaptureError::Io {
                entry: name.to_string(),
                source,
            })
    }

    fn samples(&mut self, levels: u64, mut count: u64) -> Result<(), CaptureError> {
        let unit = levels.to_le_bytes();
        let unit = unit.get(..self.unitsize).unwrap_or(&unit);
        let capacity = CHUNK / self.unitsize * self.unitsize;
        while count > 0 {
            let free = ((capacity - self.buffer.len()) / self.unitsize) as u64;
            let now = free.min(count);
            // Not above the capacity, so within usize.
            let length = self.buffer.len() + now as usize * self.unitsize;
            if let [byte] = unit {
                self.buffer.resize(length, *byte);
            } else {
                (0..now).for_each(|_| self.buffer.extend_from_slice(unit));
            }
            count -= now;
            if self.buffer.len() >= capacity {
                self.flush()?;
            }
        }
        Ok(())
    }

    fn flush(&mut self) -> Result<(), CaptureError> {
        if self.buffer.is_empty() {
            return Ok(());
        }
        self.chunks += 1;
        let buffer = std::mem::take(&mut self.buffer);
        self.entry(&format!("logic-1-{}", self.chunks), &buffer)?;
        self.buffer = buffer;
        self.buffer.clear();
        Ok(())
    }

    fn finish(mut self) -> Result<(), CaptureError> {
        self.flush()?;
        self.zip.finish().map_err(CaptureError::Archive)?;
        Ok(())
    }
}
