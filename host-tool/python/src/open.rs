//! Opens the device that an address names.

use crate::body::{LimbError, PythonLimb};
use crate::errors;
use crate::runner::{Place, Runner, micros};
use crate::session::now;
use firmware::link::HelloInfo;
use firmware::safety::{StageKind, Stages};
use host_core::drive::{BodyMaker, Drive, DriveError, LeasedDrive, MAX_LEASE, Source, TrialLog};
use host_core::record::PROGRAM_COMMAND;
use host_core::run::DeviceName;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::path::PathBuf;
use std::time::Duration;

/// Arguments with which a device is opened.
pub struct OpenArguments {
    /// Address, such as `sim:`.
    pub address: String,
    /// Seed of the simulated wearer's noise.
    pub seed: u64,
    /// Folder for the record.
    pub record: Option<PathBuf>,
    /// Title of the record.
    pub title: String,
    /// Time after which a device in real time stops without a call, s.
    pub lease_s: f64,
    /// Time between two samples, ms.
    pub telemetry_ms: u16,
    /// Whether records keep all edges.
    pub all_edges: bool,
    /// Callable that computes the limb, and the time between two calls of it, s.
    pub limb: Option<(Py<PyAny>, f64)>,
}

impl OpenArguments {
    /// Checks the arguments and opens the device. Arms and starts nothing.
    ///
    /// # Errors
    /// An argument is not possible, or the device cannot be opened.
    pub fn open(self, py: Python<'_>) -> PyResult<(Runner, Option<HelloInfo>)> {
        self.check()?;
        let limb_error = LimbError::default();
        let body = match self.limb {
            Some((callable, period_s)) => {
                let period_us = micros(period_s, "limb_period_s")?;
                Some(body_maker(callable, period_us, limb_error.clone()))
            }
            None => None,
        };
        let source = Address::read(&self.address)?.source(self.seed, body);
        let opened = py.detach(|| {
            let (name, seed) = (source.name(), source.seed());
            let mut drive = Drive::new(source);
            drive.set_telemetry_period(self.telemetry_ms);
            if self.all_edges {
                drive.keep_all_edges();
            }
            // The device first: a record without a device would be in the way of the next try.
            let info = drive.open()?;
            if let Some(dir) = &self.record {
                let device = (&*name, seed);
                let log = TrialLog::begin(dir, &self.title, PROGRAM_COMMAND, device, now())?;
                drive.record_in(log);
            }
            Ok((drive, info))
        });
        let (drive, info) = opened.map_err(|e: DriveError| errors::of_opening(py, &e))?;
        let place = match self.address == "sim:" {
            true => Place::Here(Box::new(drive)),
            false => {
                let lease = Duration::from_secs_f64(self.lease_s);
                Place::Thread(LeasedDrive::start(drive, lease).map_err(errors::internal)?)
            }
        };
        Ok((Runner::new(place, limb_error), info))
    }

    fn check(&self) -> PyResult<()> {
        if !(0.05..=MAX_LEASE.as_secs_f64()).contains(&self.lease_s) {
            return Err(PyValueError::new_err(format!(
                "lease_s must be between 0.05 and {} s, not {}: it is the time after which \
                 stimulation stops if the program makes no call",
                MAX_LEASE.as_secs(),
                self.lease_s
            )));
        }
        if !(1..=1000).contains(&self.telemetry_ms) {
            let message = "telemetry_ms must be between 1 and 1000";
            return Err(PyValueError::new_err(message));
        }
        let Some((_, period_s)) = &self.limb else {
            return Ok(());
        };
        if !self.address.starts_with("sim:") {
            return Err(PyValueError::new_err(
                "limb= replaces the simulated wearer, so it needs the address sim: or sim:realtime",
            ));
        }
        match (0.0001..=1.0).contains(period_s) {
            true => Ok(()),
            false => Err(PyValueError::new_err(
                "limb_period_s must be between 0.0001 and 1 s",
            )),
        }
    }
}

/// Returns a function that creates the limb that `callable` computes.
fn body_maker(callable: Py<PyAny>, period_us: u64, error: LimbError) -> BodyMaker {
    Box::new(move |_, _| {
        let callable = Python::attach(|py| callable.clone_ref(py));
        let limb = PythonLimb::new(callable, period_us, error.clone());
        Ok(Box::new(limb))
    })
}

/// Device that an address names.
pub struct Address {
    /// The native simulator, or a port.
    pub name: DeviceName,
    /// Whether a simulator advances at the pace of the clock.
    pub is_paced: bool,
}

impl Address {
    /// Reads an address such as `sim:`.
    ///
    /// # Errors
    /// The text is no address.
    pub fn read(address: &str) -> PyResult<Self> {
        let (name, is_paced) = match address.split_once(':') {
            Some(("sim", "")) => (Some(DeviceName::Native), false),
            Some(("sim", "realtime")) => (Some(DeviceName::Native), true),
            Some(("serial", path)) if !path.is_empty() => (path.parse().ok(), false),
            Some(("tcp", place)) if !place.is_empty() => (address.parse().ok(), false),
            _ => (None, false),
        };
        let name = name.ok_or_else(|| errors::wrong_address(address))?;
        Ok(Self { name, is_paced })
    }

    /// Returns the source of the device, with a limb that a program computes if there is one.
    fn source(self, seed: u64, body: Option<BodyMaker>) -> Source {
        match self.name {
            DeviceName::Native => Source::Simulated {
                seed,
                body,
                is_paced: self.is_paced,
            },
            name => Source::Device(name),
        }
    }
}

/// Returns the output stages that a board has stored, by channel from 1, as fields of a session.
pub fn stages_by_channel<'py>(py: Python<'py>, stages: &Stages) -> PyResult<Bound<'py, PyDict>> {
    let known = PyDict::new(py);
    let Stages::Stored(table) = stages else {
        return Ok(known);
    };
    for (channel, stage) in (1..).zip(&table.stages) {
        let fields = PyDict::new(py);
        match stage {
            Some(StageKind::Current { full_scale_ua }) => {
                fields.set_item("full_scale_ma", f64::from(*full_scale_ua) / 1e3)?;
            }
            Some(StageKind::Voltage { full_scale_mv }) => {
                fields.set_item("full_scale_v", f64::from(*full_scale_mv) / 1e3)?;
            }
            None => continue,
        }
        known.set_item(channel, fields)?;
    }
    Ok(known)
}
