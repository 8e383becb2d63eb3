//! Drives a device call by call, for a program that decides on its setpoints while it runs.
//!
//! A [`Drive`] sets up a session, arms, starts, sends setpoints, waits and stops, in the time of the
//! device's port. [`LeasedDrive`] runs a drive in real time on a thread of its own and stops the device
//! when the program does not renew its lease. [`TrialLog`] is the record, which is on disk while the
//! device stimulates. What a call looks like in a programming language is decided elsewhere.
//!
//! Input: sessions and requests. Output: trials and errors.

mod error;
#[cfg(feature = "realtime")]
mod leased;
mod outputs;
mod setpoints;
mod source;
mod stimulate;
mod telemetry;
mod trials;

pub use error::DriveError;
#[cfg(feature = "realtime")]
pub use leased::{LeasedDrive, MAX_LEASE};
pub use setpoints::{LEAST, LatestAmplitudes, SetpointError, SetpointValues, check_channel};
pub use source::{BodyMaker, Source};
pub use trials::TrialLog;

use crate::link::{Connection, Port, RefusalInWords};
use crate::record::Trial;
use crate::run::{RunError, Stepper, acknowledge};
use crate::session::Session;
use error::RequiredState;
use firmware::link::HelloInfo;
use outputs::DriveOutputs;
use telemetry::TelemetryQueue;

type DeviceStepper = Stepper<'static, Box<dyn Port>>;

/// Phase of a session that a program drives; decides which calls are possible.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum DriveState {
    /// Nothing is armed. The outputs are disconnected.
    Idle,
    /// The device is armed and has not started.
    Armed,
    /// The device stimulates.
    Running,
    /// The drive was closed.
    Closed,
}

/// A device that a program drives call by call. Each cycle from arming to the stop is a trial.
///
/// ```
/// use firmware::link::Request;
/// use firmware::units::Amplitude;
/// use host_core::drive::{Drive, Source};
/// use host_core::run::SessionFile;
///
/// let file = SessionFile::parse("one.toml", r#"
/// title = "one channel"
/// duration_s = 86400
/// [[channel]]
/// number = 1
/// name = "flexor"
/// stage = { kind = "current", full_scale_ma = 100.0 }
/// limit = 15.0
/// train = { shape = "biphasic-cathodic-first", width_us = 200, frequency_hz = 50.0 }
/// [setpoints]
/// kind = "amplitudes"
/// values = [{ channel = 1, value = 0.0 }]
/// rate_hz = 50
/// "#)?;
/// let mut drive = Drive::new(Source::simulated(1));
/// let readings = drive.arm(file)?;
/// assert_eq!(readings[0].channel, 1);
/// drive.start()?;
/// let values = [Amplitude::new(8_000)].into_iter().collect();
/// let widths = Default::default();
/// drive.send(vec![Request::Amplitudes { at: None, mask: 1, values, widths }])?;
/// drive.wait(1_000_000)?;
/// drive.stop()?;
/// assert!(drive.trial().is_some_and(|trial| trial.pulses.is_some_and(|pulses| pulses > 30)));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct Drive {
    source: Source,
    stage: Stage,
    log: Option<TrialLog>,
    outputs: DriveOutputs,
    /// Session of the present or latest trial.
    session: Option<Session>,
    /// Latest complete trial.
    trial: Option<Trial>,
    /// Reason for which that trial ended early, in words.
    ended: Option<String>,
    /// Samples for a program that follows the trial.
    telemetry: TelemetryQueue,
    /// Number of trials so far.
    count: usize,
    telemetry_ms: u16,
    keeps_edges: bool,
}

enum Stage {
    /// Nothing is armed. The port is that of a device that was opened before.
    Idle(Option<Box<dyn Port>>),
    Active {
        stepper: Box<DeviceStepper>,
        is_started: bool,
    },
    Closed,
}

impl Drive {
    /// Creates a drive for the device of `source`.
    #[must_use]
    pub fn new(source: Source) -> Self {
        Self {
            source,
            stage: Stage::Idle(None),
            log: None,
            outputs: DriveOutputs::default(),
            telemetry: TelemetryQueue::default(),
            session: None,
            trial: None,
            ended: None,
            count: 0,
            telemetry_ms: 10,
            keeps_edges: false,
        }
    }

    /// Records every later trial in `log`.
    pub fn record_in(&mut self, log: TrialLog) {
        self.log = Some(log);
    }

    /// Makes every later trial keep all edges of a simulated device in memory, instead of one
    /// period of them.
    pub const fn keep_all_edges(&mut self) {
        self.keeps_edges = true;
    }

    /// Sets the time between two telemetry samples of later trials, ms (1 to 1000).
    pub const fn set_telemetry_period(&mut self, period_ms: u16) {
        self.telemetry_ms = period_ms;
    }

    /// Opens the device and returns its answer to `Hello`; `None` for a simulator, which is created
    /// together with its wearer when it is armed. Arms and starts nothing.
    ///
    /// # Errors
    /// The device cannot be opened or does not answer.
    pub fn open(&mut self) -> Result<Option<HelloInfo>, DriveError> {
        let Some(port) = self.source.connect()? else {
            return Ok(None);
        };
        let (connection, info) = Connection::open(port).map_err(RunError::from)?;
        self.stage = Stage::Idle(Some(connection.into_port()));
        Ok(Some(info))
    }

    /// Returns the present state of the drive.
    #[must_use]
    pub const fn state(&self) -> DriveState {
        match &self.stage {
            Stage::Idle(_) => DriveState::Idle,
            Stage::Active {
                is_started: false, ..
            } => DriveState::Armed,
            Stage::Active {
                is_started: true, ..
            } => DriveState::Running,
            Stage::Closed => DriveState::Closed,
        }
    }

    /// Returns the time since the start of the trains, µs; 0 before the start.
    pub fn time_us(&mut self) -> u64 {
        match &mut self.stage {
            Stage::Active { stepper, .. } => stepper.time_us(),
            Stage::Idle(_) | Stage::Closed => 0,
        }
    }

    /// Returns the present trial with everything that was recorded so far, or the latest complete
    /// one; `None` before the first.
    #[must_use]
    pub fn trial(&self) -> Option<&Trial> {
        match &self.stage {
            Stage::Active { stepper, .. } => Some(stepper.trial()),
            Stage::Idle(_) | Stage::Closed => self.trial.as_ref(),
        }
    }

    /// Returns the reason for which the latest complete trial ended early; `None` if it did not, and
    /// while a trial runs.
    #[must_use]
    pub fn early_end(&self) -> Option<&str> {
        match &self.stage {
            Stage::Active { .. } => None,
            Stage::Idle(_) | Stage::Closed => self.ended.as_deref(),
        }
    }

    /// Returns the session of the present or latest trial; `None` before the first.
    #[must_use]
    pub const fn session(&self) -> Option<&Session> {
        self.session.as_ref()
    }

    /// Returns the simulated world; `None` for a real device, and before a simulator is armed.
    pub fn world(&mut self) -> Option<&mut hal_sim::world::World> {
        match &mut self.stage {
            Stage::Active { stepper, .. } => stepper.port().world(),
            Stage::Idle(Some(port)) => port.world(),
            Stage::Idle(None) | Stage::Closed => None,
        }
    }

    /// Discards the simulated world, so that the next trial begins with a rested wearer whose noise
    /// `seed` determines.
    ///
    /// # Errors
    /// The device is real, or the drive is not idle.
    pub fn reset(&mut self, seed: u64) -> Result<(), DriveError> {
        self.check_idle("reset")?;
        self.source.reseed(seed)?;
        self.stage = Stage::Idle(None);
        Ok(())
    }

    /// Acknowledges a latched fault of the device; does nothing if none is latched.
    ///
    /// # Errors
    /// The drive is not idle, or the device does not answer.
    pub fn acknowledge(&mut self) -> Result<(), DriveError> {
        self.check_idle("acknowledge")?;
        if let Stage::Idle(slot) = &mut self.stage
            && let Some(port) = slot.take()
        {
            *slot = Some(acknowledge(port).map_err(RunError::from)?);
        }
        Ok(())
    }

    /// Checks that the setup may change, because nothing is armed. `call` names the call that
    /// changes it.
    ///
    /// # Errors
    /// The drive is not idle.
    pub fn check_idle(&self, call: &str) -> Result<(), DriveError> {
        match self.stage {
            Stage::Idle(_) => Ok(()),
            Stage::Active { .. } | Stage::Closed => {
                Err(self.wrong_state(call, RequiredState::Idle))
            }
        }
    }

    fn wrong_state(&self, call: &str, needed: RequiredState) -> DriveError {
        match self.state() {
            DriveState::Closed => DriveError::Closed,
            state => DriveError::Order {
                call: call.to_owned(),
                needed,
                state,
            },
        }
    }
}

/// Returns the device's refusal, if `error` is one.
#[must_use]
pub const fn refusal(error: &RunError) -> Option<&RefusalInWords> {
    match error {
        RunError::Link(crate::link::Error::Refused(refused)) => Some(refused),
        _ => None,
    }
}
