//! A native device on the bench, brought into the state that a row needs.

use crate::bad_input::setup;
use firmware::control::{HoldPolicy, JointSpec, LawSpec, PointSpec, SensorSource};
use firmware::link::{Request, Response, SetupSum};
use firmware::pulse::{CHANNELS, TrainSpec};
use firmware::safety::ChannelSpec;
use firmware::units::{Amplitude, Micros};
use hal_sim::world::World;
use host_core::link::{Connection, Error, Port, SimulatedPort};
use tests::desk;

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
    pub client: Connection<SimulatedPort>,
    /// The owner's session.
    pub session: u16,
}

/// One frame from the device, as far as rows care.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum OwnedResponse {
    Ack(u16),
    Refused(Option<u16>, u16, String),
    Other,
}

pub fn world() -> World {
    desk::world(BOOT)
}

/// 200 µs at 50 Hz, up to [`LIMIT`].
pub fn channel(offset_us: u32) -> ChannelSpec {
    let train = TrainSpec {
        offset_us,
        ..TrainSpec::biphasic(200, 100, 20_000)
    };
    desk::channel(train, 100_000, LIMIT.get())
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

/// A wearer and this many channels.
fn channels(count: u8) -> impl Iterator<Item = Request> {
    let channels = (0..count).map(|c| Request::Channel {
        channel: c,
        spec: channel(1500 * u32::from(c)),
    });
    std::iter::once(Request::Wearer(desk::wearer(1_000))).chain(channels)
}

impl Bench {
    /// A session is open, nothing is configured.
    pub fn open() -> Self {
        let (client, info) = desk::open(BOOT);
        let session = info.session;
        Self { client, session }
    }

    /// After these requests, none of them refused.
    pub fn after_requests(mut self, requests: impl IntoIterator<Item = Request>) -> Self {
        for request in requests {
            self.ask(request).unwrap();
        }
        self
    }

    /// What the device says to a request; [`desk::ARM`] means what was accepted.
    pub fn ask(&mut self, request: Request) -> Result<u64, Error> {
        match request {
            desk::ARM => self.client.arm(),
            request => self.client.request(request),
        }
    }

    /// Three channels are configured.
    pub fn draft() -> Self {
        Self::with_channels(3)
    }

    fn with_channels(count: u8) -> Self {
        Self::open().after_requests(channels(count))
    }

    /// Arms what [`Self::draft`] configures.
    pub fn arm_draft() -> Request {
        let mut sum = SetupSum::default();
        channels(3).for_each(|request| sum.note(&request));
        let setup = sum.total();
        Request::Arm { setup }
    }

    /// The draft is armed.
    pub fn arm(self) -> Self {
        self.after_requests([desk::ARM])
    }

    /// Three channels are armed.
    pub fn armed() -> Self {
        Self::draft().arm()
    }

    /// All ten channels are armed.
    pub fn ten_armed() -> Self {
        Self::with_channels(10).arm()
    }

    /// All ten channels are armed with a muscle each.
    pub fn ten_muscles_armed() -> Self {
        let spec = setup::MUSCLE;
        let muscles = (0..10).map(|channel| Request::Muscle { channel, spec });
        Self::with_channels(10).after_requests(muscles).arm()
    }

    /// Three channels stimulate.
    pub fn stimulating() -> Self {
        let mut bench = Self::armed().after_requests([Request::Start]);
        let all = [0, 1, 2].map(|channel| (channel, FLOWING));
        bench.client.set_amplitudes(&all).unwrap();
        bench.wait(50_000);
        bench
    }

    /// A joint measured by the host is configured beside channel 2.
    pub fn joint_draft() -> Self {
        Self::draft().after_requests([Request::Joint(joint(SensorSource::Host))])
    }

    /// A joint measured by the host is armed.
    pub fn joint_armed() -> Self {
        Self::joint_draft().arm()
    }

    /// A joint measured by the board is armed.
    pub fn adc_joint_armed() -> Self {
        let (code_at_0, code_at_100) = (500, 3500);
        let sensor = SensorSource::Adc {
            code_at_0,
            code_at_100,
        };
        Self::draft()
            .after_requests([Request::Joint(joint(sensor))])
            .arm()
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
}
/// Sends bytes as they are and collects the answers.
pub fn exchange(port: &mut SimulatedPort, bytes: &[u8]) -> Vec<OwnedResponse> {
    port.send(bytes).unwrap();
    let until = port.now_us() + ANSWERS_US;
    let mut heard = Vec::new();
    while port.now_us() < until {
        heard.extend(port.receive(until).unwrap());
    }
    desk::messages(&heard)
        .map(|messages| understand(&messages))
        .collect()
}

fn understand(message: &[u8]) -> OwnedResponse {
    match postcard::from_bytes::<Response<'_>>(message).unwrap() {
        Response::Ack { seq, .. } => OwnedResponse::Ack(seq),
        Response::Refused { seq, refusal } => {
            OwnedResponse::Refused(seq, refusal.code, refusal.field.to_owned())
        }
        _ => OwnedResponse::Other,
    }
}
