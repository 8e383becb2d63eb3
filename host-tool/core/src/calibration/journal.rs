//! The journal beside a wearer file, which records line by line what happened, so that a
//! calibration can be continued.
//!
//! Each line holds one JSON object and is handed to the system at once. A last line without its end
//! was cut off and is ignored. Any other line that differs from what was written is damage: each
//! line ends with a checksum over itself and all lines before it. The checksum finds a slip or an
//! edit, not a forger.

use super::found::Value;
use super::head::{FORMAT, Head};
use super::{CalibrationError, Level, Step};
use hal_sim::input;
use serde::{Deserialize, Serialize};
use std::fs::{File, OpenOptions, TryLockError};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// Entry of the journal: one event of a calibration.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub enum Entry {
    /// A calibration began or was continued.
    Begun(Head),
    /// An electrode passed the device's electrode check and was armed.
    Armed {
        /// Channel, counted from 1.
        channel: u8,
        /// Current that the electrode check measured, mA; `None` if the device reported none.
        check_ma: Option<f64>,
    },
    /// A level was given for the length of one presentation.
    Given {
        /// Channel, counted from 1.
        channel: u8,
        /// Step of the calibration in which the level was given.
        step: Step,
        /// Level that was given, in the channel's unit.
        level: Level,
    },
    /// The instrument judged whether a presentation moved anything.
    Judged {
        /// Channel, counted from 1.
        channel: u8,
        /// Whether the verdict is a movement.
        moved: bool,
        /// Largest lasting difference from the force at rest, N.
        deviation_n: f64,
        /// Difference from rest above which the verdict is a movement, N.
        bound_n: f64,
    },
    /// A step of the calibration ended with a result.
    Found {
        /// Channel, counted from 1.
        channel: u8,
        /// Step that ended.
        step: Step,
        /// Result of the step: a level, or names of movements.
        value: Value,
    },
    /// The wearer did not tolerate a level, which is therefore not given again.
    TooMuch {
        /// Channel, counted from 1.
        channel: u8,
        /// Level that was too much, in the channel's unit.
        level: Level,
    },
    /// The operator left an electrode out of the calibration.
    Skipped {
        /// Channel, counted from 1.
        channel: u8,
    },
    /// This computer sent no keep-alive for so long that the device ended stimulation. The level
    /// that was being given is discarded.
    Stalled {
        /// Channel, counted from 1.
        channel: u8,
        /// Longest time between two keep-alives, ms.
        pause_ms: u32,
    },
    /// The wearer file was written.
    Written {
        /// Number of electrodes in the file, all of which are complete.
        electrodes: usize,
    },
    /// The calibration ended early.
    Ended {
        /// Reason for the end, as the error message states it.
        why: String,
    },
    /// Every electrode is complete or left out.
    Done,
}

/// Line of the journal, as a JSON object.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Line {
    /// Number of the line, counted from 1 without a gap.
    n: usize,
    /// Time since the device was opened, in the device's time, s.
    t_s: f64,
    entry: Entry,
    /// Checksum ([`chained_checksum`]) of all lines before this one and of this line up to the
    /// checksum. It is not serialised with the other fields but appended to their text.
    #[serde(default, skip_serializing)]
    sum: String,
}

impl Line {
    /// Returns the text of the line, and the line's checksum. `before` is the checksum of the
    /// previous line.
    fn with_checksum(&self, before: &str) -> serde_json::Result<(String, String)> {
        let object = serde_json::to_string(self)?;
        let content = object.strip_suffix('}').unwrap_or(&object); // an object ends so
        let sum = chained_checksum(before, content);
        Ok((format!("{content}{SUM}{sum}\"}}\n"), sum))
    }
}

/// Text between the content of a line and its checksum.
const SUM: &str = ",\"sum\":\"";

/// Returns the checksum of a line: the first 64 bits, in hexadecimal, of SHA-256 over the previous
/// line's checksum `before` and the content `content` of the line. It thus depends on all lines
/// before.
fn chained_checksum(before: &str, content: &str) -> String {
    let mut sum = crate::record::sha256(format!("{before}{content}").as_bytes());
    sum.truncate(16);
    sum
}

/// Destination of journal and wearer file: the file system or, in tests, a substitute that can fail
/// like a full disk.
pub trait Files {
    /// Opens a file for appending. Each write reaches the operating system at once.
    ///
    /// # Errors
    /// The file cannot be opened.
    fn append(&self, path: &Path) -> io::Result<Box<dyn Write>>;

    /// Replaces the content of a file as a whole. If this fails, the old file is unchanged.
    ///
    /// # Errors
    /// The file cannot be written.
    fn replace(&self, path: &Path, text: &str) -> io::Result<()>;
}

/// Destination in the file system.
#[derive(Clone, Copy, Debug, Default)]
pub struct OnDisk;

impl Files for OnDisk {
    fn append(&self, path: &Path) -> io::Result<Box<dyn Write>> {
        input::check_appendable(path)?;
        let file = OpenOptions::new().append(true).create(true).open(path)?;
        // The lock is held until the file is closed, however the program ends.
        if matches!(file.try_lock(), Err(TryLockError::WouldBlock)) {
            return Err(io::Error::other("another flexor is writing it"));
        }
        Ok(Box::new(file))
    }

    fn replace(&self, path: &Path, text: &str) -> io::Result<()> {
        let replaced = crate::record::replace_file(path, text.as_bytes());
        replaced.map_err(|error| match error {
            crate::record::RecordError::Write { why, .. } => why,
            other => io::Error::other(other.to_string()),
        })
    }
}

/// Returns the path of the journal that belongs to the wearer file `out`: in the same folder, with
/// ".journal" added to the name.
#[must_use]
pub fn journal_path(out: &Path) -> PathBuf {
    let mut name = out.file_name().unwrap_or_default().to_owned();
    name.push(".journal");
    out.with_file_name(name)
}

/// Journal that is open for writing. Each entry becomes one line.
pub struct Journal {
    path: PathBuf,
    out: Box<dyn Write>,
    lines: usize,
    /// Checksum of the last line; empty if there is no line.
    sum: String,
}

impl Journal {
    /// Opens the journal at `path`. It continues after the lines in `kept`, which were read from
    /// it, or begins a new journal if `kept` is `None`.
    ///
    /// # Errors
    /// The file cannot be opened.
    pub fn open(
        files: &dyn Files,
        path: &Path,
        kept: Option<&JournalContents>,
    ) -> Result<Self, CalibrationError> {
        let out = files.append(path);
        let out = out.map_err(|why| CalibrationError::Closed(path.to_owned(), why))?;
        Ok(Self {
            path: path.to_owned(),
            out,
            lines: kept.map_or(0, |kept| kept.entries.len()),
            sum: kept.map_or_else(String::new, |kept| kept.sum.clone()),
        })
    }

    /// Creates a journal that writes no file and discards its entries, for a drift check.
    #[must_use]
    pub fn discarding() -> Self {
        Self {
            path: PathBuf::new(),
            out: Box::new(io::sink()),
            lines: 0,
            sum: String::new(),
        }
    }

    /// Appends an entry as a line. `t_s` is the time since the device was opened, s.
    ///
    /// # Errors
    /// The line cannot be written completely.
    pub fn add(&mut self, t_s: f64, entry: &Entry) -> Result<(), CalibrationError> {
        let line = Line {
            n: self.lines + 1,
            t_s: (t_s * 1e6).round() / 1e6,
            entry: entry.clone(),
            sum: String::new(),
        };
        let text = line.with_checksum(&self.sum).map_err(io::Error::from);
        let written = text.and_then(|(text, sum)| {
            self.out.write_all(text.as_bytes())?;
            self.out.flush()?;
            Ok(sum)
        });
        self.sum = written.map_err(|why| CalibrationError::Write(self.path.clone(), why))?;
        self.lines += 1;
        Ok(())
    }
}

/// Returns whether the journal at `path` contains a complete line. A file without one is removed,
/// because it was cut off before anything happened.
///
/// # Errors
/// The file cannot be read or removed.
pub fn has_entries(path: &Path) -> io::Result<bool> {
    match input::read(path, input::LONGEST_DOCUMENT) {
        Err(why) if why.kind() == io::ErrorKind::NotFound => Ok(false),
        Err(why) => Err(why),
        Ok(text) if text.contains(&b'\n') => Ok(true),
        Ok(_) => std::fs::remove_file(path).map(|()| false),
    }
}

/// Content of a journal, from which a calibration continues.
#[derive(Clone, PartialEq, Debug)]
pub struct JournalContents {
    /// Head of the first run in the journal.
    pub head: Head,
    /// All entries, including those that hold a head.
    pub entries: Vec<Entry>,
    /// Length of the complete lines together, in bytes. An incomplete last line comes after them.
    pub whole: usize,
    /// Checksum of the last complete line, which depends on all lines.
    pub sum: String,
}

/// Reads the journal at `path`, and removes an incomplete last line from the file.
///
/// # Errors
/// The file cannot be read, is empty, has a later format, or is damaged.
pub fn read(path: &Path) -> Result<JournalContents, CalibrationError> {
    let unusable = |why: String| CalibrationError::NotResumable(path.to_owned(), why);
    let text = input::read(path, input::LONGEST_DOCUMENT).map_err(|why| {
        unusable(match why.kind() {
            io::ErrorKind::NotFound => {
                "there is no journal; run without --resume to start one".to_owned()
            }
            _ => why.to_string(),
        })
    })?;
    if !text.contains(&b'\n') {
        let why = "it is empty; start again without --resume";
        return Err(unusable(why.to_owned()));
    }
    let kept = parse_journal(path, &text)?;
    if kept.head.format > FORMAT {
        return Err(unusable(format!(
            "its format is {}, but this flexor reads formats up to {FORMAT}; use a newer flexor",
            kept.head.format
        )));
    }
    if kept.whole < text.len() {
        let cut = OpenOptions::new().write(true).open(path);
        cut.and_then(|file: File| file.set_len(kept.whole as u64))
            .map_err(|why| CalibrationError::Write(path.to_owned(), why))?;
    }
    Ok(kept)
}

/// Parses the bytes `text` of the journal at `path`. An incomplete last line is ignored.
///
/// # Errors
/// The journal is damaged; the error names the line and the reason.
pub fn parse_journal(path: &Path, text: &[u8]) -> Result<JournalContents, CalibrationError> {
    let damaged = |line: usize, why: &str| {
        CalibrationError::Damaged(
            path.to_owned(),
            line,
            crate::session::escape_control_chars(why),
        )
    };
    let (mut entries, mut length, mut sum) = (Vec::new(), 0, String::new());
    for line in text.split_inclusive(|byte| *byte == b'\n') {
        if !line.ends_with(b"\n") {
            break; // cut off
        }
        let number = entries.len() + 1;
        let read: Line =
            serde_json::from_slice(line).map_err(|why| damaged(number, &why.to_string()))?;
        if read.n != number {
            return Err(damaged(
                number,
                &format!("it was written as line {}", read.n),
            ));
        }
        let text = String::from_utf8_lossy(line); // JSON that was read is UTF-8
        sum = chained_checksum(
            &sum,
            text.rsplit_once(SUM).map_or("", |(content, _)| content),
        );
        if read.sum != sum {
            return Err(damaged(number, "it was changed after it was written"));
        }
        entries.push(read.entry);
        length += line.len();
    }
    let Some(Entry::Begun(head)) = entries.first().cloned() else {
        return Err(damaged(1, "it does not begin with the wearer and the plan"));
    };
    Ok(JournalContents {
        head,
        entries,
        whole: length,
        sum,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn text(lines: usize) -> String {
        let entries = [
            Entry::Begun(Head::new("K05", "a plan")),
            Entry::Skipped { channel: 3 },
            Entry::Found {
                channel: 1,
                step: Step::Threshold,
                value: Value::Level(Level(7500)),
            },
        ];
        let mut before = String::new();
        let line = |(i, entry): (usize, &Entry)| {
            let (n, t_s, entry, sum) = (i + 1, 0.5, entry.clone(), String::new());
            let line = Line { n, t_s, entry, sum };
            let (text, sum) = line.with_checksum(&before).unwrap();
            before = sum;
            text
        };
        entries.iter().enumerate().take(lines).map(line).collect()
    }

    #[test]
    fn what_was_cut_off_does_not_count_and_what_was_changed_is_damage() {
        let path = Path::new("x.journal");
        let full_text = text(3);
        let read = parse_journal(path, full_text.as_bytes()).unwrap();
        assert_eq!(read.entries.len(), 3);
        assert_eq!(read.head.wearer, "K05");
        for end in text(2).len()..full_text.len() {
            let kept = parse_journal(path, &full_text.as_bytes()[..end]).unwrap();
            assert_eq!(
                (kept.entries.len(), kept.whole),
                (2, text(2).len()),
                "{end}"
            );
        }
        let message = |text: &str| {
            parse_journal(path, text.as_bytes())
                .unwrap_err()
                .to_string()
        };
        let renumbered = full_text.replace("\"n\":2", "\"n\":9");
        assert!(message(&renumbered).contains("line 2: it was written as line 9"));
        let line = text(2);
        let second = line.lines().nth(1).unwrap();
        let missing = full_text.replace(&format!("{second}\n"), "");
        assert!(message(&missing).contains("line 2: it was written as line 3"));
        let misspelt = message(&full_text.replace("threshold", "thr"));
        assert!(misspelt.starts_with("E674") && misspelt.contains("the journal x.journal, line 3"));
        assert!(message("").contains("does not begin with the wearer"));
        for (line, was, is) in [(1, "K05", "K06"), (2, "3}", "4}"), (3, "7.5", "24.0")] {
            let changed = full_text.replace(was, is);
            assert_ne!(changed, full_text, "{was}");
            let wanted = format!("line {line}: it was changed after it was written");
            assert!(message(&changed).contains(&wanted), "{}", message(&changed));
        }
    }
}
