//! Runs a session on a device step by step: open, configure, arm, start, step until a device time
//! or an event, stop, close.
//!
//! [`run`](super::run()) is its first user. A program of your own drives it the same way; the
//! result does not depend on where the steps end. A program that decides on setpoints while the
//! session runs supplies them itself ([`Stepper::with_live_setpoints`]).

mod close;
mod controls;
mod ended;
mod listen;
mod live;
mod measured;
mod post;
mod record;
mod snapshot;

use super::stages::{check_opposition, check_stages};
use super::{
    Observation, Observer, ObserverRequest, Outcome, Outputs, RunError, SessionFile, Stopped, trial,
};
use crate::link::{Connection, Error, Port, RefusalInWords};
use crate::record::{Recorder, Trial};
use crate::session::Session;
use firmware::link::{Counters, Event, HelloInfo};
use firmware::pulse::CHANNELS;
use std::borrow::Cow;
use std::collections::VecDeque;
use std::ops::DerefMut;

use controls::Paused;
pub use controls::{Control, INTENSITY_STEP, Keys, replay_keys};
use listen::ListenEnd;
use post::Programmed;

/// Time without a message after which a device counts as lost, µs. A device sends telemetry at
/// least every 100 ms.
const SILENCE_US: u64 = 1_000_000;

/// Simulated time between two transfers of a device's output to its receiver, µs.
const TAKE_US: u64 = 1_000_000;

/// Optional recorder, receiver of outputs and observer of a running session. By default there are
/// none.
pub struct Attachments<'a> {
    /// Recorder that writes every row to disk as it arrives; `None` keeps the rows in memory only.
    pub recorder: Option<Box<dyn DerefMut<Target = Recorder> + Send + 'a>>,
    /// Receiver of a simulated device's output while it runs; without one, the simulated world
    /// keeps the output.
    pub outputs: Option<Box<dyn Outputs + Send + 'a>>,
    /// Observer that sees the session run and may end it.
    pub observer: Box<dyn Observer + Send + 'a>,
}

impl Default for Attachments<'_> {
    fn default() -> Self {
        Self {
            recorder: None,
            outputs: None,
            observer: Box::new(|_: f64| {}),
        }
    }
}

/// When a step ends at the latest.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum StepLimit {
    /// At this time, µs after the start of the trains. The step ends up to 2 ms later, at the first
    /// time at which the host reads from its device anyway. In a live session, it ends exactly at
    /// this time.
    Time(u64),
    /// At this time, µs after the start of the trains, or earlier at the first event that the
    /// device reports.
    Event(u64),
}

/// Reason why a step ended.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum StepEnd {
    /// The time of the step was reached.
    Reached,
    /// The device reported this event; its time is in s after the start of the trains.
    Event(f64, Event),
    /// The session is over: its length has passed, every train with a fixed number of pulses has
    /// played, or a person has ended it. Call [`Stepper::close`] next.
    Over,
}

/// A session that runs on a device step by step.
///
/// ```
/// use host_core::run::{Attachments, DeviceName, SessionFile, StepEnd, Stepper, StepLimit};
///
/// let file = SessionFile::parse("one.toml", r#"
/// title = "one channel"
/// duration_s = 0.5
/// [[channel]]
/// number = 1
/// name = "flexor"
/// stage = { kind = "current", full_scale_ma = 100.0 }
/// limit = 15.0
/// train = { shape = "biphasic-cathodic-first", width_us = 200, frequency_hz = 50.0 }
/// [setpoints]
/// kind = "amplitudes"
/// values = [{ channel = 1, value = 8.0 }]
/// rate_hz = 50
/// "#)?;
/// let port = DeviceName::Native.open(&file.session, 1)?;
/// let mut stepper = Stepper::open(&file, port, Attachments::default())?;
/// stepper.configure()?;
/// stepper.arm()?;
/// stepper.start()?;
/// assert_eq!(stepper.step(StepLimit::Time(250_000))?, StepEnd::Reached);
/// assert!((250_000..252_000).contains(&stepper.time_us()));
/// assert_eq!(stepper.step(StepLimit::Time(u64::MAX))?, StepEnd::Over);
/// let (outcome, _port) = stepper.close(Ok(()));
/// assert!(outcome.error.is_none());
/// assert!(outcome.trial.pulses.is_some_and(|pulses| pulses > 20));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct Stepper<'a, P> {
    session: Cow<'a, Session>,
    connection: Connection<P>,
    info: HelloInfo,
    trial: Trial,
    attached: Attachments<'a>,
    /// Number of pulses in the part of the output that was already passed on, and the end of that
    /// part, µs of the port's time.
    taken: (u64, u64),
    /// Start of the trains, device time in µs.
    epoch: u64,
    /// Start of the trains in the port's time, µs; `None` before the start.
    started_us: Option<u64>,
    /// Number of the setpoint that is sent next.
    index: u64,
    /// Time up to which the edges of a simulated trigger input are scheduled, µs after the start of
    /// the trains.
    triggered_us: u64,
    /// Number of pulses of the electrode check, to be subtracted from the device's count of pulses
    /// if the device has no trace.
    checked: u32,
    /// Counters of the device before this run; all zero if the device booted for this run.
    begun: Counters,
    refused: usize,
    /// Latest refusal of a request, with its time, s after the start of the trains.
    last_refused: Option<(f64, RefusalInWords)>,
    /// Reason why the device ended the session; `None` while it runs.
    ended: Option<RunError>,
    /// Latest event with its time, s after the start of the trains; `None` if a step has already
    /// returned it.
    event: Option<(f64, Event)>,
    /// Number of events that were not recorded because the record has too many already.
    left_out: u64,
    /// Whether every train with a fixed number of pulses has played, so that the session is over.
    is_finished: bool,
    /// Latest wanted forces at the hand that were sent, mN, each with the number of its request.
    wishes: VecDeque<(u16, [i32; 3])>,
    programmed: Programmed,
    /// Intensity of each channel (0–9), percent of the amplitudes in the session file.
    intensity: [u16; CHANNELS],
    /// State of a pause by hand.
    paused: Paused,
    /// Whether a person at the controls ended the session.
    is_stopped: bool,
    /// Time at which actions at the controls were last requested, µs after the start of the trains.
    controlled_us: u64,
    /// Time at which the next keep-alive of a live session is due, in the port's time, µs; `None`
    /// for other sessions.
    keep_alive_us: Option<u64>,
    /// Time of the device's last message, in the port's time, µs.
    heard_us: u64,
    /// Total time for which this computer had not run the program when the device's last message
    /// arrived, µs.
    heard_stalled_us: u64,
}

/// Converts the link's error about a signal into [`RunError::Signal`]; returns other errors
/// unchanged. `t_s` is the time since the start of the trains, s, and `stopped` says what became of
/// the stop.
pub(super) fn to_signal_error(error: RunError, t_s: Option<f64>, stopped: Stopped) -> RunError {
    match error {
        RunError::Link(Error::Interrupted(signal)) => RunError::Signal {
            signal,
            t_s,
            stopped,
        },
        error => error,
    }
}

impl<'a, P: Port> Stepper<'a, P> {
    /// Opens a session with the device behind `port`, to run the session of `file`. The device is
    /// not configured yet.
    ///
    /// # Errors
    /// The device does not answer, another host holds it, or a signal arrived. The port is lost.
    pub fn open(
        file: &'a SessionFile,
        port: P,
        attached: Attachments<'a>,
    ) -> Result<Self, RunError> {
        let trial = trial::begin_trial(file);
        Self::begin(Cow::Borrowed(&file.session), trial, port, attached)
    }

    /// Opens a session as [`Self::open`] does, and takes ownership of `file`.
    ///
    /// # Errors
    /// The errors of [`Self::open`].
    pub fn open_owned(
        file: SessionFile,
        port: P,
        attached: Attachments<'a>,
    ) -> Result<Self, RunError> {
        let trial = trial::begin_trial(&file);
        Self::begin(Cow::Owned(file.session), trial, port, attached)
    }

    fn begin(
        session: Cow<'a, Session>,
        trial: Trial,
        port: P,
        mut attached: Attachments<'a>,
    ) -> Result<Self, RunError> {
        let interruption = attached.observer.interruption();
        let opened = Connection::open_interruptible(port, interruption);
        let (connection, info) =
            opened.map_err(|error| to_signal_error(error.into(), None, Stopped::NotOpen))?;
        attached.observer.observe(Observation::Hello(&info));
        Ok(Self {
            session,
            connection,
            info,
            trial,
            attached,
            taken: (0, 0),
            epoch: 0,
            started_us: None,
            index: 1,
            triggered_us: 0,
            checked: 0,
            begun: Counters::default(),
            refused: 0,
            last_refused: None,
            ended: None,
            event: None,
            left_out: 0,
            is_finished: false,
            wishes: VecDeque::new(),
            programmed: Programmed::default(),
            intensity: [100; CHANNELS],
            paused: Paused::No,
            is_stopped: false,
            controlled_us: 0,
            keep_alive_us: None,
            heard_us: 0,
            heard_stalled_us: 0,
        })
    }

    /// Returns the device's answer to `Hello`.
    pub const fn info(&self) -> &HelloInfo {
        &self.info
    }

    /// Returns the session that runs.
    pub fn session(&self) -> &Session {
        &self.session
    }

    /// Returns everything that was recorded so far.
    pub const fn trial(&self) -> &Trial {
        &self.trial
    }

    /// Returns the port, for example to inspect a simulated world.
    pub fn port(&mut self) -> &mut P {
        self.connection.port()
    }

    /// Returns the time since the start of the trains, µs of the port's time; 0 before the start.
    pub fn time_us(&mut self) -> u64 {
        let now_us = self.connection.port().now_us();
        now_us.saturating_sub(self.started_us.unwrap_or(now_us))
    }

    /// Sends the setup of the session to the device.
    ///
    /// # Errors
    /// The session does not fit the device, a request is refused or not answered, or the device is
    /// lost.
    pub fn configure(&mut self) -> Result<(), RunError> {
        self.record_identity()?;
        // The device may have played for others, or another trial, since it booted.
        let is_new = (self.connection.port().world()).is_some_and(|world| !world.is_used());
        if !is_new {
            self.begun = self.connection.status()?.counters;
        }
        check_stages(&self.session, &self.info.stages)?;
        check_opposition(&self.session, &self.info.stages)?;
        for request in self.session.setup_requests() {
            self.connection.request(request)?;
        }
        if self.measures_angle() && self.connection.port().glove_deg().is_none() {
            return Err(RunError::NoGlove("this device".to_owned()));
        }
        if !self.is_live() {
            self.connection.subscribe(self.session.telemetry_ms)?;
        }
        Ok(())
    }

    /// Arms the device, which checks the electrodes first.
    ///
    /// # Errors
    /// Arming is refused (an electrode, an input) or not answered, the device is lost, or the host
    /// cannot measure an angle that the session needs.
    pub fn arm(&mut self) -> Result<(), RunError> {
        let is_seen = self.connection.port().world().is_some();
        let before = match (is_seen, self.started_us) {
            (true, _) | (false, None) => self.begun.pulses,
            (false, Some(_)) => self.connection.status()?.counters.pulses,
        };
        self.connection.arm()?;
        self.poll_observer()?;
        if !is_seen {
            let pulses = self.connection.status()?.counters.pulses;
            let checked = pulses.wrapping_sub(before);
            self.checked = self.checked.wrapping_add(checked);
        }
        self.send_measurements()
    }

    /// Starts the trains.
    ///
    /// # Errors
    /// The start is refused or not answered, or the device is lost.
    pub fn start(&mut self) -> Result<(), RunError> {
        self.epoch = self.start_trains()?;
        let now_us = self.connection.port().now_us();
        self.note_received();
        let is_simulated = self.connection.port().world().is_some();
        // In a simulated world, host time and device time are the same.
        let now = match is_simulated {
            true => now_us,
            false => self.device_time(now_us),
        };
        // The epoch is at most a few milliseconds from now.
        self.started_us = Some((now_us + self.epoch).saturating_sub(now));
        self.begin_keep_alives()?;
        self.post_programs(0)
    }

    /// Sends the first setpoint and starts the armed trains. Returns the device time of the start,
    /// µs.
    fn start_trains(&mut self) -> Result<u64, RunError> {
        // The first setpoint is sent before the first pulse.
        for request in self.requests_before_start() {
            self.connection.request(request)?;
        }
        Ok(self.connection.start()?)
    }

    /// Sends setpoints and processes messages until the end that `until` defines. Does nothing
    /// before [`Self::start`].
    ///
    /// # Errors
    /// The device ended the session or is lost, a signal arrived, the observer ended the session,
    /// or the record cannot be written. Call [`Self::close`] next.
    pub fn step(&mut self, until: StepLimit) -> Result<StepEnd, RunError> {
        let Some(begin) = self.started_us else {
            return Ok(StepEnd::Reached);
        };
        let (to_us, ends_at_event) = match until {
            StepLimit::Time(to_us) => (to_us, false),
            StepLimit::Event(to_us) => (to_us, true),
        };
        self.event = None;
        let to_us = begin.saturating_add(to_us);
        if self.is_live() {
            return self.step_live(to_us, ends_at_event);
        }
        loop {
            if let (true, Some((t_s, event))) = (ends_at_event, self.event.take()) {
                return Ok(StepEnd::Event(t_s, event));
            }
            if self.connection.port().now_us() >= to_us {
                return Ok(StepEnd::Reached);
            }
            let duration_us = self.session.duration_us;
            let due = self.session.setpoints.due_us(self.index);
            self.schedule_triggers(due);
            let listened = self.listen(begin + due.min(duration_us), to_us, ends_at_event)?;
            if listened == ListenEnd::Paused {
                continue;
            }
            self.take_outputs();
            if due >= duration_us || self.is_finished || self.is_stopped {
                self.attached.observer.observe(Observation::Progress(1.0));
                return Ok(StepEnd::Over);
            }
            self.post_due(self.session.setpoints.due_us(self.index - 1), due)?;
            if self.index.is_multiple_of(90) {
                let part = due as f64 / duration_us as f64;
                self.attached.observer.observe(Observation::Progress(part));
            }
            self.index += 1;
        }
    }

    /// Configures, arms and starts the device, and runs the session to its end.
    pub(super) fn run_to_end(&mut self) -> Result<(), RunError> {
        self.configure()?;
        self.arm()?;
        self.start()?;
        self.step(StepLimit::Time(u64::MAX)).map(drop)
    }

    /// Returns the present device time as the host estimates it, µs.
    pub fn device_time_us(&mut self) -> u64 {
        let now_us = self.connection.port().now_us();
        self.device_time(now_us)
    }

    /// Estimates the device time at the time `port_us` of the port, both in µs. Before the first
    /// answer of the device, returns the start of the trains.
    fn device_time(&self, port_us: u64) -> u64 {
        self.connection.device_time(port_us).unwrap_or(self.epoch)
    }

    /// Converts the device time `at_us`, µs, into the time since the start of the trains, s.
    fn since_start_s(&self, at_us: u64) -> f64 {
        trial::seconds_between(at_us, self.epoch)
    }
}
