//! Rules for every error of host program and simulators: a number has one meaning, and a cause is
//! printed once.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Returns every source file of the host program and the simulators, with its text.
fn sources() -> Vec<(PathBuf, String)> {
    let package = Path::new(env!("CARGO_MANIFEST_DIR"));
    let rooms = ["src", "core/src", "studies/src", "../hal-sim/src"];
    let mut folders = rooms.map(|room| package.join(room)).to_vec();
    let mut sources = Vec::new();
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|e| e == "rs") {
                sources.push((path.clone(), std::fs::read_to_string(path).unwrap()));
            }
        }
    }
    sources
}

/// Returns the code without its test module, which may contain any number.
fn product(text: &str) -> &str {
    text.split("\n#[cfg(test)]").next().unwrap_or_default()
}

/// Returns the string literal that begins with the quote at `start`, without its line breaks and
/// indents.
fn literal(text: &str, start: usize) -> String {
    let mut escaped = false;
    let inside = text[start + 1..].chars().take_while(|&c| {
        let ends = c == '"' && !escaped;
        escaped = c == '\\' && !escaped;
        !ends
    });
    let raw: String = inside.collect();
    raw.split("\\\n").map(str::trim_start).collect()
}

/// Numbers with one meaning but several wordings.
const IN_SEVERAL_WORDINGS: [(&str, &str); 1] = [("E580", "a signal came")];

#[test]
fn every_number_has_one_meaning() {
    let mut meanings = BTreeMap::<String, Vec<(String, PathBuf)>>::new();
    for (path, text) in sources() {
        let text = product(&text);
        for (start, _) in text.match_indices("\"E5") {
            let message = literal(text, start);
            let (number, words) = message.split_at_checked(4).unwrap();
            if !words.starts_with(' ') {
                continue; // a number alone is not a message
            }
            let found = meanings.entry(number.to_owned()).or_default();
            if !found.iter().any(|(known, _)| known == words) {
                found.push((words.to_owned(), path.clone()));
            }
        }
    }
    assert!(meanings.len() > 40, "{} numbers found", meanings.len());
    for (number, meaning) in IN_SEVERAL_WORDINGS {
        let wordings = meanings.remove(number).unwrap_or_default();
        assert!(
            wordings.len() > 1,
            "{number} ({meaning}) needs no exception"
        );
    }
    let torn: Vec<_> = meanings.iter().filter(|(_, m)| m.len() > 1).collect();
    assert!(torn.is_empty(), "numbers with two meanings: {torn:#?}");
}

/// anyhow prints a chain of causes, so that a message that contains its cause must not also link to
/// it.
#[test]
fn a_cause_is_told_once() {
    let (mut linked, mut twice) = (0, Vec::new());
    for (path, text) in sources() {
        let errors: Vec<_> = product(&text).split("#[error(").skip(1).collect();
        for error in errors {
            // From the message to the end of its variant or type.
            let end = ["\n    },\n", "),\n    ///", "),\n}", "\n}\n"]
                .iter()
                .filter_map(|end| error.find(end))
                .min();
            let error = &error[..end.unwrap_or(error.len())];
            let (message, fields) = error.split_once(")]").unwrap_or((error, ""));
            let is_linked = ["#[from]", "#[source]", " source:"]
                .iter()
                .any(|link| fields.contains(link));
            linked += usize::from(is_linked);
            if is_linked && (message.contains("{0") || message.contains("{source")) {
                twice.push(format!("{}: {}", path.display(), message.trim()));
            }
        }
    }
    assert!(linked > 10, "{linked} causes found");
    assert!(twice.is_empty(), "told twice: {twice:#?}");
}

#[test]
fn a_lost_device_is_told_once() {
    let why = || std::io::Error::other("the cable burns");
    let link = host_core::link::Error::from(why());
    let run = host_core::run::RunError::from(host_core::link::Error::from(why()));
    let unbuilt = || hal_sim::images::BuildError::NoBuilder {
        image: "qemu",
        program: "cargo".to_owned(),
        why: why(),
    };
    let (image, chip) = (unbuilt(), host_core::run::ChipError::from(unbuilt()));
    let qemu = hal_sim::qemu::StartError::NotBuilt(unbuilt());
    let open = host_core::run::OpenError::from(qemu);
    for error in [
        anyhow::Error::from(link),
        run.into(),
        image.into(),
        chip.into(),
        open.into(),
    ] {
        let text = format!("{error:#}");
        assert_eq!(text.matches("the cable burns").count(), 1, "{text}");
    }
}
