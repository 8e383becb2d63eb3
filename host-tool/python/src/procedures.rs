//! Procedures with an operator: calibration, check of a wearer file, and search.
//!
//! A procedure runs on a thread of its own, while the calling thread looks for Ctrl-C. The operator
//! is a Python callable, which that thread calls again and again. If the callable hangs, the device
//! hears no keep-alives after 200 ms, and stops.

use crate::convert::to_text;
use crate::errors;
use crate::open::Address;
use crate::session::{SessionArgument, now};
use crate::supervise::{Raised, supervise};
use host_core::calibration::{
    Auto, CalibrationDevice, CalibrationError, Level, Operator, OperatorLoss, OperatorNotice,
    OperatorStation, Order, Plan, SimulatedWearer, View,
};
use host_core::link::{Interruption, PacedPort, Port};
use host_core::run::SessionFile;
use host_core::search::{
    self, DeviceError, OnDevice, Question, SearchEnd, SearchError, SearchFile, report,
};
use host_core::session::Session;
use host_core::wearer::Wearer;
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

/// Calibrates the electrodes of a plan. Returns the outcome as JSON.
#[pyfunction]
#[pyo3(signature = (
    plan, out, *, address, operator, listener, name, wearer, seed, resumes, acknowledges, watch
))]
#[expect(clippy::too_many_arguments, reason = "keyword arguments of Python")]
pub fn calibrate(
    py: Python<'_>,
    plan: &Bound<'_, PyAny>,
    out: PathBuf,
    address: &str,
    operator: Option<Py<PyAny>>,
    listener: Option<Py<PyAny>>,
    name: String,
    wearer: &str,
    seed: u64,
    resumes: bool,
    acknowledges: bool,
    watch: Option<Py<PyAny>>,
) -> PyResult<String> {
    let (source, text) = plan_text(py, plan)?;
    let plan = Plan::parse(&source, &text).map_err(|error| of_calibration(py, &error))?;
    let device = device(address, name, wearer, seed, operator.is_some())?;
    let raised = Raised::default();
    let mut person = CalledOperator::new(operator, listener, raised.clone());
    let done = supervise(py, &raised, watch.as_ref(), || {
        let mut desk = station(&mut person, &raised, acknowledges);
        device.calibrate((&plan, &text), &out, resumes, &mut desk)
    })?;
    let outcome = done.map_err(|error| of_calibration(py, &error))?;
    Ok(outcome.to_json().to_string())
}

/// Checks the thresholds of a wearer file and adds the result to it. Returns the outcome as JSON.
#[pyfunction]
#[pyo3(signature = (
    file, *, tolerance, address, operator, listener, name, wearer, seed, acknowledges, watch
))]
#[expect(clippy::too_many_arguments, reason = "keyword arguments of Python")]
pub fn check_thresholds(
    py: Python<'_>,
    file: PathBuf,
    tolerance: f64,
    address: &str,
    operator: Option<Py<PyAny>>,
    listener: Option<Py<PyAny>>,
    name: String,
    wearer: &str,
    seed: u64,
    acknowledges: bool,
    watch: Option<Py<PyAny>>,
) -> PyResult<String> {
    let Some(tolerance) = Level::from_units(tolerance).filter(|level| level.0 > 0) else {
        return Err(PyValueError::new_err(format!(
            "tolerance must be 0.001 to 100 in steps of 0.001, not {tolerance}"
        )));
    };
    let known = Wearer::read(&file).map_err(|error| errors::of_session(py, &error))?;
    let device = device(address, name, wearer, seed, operator.is_some())?;
    let raised = Raised::default();
    let mut person = CalledOperator::new(operator, listener, raised.clone());
    let done = supervise(py, &raised, watch.as_ref(), || {
        let mut desk = station(&mut person, &raised, acknowledges);
        device.check((&file, &known), tolerance, &mut desk)
    })?;
    let outcome = done.map_err(|error| of_calibration(py, &error))?;
    Ok(outcome.to_json().to_string())
}

/// Runs the searches of a file. Returns their reports as JSON, and the exception that ended them
/// early.
#[pyfunction]
#[pyo3(signature = (file, *, address, operator, seed, watch))]
pub fn run_searches(
    py: Python<'_>,
    file: SessionArgument<'_>,
    address: &str,
    operator: Option<Py<PyAny>>,
    seed: u64,
    watch: Option<Py<PyAny>>,
) -> PyResult<(String, Option<PyErr>)> {
    let place = Address::read(address)?;
    if place.name.is_port() && operator.is_none() {
        return Err(nobody());
    }
    let loaded = load_searches(&file, !place.name.is_port())?;
    let (searches, session) = loaded.map_err(|error| of_search(py, &error))?;
    let raised = Raised::default();
    let mut asked = AskedOperator {
        callable: operator,
        question: None,
        raised: raised.clone(),
    };
    let opened = py.detach(|| place.name.open(&session, seed));
    let port = opened.map_err(|error| errors::of_open(py, &error))?;
    let port: Box<dyn Port> = match place.is_paced {
        true => Box::new(PacedPort::new(port)),
        false => port,
    };
    let (reports, ended) = supervise(py, &raised, watch.as_ref(), || {
        search_all(
            port,
            &searches,
            &session,
            &mut asked,
            &raised.interruption(),
            seed,
        )
    })?;
    let ended = ended.err().map(|error| of_search(py, &error));
    Ok((Value::Array(reports).to_string(), ended))
}

/// Loads searches from a file, or from fields whose `session` is relative to the present folder.
fn load_searches(
    file: &SessionArgument<'_>,
    is_simulated: bool,
) -> PyResult<Result<(SearchFile, Session), SearchError>> {
    let fields = match file {
        SessionArgument::Path(path) => return Ok(SearchFile::load(path, is_simulated)),
        SessionArgument::Fields(fields) => to_text(fields)?,
    };
    let name = Path::new("of this program");
    let parsed = SearchFile::parse(&fields);
    let parsed = parsed.map_err(|mistakes| SearchError::Mistakes(name.to_owned(), mistakes));
    Ok(parsed.and_then(|searches| {
        let session = SessionFile::load(Path::new(&searches.session))?.session;
        searches.check(name, &session, is_simulated)?;
        Ok((searches, session))
    }))
}

/// Runs searches one after the other; returns the reports of those that began.
fn search_all(
    mut port: Box<dyn Port>,
    searches: &SearchFile,
    session: &Session,
    operator: &mut AskedOperator,
    interruption: &Interruption,
    seed: u64,
) -> (Vec<Value>, Result<(), SearchError>) {
    let mut reports = Vec::new();
    for declared in &searches.searches {
        let asked = Some(interruption.clone());
        let mut probe = match OnDevice::start(port, session, declared, operator, asked, seed) {
            Ok(probe) => probe,
            Err(error) => return (reports, Err(error.into())),
        };
        let finding = search::search(declared, &mut probe, |_| {});
        let stopped = probe.stop();
        reports.push(report(declared, session, &finding));
        let is_complete = matches!(finding.ended, SearchEnd::Found | SearchEnd::Limit);
        if !is_complete {
            return (reports, finding.into_end());
        }
        port = match stopped {
            Ok(port) => port,
            Err(error) => return (reports, Err(DeviceError::from(error).into())),
        };
    }
    (reports, Ok(()))
}

fn device(
    address: &str,
    operator: String,
    wearer: &str,
    seed: u64,
    has_operator: bool,
) -> PyResult<CalibrationDevice> {
    let Address { name, is_paced } = Address::read(address)?;
    if name.is_port() && !has_operator {
        return Err(nobody());
    }
    let Some(wearer) = SimulatedWearer::from_name(wearer) else {
        let names = SimulatedWearer::ALL.map(SimulatedWearer::name).join(", ");
        let message = format!("{wearer:?} is not a simulated wearer; there are {names}");
        return Err(PyValueError::new_err(message));
    };
    Ok(CalibrationDevice {
        device: name,
        wearer,
        seed,
        is_paced,
        operator,
        at: None,
        now: now().utc(),
    })
}

fn nobody() -> PyErr {
    PyValueError::new_err("a device behind a port needs operator=: a person must order each raise")
}

fn station<'a>(
    operator: &'a mut CalledOperator,
    raised: &Raised,
    acknowledges: bool,
) -> OperatorStation<'a> {
    OperatorStation {
        operator,
        interruption: Some(raised.interruption()),
        acknowledges,
    }
}

/// Returns the name and the text of a plan, which is a path or a dictionary.
fn plan_text(py: Python<'_>, plan: &Bound<'_, PyAny>) -> PyResult<(String, String)> {
    if let Ok(fields) = plan.cast::<PyDict>() {
        return Ok(("the plan".to_owned(), to_text(fields)?));
    }
    let path: PathBuf = plan.extract()?;
    let text = Session::text(&path).map_err(|error| errors::of_session(py, &error))?;
    Ok((path.display().to_string(), text))
}

/// Operator of a calibration whose orders a Python callable gives, or the simulated instrument.
struct CalledOperator {
    callable: Option<Py<PyAny>>,
    listener: Option<Py<PyAny>>,
    raised: Raised,
}

impl CalledOperator {
    const fn new(callable: Option<Py<PyAny>>, listener: Option<Py<PyAny>>, raised: Raised) -> Self {
        Self {
            callable,
            listener,
            raised,
        }
    }

    fn ask(&self, callable: &Py<PyAny>, view: &View) -> PyResult<Vec<Order>> {
        Python::attach(|py| {
            let mut shown = json!(view);
            shown["orders"] = json!(view.allowed_orders());
            let line: Option<String> = callable.call1(py, (shown.to_string(),))?.extract(py)?;
            let order = line.map(|line| Order::parse(&line)).transpose();
            order
                .map(|order| order.into_iter().collect())
                .map_err(|error| PyTypeError::new_err(error.to_string()))
        })
    }

    fn send(&self, message: &Value) {
        let Some(listener) = &self.listener else {
            return;
        };
        let called = Python::attach(|py| listener.call1(py, (message.to_string(),)).map(drop));
        if let Err(error) = called {
            self.raised.set(error);
        }
    }
}

impl Operator for CalledOperator {
    fn orders(&mut self, view: &View) -> Result<Vec<Order>, OperatorLoss> {
        let Some(callable) = &self.callable else {
            return Auto.orders(view);
        };
        Ok(self.ask(callable, view).unwrap_or_else(|error| {
            self.raised.set(error);
            vec![Order::Abort]
        }))
    }

    fn notify(&mut self, notice: OperatorNotice<'_>, view: &View) {
        let message = match notice {
            OperatorNotice::Recorded(entry) => json!({ "t_s": view.t_s, "entry": entry }),
            OperatorNotice::Refused(refusal) => {
                json!({ "t_s": view.t_s, "refused": refusal.to_string() })
            }
            OperatorNotice::Written => json!({ "t_s": view.t_s, "written": true }),
        };
        self.send(&message);
    }
}

/// Operator of a search, whose answers a Python callable gives.
struct AskedOperator {
    callable: Option<Py<PyAny>>,
    question: Option<Question>,
    raised: Raised,
}

impl AskedOperator {
    fn answer(&self, callable: &Py<PyAny>, question: Question) -> PyResult<Option<u8>> {
        let (kind, level, from) = match question {
            Question::Raise(from, to) => ("raise", to.units(), Some(from.units())),
            Question::Rating(level) => ("rating", level.units(), None),
            Question::Moved(level) => ("moved", level.units(), None),
        };
        Python::attach(|py| {
            let answer: Option<u8> = callable.call1(py, (kind, level, from))?.extract(py)?;
            match answer {
                Some(number) if number > question.most() => Err(PyValueError::new_err(format!(
                    "{number} is no answer to {question}"
                ))),
                answer => Ok(answer),
            }
        })
    }
}

impl search::Operator for AskedOperator {
    fn ask(&mut self, question: Question) {
        self.question = Some(question);
    }

    fn reply(&mut self) -> Option<u8> {
        let (callable, question) = (self.callable.as_ref()?, self.question?);
        match self.answer(callable, question) {
            Ok(answer) => answer,
            Err(error) => {
                self.raised.set(error);
                None // the interruption ends the search
            }
        }
    }
}

fn of_calibration(py: Python<'_>, error: &CalibrationError) -> PyErr {
    let kind = match error {
        CalibrationError::Plan(..)
        | CalibrationError::Taken(_)
        | CalibrationError::NotResumable(..)
        | CalibrationError::Damaged(..)
        | CalibrationError::Another(..)
        | CalibrationError::Loose(..)
        | CalibrationError::Refused(_) => "refused",
        CalibrationError::Ended(..) => "fault",
        CalibrationError::Link(error) => errors::link_kind(error),
        CalibrationError::Open(_) => "lost",
        _ => "error",
    };
    errors::of_message(py, kind, error)
}

fn of_search(py: Python<'_>, error: &SearchError) -> PyErr {
    let kind = match error {
        SearchError::Session(error) => return errors::of_session(py, error),
        SearchError::Mistakes(..) | SearchError::NotAllowed(..) => "refused",
        SearchError::Device(DeviceError::Link(error)) => errors::link_kind(error),
        SearchError::Device(DeviceError::NoSensor) => "refused",
        SearchError::Device(DeviceError::Ended(_) | DeviceError::Stalled(_)) => "fault",
    };
    errors::of_message(py, kind, error)
}
