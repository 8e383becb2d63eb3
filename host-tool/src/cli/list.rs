//! `flexor list`: lists the sessions, wearers, searches and studies of the program by name.

use super::Output;
use clap::Args;
use host_core::search::SHIPPED as SEARCHES;
use host_core::session::{SHIPPED as SESSIONS, Session, escape_control_chars};
use host_core::suggestion;
use host_core::wearer::{SHIPPED as WEARERS, Wearer};
use serde_json::{Value, json};
use studies::{catalog, experiments, faults, limb};

/// List the shipped sessions, wearers, searches and studies
///
/// A name works from any folder; flexor new FILE --from NAME copies the file.
#[derive(Args, Debug)]
pub struct List {}

/// # Errors
/// Fails if the standard output cannot be written.
pub fn main(_: &List, output: Output) -> anyhow::Result<()> {
    let groups = groups();
    output.print(|| text_report(&groups), || json_report(&groups))
}

/// Heading, key in the JSON output, command that takes a name, and names with descriptions.
type Group = (
    &'static str,
    &'static str,
    &'static str,
    Vec<(String, String)>,
);

fn groups() -> [Group; 4] {
    let titled = |name: &str, text: &str| {
        let title = Session::parse(name, text).map(|session| escape_control_chars(&session.title));
        (name.to_owned(), title.unwrap_or_default())
    };
    let sessions = SESSIONS.iter().map(|(name, text)| titled(name, text));
    let wearers = WEARERS.iter().map(|(file, text)| {
        let name = file.trim_end_matches(".toml");
        let summary = Wearer::parse(file, text).map(|wearer| {
            let count = wearer.electrodes.len();
            let s = if count == 1 { "" } else { "s" };
            format!("{}, {count} electrode{s}", wearer.evidence.word())
        });
        (name.to_owned(), summary.unwrap_or_default())
    });
    let searches = SEARCHES.iter().map(|(name, text)| {
        let comment = text.lines().find_map(|line| line.strip_prefix("# "));
        ((*name).to_owned(), comment.unwrap_or_default().to_owned())
    });
    let drawn = catalog::names_and_titles()
        .map(|(name, description)| (name.to_owned(), description.to_owned()));
    let mut studies: Vec<(String, String)> = drawn.collect();
    for name in experiments::names() {
        if studies.iter().all(|(known, _)| known != name) {
            let title =
                experiments::load_experiment(name).map(|experiment| experiment.declaration.title);
            studies.push((name.to_owned(), title.unwrap_or_default()));
        }
    }
    studies.sort();
    [
        (
            "Sessions",
            "sessions",
            "flexor run NAME",
            sessions.collect(),
        ),
        (
            "Wearers",
            "wearers",
            "flexor experiment STUDY --wearer NAME",
            wearers.collect(),
        ),
        (
            "Searches",
            "searches",
            "flexor search NAME",
            searches.collect(),
        ),
        ("Studies", "studies", "flexor experiment NAME", studies),
    ]
}

fn text_report(groups: &[Group]) -> String {
    let mut text = String::new();
    for (heading, _, command, names) in groups {
        text += &format!("{heading} ({command})\n");
        for (name, description) in names {
            text += &format!("  {}\n", truncate(&format!("{name:<22} {description}"), 78));
        }
        text += "\n";
    }
    text + "To copy one: flexor new FILE --from NAME"
}

/// Shortens a line to at most `most` characters.
fn truncate(line: &str, most: usize) -> String {
    match line.chars().count() > most {
        true => line.chars().take(most - 1).chain(['…']).collect(),
        false => line.to_owned(),
    }
}

fn json_report(groups: &[Group]) -> Value {
    let mut listing = json!({});
    for (_, key, _, names) in groups {
        let names = names.iter();
        listing[*key] = names
            .map(|(name, description)| json!({ "name": name, "what": description }))
            .collect();
    }
    listing
}

/// A file built into the program.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shipped {
    /// Kind of file, as `flexor list --json` calls it.
    pub kind: &'static str,
    pub text: &'static str,
    /// Command that uses the file; FILE stands for the path of a copy. A command without FILE
    /// belongs to a study that reads its own declaration and never a copy.
    pub command: &'static str,
}

/// Returns the shipped session, wearer, search and declaration of this name; several kinds may have
/// the same name. `KIND/NAME` selects one kind.
pub(super) fn find_shipped(name: &str) -> Vec<Shipped> {
    let entries = all_shipped();
    let of_name = |wanted: &str| -> Vec<Shipped> {
        let same = entries.iter().filter(|(name, _)| name == wanted);
        same.map(|(_, shipped)| *shipped).collect()
    };
    match name.split_once('/') {
        Some((kind, rest)) if entries.iter().any(|(_, shipped)| shipped.kind == kind) => {
            let mut of_kind = of_name(rest);
            of_kind.retain(|shipped| shipped.kind == kind);
            of_kind
        }
        _ => of_name(name),
    }
}

/// Asks about the name of a shipped file that is most similar to a misspelt name.
pub(super) fn did_you_mean(typed: &str) -> String {
    let entries = all_shipped();
    suggestion::did_you_mean(typed, entries.iter().map(|(name, _)| name.as_str()))
}

/// Returns every shipped file with its name, in the order of `flexor list`. A study is found by the
/// file name of its declaration; each other name of the study stands for its first declaration.
fn all_shipped() -> Vec<(String, Shipped)> {
    type Files = &'static [(&'static str, &'static str)];
    let kinds: [(&str, Files, &str); 5] = [
        ("sessions", SESSIONS, "flexor run FILE"),
        ("wearers", &WEARERS, "flexor check FILE"),
        ("searches", SEARCHES, "flexor search FILE"),
        (
            "studies",
            &experiments::DECLARATIONS,
            "flexor experiment FILE",
        ),
        (
            "studies",
            &[("recruitments.toml", limb::DECLARED)],
            "flexor chart limb",
        ),
    ];
    let studies = catalog::ENTRIES.iter();
    let studies = studies.map(|entry| ("studies", entry.declarations, entry.command));
    let mut entries: Vec<(String, Shipped)> = Vec::new();
    for (kind, files, command) in kinds.into_iter().chain(studies) {
        for (file, text) in files {
            let name = file.trim_end_matches(".toml").to_owned();
            entries.push((
                name,
                Shipped {
                    kind,
                    text,
                    command,
                },
            ));
        }
    }
    for (file, text) in &faults::FILES {
        let name = format!("faults/{}", file.trim_end_matches(".toml"));
        let (kind, command) = ("studies", "flexor faults");
        entries.push((
            name,
            Shipped {
                kind,
                text,
                command,
            },
        ));
    }
    for entry in &catalog::ENTRIES {
        let Some((_, text)) = entry.declarations.first() else {
            continue;
        };
        for (name, _) in entry.names {
            let (kind, command) = ("studies", entry.command);
            entries.push((
                (*name).to_owned(),
                Shipped {
                    kind,
                    text,
                    command,
                },
            ));
        }
    }
    // Several studies may share a file, and a study may have the name of its file.
    let mut seen = std::collections::BTreeSet::new();
    entries.retain(|(name, shipped)| seen.insert((name.clone(), shipped.kind)));
    entries
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_name_that_is_listed_can_be_copied() {
        for (_, kind, _, names) in groups() {
            for (name, _) in names {
                let found = find_shipped(&format!("{kind}/{name}"));
                assert_eq!(found.len(), 1, "{kind}/{name}");
                assert!(
                    find_shipped(&name).iter().any(|found| found.kind == kind),
                    "{name}"
                );
            }
        }
    }

    #[test]
    fn a_name_of_two_kinds_finds_both() {
        let kinds = find_shipped("distributed")
            .into_iter()
            .map(|found| found.kind);
        assert_eq!(kinds.collect::<Vec<_>>(), ["sessions", "studies"]);
        assert!(find_shipped("harris_wall/1_pre_wall").len() == 1);
        assert!(find_shipped("wearers/distributed").is_empty());
    }
}
