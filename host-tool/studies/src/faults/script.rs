//! Records a session's host messages once, and replays them to a freshly booted board.

use super::bench::Bench;
use super::case::CaseEnd;
use super::error::{FaultsError, never_runs};
use super::simulated::{Boards, FaultableDevice, Native, judge_case};
use super::truth::declared_truth;
use firmware::link::{Decoder, ToDevice};
use firmware::lockstep::{Lockstep, Sensors, Sink};
use firmware::units::Micros;
use hal_sim::body::Load;
use hal_sim::chip::board::Board;
use hal_sim::chip::image::Image;
use hal_sim::lockstep::{Device, Output};
use hal_sim::native::native;
use hal_sim::trace::Trace;
use hal_sim::trace::judge::{Rule, Truth, Verdict};
use hal_sim::wire::faults::DELIMITER;
use hal_sim::wire::stream::{Stream, Write};
use hal_sim::world::Recorder;
use host_core::run::{SessionFile, power_on, run, simulated_port};
use host_core::session::Session;
use std::collections::VecDeque;
use std::io;
use std::sync::{Arc, Mutex, PoisonError};

/// Interval between stored copies of a simulated board, µs.
pub(super) const KEPT_US: u64 = 50_000;
/// Time that a run lasts after the host's last message, µs.
const AFTER_US: u64 = 250_000;
/// Interval at which the simulation checks which messages the bus has delivered, µs.
const LOOK_US: u64 = 250;
/// Interval at which the simulation checks whether the run may end, µs.
const ASKED_US: u64 = 20_000;

/// Boards of one simulator that can replay a script and, if that is useful, be copied.
pub(super) trait ForkableBoards: Boards<Board: 'static> {
    /// Longest time from the delivery of a message by the bus until the device has read it, µs.
    const LINE_US: u64;
    /// Longest time from plugging in the cable until host and board can communicate again, µs.
    const CONNECTS_US: u64;
    /// Whether processing one frame never delays anything else, so that two runs agree to the
    /// microsecond.
    const IS_EXACT: bool;

    /// Boots a board with the output stages of `session`, to which the host has sent nothing yet.
    fn boot(&self, session: &Session, sensors: Sensors) -> Result<Bench<Self::Board>, FaultsError>;

    /// Copies a board in its current state; returns `None` if repeating its run is faster.
    fn fork(board: &Self::Board) -> Option<Self::Board>;
}

impl ForkableBoards for Image {
    /// The device processes one packet before it takes the next, which arrives with the next frame
    /// of the bus.
    const LINE_US: u64 = 1_500;
    /// Debounce, reset and recovery of the bus (USB 2.0 section 7.1.7), and the first requests of a
    /// host.
    const CONNECTS_US: u64 = 200_000;
    const IS_EXACT: bool = false;

    fn boot(&self, session: &Session, sensors: Sensors) -> Result<Bench<Board<()>>, FaultsError> {
        let mut board = power_on(session, self, ())?;
        board.boot(&Sensors::default())?;
        let now_us = board.now_us();
        Ok(Bench::new(board, Recorder::default(), now_us, sensors))
    }

    fn fork(board: &Board<()>) -> Option<Board<()>> {
        Some(board.clone())
    }
}

impl ForkableBoards for Native {
    const LINE_US: u64 = 0;
    const CONNECTS_US: u64 = 0;
    const IS_EXACT: bool = true;

    fn boot(&self, _: &Session, sensors: Sensors) -> Result<Bench<Lockstep>, FaultsError> {
        let device = native(Micros::new(0));
        Ok(Bench::new(device, Recorder::default(), 0, sensors))
    }

    fn fork(_: &Lockstep) -> Option<Lockstep> {
        None
    }
}

/// A recorded session: all messages of its host, and the output that they cause without a fault.
pub(super) struct Script<B: ForkableBoards> {
    /// Session file that was recorded.
    pub file: SessionFile,
    /// Messages of the host, undisturbed.
    pub said: Stream,
    /// Output of the device without a fault.
    pub whole: Trace,
    /// Rule and channel of each finding that the judge would report without protective circuits,
    /// although no fault was injected.
    always: Vec<(Rule, u8)>,
    /// Index of the message `Start`, and its time, µs.
    pub start: (usize, u64),
    pub stop: (usize, u64),
    sensors: Sensors,
    /// Stored copies of the board, each with its time, µs.
    kept: Vec<(u64, Mutex<Bench<B::Board>>)>,
}

/// Device that records each message of the host and passes it on to another device.
struct WriteRecorder<D> {
    device: D,
    heard: Arc<Mutex<Vec<Write>>>,
}

impl<D: Device> Device for WriteRecorder<D> {
    fn receive(
        &mut self,
        at: Micros,
        bytes: &[u8],
        sensors: &Sensors,
        sink: &mut dyn Sink,
    ) -> io::Result<()> {
        let mut heard = self.heard.lock().unwrap_or_else(PoisonError::into_inner);
        heard.push(Write {
            t_us: at.get().into(), // far from wrapping
            bytes: bytes.to_vec(),
        });
        drop(heard);
        self.device.receive(at, bytes, sensors, sink)
    }

    fn advance(&mut self, to: Micros, sensors: &Sensors, sink: &mut dyn Sink) -> io::Result<()> {
        self.device.advance(to, sensors, sink)
    }

    fn output(&self, channel: usize) -> Option<Output> {
        self.device.output(channel)
    }
}

impl<B: ForkableBoards> Script<B> {
    /// Plays the session with its own host and wearer, and records the host's messages.
    ///
    /// # Errors
    /// Fails if the session does not run to its end without a fault.
    pub fn record(boards: &B, file: &SessionFile) -> Result<Self, FaultsError> {
        let session = &file.session;
        let bench = boards.boot(session, Sensors::default())?;
        let (boot_us, heard) = (bench.now_us(), Arc::default());
        let tap = Box::new(WriteRecorder {
            device: bench.device,
            heard: Arc::clone(&heard),
        });
        let boot = Micros::new(boot_us as u32); // far from wrapping
        let port = simulated_port(session, 0, tap, boot).map_err(never_runs)?;
        let (outcome, port) = run(file, port, None, |_: f64| {});
        let (None, Some(port)) = (outcome.error.as_ref(), port) else {
            let why = outcome.error.map_or_else(String::new, |e| e.to_string());
            return Err(FaultsError::NeverStimulates(format!(
                "{}: {why}",
                file.name
            )));
        };
        let sensors = Sensors {
            load_ohm: port.world.sensors.load_ohm,
            ..Sensors::default()
        };
        drop(port);
        let heard = Arc::into_inner(heard).map(Mutex::into_inner);
        let heard = heard.map(|writes| writes.unwrap_or_else(PoisonError::into_inner));
        let stream = Stream::new(heard.unwrap_or_default());
        let first_us = stream.writes().first().map_or(0, |write| write.t_us);
        let mut bench = boards.boot(session, sensors)?;
        bench.run_to(first_us).map_err(never_runs)?;
        Ok(Self {
            file: file.clone(),
            start: find(&stream, "Start")?,
            stop: find(&stream, "Stop")?,
            said: stream,
            whole: Trace::default(),
            always: Vec::new(),
            sensors,
            kept: fork_with_time::<B>(&bench).into_iter().collect(),
        })
    }

    /// Replays all messages on a board; stores copies of the board at intervals, and its output.
    ///
    /// # Errors
    /// Fails as [`Self::accept`] does.
    pub fn replay(&mut self, boards: &B) -> Result<(), FaultsError> {
        let mut bench = self.board(boards, self.first_us())?;
        let (mut kept, mut next_us) = (Vec::new(), 0);
        for write in self.said.writes() {
            if write.t_us >= next_us {
                bench.run_to(write.t_us).map_err(never_runs)?;
                kept.extend(self::fork_with_time::<B>(&bench));
                next_us = write.t_us + KEPT_US;
            }
            bench
                .receive(write.t_us, &write.bytes)
                .map_err(never_runs)?;
        }
        bench.run_to(self.end_us()).map_err(never_runs)?;
        self.kept = kept;
        self.accept(bench)
    }

    /// Judges and stores the output of `bench`, which ran without a fault. All cases are compared
    /// with it.
    ///
    /// # Errors
    /// Fails if the output is severe by itself, or if the device reports a fault.
    pub fn accept(&mut self, mut bench: Bench<B::Board>) -> Result<(), FaultsError> {
        let (fate, verdict) = judge_case(&mut bench, self.end_us(), self.truth());
        if let Some(severe) = fate.severe.first() {
            let severe = format!("{}: {severe}", self.file.name);
            return Err(FaultsError::SevereItself(severe));
        }
        if let Some(fault) = fate.fault {
            let why = format!("{}: fault {}", self.file.name, fault.number());
            return Err(FaultsError::NeverStimulates(why));
        }
        let bare = verdict.bare.findings.iter();
        self.always = bare.map(|found| (found.rule, found.channel)).collect();
        self.whole = bench.recorder.trace;
        Ok(())
    }

    /// Returns the time of the host's first message, µs.
    pub fn first_us(&self) -> u64 {
        self.said.writes().first().map_or(0, |write| write.t_us)
    }

    /// Returns the time at which a run of the whole script ends, µs.
    pub fn end_us(&self) -> u64 {
        let last = self.said.writes().last();
        last.map_or(0, |write| write.t_us) + AFTER_US
    }

    /// Returns the true electrode loads and limits by which the output is judged.
    pub fn truth(&self) -> Truth {
        let loads = self.sensors.load_ohm.map(|ohm| Load::Ohms(ohm.into()));
        declared_truth(&self.file.session, &loads)
    }

    /// Returns the findings that would be severe without protective circuits, except those that
    /// also exist without a fault.
    pub fn unprotected_findings(&self, verdict: &Verdict) -> Vec<String> {
        let found = verdict.bare.findings.iter();
        let found = found.filter(|finding| !self.always.contains(&(finding.rule, finding.channel)));
        found.map(ToString::to_string).collect()
    }

    /// Returns a copy of the last board that was stored up to `to_us`. The board has received all
    /// messages up to its own time.
    pub fn board(&self, boards: &B, to_us: u64) -> Result<Bench<B::Board>, FaultsError> {
        let after = self.kept.partition_point(|kept| kept.0 <= to_us);
        let fork = self.kept[..after].last().and_then(|(_, kept)| {
            let kept = kept.lock().unwrap_or_else(PoisonError::into_inner);
            fork::<B>(&kept)
        });
        match fork {
            Some(fork) => Ok(fork),
            None => boards.boot(&self.file.session, self.sensors),
        }
    }

    /// Sends `stream` to the board from the board's current time on, until `end_us` or until
    /// `is_over` returns `true`. `out` gives the times at which the cable is pulled and plugged in
    /// again. Returns the messages that the device received with their times, and how the run
    /// ended.
    ///
    /// # Errors
    /// Fails if the simulation cannot continue because the device did something that the simulator
    /// does not model.
    pub fn send_stream(
        &self,
        bench: &mut Bench<B::Board>,
        stream: &Stream,
        out: Option<(u64, u64)>,
        end_us: u64,
        is_over: &EndCheck<'_, B::Board>,
    ) -> (Stream, io::Result<CaseEnd>) {
        let mut passed = Vec::new();
        let done = send_writes(bench, stream, out, (end_us, is_over), &mut passed);
        (Stream::new(passed), done)
    }
}

/// Function that returns whether a run may end, given the board, the messages that it received, and
/// those that remain.
pub(super) type EndCheck<'a, D> = dyn Fn(&Bench<D>, &[Write], &[Write]) -> bool + 'a;

fn fork<B: ForkableBoards>(bench: &Bench<B::Board>) -> Option<Bench<B::Board>> {
    B::fork(&bench.device).map(|device| bench.with_device(device))
}

/// Returns a copy of the board with its time, µs, or `None` if the simulator's boards are not
/// copied.
fn fork_with_time<B: ForkableBoards>(
    bench: &Bench<B::Board>,
) -> Option<(u64, Mutex<Bench<B::Board>>)> {
    fork::<B>(bench).map(|fork| (fork.now_us(), Mutex::new(fork)))
}

fn send_writes<D: FaultableDevice>(
    bench: &mut Bench<D>,
    stream: &Stream,
    out: Option<(u64, u64)>,
    (end_us, is_over): (u64, &EndCheck<'_, D>),
    passed: &mut Vec<Write>,
) -> io::Result<CaseEnd> {
    let begin_us = bench.now_us();
    let mut asked_us = begin_us;
    let (out_us, in_us) = out.unwrap_or((u64::MAX, u64::MAX));
    let mut cable = [(out_us, false), (in_us, true)].into_iter().peekable();
    let mut waiting = VecDeque::new();
    let writes = stream.writes();
    let count = writes.partition_point(|write| write.t_us < end_us);
    for (at, write) in writes[..count].iter().enumerate() {
        if write.t_us < begin_us {
            passed.push(write.clone()); // received before the fork
            continue;
        }
        while let Some((at, is_in)) = cable.next_if(|pair| pair.0 <= write.t_us) {
            deliver_writes(bench, &mut waiting, passed, at)?;
            waiting.clear();
            bench.device.set_cable(is_in);
        }
        deliver_writes(bench, &mut waiting, passed, write.t_us)?;
        if waiting.is_empty() && write.t_us >= asked_us + ASKED_US {
            asked_us = write.t_us;
            if is_over(bench, passed, &writes[at..]) {
                return Ok(CaseEnd::Isolated);
            }
        }
        let is_lost = (out_us..in_us).contains(&write.t_us) || !bench.device.is_connected();
        if !is_lost {
            bench.receive(write.t_us, &write.bytes)?;
            // Each frame counts separately, because the device obeys it while those behind it wait.
            let frames = write.bytes.split_inclusive(|&byte| byte == DELIMITER);
            waiting.extend(frames.map(|bytes| Write {
                t_us: write.t_us,
                bytes: bytes.to_vec(),
            }));
        }
    }
    for (at, is_in) in cable.filter(|pair| pair.0 < end_us) {
        deliver_writes(bench, &mut waiting, passed, at)?;
        waiting.clear();
        bench.device.set_cable(is_in);
    }
    deliver_writes(bench, &mut waiting, passed, end_us)?;
    Ok(CaseEnd::Played)
}

/// Runs to `to_us`. Moves the messages that the device has read from `waiting` to `passed`, with
/// the time at which the simulation noticed it.
fn deliver_writes<D: FaultableDevice>(
    bench: &mut Bench<D>,
    waiting: &mut VecDeque<Write>,
    passed: &mut Vec<Write>,
    to_us: u64,
) -> io::Result<()> {
    loop {
        let mut left = waiting.iter().map(|write| write.bytes.len()).sum::<usize>();
        let unsent = bench.device.unread_bytes();
        while let Some(first) = waiting.pop_front_if(|first| left - first.bytes.len() >= unsent) {
            left -= first.bytes.len();
            let t_us = first.t_us.max(bench.now_us());
            passed.push(Write { t_us, ..first });
        }
        if bench.now_us() >= to_us {
            return Ok(());
        }
        let step_us = match waiting.is_empty() {
            true => to_us,
            false => to_us.min(bench.now_us() + LOOK_US),
        };
        bench.run_to(step_us)?;
    }
}

/// Decodes the request of an intact frame.
pub(super) fn decode_request(frame: &[u8]) -> Option<ToDevice> {
    let mut decoder = Decoder::default();
    let message = decoder.push_until_delimiter(&mut &*frame)?.ok()?;
    postcard::from_bytes(message).ok()
}

/// Returns the name of the request in a message, such as `Start`.
pub(super) fn name(asked: &ToDevice) -> String {
    let text = format!("{:?}", asked.request);
    let end = text.find(|c: char| !c.is_alphanumeric());
    text[..end.unwrap_or(text.len())].to_owned()
}

/// Returns index and time of the first message whose request has the name `wanted`.
fn find(stream: &Stream, wanted: &str) -> Result<(usize, u64), FaultsError> {
    let is = |write: &Write| {
        decode_request(&write.bytes).is_some_and(|to_device| name(&to_device) == wanted)
    };
    let found = stream.writes().iter().position(is);
    let write = found.map(|index| (index, stream.writes()[index].t_us));
    let why = || format!("the recorded host never sends {wanted}");
    write.ok_or_else(|| FaultsError::NeverStimulates(why()))
}
