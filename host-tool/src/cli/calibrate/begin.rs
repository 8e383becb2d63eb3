//! What a calibration begins with: its device, its files, and whose they are.

use super::CalibrateArgs;
use crate::cli::moment;
use crate::cli::perform::SEED;
use host_core::calibration::{self, CalibrationError, Head, JournalContents, Plan, journal_path};
use host_core::link::{Connection, PacedPort, Port};
use host_core::run::identity;
use host_core::wearer::Wearer;
use std::path::{Path, PathBuf};

/// What there was before, and whose it is now.
pub struct OpenedJournal {
    /// The journal's place.
    pub journal: PathBuf,
    /// What it held.
    pub kept: Option<JournalContents>,
}

/// Looks at the files, before any device is touched: what is there, if it may be gone on
/// with.
///
/// # Errors
/// Files that are taken, missing, damaged or another person's.
pub fn check_files(
    args: &CalibrateArgs,
    out: &Path,
    head: &Head,
) -> Result<OpenedJournal, CalibrationError> {
    let journal = journal_path(out);
    let mut kept = None;
    if args.resume {
        let before = calibration::read(&journal)?;
        before.head.check_continuation(&journal, head)?;
        kept = Some(before);
        if out.exists() {
            check_owner(out, &head.wearer)?;
        }
    } else {
        let unusable = |why| CalibrationError::Closed(journal.clone(), why);
        if calibration::has_entries(&journal).map_err(unusable)? {
            return Err(CalibrationError::Taken(journal));
        }
        if out.exists() {
            return Err(CalibrationError::Taken(out.to_owned()));
        }
    }
    Ok(OpenedJournal { journal, kept })
}

/// Whether the wearer file that is there is this person's.
fn check_owner(out: &Path, name: &str) -> Result<(), CalibrationError> {
    let unusable = |why: String| CalibrationError::NotResumable(out.to_owned(), why);
    let old = Wearer::read(out).map_err(|error| unusable(error.lines()))?;
    match old.name == name {
        true => Ok(()),
        false => Err(unusable(format!(
            "it is the file of {}, the plan is for {name}; give that person's --out",
            old.name
        ))),
    }
}

/// What is known of it without a device.
pub fn journal_head(args: &CalibrateArgs, wearer: &str, text: &str) -> Head {
    let is_simulated = !args.device.is_port();
    Head {
        operator: args.operator.clone(),
        at: args.at.clone().unwrap_or_else(|| "simulated".to_owned()),
        device: args.device.to_string(),
        firmware: "0".to_owned(), // until it answers
        body: is_simulated.then(|| args.body.unwrap_or_default().name().to_owned()),
        seed: is_simulated.then(|| args.seed.unwrap_or(SEED)),
        ..Head::new(wearer, text)
    }
}

/// Opens the device, with its simulated wearer, at the pace of a clock where people
/// order; the head says who answered.
///
/// # Errors
/// The plan, or the device.
pub fn open_device(
    args: &CalibrateArgs,
    plan: &Plan,
    head: &mut Head,
) -> anyhow::Result<Box<dyn Port>> {
    let board = calibration::board_session(plan)?;
    let seed = args.seed.unwrap_or(SEED);
    let mut port = args.device.open(&board, seed)?;
    let in_process = port.world().is_some();
    if let Some(world) = port.world() {
        world.body = args.body.unwrap_or_default().body(seed)?;
    }
    let (client, info) = Connection::open(port)?;
    let identity = identity(&info, in_process);
    head.simulated = identity.simulated;
    head.device = match identity.unique_id {
        Some(id) => format!("{:?} {id}", identity.kind).to_lowercase(),
        None => format!("{:?}", identity.kind).to_lowercase(),
    };
    head.firmware = identity.firmware;
    if args.at.is_none() && !head.simulated {
        head.at = moment::now().utc();
    }
    let port = client.into_port();
    Ok(match in_process && !args.auto {
        true => Box::new(PacedPort::new(port)),
        false => port,
    })
}
