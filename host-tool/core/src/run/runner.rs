//! The course of a session: configure, arm, start, stream, stop.

mod ended;
mod measured;
mod record;

use super::stages::{check_opposition, check_stages};
use super::{Observer, Outputs, RunError, Seen, SessionFile, Stopped, Wish, trial};
use crate::link::{Client, Error, Incoming, Interruption, Port, Refused, stamp};
use crate::record::{Recorder, Trial};
use crate::session::{Course, Session, Setpoint};
use firmware::link::{Counters, Event, HelloInfo, Request};
use firmware::safety::{Stages, State};
use std::collections::VecDeque;
use std::iter;

/// Longest wait for the outputs to be reported isolated after a stop, µs.
const STOP_US: u64 = 300_000;

/// Longest wait for the grounding that follows an acknowledgement, µs.
const ACKNOWLEDGE_US: u64 = 300_000;

/// Forces at the hand are sent so long before they are valid, that none is late for its
/// recruitment, µs.
const AHEAD_US: u64 = 10_000;

/// Wanted forces at the hand whose answers may be on their way.
const WISHES: usize = 64;

/// From measurement to measurement of an arm's nine angles, µs.
const POSTURE_US: u64 = 20_000;

/// A device that says nothing for so long is lost, µs. It owes telemetry every
/// 100 ms at least.
const SILENCE_US: u64 = 1_000_000;

/// From one time that a simulated device's outputs are taken to the next, µs.
const TAKE_US: u64 = 1_000_000;
/// So many messages are filed at once when a setpoint is due, and the rest after it: a
/// device that sends without end delays neither setpoints nor the session's end.
const MOST_AT_ONCE: usize = 1000;

/// What came of a session, complete or not.
pub struct Outcome {
    /// Everything recorded.
    pub trial: Trial,
    /// Who ran it.
    pub device: Option<HelloInfo>,
    /// Epoch of the trains in the port's own time, µs.
    pub epoch_us: Option<u64>,
    /// Requests refused while it ran.
    pub refused: usize,
    /// Why it ended early, if it did.
    pub error: Option<RunError>,
}

struct Run<'a, 'o, P> {
    session: &'a Session,
    client: Client<P>,
    trial: Trial,
    recorder: Option<&'a mut Recorder>,
    /// Who takes a simulated device's outputs while it runs; else its world keeps them.
    outputs: Option<&'o mut dyn Outputs>,
    /// Pulses that were taken, and up to when, in the port's time.
    taken: (u64, u64),
    observer: &'a mut dyn Observer,
    /// When the trains started, device time in µs.
    epoch: u64,
    /// The same in the port's time.
    epoch_us: u64,
    /// A board's count of this run's pulses after the electrode check, where no
    /// trace tells.
    checked: u32,
    /// What the device had counted before: nothing if it booted for this.
    begun: Counters,
    refused: usize,
    /// The latest of them and when it came, s after the start.
    last_refused: Option<(f64, Refused)>,
    /// Why the device ended it, if it did.
    ended: Option<RunError>,
    /// Events that came beyond the most that are kept.
    left_out: u64,
    /// Every train of a fixed number of pulses has played: the session is over.
    is_finished: bool,
    /// The latest forces at the hand that were asked for, with their numbers.
    wishes: VecDeque<(u16, [i32; 3])>,
    /// When the device last said something, in the port's time.
    heard_us: u64,
    /// How long this computer had stalled in sum by then, µs.
    heard_stalled_us: u64,
}

/// Runs `session` through `port` and gives the port back with the outcome.
/// `observer` sees it run and may end it; a closure hears the part done, 0 to 1.
pub fn run<P: Port>(
    file: &SessionFile,
    port: P,
    recorder: Option<&mut Recorder>,
    observer: impl Observer,
) -> (Outcome, Option<P>) {
    conduct(file, port, (recorder, None), observer)
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
    conduct(file, port, (recorder, Some(outputs)), observer)
}

fn conduct<P: Port>(
    file: &SessionFile,
    port: P,
    (recorder, outputs): (Option<&mut Recorder>, Option<&mut dyn Outputs>),
    mut observer: impl Observer,
) -> (Outcome, Option<P>) {
    let session = &file.session;
    let trial = trial::begin_trial(file);
    let interruption = observer.interruption();
    let (client, info) = match open(port, interruption) {
        Ok(opened) => opened,
        Err(error) => {
            let outcome = Outcome {
                trial,
                device: None,
                epoch_us: None,
                refused: 0,
                error: Some(error),
            };
            return (outcome, None);
        }
    };
    observer.see(Seen::Hello(&info));
    let mut run = Run {
        session,
        client,
        trial,
        recorder,
        outputs,
        taken: (0, 0),
        observer: &mut observer,
        epoch: 0,
        epoch_us: 0,
        checked: 0,
        begun: Counters::default(),
        refused: 0,
        last_refused: None,
        ended: None,
        is_finished: false,
        left_out: 0,
        wishes: VecDeque::new(),
        heard_us: 0,
        heard_stalled_us: 0,
    };
    let started = run.identify(&info).and_then(|()| run.prepare(&info.stages));
    let is_started = started.is_ok();
    let streamed = started.and_then(|()| run.stream());
    let t_s = is_started.then(|| run.t_s());
    run.client.ignore_signals();
    // Whatever happened, ask for a stop; a lost device stops by itself.
    let stopped = run.client.stop();
    if !is_started {
        // The first error is the one to tell.
        let _ = run.read_electrodes();
    }
    let finished = match &stopped {
        Ok(_) if is_started => run.finish(),
        _ => Ok(()),
    };
    let result = match (streamed, stopped) {
        (Ok(()), Ok(_)) => finished,
        (Ok(()), Err(error)) => Err(error.into()),
        (Err(error), Ok(_)) => Err(signalled(error, t_s, Stopped::Acknowledged)),
        (Err(error), Err(why)) => Err(signalled(error, t_s, Stopped::Unanswered(why))),
    };
    run.clock();
    run.count_left_out();
    if let Err(error) = &result {
        run.cut_short(error);
    }
    if is_started {
        run.take_the_last_outputs();
        run.count_pulses();
    }
    let outcome = Outcome {
        trial: run.trial,
        device: Some(info),
        epoch_us: is_started.then_some(run.epoch_us),
        refused: run.refused,
        error: result.err(),
    };
    (outcome, Some(run.client.into_port()))
}

/// The device's first answer.
fn open<P: Port>(
    port: P,
    interruption: Option<Interruption>,
) -> Result<(Client<P>, HelloInfo), RunError> {
    let opened = Client::open_interruptible(port, interruption);
    opened.map_err(|error| signalled(error.into(), None, Stopped::NotOpen))
}

/// Waits until the device has answered, and gives the port back.
///
/// # Errors
/// It does not answer, another host holds its session, or a signal came.
pub fn greet<P: Port>(port: P, interruption: &Interruption) -> Result<P, RunError> {
    let (client, _) = open(port, Some(interruption.clone()))?;
    Ok(client.into_port())
}

/// What a signal ended, `t_s` after the start, is told as such.
fn signalled(error: RunError, t_s: Option<f64>, stopped: Stopped) -> RunError {
    match error {
        RunError::Link(Error::Interrupted(signal)) => RunError::Signal {
            signal,
            t_s,
            stopped,
        },
        error => error,
    }
}

/// Clears a latched fault, if there is one, and gives the port back.
///
/// # Errors
/// The device does not answer, or another host holds its session.
pub fn acknowledge<P: Port>(port: P) -> Result<P, Error> {
    let (mut client, info) = Client::open(port)?;
    if info.state == State::Fault {
        client.acknowledge()?;
        let until = client.port().now_us() + ACKNOWLEDGE_US;
        while client.status()?.state == State::Fault && client.port().now_us() < until {
            let soon = client.port().now_us() + 10_000;
            client.next(soon)?;
        }
    }
    Ok(client.into_port())
}

impl<P: Port> Run<'_, '_, P> {
    fn prepare(&mut self, stages: &Stages) -> Result<(), RunError> {
        // It may have played for others, or another trial, since it booted.
        let is_new = (self.client.port().world()).is_some_and(|world| !world.is_used());
        if !is_new {
            self.begun = self.client.status()?.counters;
        }
        check_stages(self.session, stages)?;
        check_opposition(self.session, stages)?;
        for request in self.session.requests() {
            self.client.request(request)?;
        }
        if self.measures() && self.client.port().glove_deg().is_none() {
            return Err(RunError::NoGlove("this device".to_owned()));
        }
        self.client.subscribe(self.session.telemetry_ms)?;
        self.client.arm()?;
        self.poll_observer()?;
        if self.client.port().world().is_none() {
            let pulses = self.client.status()?.counters.pulses;
            self.checked = pulses.wrapping_sub(self.begun.pulses);
        }
        if self.measures_posture() {
            if self.client.port().posture_deg().is_none() {
                return Err(RunError::NoPosture("this device".to_owned()));
            }
            for request in self.posture() {
                self.client.request(request)?;
            }
        }
        if !self.session.modulations.is_empty() {
            let is_simulated =
                self.client.port().world().is_some() || self.client.port().image().is_some();
            if !is_simulated {
                return Err(RunError::ScriptedAngles("this device".to_owned()));
            }
            for request in self.joint_angles(0) {
                self.client.request(request)?;
            }
        }
        // The first setpoint is there before the first pulse.
        self.client
            .request(self.session.setpoints.at(0).request(None))?;
        for beside in self.session.counted_from_start() {
            self.client.request(beside.request(None))?;
        }
        self.epoch = self.client.start()?;
        let now_us = self.client.port().now_us();
        self.hear();
        let is_simulated = self.client.port().world().is_some();
        // In a simulated world, host time and device time are one.
        let now = match is_simulated {
            true => now_us,
            false => self.device_time(now_us),
        };
        // The epoch is at most a few milliseconds from now.
        self.epoch_us = (now_us + self.epoch).saturating_sub(now);
        Ok(())
    }

    fn stream(&mut self) -> Result<(), RunError> {
        let begin = self.epoch_us;
        let end = begin + self.session.duration_us;
        let mut asked_us = 0;
        for index in 1.. {
            let due = self.session.setpoints.due_us(index);
            self.trigger(asked_us, due);
            asked_us = due;
            self.listen((begin + due).min(end))?;
            self.take_outputs();
            if begin + due >= end || self.is_finished {
                break;
            }
            self.post(self.session.setpoints.due_us(index - 1), due)?;
            if index % 90 == 0 {
                let part = due as f64 / self.session.duration_us as f64;
                self.observer.see(Seen::Progress(part));
            }
        }
        self.observer.see(Seen::Progress(1.0));
        Ok(())
    }

    /// Sends what is due `due` µs after the start, and changes of rung since
    /// `before`.
    fn post(&mut self, before: u64, due: u64) -> Result<(), RunError> {
        if self.measures()
            && let Some(deg) = self.client.port().glove_deg()
        {
            let at = stamp(self.now());
            let (joint, centideg) = (0, (deg * 100.0).round() as i16); // saturates
            let measured = Request::Measurement {
                joint,
                centideg,
                at,
            };
            self.client.post(measured)?;
        }
        if self.measures_posture() && before / POSTURE_US != due / POSTURE_US {
            for request in self.posture() {
                self.client.post(request)?;
            }
        }
        for request in self.joint_angles(due) {
            self.client.post(request)?;
        }
        for request in self.session.rungs(before, due) {
            self.client.post(request)?;
        }
        for request in self.session.setpoints.lists(before, due) {
            self.client.post(request)?;
        }
        let now = self.epoch + due;
        let setpoints = &self.session.setpoints;
        let ahead_us = match &setpoints.course {
            Course::Wrench(_) => AHEAD_US,
            _ => 0,
        };
        let driven = setpoints.at(due + ahead_us);
        for setpoint in iter::once(driven).chain(setpoints.with(due)) {
            let at = match setpoint {
                Setpoint::Wrench(_) => Some(stamp(now + ahead_us)),
                Setpoint::Angle { .. } | Setpoint::Force { .. } => Some(stamp(now)),
                Setpoint::Amplitudes(_) | Setpoint::Held(_) | Setpoint::KeepAlive => None,
            };
            let seq = self.client.post(setpoint.request(at))?;
            if let Setpoint::Wrench(force_mn) = setpoint {
                self.wishes.truncate(WISHES - 1);
                self.wishes.push_front((seq, force_mn));
            }
        }
        Ok(())
    }

    /// Device time now, µs.
    fn now(&mut self) -> u64 {
        let now_us = self.client.port().now_us();
        self.device_time(now_us)
    }

    /// Device time at `port_us` of the port's, µs; the epoch before any answer.
    fn device_time(&self, port_us: u64) -> u64 {
        self.client.device_time(port_us).unwrap_or(self.epoch)
    }

    /// Seconds from the start of the trains to the device time `at_us`.
    fn since_start_s(&self, at_us: u64) -> f64 {
        trial::since_s(at_us, self.epoch)
    }

    /// Files what arrives by `until_us`, or has arrived by now if that is over.
    fn listen(&mut self, until_us: u64) -> Result<(), RunError> {
        let until_us = until_us.max(self.client.port().now_us());
        let mut late = 0;
        while late < MOST_AT_ONCE
            && let Some(incoming) = self.client.next(until_us)?
        {
            self.hear();
            late += usize::from(self.heard_us > until_us);
            self.file(incoming)?;
            if let Some(ended) = self.ended.take() {
                return Err(ended);
            }
            if self.is_finished {
                return Ok(());
            }
            self.poll_observer()?;
        }
        self.check_silence()?;
        self.poll_observer()
    }

    /// After a stop: waits until the outputs are reported isolated, asks for
    /// counters.
    fn finish(&mut self) -> Result<(), RunError> {
        let wait_us = if self.is_finished { 0 } else { STOP_US };
        let until = self.client.port().now_us() + wait_us;
        for _ in 0..MOST_AT_ONCE {
            let Some(incoming) = self.client.next(until)? else {
                break;
            };
            let is_end = matches!(
                incoming,
                Incoming::Event(_, Event::Stopped(_) | Event::Faulted(_))
            );
            self.file(incoming)?;
            if is_end {
                break;
            }
        }
        let status = self.client.status()?;
        self.observer.see(Seen::Status(&status));
        self.trial.counters = trial::counters(&self.begun, &status.counters);
        self.client.subscribe(0)?;
        let world = self.client.port().world();
        match world.map_or(0, |world| world.body.unsettled()) {
            0 => Ok(()),
            stretches => Err(RunError::Unsettled(stretches)),
        }
    }
}
