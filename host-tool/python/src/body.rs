//! A simulated limb that is a Python callable.

use crate::convert::number;
use hal_sim::body::{Body, CHANNELS, Drive, Load, Pulse};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList, PyTuple};
use std::cell::Cell;
use std::sync::{Arc, Mutex, PoisonError};

thread_local! {
    /// Whether this thread computes a limb at present.
    static IN_LIMB: Cell<bool> = const { Cell::new(false) };
}

/// Returns whether this thread computes a limb at present, which must not wait for its device.
pub fn is_in_limb() -> bool {
    IN_LIMB.get()
}

/// First exception that a limb raised; the call that let time pass raises it again.
#[derive(Clone, Default)]
pub struct LimbError(Arc<Mutex<Option<PyErr>>>);

impl LimbError {
    /// Keeps an exception, unless there is one already.
    fn set(&self, error: PyErr) {
        let mut slot = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        slot.get_or_insert(error);
    }

    /// Removes and returns the exception.
    pub fn take(&self) -> Option<PyErr> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).take()
    }
}

/// Limb whose state a Python callable computes once per period, from the pulses since its last call.
pub struct PythonLimb {
    callable: Py<PyAny>,
    period_us: u64,
    /// Time of the next call, µs.
    next_us: u64,
    pulses: Vec<Pulse>,
    angle_deg: f64,
    sensed_deg: f64,
    loads: [Load; CHANNELS],
    error: LimbError,
    /// Whether the callable raised an exception. It is then not called again.
    has_failed: bool,
}

impl PythonLimb {
    /// Creates a limb and calls `callable` for its first state, with no pulses at time 0.
    ///
    /// # Errors
    /// The exception of the callable.
    pub fn new(callable: Py<PyAny>, period_us: u64, error: LimbError) -> Self {
        let mut limb = Self {
            callable,
            period_us,
            next_us: 0,
            pulses: Vec::new(),
            angle_deg: 0.0,
            sensed_deg: 0.0,
            loads: [Load::Ohms(1_000.0); CHANNELS],
            error,
            has_failed: false,
        };
        limb.call(0);
        limb.next_us = period_us;
        limb
    }

    /// Calls the callable for its state at `t_us`. After an exception the limb stays as it is.
    fn call(&mut self, t_us: u64) {
        let pulses = std::mem::take(&mut self.pulses);
        if self.has_failed {
            return;
        }
        IN_LIMB.set(true);
        let called = Python::attach(|py| {
            let list = PyList::empty(py);
            for pulse in pulses {
                list.append(to_python(py, &pulse)?)?;
            }
            let state = self.callable.bind(py).call1((list, t_us as f64 / 1e6))?;
            self.read(&state)
        });
        IN_LIMB.set(false);
        if let Err(error) = called {
            self.has_failed = true;
            self.error.set(error);
        }
    }

    /// Reads what the callable returned: an angle, or a pair of angle and electrode loads.
    fn read(&mut self, state: &Bound<'_, PyAny>) -> PyResult<()> {
        let (angle, loads) = match state.cast::<PyTuple>() {
            Ok(pair) if pair.len() == 2 => (pair.get_item(0)?, Some(pair.get_item(1)?)),
            _ => (state.clone(), None),
        };
        let angle_deg = number(&angle, "the angle that the limb returned, °,")?;
        if !angle_deg.is_finite() {
            let message = format!("the limb returned {angle_deg} as its angle; it must be finite");
            return Err(PyValueError::new_err(message));
        }
        if let Some(loads) = loads {
            let Ok(loads) = loads.cast::<PyDict>() else {
                return Err(PyTypeError::new_err(
                    "a limb returns its angle in °, or a pair of the angle and a dictionary from \
                     channel to load in Ω",
                ));
            };
            for (channel, load) in loads {
                let channel: usize = channel.extract()?;
                let ohm = number(&load, "the load that the limb returned, Ω,")?;
                let slot = channel.checked_sub(1).and_then(|n| self.loads.get_mut(n));
                match slot {
                    Some(slot) if ohm > 0.0 => {
                        *slot = if ohm.is_finite() {
                            Load::Ohms(ohm)
                        } else {
                            Load::Open
                        };
                    }
                    Some(_) => return Err(PyValueError::new_err("a load must be above 0 Ω")),
                    None => return Err(PyValueError::new_err("channels are numbered 1 to 10")),
                }
            }
        }
        (self.angle_deg, self.sensed_deg) = (angle_deg, angle_deg);
        Ok(())
    }
}

/// Returns a pulse as Python's `flexor.Pulse`: time in s, channel from 1, amplitude, unit, width.
fn to_python<'py>(py: Python<'py>, pulse: &Pulse) -> PyResult<Bound<'py, PyAny>> {
    let (value, unit) = match pulse.drive {
        Drive::Milliamps(ma) => (ma, "mA"),
        Drive::Volts(v) => (v, "V"),
    };
    let fields = (
        pulse.t_us as f64 / 1e6,
        pulse.channel + 1,
        value,
        unit,
        pulse.width_us,
    );
    py.import("flexor._limb")?.getattr("Pulse")?.call1(fields)
}

impl Body for PythonLimb {
    fn pulse(&mut self, pulse: &Pulse) {
        self.pulses.push(*pulse);
    }

    fn advance(&mut self, to_us: u64) -> bool {
        let mut is_changed = false;
        while self.next_us <= to_us {
            self.call(self.next_us);
            self.next_us += self.period_us;
            is_changed = true;
        }
        is_changed
    }

    fn angle_deg(&self) -> f64 {
        self.angle_deg
    }

    fn sensed_deg(&self) -> f64 {
        self.sensed_deg
    }

    fn loads(&self) -> &[Load; CHANNELS] {
        &self.loads
    }

    fn loads_mut(&mut self) -> &mut [Load; CHANNELS] {
        &mut self.loads
    }
}
