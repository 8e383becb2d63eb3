//! Where the drive of a device runs, and how a call from Python gets there and back.
//!
//! In simulated time the drive runs in the call itself; in real time it has a thread of its own. A
//! call never holds the interpreter while it waits, and Ctrl-C stops the device before it is raised.

use crate::body::LimbError;
use crate::errors;
use firmware::link::Request;
use host_core::drive::{Drive, DriveError, DriveState, LeasedDrive};
use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::thread::ThreadId;
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
    /// Thread that is in a call at present, to refuse calls that a limb makes to its own device.
    caller: Mutex<Option<ThreadId>>,
    /// Process that opened the device; a forked child must not send anything.
    process: u32,
    limb_error: LimbError,
    /// Time since the start of the trains at the end of the latest wait, µs.
    waited_us: AtomicU64,
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
            caller: Mutex::new(None),
            process: std::process::id(),
            limb_error,
            waited_us: AtomicU64::new(0),
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
        called.map_err(|error| errors::of_drive(py, &error, is_arming))
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
        sent.map_err(|error| errors::of_drive(py, &error, false))
    }

    /// Lets `length_us` of device time pass. Returns the time since the start of the trains, s.
    ///
    /// # Errors
    /// The exception that ended the trial, or `KeyboardInterrupt`.
    pub fn wait(&self, py: Python<'_>, length_us: u64) -> PyResult<f64> {
        let at_us = match self.is_real_time {
            true => self.wait_in_real_time(py, length_us),
            false => self.wait_in_simulated_time(py, length_us),
        }?;
        self.waited_us.store(at_us, Ordering::Relaxed);
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
        if *locked(&self.caller) == Some(std::thread::current().id()) {
            return Err(PyRuntimeError::new_err(
                "a limb cannot call the device that it is part of; return its state instead",
            ));
        }
        Ok(py.detach(|| {
            let mut place = locked(&self.place);
            *locked(&self.caller) = Some(std::thread::current().id());
            let result = work(&mut place);
            *locked(&self.caller) = None;
            result
        }))
    }

    /// Returns the state of the drive.
    pub fn state(&self, py: Python<'_>) -> DriveState {
        let state = self.visit(py, |place| match place {
            Place::Here(drive) => drive.state(),
            Place::Thread(leased) => {
                let state = leased.inspect(|drive| drive.state());
                state.unwrap_or(DriveState::Closed)
            }
            Place::Nowhere => DriveState::Closed,
        });
        state.unwrap_or(DriveState::Closed)
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

    /// Stops the device before an exception is raised.
    pub fn stop_quietly(&self, py: Python<'_>) {
        let stopped = self.visit(py, |place| match place {
            Place::Here(drive) => drop(drive.stop()),
            Place::Thread(leased) => drop(leased.inspect(Drive::stop)),
            Place::Nowhere => {}
        });
        drop(stopped);
    }

    /// Looks for Ctrl-C; the device is stopped before the exception is raised.
    ///
    /// # Errors
    /// `KeyboardInterrupt`, or what a signal handler raised.
    pub fn check_signals(&self, py: Python<'_>) -> PyResult<()> {
        py.check_signals().inspect_err(|_| self.stop_quietly(py))
    }

    /// Raises the exception of a limb in Python, after the device was stopped because of it.
    ///
    /// # Errors
    /// The exception of the limb.
    pub fn raise_limb_error(&self, py: Python<'_>) -> PyResult<()> {
        let Some(error) = self.limb_error.take() else {
            return Ok(());
        };
        self.stop_quietly(py);
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

    fn wait_in_real_time(&self, py: Python<'_>, length_us: u64) -> PyResult<u64> {
        let begin_us = self.call(py, false, |drive| drive.wait(0))?;
        let until_us = begin_us.saturating_add(length_us);
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

    fn wait_in_simulated_time(&self, py: Python<'_>, length_us: u64) -> PyResult<u64> {
        let mut left_us = length_us;
        loop {
            let step_us = left_us.min(SLICE_US);
            let at_us = self.call(py, false, move |drive| drive.wait(step_us))?;
            left_us -= step_us;
            if left_us == 0 {
                return Ok(at_us);
            }
            self.check_signals(py)?;
        }
    }
}
