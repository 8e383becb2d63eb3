//! Reader of sigrok session files: streams the chunks and keeps the transitions.

use std::io::{Read, Seek};
use zip::ZipArchive;
use zip::result::ZipError;

use super::metadata::{self, Metadata};
use super::{Capture, CaptureError, Transition};

const BUFFER: usize = 1 << 16;
const MAX_METADATA: u64 = 1 << 16;

/// Limits of a reader, so that a capture cannot use all memory or time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ReadOptions {
    /// Probes to keep: bit n stands for the probe with bit n. Changes of other probes are ignored.
    pub probes: u64,
    /// Largest number of transitions to keep; each needs 16 bytes.
    pub max_transitions: usize,
    /// Largest number of bytes of samples to read.
    pub max_bytes: u64,
}

impl Default for ReadOptions {
    /// Keeps all probes, 4 million transitions (64 MB) and 8 GiB of samples.
    fn default() -> Self {
        Self {
            probes: u64::MAX,
            max_transitions: 4_000_000,
            max_bytes: 8 << 30,
        }
    }
}

/// Reads a sigrok session file.
///
/// Samples are little endian, and bit n − 1 belongs to `probeN` (libsigrok `srzip.c`). The samples
/// are in the entry that `capturefile` names, or in entries with that name and `-1`, `-2`, and so
/// on.
///
/// # Errors
/// Returns a [`CaptureError`] with the entry and the reason if the file is damaged, incomplete or
/// exceeds a limit. No input makes the reader panic.
pub fn read(input: impl Read + Seek, options: &ReadOptions) -> Result<Capture, CaptureError> {
    let mut archive = ZipArchive::new(input).map_err(CaptureError::Archive)?;
    check_version(&mut archive)?;
    let text = read_text(&mut archive, "metadata")?;
    let metadata = metadata::parse(&text)?;
    let kept = options.probes;
    let mut probes = metadata.probes.clone();
    probes.retain(|probe| kept >> probe.bit & 1 == 1);
    if probes.is_empty() {
        return Err(CaptureError::NoProbes);
    }
    let mask = probes.iter().fold(0, |mask, probe| mask | 1 << probe.bit);
    let mut scanner = Scanner::new(metadata.unitsize, mask, options);
    for entry in chunks(&archive, &metadata)? {
        scanner.read_chunk(&mut archive, &entry)?;
    }
    let first = scanner.first.ok_or(CaptureError::Empty)?;
    let samples = scanner.sample;
    let rate = metadata.samplerate_hz;
    Capture::new(rate, samples, probes, first, scanner.transitions)
}

fn check_version<R: Read + Seek>(archive: &mut ZipArchive<R>) -> Result<(), CaptureError> {
    let text = read_text(archive, "version")?;
    match text.trim() {
        "1" | "2" => Ok(()),
        _ => Err(CaptureError::BadVersion {
            text: text.chars().take(16).collect(),
        }),
    }
}

fn read_text<R: Read + Seek>(
    archive: &mut ZipArchive<R>,
    entry: &'static str,
) -> Result<String, CaptureError> {
    let file = match archive.by_name(entry) {
        Ok(file) => file,
        Err(ZipError::FileNotFound) => return Err(CaptureError::MissingEntry { entry }),
        Err(error) => return Err(CaptureError::Archive(error)),
    };
    let mut bytes = Vec::new();
    let read = file.take(MAX_METADATA + 1).read_to_end(&mut bytes);
    read.map_err(|source| CaptureError::Io {
        entry: entry.to_string(),
        source,
    })?;
    let bad = |problem| CaptureError::BadMetadata { line: 0, problem };
    if bytes.len() as u64 > MAX_METADATA {
        return Err(bad("an entry exceeds 64 KiB"));
    }
    String::from_utf8(bytes).map_err(|_| bad("an entry is not UTF-8 text"))
}

/// Returns the names of the entries with samples, in order of time.
fn chunks<R: Read + Seek>(
    archive: &ZipArchive<R>,
    metadata: &Metadata,
) -> Result<Vec<String>, CaptureError> {
    let base = &metadata.capture_file;
    if archive.index_for_name(base).is_some() {
        return Ok(vec![base.clone()]);
    }
    let prefix = format!("{base}-");
    let number = |name: &str| name.strip_prefix(&prefix)?.parse::<u64>().ok();
    let names = archive.file_names().flatten();
    let mut numbers: Vec<u64> = names.filter_map(|name| number(&name)).collect();
    numbers.sort_unstable();
    numbers.dedup();
    if numbers.is_empty() {
        return Err(CaptureError::Empty);
    }
    let mut entries = Vec::with_capacity(numbers.len());
    for (number, wanted) in numbers.into_iter().zip(1_u64..) {
        let entry = format!("{prefix}{wanted}");
        if number != wanted {
            return Err(CaptureError::MissingChunk { entry });
        }
        entries.push(entry);
    }
    Ok(entries)
}

struct Scanner<'a> {
    unitsize: usize,
    mask: u64,
    options: &'a ReadOptions,
    sample: u64,
    bytes: u64,
    first: Option<u64>,
    levels: u64,
    transitions: Vec<Transition>,
}

impl<'a> Scanner<'a> {
    fn new(unitsize: usize, mask: u64, options: &'a ReadOptions) -> Self {
        Self {
            unitsize,
            mask,
            options,
            sample: 0,
            bytes: 0,
            first: None,
            levels: 0,
            transitions: Vec::new(),
        }
    }

    fn read_chunk<R: Read + Seek>(
        &mut self,
        archive: &mut ZipArchive<R>,
        entry: &str,
    ) -> Result<(), CaptureError> {
        let mut file = archive.by_name(entry).map_err(CaptureError::Archive)?;
        let mut buffer = vec![0; BUFFER / self.unitsize * self.unitsize];
        loop {
            let filled = fill(&mut file, &mut buffer).map_err(|source| CaptureError::Io {
                entry: entry.to_string(),
                source,
            })?;
            let data = buffer.get(..filled).unwrap_or_default();
            self.bytes += filled as u64;
            if self.bytes > self.options.max_bytes {
                let limit = self.options.max_bytes;
                return Err(CaptureError::TooLong { limit });
            }
            self.scan(data)?;
            if filled % self.unitsize != 0 {
                return Err(CaptureError::PartialSample {
                    entry: entry.to_string(),
                    unitsize: self.unitsize,
                });
            }
            if filled < buffer.len() {
                return Ok(());
            }
        }
    }

    fn scan(&mut self, data: &[u8]) -> Result<(), CaptureError> {
        if self.unitsize == 1 {
            // Runs of equal bytes are most of a capture.
            for run in data.chunk_by(|a, b| a == b) {
                let byte = run.first().copied().unwrap_or_default();
                self.take(byte.into(), run.len() as u64)?;
            }
            return Ok(());
        }
        for unit in data.chunks_exact(self.unitsize) {
            let bytes = unit.iter().rev();
            let levels = bytes.fold(0, |levels, byte| levels << 8 | u64::from(*byte));
            self.take(levels, 1)?;
        }
        Ok(())
    }

    /// Takes `count` samples with equal levels.
    fn take(&mut self, levels: u64, count: u64) -> Result<(), CaptureError> {
        let levels = levels & self.mask;
        if self.first.is_none() {
            self.first = Some(levels);
            self.levels = levels;
        }
        if levels != self.levels {
            if self.transitions.len() >= self.options.max_transitions {
                let limit = self.options.max_transitions;
                return Err(CaptureError::TooManyTransitions { limit });
            }
            let sample = self.sample;
            self.transitions.push(Transition { sample, levels });
            self.levels = levels;
        }
        self.sample += count;
        Ok(())
    }
}

/// Fills the buffer as far as the input allows, and returns the number of bytes.
fn fill(input: &mut impl Read, buffer: &mut [u8]) -> std::io::Result<usize> {
    let mut filled = 0;
    while let Some(rest) = buffer.get_mut(filled..).filter(|rest| !rest.is_empty()) {
        match input.read(rest) {
            Ok(0) => break,
            Ok(count) => filled += count,
            Err(error) if error.kind() == std::io::ErrorKind::Interrupted => {}
            Err(error) => return Err(error),
        }
    }
    Ok(filled)
}
