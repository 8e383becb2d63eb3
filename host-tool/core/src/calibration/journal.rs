//! The journal beside a wearer file: what happened, line by line, to go on from.
//!
//! One JSON object a line, handed to the system at once. A last line without its end was
//! cut off and does not count; any other line that is not as written is damage: each ends
//! with a sum over itself and all before it. That finds a slip or an edit, not a forger.

use super::found::Value;
use super::head::{FORMAT, Head};
use super::{CalibrationError, Level, Step};
use hal_sim::input;
use serde::{Deserialize, Serialize};
use std::fs::{File, OpenOptions, TryLockError};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// Something that happened.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub enum Entry {
    /// It began, or was gone on with.
    Begun(Head),
    /// An electrode was armed: what the check read, mA.
    Armed {
        /// From 1.
        channel: u8,
        /// Nothing where the device told none.
        check_ma: Option<f64>,
    },
    /// A level was given.
    Given {
        /// From 1.
        channel: u8,
        /// In which step.
        step: Step,
        /// In the channel's unit.
        level: Level,
    },
    /// What the instrument said, N.
    Judged {
        /// From 1.
        channel: u8,
        /// Whether it moved.
        moved: bool,
        /// Largest lasting distance from rest.
        deviation_n: f64,
        /// What it had to exceed.
        bound_n: f64,
    },
    /// A step has its result.
    Found {
        /// From 1.
        channel: u8,
        /// The step.
        step: Step,
        /// Level or movements.
        value: Value,
    },
    /// The wearer wanted no more of this.
    TooMuch {
        /// From 1.
        channel: u8,
        /// In the channel's unit.
        level: Level,
    },
    /// The operator left the electrode out.
    Skipped {
        /// From 1.
        channel: u8,
    },
    /// This computer did not tell the device for so long that it was there, and the device
    /// ended stimulation: what was being given counts for nothing.
    Stalled {
        /// From 1.
        channel: u8,
        /// The longest pause between two keep-alives.
        pause_ms: u32,
    },
    /// The wearer file was written with so many electrodes.
    Written {
        /// Complete ones.
        electrodes: usize,
    },
    /// It ended before its end.
    Ended {
        /// Why.
        why: String,
    },
    /// Every electrode is done.
    Done,
}

/// A line of the journal.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Line {
    /// From 1, without a gap.
    n: usize,
    /// Since the device was opened, s of its time.
    t_s: f64,
    entry: Entry,
    /// [`chained`] over all before it and this line up to here; written by hand.
    #[serde(default, skip_serializing)]
    sum: String,
}

impl Line {
    /// As it is written after a line with the sum `before`, and its own sum.
    fn written(&self, before: &str) -> serde_json::Result<(String, String)> {
        let object = serde_json::to_string(self)?;
        let told = object.strip_suffix('}').unwrap_or(&object); // an object ends so
        let sum = chained(before, told);
        Ok((format!("{told}{SUM}{sum}\"}}\n"), sum))
    }
}

/// What stands between a line's content and its sum.
const SUM: &str = ",\"sum\":\"";

/// Sum over a line's content `told` and, by their last sum, all lines before it: the first
/// 64 bits of SHA-256, hexadecimal.
fn chained(before: &str, told: &str) -> String {
    let mut sum = crate::record::sha256(format!("{before}{told}").as_bytes());
    sum.truncate(16);
    sum
}

/// Where journal and wearer file go: the file system, or one that fills up.
pub trait Files {
    /// Opens a file to be appended to; every write is handed to the system at once.
    ///
    /// # Errors
    /// It cannot be.
    fn append(&self, path: &Path) -> io::Result<Box<dyn Write>>;

    /// Replaces a file as a whole, or leaves the old one.
    ///
    /// # Errors
    /// It cannot be written.
    fn replace(&self, path: &Path, text: &str) -> io::Result<()>;
}

/// The file system.
#[derive(Clone, Copy, Debug, Default)]
pub struct OnDisk;

impl Files for OnDisk {
    fn append(&self, path: &Path) -> io::Result<Box<dyn Write>> {
        input::may_go_on(path)?;
        let file = OpenOptions::new().append(true).create(true).open(path)?;
        // Held until it is closed, however the program ends.
        if matches!(file.try_lock(), Err(TryLockError::WouldBlock)) {
            return Err(io::Error::other("another flexor writes it"));
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

/// Where the journal of a wearer file lies: beside it.
#[must_use]
pub fn journal_of(out: &Path) -> PathBuf {
    let mut name = out.file_name().unwrap_or_default().to_owned();
    name.push(".journal");
    out.with_file_name(name)
}

/// A journal that is written to.
pub struct Journal {
    path: PathBuf,
    out: Box<dyn Write>,
    lines: usize,
    /// Of the last line; empty without one.
    sum: String,
}

impl Journal {
    /// Goes on with the journal at `path` after what it has `kept`, or begins it.
    ///
    /// # Errors
    /// It cannot be opened.
    pub fn open(
        files: &dyn Files,
        path: &Path,
        kept: Option<&Kept>,
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

    /// One that keeps nothing.
    #[must_use]
    pub fn nowhere() -> Self {
        Self {
            path: PathBuf::new(),
            out: Box::new(io::sink()),
            lines: 0,
            sum: String::new(),
        }
    }

    /// Adds a line, `t_s` after the device was opened.
    ///
    /// # Errors
    /// It cannot be written, as a whole.
    pub fn add(&mut self, t_s: f64, entry: &Entry) -> Result<(), CalibrationError> {
        let line = Line {
            n: self.lines + 1,
            t_s: (t_s * 1e6).round() / 1e6,
            entry: entry.clone(),
            sum: String::new(),
        };
        let text = line.written(&self.sum).map_err(io::Error::from);
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

/// Whether a journal at `path` has anything whole in it. One that has not is taken away:
/// it was cut off before anything had happened.
///
/// # Errors
/// It cannot be read, or taken away.
pub fn is_begun(path: &Path) -> io::Result<bool> {
    match input::read(path, input::LONGEST_DOCUMENT) {
        Err(why) if why.kind() == io::ErrorKind::NotFound => Ok(false),
        Err(why) => Err(why),
        Ok(text) if text.contains(&b'\n') => Ok(true),
        Ok(_) => std::fs::remove_file(path).map(|()| false),
    }
}

/// What a journal holds.
#[derive(Clone, PartialEq, Debug)]
pub struct Kept {
    /// Who began it.
    pub head: Head,
    /// Everything, the head's entry included.
    pub entries: Vec<Entry>,
    /// Bytes of whole lines.
    pub whole: usize,
    /// Sum over them.
    pub sum: String,
}

/// Reads the journal at `path` and takes what was cut off from it.
///
/// # Errors
/// It cannot be read, is of a later format, or damaged.
pub fn read(path: &Path) -> Result<Kept, CalibrationError> {
    let unusable = |why: String| CalibrationError::NotResumable(path.to_owned(), why);
    let text = input::read(path, input::LONGEST_DOCUMENT).map_err(|why| {
        unusable(match why.kind() {
            io::ErrorKind::NotFound => {
                "there is no journal; without --resume it begins anew".to_owned()
            }
            _ => why.to_string(),
        })
    })?;
    if !text.contains(&b'\n') {
        let why = "nothing was recorded in it; begin anew without --resume";
        return Err(unusable(why.to_owned()));
    }
    let kept = kept(path, &text)?;
    if kept.head.format > FORMAT {
        return Err(unusable(format!(
            "its format is {}, and this flexor knows {FORMAT}: use a later one",
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

/// What the bytes of the journal at `path` hold; what was cut off does not count.
///
/// # Errors
/// They are damaged: where, and why.
pub fn kept(path: &Path, text: &[u8]) -> Result<Kept, CalibrationError> {
    let damaged = |line: usize, why: &str| {
        CalibrationError::Damaged(path.to_owned(), line, crate::session::visible(why))
    };
    let (mut entries, mut whole, mut sum) = (Vec::new(), 0, String::new());
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
                &format!("it is line {} of what was written", read.n),
            ));
        }
        let text = String::from_utf8_lossy(line); // JSON that was read is UTF-8
        sum = chained(&sum, text.rsplit_once(SUM).map_or("", |(told, _)| told));
        if read.sum != sum {
            return Err(damaged(number, "it was changed since it was written"));
        }
        entries.push(read.entry);
        whole += line.len();
    }
    let Some(Entry::Begun(head)) = entries.first().cloned() else {
        return Err(damaged(1, "it does not say whose it is"));
    };
    Ok(Kept {
        head,
        entries,
        whole,
        sum,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn text(lines: usize) -> String {
        let entries = [
            Entry::Begun(Head::of("K05", "a plan")),
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
            let (text, sum) = line.written(&before).unwrap();
            before = sum;
            text
        };
        entries.iter().enumerate().take(lines).map(line).collect()
    }

    #[test]
    fn what_was_cut_off_does_not_count_and_what_was_changed_is_damage() {
        let path = Path::new("x.journal");
        let whole = text(3);
        let read = kept(path, whole.as_bytes()).unwrap();
        assert_eq!(read.entries.len(), 3);
        assert_eq!(read.head.wearer, "K05");
        for end in text(2).len()..whole.len() {
            let kept = kept(path, &whole.as_bytes()[..end]).unwrap();
            assert_eq!(
                (kept.entries.len(), kept.whole),
                (2, text(2).len()),
                "{end}"
            );
        }
        let told = |text: &str| kept(path, text.as_bytes()).unwrap_err().to_string();
        assert!(told(&whole.replace("\"n\":2", "\"n\":9")).contains("line 2: it is line 9"));
        let line = text(2);
        let second = line.lines().nth(1).unwrap();
        let missing = whole.replace(&format!("{second}\n"), "");
        assert!(told(&missing).contains("line 2: it is line 3"));
        assert!(
            told(&whole.replace("threshold", "thr"))
                .starts_with("E674 the journal x.journal, line 3")
        );
        assert!(told("").contains("does not say whose"));
        for (line, was, is) in [(1, "K05", "K06"), (2, "3}", "4}"), (3, "7.5", "24.0")] {
            let changed = whole.replace(was, is);
            assert_ne!(changed, whole, "{was}");
            let wanted = format!("line {line}: it was changed since it was written");
            assert!(told(&changed).contains(&wanted), "{}", told(&changed));
        }
    }
}
