//! Connects a device with a host that keeps sending its request. A clone is a fork of the
//! simulation.

use super::error::{FaultsError, never_runs};
use firmware::device::Draft;
use firmware::link::{BROADCAST, Decoder, Event, Request, Response, SCHEMA, ToDevice, encode};
use firmware::lockstep::Sensors;
use firmware::safety::{FaultRecord, Stages, StopCause};
use firmware::units::Micros;
use hal_sim::lockstep::Device;
use hal_sim::world::Recorder;
use host_core::session::Session;
use std::io;

/// Interval at which the host repeats its setpoint request, µs.
pub(super) const HOST_US: u64 = 5_000;
/// Longest time until the device answers any request other than `Arm`, µs.
const ANSWER_US: u64 = 4_000;
/// Longest time until the device answers `Arm`, µs; the electrode check takes 22 ms of it.
const ARM_US: u64 = 60_000;

/// A simulated device, the host that talks to it, and the recorded output.
#[derive(Clone)]
pub(super) struct Bench<D> {
    pub device: D,
    pub recorder: Recorder,
    pub sensors: Sensors,
    /// How the device's clock deviates from world time.
    pub clock: DeviceClock,
    /// Whether the host still repeats its request.
    pub speaks: bool,
    /// Setpoint request that the host repeats; `None` before stimulation starts.
    wanted: Option<Request>,
    said_us: u64,
    now_us: u64,
    due_us: u64,
    session: u16,
    seq: u16,
    draft: Draft,
    heard: DeviceReports,
}

/// A device clock that fails at `from_us`: it stops for `stood_us`, and then runs at `rate` times
/// the true speed.
#[derive(Clone, Copy, Debug)]
pub(super) struct DeviceClock {
    pub from_us: u64,
    pub stood_us: u64,
    pub rate: f64,
}

impl DeviceClock {
    /// A clock that never deviates from world time.
    const TRUE: Self = Self {
        from_us: 0,
        stood_us: 0,
        rate: 1.0,
    };

    /// Returns the world time at which the device's clock showed `at`, µs.
    pub fn world_us(&self, at: Micros) -> u64 {
        let at_us = u64::from(at.get());
        match at_us.checked_sub(self.from_us) {
            Some(after) => self.from_us + self.stood_us + (after as f64 / self.rate) as u64,
            None => at_us,
        }
    }
}

/// What the device has reported to its host: responses and events.
#[derive(Clone, Debug, Default)]
pub(super) struct DeviceReports {
    /// Received bytes that do not yet form a complete frame.
    half: Vec<u8>,
    /// First fault that the device reported since it answered `Hello`.
    pub fault: Option<FaultRecord>,
    /// Device time and cause of the first reported end of stimulation.
    pub stopping: Option<(Micros, StopCause)>,
    /// Code and field of each refused request, in the order of the refusals.
    pub refused: Vec<(u16, String)>,
    /// Session number that the device assigned in its answer to `Hello`.
    hello: Option<u16>,
    /// Output stages that the device stated in its answer to `Hello`.
    pub stages: Option<Stages>,
}

impl<D> Bench<D> {
    /// Returns a copy of host, clock and recorded output with another device.
    pub fn with_device<E>(&self, device: E) -> Bench<E> {
        Bench {
            device,
            recorder: self.recorder.clone(),
            sensors: self.sensors,
            clock: self.clock,
            speaks: self.speaks,
            wanted: self.wanted.clone(),
            said_us: self.said_us,
            now_us: self.now_us,
            due_us: self.due_us,
            session: self.session,
            seq: self.seq,
            draft: self.draft.clone(),
            heard: self.heard.clone(),
        }
    }
}

impl<D: Device> Bench<D> {
    /// Combines a device at time `now_us` with its output so far and a host that sends nothing yet.
    pub fn new(device: D, recorder: Recorder, now_us: u64, sensors: Sensors) -> Self {
        Self {
            device,
            recorder,
            sensors,
            clock: DeviceClock::TRUE,
            speaks: true,
            wanted: None,
            said_us: 0,
            now_us,
            due_us: 0,
            session: BROADCAST,
            seq: 0,
            draft: Draft::default(),
            heard: DeviceReports::default(),
        }
    }

    /// Replaces everything that the device has reported so far.
    pub fn with_reports(self, heard: DeviceReports) -> Self {
        Self { heard, ..self }
    }

    /// Connects a host to the device at time `now_us` and exchanges `Hello`. Fails if the device
    /// does not answer.
    pub fn connect(device: D, now_us: u64, sensors: Sensors) -> Result<Self, FaultsError> {
        let mut bench = Self::new(device, Recorder::default(), now_us, sensors);
        bench.send_and_wait(Request::Hello { schema: SCHEMA }, ANSWER_US)?;
        match bench.heard.hello {
            Some(session) => bench.session = session,
            None => return Err(never_runs("the device does not answer Hello")),
        }
        Ok(bench)
    }

    /// Sends the setup of `session`; refusals are recorded in [`Self::reports`] and are no error.
    pub fn configure(&mut self, session: &Session) -> Result<(), FaultsError> {
        let mut requests = session.setup_requests().into_iter();
        requests.try_for_each(|request| self.send_and_wait(request, ANSWER_US))
    }

    /// Returns the checksum of the setup that the host has sent.
    pub fn sum(&self) -> u32 {
        self.draft.checksum()
    }

    /// Sends `Arm` with the setup checksum `setup` (0 stands for that of the sent setup) and
    /// `Start`. From then on the host repeats `wanted`, even if the device has refused to arm.
    pub fn start(&mut self, setup: u32, wanted: Request) -> Result<(), FaultsError> {
        self.start_within(setup, wanted, ARM_US)
    }

    /// Starts as [`Self::start`] does, but waits up to `arm_us` for the answer to `Arm`, which
    /// includes the pause between two electrode checks.
    pub fn start_within(
        &mut self,
        setup: u32,
        wanted: Request,
        arm_us: u64,
    ) -> Result<(), FaultsError> {
        self.wanted = None;
        self.send_and_wait(Request::Arm { setup }, arm_us)?;
        self.wanted = Some(wanted);
        self.send_and_wait(Request::Start, ANSWER_US)?;
        self.due_us = self.now_us.next_multiple_of(HOST_US);
        Ok(())
    }

    /// Configures and starts the device and stimulates for `us` µs. Fails if the device refuses a
    /// request, reports a fault, or drives no output.
    pub fn into_stimulating(
        mut self,
        session: &Session,
        wanted: Request,
        us: u64,
    ) -> Result<Self, FaultsError> {
        self.configure(session)?;
        self.start(0, wanted)?;
        self.run_to(self.now_us + us)
            .map_err(|e| never_runs(e.to_string()))?;
        match (&*self.heard.refused, self.heard.fault) {
            ([], None) if self.has_driven_since(self.now_us.saturating_sub(50_000)) => Ok(self),
            (refused, fault) => Err(never_runs(format!("refusals {refused:?}, fault {fault:?}"))),
        }
    }

    /// Returns whether this host and that of `other` are in the same state and therefore will send
    /// the same messages.
    pub fn has_same_host_state(&self, other: &Self) -> bool {
        (self.speaks, self.said_us, self.due_us) == (other.speaks, other.said_us, other.due_us)
            && (self.session, self.seq, self.now_us) == (other.session, other.seq, other.now_us)
            && (&self.wanted, &self.heard.half) == (&other.wanted, &other.heard.half)
    }

    /// Returns the current simulated time, µs.
    pub const fn now_us(&self) -> u64 {
        self.now_us
    }

    /// Returns whether any channel was driven at or after `since_us`.
    pub fn has_driven_since(&self, since_us: u64) -> bool {
        let levels = self.recorder.trace.levels.iter().rev();
        let mut last = levels.take_while(|(t, _)| *t >= since_us);
        last.any(|(_, levels)| (0..10).any(|c| levels.state(c).is_driven()))
    }

    /// Returns the time at which the host last sent a request.
    pub const fn last_sent_us(&self) -> u64 {
        self.said_us
    }

    /// Returns what the device has reported since it booted: responses and events.
    pub const fn reports(&self) -> &DeviceReports {
        &self.heard
    }

    /// Sends `request` without waiting for an answer.
    pub fn send(&mut self, request: Request) -> Result<(), FaultsError> {
        self.send_and_wait(request, 0)
    }

    fn send_and_wait(&mut self, request: Request, us: u64) -> Result<(), FaultsError> {
        let failure = |e: io::Error| never_runs(e.to_string());
        self.write_request(request).map_err(failure)?;
        self.advance(self.now_us + us).map_err(failure)
    }

    fn write_request(&mut self, request: Request) -> io::Result<()> {
        let message = ToDevice {
            session: self.session,
            seq: self.seq,
            request: self.draft.prepare_request(request),
        };
        self.seq = self.seq.wrapping_add(1);
        self.said_us = self.now_us;
        let Some(frame) = encode(&message) else {
            return Err(io::Error::other("a request is too long for a frame"));
        };
        let (at, sensors) = (Micros::new(self.now_us as u32), &self.sensors);
        self.device.receive(at, &frame, sensors, &mut self.recorder)
    }

    /// Passes bytes that this host did not create to the device at `at_us`, or now if that time has
    /// passed.
    ///
    /// # Errors
    /// Fails as [`Self::run_to`] does.
    pub fn receive(&mut self, at_us: u64, bytes: &[u8]) -> io::Result<()> {
        self.advance(at_us.max(self.now_us))?;
        let (at, sensors) = (Micros::new(self.now_us as u32), &self.sensors);
        self.device.receive(at, bytes, sensors, &mut self.recorder)
    }

    /// Runs until `to_us`; meanwhile the host repeats its request.
    ///
    /// # Errors
    /// Fails if the simulation cannot continue because the device did something that the simulator
    /// does not model.
    pub fn run_to(&mut self, to_us: u64) -> io::Result<()> {
        while self.due_us < to_us {
            self.advance(self.due_us.max(self.now_us))?;
            if let Some(wanted) = self.wanted.clone().filter(|_| self.speaks) {
                self.write_request(wanted)?;
            }
            self.due_us += HOST_US;
        }
        self.advance(to_us)
    }

    fn advance(&mut self, to_us: u64) -> io::Result<()> {
        let to = Micros::new(to_us as u32);
        let done = self.device.advance(to, &self.sensors, &mut self.recorder);
        self.now_us = to_us;
        self.heard.decode_recorded(&mut self.recorder);
        done
    }
}

impl DeviceReports {
    /// Decodes the bytes that the device has sent since the last call.
    pub fn decode_recorded(&mut self, recorder: &mut Recorder) {
        for (_, bytes) in recorder.bytes.drain(..) {
            self.half.extend(bytes);
        }
        while let Some(end) = self.half.iter().position(|&byte| byte == 0) {
            let frame: Vec<u8> = self.half.drain(..=end).collect();
            if let Some(Ok(message)) = Decoder::default().push_until_delimiter(&mut &*frame) {
                self.decode_message(message);
            }
        }
    }

    fn decode_message(&mut self, message: &[u8]) {
        match postcard::from_bytes(message) {
            Ok(Response::Hello(hello)) => {
                self.hello = Some(hello.session);
                self.stages = Some(hello.stages);
            }
            Ok(Response::Event {
                event: Event::Faulted(record),
                ..
            }) => {
                self.fault.get_or_insert(record);
            }
            Ok(Response::Event {
                at,
                event: Event::Stopping(cause) | Event::Stopped(cause),
            }) => {
                self.stopping.get_or_insert((at, cause));
            }
            Ok(Response::Refused { refusal, .. }) => {
                let field = refusal.field.to_owned();
                self.refused.push((refusal.code, field));
            }
            _ => {}
        }
    }
}
