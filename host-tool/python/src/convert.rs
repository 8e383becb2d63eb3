//! Converts Python's dictionaries into the text of a session file.

use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyDict, PyFloat, PyInt, PyList, PyString, PyTuple};
use std::fmt::Display;
use toml::{Table, Value};

/// Returns the text of the session file with the fields of `document`. Fields that are `None` are
/// left out.
///
/// # Errors
/// A value is of a type that no field has.
pub fn to_text(document: &Bound<'_, PyDict>) -> PyResult<String> {
    let table = to_table(document, "", 0)?;
    toml::to_string(&table).map_err(|error| PyTypeError::new_err(error.to_string()))
}

/// Deepest nesting; a session needs three levels. A list that contains itself has no end.
const DEEPEST: usize = 16;

fn to_table(dictionary: &Bound<'_, PyDict>, path: &str, depth: usize) -> PyResult<Table> {
    let mut table = Table::new();
    for (key, value) in dictionary {
        let key: String = key.extract()?;
        let path = match path {
            "" => key.clone(),
            path => format!("{path}.{key}"),
        };
        if !value.is_none() {
            table.insert(key, to_value(&value, &path, depth)?);
        }
    }
    Ok(table)
}

fn to_value(value: &Bound<'_, PyAny>, path: &str, depth: usize) -> PyResult<Value> {
    if depth > DEEPEST {
        let start: String = path.chars().take(40).collect();
        let message = format!("{start} is nested too deeply, or contains itself");
        return Err(PyTypeError::new_err(message));
    }
    let depth = depth + 1;
    if let Ok(flag) = value.cast::<PyBool>() {
        return Ok(Value::Boolean(flag.is_true()));
    }
    if let Ok(text) = value.cast::<PyString>() {
        return Ok(Value::String(text.to_str()?.to_owned()));
    }
    if let Ok(dictionary) = value.cast::<PyDict>() {
        return Ok(Value::Table(to_table(dictionary, path, depth)?));
    }
    if value.is_instance_of::<PyList>() || value.is_instance_of::<PyTuple>() {
        let items = value.try_iter()?.map(|item| to_value(&item?, path, depth));
        return Ok(Value::Array(items.collect::<PyResult<_>>()?));
    }
    if value.is_instance_of::<PyInt>() {
        return value.extract().map(Value::Integer);
    }
    if value.is_instance_of::<PyFloat>() {
        return value.extract().map(Value::Float);
    }
    // Values of numpy become those of Python, which have their own kinds.
    if value.hasattr("__array__")? && value.hasattr("tolist")? {
        return to_value(&value.call_method0("tolist")?, path, depth);
    }
    if let Ok(whole) = value.extract::<i64>() {
        return Ok(Value::Integer(whole));
    }
    if let Ok(number) = value.extract::<f64>() {
        return Ok(Value::Float(number));
    }
    let kind = value.get_type().name()?.to_string();
    Err(PyTypeError::new_err(format!(
        "{path} is a {kind}; give a number, a text, true or false, or a list of them"
    )))
}

/// Returns a number for the argument `name`. Truth values, texts and everything that is no single
/// number are refused.
///
/// # Errors
/// `TypeError`.
pub fn number(value: &Bound<'_, PyAny>, name: impl Display) -> PyResult<f64> {
    if let Ok(number) = value.cast_exact::<PyFloat>() {
        return Ok(number.value()); // most are
    }
    // Of numpy's kinds, whole numbers and floats; not truth values, texts and complex numbers.
    let kind = value
        .getattr("dtype")
        .and_then(|dtype| dtype.getattr("kind"));
    let kind: Option<String> = kind.and_then(|kind| kind.extract()).ok();
    let is_number = !value.is_instance_of::<PyBool>()
        && !value.is_instance_of::<PyString>()
        && kind.is_none_or(|kind| ["i", "u", "f"].contains(&&*kind));
    let number = value.extract::<f64>().ok().filter(|_| is_number);
    number.ok_or_else(|| {
        let shown = value
            .repr()
            .map_or_else(|_| "?".to_owned(), |repr| repr.to_string());
        PyTypeError::new_err(format!("{name} must be a number, not {shown}"))
    })
}
