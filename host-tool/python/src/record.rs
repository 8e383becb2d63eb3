//! Recorded trials as Python objects.

use host_core::record::{
    self, ChannelInfo, Edge, ElectrodeReading, Field, Sample, State, Trial, sample_columns,
    visit_sample,
};
use numpy::{IntoPyArray, PyArray1};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};
use std::path::PathBuf;
use std::sync::Arc;

/// Data of one trial. The Python class `flexor.Record` makes arrays of them.
#[pyclass(frozen, module = "flexor._native")]
pub struct Record {
    trial: Arc<Trial>,
    path: Option<PathBuf>,
    error: Option<String>,
}

impl Record {
    /// Creates the Python object of a trial. `path` is the folder of the record, and `error` the
    /// reason for which the trial ended early.
    pub fn new(trial: Trial, path: Option<PathBuf>, error: Option<String>) -> Self {
        let trial = Arc::new(trial);
        Self { trial, path, error }
    }
}

#[pymethods]
impl Record {
    /// Columns of `samples.csv`: for each its name and either numbers or words.
    fn columns<'py>(&self, py: Python<'py>) -> PyResult<Vec<Column<'py>>> {
        columns(py, &self.trial.channels, self.trial.samples.iter())
    }

    /// Edges of the outputs: time in µs, channel, index of the state, DAC code.
    fn edges<'py>(&self, py: Python<'py>) -> EdgeArrays<'py> {
        edge_arrays(py, &self.trial.edges)
    }

    /// Events as pairs of time in s and text.
    #[getter]
    fn events(&self) -> Vec<(f64, String)> {
        self.trial.events.clone()
    }

    /// Readings of the electrode check: channel, applied, current in mA, load in Ω.
    #[getter]
    fn electrodes(&self) -> Vec<ReadingTuple> {
        let readings = self.trial.electrode_check.iter();
        readings.map(reading_tuple).collect()
    }

    /// Counters of the device.
    #[getter]
    fn counters<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let counters = PyDict::new(py);
        for (name, count) in &self.trial.counters {
            counters.set_item(name, count)?;
        }
        Ok(counters)
    }

    /// Time, kind, channel and text of each marker.
    #[getter]
    fn markers(&self) -> Vec<(f64, &'static str, Option<u8>, String)> {
        let markers = self.trial.markers.iter();
        let markers = markers.map(|m| (m.t_s, m.kind.word(), m.channel, m.text.clone()));
        markers.collect()
    }

    #[getter]
    fn pulses(&self) -> Option<u64> {
        self.trial.pulses
    }

    /// Why no pulse was played; `None` if there were pulses.
    #[getter]
    fn silent(&self) -> Option<String> {
        self.trial.silent.clone()
    }

    #[getter]
    fn duration_s(&self) -> f64 {
        self.trial.duration_s
    }

    #[getter]
    fn title(&self) -> &str {
        &self.trial.name
    }

    #[getter]
    fn session_text(&self) -> &str {
        &self.trial.session_text
    }

    /// Whether the wearer was simulated.
    #[getter]
    fn simulated(&self) -> bool {
        self.trial.is_simulated()
    }

    #[getter]
    fn path(&self) -> Option<PathBuf> {
        self.path.clone()
    }

    /// Reason for which the trial ended early.
    #[getter]
    fn error(&self) -> Option<String> {
        self.error.clone()
    }

    fn __len__(&self) -> usize {
        self.trial.samples.len()
    }

    /// Reads the record in a folder; one object per trial.
    #[staticmethod]
    fn load(py: Python<'_>, folder: PathBuf) -> PyResult<Vec<Self>> {
        let run = py.detach(|| record::load(&folder));
        let run = run.map_err(|error| crate::errors::of_message(py, "error", &error))?;
        if let Some(damaged) = run.damage_error(&folder) {
            return Err(crate::errors::of_message(py, "error", &damaged));
        }
        let path = Some(folder);
        let is_incomplete = run.ending.is_incomplete();
        let unknown =
            || "the program that writes the record was killed, lost its disk, or still runs";
        let reason = run.ending.reason;
        let reason = reason.or_else(|| is_incomplete.then(|| unknown().to_owned()));
        let trials = run.trials.into_iter();
        Ok(trials
            .map(|trial| Self::new(trial, path.clone(), reason.clone()))
            .collect())
    }
}

/// Columns of edges: time in µs, channel, index of the state, DAC code.
pub type EdgeArrays<'py> = (
    Bound<'py, PyArray1<u64>>,
    Bound<'py, PyArray1<u8>>,
    Bound<'py, PyArray1<u8>>,
    Bound<'py, PyArray1<u16>>,
);

/// Reading of the electrode check: channel, applied amplitude, current in mA, load in Ω.
pub type ReadingTuple = (u8, f64, f64, Option<f64>);

/// Returns a reading as Python gets it.
pub fn reading_tuple(reading: &ElectrodeReading) -> ReadingTuple {
    let load_ohm = reading.load_ohm;
    (
        reading.channel,
        reading.applied,
        reading.current_ma,
        load_ohm,
    )
}

/// Name of a column, and its values: an array of numbers or a list of words.
pub type Column<'py> = (String, Bound<'py, PyAny>);

/// Returns samples as the columns of `samples.csv`.
pub fn columns<'py>(
    py: Python<'py>,
    channels: &[ChannelInfo],
    samples: impl Iterator<Item = Sample> + Send,
) -> PyResult<Vec<Column<'py>>> {
    let names = sample_columns(channels);
    let mut numbers: Vec<Vec<f64>> = vec![Vec::new(); names.len()];
    let mut words: Vec<Vec<&'static str>> = vec![Vec::new(); names.len()];
    py.detach(|| {
        for sample in samples {
            let mut column = 0;
            visit_sample(&sample, channels, |field| {
                match (field, numbers.get_mut(column), words.get_mut(column)) {
                    (Field::Time(seconds), Some(values), _) => values.push(seconds),
                    (Field::Number(value), Some(values), _) => {
                        values.push(value.unwrap_or(f64::NAN));
                    }
                    (Field::Word(word), _, Some(values)) => values.push(word),
                    _ => {}
                }
                column += 1;
            });
        }
    });
    let columns = names.into_iter().zip(numbers).zip(words);
    columns
        .map(|((name, numbers), words)| match words.is_empty() {
            true => Ok((name, numbers.into_pyarray(py).into_any())),
            false => Ok((name, PyList::new(py, words)?.into_any())),
        })
        .collect()
}

/// Returns edges as four arrays.
pub fn edge_arrays<'py>(py: Python<'py>, edges: &[Edge]) -> EdgeArrays<'py> {
    let state = |edge: &Edge| match edge.state {
        State::Isolated => 0_u8,
        State::Anodic => 1,
        State::Cathodic => 2,
        State::Grounded => 3,
    };
    let times: Vec<u64> = edges.iter().map(|edge| edge.t_us).collect();
    let channels: Vec<u8> = edges.iter().map(|edge| edge.channel).collect();
    let states: Vec<u8> = edges.iter().map(state).collect();
    let codes: Vec<u16> = edges.iter().map(|edge| edge.dac_code).collect();
    (
        times.into_pyarray(py),
        channels.into_pyarray(py),
        states.into_pyarray(py),
        codes.into_pyarray(py),
    )
}
