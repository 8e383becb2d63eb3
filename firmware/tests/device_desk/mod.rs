//! Simulated board with a host: sends requests and records everything that the device outputs.

use firmware::control::{HoldPolicy, JointSpec, LawSpec, PointSpec, SensorSource};
use firmware::device::{Draft, Identity};
use firmware::link::message::ResetCause;
use firmware::link::{
    BROADCAST, Code, Decoder, Event, HelloInfo, Kind, Refusal, Request, Response, SCHEMA, Status,
    Telemetry, ToDevice, encode,
};
use firmware::lockstep::{Lockstep, Sensors, Sink};
use firmware::pulse::{CHANNELS, GroupSpec, Levels, Partner, State as Line, TrainSpec};
use firmware::safety::{ChannelSpec, Fault, FaultRecord, StageSpec, Stages, State, WearerSpec};
use firmware::units::{Amplitude, DacCode, Micros, us};

/// Everything that the device output, with times in µs since boot, which never wrap.
#[derive(Default)]
pub struct Record {
    boot: Micros,
    last: u64,
    pub levels: Vec<(u64, Levels)>,
    pub dac: Vec<(u64, u8, u16)>,
    pub trips: Vec<(u64, u8, u16)>,
    pub bytes: Vec<u8>,
    pub sent: Vec<u64>,
}

impl Record {
    pub fn since_boot_us(&mut self, at: Micros) -> u64 {
        // The time is relative to the latest known time, in either direction.
        let now = self.boot + us(self.last as u32);
        let t = self.last.wrapping_add_signed((at - now).us().into());
        self.last = self.last.max(t);
        t
    }
}

impl Sink for Record {
    fn write_levels(&mut self, at: Micros, levels: Levels) {
        let t = self.since_boot_us(at);
        self.levels.push((t, levels));
    }
    fn write_dac(&mut self, at: Micros, channel: u8, code: DacCode) {
        let t = self.since_boot_us(at);
        self.dac.push((t, channel, code.get()));
    }
    fn write_trip(&mut self, at: Micros, bank: u8, code: DacCode) {
        let t = self.since_boot_us(at);
        self.trips.push((t, bank, code.get()));
    }
    fn write_bytes(&mut self, at: Micros, bytes: &[u8]) {
        let t = self.since_boot_us(at);
        self.sent.push(t);
        self.bytes.extend_from_slice(bytes);
    }
}

/// Response that owns its data.
#[derive(Clone, Debug, PartialEq)]
#[expect(clippy::large_enum_variant, reason = "a test's, and few")]
pub enum OwnedResponse {
    Hello(HelloInfo),
    Ack(u16, Micros),
    Refused(Option<u16>, Code, String),
    Status(u16, Status),
    Event(Micros, Event),
    Telemetry(Telemetry),
}

/// Decodes all responses. Panics on a frame that is not a response.
pub fn decode(bytes: &[u8]) -> Vec<OwnedResponse> {
    let mut decoder = Decoder::default();
    let mut responses = Vec::new();
    for &byte in bytes {
        if let Some(frame) = decoder.push(byte) {
            let response: Response<'_> = postcard::from_bytes(frame.unwrap()).unwrap();
            responses.push(match response {
                Response::Hello(info) => OwnedResponse::Hello(info),
                Response::Ack { seq, at } => OwnedResponse::Ack(seq, at),
                Response::Refused { seq, refusal } => {
                    let Refusal { code, field, .. } = refusal;
                    let code = Code::from_number(code).expect("a code");
                    OwnedResponse::Refused(seq, code, field.to_string())
                }
                Response::Status { seq, status } => OwnedResponse::Status(seq, status),
                Response::Event { at, event } => OwnedResponse::Event(at, event),
                Response::Telemetry(sample) => OwnedResponse::Telemetry(sample),
            });
            decoder.clear();
        }
    }
    responses
}

/// Arm order; the test host fills in the checksum of the setup that it has sent.
pub const ARM: Request = Request::Arm { setup: 0 };

pub fn frame(session: u16, seq: u16, request: Request) -> Vec<u8> {
    let message = ToDevice {
        session,
        seq,
        request,
    };
    encode(&message).unwrap().to_vec()
}

pub struct TestHost {
    pub board: Lockstep,
    pub record: Record,
    pub sensors: Sensors,
    pub session: u16,
    pub seq: u16,
    /// Setup that the host has sent.
    draft: Draft,
    read: usize,
}

impl TestHost {
    pub fn boot(at: Micros, last_fault: Option<FaultRecord>) -> Self {
        let mut desk = Self {
            board: Lockstep::new(identity(1, last_fault), at),
            record: Record {
                boot: at,
                ..Record::default()
            },
            sensors: Sensors::default(),
            session: BROADCAST,
            seq: 0,
            draft: Draft::default(),
            read: 0,
        };
        desk.wait(1_000);
        desk
    }

    /// Resets the device at the next window because of `reset`; its session ends.
    pub fn reset(&mut self, reset: ResetCause) {
        let at = self.now() + us(1_000);
        self.record.write_levels(self.now(), Levels::ISOLATED); // pins are inputs
        let identity = Identity {
            reset,
            ..identity(1, None)
        };
        self.board.boot(identity, at);
        self.draft = Draft::default();
        self.wait(1_000);
        self.hello();
    }

    /// Boots a device and opens a session.
    pub fn open(at: Micros) -> Self {
        let mut desk = Self::boot(at, None);
        desk.hello();
        desk
    }

    pub fn hello(&mut self) -> HelloInfo {
        let heard = self.exchange(Request::Hello { schema: SCHEMA });
        let Some(OwnedResponse::Hello(info)) = heard
            .iter()
            .find(|h| matches!(h, OwnedResponse::Hello(_)))
            .cloned()
        else {
            panic!("{heard:?}");
        };
        self.session = info.session;
        info
    }

    pub fn now(&self) -> Micros {
        self.board.now()
    }

    /// Returns the time in µs since boot.
    pub fn since_boot_us(&mut self) -> u64 {
        let now = self.now();
        self.record.since_boot_us(now)
    }

    pub fn wait(&mut self, length_us: u32) {
        let to = self.now() + us(length_us);
        self.board.advance(to, &self.sensors, &mut self.record);
    }

    /// Sends a request that arrives now, and returns its number without waiting.
    pub fn send(&mut self, request: Request) -> u16 {
        self.write([request])[0]
    }

    /// Sends several requests in one write, and returns their numbers.
    pub fn write(&mut self, requests: impl IntoIterator<Item = Request>) -> Vec<u16> {
        let (mut numbers, mut bytes) = (Vec::new(), Vec::new());
        for request in requests {
            numbers.push(self.seq);
            bytes.extend(self.frame(request));
        }
        self.receive(&bytes);
        numbers
    }

    /// Returns the frame of the next request.
    pub fn frame(&mut self, request: Request) -> Vec<u8> {
        let is_at_rest = !matches!(self.state(), State::Stimulating | State::Stopping);
        let request = match request {
            // The device refuses these requests.
            Request::Channel { .. } | Request::Muscle { .. } | Request::ForceControl { .. }
                if !is_at_rest =>
            {
                request
            }
            request => self.draft.prepare_request(request),
        };
        let bytes = frame(self.session, self.seq, request);
        self.seq = self.seq.wrapping_add(1);
        bytes
    }

    /// Delivers bytes to the device now.
    pub fn receive(&mut self, bytes: &[u8]) {
        let now = self.now();
        self.board
            .receive(now, bytes, &self.sensors, &mut self.record);
    }

    /// Returns the responses since the last call.
    pub fn take_messages(&mut self) -> Vec<OwnedResponse> {
        let new = decode(&self.record.bytes[self.read..]);
        self.read = self.record.bytes.len();
        new
    }

    /// Returns the telemetry among the responses since the last call.
    pub fn samples(&mut self) -> Vec<Telemetry> {
        let sample = |heard| match heard {
            OwnedResponse::Telemetry(sample) => Some(sample),
            _ => None,
        };
        self.take_messages()
            .into_iter()
            .filter_map(sample)
            .collect()
    }

    /// Sends a request, gives the device 2 ms, and returns all its responses.
    pub fn exchange(&mut self, request: Request) -> Vec<OwnedResponse> {
        self.take_messages();
        self.send(request);
        self.wait(2_000);
        self.take_messages()
    }

    /// Sends a request and waits for its answer, at most half a second. `Err` holds the code and
    /// field of the refusal.
    pub fn answer(&mut self, request: Request) -> Result<(), (Code, String)> {
        self.take_messages();
        let seq = self.send(request);
        for _ in 0..500 {
            for heard in self.take_messages() {
                match heard {
                    OwnedResponse::Ack(s, _) | OwnedResponse::Status(s, _) if s == seq => {
                        return Ok(());
                    }
                    OwnedResponse::Refused(Some(s), code, field) if s == seq => {
                        return Err((code, field));
                    }
                    _ => {}
                }
            }
            self.wait(1_000);
        }
        panic!("no answer to {seq}");
    }

    /// Sends a request, and returns the code and field of the expected refusal.
    pub fn expect_refusal(&mut self, request: Request) -> (Code, String) {
        self.answer(request).expect_err("accepted")
    }

    /// Sends a request, and returns the code if it was refused.
    pub fn refusal_code(&mut self, request: Request) -> Option<Code> {
        self.answer(request).err().map(|(code, _)| code)
    }

    pub fn expect_all_ok(&mut self, requests: impl IntoIterator<Item = Request>) {
        for request in requests {
            self.expect_ok(request);
        }
    }

    pub fn expect_ok(&mut self, request: Request) {
        let shown = format!("{request:?}");
        if let Err(e) = self.answer(request) {
            panic!("{shown}: {e:?}");
        }
    }

    pub fn status(&mut self) -> Status {
        let heard = self.exchange(Request::Status);
        let status = heard.iter().find_map(|h| match h {
            OwnedResponse::Status(_, status) => Some(*status),
            _ => None,
        });
        status.unwrap_or_else(|| panic!("{heard:?}"))
    }

    /// Returns the latched or the last fault.
    pub fn fault(&mut self) -> Option<Fault> {
        self.status().fault.map(|record| record.fault)
    }

    /// Sends an angle measured at this moment, in hundredths of a degree.
    pub fn measure(&mut self, centideg: i16) {
        let at = self.now();
        self.expect_ok(Request::Measurement {
            joint: 0,
            centideg,
            at,
        });
    }

    /// Waits `count` times `us`, with a keep-alive before each.
    pub fn keep_alive(&mut self, count: u32, us: u32) {
        for _ in 0..count {
            self.expect_ok(Request::KeepAlive);
            self.wait(us);
        }
    }

    /// Arms and starts.
    pub fn start(&mut self) {
        self.expect_all_ok([ARM, Request::Start]);
    }

    /// Configures a wearer and channels, arms, starts, and orders `amplitude` on every channel.
    pub fn run(&mut self, wearer: WearerSpec, specs: &[ChannelSpec], amplitude: u32) {
        self.prepare(wearer, specs);
        self.start();
        self.expect_ok(equal_amplitudes(specs.len(), amplitude));
    }

    pub fn prepare(&mut self, wearer: WearerSpec, specs: &[ChannelSpec]) {
        self.expect_ok(Request::Wearer(wearer));
        for (channel, &spec) in (0u8..).zip(specs) {
            self.expect_ok(Request::Channel { channel, spec });
        }
    }

    /// Returns the time since which all outputs are disconnected, µs since boot, or `None` if one
    /// is driven or grounded.
    pub fn isolated_since(&mut self) -> Option<u64> {
        let &(t, levels) = self.record.levels.last()?;
        (levels.0 & Levels::GROUNDED.0 == 0).then_some(t)
    }

    pub fn state(&self) -> State {
        self.board.state()
    }
}

/// Returns the identity of a simulated device.
pub fn identity(first_session: u16, last_fault: Option<FaultRecord>) -> Identity {
    Identity {
        kind: Kind::Native,
        unique_id: [0; 3],
        reset: ResetCause::PowerOn,
        last_fault,
        first_session,
        stages: Stages::AsConfigured,
        option_bytes: None,
        board: "",
        crystal_hz: 0,
        has_boot_loader: false,
    }
}

/// Returns a refusal in the form that tests compare.
pub fn refusal(code: Code, field: &str) -> (Code, String) {
    (code, field.to_owned())
}

/// Returns whether the device reported `event`.
pub fn has_event(heard: &[OwnedResponse], event: Event) -> bool {
    let is = |h: &OwnedResponse| matches!(h, OwnedResponse::Event(_, e) if *e == event);
    heard.iter().any(is)
}

/// Sends keep-alives until the device stops by itself. Returns the time taken, µs, and the
/// responses.
pub fn wait_until_stopped(desk: &mut TestHost, most_s: u32) -> (u64, Vec<OwnedResponse>) {
    let (from, mut heard) = (desk.since_boot_us(), Vec::new());
    for _ in 0..most_s * 50 {
        if desk.state() != State::Stimulating {
            break;
        }
        heard.extend(desk.exchange(Request::KeepAlive));
        desk.wait(20_000);
    }
    desk.wait(60_000);
    heard.extend(desk.take_messages());
    (desk.since_boot_us() - 60_000 - from, heard)
}

/// Returns a request with one group of channels.
pub fn group(members: u16, partner: Partner) -> Request {
    let group = GroupSpec { members, partner };
    Request::Groups([group].into_iter().collect())
}

/// Returns a joint of two points, 0° to 90°, whose angle the host measures.
pub fn joint(flexor: u8, extensor: u8, threshold: u32, max: u32) -> Request {
    let point = |channel| PointSpec {
        channel,
        threshold: Amplitude::new(threshold),
        max: Amplitude::new(max),
    };
    Request::Joint(JointSpec {
        law: LawSpec::ALONE,
        law_period_ms: 2,
        cutoff_mhz: 17_000,
        flexors: [point(flexor)].into_iter().collect(),
        extensor: point(extensor),
        hold: HoldPolicy::Hold,
        angle_min_mdeg: 0,
        angle_max_mdeg: 90_000,
        sensor: SensorSource::Host,
        stale_after_ms: 40,
        wearer: None,
        response: None,
    })
}

/// Returns an angle setpoint that holds from now on.
pub fn angle(centideg: i16) -> Request {
    Request::Angle {
        at: None,
        centideg,
        centideg_per_s: None,
    }
}

/// Returns an order of the same amplitude on the first `count` channels.
pub fn equal_amplitudes(count: usize, amplitude: u32) -> Request {
    let mut values = heapless::Vec::new();
    for _ in 0..count {
        values.push(Amplitude::new(amplitude)).unwrap();
    }
    Request::Amplitudes {
        at: None,
        mask: (1 << count) - 1,
        values,
        widths: heapless::Vec::new(),
    }
}

/// Driven intervals in a channel's electrode check: two phases, two pulses, four amplitudes.
pub const CHECK_PHASES: usize = 16;

pub const PLAIN: TrainSpec = TrainSpec::biphasic(200, 100, 20_000);

pub const MONO: TrainSpec = TrainSpec::monophasic(200, 1_000, 20_000);

/// Returns a channel with 100 mA full scale and a limit of 20 mA.
pub fn channel(train: TrainSpec) -> ChannelSpec {
    ChannelSpec {
        train,
        stage: StageSpec::Current {
            full_scale_ua: 100_000,
        },
        limit: Amplitude::new(20_000),
        start: Amplitude::new(0),
        area_mm2: ChannelSpec::ASSUMED_AREA_MM2,
    }
}

/// Returns the same channel without a rise, for trains of a fixed number of pulses.
pub fn without_rise(train: TrainSpec) -> ChannelSpec {
    let spec = channel(train);
    ChannelSpec {
        start: spec.limit,
        ..spec
    }
}

/// Returns a wearer with the shortest rise, so that amplitudes are reached at once.
pub fn wearer() -> WearerSpec {
    WearerSpec {
        rise_ms: 1,
        ..WearerSpec::default()
    }
}

/// Returns the intervals of one channel as (start, state, end), µs since boot.
pub fn line_intervals(levels: &[(u64, Levels)], channel: usize, end: u64) -> Vec<(u64, Line, u64)> {
    let mut out: Vec<(u64, Line, u64)> = Vec::new();
    let mut now = (0, Line::Isolated);
    for &(t, l) in levels {
        let state = l.state(channel);
        if state != now.1 {
            out.push((now.0, now.1, t));
            now = (t, state);
        }
    }
    out.push((now.0, now.1, end));
    out
}

/// Returns the starts of a channel's driven intervals, µs since boot.
pub fn driven_starts(levels: &[(u64, Levels)], channel: usize) -> Vec<u64> {
    assert!(channel < CHANNELS);
    line_intervals(levels, channel, u64::MAX)
        .into_iter()
        .filter(|s| matches!(s.1, Line::Anodic | Line::Cathodic))
        .map(|s| s.0)
        .collect()
}
