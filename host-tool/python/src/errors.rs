//! Turns errors of `host-core` into the exceptions that `flexor._errors` defines.

use host_core::drive::{DriveError, SetpointError};
use host_core::link::{Error, RefusalInWords};
use host_core::run::{OpenError, RunError};
use host_core::session::SessionError;
use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};

/// One mistake as Python gets it.
#[derive(Default)]
struct Mistake {
    message: String,
    number: Option<u16>,
    field: Option<String>,
    value: Option<String>,
    allowed: Option<String>,
    remedy: Option<String>,
}

impl Mistake {
    /// Returns a mistake whose message begins with its number, as every message of `host-core` does.
    fn from_message(message: String) -> Self {
        let digits: String = message
            .strip_prefix('E')
            .unwrap_or_default()
            .chars()
            .take_while(char::is_ascii_digit)
            .collect();
        Self {
            number: digits.parse().ok(),
            message,
            ..Self::default()
        }
    }
}

/// Returns an exception of the class that `kind` names in `flexor._errors.CLASSES`.
fn raise(py: Python<'_>, kind: &str, mistakes: Vec<Mistake>) -> PyErr {
    let raised = || -> PyResult<PyErr> {
        let list = PyList::empty(py);
        for mistake in mistakes {
            let entry = PyDict::new(py);
            entry.set_item("message", mistake.message)?;
            entry.set_item("number", mistake.number)?;
            entry.set_item("field", mistake.field)?;
            entry.set_item("value", mistake.value)?;
            entry.set_item("allowed", mistake.allowed)?;
            entry.set_item("remedy", mistake.remedy)?;
            list.append(entry)?;
        }
        let module = py.import("flexor._errors")?;
        let error = module.call_method1("build", (kind, list))?;
        Ok(PyErr::from_value(error))
    };
    raised().unwrap_or_else(|error| error)
}

/// Returns the exception for a session or wearer file that is refused, with all its mistakes.
pub fn of_session(py: Python<'_>, error: &SessionError) -> PyErr {
    let mistakes = error.errors().map(|error| Mistake {
        message: error.summary(),
        number: Some(error.problem().number()),
        field: Some(error.field().to_owned()),
        value: Some(error.given().to_owned()),
        allowed: error.allowed().map(str::to_owned),
        remedy: error.remedy(),
    });
    raise(py, "refused", mistakes.collect())
}

/// Returns the exception for values of a call that are refused.
pub fn of_setpoints(py: Python<'_>, errors: &[SetpointError]) -> PyErr {
    let mistakes = errors.iter().map(|error| {
        let (field, value, allowed) = match error {
            SetpointError::NoChannel { field, channel, .. }
            | SetpointError::OtherKind { field, channel, .. } => {
                (*field, channel.to_string(), None)
            }
            SetpointError::OutOfRange {
                field,
                value,
                allowed,
                ..
            } => (*field, value.to_string(), Some(allowed.clone())),
            SetpointError::Impossible {
                field,
                value,
                allowed,
            } => (*field, value.to_string(), Some(allowed.clone())),
            SetpointError::NoPart { field, .. } => (*field, String::new(), None),
            SetpointError::NoAmplitude { channel } => ("width_us", channel.to_string(), None),
        };
        Mistake {
            field: Some(field.to_owned()),
            value: Some(value),
            allowed,
            ..Mistake::from_message(error.to_string())
        }
    });
    raise(py, "refused", mistakes.collect())
}

/// Returns the exception for an error of a drive. `is_arming` says whether the call was `arm()`.
pub fn of_drive(py: Python<'_>, error: &DriveError, is_arming: bool) -> PyErr {
    raise(py, kind(error, is_arming), vec![to_mistake(error)])
}

/// Returns the exception for a device that could not be connected: whatever it answers, there is no
/// connection.
pub fn of_opening(py: Python<'_>, error: &DriveError) -> PyErr {
    let kind = match error {
        DriveError::Run(RunError::Link(_)) | DriveError::Open(_) => "lost",
        _ => "error",
    };
    raise(py, kind, vec![to_mistake(error)])
}

/// Returns the exception for a device that could not be opened.
pub fn of_open(py: Python<'_>, error: &OpenError) -> PyErr {
    raise(py, "lost", vec![Mistake::from_message(error.to_string())])
}

/// Returns the exception for an error with a number in its message.
pub fn of_message(py: Python<'_>, kind: &str, error: &impl ToString) -> PyErr {
    raise(py, kind, vec![Mistake::from_message(error.to_string())])
}

/// Returns the exception for a fault of this package itself.
pub fn internal(error: impl ToString) -> PyErr {
    PyRuntimeError::new_err(error.to_string())
}

/// Returns the exception for a text that is no address of a device.
pub fn wrong_address(address: &str) -> PyErr {
    PyValueError::new_err(format!(
        "{address:?} is not an address; give \"sim:\", \"sim:realtime\", \
         \"serial:/dev/ttyACM0\" or \"tcp:127.0.0.1:4242\""
    ))
}

/// Returns the reason of an early end because of an exception.
pub fn ended_by(py: Python<'_>, error: &PyErr) -> String {
    let name = error.get_type(py).name();
    let name = name.map_or_else(|_| "an exception".to_owned(), |name| name.to_string());
    format!("{name} ended the program's call")
}

/// Returns the name of the exception's class for an error of the link, outside of arming.
pub const fn link_kind(error: &Error) -> &'static str {
    match error {
        Error::Refused(_) => "refused",
        _ => "lost",
    }
}

/// Returns the name of an exception's class.
const fn kind(error: &DriveError, is_arming: bool) -> &'static str {
    match error {
        DriveError::Run(RunError::Link(Error::Refused(_))) if is_arming => "arm",
        DriveError::Run(RunError::Link(error)) => link_kind(error),
        DriveError::Run(RunError::Ended { .. }) => "fault",
        DriveError::Run(
            RunError::OtherStages(_) | RunError::StagesUnknown(_) | RunError::Opposed(_),
        ) => "arm",
        DriveError::Open(OpenError::Port(_)) => "lost",
        DriveError::LeaseExpired { .. } => "lease",
        DriveError::Late { .. } | DriveError::Choice(_) | DriveError::OtherBody => "refused",
        DriveError::Run(_)
        | DriveError::Open(_)
        | DriveError::Record(_)
        | DriveError::Order { .. }
        | DriveError::Closed
        | DriveError::NotSimulated(_)
        | DriveError::NotCopyable
        | DriveError::Over => "error",
    }
}

/// Returns the mistake that an error of a drive is.
fn to_mistake(error: &DriveError) -> Mistake {
    match error {
        DriveError::Run(RunError::Link(Error::Refused(refused))) => of_refusal(refused),
        error => Mistake::from_message(error.to_string()),
    }
}

fn of_refusal(refused: &RefusalInWords) -> Mistake {
    let allowed = refused.allowed.map(|(min, max)| format!("{min} to {max}"));
    Mistake {
        message: refused.to_string(),
        number: Some(refused.number),
        field: Some(refused.field.clone()),
        value: None,
        allowed,
        remedy: refused
            .code()
            .map(|code| host_core::link::advice(code).to_owned()),
    }
}
