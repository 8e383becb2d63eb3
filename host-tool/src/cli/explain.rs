//! `flexor explain`: explains an error number from the table of all numbers.

use super::{Output, usage_error};
use clap::Args;
use serde::Deserialize;

/// Print what an error number means, an example and the remedy
#[derive(Args, Debug)]
pub struct Explain {
    /// Number as it is printed, such as E407
    number: String,
}

/// Every error number of the program; `docs/reference/errors.md` is generated from it.
const TABLE: &str = include_str!("errors.toml");

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Table {
    error: Vec<Entry>,
}

/// Table entry of one error number.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Entry {
    number: u16,
    /// Title of at most nine words.
    title: String,
    /// Description of what happened and when it happens.
    meaning: String,
    /// Advice on what the user does next.
    remedy: String,
    /// Example of a line as the program prints it.
    example: String,
}

/// # Errors
/// E518: there is no such number.
pub fn main(args: &Explain, output: Output) -> anyhow::Result<()> {
    let table = table()?;
    let number = args.number.trim_start_matches(['E', 'e']).parse::<u16>();
    let found = number.ok().and_then(|number| {
        let mut entries = table.iter();
        entries.find(|entry| entry.number == number)
    });
    let Some(entry) = found else {
        return usage_error(format!(
            "{} is not an error number; the numbers are E{} to E{}, listed in docs/reference/errors.md",
            args.number,
            table.first().map_or(0, |entry| entry.number),
            table.last().map_or(0, |entry| entry.number),
        ));
    };
    output.print(
        || {
            let Entry {
                number,
                title,
                meaning,
                remedy,
                example,
            } = entry;
            format!(
                "E{number}: {title}\n\n{}\n\nWhat to do: {}\n\nExample:\n  {example}",
                wrapped(meaning),
                wrapped(remedy)
            )
        },
        || {
            serde_json::json!({
                "number": entry.number, "title": entry.title, "meaning": entry.meaning,
                "remedy": entry.remedy, "example": entry.example, "error": null,
            })
        },
    )
}

fn table() -> anyhow::Result<Vec<Entry>> {
    Ok(toml::from_str::<Table>(TABLE)?.error)
}

/// Wraps `text` at spaces into lines of at most 80 characters.
fn wrapped(text: &str) -> String {
    let mut lines = vec![String::new()];
    for word in text.split_whitespace() {
        let line = lines.last().map_or(0, |line| line.chars().count());
        if line > 0 && line + 1 + word.chars().count() > 80 {
            lines.push(String::new());
        }
        if let Some(line) = lines.last_mut() {
            if !line.is_empty() {
                line.push(' ');
            }
            line.push_str(word);
        }
    }
    lines.join("\n")
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;
    use std::path::{Path, PathBuf};

    /// Collects the Rust files of the program and its libraries, without tests.
    fn sources(folder: &Path, files: &mut Vec<PathBuf>) {
        for entry in std::fs::read_dir(folder).unwrap().flatten() {
            let path = entry.path();
            if path.is_dir() && !path.ends_with("tests") && !path.ends_with("target") {
                sources(&path, files);
            } else if path.extension().is_some_and(|extension| extension == "rs") {
                files.push(path);
            }
        }
    }

    /// Returns every error number in `text` that is written like E407.
    fn numbers(text: &str) -> impl Iterator<Item = u16> {
        text.match_indices('E').filter_map(|(at, _)| {
            let digits = text.get(at + 1..at + 4)?;
            let is_word = text[..at].ends_with(|c: char| c.is_alphanumeric() || c == '_');
            let is_longer = text[at + 4..].starts_with(|c: char| c.is_alphanumeric());
            let is_number = digits.bytes().all(|byte| byte.is_ascii_digit());
            (is_number && !is_word && !is_longer)
                .then(|| digits.parse().ok())
                .flatten()
        })
    }

    #[test]
    fn numbers_rise_and_every_entry_is_complete() {
        let table = table().unwrap();
        assert!(table.windows(2).all(|pair| pair[0].number < pair[1].number));
        for entry in &table {
            let number = entry.number;
            let words = entry.title.split_whitespace().count();
            assert!((1..=9).contains(&words), "E{number}: {}", entry.title);
            for sentence in [&entry.meaning, &entry.remedy] {
                assert!(sentence.ends_with('.') && sentence.len() >= 10, "E{number}");
            }
            assert!(
                entry.example.starts_with(&format!("E{number}")),
                "E{number}"
            );
        }
    }

    /// Every number that the code prints must be in the table, and every number in the table must
    /// be printed. The numbers of files and of the device are listed by name; the others stand in
    /// messages.
    #[test]
    fn the_table_has_the_numbers_of_the_code() {
        let root = Path::new(env!("CARGO_MANIFEST_DIR"));
        let mut files = Vec::new();
        for folder in [
            "src",
            "core/src",
            "studies/src",
            "web/src",
            "../tests/src/bin",
            "../hal-sim/src",
        ] {
            sources(&root.join(folder), &mut files);
        }
        let mut used = BTreeSet::new();
        for file in files.iter().filter(|file| !file.ends_with("explain.rs")) {
            used.extend(numbers(&std::fs::read_to_string(file).unwrap()));
        }
        used.extend(host_core::session::Problem::NUMBERS);
        used.extend(firmware::link::Code::ALL.map(|code| code as u16));
        let table: BTreeSet<_> = table().unwrap().iter().map(|entry| entry.number).collect();
        let missing: Vec<_> = used.difference(&table).collect();
        let unused: Vec<_> = table.difference(&used).collect();
        assert!(missing.is_empty(), "not in the table: {missing:?}");
        assert!(unused.is_empty(), "in no message: {unused:?}");
    }

    #[test]
    fn the_document_is_generated_from_the_table() {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/reference/errors.md");
        let mut text = "# Errors\n\n\
             Every error of the program has a number; `flexor explain E407` prints the entry of\n\
             one. Generated from `host-tool/src/cli/errors.toml`: do not edit.\n\n\
             | number | error | meaning | what to do |\n|---|---|---|---|\n"
            .to_owned();
        for entry in table().unwrap() {
            let cells = [&entry.title, &entry.meaning, &entry.remedy];
            let [title, meaning, remedy] = cells.map(|cell| cell.replace('|', "\\|"));
            text += &format!("| E{} | {title} | {meaning} | {remedy} |\n", entry.number);
        }
        if std::env::var_os("FLEXOR_OVERWRITE").is_some() {
            std::fs::write(&path, &text).unwrap();
        }
        assert_eq!(std::fs::read_to_string(&path).unwrap_or_default(), text);
    }

    #[test]
    fn text_is_wrapped_at_spaces() {
        let text = wrapped(&"word ".repeat(40));
        assert!(text.lines().all(|line| line.len() <= 80));
        assert_eq!(text.split_whitespace().count(), 40);
    }
}
