//! Reads the arguments of `Device.set`.

use crate::convert::number;
use host_core::drive::SetpointValues;
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict};
use std::collections::BTreeMap;

/// Returns the values of a call from its keyword arguments.
///
/// # Errors
/// `TypeError` for an argument that is not what it must be.
pub fn read(arguments: &Bound<'_, PyDict>) -> PyResult<SetpointValues> {
    let mut wanted = SetpointValues::default();
    let mut rate = 0.0;
    let mut has_rate = false;
    for (key, value) in arguments {
        if value.is_none() {
            continue;
        }
        match key.extract::<&str>()? {
            "ma" => wanted.ma = by_channel(&value, "ma")?,
            "v" => wanted.v = by_channel(&value, "v")?,
            "width_us" => wanted.width_us = by_channel(&value, "width_us")?,
            "force_n" => wanted.force_n = by_channel(&value, "force_n")?,
            "angle_deg" => wanted.angle_deg = Some((number(&value, "angle_deg")?, 0.0)),
            "rate_deg_per_s" => {
                rate = number(&value, "rate_deg_per_s")?;
                has_rate = true;
            }
            "endpoint_n" => wanted.endpoint_n = Some(endpoint(&value)?),
            "held" => match value.cast::<PyBool>() {
                Ok(held) => wanted.held = Some(held.is_true()),
                Err(_) => return Err(PyTypeError::new_err("held must be True or False")),
            },
            other => {
                return Err(PyTypeError::new_err(format!(
                    "set() has no argument {other}; its arguments are ma, v, width_us, force_n, \
                     angle_deg, rate_deg_per_s, endpoint_n and held"
                )));
            }
        }
    }
    match &mut wanted.angle_deg {
        Some(angle) => angle.1 = rate,
        None if has_rate => {
            return Err(PyTypeError::new_err("rate_deg_per_s needs angle_deg"));
        }
        None => {}
    }
    Ok(wanted)
}

fn by_channel(value: &Bound<'_, PyAny>, name: &str) -> PyResult<BTreeMap<u8, f64>> {
    let Ok(dictionary) = value.cast::<PyDict>() else {
        return Err(PyTypeError::new_err(format!(
            "{name} must be a dictionary from channel to value, such as {name}={{1: 8}}"
        )));
    };
    if dictionary.is_empty() {
        return Err(PyValueError::new_err(format!("{name} names no channel")));
    }
    let mut values = BTreeMap::new();
    for (channel, value) in dictionary {
        let index = match channel.is_instance_of::<PyBool>() {
            true => None,
            false => channel.extract::<u8>().ok(),
        };
        let Some(index) = index else {
            return Err(PyTypeError::new_err(format!(
                "{name}: {channel} is not a channel; channels are numbered from 1 to 10"
            )));
        };
        values.insert(index, number(&value, format_args!("{name}[{index}]"))?);
    }
    Ok(values)
}

fn endpoint(value: &Bound<'_, PyAny>) -> PyResult<[f64; 3]> {
    let items: Vec<Bound<'_, PyAny>> = value.try_iter()?.collect::<PyResult<_>>()?;
    let Ok([x, y, z]) = <[_; 3]>::try_from(items) else {
        return Err(PyTypeError::new_err(
            "endpoint_n must have three components: backward, to the right and upward",
        ));
    };
    Ok([
        number(&x, "endpoint_n")?,
        number(&y, "endpoint_n")?,
        number(&z, "endpoint_n")?,
    ])
}
