//! A board whose host may send anything.

use super::judged::{BOOT, JudgedRun, SessionEnd};
use super::watch::Watch;
use crate::desk;
use crate::record::Record;
use firmware::device::Draft;
use firmware::link::{Decoder, Kind, MAX_MESSAGE, Request, Response, SCHEMA, ToDevice, encode};
use firmware::lockstep::{Lockstep, Sensors, Sink};
use firmware::pulse::Levels;
use firmware::safety::{StageTable, Stages};
use firmware::units::{DacCode, Micros, us};

/// Device time after the answer to `Hello`.
pub const BOOTED: Micros = Micros::new(BOOT.get() + 2_000);

/// Longest interval between two checks of the device's state, µs.
const LOOK_US: u32 = 250;

/// The only session number that a fresh board grants.
const SESSION: u16 = 1;

/// Native board with an open session, whose outputs are checked.
pub struct Session {
    board: Lockstep,
    /// Second board that must emit the same output.
    twin: Option<Lockstep>,
    sensors: Sensors,
    watch: Watch,
    record: Record,
    judged: JudgedRun,
    heard: Decoder,
    /// Setup sent so far, as far as it is acceptable in any state.
    draft: Draft,
    seq: u16,
}

impl Session {
    /// Boots a board that answers `Hello`.
    pub fn open() -> Self {
        Self::boot(false, Stages::AsConfigured)
    }

    /// Boots a board like [`Self::open`], with these stages.
    pub fn with_stages(stages: StageTable) -> Self {
        Self::boot(false, Stages::Stored(stages))
    }

    /// Boots a board like [`Self::open`], with a twin beside it that skips no refill.
    pub fn with_unskipping_twin() -> Self {
        Self::boot(true, Stages::AsConfigured)
    }

    fn boot(has_twin: bool, stages: Stages) -> Self {
        let mut identity = desk::identity(Kind::Native, SESSION);
        identity.stages = stages;
        let mut session = Self {
            board: Lockstep::new(identity, BOOT),
            twin: has_twin.then(|| Lockstep::new(identity, BOOT).without_skipping()),
            sensors: Sensors::default(),
            watch: Watch::default(),
            record: Record::starting_at(BOOT),
            judged: JudgedRun::default(),
            heard: Decoder::default(),
            draft: Draft::default(),
            seq: 0,
        };
        session.advance(1_000);
        let hello = Request::Hello { schema: SCHEMA };
        session.receive(&request_frame(&hello, session.seq));
        session.advance(1_000);
        session
    }

    /// Delivers bytes of at most one frame. A request to arm an empty setup gets the checksum of
    /// the setup sent, because nothing would ever be armed otherwise.
    pub fn receive(&mut self, bytes: &[u8]) {
        let mut meant = None;
        for message in requests(&mut self.heard, bytes) {
            let is_arm = matches!(message.request, Request::Arm { .. });
            let request = self.draft.prepare_request(message.request);
            if is_arm {
                self.watch.note_arm_request(self.board.now());
                meant = encode(&ToDevice { request, ..message });
            }
        }
        let bytes = meant.as_deref().unwrap_or(bytes);
        let now = self.board.now();
        self.judged.note_host(now);
        self.watch.note_state(now, self.board.state());
        self.drive(|board, sensors, sink| board.receive(now, bytes, sensors, sink));
        self.update_watch();
    }

    fn update_watch(&mut self) {
        self.watch.note_state(self.board.now(), self.board.state());
        if let Some(setup) = self.board.setup() {
            self.judged.note_setup(setup);
        }
    }

    /// Drives the board and its twin, and compares their outputs.
    fn drive(&mut self, drive: impl Fn(&mut Lockstep, &Sensors, &mut Outputs)) {
        let mut outputs = Outputs::default();
        drive(&mut self.board, &self.sensors, &mut outputs);
        if let Some(twin) = &mut self.twin {
            let mut others = Outputs::default();
            drive(twin, &self.sensors, &mut others);
            assert_eq!(outputs, others, "a board that skips differs");
            assert_eq!(self.board.state(), twin.state());
        }
        for put_out in outputs.0 {
            put_out.send_to(&mut self.watch);
            put_out.send_to(&mut self.record);
        }
    }

    /// Delivers a well-formed frame whose request is `payload`.
    pub fn request(&mut self, payload: &[u8]) {
        self.seq = self.seq.wrapping_add(1);
        let room = payload.len().min(MAX_MESSAGE - 6); // two numbers of at most 3 bytes
        let message = (SESSION, self.seq, Raw(&payload[..room]));
        let frame = encode(&message).expect("fits the longest message");
        self.receive(&frame);
    }

    /// Advances time by `length_us`.
    pub fn advance(&mut self, length_us: u32) {
        let end = self.board.now() + us(length_us);
        while self.board.now().is_before(end) {
            let next = self.board.now() + us(LOOK_US);
            let to = if next.is_before(end) { next } else { end };
            self.watch.note_state(self.board.now(), self.board.state());
            self.drive(|board, sensors, sink| board.advance(to, sensors, sink));
            self.update_watch();
            self.sensors.trigger = None;
        }
    }

    /// Sets arm key, hand-held stop, over-current and one electrode: one bit each, with the
    /// electrode's channel in the upper half.
    pub fn set_inputs(&mut self, bits: u8) {
        self.sensors.arm = bits & 1 == 0;
        self.sensors.hand_stop = bits & 2 == 0;
        self.sensors.over_current = bits & 4 != 0;
        let now = self.board.now();
        let off = (bits & 8 != 0).then_some(usize::from(bits >> 4));
        for (channel, load) in self.sensors.load_ohm.iter_mut().enumerate() {
            let is_on = off != Some(channel);
            if is_on != (*load != u32::MAX) {
                self.judged.note_load(now, channel, is_on);
            }
            *load = if is_on { 2_000 } else { u32::MAX };
        }
    }

    /// Generates a trigger edge now.
    pub fn trigger(&mut self) {
        self.sensors.trigger = Some(self.board.now());
    }

    /// Sets the joint sensor's code to these two bytes; without them the sensor is off.
    pub fn set_joint_code(&mut self, bytes: &[u8]) {
        let code = <[u8; 2]>::try_from(bytes).ok();
        self.sensors.joint = code.map(u16::from_le_bytes);
    }

    /// Sets whether the trigger input is active.
    pub fn set_held(&mut self, held: bool) {
        self.sensors.held = held;
    }

    /// Returns the device time.
    pub fn now(&self) -> Micros {
        self.board.now()
    }

    /// Returns the data for the judge.
    pub fn into_result(self) -> SessionEnd {
        (self.judged, self.record.trace, self.watch.faults)
    }

    /// Returns whether any output has been driven.
    pub fn has_driven(&self) -> bool {
        self.watch.has_driven
    }

    /// Returns the numbers of accepted and refused requests.
    pub fn answers(&self) -> (u32, u32) {
        (self.watch.acknowledged, self.watch.refused)
    }
}

/// Outputs of a board, in order.
#[derive(PartialEq, Debug, Default)]
struct Outputs(Vec<DeviceOutput>);

#[derive(PartialEq, Debug)]
enum DeviceOutput {
    Levels(Micros, Levels),
    Dac(Micros, u8, DacCode),
    Bytes(Micros, Vec<u8>),
}

impl DeviceOutput {
    fn send_to(&self, sink: &mut impl Sink) {
        match self {
            Self::Levels(at, levels) => sink.write_levels(*at, *levels),
            Self::Dac(at, channel, code) => sink.write_dac(*at, *channel, *code),
            Self::Bytes(at, bytes) => sink.write_bytes(*at, bytes),
        }
    }
}

impl Sink for Outputs {
    fn write_levels(&mut self, at: Micros, levels: Levels) {
        self.0.push(DeviceOutput::Levels(at, levels));
    }

    fn write_dac(&mut self, at: Micros, channel: u8, code: DacCode) {
        self.0.push(DeviceOutput::Dac(at, channel, code));
    }

    fn write_bytes(&mut self, at: Micros, bytes: &[u8]) {
        self.0.push(DeviceOutput::Bytes(at, bytes.to_vec()));
    }
}

/// Bytes that are encoded into a message unchanged.
struct Raw<'a>(&'a [u8]);

impl serde::Serialize for Raw<'_> {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        use serde::ser::SerializeTuple;
        let mut tuple = serializer.serialize_tuple(self.0.len())?;
        for byte in self.0 {
            tuple.serialize_element(byte)?;
        }
        tuple.end()
    }
}

/// Returns the frame of a request in the session that [`Session::open`] opens.
pub fn request_frame(request: &Request, seq: u16) -> Vec<u8> {
    desk::frame(SESSION, seq, request.clone())
}

/// Returns a request as it is encoded in a message.
pub fn payload(request: &Request) -> Vec<u8> {
    let mut buffer = [0; MAX_MESSAGE];
    let used = postcard::to_slice(request, &mut buffer).expect("every request fits");
    used.to_vec()
}

/// Returns the requests that end in `bytes`, as the device would parse them.
fn requests(decoder: &mut Decoder, bytes: &[u8]) -> Vec<ToDevice> {
    let mut found = Vec::new();
    for &byte in bytes {
        if let Some(Ok(message)) = decoder.push(byte) {
            found.extend(postcard::from_bytes(message));
            decoder.clear();
        }
    }
    found
}

/// Decodes `bytes` as a host decodes answers, although they may be anything.
pub fn decode_as_host(bytes: &[u8]) {
    let mut decoder = Decoder::default();
    for &byte in bytes {
        let Some(result) = decoder.push(byte) else {
            continue;
        };
        if let Ok(message) = result {
            assert!(message.len() <= MAX_MESSAGE, "a message beyond its bound");
            let _ = postcard::from_bytes::<Response<'_>>(message);
        }
        decoder.clear();
    }
}
