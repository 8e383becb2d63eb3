//! Where the drive of a device runs, and how a call from Python gets there and back.
//!
//! In simulated time the drive runs in the call itself; in real time it has a thread of its own. A
//! call never holds the interpreter while it waits, and Ctrl-C stops the device before it is raised.

use crate::body::{LimbError, is_in_limb};
use crate::errors;
use firmware::link::Request;
use host_core::drive::{Drive, DriveError, DriveState, LeasedDrive};
use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// Longest device time that passes in a simulation before signals are looked for, µs.
const SLICE_US: u64 = 100_000;

/// Time between two looks for signals while real time passes.
const LOOK: Duration = Duration::from_millis(5);

/// Drive of one device.
pub struct Runner {
    place: Mutex<Place>,
    /// Whether time is real; does not change.
    is_real_time: bool,
    /// Process that opened the device; a forked child must not send anything.
    process: u32,
    limb_error: LimbError,
}

/// Place where a drive runs.
pub enum Place {
    /// Simulated time, which advances in calls only.
    Here(Box<Drive>),
    /// Real time.
    Thread(LeasedDrive),
    /// Closed.
    Nowhere,
}

/// When a wait ends, in device time.
#[derive(Clone, Copy)]
pub enum WaitEnd {
    /// Device time that passes, µs.
    After(u64),
    /// Time since the start of the trains, µs; a time that has passed ends the wait at once.
    At(u64),
}

impl WaitEnd {
    /// Returns the end as a time since the start of the trains, if the wait begins at `now_us`.
    const fn to_time(self, now_us: u64) -> u64 {
        match self {
            Self::After(length_us) => now_us.saturating_add(length_us),
            Self::At(at_us) => at_us,
        }
    }
}

/// Locks a mutex, also one whose holder panicked.
pub fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Returns device time in µs for `seconds` of it.
///
/// # Errors
/// The time is not a number, negative, or longer than a day.
pub fn micros(seconds: f64, name: &str) -> PyResult<u64> {
    if !(0.0..=86_400.0).contains(&seconds) {
        return Err(PyValueError::new_err(format!(
            "{name} must be between 0 and 86400 s (a day), not {seconds}"
        )));
    }
    Ok((seconds * 1e6).round() as u64)
}

impl Runner {
    /// Creates the runner of a drive. A limb in Python reports its exceptions in `limb_error`.
    pub fn new(place: Place, limb_error: LimbError) -> Self {
        Self {
            is_real_time: matches!(place, Place::Thread(_)),
            place: Mutex::new(place),
            process: std::process::id(),
            limb_error,
        }
    }

    /// Carries out `call` where the drive is, without the interpreter, and turns its error into an
    /// exception. `is_arming` says whether the call is `arm()`.
    ///
    /// # Errors
    /// The exception of the call.
    pub fn call<T: Send + 'static>(
        &self,
        py: Python<'_>,
        is_arming: bool,
        call: impl FnOnce(&mut Drive) -> Result<T, DriveError> + Send + 'static,
    ) -> PyResult<T> {
        let called = self.visit(py, |place| match place {
            Place::Here(drive) => call(drive),
            Place::Thread(leased) => leased.call(call),
            Place::Nowhere => Err(DriveError::Closed),
        })?;
        self.raise_limb_error(py)?;
        self.check_signals(py)?;
        called.map_err(|error| errors::of_drive(py, &error, is_arming))
    }

    /// Looks at the drive without the interpreter. A look renews no lease: a program that only watches
    /// does not decide that stimulation goes on.
    ///
    /// # Errors
    /// The device is closed.
    pub fn inspect<T: Send + 'static>(
        &self,
        py: Python<'_>,
        look: impl FnOnce(&mut Drive) -> Result<T, DriveError> + Send + 'static,
    ) -> PyResult<T> {
        let seen = self.visit(py, |place| match place {
            Place::Here(drive) => look(drive),
            Place::Thread(leased) => leased.inspect(look).and_then(|seen| seen),
            Place::Nowhere => Err(DriveError::Closed),
        })?;
        seen.map_err(|error| errors::of_drive(py, &error, false))
    }

    /// Starts the trains, in real time only if the call is fresh.
    ///
    /// # Errors
    /// The exception of the call.
    pub fn start(&self, py: Python<'_>) -> PyResult<()> {
        let started = self.visit(py, |place| match place {
            Place::Here(drive) => drive.start(),
            Place::Thread(leased) => leased.call_promptly(Drive::start),
            Place::Nowhere => Err(DriveError::Closed),
        })?;
        self.raise_limb_error(py)?;
        self.check_signals(py)?;
        started.map_err(|error| errors::of_drive(py, &error, false))
    }

    /// Sends requests, in real time only as long as they are fresh.
    ///
    /// # Errors
    /// The exception of the call.
    pub fn send(&self, py: Python<'_>, requests: Vec<Request>) -> PyResult<()> {
        let sent = self.visit(py, |place| match place {
            Place::Here(drive) => drive.send(requests),
            Place::Thread(leased) => leased.send(requests),
            Place::Nowhere => Err(DriveError::Closed),
        })?;
        self.raise_limb_error(py)?;
        self.check_signals(py)?;
        sent.map_err(|error| errors::of_drive(py, &error, false))
    }

    /// Sends requests, lets device time pass until `at_us` after the start of the trains, and
    /// returns that time, s, and what `look` sees then. A short time of a simulation takes one visit.
    ///
    /// # Errors
    /// The exceptions of [`Self::send`] and [`Self::wait`].
    pub fn advance<T: Send + 'static>(
        &self,
        py: Python<'_>,
        requests: Vec<Request>,
        at_us: u64,
        look: impl FnOnce(&mut Drive) -> T + Copy + Send + 'static,
    ) -> PyResult<(f64, T)> {
        if self.is_real_time {
            self.send(py, requests)?;
        } else {
            let (now_us, seen) = self.call(py, false, move |drive| {
                drive.send(requests)?;
                let most_us = drive.time_us().saturating_add(SLICE_US);
                let now_us = drive.wait_until(at_us.min(most_us))?;
                Ok((now_us, look(drive)))
            })?;
            if now_us >= at_us {
                return Ok((now_us as f64 / 1e6, seen));
            }
        }
        let now_s = self.wait(py, WaitEnd::At(at_us))?;
        let seen = self.inspect(py, move |drive| Ok(look(drive)))?;
        Ok((now_s, seen))
    }

    /// Lets device time pass until `end`. Returns the time since the start of the trains, s.
    ///
    /// # Errors
    /// The exception that ended the trial, or `KeyboardInterrupt`.
    pub fn wait(&self, py: Python<'_>, end: WaitEnd) -> PyResult<f64> {
        let at_us = match self.is_real_time {
            true => self.wait_in_real_time(py, end),
            false => self.wait_in_simulated_time(py, end),
        }?;
        Ok(at_us as f64 / 1e6)
    }

    /// Carries out `work` with the drive locked, without the interpreter, because a limb in Python
    /// needs it on whatever thread the drive runs.
    ///
    /// # Errors
    /// The process was forked from the owner, or a limb calls its own device.
    pub fn visit<T: Send>(
        &self,
        py: Python<'_>,
        work: impl FnOnce(&mut Place) -> T + Send,
    ) -> PyResult<T> {
        if self.process != std::process::id() {
            self.abandon();
            return Err(errors::of_drive(py, &DriveError::Closed, false));
        }
        if is_in_limb() {
            return Err(PyRuntimeError::new_err(
                "a limb cannot call the device that it is part of; return its state instead",
            ));
        }
        Ok(py.detach(|| work(&mut locked(&self.place))))
    }

    /// Returns the state of the drive; in a forked child it is closed.
    ///
    /// # Errors
    /// A limb asks for the state of its own device.
    pub fn state(&self, py: Python<'_>) -> PyResult<DriveState> {
        if self.process != std::process::id() {
            return Ok(DriveState::Closed);
        }
        self.visit(py, |place| match place {
            Place::Here(drive) => drive.state(),
            Place::Thread(leased) => {
                let state = leased.inspect(|drive| drive.state());
                state.unwrap_or(DriveState::Closed)
            }
            Place::Nowhere => DriveState::Closed,
        })
    }

    /// Stops and closes the drive. In a forked child, only forgets it.
    ///
    /// # Errors
    /// The device did not acknowledge the stop, or the record cannot be written.
    pub fn close(&self, py: Python<'_>) -> PyResult<()> {
        if self.process != std::process::id() {
            self.abandon();
            return Ok(());
        }
        let closed = self.visit(py, |place| match std::mem::replace(place, Place::Nowhere) {
            Place::Here(mut drive) => drive.close(),
            Place::Thread(leased) => leased.inspect(Drive::close).and_then(|closed| closed),
            Place::Nowhere => Ok(()),
        })?;
        closed.map_err(|error| errors::of_drive(py, &error, false))
    }

    /// Stops the device because of `reason`, which the record names.
    ///
    /// # Errors
    /// The device did not acknowledge the stop, or the record cannot be written.
    pub fn stop_early(&self, py: Python<'_>, reason: String) -> PyResult<()> {
        let stop = move |drive: &mut Drive| drive.stop_early(&reason);
        let stopped = self.visit(py, |place| match place {
            Place::Here(drive) => stop(drive),
            Place::Thread(leased) => leased.inspect(stop).and_then(|stopped| stopped),
            Place::Nowhere => Ok(()),
        })?;
        stopped.map_err(|error| errors::of_drive(py, &error, false))
    }

    /// Stops the device because of `error`, before it is raised.
    fn stop_for(&self, py: Python<'_>, error: &PyErr) {
        // The exception says more than an error of the stop.
        drop(self.stop_early(py, errors::ended_by(py, error)));
    }

    /// Looks for Ctrl-C; the device is stopped before the exception is raised.
    ///
    /// # Errors
    /// `KeyboardInterrupt`, or what a signal handler raised.
    pub fn check_signals(&self, py: Python<'_>) -> PyResult<()> {
        py.check_signals()
            .inspect_err(|error| self.stop_for(py, error))
    }

    /// Raises the exception of a limb in Python, after the device was stopped because of it.
    ///
    /// # Errors
    /// The exception of the limb.
    pub fn raise_limb_error(&self, py: Python<'_>) -> PyResult<()> {
        let Some(error) = self.limb_error.take() else {
            return Ok(());
        };
        self.stop_for(py, &error);
        Err(error)
    }

    /// Forgets the drive without a message to the device, because another process owns it.
    fn abandon(&self) {
        let Ok(mut place) = self.place.try_lock() else {
            return; // a call was under way when the process was forked
        };
        match std::mem::replace(&mut *place, Place::Nowhere) {
            Place::Thread(leased) => leased.abandon(),
            // Its drop could write to the record that the owner still writes.
            Place::Here(drive) => std::mem::forget(drive),
            Place::Nowhere => {}
        }
    }

    fn wait_in_real_time(&self, py: Python<'_>, end: WaitEnd) -> PyResult<u64> {
        let until_us = end.to_time(self.call(py, false, |drive| drive.wait(0))?);
        loop {
            let seen = self.visit(py, |place| match place {
                Place::Thread(leased) => leased.renew().map(|at| (at, leased.is_running())),
                Place::Here(_) | Place::Nowhere => Err(DriveError::Closed),
            })?;
            self.raise_limb_error(py)?;
            let (now_us, is_running) = seen.map_err(|error| errors::of_drive(py, &error, false))?;
            if now_us >= until_us {
                return Ok(now_us);
            }
            if !is_running {
                return self.call(py, false, |drive| drive.wait(0)); // says why
            }
            let left = Duration::from_micros(until_us - now_us);
            py.detach(|| std::thread::sleep(left.min(LOOK)));
            self.check_signals(py)?;
        }
    }

    fn wait_in_simulated_time(&self, py: Python<'_>, end: WaitEnd) -> PyResult<u64> {
        let (at_us, until_us) = self.call(py, false, move |drive| {
            let now_us = drive.time_us();
            let until_us = end.to_time(now_us);
            let at_us = drive.wait_until(until_us.min(now_us.saturating_add(SLICE_US)))?;
            Ok((at_us, until_us))
        })?;
        let mut at_us = at_us;
        while at_us < until_us {
            self.check_signals(py)?;
            let to_us = until_us.min(at_us.saturating_add(SLICE_US));
            at_us = self.call(py, false, move |drive| drive.wait_until(to_us))?;
        }
        Ok(at_us)
    }
}

impl Drop for Runner {
    /// Stops and closes the device without the interpreter, because a limb in Python needs it on the
    /// thread of the drive.
    fn drop(&mut self) {
        if self.process != std::process::id() {
            return self.abandon();
        }
        let place = std::mem::replace(&mut *locked(&self.place), Place::Nowhere);
        let mut place = Some(place);
        // At the end of the interpreter there is none to release.
        let _ = Python::try_attach(|py| py.detach(|| drop(place.take())));
    }
}
