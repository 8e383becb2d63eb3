//! A native device brought into the state that a row of the table needs.

use crate::bad_input::setup;
use firmware::control::{HoldPolicy, JointSpec, LawSpec, PointSpec, SensorSource};
use firmware::link::{Request, Response, SetupSum};
use firmware::pulse::{CHANNELS, TrainSpec};
use firmware::safety::ChannelSpec;
use firmware::units::{Amplitude, Micros};
use hal_sim::world::World;
use host_core::link::{Connection, Error, Port, SimulatedPort};
use tests::desk;

/// Device time at boot; the clock wraps while rows run.
const BOOT: Micros = Micros::new(u32::MAX - 1_000_000);

/// Limit of every configured channel, µA.
pub const LIMIT: Amplitude = Amplitude::new(20_000);

/// Amplitude during stimulation, µA.
const FLOWING: Amplitude = Amplitude::new(5_000);

/// Longest wait for answers, µs; longer than an electrode check.
const ANSWERS_US: u64 = 60_000;

/// Device, and the host that owns its session.
pub struct Bench {
    pub client: Connection<SimulatedPort>,
    /// Number of the owner's session.
    pub session: u16,
}

/// Frame from the device, reduced to the parts that rows compare.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum OwnedResponse {
    Ack(u16),
    Refused(Option<u16>, u16, String),
    Other,
}

pub fn world() -> World {
    desk::world(BOOT)
}

/// Returns a channel with 200 µs at 50 Hz, up to [`LIMIT`].
pub fn channel(offset_us: u32) -> ChannelSpec {
    let train = TrainSpec {
        offset_us,
        ..TrainSpec::biphasic(200, 100, 20_000)
    };
    desk::channel(train, 100_000, LIMIT.get())
}
/// Returns a joint on channels 0 (flexor) and 1 (extensor), 0° to 90°.
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

/// Returns requests for a wearer and this many channels.
fn channels(count: u8) -> impl Iterator<Item = Request> {
    let channels = (0..count).map(|c| Request::Channel {
        channel: c,
        spec: channel(1500 * u32::from(c)),
    });
    std::iter::once(Request::Wearer(desk::wearer(1_000))).chain(channels)
}

impl Bench {
    /// Opens a session without any configuration.
    pub fn open() -> Self {
        let (client, info) = desk::open(BOOT);
        let session = info.session;
        Self { client, session }
    }

    /// Sends these requests, which must all be accepted.
    pub fn after_requests(mut self, requests: impl IntoIterator<Item = Request>) -> Self {
        for request in requests {
            self.ask(request).unwrap();
        }
        self
    }

    /// Sends a request and returns the answer; [`desk::ARM`] arms the accepted setup.
    pub fn ask(&mut self, request: Request) -> Result<u64, Error> {
        match request {
            desk::ARM => self.client.arm(),
            request => self.client.request(request),
        }
    }

    /// Configures three channels.
    pub fn draft() -> Self {
        Self::with_channels(3)
    }

    fn with_channels(count: u8) -> Self {
        Self::open().after_requests(channels(count))
    }

    /// Returns a request that arms the setup of [`Self::draft`].
    pub fn arm_draft() -> Request {
        let mut sum = SetupSum::default();
        channels(3).for_each(|request| sum.note(&request));
        let setup = sum.total();
        Request::Arm { setup }
    }

    /// Arms the configured setup.
    pub fn arm(self) -> Self {
        self.after_requests([desk::ARM])
    }

    /// Configures and arms three channels.
    pub fn armed() -> Self {
        Self::draft().arm()
    }

    /// Configures and arms all ten channels.
    pub fn ten_armed() -> Self {
        Self::with_channels(10).arm()
    }

    /// Configures and arms all ten channels with a muscle each.
    pub fn ten_muscles_armed() -> Self {
        let spec = setup::MUSCLE;
        let muscles = (0..10).map(|channel| Request::Muscle { channel, spec });
        Self::with_channels(10).after_requests(muscles).arm()
    }

    /// Stimulates on three channels.
    pub fn stimulating() -> Self {
        let mut bench = Self::armed().after_requests([Request::Start]);
        let amplitudes = [0, 1, 2].map(|channel| (channel, FLOWING));
        bench.client.set_amplitudes(&amplitudes).unwrap();
        bench.wait(50_000);
        bench
    }

    /// Configures a joint measured by the host, beside channel 2.
    pub fn joint_draft() -> Self {
        Self::draft().after_requests([Request::Joint(joint(SensorSource::Host))])
    }

    /// Arms a joint measured by the host.
    pub fn joint_armed() -> Self {
        Self::joint_draft().arm()
    }

    /// Arms a joint measured by the board.
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
    /// Causes an over-current fault during stimulation, whose cause is over.
    pub fn faulted() -> Self {
        let mut bench = Self::stimulating();
        bench.client.port().world.sensors.over_current = true;
        bench.wait(5_000);
        bench.client.port().world.sensors.over_current = false;
        bench.wait(5_000);
        bench
    }

    /// Advances time, and discards messages.
    pub fn wait(&mut self, us: u64) {
        let until = self.client.port().now_us() + us;
        while self.client.next(until).unwrap().is_some() {}
    }

    /// Returns the device time.
    pub fn now(&mut self) -> Micros {
        Micros::new(self.client.port().now_us() as u32)
    }

    /// Returns the present codes of the DACs.
    pub fn codes(&mut self) -> [u16; CHANNELS] {
        let mut codes = [0; CHANNELS];
        for write in &self.client.port().world.recorder.trace.dac {
            codes[usize::from(write.channel)] = write.code;
        }
        codes
    }

    /// Returns whether every channel is disconnected now.
    pub fn is_isolated(&mut self) -> bool {
        self.client.port().world.recorder.trace.last_levels().0 == 0
    }
}
/// Sends bytes unchanged and returns the answers.
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
