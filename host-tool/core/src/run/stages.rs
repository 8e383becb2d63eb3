//! Describes the board's output stages in words, and checks that a session declares the same. The
//! device itself applies the rule in [`Stages::check`].

use super::{Board, RunError};
use crate::session::Session;
use firmware::device::{Draft, Rule};
use firmware::pulse::CHANNELS;
use firmware::safety::{
    Origin, SetupError, StageKind, StageMismatch, StageSupply, StageTable, Stages, StagesFault,
};
use std::convert::Infallible;

/// Describes the output stages of a device. Neighbouring channels with the same stage share a line.
#[must_use]
pub fn describe_stages(stages: &Stages) -> Vec<String> {
    let table = match stages {
        Stages::AsConfigured => {
            return vec![
                "a simulator, which has the stages that the session configures".to_owned(),
            ];
        }
        Stages::Simulated { channels } => return vec![describe_simulated(*channels)],
        Stages::Unknown(fault) => return vec![format!("not known: {}", describe_fault(*fault))],
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
        let kind = stage.map_or_else(|| "no stage".to_owned(), describe_stage);
        lines.push(format!("{channels}: {kind}"));
        first = index + 1;
    }
    lines.push(format!("supply: {}", describe_supply(table.supply)));
    if table.origin == Origin::Session {
        lines.push("simulated board: the stages are those of the session".to_owned());
    }
    lines
}

/// Describes the simulated stages of a breadboard; bit i of `channels` is channel i + 1.
fn describe_simulated(channels: u16) -> String {
    let present = (0..CHANNELS).filter(|n| channels >> n & 1 == 1);
    let numbers: Vec<String> = present.map(|n| (n + 1).to_string()).collect();
    format!(
        "simulated, as the session configures them, on the channels {}",
        numbers.join(", ")
    )
}

/// Checks that the board has the output stage that the session file gives for each channel. The
/// error names every channel whose stage differs.
pub(super) fn check_stages(session: &Session, stages: &Stages) -> Result<(), RunError> {
    let channels = session.channels.iter();
    let wrong: Vec<String> = channels
        .filter_map(|channel| {
            let declared = &channel.spec.stage;
            let mismatch = stages.check(channel.index(), declared).err()?;
            let has = match mismatch {
                StageMismatch::Unknown(_) => return None, // told once
                StageMismatch::NoStage => "no stage".to_owned(),
                _ => stored_stage(stages, channel.index()).map_or_else(String::new, describe_stage),
            };
            let (number, declared) = (channel.number, describe_stage(declared.kind()));
            Some(format!(
                "channel {number}: the session has {declared}, the board has {has}"
            ))
        })
        .collect();
    match stages {
        Stages::Unknown(fault) => Err(RunError::StagesUnknown(describe_fault(*fault))),
        _ if wrong.is_empty() => Ok(()),
        _ => Err(RunError::OtherStages(wrong.join("; "))),
    }
}

/// Checks that `board` has pins for every channel of the session. A breadboard takes the stages that
/// the session configures; those of the reference board are stored in it and not known here.
///
/// # Errors
/// E505, with every channel that has no pins.
pub fn check_board(session: &Session, board: Board) -> Result<(), RunError> {
    let wiring = board.pins();
    if wiring.breadboard.is_none() {
        return Ok(());
    }
    let lines = wiring.outputs.channels.iter().enumerate();
    let channels = lines.fold(0, |bits, (n, lines)| bits | u16::from(lines.is_some()) << n);
    check_stages(session, &Stages::Simulated { channels })
}

/// Describes the supply of the output stages, and what it means for stimulation.
const fn describe_supply(supply: Option<StageSupply>) -> &'static str {
    match supply {
        None => {
            "not stored, so treated as common: no two channels may drive in opposite directions at the same time"
        }
        Some(StageSupply::Common) => {
            "common: no two channels may drive in opposite directions at the same time"
        }
        Some(StageSupply::Separate) => "separate",
    }
}

/// Checks whether `session` could run on a board whose output stages have this supply and are
/// otherwise those of the session file. `None` is a board that has not stored its supply, which is
/// treated as common.
///
/// # Errors
/// Two channels can drive in opposite directions at once, and the supply does not allow it (E507).
pub fn check_supply(session: &Session, supply: Option<StageSupply>) -> Result<(), RunError> {
    let mut stages = [None; CHANNELS];
    for channel in &session.channels {
        stages[usize::from(channel.index())] = Some(channel.spec.stage.kind()); // below 10
    }
    let origin = Origin::Session;
    let table = StageTable {
        origin,
        supply,
        stages,
    };
    check_opposition(session, &Stages::Stored(table))
}

/// Checks that no two channels of `session` can drive in opposite directions at the same time,
/// unless the board's stages allow it. Uses the rule in [`Draft::examine`] by which the device
/// itself decides.
///
/// # Errors
/// E507, with every such pair of channels.
pub(super) fn check_opposition(session: &Session, stages: &Stages) -> Result<(), RunError> {
    let mut draft = Draft::for_stages(*stages);
    for request in session.setup_requests() {
        let _ = draft.configure(&request); // what the device refuses, it refuses by itself
    }
    let mut pairs = Vec::new();
    let Ok(_) = draft.examine(|mistake| {
        if let Rule::Setup(SetupError::Opposed { channel, other }) = mistake.rule {
            pairs.push(format!("channels {} and {}", channel + 1, other + 1)); // at most 10
        }
        Ok::<(), Infallible>(())
    });
    let supply = match stages {
        _ if pairs.is_empty() => return Ok(()),
        Stages::Stored(StageTable { supply: None, .. }) => "have no stored supply",
        _ => "share one supply",
    };
    Err(RunError::Opposed(format!(
        "{} can drive in opposite directions at the same time, but the board's stages {supply}",
        pairs.join(", ")
    )))
}

fn stored_stage(stages: &Stages, channel: u8) -> Option<StageKind> {
    match stages {
        Stages::Stored(table) => *table.stages.get(usize::from(channel))?,
        _ => None,
    }
}

/// Describes an output stage, for example "current, 100 mA full scale".
fn describe_stage(kind: StageKind) -> String {
    match kind {
        StageKind::Current { full_scale_ua } => {
            format!("current, {} mA full scale", f64::from(full_scale_ua) / 1e3)
        }
        StageKind::Voltage { full_scale_mv } => {
            format!("voltage, {} V full scale", f64::from(full_scale_mv) / 1e3)
        }
    }
}

const fn describe_fault(fault: StagesFault) -> &'static str {
    match fault {
        StagesFault::Erased => "no table has been stored",
        StagesFault::Incomplete => "the table is incomplete: storing it was interrupted",
        StagesFault::Damaged => "the table is damaged",
        StagesFault::Version => "the table was stored by another version of the firmware",
        StagesFault::OtherBoard => "the table was stored for another board",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_pair_that_can_oppose_is_told_unless_supplies_are_separate() {
        let text = std::fs::read_to_string("../sessions/ten_channels.toml").unwrap();
        let common = Some(StageSupply::Common);
        let apart = Session::parse("apart.toml", &text).unwrap();
        assert!(check_supply(&apart, common).is_ok(), "2 ms apart");
        // Second phases of channel 1 overlap first phases of channel 2, and those of channel 3
        // overlap those of channel 4's burst.
        let text = text.replace("offset_us = 2000 ", "offset_us = 250 ");
        let text = text.replace("offset_us = 6000,", "offset_us = 4250,");
        let session = Session::parse("opposed.toml", &text).unwrap();
        assert!(check_supply(&session, Some(StageSupply::Separate)).is_ok());
        assert!(check_opposition(&session, &Stages::AsConfigured).is_ok());
        for (supply, why) in [(None, "no stored supply"), (common, "share one supply")] {
            let message = check_supply(&session, supply).unwrap_err().to_string();
            let pairs = "channels 1 and 2, channels 3 and 4 can drive";
            assert!(
                message.starts_with("E507") && message.contains(pairs),
                "{message}"
            );
            assert!(message.contains(why), "{message}");
        }
    }

    #[test]
    fn every_channel_that_differs_is_told_at_once() {
        let session = Session::load("../sessions/gentle_force.toml").unwrap();
        let declared = session.channels[0].spec.stage.kind();
        let volts = StageKind::Voltage {
            full_scale_mv: 60_000,
        };
        let stored = |stages| {
            Stages::Stored(StageTable {
                origin: Origin::Owner,
                supply: Some(StageSupply::Separate),
                stages,
            })
        };
        assert!(check_stages(&session, &Stages::AsConfigured).is_ok());
        assert!(check_stages(&session, &stored([Some(declared); 10])).is_ok());
        let refusal = check_stages(&session, &stored([Some(volts); 10])).unwrap_err();
        let message = refusal.to_string();
        let first = "channel 1: the session has current";
        assert!(
            message.starts_with("E505") && message.contains(first),
            "{message}"
        );
        let count = message.matches("voltage, 60 V full scale").count();
        assert_eq!(count, session.channels.len(), "{message}");
        let none = check_stages(&session, &stored([None; 10])).unwrap_err();
        assert!(
            none.to_string().contains("the board has no stage"),
            "{none}"
        );
        let erased = Stages::Unknown(StagesFault::Erased);
        let erased_message = check_stages(&session, &erased).unwrap_err().to_string();
        assert!(
            erased_message.starts_with("E506") && erased_message.contains("no table"),
            "{erased_message}"
        );
    }
}
