//! Runs the thread that talks to the device.

use super::{Shared, Watch};
use firmware::link::Request;
use firmware::safety::State;
use host_core::link::{Connection, Error, Incoming, PacedPort, Port};
use host_core::run::{
    DeviceName, Observation, Observer, ObserverRequest, RunError, SessionFile, run, to_sample,
};
use host_core::session::Session;

/// Telemetry period while no session runs, ms.
const TELEMETRY_MS: u16 = 20;

/// Longest time between two checks for the person's commands, µs on the clock of the port.
const LOOK_US: u64 = 20_000;

/// Work for the thread at the device.
pub struct Plan {
    pub device: DeviceName,
    /// The session to run, if any.
    pub session: Option<SessionFile>,
    /// Whether to continue watching after the session, until told to quit.
    pub stays: bool,
    /// Seed of a simulated wearer's noise.
    pub seed: u64,
}

/// Runs the plan's session, then watches the device until told to quit.
///
/// # Errors
/// Fails if the device cannot be opened or is lost, or the session ended early by itself. A stop by
/// hand is not an error.
pub fn run_plan(plan: &Plan, shared: &Shared) -> anyhow::Result<()> {
    let Some(file) = &plan.session else {
        return Ok(watch(plan.device.connect()?, shared)?);
    };
    let port = open(&plan.device, &file.session, plan.seed)?;
    let (outcome, port) = run(file, port, None, Watch::new(shared));
    let is_by_hand = matches!(outcome.error, Some(RunError::Interrupted { .. }));
    let is_signal = matches!(outcome.error, Some(RunError::Signal { .. }));
    let has_played = outcome.epoch_us.is_some() || is_by_hand;
    let failed = outcome.error.filter(|_| !is_by_hand);
    {
        let mut model = shared.model();
        let t_s = model.t_s;
        model.is_ending = false;
        match &failed {
            None if is_by_hand => model.note(t_s, "stopped on request".to_owned(), false),
            None => model.note(t_s, "session complete".to_owned(), false),
            Some(error) => model.note(t_s, error.to_string(), true),
        }
    }
    if let Some(port) = port
        && plan.stays
        && has_played
        && !shared.is_quitting()
        && !is_signal
    {
        let watched = watch(port, shared);
        if failed.is_none() {
            watched?;
        }
    }
    failed.map_or(Ok(()), |error| Err(error.into()))
}

/// Opens the device, paced by the wall clock.
fn open(device: &DeviceName, session: &Session, seed: u64) -> anyhow::Result<Box<dyn Port>> {
    let port = device.open(session, seed)?;
    Ok(match device {
        DeviceName::Native | DeviceName::Chip => Box::new(PacedPort::new(port)),
        _ => port,
    })
}

/// Watches without a session: requests status and telemetry, drives nothing.
fn watch<P: Port>(port: P, shared: &Shared) -> Result<(), Error> {
    let (mut client, info) = Connection::open(port)?;
    let mut watch = Watch::new(shared);
    watch.observe(Observation::Hello(&info));
    client.subscribe(TELEMETRY_MS)?;
    let mut clock = Elapsed {
        s: shared.model().t_s,
        last_us: None,
    };
    while !shared.is_quitting() {
        if shared.take_acknowledge() && shared.model().state == State::Fault {
            client.post(Request::Acknowledge)?;
        }
        match watch.next_request() {
            ObserverRequest::Nothing => {}
            ObserverRequest::Status => drop(client.post(Request::Status)?),
            ObserverRequest::Stop => {
                client.post(Request::Stop)?;
                shared.model().is_ending = false;
            }
        }
        let until = client.port().now_us() + LOOK_US;
        while let Some(incoming) = client.next(until)? {
            update_model(&incoming, &mut clock, shared);
        }
        if let Some(world) = client.port().world() {
            world.recorder.discard_trace();
        }
    }
    client.subscribe(0)?;
    Ok(())
}

fn update_model(incoming: &Incoming, clock: &mut Elapsed, shared: &Shared) {
    let mut model = shared.model();
    match incoming {
        Incoming::Telemetry(at_us, telemetry) => {
            clock.advance_to(*at_us);
            // Angles are measured only while trains play; otherwise the last ones stay.
            if model.is_on() {
                model.observe(Observation::Sample(&to_sample(telemetry, clock.s, None)));
            }
        }
        Incoming::Event(at_us, event) => {
            model.observe(Observation::Event(clock.advance_to(*at_us), event))
        }
        Incoming::Status(_, status) => model.observe(Observation::Status(status)),
        Incoming::Refused(_, refused) => model.observe(Observation::Refused(clock.s, refused)),
        Incoming::Acknowledged(..) | Incoming::Hello(_) => {}
    }
    model.silent_s = 0.0;
    if model.duration_s.is_none() {
        model.t_s = clock.s;
    }
}

/// Seconds on the dashboard's clock, from device times.
struct Elapsed {
    s: f64,
    /// The latest device time, µs; `None` before the first.
    last_us: Option<u64>,
}

impl Elapsed {
    fn advance_to(&mut self, at_us: u64) -> f64 {
        let last_us = self.last_us.unwrap_or(at_us);
        if at_us >= last_us {
            self.s += (at_us - last_us) as f64 / 1e6;
            self.last_us = Some(at_us);
        }
        self.s
    }
}
