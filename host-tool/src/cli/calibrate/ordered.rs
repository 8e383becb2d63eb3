//! Turns the arguments of `flexor calibrate` into a task.

use super::CalibrateArgs;
use crate::cli::usage_error;
use host_core::calibration::{Level, Plan};
use host_core::session::Session;
use host_core::wearer::Wearer;
use std::collections::BTreeSet;
use std::path::PathBuf;
use toml::{Table, Value};

/// Task of the command.
pub enum Task {
    /// Find the wearer's thresholds, limits and stimulation points.
    Calibrate {
        /// Wearer and electrodes.
        plan: Plan,
        /// Text of the plan, whose hash the journal records.
        text: String,
        /// Path of the wearer file to write.
        out: PathBuf,
    },
    /// Check whether the thresholds of a wearer file have drifted.
    Check {
        /// Path of the wearer file.
        file: PathBuf,
        /// Contents of the wearer file.
        wearer: Box<Wearer>,
        /// Largest change of a threshold that does not count as drift, in the unit of its channel.
        tolerance: Level,
    },
}

impl Task {
    /// Builds the task from the command line.
    ///
    /// # Errors
    /// Fails if the plan or the wearer file is invalid, or if options contradict each other.
    pub fn from_args(args: &CalibrateArgs) -> anyhow::Result<Self> {
        if let Some(file) = &args.check {
            let tolerance = args.tolerance.unwrap_or(1.0);
            let Some(tolerance) = Level::from_units(tolerance).filter(|level| level.0 > 0) else {
                return usage_error(format!(
                    "--tolerance is {tolerance}; allowed: 0.001 to 100 in steps of 0.001"
                ));
            };
            let wearer = Box::new(Wearer::read(file)?);
            let file = file.clone();
            return Ok(Self::Check {
                file,
                wearer,
                tolerance,
            });
        }
        let (name, text) = match (&args.electrodes, &args.channels) {
            (Some(path), _) => (path.display().to_string(), Session::text(path)?),
            (None, Some(channels)) => ("--channels".to_owned(), default_plan(args, channels)?),
            (None, None) => {
                return usage_error(
                    "give --electrodes PLAN.toml, or --pseudonym NAME and --channels 1,2,3",
                );
            }
        };
        let text = match &args.pseudonym {
            Some(wearer) => with_wearer(&text, wearer),
            None => text,
        };
        Ok(Self::Calibrate {
            plan: Plan::parse(&name, &text)?,
            text,
            out: args.out.clone().unwrap_or_default(), // clap requires `--out`
        })
    }

    /// Returns the wearer's pseudonym.
    pub fn wearer(&self) -> &str {
        match self {
            Self::Calibrate { plan, .. } => &plan.wearer,
            Self::Check { wearer, .. } => &wearer.name,
        }
    }
}

/// Replaces the wearer in the text of a plan; returns the text unchanged if it is not TOML.
fn with_wearer(text: &str, wearer: &str) -> String {
    match toml::from_str::<Table>(text) {
        Ok(mut plan) => {
            plan.insert("wearer".to_owned(), wearer.into());
            plan.to_string()
        }
        Err(_) => text.to_owned(),
    }
}

/// Returns the text of a plan for these channels.
fn default_plan(args: &CalibrateArgs, channels: &str) -> anyhow::Result<String> {
    let Some(wearer) = &args.pseudonym else {
        return usage_error("--channels needs --pseudonym NAME, the wearer's pseudonym");
    };
    let Some(channels) = parse_channels(channels) else {
        return usage_error(format!(
            "--channels is \"{}\"; allowed: channels 1 to 10, such as 1,2,3 or 1-10",
            host_core::session::escape_control_chars(channels)
        ));
    };
    let ceiling = args.ceiling.unwrap_or(20.0);
    let electrode = |channel: u8| {
        Value::from(Table::from_iter([
            ("channel".to_owned(), Value::from(i64::from(channel))),
            ("place".to_owned(), format!("electrode {channel}").into()),
            ("ceiling".to_owned(), ceiling.into()),
        ]))
    };
    let electrodes: Vec<Value> = channels.into_iter().map(electrode).collect();
    let plan = Table::from_iter([
        ("wearer".to_owned(), Value::from(wearer.as_str())),
        ("electrode".to_owned(), electrodes.into()),
    ]);
    Ok(plan.to_string())
}

/// Parses channels such as "1,3-5" and removes duplicates; `None` if the text is invalid.
fn parse_channels(text: &str) -> Option<Vec<u8>> {
    let mut channels = BTreeSet::new();
    for part in text.split(',') {
        let (from, to) = part.split_once('-').unwrap_or((part, part));
        let (from, to): (u8, u8) = (from.trim().parse().ok()?, to.trim().parse().ok()?);
        if from < 1 || to > 10 || from > to {
            return None;
        }
        channels.extend(from..=to);
    }
    Some(channels.into_iter().collect())
}

#[cfg(test)]
mod tests {
    use super::parse_channels;

    #[test]
    fn channels_are_listed_or_refused() {
        assert_eq!(parse_channels("1,3-5, 4"), Some(vec![1, 3, 4, 5]));
        for wrong in ["", "0", "11", "3-1", "a", "1,,2", "1-"] {
            assert_eq!(parse_channels(wrong), None, "{wrong}");
        }
    }
}
