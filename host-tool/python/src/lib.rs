//! The extension module `flexor._native`: sessions, devices and records of `host-core` for Python.
//!
//! Nothing here decides what a session means or what the protocol says. This crate converts Python
//! values into those of `host-core` and back, and sees to it that a call can be interrupted. The
//! classes and functions that users see are written in Python, in `flexor/`.

mod benchmark;
mod body;
mod convert;
mod device;
mod errors;
mod models;
mod open;
mod procedures;
mod record;
mod runner;
mod session;
mod setpoints;
mod statistics;
mod supervise;

use pyo3::prelude::*;

/// Private extension of the package `flexor`.
#[pymodule]
mod _native {
    #[pymodule_export]
    use super::benchmark::time_steps;
    #[pymodule_export]
    use super::device::Device;
    #[pymodule_export]
    use super::models::{Controller, force_stimulus, muscle_response};
    #[pymodule_export]
    use super::procedures::{calibrate, check_thresholds, run_searches};
    #[pymodule_export]
    use super::record::Record;
    #[pymodule_export]
    use super::session::{
        check, edges, run, run_many, session_text, sessions, wearer_text, wearers,
    };
    #[pymodule_export]
    use super::statistics::{
        friedman, holm, mann_whitney, paired_t, shapiro_wilk, wilcoxon, wilson_share,
    };
}
