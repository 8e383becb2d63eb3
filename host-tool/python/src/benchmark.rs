//! The loops of the speed comparison in Rust, beside which Python is measured in the same run.

use crate::errors;
use crate::open::OpenArguments;
use crate::runner::Place;
use crate::session::{SessionArgument, read};
use crate::setpoints;
use host_core::drive::{DriveError, LatestAmplitudes};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::path::PathBuf;
use std::time::Instant;

/// Runs `steps` steps of `step_us` on a simulator that records in `record`, or only in memory, and
/// returns the time that they took, s. With `values`, the arguments of a setpoint, each step begins
/// with this setpoint and ends with a look at the latest sample, as the step of an environment does.
#[pyfunction]
#[pyo3(signature = (session, record, steps, step_us, values))]
pub fn time_steps(
    py: Python<'_>,
    session: SessionArgument<'_>,
    record: Option<PathBuf>,
    steps: u32,
    step_us: u64,
    values: Option<&Bound<'_, PyDict>>,
) -> PyResult<f64> {
    let file = read(py, &session)?;
    let its_session = file.session.clone();
    let values = values.map(setpoints::read).transpose()?;
    let arguments = OpenArguments {
        address: "sim:".to_owned(),
        seed: 1,
        record,
        title: file.session.title.clone(),
        lease_s: 1.0,
        telemetry_ms: 10,
        all_edges: false,
        limb: None,
    };
    let (runner, _) = arguments.open(py)?;
    let ran = runner.visit(py, |place| {
        let Place::Here(drive) = place else {
            return Err(DriveError::Closed);
        };
        drive.arm(file)?;
        drive.start()?;
        let (mut latest, mut seen) = (LatestAmplitudes::default(), 0.0);
        let begin = Instant::now();
        for _ in 0..steps {
            if let Some(values) = &values {
                match values.to_requests(&its_session, &mut latest) {
                    Ok(requests) => drive.send(requests)?,
                    Err(mistakes) => return Ok(Err(mistakes)),
                }
            }
            drive.wait(step_us)?;
            if values.is_some() {
                let sample = drive.trial().and_then(|trial| trial.samples.last());
                seen += sample.map_or(0.0, |sample| sample.t_s);
            }
        }
        let passed_s = begin.elapsed().as_secs_f64();
        std::hint::black_box(seen);
        drive.close()?;
        Ok(Ok(passed_s))
    })?;
    let timed = ran.map_err(|error| errors::of_drive(py, &error, false))?;
    timed.map_err(|mistakes| errors::of_setpoints(py, &mistakes))
}
