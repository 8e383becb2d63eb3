//! Command line of `cargo verify`.

use std::time::Duration;

/// Help text.
pub(super) const USAGE: &str = "\
usage: cargo verify [STEP...]         all steps, or only these steps
       cargo verify quick             rules, format, lints, changed unit tests
       cargo verify stalled           tests over real ports on a busy computer
       cargo verify cluster           studies as Slurm job arrays, as root
       cargo verify release           wheels, archives for Linux and Windows, images, sums
       cargo verify --soak MINUTES    property tests on fresh seeds, 1 to 10080
       cargo verify --soak-seed SEED  one round of these tests on this seed";

/// A week; a longer time is probably a typing error.
const LONGEST_MINUTES: u64 = 7 * 24 * 60;

#[derive(Clone, PartialEq, Eq, Debug)]
pub(super) enum VerifyMode {
    /// Steps by name; all steps if empty.
    Steps(Vec<String>),
    /// Rounds of the property tests on fresh seeds, for this time.
    Soak(Duration),
    /// One round of the property tests on this seed.
    SoakSeed(u64),
    Help,
}

/// Parses `arguments`, with `steps` to choose from. Returns an explanation if they are invalid.
pub(super) fn parse(arguments: &[String], steps: &[&str]) -> Result<VerifyMode, String> {
    let words: Vec<&str> = arguments.iter().map(String::as_str).collect();
    match words[..] {
        ["-h" | "--help", ..] => Ok(VerifyMode::Help),
        ["--soak", minutes] => parse_soak(minutes),
        ["--soak-seed", seed] => {
            let wrong = |_| format!("--soak-seed `{seed}`: not a number from 0 to {}", u64::MAX);
            seed.parse().map(VerifyMode::SoakSeed).map_err(wrong)
        }
        [option @ ("--soak" | "--soak-seed")] => Err(format!("{option}: a number is missing")),
        [option @ ("--soak" | "--soak-seed"), _, ..] => Err(format!(
            "{option} takes one number and cannot be combined with other arguments"
        )),
        _ => parse_steps(arguments, steps),
    }
}

fn parse_soak(minutes: &str) -> Result<VerifyMode, String> {
    match minutes.parse::<u64>() {
        Ok(count) if (1..=LONGEST_MINUTES).contains(&count) => {
            Ok(VerifyMode::Soak(Duration::from_secs(60 * count)))
        }
        _ => Err(format!(
            "--soak `{minutes}`: not a whole number of minutes from 1 to {LONGEST_MINUTES}"
        )),
    }
}

fn parse_steps(arguments: &[String], steps: &[&str]) -> Result<VerifyMode, String> {
    let mut words = arguments.iter();
    match words.find(|word| !steps.contains(&word.as_str())) {
        None => Ok(VerifyMode::Steps(arguments.to_vec())),
        Some(option) if option.starts_with('-') => Err(format!(
            "there is no option `{option}`, or it cannot be combined with steps"
        )),
        Some(unknown) => Err(format!(
            "there is no step `{unknown}`; steps: {}",
            steps.join(" ")
        )),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parsed(line: &str) -> Result<VerifyMode, String> {
        let words: Vec<_> = line.split_whitespace().map(str::to_owned).collect();
        parse(&words, &["rules", "tests"])
    }

    #[test]
    fn steps_and_soaks_are_told_apart() {
        assert_eq!(parsed(""), Ok(VerifyMode::Steps(vec![])));
        let steps = vec!["tests".to_owned(), "rules".to_owned()];
        assert_eq!(parsed("tests rules"), Ok(VerifyMode::Steps(steps)));
        let hour = Duration::from_secs(3_600);
        assert_eq!(parsed("--soak 60"), Ok(VerifyMode::Soak(hour)));
        assert_eq!(parsed("--soak-seed 0"), Ok(VerifyMode::SoakSeed(0)));
        let most = format!("--soak-seed {}", u64::MAX);
        assert_eq!(parsed(&most), Ok(VerifyMode::SoakSeed(u64::MAX)));
        assert_eq!(parsed("--help"), Ok(VerifyMode::Help));
    }

    #[test]
    fn what_cannot_be_done_is_named() {
        for (line, part) in [
            ("--soak", "number is missing"),
            ("--soak x", "`x`"),
            ("--soak 0", "from 1 to 10080"),
            ("--soak 1.5", "`1.5`"),
            ("--soak -3", "`-3`"),
            ("--soak 10081", "from 1 to 10080"),
            ("--soak 1 rules", "cannot be combined"),
            ("--soak-seed", "number is missing"),
            ("--soak-seed x", "`x`"),
            ("--soak-seed 18446744073709551616", "from 0 to"),
            ("rules --soak 5", "no option `--soak`"),
            ("--sok 5", "no option `--sok`"),
            ("rulse", "steps: rules tests"),
        ] {
            let problem = parsed(line).unwrap_err();
            assert!(problem.contains(part), "{line}: {problem}");
        }
    }
}
