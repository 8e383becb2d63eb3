//! Prepares a calibration: checks its files, describes it for the journal and opens its device.

use super::CalibrateArgs;
use crate::cli::moment;
use crate::cli::perform::SEED;
use host_core::calibration::{self, CalibrationError, Head, JournalContents, Plan, journal_path};
use host_core::link::{Connection, PacedPort, Port};
use host_core::run::identity;
use host_core::wearer::Wearer;
use std::path::{Path, PathBuf};

/// The journal of a calibration that begins or continues.
pub struct OpenedJournal {
    pub journal: PathBuf,
    /// Earlier entries; `None` for a new calibration.
    pub kept: Option<JournalContents>,
}

/// Checks the files before any device is opened, and reads the journal that `--resume` continues.
///
/// # Errors
/// Fails if a file exists already, is missing or damaged, or belongs to another wearer.
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

/// Checks that the existing wearer file belongs to `name`.
fn check_owner(out: &Path, name: &str) -> Result<(), CalibrationError> {
    let unusable = |why: String| CalibrationError::NotResumable(out.to_owned(), why);
    let old = Wearer::read(out).map_err(|error| unusable(error.lines()))?;
    match old.name == name {
        true => Ok(()),
        false => Err(unusable(format!(
            "it is the file of wearer {}, but the plan is for {name}; give --out of {name}",
            old.name
        ))),
    }
}

/// Returns the head of the journal (wearer, plan, operator and device), with everything that is
/// known before the device answers.
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

/// Opens the device with its simulated wearer, paced by the wall clock if an operator gives orders,
/// and enters the device's identity in the head.
///
/// # Errors
/// Fails if the plan is invalid or the device does not open.
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
