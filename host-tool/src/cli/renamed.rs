//! Former names of options and charts: they still work, with a note.
//!
//! In: the arguments as typed. Out: the arguments with today's names, and one note for each
//! former name.

use super::wearer_args::PARTICIPANTS;
use std::ffi::OsString;

/// Former and present name of an option, and what happens to its value.
struct RenamedOption {
    /// Commands that have the option.
    commands: &'static [&'static str],
    /// Former name.
    old: &'static str,
    /// Present name.
    new: &'static str,
    /// Change that the value of the option needs.
    value: ValueRule,
}

/// Change of the value of a renamed option.
#[derive(Clone, Copy)]
enum ValueRule {
    /// The option has no value, or the same one.
    Same,
    /// The value was in minutes and is in seconds.
    MinutesToSeconds,
    /// Only the letters of Hamana's participants moved to the new option.
    Participants,
}

const RENAMED: [RenamedOption; 7] = [
    renamed(&["faults"], "--count", "--draws", ValueRule::Same),
    renamed(&["muscle"], "--duration-s", "--seconds", ValueRule::Same),
    renamed(&["calibrate"], "--wearer", "--pseudonym", ValueRule::Same),
    renamed(&["selftest"], "--bench", "--bench-test", ValueRule::Same),
    renamed(
        &["selftest"],
        "--minutes",
        "--seconds",
        ValueRule::MinutesToSeconds,
    ),
    renamed(
        &["experiment", "sweep"],
        "--departure",
        "--ablation",
        ValueRule::Same,
    ),
    renamed(
        &["experiment", "sweep", "chart"],
        "--wearer",
        "--participant",
        ValueRule::Participants,
    ),
];

const fn renamed(
    commands: &'static [&'static str],
    old: &'static str,
    new: &'static str,
    value: ValueRule,
) -> RenamedOption {
    RenamedOption {
        commands,
        old,
        new,
        value,
    }
}

/// Former and present name of a chart.
const CHART: (&str, &str) = ("ladder", "model-selection");

/// Replaces former names in `typed`, the arguments with the program's name before them. Arguments
/// after `--` and arguments that are not UTF-8 stay as they are. Returns the arguments, and a note
/// for each replaced name.
pub fn translate(typed: impl IntoIterator<Item = OsString>) -> (Vec<OsString>, Vec<String>) {
    let mut arguments: Vec<OsString> = typed.into_iter().collect();
    let mut notes = Vec::new();
    let is_word = |text: &OsString| text.to_str().is_some_and(|text| !text.starts_with('-'));
    let Some(at) = (1..arguments.len()).find(|&n| is_word(&arguments[n])) else {
        return (arguments, notes);
    };
    let command = arguments[at].to_string_lossy().into_owned();
    let is_chart = |text: &OsString| text == CHART.0;
    if command == "chart" && arguments.get(at + 1).is_some_and(is_chart) {
        arguments[at + 1] = CHART.1.into();
        notes.push(note(
            &format!("chart {}", CHART.0),
            &format!("chart {}", CHART.1),
        ));
    }
    for n in at + 1..arguments.len() {
        let Some(text) = arguments[n].to_str().map(str::to_owned) else {
            continue;
        };
        if text == "--" {
            break;
        }
        let (name, joined) = match text.split_once('=') {
            Some((name, value)) => (name, Some(value.to_owned())),
            None => (&*text, None),
        };
        let following = arguments.get(n + 1).and_then(|value| value.to_str());
        let value = joined.as_deref().or(following).unwrap_or_default();
        let Some((option, value)) = RENAMED
            .iter()
            .filter(|option| option.old == name && option.commands.contains(&&*command))
            .find_map(|option| Some((option, option.value.apply(value)?)))
        else {
            continue;
        };
        if joined.is_some() {
            arguments[n] = format!("{}={value}", option.new).into();
        } else {
            if !matches!(option.value, ValueRule::Same) {
                arguments[n + 1] = value.into();
            }
            arguments[n] = option.new.into();
        }
        notes.push(note(option.old, option.new));
    }
    (arguments, notes)
}

impl ValueRule {
    /// Returns the value for the new option; `None` if the old option keeps it.
    fn apply(self, value: &str) -> Option<String> {
        match self {
            Self::Same => Some(value.to_owned()),
            Self::MinutesToSeconds => {
                let minutes: u64 = value.parse().ok()?;
                Some(minutes.checked_mul(60)?.to_string())
            }
            Self::Participants => PARTICIPANTS.contains(&value).then(|| value.to_owned()),
        }
    }
}

fn note(old: &str, new: &str) -> String {
    format!("note: `{old}` is now `{new}`; the old name still works")
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the translation of a command line, and the number of notes.
    fn translated(line: &str) -> (String, usize) {
        let (arguments, notes) = translate(line.split(' ').map(OsString::from));
        let words: Vec<_> = arguments
            .iter()
            .map(|word| word.to_str().unwrap())
            .collect();
        (words.join(" "), notes.len())
    }

    #[test]
    fn former_names_become_present_ones() {
        for (old, new) in [
            (
                "faults --count 5 --class all",
                "faults --draws 5 --class all",
            ),
            ("--json faults --count=5", "--json faults --draws=5"),
            ("muscle --duration-s 2", "muscle --seconds 2"),
            ("calibrate --wearer hana", "calibrate --pseudonym hana"),
            (
                "selftest --bench --minutes 3",
                "selftest --bench-test --seconds 180",
            ),
            ("selftest --minutes=2", "selftest --seconds=120"),
            (
                "sweep hamana-1 --departure found",
                "sweep hamana-1 --ablation found",
            ),
            (
                "experiment hamana-1 --wearer P",
                "experiment hamana-1 --participant P",
            ),
            (
                "chart control --wearer=all",
                "chart control --participant=all",
            ),
            (
                "chart ladder --workspace .",
                "chart model-selection --workspace .",
            ),
        ] {
            let (line, notes) = translated(&format!("flexor {old}"));
            assert_eq!(line, format!("flexor {new}"));
            assert!(notes > 0, "{old}");
        }
    }

    #[test]
    fn everything_else_stays() {
        for line in [
            "flexor",
            "flexor --help",
            "flexor experiment hamana-1 --wearer own.toml",
            "flexor new s.toml --wearer P",
            "flexor selftest --minutes many",
            "flexor muscle --count 3",
            "flexor faults -- --count",
            "flexor list ladder",
        ] {
            assert_eq!(translated(line), (line.to_owned(), 0));
        }
    }
}
