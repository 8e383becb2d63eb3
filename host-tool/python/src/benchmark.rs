//! The loops of the speed comparison in Rust, beside which Python is measured in the same run.

use crate::errors;
use crate::open::OpenArguments;
use crate::runner::Place;
use crate::session::{SessionArgument, read};
use host_core::drive::{DriveError, LatestAmplitudes, SetpointValues};
use pyo3::prelude::*;
use std::path::PathBuf;
use std::time::Instant;

/// Runs `steps` steps of `step_us` on a simulator that records in `record`, and returns the time
/// that they took, s. If `sets` is true, each step begins with an amplitude of 1 mA on channel 1
/// and ends with a look at the latest sample, as the step of an environment does.
#[pyfunction]
pub fn time_steps(
    py: Python<'_>,
    session: SessionArgument<'_>,
    record: PathBuf,
    steps: u32,
    step_us: u64,
    sets: bool,
) -> PyResult<f64> {
    let file = read(py, &session)?;
    let its_session = file.session.clone();
    let arguments = OpenArguments {
        address: "sim:".to_owned(),
        seed: 1,
        record: Some(record),
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
            if sets {
                let values = SetpointValues {
                    ma: [(1, 1.0)].into(),
                    ..SetpointValues::default()
                };
                let requests = values.to_requests(&its_session, &mut latest);
                drive.send(requests.unwrap_or_default())?;
            }
            drive.wait(step_us)?;
            if sets {
                let sample = drive.trial().and_then(|trial| trial.samples.last());
                seen += sample.map_or(0.0, |sample| sample.t_s);
            }
        }
        let passed_s = begin.elapsed().as_secs_f64();
        std::hint::black_box(seen);
        drive.close()?;
        Ok(passed_s)
    })?;
    ran.map_err(|error| errors::of_drive(py, &error, false))
}
