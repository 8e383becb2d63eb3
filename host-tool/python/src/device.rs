//! A device that Python drives call by call.

use crate::open::{OpenArguments, stages_by_channel};
use crate::record::{Column, ReadingTuple, Record, columns, reading_tuple};
use crate::runner::{Place, Runner, WaitEnd, locked, micros};
use crate::session::{SessionArgument, read};
use crate::{body::LimbError, errors, setpoints};
use firmware::link::{HelloInfo, Request};
use firmware::safety::{ListedPulse, MAX_LISTED};
use firmware::units::Amplitude;
use host_core::drive::{Drive, DriveState, LEAST, LatestAmplitudes, check_channel};
use host_core::run::{describe_stages, identity};
use host_core::session::Session;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::path::PathBuf;
use std::sync::{Arc, Mutex};

/// A device behind an address.
#[pyclass(frozen, module = "flexor._native")]
pub struct Device {
    runner: Runner,
    /// Present setup, for the checks of `send`.
    setup: Mutex<Option<Setup>>,
    info: Option<HelloInfo>,
    folder: Option<PathBuf>,
}

/// Session of the present setup and the latest amplitudes.
#[derive(Clone)]
struct Setup {
    session: Arc<Session>,
    latest: LatestAmplitudes,
}

/// Time, reference, measured and true angle, and effort of a sample.
type Latest = (f64, Option<f64>, Option<f64>, Option<f64>, Option<f64>);

#[pymethods]
impl Device {
    /// Connects to the device at `address`. Arms and starts nothing.
    #[new]
    #[pyo3(signature = (
        address, *, seed, record, title, lease_s, telemetry_ms, all_edges, limb, limb_period_s
    ))]
    #[expect(clippy::too_many_arguments, reason = "keyword arguments of Python")]
    fn new(
        py: Python<'_>,
        address: String,
        seed: u64,
        record: Option<PathBuf>,
        title: String,
        lease_s: f64,
        telemetry_ms: u16,
        all_edges: bool,
        limb: Option<Py<PyAny>>,
        limb_period_s: f64,
    ) -> PyResult<Self> {
        let arguments = OpenArguments {
            address,
            seed,
            record: record.clone(),
            title,
            lease_s,
            telemetry_ms,
            all_edges,
            limb: limb.map(|callable| (callable, limb_period_s)),
        };
        let (runner, info) = arguments.open(py)?;
        Ok(Self {
            runner,
            setup: Mutex::new(None),
            info,
            folder: record,
        })
    }

    /// What the device says of itself; `None` for a simulator in this process.
    fn info<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyDict>>> {
        let Some(info) = &self.info else {
            return Ok(None);
        };
        let known = identity(info, false);
        let dict = PyDict::new(py);
        dict.set_item("simulated", known.simulated)?;
        dict.set_item("firmware", known.firmware)?;
        dict.set_item("board", info.board.as_str())?;
        dict.set_item("unique_id", known.unique_id)?;
        dict.set_item("reset", known.reset)?;
        dict.set_item("stages", describe_stages(&info.stages))?;
        dict.set_item("stages_by_channel", stages_by_channel(py, &info.stages)?)?;
        Ok(Some(dict))
    }

    /// Configures and arms the device; returns the readings of the electrode check.
    fn arm(&self, py: Python<'_>, session: SessionArgument<'_>) -> PyResult<Vec<ReadingTuple>> {
        let file = read(py, &session)?;
        let session = Arc::new(file.session.clone());
        let readings = self.runner.call(py, true, move |drive| drive.arm(file))?;
        *locked(&self.setup) = Some(Setup {
            session,
            latest: LatestAmplitudes::default(),
        });
        self.runner.check_signals(py)?;
        Ok(readings.iter().map(reading_tuple).collect())
    }

    /// Starts the armed trains.
    fn start(&self, py: Python<'_>) -> PyResult<()> {
        self.runner.start(py)
    }

    /// Sends setpoints: all of them or none.
    #[pyo3(signature = (**arguments))]
    fn send(&self, py: Python<'_>, arguments: Option<&Bound<'_, PyDict>>) -> PyResult<()> {
        let (requests, setup) = self.requests(py, arguments)?;
        self.runner.send(py, requests)?;
        self.note_amplitudes(setup);
        Ok(())
    }

    /// Checks setpoints as `send` does, and sends nothing.
    #[pyo3(signature = (**arguments))]
    fn check_values(&self, py: Python<'_>, arguments: Option<&Bound<'_, PyDict>>) -> PyResult<()> {
        self.requests(py, arguments).map(drop)
    }

    /// Replaces the programs of the present setup by those of `session`, whose channels are the
    /// same.
    fn play(&self, py: Python<'_>, session: SessionArgument<'_>) -> PyResult<()> {
        let programs = read(py, &session)?.session.setpoints.programs;
        self.runner
            .call(py, false, move |drive| drive.set_programs(programs))
    }

    /// Plays a list of pulses: for each its amplitude, width in µs, and delay in µs after the start
    /// of the pulse before.
    fn play_pulses(
        &self,
        py: Python<'_>,
        channel: u8,
        pulses: Vec<(f64, u16, u32)>,
    ) -> PyResult<()> {
        let index = self.channel_index(py, channel)?;
        if pulses.is_empty() || pulses.len() > MAX_LISTED {
            return Err(PyValueError::new_err("a list has 1 to 16 pulses"));
        }
        let mut listed = Vec::new();
        for (amplitude, width_us, after_us) in pulses {
            if amplitude != 0.0 && !(LEAST..=150.0).contains(&amplitude) {
                let message = format!(
                    "{amplitude} is not an amplitude in mA or V; allowed: 0, or {LEAST} up to the \
                     channel's limit"
                );
                return Err(PyValueError::new_err(message));
            }
            listed.push(ListedPulse {
                amplitude: Amplitude::new((amplitude * 1e3).round() as u32), // at most 150 000
                width_us,
                after_us,
            });
        }
        let request = Request::Pulses {
            channel: index,
            pulses: listed.into_iter().collect(),
        };
        self.runner.send(py, vec![request])
    }

    /// Sends a measured angle of a joint, °.
    fn measure(&self, py: Python<'_>, joint: u8, deg: f64) -> PyResult<()> {
        if !deg.is_finite() {
            return Err(PyValueError::new_err(
                "an angle must be a finite number of degrees",
            ));
        }
        self.runner
            .call(py, false, move |drive| drive.measure(joint, deg))
    }

    /// Adds a mark to the record.
    fn mark(&self, py: Python<'_>, text: String) -> PyResult<()> {
        self.runner.call(py, false, move |drive| drive.mark(&text))
    }

    /// Gives a simulated trigger input an edge and holds it, s.
    fn trigger(&self, py: Python<'_>, held_s: f64) -> PyResult<()> {
        let held_us = micros(held_s, "held_s")?;
        self.runner
            .call(py, false, move |drive| drive.trigger(held_us))
    }

    /// Lets `seconds` of device time pass. Returns the time since the start of the trains, s.
    fn wait(&self, py: Python<'_>, seconds: f64) -> PyResult<f64> {
        let length_us = micros(seconds, "the time to wait")?;
        self.runner.wait(py, WaitEnd::After(length_us))
    }

    /// Lets device time pass until `t_s` after the start of the trains. Returns that time, s.
    fn wait_until(&self, py: Python<'_>, t_s: f64) -> PyResult<f64> {
        let at_us = micros(t_s, "t_s")?;
        self.runner.wait(py, WaitEnd::At(at_us))
    }

    /// Sends setpoints if there are any, lets device time pass until `t_s` after the start of the
    /// trains, and returns that time and the latest sample. One call, because each takes the drive
    /// from the interpreter and back.
    #[pyo3(signature = (t_s, **arguments))]
    fn advance(
        &self,
        py: Python<'_>,
        t_s: f64,
        arguments: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<(f64, Option<Latest>)> {
        let at_us = micros(t_s, "t_s")?;
        let (requests, setup) = match arguments {
            Some(_) => self.requests(py, arguments)?,
            None => (Vec::new(), None),
        };
        let (now_s, latest) = self.runner.advance(py, requests, at_us, latest_sample)?;
        self.note_amplitudes(setup);
        Ok((now_s, latest))
    }

    /// Stops the device and returns the trial; `None` if there is none.
    fn stop(&self, py: Python<'_>) -> PyResult<Option<Record>> {
        let folder = self.folder.clone();
        let stop = |drive: &mut Drive| {
            let stopped = drive.stop();
            let reason = drive.early_end().map(str::to_owned);
            stopped.map(|()| (drive.trial().cloned(), reason))
        };
        let done = self.runner.visit(py, |place| match place {
            Place::Here(drive) => stop(drive),
            Place::Thread(leased) => {
                let done = leased.inspect(stop).and_then(|done| done);
                drop(leased.take_end()); // in the record
                done
            }
            Place::Nowhere => Ok((None, None)),
        })?;
        let (trial, reason) = done.map_err(|error| errors::of_drive(py, &error, false))?;
        Ok(trial.map(|trial| Record::new(trial, folder, reason)))
    }

    /// Raises the error that ended the trial since the last call, if there is one.
    fn raise_end(&self, py: Python<'_>) -> PyResult<()> {
        let ended = self.runner.visit(py, |place| match place {
            Place::Thread(leased) => leased.take_end(),
            Place::Here(_) | Place::Nowhere => Ok(()),
        })?;
        ended.map_err(|error| errors::of_drive(py, &error, false))
    }

    /// Stops the device because of `reason`, which the record names.
    fn stop_early(&self, py: Python<'_>, reason: String) -> PyResult<()> {
        self.runner.stop_early(py, reason)
    }

    /// Refuses a change of the setup while the device is armed; `call` names what changes it.
    fn check_idle(&self, py: Python<'_>, call: String) -> PyResult<()> {
        self.runner
            .inspect(py, move |drive| drive.check_idle(&call))
    }

    /// Acknowledges a latched fault.
    fn acknowledge(&self, py: Python<'_>) -> PyResult<()> {
        self.runner.call(py, false, Drive::acknowledge)
    }

    /// Stops and closes the device. A closed device stays closed.
    fn close(&self, py: Python<'_>) -> PyResult<()> {
        self.runner.close(py)
    }

    /// Begins again with a rested simulated wearer.
    fn reset(&self, py: Python<'_>, seed: u64) -> PyResult<()> {
        self.runner.call(py, false, move |drive| drive.reset(seed))
    }

    /// An independent copy of an armed simulator in its present state.
    fn fork(&self, py: Python<'_>) -> PyResult<Self> {
        let copy = self.runner.call(py, false, |drive| drive.fork())?;
        let place = Place::Here(Box::new(copy));
        Ok(Self {
            runner: Runner::new(place, LimbError::default()),
            setup: Mutex::new(locked(&self.setup).clone()),
            info: None,
            folder: None,
        })
    }

    /// The trial so far.
    fn trial(&self, py: Python<'_>) -> PyResult<Option<Record>> {
        let folder = self.folder.clone();
        let (trial, reason) = self.runner.inspect(py, |drive| {
            let (time_us, state) = (drive.time_us(), drive.state());
            let mut trial = drive.trial().cloned();
            if let (Some(trial), DriveState::Running) = (&mut trial, state) {
                trial.duration_s = time_us as f64 / 1e6;
            }
            Ok((trial, drive.early_end().map(str::to_owned)))
        })?;
        Ok(trial.map(|trial| Record::new(trial, folder, reason)))
    }

    /// Latest telemetry sample.
    fn latest(&self, py: Python<'_>) -> PyResult<Option<Latest>> {
        self.runner.inspect(py, |drive| Ok(latest_sample(drive)))
    }

    /// Samples that arrived since the last call, as columns. The first call returns none.
    fn take_samples<'py>(&self, py: Python<'py>) -> PyResult<Vec<Column<'py>>> {
        let taken = self.runner.inspect(py, |drive| {
            let channels = drive.trial().map(|trial| trial.channels.clone());
            Ok((channels.unwrap_or_default(), drive.take_samples()))
        });
        let (channels, samples) = taken?;
        columns(py, &channels, samples.into_iter())
    }

    /// Events from number `first` on, as time and text.
    fn events_from(&self, py: Python<'_>, first: usize) -> PyResult<Vec<(f64, String)>> {
        self.runner
            .inspect(py, move |drive| Ok(drive.events_from(first)))
    }

    /// Time since the start of the trains, s.
    #[getter]
    fn time_s(&self, py: Python<'_>) -> PyResult<f64> {
        let at_us = self.runner.inspect(py, |drive| Ok(drive.time_us()))?;
        Ok(at_us as f64 / 1e6)
    }

    /// State of the device.
    #[getter]
    fn state(&self, py: Python<'_>) -> PyResult<&'static str> {
        Ok(match self.runner.state(py)? {
            DriveState::Idle => "idle",
            DriveState::Armed => "armed",
            DriveState::Running => "running",
            DriveState::Closed => "closed",
        })
    }
}

fn latest_sample(drive: &mut Drive) -> Option<Latest> {
    let sample = drive.trial().and_then(|trial| trial.samples.last());
    sample.map(|s| (s.t_s, s.target_deg, s.measured_deg, s.true_deg, s.effort))
}

impl Device {
    /// Keeps the amplitudes of a setpoint that the device has accepted.
    fn note_amplitudes(&self, new: Option<Setup>) {
        if let (Some(new), Some(setup)) = (new, &mut *locked(&self.setup)) {
            setup.latest = new.latest;
        }
    }

    /// Returns the index on the link of the channel with this number, if the setup has it.
    fn channel_index(&self, py: Python<'_>, number: u8) -> PyResult<u8> {
        let setup = locked(&self.setup).clone();
        let Some(setup) = setup else {
            return self.runner.send(py, Vec::new()).map(|()| 0); // the drive says what is missing
        };
        check_channel(&setup.session, "channel", number)
            .map_err(|mistake| errors::of_setpoints(py, &[mistake]))
    }

    /// Returns the requests that send the values of a call, and the setup with its new amplitudes.
    fn requests(
        &self,
        py: Python<'_>,
        arguments: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<(Vec<Request>, Option<Setup>)> {
        let values = match arguments {
            Some(arguments) => setpoints::read(arguments)?,
            None => {
                return Err(PyValueError::new_err(
                    "set() needs a value, such as ma={1: 8}",
                ));
            }
        };
        let Some(mut setup) = locked(&self.setup).clone() else {
            // The drive says what is missing.
            let ordered = self.runner.send(py, Vec::new());
            return ordered.map(|()| (Vec::new(), None));
        };
        let requests = values.to_requests(&setup.session, &mut setup.latest);
        match requests {
            Ok(requests) => Ok((requests, Some(setup))),
            Err(mistakes) => Err(errors::of_setpoints(py, &mistakes)),
        }
    }
}
