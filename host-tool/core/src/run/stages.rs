//! The board's output stages, in words: what it has, and where a session declares
//! others. The rule is the device's ([`Stages::check`]).

use super::RunError;
use crate::session::Session;
use firmware::safety::{Origin, StageKind, StageMismatch, Stages, StagesFault};

/// What a device has on its channels, a line for each stretch of equal ones.
#[must_use]
pub fn stages_told(stages: &Stages) -> Vec<String> {
    let table = match stages {
        Stages::AsDeclared => {
            return vec!["a simulator: the stages are those that a session declares".to_owned()];
        }
        Stages::Unknown(fault) => return vec![format!("unknown: {}", unknown(*fault))],
        Stages::Stored(table) => table,
    };
    let mut lines: Vec<String> = Vec::new();
    let mut first = 0;
    for (index, stage) in table.stages.iter().enumerate() {
        let next = table.stages.get(index + 1);
        if next == Some(stage) {
            continue;
        }
        let channels = match (first + 1, index + 1) {
            (a, b) if a == b => format!("channel {a}"),
            (a, b) => format!("channels {a} to {b}"),
        };
        let kind = stage.map_or_else(|| "no stage".to_owned(), told);
        lines.push(format!("{channels}: {kind}"));
        first = index + 1;
    }
    if table.origin == Origin::Session {
        lines.push("taken from the session: a simulated board".to_owned());
    }
    lines
}

/// Every channel of `session` whose stage the device does not have.
pub(super) fn check_stages(session: &Session, stages: &Stages) -> Result<(), RunError> {
    let channels = session.channels.iter();
    let wrong: Vec<String> = channels
        .filter_map(|channel| {
            let declared = &channel.spec.stage;
            let mismatch = stages.check(channel.index(), declared).err()?;
            let has = match mismatch {
                StageMismatch::Unknown(_) => return None, // told once
                StageMismatch::NoStage => "no stage".to_owned(),
                _ => of(stages, channel.index()).map_or_else(String::new, told),
            };
            let (number, declared) = (channel.number, told(declared.kind()));
            Some(format!(
                "channel {number} is declared {declared}, the board has {has}"
            ))
        })
        .collect();
    match stages {
        Stages::Unknown(fault) => Err(RunError::StagesUnknown(unknown(*fault))),
        _ if wrong.is_empty() => Ok(()),
        _ => Err(RunError::OtherStages(wrong.join("; "))),
    }
}

fn of(stages: &Stages, channel: u8) -> Option<StageKind> {
    match stages {
        Stages::Stored(table) => *table.stages.get(usize::from(channel))?,
        _ => None,
    }
}

/// "current, 100 mA full scale".
fn told(kind: StageKind) -> String {
    match kind {
        StageKind::Current { full_scale_ua } => {
            format!("current, {} mA full scale", f64::from(full_scale_ua) / 1e3)
        }
        StageKind::Voltage { full_scale_mv } => {
            format!("voltage, {} V full scale", f64::from(full_scale_mv) / 1e3)
        }
    }
}

const fn unknown(fault: StagesFault) -> &'static str {
    match fault {
        StagesFault::Erased => "no table has been stored",
        StagesFault::HalfWritten => "the table is half written: storing it was cut off",
        StagesFault::Damaged => "the table is damaged",
        StagesFault::Version => "the table was stored by another version of the firmware",
        StagesFault::OtherBoard => "the table was stored for another board",
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use firmware::safety::StageTable;

    #[test]
    fn every_channel_that_differs_is_told_at_once() {
        let session = Session::load("../sessions/gentle_force.toml").unwrap();
        let declared = session.channels[0].spec.stage.kind();
        let volts = StageKind::Voltage {
            full_scale_mv: 60_000,
        };
        let stored = |stages| {
            let origin = Origin::Owner;
            Stages::Stored(StageTable { origin, stages })
        };
        assert!(check_stages(&session, &Stages::AsDeclared).is_ok());
        assert!(check_stages(&session, &stored([Some(declared); 10])).is_ok());
        let told = check_stages(&session, &stored([Some(volts); 10])).unwrap_err();
        let told = told.to_string();
        assert!(
            told.starts_with("E505 channel 1 is declared current"),
            "{told}"
        );
        let count = told.matches("voltage, 60 V full scale").count();
        assert_eq!(count, session.channels.len(), "{told}");
        let none = check_stages(&session, &stored([None; 10])).unwrap_err();
        assert!(
            none.to_string().contains("the board has no stage"),
            "{none}"
        );
        let erased = Stages::Unknown(StagesFault::Erased);
        let told = check_stages(&session, &erased).unwrap_err().to_string();
        assert!(
            told.starts_with("E506") && told.contains("no table"),
            "{told}"
        );
    }
}
