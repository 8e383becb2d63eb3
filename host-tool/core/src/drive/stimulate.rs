//! Arming, setpoints, waiting and stopping: the life of a trial.

use super::error::RequiredState;
use super::outputs::DriveOutputs;
use super::{DeviceStepper, Drive, DriveError, Stage, TrialLog, refusal};
use crate::choice;
use crate::link::{Port, stamp};
use crate::record::ElectrodeReading;
use crate::run::{
    Attachments, Control, RunError, SessionFile, StepEnd, StepLimit, Stepper, attach_electrodes,
};
use crate::session::{BodySpec, Programs, Session};
use firmware::link::Request;

/// Time within which the events are read that came before a refusal, µs.
const EVENTS_US: u64 = 1_000;

impl Drive {
    /// Configures the device for the session of `file` and arms it, which checks the electrodes.
    /// Returns the readings of that check. The host then sends what the program asks for, and
    /// nothing of the session's setpoints.
    ///
    /// # Errors
    /// The drive is not idle, the session does not fit the device, or arming is refused. The
    /// outputs are then disconnected.
    pub fn arm(&mut self, mut file: SessionFile) -> Result<Vec<ElectrodeReading>, DriveError> {
        let port = match &mut self.stage {
            Stage::Idle(port) => port.take(),
            Stage::Active { .. } | Stage::Closed => {
                return Err(self.wrong_state("arm", RequiredState::Idle));
            }
        };
        choice::resolve_auto_models(&mut file.session)?;
        let port = self.prepare_port(port, &file.session)?;
        let recorder = match &mut self.log {
            Some(log) => Some(Box::new(Box::new(log.begin_trial(self.count, &file)?)) as _),
            None => None,
        };
        self.count += 1;
        self.outputs = DriveOutputs::new(&file.session, self.keeps_edges);
        let attached = Attachments {
            recorder,
            outputs: Some(Box::new(self.outputs.clone())),
            observer: Box::new(self.telemetry.clone()),
        };
        self.session = Some(file.session.clone());
        let stepper = Stepper::open_owned(file, port, attached)?.with_live_setpoints();
        self.stage = Stage::Active {
            stepper: Box::new(stepper),
            is_started: false,
        };
        let telemetry = Request::Subscribe {
            period_ms: self.telemetry_ms,
        };
        self.attempt(|stepper| {
            stepper.configure()?;
            stepper.request(telemetry)?;
            stepper.arm()?;
            stepper.read_electrodes()
        })?;
        let readings = self.trial().map(|trial| trial.electrode_check.clone());
        Ok(readings.unwrap_or_default())
    }

    /// Starts the armed trains. All amplitudes are 0 until a setpoint raises them.
    ///
    /// # Errors
    /// The drive is not armed, or the start is refused; the outputs are then disconnected.
    pub fn start(&mut self) -> Result<(), DriveError> {
        let Stage::Active { is_started, .. } = &mut self.stage else {
            return Err(self.wrong_state("start", RequiredState::Armed));
        };
        if std::mem::replace(is_started, true) {
            return Err(self.wrong_state("start", RequiredState::Armed));
        }
        self.attempt(|stepper| stepper.start())
    }

    /// Sends requests one after the other and waits for the acknowledgement of each.
    ///
    /// # Errors
    /// A request is refused, and the later ones are not sent; stimulation continues as before. Or
    /// the drive is not armed, or the device is lost.
    pub fn send(&mut self, requests: Vec<Request>) -> Result<(), DriveError> {
        let Stage::Active {
            stepper,
            is_started,
        } = &mut self.stage
        else {
            return Err(self.wrong_state("set", RequiredState::Armed));
        };
        for request in requests {
            let Err(error) = stepper.request(request) else {
                continue;
            };
            if refusal(&error).is_none() {
                return Err(self.end(error));
            }
            // A device that has just ended stimulation refuses, too. The end says more.
            if *is_started {
                self.wait(EVENTS_US)?;
            }
            return Err(error.into());
        }
        Ok(())
    }

    /// Replaces the programs, which give the amplitudes of their channels over time.
    ///
    /// # Errors
    /// The drive is not armed, or the device is lost.
    pub fn set_programs(&mut self, programs: Programs) -> Result<(), DriveError> {
        if !matches!(self.stage, Stage::Active { .. }) {
            return Err(self.wrong_state("set", RequiredState::Armed));
        }
        self.attempt(|stepper| stepper.set_programs(programs))
    }

    /// Lets time pass until `length_us` from now, while the device's messages are recorded and
    /// programs are sent. Returns the time since the start of the trains, µs.
    ///
    /// # Errors
    /// The drive is not running, the device ended stimulation, or it is lost.
    pub fn wait(&mut self, length_us: u64) -> Result<u64, DriveError> {
        let to_us = self.time_us().saturating_add(length_us);
        self.wait_until(to_us)
    }

    /// Lets time pass until `to_us` after the start of the trains, as [`Self::wait`] does.
    ///
    /// # Errors
    /// The errors of [`Self::wait`].
    pub fn wait_until(&mut self, to_us: u64) -> Result<u64, DriveError> {
        let Stage::Active {
            stepper,
            is_started: true,
        } = &mut self.stage
        else {
            return Err(self.wrong_state("wait", RequiredState::Running));
        };
        match stepper.step(StepLimit::Time(to_us)) {
            Ok(StepEnd::Reached | StepEnd::Event(..)) => Ok(stepper.time_us()),
            Ok(StepEnd::Over) => Err(self.finish()),
            Err(error) => Err(self.end(error)),
        }
    }

    /// Stops stimulation, or disarms; [`Self::trial`] is then the complete trial. Does nothing if
    /// nothing is armed.
    ///
    /// # Errors
    /// The device did not acknowledge the stop, and stops by itself after its host timeout; or the
    /// record cannot be written.
    pub fn stop(&mut self) -> Result<(), DriveError> {
        match &self.stage {
            Stage::Active { .. } => Ok(self.close_stepper(Ok(())).map_or(Ok(()), Err)?),
            Stage::Idle(_) | Stage::Closed => Ok(()),
        }
    }

    /// Stops stimulation, or disarms, before the trial was to end; the record says that it ended
    /// early because of `reason`. Does nothing if nothing is armed.
    ///
    /// # Errors
    /// The errors of [`Self::stop`].
    pub fn stop_early(&mut self, reason: &str) -> Result<(), DriveError> {
        if !matches!(self.stage, Stage::Active { .. }) {
            return Ok(());
        }
        self.stop()?;
        if let Some(log) = &mut self.log {
            log.note_early_end(reason);
        }
        self.ended = Some(reason.to_owned());
        Ok(())
    }

    /// Stops stimulation, closes the port and completes the record.
    ///
    /// # Errors
    /// The device did not acknowledge the stop, or the record cannot be written.
    pub fn close(&mut self) -> Result<(), DriveError> {
        let stopped = match &self.stage {
            Stage::Active { .. } => self.close_stepper(Ok(())).map_or(Ok(()), Err),
            Stage::Idle(_) | Stage::Closed => Ok(()),
        };
        self.stage = Stage::Closed;
        let kept = self.log.take().map_or(Ok(()), TrialLog::close);
        stopped?;
        Ok(kept?)
    }

    /// Sends an angle that the program has measured, °, of the joint with this number on the link.
    /// The device takes it as measured now.
    ///
    /// # Errors
    /// The angle is not possible or not expected, the drive is not armed, or the device is lost.
    pub fn measure(&mut self, joint: u8, deg: f64) -> Result<(), DriveError> {
        let Stage::Active { stepper, .. } = &mut self.stage else {
            return Err(self.wrong_state("measure", RequiredState::Armed));
        };
        let at = stamp(stepper.device_time_us());
        let centideg = (deg * 100.0).round() as i16; // saturates, and the device refuses it
        self.send(vec![Request::Measurement {
            joint,
            centideg,
            at,
        }])
    }

    /// Adds a mark with `text` to the record at the present time.
    ///
    /// # Errors
    /// The drive is not armed, or the record cannot be written.
    pub fn mark(&mut self, text: &str) -> Result<(), DriveError> {
        if !matches!(self.stage, Stage::Active { .. }) {
            return Err(self.wrong_state("mark", RequiredState::Armed));
        }
        let control = Control::Mark(text.to_owned());
        self.attempt(|stepper| stepper.control(&control))
    }

    /// Gives the trigger input of a simulated device an edge now, and holds the input for
    /// `held_us`.
    ///
    /// # Errors
    /// The device is real, or nothing is armed.
    pub fn trigger(&mut self, held_us: u64) -> Result<(), DriveError> {
        let Stage::Active { stepper, .. } = &mut self.stage else {
            return Err(self.wrong_state("trigger", RequiredState::Armed));
        };
        let Some(world) = stepper.port().world() else {
            return Err(DriveError::NotSimulated("trigger()"));
        };
        let now_us = world.now_us();
        world.hold_trigger(now_us, held_us);
        Ok(())
    }

    /// Returns the port of the device for `session`: the open one, or a new one.
    fn prepare_port(
        &mut self,
        open: Option<Box<dyn Port>>,
        session: &Session,
    ) -> Result<Box<dyn Port>, DriveError> {
        let Some(mut port) = open else {
            return Ok(self.source.open(session)?);
        };
        if let Some(world) = port.world() {
            let worn: Option<&BodySpec> = self.session.as_ref().and_then(|last| last.body.as_ref());
            if worn != session.body.as_ref() {
                self.stage = Stage::Idle(Some(port));
                return Err(DriveError::OtherBody);
            }
            attach_electrodes(world, session);
        }
        Ok(port)
    }

    /// Stops stimulation because the program did not renew its lease of `lease_s`, and returns the
    /// error that says so.
    #[cfg(feature = "realtime")]
    pub(super) fn stop_expired(&mut self, lease_s: f64) -> DriveError {
        let expired = DriveError::LeaseExpired { lease_s };
        self.stop_early(&expired.to_string())
            .err()
            .unwrap_or(expired)
    }

    /// Carries out a step of the present trial. An error ends the trial.
    fn attempt(
        &mut self,
        step: impl FnOnce(&mut DeviceStepper) -> Result<(), RunError>,
    ) -> Result<(), DriveError> {
        let Stage::Active { stepper, .. } = &mut self.stage else {
            return Err(DriveError::Closed);
        };
        match step(stepper) {
            Ok(()) => Ok(()),
            Err(error) => Err(self.end(error)),
        }
    }

    /// Ends the present trial because of `error`, and returns that error.
    fn end(&mut self, error: RunError) -> DriveError {
        match self.close_stepper(Err(error)) {
            Some(error) => error.into(),
            None => DriveError::Over, // an error always comes back
        }
    }

    /// Ends the present trial after its last pulse, and returns the error that says so.
    fn finish(&mut self) -> DriveError {
        self.close_stepper(Ok(()))
            .map_or(DriveError::Over, Into::into)
    }

    /// Stops the device, completes the trial and keeps the port. Returns the first error.
    fn close_stepper(&mut self, ran: Result<(), RunError>) -> Option<RunError> {
        let stage = std::mem::replace(&mut self.stage, Stage::Idle(None));
        let Stage::Active { stepper, .. } = stage else {
            self.stage = stage;
            return None;
        };
        let (outcome, port, attached) = stepper.close_keeping_attachments(ran);
        let (mut trial, mut error) = (outcome.trial, outcome.error);
        trial.edges = self.outputs.take_edges();
        if let Some(mut recorder) = attached.recorder {
            let closed = recorder
                .record_edges(&trial.edges)
                .and_then(|()| recorder.finish(&trial.counters, trial.duration_s));
            error = error.or(closed.err().map(RunError::from));
        }
        if let Some(log) = &mut self.log {
            let kept = log.end_trial(&trial, error.as_ref());
            error = error.or(kept.err().map(RunError::from));
        }
        self.ended = error.as_ref().map(ToString::to_string);
        self.trial = Some(trial);
        self.stage = Stage::Idle(self.source.is_reusable(error.as_ref()).then_some(port));
        error
    }
}
