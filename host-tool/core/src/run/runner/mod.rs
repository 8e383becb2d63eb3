//! A whole session in one call: opened, configured, armed, started, streamed, stopped.

use super::stepper::{Attached, Stepper, signalled};
use super::{Observer, Outcome, Outputs, RunError, SessionFile, Stopped, trial};
use crate::link::{Connection, Error, Interruption, Port};
use crate::record::Recorder;
use firmware::safety::State;

/// Longest wait for the grounding that follows an acknowledgement, µs.
const ACKNOWLEDGE_US: u64 = 300_000;

/// Runs `session` through `port` and gives the port back with the outcome.
/// `observer` sees it run and may end it; a closure hears the part done, 0 to 1.
pub fn run<P: Port>(
    file: &SessionFile,
    port: P,
    recorder: Option<&mut Recorder>,
    observer: impl Observer,
) -> (Outcome, Option<P>) {
    conduct(file, port, recorder, None, observer)
}

/// The same, and `outputs` takes what a simulated device puts out while it runs: then
/// its world has no trace of it in the end.
pub fn run_taken<P: Port>(
    file: &SessionFile,
    port: P,
    recorder: Option<&mut Recorder>,
    observer: impl Observer,
    outputs: &mut dyn Outputs,
) -> (Outcome, Option<P>) {
    conduct(file, port, recorder, Some(outputs), observer)
}

fn conduct<P: Port>(
    file: &SessionFile,
    port: P,
    recorder: Option<&mut Recorder>,
    outputs: Option<&mut dyn Outputs>,
    observer: impl Observer,
) -> (Outcome, Option<P>) {
    let attached = Attached {
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

/// Waits until the device has answered, and gives the port back.
///
/// # Errors
/// It does not answer, another host holds its session, or a signal came.
pub fn greet<P: Port>(port: P, interruption: &Interruption) -> Result<P, RunError> {
    let opened = Connection::open_interruptible(port, Some(interruption.clone()));
    let (connection, _) =
        opened.map_err(|error| signalled(error.into(), None, Stopped::NotOpen))?;
    Ok(connection.into_port())
}

/// Clears a latched fault, if there is one, and gives the port back.
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
