//! Lists the commands under headings, each with an example and the document that describes it.

#[cfg(test)]
mod documents;

use clap::{Command, CommandFactory};
use std::fmt::Write;

/// Name of a command, an example, and its document.
type Entry = (&'static str, &'static str, &'static str);

/// Example of `flexor muscle`: five constants of the model, a train and a duration.
const MUSCLE: &str = "flexor muscle --a-n-per-s 1000 --k 0.1 --tau-c-ms 20 --tau1-ms 50 \
                      --tau2-ms 60 --frequency-hz 30 --train-s 1 --seconds 2 --csv force.csv";

/// Headings with their commands, the most often needed first.
#[rustfmt::skip]
const GROUPS: [(&str, &[Entry]); 7] = [
    ("Start", &[
        ("demo", "flexor demo", "README.md"),
        ("playground", "flexor playground", "docs/guides/playground.md"),
        ("list", "flexor list", "docs/reference/laboratory.md"),
        ("new", "flexor new my.toml --channels 2 --program on-off", "docs/reference/sessions.md"),
        ("check", "flexor check my.toml", "docs/reference/sessions.md"),
        ("explain", "flexor explain E407", "docs/reference/errors.md"),
    ]),
    ("Stimulate", &[
        ("run", "flexor run my.toml", "docs/reference/record.md"),
        ("monitor", "flexor monitor --session my.toml --seconds 60", "docs/guides/watch.md"),
        ("calibrate", "flexor calibrate --electrodes PLAN.toml --out W01.toml", "docs/guides/calibrate.md"),
        ("search", "flexor search finger", "docs/guides/search.md"),
    ]),
    ("Records", &[
        ("report", "flexor report out/record", "docs/reference/record.md"),
        ("compare", "flexor compare out/first out/second", "docs/reference/record.md"),
        ("rerun", "flexor rerun out/record", "docs/reference/record.md"),
        ("edges", "flexor edges ten_channels --seconds 0.1 --csv edges.csv", "docs/reference/record.md"),
    ]),
    ("Studies", &[
        ("experiment", "flexor experiment hamana-4", "docs/reference/laboratory.md"),
        ("sweep", "flexor sweep harris-wall --draws 20 --out out/walls", "docs/reference/laboratory.md"),
        ("two-points", "flexor two-points --draws 10", "docs/evidence/two_points.md"),
        ("faults", "flexor faults --class flips --draws 100", "docs/evidence/faults.md"),
        ("chart", "flexor chart accuracy", "docs/evidence/methods.md"),
    ]),
    ("Models", &[
        ("muscle", MUSCLE, "docs/how/muscle.md"),
        ("explain-model", "flexor explain-model force_ramp", "docs/how/muscle.md"),
    ]),
    ("Board", &[
        ("devices", "flexor devices", "docs/guides/breadboard.md"),
        ("board", "flexor board show weact", "docs/guides/breadboard.md"),
        ("flash", "flexor flash --board weact --simulated", "docs/guides/breadboard.md"),
        ("image", "flexor image --board weact --hex weact.hex", "docs/guides/breadboard.md"),
        ("hil", "flexor hil ten_channels --plan", "docs/evidence/hil.md"),
        ("serve", "flexor serve --tcp 127.0.0.1:4242", "docs/protocol.md"),
        ("protocol", "flexor protocol --json", "docs/protocol.md"),
        ("stages", "flexor stages --device /dev/ttyACM0", "docs/reference/hardware.md"),
        ("selftest", "flexor selftest", "docs/evidence/hil.md"),
    ]),
    ("Development", &[
        ("bench", "flexor bench", "docs/how/chip.md"),
        ("profile", "flexor profile full_load", "docs/how/chip.md"),
        ("chip", "flexor chip image.elf", "docs/how/chip.md"),
        ("completion", "flexor completion bash", "README.md"),
        ("man", "flexor man man1", "README.md"),
    ]),
];

/// Returns the command line with its commands under headings, and an example and a document below
/// the help of each command.
pub(super) fn command_line() -> Command {
    let mut command = super::Cli::command();
    for (name, example, document) in entries() {
        let more = format!("Example: {example}\nMore: {document}");
        command = command.mut_subcommand(*name, |below| below.after_help(more));
    }
    let list = list(&command);
    command.help_template(format!(
        "{{about-with-newline}}\n{{usage-heading}} {{usage}}\n\n{list}\n\
         flexor help COMMAND describes a command.\n\nOptions:\n{{options}}"
    ))
}

fn entries() -> impl Iterator<Item = &'static Entry> {
    GROUPS.iter().flat_map(|(_, entries)| entries.iter())
}

/// Formats each heading with its commands and their descriptions.
fn list(command: &Command) -> String {
    let mut text = String::new();
    for (heading, entries) in &GROUPS {
        let _ = writeln!(text, "{heading}:");
        for (name, ..) in *entries {
            let about = command.find_subcommand(name).and_then(Command::get_about);
            let about = about.map(ToString::to_string).unwrap_or_default();
            let _ = writeln!(text, "  {name:<14} {about}");
        }
        text.push('\n');
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;
    use std::path::Path;

    /// Largest number of characters in a line of the list.
    const WIDTH: usize = 80;

    #[test]
    fn every_command_stands_under_one_heading() {
        let listed: Vec<_> = entries().map(|(name, ..)| *name).collect();
        let unique: BTreeSet<_> = listed.iter().copied().collect();
        assert_eq!(listed.len(), unique.len());
        let command = command_line();
        let known = command.get_subcommands().map(Command::get_name);
        assert_eq!(known.collect::<BTreeSet<_>>(), unique);
    }

    #[test]
    fn the_list_fits_a_terminal() {
        let help = command_line().render_help().to_string();
        for line in help.lines() {
            assert!(line.chars().count() <= WIDTH, "{line}");
        }
    }

    #[test]
    fn every_example_is_read_and_every_document_is_there() {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
        for (name, example, document) in entries() {
            let read = command_line().try_get_matches_from(example.split(' '));
            let read = read.unwrap_or_else(|error| panic!("{example}: {error}"));
            assert_eq!(read.subcommand_name(), Some(*name), "{example}");
            assert!(root.join(document).is_file(), "{document}");
        }
    }
}
