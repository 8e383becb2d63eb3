//! A session that plays in the page: by itself, or with setpoints from the page.

use crate::check;
use crate::describe::describe;
use crate::error::CallError;
use crate::memory::Memory;
use crate::tap::{Tap, numbers};
use firmware::link::Request;
use hal_sim::trace::Trace;
use host_core::clock::Moment;
use host_core::drive::{LatestAmplitudes, SetpointValues};
use host_core::link::Port;
use host_core::record::{
    Ending, Plan, RecordError, Recorder, Run, Sample, Trial, write_header_on, write_run_on,
};
use host_core::report::{Report, write_on};
use host_core::run::{
    Attachments, Control, DeviceName, FullestPeriod, Observation, Observer, RunError, SessionFile,
    StepEnd, StepLimit, Stepper, begin_trial,
};
use serde::Deserialize;
use serde_json::{Value, json};
use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};

/// Longest session that the page records, s. Its files are in memory.
const LONGEST_RECORD_S: u64 = 3_600;

/// Age from which the output of the device no longer changes, µs; it is rendered 250 µs ahead.
const SETTLED_US: u64 = 1_000;

/// Folder of the record, whose files have paths relative to it.
const RECORD: &str = "";

/// A session to be opened.
#[derive(Deserialize, Debug)]
#[serde(deny_unknown_fields)]
pub struct Opening {
    /// Name of the session file.
    name: String,
    /// Text of the file, which may differ from the file of that name.
    text: String,
    /// Controller in place of the file's own.
    #[serde(default)]
    law: Option<String>,
    /// Seed of the simulated wearer: a number, or a text if it is larger than a JavaScript number
    /// holds.
    seed: Seed,
    /// Whether the page sends the setpoints; the session then has no length and no record.
    #[serde(default)]
    live: bool,
    /// Present time, ms since 1970 in UTC, for the record.
    #[serde(default)]
    now_ms: u64,
}

/// Seed of 64 bits.
#[derive(Deserialize, Debug)]
#[serde(untagged)]
enum Seed {
    Number(u64),
    Text(String),
}

impl Seed {
    fn read(&self) -> Result<u64, CallError> {
        match self {
            Self::Number(seed) => Ok(*seed),
            Self::Text(text) => text.trim().parse().map_err(|_| {
                CallError::new(format!("the seed {text:?} is no whole number of 64 bits"))
            }),
        }
    }
}

/// Setpoints from the page.
#[derive(Deserialize, Default, Debug)]
#[serde(deny_unknown_fields, default)]
pub struct Setpoints {
    /// Channels with their amplitudes, mA.
    ma: Vec<(u8, f64)>,
    /// Channels with their amplitudes, V.
    v: Vec<(u8, f64)>,
    /// Reference angle, °, and its rate, °/s.
    angle_deg: Option<(f64, f64)>,
    /// Torque from outside on a simulated finger, N·m, flexion positive.
    external_nm: Option<f64>,
}

/// Action at the controls.
#[derive(Deserialize, Debug)]
#[serde(rename_all = "snake_case")]
pub enum Action {
    Pause,
    Resume,
    Raise(u8),
    Lower(u8),
    Mark(String),
    Stop,
}

type PageStepper = Stepper<'static, Box<dyn Port>>;

/// A session with its simulated wearer.
pub struct Playback {
    /// `None` when the session has ended.
    stepper: Option<Box<PageStepper>>,
    run: Run,
    files: Memory,
    tap: Tap,
    /// Start of the trains in the port's time, µs.
    started_us: u64,
    latest: LatestAmplitudes,
    is_live: bool,
    /// Samples that the page has not received yet.
    feed: Feed,
    /// Number of events that the page has received.
    events: usize,
    /// Events that came while the device stopped.
    late: Vec<(f64, String)>,
}

/// Samples that have arrived.
#[derive(Clone, Default)]
struct Feed(Arc<Mutex<Vec<Sample>>>);

impl Feed {
    fn take(&self) -> Vec<Sample> {
        std::mem::take(&mut *self.0.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

impl Observer for Feed {
    fn observe(&mut self, seen: Observation<'_>) {
        if let Observation::Sample(sample) = seen {
            let mut samples = self.0.lock().unwrap_or_else(PoisonError::into_inner);
            samples.push(sample.clone());
        }
    }
}

impl Playback {
    /// Configures, arms and starts the session, and describes it.
    ///
    /// # Errors
    /// The mistakes of the text, a session that is too long to record here, or a refusal of the
    /// device.
    pub fn open(opening: &Opening) -> Result<(Self, Value), CallError> {
        let file = check::read(&opening.name, &opening.text, opening.law.as_deref())?;
        let seed = opening.seed.read()?;
        let session = &file.session;
        let description = describe(session);
        if !opening.live && session.duration_us > LONGEST_RECORD_S * 1_000_000 {
            return Err(CallError::new(format!(
                "E815 the session lasts longer than {LONGEST_RECORD_S} s, which this page cannot \
                 record; shorten `duration_s`, or use `flexor run`"
            )));
        }
        let port = DeviceName::Native.open(session, seed);
        let port = port.map_err(CallError::new)?;
        let files = Memory::default();
        let device = DeviceName::Native.to_string();
        let plan = Plan {
            law: opening.law.clone(),
            ..Plan::new("run", &device)
        };
        let start = Moment {
            since_1970: std::time::Duration::from_millis(opening.now_ms),
            local_offset_s: 0,
        };
        let run = Run::begin(&session.title, &device, Some(seed), plan, start);
        let duration_us = session.duration_us;
        let (recorder, fullest): (Option<Recorder>, _) = match opening.live {
            true => (None, None),
            false => {
                let begun = begin_record(&files, &run, &file).map_err(CallError::new)?;
                (
                    Some(begun),
                    Some(FullestPeriod::new(session, duration_us / 2)),
                )
            }
        };
        let (feed, tap) = (Feed::default(), Tap::new(fullest));
        let attached = Attachments {
            recorder: recorder.map(|recorder| Box::new(Box::new(recorder)) as _),
            outputs: Some(Box::new(tap.clone())),
            observer: Box::new(feed.clone()),
        };
        let telemetry = Request::Subscribe {
            period_ms: session.telemetry_ms,
        };
        let stepper = Stepper::open_owned(file, port, attached).map_err(CallError::new)?;
        let stepper = match opening.live {
            true => stepper.with_live_setpoints(),
            false => stepper,
        };
        let mut playback = Self {
            stepper: Some(Box::new(stepper)),
            run,
            files,
            tap,
            started_us: 0,
            latest: LatestAmplitudes::default(),
            is_live: opening.live,
            feed,
            events: 0,
            late: Vec::new(),
        };
        let begun = playback.begin(telemetry);
        match begun {
            Ok(()) => Ok((playback, description)),
            Err(error) => {
                let message = error.to_string();
                playback.end(Err(error));
                Err(CallError::new(message))
            }
        }
    }

    fn begin(&mut self, telemetry: Request) -> Result<(), RunError> {
        let Some(stepper) = &mut self.stepper else {
            return Ok(());
        };
        stepper.configure()?;
        if self.is_live {
            stepper.request(telemetry)?;
        }
        stepper.arm()?;
        stepper.start()
    }

    /// Lets time pass until `to_us` after the start of the trains. Returns the samples, edges and
    /// events since the last call.
    pub fn advance(&mut self, to_us: u64) -> Value {
        let Some(stepper) = &mut self.stepper else {
            return json!({ "end": { "error": null } });
        };
        let stepped = stepper.step(StepLimit::Time(to_us));
        let mut answer = self.news();
        match stepped {
            Ok(StepEnd::Over) => answer["end"] = json!({ "error": self.end(Ok(())) }),
            Err(error) => answer["end"] = json!({ "error": self.end(Err(error)) }),
            Ok(_) => {}
        }
        if self.stepper.is_some() {
            answer["samples"] = columns(&self.feed.take());
            return answer;
        }
        // The device emits, and reports, until its outputs are disconnected.
        let rest = self.tap.take_edges(&Trace::default(), u64::MAX);
        if let Some(edges) = answer["edges"].as_array_mut() {
            edges.extend(numbers(rest, self.started_us).into_iter().map(Value::from));
        }
        answer["samples"] = columns(&self.feed.take());
        if let Some(events) = answer["events"].as_array_mut() {
            events.extend(self.late.drain(..).map(|(t_s, text)| json!([t_s, text])));
        }
        answer
    }

    /// Sends setpoints of the page.
    ///
    /// # Errors
    /// A value that the session or the device refuses; nothing of the refused request is played.
    pub fn send(&mut self, asked: Setpoints) -> Result<Value, CallError> {
        let Some(stepper) = &mut self.stepper else {
            return Err(CallError::new("the session has ended"));
        };
        if let (Some(torque_nm), Some(world)) = (asked.external_nm, stepper.port().world()) {
            world.body.set_external_torque(torque_nm);
        }
        let values = SetpointValues {
            ma: asked.ma.into_iter().collect(),
            v: asked.v.into_iter().collect(),
            angle_deg: asked.angle_deg,
            ..SetpointValues::default()
        };
        let requests = values.to_requests(stepper.session(), &mut self.latest);
        let requests = requests.map_err(|mistakes| {
            let lines: Vec<String> = mistakes.iter().map(ToString::to_string).collect();
            CallError::new(lines.join("; "))
        })?;
        for request in requests {
            stepper.request(request).map_err(CallError::new)?;
        }
        Ok(json!({}))
    }

    /// Carries out an action at the controls.
    ///
    /// # Errors
    /// The session has ended, or the device is lost.
    pub fn act(&mut self, action: Action) -> Result<Value, CallError> {
        let Some(stepper) = &mut self.stepper else {
            return Err(CallError::new("the session has ended"));
        };
        let control = match action {
            Action::Pause => Control::Pause,
            Action::Resume => Control::Resume,
            Action::Raise(channel) => Control::Raise(channel),
            Action::Lower(channel) => Control::Lower(channel),
            Action::Mark(text) => Control::Mark(text),
            Action::Stop => Control::Stop,
        };
        stepper.control(&control).map_err(CallError::new)?;
        Ok(json!({ "paused": stepper.is_paused() }))
    }

    /// Returns the files of the record, complete after the end of the session.
    pub const fn files(&self) -> &Memory {
        &self.files
    }

    /// Returns time, edges and events since the last call.
    fn news(&mut self) -> Value {
        let Some(stepper) = &mut self.stepper else {
            return json!({});
        };
        let time_us = stepper.time_us();
        let events = stepper.trial().events.iter().skip(self.events);
        let events: Vec<_> = events.cloned().collect();
        self.events += events.len();
        self.started_us = stepper.port().now_us().saturating_sub(time_us);
        let settled_us = self.started_us + time_us.saturating_sub(SETTLED_US);
        let edges = match stepper.port().world() {
            Some(world) => self.tap.take_edges(&world.recorder.trace, settled_us),
            None => Vec::new(),
        };
        if self.is_live {
            stepper.forget_rows();
            self.events = 0;
        }
        json!({
            "t_s": time_us as f64 / 1e6,
            "edges": numbers(edges, self.started_us),
            "events": events,
        })
    }

    /// Stops the device and completes the record. Returns the reason of an early end.
    fn end(&mut self, ran: Result<(), RunError>) -> Option<String> {
        let stepper = self.stepper.take()?;
        let (outcome, _, attached) = stepper.close_keeping_attachments(ran);
        let mut trial = outcome.trial;
        self.late = trial.events.iter().skip(self.events).cloned().collect();
        let mut reason = outcome.error.map(|error| error.to_string());
        let fullest = self.tap.take_period();
        if let (Some(mut recorder), Some(fullest)) = (attached.recorder, fullest) {
            trial.edges = fullest.into_edges();
            let closed = recorder
                .record_edges(&trial.edges)
                .and_then(|()| recorder.finish(&trial.counters, trial.duration_s))
                .and_then(|()| self.write_run(trial, reason.clone()));
            reason = reason.or(closed.err().map(|error| error.to_string()));
        }
        reason
    }

    fn write_run(&mut self, trial: Trial, reason: Option<String>) -> Result<(), RecordError> {
        self.run.trials.push(trial);
        self.run.ending = match reason {
            Some(reason) => Ending::cut_short(reason, 1),
            None => Ending::complete(),
        };
        write_header_on(&self.files, Path::new(RECORD), &self.run)?;
        write_on(&self.files, Path::new(RECORD), &Report::from_run(&self.run)).map(drop)
    }
}

/// Creates the folder of the run and of its trial, and writes what is known before the first sample.
fn begin_record(files: &Memory, run: &Run, file: &SessionFile) -> Result<Recorder, RecordError> {
    write_run_on(files, Path::new(RECORD), run)?;
    let disk = Box::new(files.clone());
    Recorder::create_on(disk, Path::new(RECORD), 0, &begin_trial(file))
}

/// Returns samples as columns.
fn columns(samples: &[Sample]) -> Value {
    let column = |value: fn(&Sample) -> Option<f64>| samples.iter().map(value).collect::<Vec<_>>();
    let by_channel = |values: fn(&Sample) -> &Vec<Option<f64>>| {
        let count = samples.first().map_or(0, |sample| values(sample).len());
        let of = |place: usize| {
            let picked = samples
                .iter()
                .map(|sample| values(sample).get(place).copied().flatten());
            picked.collect::<Vec<_>>()
        };
        (0..count).map(of).collect::<Vec<_>>()
    };
    json!({
        "t_s": samples.iter().map(|sample| sample.t_s).collect::<Vec<_>>(),
        "target_deg": column(|sample| sample.target_deg),
        "measured_deg": column(|sample| sample.measured_deg),
        "true_deg": column(|sample| sample.true_deg),
        "effort": column(|sample| sample.effort),
        "state": samples.last().map(|sample| sample.state),
        "amplitudes": by_channel(|sample| &sample.amplitudes),
        "forces_n": by_channel(|sample| &sample.forces_n),
        "hand_n": by_channel(|sample| &sample.hand_n),
        "hand_true_n": by_channel(|sample| &sample.hand_true_n),
    })
}
