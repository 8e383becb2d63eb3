//! `flexor list`: the sessions, wearers, searches and studies of the program, by name.

use super::Output;
use clap::Args;
use host_core::session::{SHIPPED as SESSIONS, Session, visible};
use host_core::wearer::{SHIPPED as WEARERS, Wearer};
use serde_json::{Value, json};
use studies::laboratory::search::SHIPPED as SEARCHES;
use studies::{catalog, experiments, faults, limb};

/// List the shipped sessions, wearers, searches and studies; each is found by its name from
/// any folder, and copied out by flexor new FILE --from NAME
#[derive(Args, Debug)]
pub struct List {}

/// # Errors
/// The standard output cannot be written.
pub fn main(_: &List, output: Output) -> anyhow::Result<()> {
    let groups = groups();
    output.say(|| people(&groups), || machines(&groups))
}

/// Heading, key for machines, the command that takes a name, and names with what they are.
type Group = (
    &'static str,
    &'static str,
    &'static str,
    Vec<(String, String)>,
);

fn groups() -> [Group; 4] {
    let titled = |name: &str, text: &str| {
        let title = Session::parse(name, text).map(|it| visible(&it.title));
        (name.to_owned(), title.unwrap_or_default())
    };
    let sessions = SESSIONS.iter().map(|(name, text)| titled(name, text));
    let wearers = WEARERS.iter().map(|(file, text)| {
        let name = file.trim_end_matches(".toml");
        let what = Wearer::parse(file, text).map(|it| {
            let count = it.electrodes.len();
            let s = if count == 1 { "" } else { "s" };
            format!("{}, {count} electrode{s}", it.evidence.word())
        });
        (name.to_owned(), what.unwrap_or_default())
    });
    let searches = SEARCHES.iter().map(|(name, text)| {
        let comment = text.lines().find_map(|line| line.strip_prefix("# "));
        ((*name).to_owned(), comment.unwrap_or_default().to_owned())
    });
    let drawn = catalog::named().map(|(name, what)| (name.to_owned(), what.to_owned()));
    let mut studies: Vec<(String, String)> = drawn.collect();
    for name in experiments::names() {
        if studies.iter().all(|(known, _)| known != name) {
            let title = experiments::named(name).map(|it| it.declaration.title);
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

fn people(groups: &[Group]) -> String {
    let mut text = String::new();
    for (heading, _, command, names) in groups {
        text += &format!("{heading} ({command})\n");
        for (name, what) in names {
            text += &format!("  {}\n", shortened(&format!("{name:<22} {what}"), 78));
        }
        text += "\n";
    }
    text + "Copy one out: flexor new FILE --from NAME"
}

/// A line of at most so many characters.
fn shortened(line: &str, most: usize) -> String {
    match line.chars().count() > most {
        true => line.chars().take(most - 1).chain(['…']).collect(),
        false => line.to_owned(),
    }
}

fn machines(groups: &[Group]) -> Value {
    let mut all = json!({});
    for (_, key, _, names) in groups {
        let names = names.iter();
        all[*key] = names
            .map(|(name, what)| json!({ "name": name, "what": what }))
            .collect();
    }
    all
}

/// The text of the shipped session, wearer, search or declaration of this name, and the
/// command that uses it, where FILE stands for a copy's path. A study that is more than its
/// declaration reads its own, not a copy.
pub(super) fn shipped(name: &str) -> Option<(&'static str, &'static str)> {
    type Files = &'static [(&'static str, &'static str)];
    if let Some(name) = name.strip_prefix("faults/") {
        return named(&faults::FILES, name).map(|text| (text, "flexor faults"));
    }
    let kinds: [(Files, &str); 5] = [
        (SESSIONS, "flexor run FILE"),
        (&WEARERS, "flexor check FILE"),
        (SEARCHES, "flexor search FILE"),
        (&experiments::DECLARATIONS, "flexor experiment FILE"),
        (
            &[("recruitments.toml", limb::DECLARED)],
            "flexor chart limb",
        ),
    ];
    let studies = catalog::ENTRIES.iter();
    let studies = studies.map(|entry| (entry.declarations, entry.command));
    let mut kinds = kinds.into_iter().chain(studies);
    kinds.find_map(|(files, command)| Some((named(files, name)?, command)))
}

/// The text of the file of this name.
fn named(files: &[(&str, &'static str)], name: &str) -> Option<&'static str> {
    let is = |file: &str| file.trim_end_matches(".toml") == name;
    let found = files.iter().find(|(file, _)| is(file));
    found.map(|(_, text)| *text)
}
