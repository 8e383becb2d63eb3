//! Work on other threads that Ctrl-C and exceptions of callables end.

use crate::errors;
use host_core::link::{Interruption, Signal};
use pyo3::prelude::*;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

/// Time between two looks for signals.
const LOOK: Duration = Duration::from_millis(1);

/// First exception that a callable or a signal handler raised. It ends the work.
#[derive(Clone, Default)]
pub struct Raised(Arc<Mutex<Option<PyErr>>>, Interruption);

impl Raised {
    /// Returns the flag that ends the work on a device.
    pub fn interruption(&self) -> Interruption {
        self.1.clone()
    }

    /// Keeps the exception and interrupts the work.
    pub fn set(&self, error: PyErr) {
        let mut slot = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        slot.get_or_insert(error);
        self.1.raise_signal(Signal::Interrupt);
    }

    fn take(&self) -> Option<PyErr> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).take()
    }
}

/// Carries out `work` on a thread of its own without the interpreter. Ctrl-C, an exception of
/// `watch`, which is called meanwhile, and exceptions of other callables end it.
///
/// # Errors
/// The exception of a callable or a signal handler, after the work has ended.
pub fn supervise<T: Send>(
    py: Python<'_>,
    raised: &Raised,
    watch: Option<&Py<PyAny>>,
    work: impl FnOnce() -> T + Send,
) -> PyResult<T> {
    let done = py.detach(|| {
        std::thread::scope(|scope| {
            let worker = scope.spawn(work);
            while !worker.is_finished() {
                std::thread::sleep(LOOK);
                let seen = Python::attach(|py| match watch {
                    Some(watch) => py.check_signals().and(watch.call0(py).map(drop)),
                    None => py.check_signals(),
                });
                if let Err(error) = seen {
                    raised.set(error);
                }
            }
            worker.join()
        })
    });
    if let Some(error) = raised.take() {
        return Err(error);
    }
    done.map_err(|_| errors::internal("the work panicked; its device stops by itself"))
}
