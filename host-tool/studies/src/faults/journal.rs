//! The cases of a campaign as they are done, so that what was interrupted goes on.
//!
//! A file of lines of JSON: what is played, then a case each, in their order, with a sum
//! over all up to it. A line that was cut off is dropped.

use super::case::Case;
use super::declaration::Declaration;
use super::error::FaultsError;
use hal_sim::input;
use host_core::record::{Program, sha256};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

/// In the folder of a campaign.
pub const JOURNAL: &str = "faults.jsonl";

/// Which campaign it is: another one does not go on in the same folder.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct Identity {
    /// Which program plays and judges it, with its commit.
    #[serde(default = "untold")]
    pub program: String,
    /// Which class.
    pub class: String,
    /// chip or native.
    pub device: String,
    /// Of what is drawn.
    pub seed: u64,
    /// SHA-256 of what is flashed, on the chip.
    pub image: Option<String>,
    /// SHA-256 of what is declared, by file.
    pub declared: BTreeMap<String, String>,
}

/// Of a journal from before it was kept.
fn untold() -> String {
    "not told".to_owned()
}

impl Identity {
    /// A campaign of `declaration` on `device`.
    #[must_use]
    pub fn of(declaration: &Declaration, device: &str, seed: u64, image: Option<String>) -> Self {
        Self {
            program: Program::this().words(),
            class: declaration.class.to_string(),
            device: device.to_owned(),
            seed,
            image,
            declared: declaration.sha256.clone(),
        }
    }

    /// What of it is another, by name.
    fn differences(&self, other: &Self) -> Vec<String> {
        let mut all = Vec::new();
        let mut differs = |what: &str, here: &str, asked: &str| {
            if here != asked {
                all.push(format!("{what} is {here}, not {asked}"));
            }
        };
        differs("program", &other.program, &self.program);
        differs("class", &other.class, &self.class);
        differs("device", &other.device, &self.device);
        differs("seed", &other.seed.to_string(), &self.seed.to_string());
        if self.image != other.image {
            all.push("the image is another".to_owned());
        }
        let files: Vec<&String> = self.declared.keys().chain(other.declared.keys()).collect();
        let changed = files
            .into_iter()
            .filter(|it| self.declared.get(*it) != other.declared.get(*it));
        let changed: std::collections::BTreeSet<_> = changed.collect();
        all.extend(changed.into_iter().map(|file| format!("{file} is another")));
        all
    }
}

/// A case as a line of the file has it.
#[derive(Serialize, Deserialize)]
struct Line<C> {
    case: C,
    /// Over the sum of the line before and the case.
    sum: String,
}

/// The file, to write in.
#[derive(Debug)]
pub struct Journal {
    path: PathBuf,
    file: File,
    /// Of its last line.
    sum: String,
}

/// What a campaign's folder has once it was published.
const RESULT: &str = "result.json";

/// SHA-256 of `value` as JSON after the sum `before`: a line that is changed, exchanged or
/// taken out shows in its own or in the next.
fn chained(before: &str, value: &impl Serialize) -> Result<String, String> {
    let value = serde_json::to_string(value).map_err(|e| e.to_string())?;
    Ok(sha256(format!("{before}{value}").as_bytes()))
}

impl Journal {
    /// That of `dir`, begun if it is not there, and the cases that it has.
    ///
    /// # Errors
    /// E790: it is another campaign's. E791: it is damaged, or cannot be read or written.
    pub fn open(dir: &Path, identity: &Identity) -> Result<(Self, Vec<Case>), FaultsError> {
        let path = dir.join(JOURNAL);
        let told = |why: String| FaultsError::Journal(path.display().to_string(), why);
        let io = |error: std::io::Error| told(error.to_string());
        input::may_go_on(&path).map_err(io)?;
        let mut options = File::options();
        let options = options.create(true).truncate(false).read(true).write(true);
        let mut file = options.open(&path).map_err(io)?;
        let mut text = input::read_text(&path, input::LONGEST_TABLE).map_err(io)?;
        // What follows the last end of a line was cut off.
        let whole = text.rfind('\n').map_or(0, |at| at + 1);
        text.truncate(whole);
        file.set_len(whole as u64).map_err(io)?;
        file.seek(SeekFrom::End(0)).map_err(io)?;
        let mut journal = Self {
            path: path.clone(),
            file,
            sum: chained("", identity).map_err(told)?,
        };
        let mut lines = text.lines();
        let Some(first) = lines.next() else {
            if dir.join(RESULT).exists() {
                return Err(told(format!("it is empty, and {RESULT} lies beside it")));
            }
            journal.line(identity)?;
            return Ok((journal, Vec::new()));
        };
        let found: Identity = serde_json::from_str(first).map_err(|e| told(e.to_string()))?;
        let differences = identity.differences(&found);
        if !differences.is_empty() {
            let dir = dir.display().to_string();
            return Err(FaultsError::AnotherCampaign(dir, differences.join(", ")));
        }
        let cases = journal.cases(lines).map_err(told)?;
        Ok((journal, cases))
    }

    /// Those of `lines`, or what is wrong with them; the sum goes on to the last.
    fn cases<'a>(&mut self, lines: impl Iterator<Item = &'a str>) -> Result<Vec<Case>, String> {
        let mut cases = Vec::new();
        for (number, line) in (0_u64..).zip(lines) {
            let line = serde_json::from_str(line).map_err(|e| e.to_string())?;
            let Line::<Case> { case, sum } = line;
            if case.index != number {
                let index = case.index;
                return Err(format!("case {index} stands where {number} should"));
            }
            self.sum = chained(&self.sum, &case)?;
            if self.sum != sum {
                return Err(format!("case {number} is not as it was written"));
            }
            cases.push(case);
        }
        Ok(cases)
    }

    /// Adds what was played.
    ///
    /// # Errors
    /// E791.
    pub fn add(&mut self, cases: &[Case]) -> Result<(), FaultsError> {
        for case in cases {
            let sum = chained(&self.sum, case).map_err(|why| self.unusable(why))?;
            self.sum.clone_from(&sum);
            self.line(&Line { case, sum })?;
        }
        Ok(())
    }

    fn unusable(&self, why: String) -> FaultsError {
        FaultsError::Journal(self.path.display().to_string(), why)
    }

    fn line(&mut self, value: &impl Serialize) -> Result<(), FaultsError> {
        let mut line = serde_json::to_vec(value).map_err(|e| self.unusable(e.to_string()))?;
        line.push(b'\n');
        // At once: a line that another write completes could be lost between the two.
        let written = self.file.write_all(&line);
        written.map_err(|e| self.unusable(e.to_string()))
    }
}

#[cfg(test)]
mod tests {
    use super::super::case::Fate;
    use super::super::declaration::Class;
    use super::*;

    fn folder(name: &str) -> PathBuf {
        let dir =
            std::env::temp_dir().join(format!("flexor-journal-{name}-{}", std::process::id()));
        let _ = std::fs::remove_dir_all(&dir);
        std::fs::create_dir_all(&dir).unwrap();
        dir
    }

    fn case(index: u64) -> Case {
        let fate = Fate {
            truncated_uc: vec![0.1 + 0.2],
            fault: Some(firmware::safety::Fault::TapeSlip),
            ..Fate::default()
        };
        let what = "kind: it".to_owned();
        Case {
            index,
            moment_us: 7,
            what,
            fate,
        }
    }

    #[test]
    fn what_was_written_is_read_and_a_line_cut_off_is_dropped() {
        let dir = folder("cut");
        let declaration = Declaration::of(Class::Flips).unwrap();
        let identity = Identity::of(&declaration, "chip", 1, Some("abc".into()));
        let (mut journal, cases) = Journal::open(&dir, &identity).unwrap();
        assert!(cases.is_empty());
        journal.add(&[case(0), case(1)]).unwrap();
        journal.file.write_all(b"{\"index\":2,\"mom").unwrap();
        drop(journal);
        let (mut journal, cases) = Journal::open(&dir, &identity).unwrap();
        assert_eq!(cases, [case(0), case(1)]);
        journal.add(&[case(2)]).unwrap();
        let (_, cases) = Journal::open(&dir, &identity).unwrap();
        assert_eq!(cases, [case(0), case(1), case(2)]);
        std::fs::remove_dir_all(&dir).unwrap();
    }

    #[test]
    fn a_line_that_was_changed_and_an_emptied_file_are_refused() {
        let dir = folder("changed");
        let declaration = Declaration::of(Class::Flips).unwrap();
        let identity = Identity::of(&declaration, "chip", 1, None);
        let (mut journal, _) = Journal::open(&dir, &identity).unwrap();
        journal.add(&[case(0), case(1), case(2)]).unwrap();
        let path = dir.join(JOURNAL);
        let text = std::fs::read_to_string(&path).unwrap();
        let refused = |text: &str, wanted: &str| {
            std::fs::write(&path, text).unwrap();
            let error = Journal::open(&dir, &identity).unwrap_err().to_string();
            assert!(
                error.starts_with("E791 ") && error.contains(wanted),
                "{error}"
            );
        };
        // Of the second case alone.
        let lines: Vec<&str> = text.lines().collect();
        for (was, is) in [
            ("\"found\":false", "\"found\":true"),
            ("\"changed_us\":null", "\"changed_us\":7"),
            ("kind: it", "kind: is"),
            ("\"moment_us\":7", "\"moment_us\":8"),
        ] {
            let second = lines[2].replace(was, is);
            assert_ne!(second, lines[2], "{was}");
            let changed = [lines[0], lines[1], &second, lines[3], ""].join("\n");
            refused(&changed, "case 1 is not as it was written");
        }
        std::fs::write(dir.join(RESULT), "{}").unwrap();
        refused("", "result.json lies beside it");
        std::fs::write(&path, &text).unwrap();
        let (_, cases) = Journal::open(&dir, &identity).unwrap();
        assert_eq!(cases.len(), 3);
        std::fs::remove_dir_all(&dir).unwrap();
    }

    #[test]
    fn another_campaign_is_refused_by_name() {
        let dir = folder("another");
        let declaration = Declaration::of(Class::Flips).unwrap();
        let identity = Identity::of(&declaration, "chip", 1, Some("abc".into()));
        Journal::open(&dir, &identity).unwrap();
        let refused = |other: Identity, wanted: &str| {
            let error = Journal::open(&dir, &other).unwrap_err().to_string();
            assert!(
                error.starts_with("E790 ") && error.contains(wanted),
                "{error}"
            );
        };
        refused(
            Identity {
                seed: 2,
                ..identity.clone()
            },
            "seed is 1, not 2",
        );
        refused(
            Identity {
                program: "of yesterday".into(),
                ..identity.clone()
            },
            "program is 0.1.0",
        );
        refused(
            Identity {
                image: None,
                ..identity.clone()
            },
            "the image is another",
        );
        let registers = Declaration::of(Class::Registers).unwrap();
        let other = Identity::of(&registers, "chip", 1, Some("abc".into()));
        refused(
            other,
            "class is flips, not registers, flips.toml is another",
        );
        std::fs::write(dir.join(JOURNAL), "what\n").unwrap();
        let error = Journal::open(&dir, &identity).unwrap_err().to_string();
        assert!(error.starts_with("E791 "), "{error}");
        std::fs::remove_dir_all(&dir).unwrap();
    }
}
