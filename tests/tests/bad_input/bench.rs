//! A native device on the bench, brought into the state that a row needs.

use firmware::control::{HoldPolicy, JointSpec, LawSpec, PointSpec, SensorSource};
use firmware::link::{Decoder, Response, ToDevice, encode};
use firmware::pulse::{CHANNELS, TrainSpec};
use firmware::safety::{ChannelSpec, StageSpec, WearerSpec};
use firmware::units::{Amplitude, Micros};
use hal_sim::body::Still;
use hal_sim::native::native;
use hal_sim::wire::faults::Faults;
use hal_sim::world::World;
use host_core::link::{Client, Port, SimulatedPort};

/// Device time at boot: the clock wraps while rows run.
const BOOT: Micros = Micros::new(u32::MAX - 1_000_000);

/// The largest amplitude of every channel of the benches, µA.
pub const LIMIT: Amplitude = Amplitude::new(20_000);

/// What flows while the benches stimulate, µA.
const FLOWING: Amplitude = Amplitude::new(5_000);

/// Answers are waited for this long, µs: longer than an electrode check.
const ANSWERS_US: u64 = 60_000;

/// A device and the host that owns its session.
pub struct Bench {
    pub client: Client<SimulatedPort>,
    /// The owner's session.
    pub session: u16,
}

/// One frame from the device, as far as rows care.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Heard {
    Ack(u16),
    Refused(Option<u16>, u16, String),
    Other,
}

pub fn world() -> World {
    let body = Box::new(Still::new(0.0));
    World::new(Box::new(native(BOOT)), body, BOOT, Faults::default(), 1)
}

/// 200 µs at 50 Hz, up to [`LIMIT`].
pub fn channel(offset_us: u32) -> ChannelSpec {
    ChannelSpec {
        train: TrainSpec {
            offset_us,
            ..TrainSpec::biphasic(200, 100, 20_000)
        },
        stage: StageSpec::Current {
            full_scale_ua: 100_000,
        },
        limit: LIMIT,
    }
}

pub fn wearer() -> WearerSpec {
    WearerSpec {
        rise_ms: 1,
        host_timeout_ms: 1000,
        ..WearerSpec::default()
    }
}

/// A joint on channels 0 (flexor) and 1 (extensor), 0° to 90°.
pub fn joint(sensor: SensorSource) -> JointSpec {
    let point = |channel| PointSpec {
        channel,
        threshold: Amplitude::new(1_000),
        max: Amplitude::new(10_000),
    };
    JointSpec {
        law: LawSpec::Recommended {
            lambda_milli: 12_700,
            k1_milli: 605,
            k2_milli: 6_620,
            b_milli: 91_600,
            k3_milli: 0,
            ki_milli: 0,
        },
        law_period_ms: 11,
        cutoff_mhz: 3_000,
        flexors: [point(0)].into_iter().collect(),
        extensor: point(1),
        hold: HoldPolicy::Hold,
        angle_min_mdeg: 0,
        angle_max_mdeg: 90_000,
        sensor,
        stale_after_ms: 200,
        wearer: None,
        response: None,
    }
}

impl Bench {
    /// A session is open, nothing is configured.
    pub fn open() -> Self {
        let port = SimulatedPort::new(world());
        let (client, info) = Client::open(port).unwrap();
        Self {
            client,
            session: info.session,
        }
    }

    /// Three channels are configured.
    pub fn draft() -> Self {
        Self::with_channels(3)
    }

    fn with_channels(count: u8) -> Self {
        let mut bench = Self::open();
        bench.client.wearer(wearer()).unwrap();
        for c in 0..count {
            let spec = channel(1500 * u32::from(c));
            bench.client.channel(c, spec).unwrap();
        }
        bench
    }

    /// Three channels are armed.
    pub fn armed() -> Self {
        let mut bench = Self::draft();
        bench.client.arm().unwrap();
        bench
    }

    /// All ten channels are armed.
    pub fn ten_armed() -> Self {
        let mut bench = Self::with_channels(10);
        bench.client.arm().unwrap();
        bench
    }

    /// All ten channels are armed with a muscle each.
    pub fn ten_muscles_armed() -> Self {
        let mut bench = Self::with_channels(10);
        for c in 0..10 {
            bench
                .client
                .muscle(c, crate::bad_input::setup::MUSCLE)
                .unwrap();
        }
        bench.client.arm().unwrap();
        bench
    }

    /// Three channels stimulate.
    pub fn stimulating() -> Self {
        let mut bench = Self::armed();
        bench.client.start().unwrap();
        bench.flow();
        bench
    }

    /// A joint measured by the host is configured beside channel 2.
    pub fn joint_draft() -> Self {
        let mut bench = Self::draft();
        bench.client.joint(joint(SensorSource::Host)).unwrap();
        bench
    }

    /// A joint measured by the host is armed.
    pub fn joint_armed() -> Self {
        let mut bench = Self::joint_draft();
        bench.client.arm().unwrap();
        bench
    }

    /// A joint measured by the board is armed.
    pub fn adc_joint_armed() -> Self {
        let mut bench = Self::draft();
        let sensor = SensorSource::Adc {
            code_at_0: 500,
            code_at_100: 3500,
        };
        bench.client.joint(joint(sensor)).unwrap();
        bench.client.arm().unwrap();
        bench
    }

    /// Over-current tripped while stimulating, and is over.
    pub fn faulted() -> Self {
        let mut bench = Self::stimulating();
        bench.client.port().world.sensors.over_current = true;
        bench.wait(5_000);
        bench.client.port().world.sensors.over_current = false;
        bench.wait(5_000);
        bench
    }

    /// Sets every channel to what flows, and waits until it does.
    fn flow(&mut self) {
        let all = [(0, FLOWING), (1, FLOWING), (2, FLOWING)];
        self.client.amplitudes(&all).unwrap();
        self.wait(50_000);
    }

    /// Lets time go on, and forgets what arrives.
    pub fn wait(&mut self, us: u64) {
        let until = self.client.port().now_us() + us;
        while self.client.next(until).unwrap().is_some() {}
    }

    /// Device time.
    pub fn now(&mut self) -> Micros {
        Micros::new(self.client.port().now_us() as u32)
    }

    /// Codes in the DACs.
    pub fn codes(&mut self) -> [u16; CHANNELS] {
        let mut codes = [0; CHANNELS];
        for write in &self.client.port().world.recorder.trace.dac {
            codes[usize::from(write.channel)] = write.code;
        }
        codes
    }

    /// Whether every channel is isolated now.
    pub fn is_isolated(&mut self) -> bool {
        self.client.port().world.recorder.trace.last_levels().0 == 0
    }

    /// A frame of the owner, or of someone else.
    pub fn frame(session: u16, seq: u16, request: firmware::link::Request) -> Vec<u8> {
        let message = ToDevice {
            session,
            seq,
            request,
        };
        encode(&message).unwrap().to_vec()
    }
}

/// Sends bytes as they are and collects the answers.
pub fn exchange(port: &mut SimulatedPort, bytes: &[u8]) -> Vec<Heard> {
    port.send(bytes).unwrap();
    let until = port.now_us() + ANSWERS_US;
    let (mut decoder, mut heard) = (Decoder::default(), Vec::new());
    while port.now_us() < until {
        for byte in port.receive(until).unwrap() {
            if let Some(message) = decoder.push(byte) {
                heard.push(understand(message.expect("the device sends whole frames")));
                decoder.clear();
            }
        }
    }
    heard
}

fn understand(message: &[u8]) -> Heard {
    match postcard::from_bytes::<Response<'_>>(message).unwrap() {
        Response::Ack { seq, .. } => Heard::Ack(seq),
        Response::Refused { seq, refusal } => {
            Heard::Refused(seq, refusal.code, refusal.field.to_owned())
        }
        _ => Heard::Other,
    }
}
