//! Thirty seconds of a device's inputs as a log: ten channels of every waveform, a controlled
//! joint, predicted muscles, setpoints at 90 Hz, bad frames, refusals, a trigger, a fault and a
//! silent host.

use firmware::control::{HoldPolicy, JointSpec, LawSpec, PointSpec, SensorSource};
use firmware::device::Draft;
use firmware::link::{BROADCAST, Request, SCHEMA};
use firmware::lockstep::Sensors;
use firmware::muscle::{CalciumForceSpec, MuscleSpec, RecruitmentSpec};
use firmware::pulse::{GroupSpec, Partner, Shape, TrainSpec, Trigger};
use firmware::safety::{ChannelSpec, StageSpec, WearerSpec};
use firmware::units::{Amplitude, Micros, us};
use tests::desk;

/// Boot time; the clock wraps ten seconds into the session.
pub const BOOT: Micros = Micros::new(u32::MAX - 10_000_000);

/// Input of a device.
pub enum Step {
    Receive(Micros, Vec<u8>, Sensors),
    Advance(Micros, Sensors),
}

pub struct Host {
    pub log: Vec<Step>,
    /// Time in µs since boot.
    pub now: u32,
    session: u16,
    seq: u16,
    /// Setup that the host has sent.
    draft: Draft,
    sensors: Sensors,
}

/// Delay of bytes after the preceding step, µs.
pub const ARRIVAL_US: u32 = 137;

impl Host {
    /// Returns the host of a device whose first session has this number, just after opening the
    /// session.
    pub fn greeting(session: u16) -> Self {
        let mut host = Self {
            log: Vec::new(),
            now: 0,
            session: BROADCAST,
            seq: 65_000,
            draft: Draft::default(),
            sensors: Sensors::default(),
        };
        host.wait_ms(3);
        host.say(Request::Hello { schema: SCHEMA });
        host.session = session;
        host.wait_ms(5);
        host
    }

    pub fn say(&mut self, request: Request) {
        let frame = desk::frame(self.session, self.seq, self.draft.prepare_request(request));
        self.seq = self.seq.wrapping_add(1);
        self.send(frame);
    }

    /// Sends bytes between two steps of time.
    fn send(&mut self, bytes: Vec<u8>) {
        let at = BOOT + us(self.now + ARRIVAL_US);
        self.log.push(Step::Receive(at, bytes, self.sensors));
    }

    /// Waits while the finger follows a slow sine, independently of the device.
    pub fn wait_ms(&mut self, ms: u32) {
        for _ in 0..ms {
            self.now += 1000;
            let phase = f64::from(self.now) * 1e-6 * 2.0;
            self.sensors.joint = Some((1200.0 + 800.0 * phase.sin()) as u16);
            let to = BOOT + us(self.now);
            self.log.push(Step::Advance(to, self.sensors));
            self.sensors.trigger = None;
        }
    }

    fn configure(&mut self) {
        self.say(Request::Wearer(WearerSpec {
            rise_ms: 200,
            ..WearerSpec::default()
        }));
        for channel in 0..10 {
            let spec = channel_spec(channel);
            self.say(Request::Channel { channel, spec });
            self.wait_ms(1);
        }
        let (members, partner) = (1 << 8 | 1 << 9, Partner::Conducted);
        let pair = GroupSpec { members, partner };
        self.say(Request::Groups([pair].into_iter().collect()));
        self.say(Request::Sync { channel: Some(0) });
        for channel in [0, 1, 4] {
            self.say(muscle(channel));
        }
        self.say(Request::Joint(joint()));
        self.say(Request::Subscribe { period_ms: 20 });
    }

    fn arm_and_start(&mut self) {
        self.say(desk::ARM);
        self.wait_ms(40);
        self.say(Request::Start);
        self.wait_ms(1);
    }

    /// Stimulates for `ms`, with a setpoint of every kind at 90 Hz.
    fn stimulate(&mut self, ms: u32) {
        for step in 0..ms / 11 {
            let amplitude = |c: u32| Amplitude::new(2_000 + 150 * ((step * (c + 3)) % 40));
            self.say(Request::Amplitudes {
                at: None,
                mask: 0b11_1111_0001,
                values: DIRECT.map(|c| amplitude(c.into())).into_iter().collect(),
                // The widths of two channels, one of each shape, change from burst to burst.
                widths: DIRECT
                    .map(|c| match c {
                        LIVE_BIPHASIC => 50 + (step * 7 % 250) as u16,
                        LIVE_MONOPHASIC => 10 + (step * 11 % 290) as u16,
                        fixed => width_us(fixed),
                    })
                    .into_iter()
                    .collect(),
            });
            self.say(Request::Angle {
                at: None,
                centideg: 4_500 + ((step % 90) as i16 - 45) * 70,
                centideg_per_s: None,
            });
            match step % 50 {
                7 => self.send(vec![3, 141, 59, 26, 53, 0]),
                19 => self.send(vec![1; 900]),
                20 => self.send(vec![0]),
                31 => self.say(Request::Amplitudes {
                    at: None,
                    mask: 1,
                    values: [Amplitude::new(99_999)].into_iter().collect(),
                    widths: Default::default(),
                }),
                43 => self.sensors.trigger = Some(BOOT + us(self.now + 411)),
                _ => {}
            }
            self.wait_ms(11);
        }
    }
}

/// Channels that the host drives.
const DIRECT: [u8; 7] = [0, 4, 5, 6, 7, 8, 9];
/// Channels among them with a live width.
const LIVE_BIPHASIC: u8 = 6;
const LIVE_MONOPHASIC: u8 = 5;

fn width_us(channel: u8) -> u16 {
    150 + 13 * u16::from(channel)
}

/// Returns a channel with its own waveform, rate, width and offset.
pub fn channel_spec(channel: u8) -> ChannelSpec {
    let (c, is_one_phase) = (u32::from(channel), channel % 3 == 2);
    let mut train = TrainSpec {
        shape: match channel % 3 {
            0 => Shape::BiphasicCathodicFirst,
            1 => Shape::BiphasicAnodicFirst,
            _ => Shape::MonophasicCathodic,
        },
        width_us: width_us(channel),
        max_width_us: match channel {
            LIVE_BIPHASIC | LIVE_MONOPHASIC => 300,
            _ => 0,
        },
        gap_us: if is_one_phase {
            0
        } else {
            11 * u16::from(channel)
        },
        ground_us: if is_one_phase { 1_500 } else { 0 },
        period_us: 20_011 + 1_237 * c,
        offset_us: 731 * c,
        burst_count: 1,
        burst_interval_us: 0,
        repeats: 0,
        trigger: (channel == 7).then_some(Trigger::Start),
        lists: false,
    };
    if channel == 6 {
        (train.burst_count, train.burst_interval_us) = (3, 3_001);
    }
    if channel == 7 {
        train.repeats = 3;
    }
    if channel >= 8 {
        // Members of one group: each pulses while the other is grounded, never both at once.
        train.shape = Shape::BiphasicAnodicFirst;
        (train.gap_us, train.ground_us, train.period_us) = (20, 0, 25_000);
        train.offset_us = 9_000 * (c - 8);
    }
    let mut spec = desk::channel(train, 24_000, 18_000);
    if !channel.is_multiple_of(2) {
        let (full_scale_mv, load_ohm) = (24_000, 2_000);
        spec.stage = StageSpec::Voltage {
            full_scale_mv,
            load_ohm,
        };
    }
    if channel == 7 {
        spec.start = spec.limit; // a train of a fixed number of pulses does not rise
    }
    spec
}

/// Returns an arbitrary muscle within the allowed ranges.
fn muscle(channel: u8) -> Request {
    Request::Muscle {
        channel,
        spec: MuscleSpec::new(
            CalciumForceSpec {
                a_mn_per_s: 300_000,
                k_micro: 150_000,
                tau_c_us: 20_000,
                tau1_us: 40_000,
                tau2_us: 80_000,
            },
            RecruitmentSpec {
                motor_threshold: Amplitude::new(1_500),
                limit: Amplitude::new(18_000),
                reference: Amplitude::new(18_000),
                slope_micro: 300_000,
            },
        ),
    }
}

fn joint() -> JointSpec {
    let point = |channel| PointSpec::of_pair(channel, Amplitude::new(15_000), 400);
    JointSpec {
        law: LawSpec::ALONE,
        law_period_ms: 2,
        cutoff_mhz: LawSpec::ALONE.default_cutoff_mhz(),
        flexors: [point(1), point(2)].into_iter().collect(),
        extensor: point(3),
        hold: HoldPolicy::Extrapolate { max_ms: 60 },
        angle_min_mdeg: 0,
        angle_max_mdeg: 100_000,
        sensor: SensorSource::Adc {
            code_at_0: 100,
            code_at_100: 2_600,
        },
        stale_after_ms: 50,
        wearer: None,
        response: None,
    }
}

/// Returns the whole log, for a device whose first session has this number.
pub fn thirty_seconds(session: u16) -> Vec<Step> {
    let mut host = Host::greeting(session);
    host.configure();
    host.arm_and_start();
    host.stimulate(19_000); // across the wrap
    host.say(Request::Stop);
    host.wait_ms(300);
    host.arm_and_start();
    host.stimulate(4_000);
    host.sensors.over_current = true;
    host.wait_ms(5);
    host.sensors.over_current = false;
    host.say(Request::Status);
    host.wait_ms(5);
    host.say(Request::Acknowledge);
    host.wait_ms(200);
    host.arm_and_start();
    host.stimulate(4_000);
    host.wait_ms(400); // silence of the host
    host.say(Request::Status);
    host.wait_ms(30_000 - host.now / 1000);
    host.log
}
