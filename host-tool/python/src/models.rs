//! Muscle models, the inverse model and controllers as functions.

use crate::errors;
use crate::session::{SessionArgument, read};
use firmware::muscle::{CalciumForce, CalciumForceSpec};
use hal_sim::body::muscle::Parameters;
use host_core::models::{
    ControllerOutput, JointController, ResponseRow, device_response, reference_response,
    stimulus_for_force,
};
use numpy::{IntoPyArray, PyArray1};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use std::sync::Mutex;

/// Time, C and force as arrays.
type Response<'py> = (
    Bound<'py, PyArray1<f64>>,
    Bound<'py, PyArray1<f64>>,
    Bound<'py, PyArray1<f64>>,
);

/// Response of a muscle to pulses, by the device's model or by the reference. `parameters` are A in
/// N/s, K, and τc, τ1 and τ2 in ms.
#[pyfunction]
pub fn muscle_response<'py>(
    py: Python<'py>,
    parameters: [f64; 5],
    pulses_us: Vec<u64>,
    duration_us: u64,
    row_us: u64,
    is_reference: bool,
) -> PyResult<Response<'py>> {
    let [a_n_per_s, k, tau_c_ms, tau1_ms, tau2_ms] = parameters;
    let thousandths = |value: f64, factor: f64| (value * factor).round() as u32; // saturates
    let spec = CalciumForceSpec {
        a_mn_per_s: thousandths(a_n_per_s, 1e3),
        k_micro: thousandths(k, 1e6),
        tau_c_us: thousandths(tau_c_ms, 1e3),
        tau1_us: thousandths(tau1_ms, 1e3),
        tau2_us: thousandths(tau2_ms, 1e3),
    };
    let muscle =
        CalciumForce::new(spec).map_err(|error| PyValueError::new_err(error.to_string()))?;
    if !pulses_us.is_sorted_by(|a, b| a < b) {
        return Err(PyValueError::new_err(
            "the times of the pulses must increase",
        ));
    }
    let rows = py.detach(|| match is_reference {
        false => device_response(&muscle, &pulses_us, duration_us, row_us),
        true => {
            let parameters = Parameters {
                a_n_per_s,
                k,
                tau_c_s: tau_c_ms * 1e-3,
                tau1_s: tau1_ms * 1e-3,
                tau2_s: tau2_ms * 1e-3,
            };
            let times: Vec<f64> = pulses_us.iter().map(|&us| us as f64 * 1e-6).collect();
            let (duration_s, row_s) = (duration_us as f64 * 1e-6, row_us as f64 * 1e-6);
            reference_response(&parameters, &times, duration_s, row_s)
        }
    });
    let column = |value: fn(&ResponseRow) -> f64| -> Vec<f64> { rows.iter().map(value).collect() };
    Ok((
        column(|row| row.t_s).into_pyarray(py),
        column(|row| row.c).into_pyarray(py),
        column(|row| row.force_n).into_pyarray(py),
    ))
}

/// Stimulus for a force on a channel of a session: amplitude, rate in Hz, force in N, whether the
/// limits do not allow the force.
#[pyfunction]
pub fn force_stimulus(
    py: Python<'_>,
    session: SessionArgument<'_>,
    channel: u8,
    force_n: f64,
) -> PyResult<(f64, f64, f64, bool)> {
    if !(0.0..=4000.0).contains(&force_n) {
        let message = format!("force_n must be between 0 and 4000 N, not {force_n}");
        return Err(PyValueError::new_err(message));
    }
    let file = read(py, &session)?;
    let found = file.session.channels.iter().find(|c| c.number == channel);
    let Some(found) = found else {
        let message = format!("the session has no channel {channel}");
        return Err(PyValueError::new_err(message));
    };
    let stimulus = stimulus_for_force(found, force_n)
        .map_err(|error| PyValueError::new_err(error.to_string()))?;
    let Some(stimulus) = stimulus else {
        let message = format!("channel {channel} has no muscle, so its force is not known");
        return Err(PyValueError::new_err(message));
    };
    let (amplitude, rate_hz) = (stimulus.amplitude, stimulus.rate_hz);
    Ok((amplitude, rate_hz, stimulus.force_n, stimulus.is_limited))
}

/// Effort, amplitudes by channel, and whether one was held at its maximum.
type Output = (f64, Vec<(u8, f64)>, bool);

/// Controller of a session's joint, apart from a device.
#[pyclass(frozen, module = "flexor._native")]
pub struct Controller(Mutex<JointController>);

#[pymethods]
impl Controller {
    #[new]
    fn new(py: Python<'_>, session: SessionArgument<'_>) -> PyResult<Self> {
        let file = read(py, &session)?;
        let created = JointController::from_session(&file.session);
        let created = created.map_err(|error| errors::of_message(py, "refused", &error))?;
        Ok(Self(Mutex::new(created)))
    }

    /// Sets the reference and its rate, then advances by `ticks` of 1 ms with this measured angle.
    /// Returns effort, amplitudes by channel, and whether one was held at its maximum.
    fn step(
        &self,
        py: Python<'_>,
        reference_deg: f64,
        rate_deg_per_s: f64,
        measured_deg: f64,
        ticks: u32,
    ) -> PyResult<Output> {
        for value in [reference_deg, rate_deg_per_s, measured_deg] {
            if !value.is_finite() {
                return Err(PyValueError::new_err(
                    "angles and rates must be finite numbers",
                ));
            }
        }
        let mut controller = crate::runner::locked(&self.0);
        let output = controller
            .set_reference(reference_deg, rate_deg_per_s)
            .and_then(|()| controller.advance(measured_deg, ticks));
        let output = output.map_err(|error| errors::of_message(py, "refused", &error))?;
        let Some(ControllerOutput {
            effort,
            amplitudes,
            is_limited,
        }) = output
        else {
            return Err(PyValueError::new_err("a step must be at least 1 ms"));
        };
        Ok((effort, amplitudes, is_limited))
    }
}
