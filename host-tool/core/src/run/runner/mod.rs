//! Runs a whole session in one call: opens, configures, arms, starts, streams and stops.

use super::stepper::{Attachments, Stepper, to_signal_error};
use super::{Observer, Outcome, Outputs, RunError, SessionFile, Stopped, trial};
use crate::link::{Connection, Error, Interruption, Port};
use crate::record::Recorder;
use firmware::safety::State;

/// Longest time to wait until the device has grounded its outputs after a fault was acknowledged,
/// µs.
const ACKNOWLEDGE_US: u64 = 300_000;

/// Runs the session of `file` through `port`. Returns the outcome, and the port unless the device
/// did not answer. `observer` is informed of everything that happens and can end the run; a closure
/// receives the progress, 0 to 1.
pub fn run<P: Port>(
    file: &SessionFile,
    port: P,
    recorder: Option<&mut Recorder>,
    observer: impl Observer + Send,
) -> (Outcome, Option<P>) {
    conduct(file, port, recorder, None, observer)
}

/// Runs a session as [`run`] does, and passes the output of a simulated device to `outputs` while
/// the session runs. The output is removed from the simulated world meanwhile.
pub fn run_with_outputs<P: Port>(
    file: &SessionFile,
    port: P,
    recorder: Option<&mut Recorder>,
    observer: impl Observer + Send,
    outputs: &mut (dyn Outputs + Send),
) -> (Outcome, Option<P>) {
    conduct(file, port, recorder, Some(outputs), observer)
}

fn conduct<P: Port>(
    file: &SessionFile,
    port: P,
    recorder: Option<&mut Recorder>,
    outputs: Option<&mut (dyn Outputs + Send)>,
    observer: impl Observer + Send,
) -> (Outcome, Option<P>) {
    let attached = Attachments {
        recorder: recorder.map(|recorder| Box::new(recorder) as _),
        outputs: outputs.map(|output| Box::new(output) as _),
        observer: Box::new(observer),
    };
    let mut stepper = match Stepper::open(file, port, attached) {
        Ok(stepper) => stepper,
        Err(error) => {
            let outcome = Outcome {
                trial: trial::begin_trial(file),
                device: None,
                epoch_us: None,
                refused: 0,
                error: Some(error),
            };
            return (outcome, None);
        }
    };
    let ran = stepper.run_to_end();
    let (outcome, port) = stepper.close(ran);
    (outcome, Some(port))
}

/// Opens a session to check that the device answers `Hello`, and returns the port.
///
/// # Errors
/// The device does not answer, another host holds its session, or a signal arrived.
pub fn wait_for_hello<P: Port>(port: P, interruption: &Interruption) -> Result<P, RunError> {
    let opened = Connection::open_interruptible(port, Some(interruption.clone()));
    let (connection, _) =
        opened.map_err(|error| to_signal_error(error.into(), None, Stopped::NotOpen))?;
    Ok(connection.into_port())
}

/// Acknowledges the fault of the device if one is latched, and returns the port.
///
/// # Errors
/// The device does not answer, or another host holds its session.
pub fn acknowledge<P: Port>(port: P) -> Result<P, Error> {
    let (mut connection, info) = Connection::open(port)?;
    if info.state == State::Fault {
        connection.acknowledge()?;
        let until = connection.port().now_us() + ACKNOWLEDGE_US;
        while connection.status()?.state == State::Fault && connection.port().now_us() < until {
            let soon = connection.port().now_us() + 10_000;
            connection.next(soon)?;
        }
    }
    Ok(connection.into_port())
}
