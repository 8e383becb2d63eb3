//! Complete conversations in which a device uses all its functions, as seeds for the fuzzers.

mod shipped;

use firmware::control::{HoldPolicy, JointSpec, LawSpec, PointSpec, SensorSource};
use firmware::link::Request;
use firmware::muscle::{CalciumForceSpec, MuscleSpec, RecruitmentSpec};
use firmware::pulse::{GroupSpec, Partner, Shape, TrainSpec};
use firmware::safety::{ListedPulse, WearerSpec};
use firmware::units::{Amplitude, Micros, us};
use tests::desk;
use tests::fuzz::{BOOTED, Session, payload, request_frame};

/// Step of a conversation.
#[expect(
    clippy::large_enum_variant,
    reason = "a few dozen steps a seed, made once"
)]
pub enum Step {
    /// The host sends a request.
    Ask(Request),
    /// Time advances by this number of 100 µs and 1 µs.
    Wait(u8),
    /// The board's inputs change, encoded as in `fuzz::Session::set_inputs`.
    Inputs(u8),
    /// A trigger edge.
    Trigger,
    /// The joint sensor returns this code.
    Joint(u16),
}

use Step::{Ask, Inputs, Joint, Trigger, Wait};

impl Step {
    /// Applies the step to a session.
    pub fn run(&self, session: &mut Session) {
        match self {
            Ask(request) => session.request(&payload(request)),
            Wait(_) => session.advance(self.length_us()),
            Inputs(bits) => session.set_inputs(*bits),
            Trigger => session.trigger(),
            Joint(code) => session.set_joint_code(&code.to_le_bytes()),
        }
    }

    /// Returns the time that the step takes, µs.
    fn length_us(&self) -> u32 {
        match self {
            Wait(n) => u32::from(*n) * 100 + 1,
            _ => 0,
        }
    }

    /// Returns the step as `fuzz::lockstep` parses it.
    fn bytes(&self) -> Vec<u8> {
        match self {
            Ask(request) => {
                let payload = payload(request);
                let length = u8::try_from(payload.len()).expect("seeds have short requests");
                [&[0, length][..], &payload].concat()
            }
            Wait(n) => vec![4, *n],
            Inputs(bits) => vec![5, *bits],
            Trigger => vec![6, 0],
            Joint(code) => [[7, 0], code.to_le_bytes()].concat(),
        }
    }
}

/// Returns target, file name and contents of every generated seed.
pub fn all() -> Vec<(&'static str, String, Vec<u8>)> {
    let mut seeds = Vec::new();
    for (name, steps) in conversations() {
        let bytes = steps.iter().flat_map(Step::bytes).collect();
        seeds.push(("lockstep", name.to_owned(), bytes));
        let requests = steps.iter().filter_map(|step| match step {
            Ask(request) => Some(request),
            _ => None,
        });
        let frames = (1..)
            .zip(requests)
            .flat_map(|(seq, r)| request_frame(r, seq));
        seeds.push(("frame", name.to_owned(), frames.collect()));
    }
    let edges = "t_us,channel,state,dac_code\n0,1,cathodic,100\n200,1,isolated,100\n\
                 200,10,anodic,65535\n300,1,anodic,100\n500,1,grounded,0\n";
    seeds.push(("edge_file", "one_period".to_owned(), edges.into()));
    seeds
}

/// Returns conversations that a device carries out from beginning to end.
pub fn conversations() -> [(&'static str, Vec<Step>); 10] {
    [
        ("two_channels", two_channels()),
        ("group_and_trigger", group_and_trigger()),
        ("joint", joint()),
        ("fault", fault()),
        ("lists", lists()),
        ("timed", timed()),
        ("wall", shipped::conversation("harris_wall/1_pre_wall.toml")),
        ("force", shipped::conversation("gentle_force.toml")),
        ("endpoint", shipped::conversation("endpoint_force.toml")),
        ("lift", shipped::conversation("lift.toml")),
    ]
}

const LIMIT: Amplitude = Amplitude::new(20_000);

fn channel(channel: u8, train: TrainSpec) -> Step {
    let mut spec = desk::channel(train, 100_000, LIMIT.get());
    if train.repeats != 0 {
        spec.start = spec.limit;
    }
    Ask(Request::Channel { channel, spec })
}

const TRAIN: TrainSpec = TrainSpec::biphasic(200, 100, 5_000);

fn wearer() -> Step {
    Ask(Request::Wearer(WearerSpec {
        fall_ms: 5,
        ..desk::wearer(20)
    }))
}

/// Returns the steps of arming, which includes the electrode check of 22 ms, and starting.
fn arm_and_start() -> [Step; 4] {
    [Ask(desk::ARM), Wait(250), Ask(Request::Start), Wait(20)]
}

fn amplitudes(mask: u16, ua: u32) -> Step {
    amplitudes_at(None, mask, ua)
}

fn amplitudes_at(at: Option<Micros>, mask: u16, ua: u32) -> Step {
    let values = (0..mask.count_ones()).map(|_| Amplitude::new(ua)).collect();
    Ask(Request::Amplitudes {
        at,
        mask,
        values,
        widths: Default::default(),
    })
}

fn two_channels() -> Vec<Step> {
    let octuplet = TrainSpec {
        shape: Shape::BiphasicAnodicFirst,
        burst_count: 8,
        burst_interval_us: 600,
        period_us: 20_000,
        offset_us: 700,
        ..TRAIN
    };
    let force = CalciumForceSpec {
        a_mn_per_s: 1_473_000,
        k_micro: 200_000,
        tau_c_us: 20_000,
        tau1_us: 30_000,
        tau2_us: 120_000,
    };
    let recruitment = RecruitmentSpec {
        motor_threshold: Amplitude::new(5_000),
        limit: LIMIT,
        reference: LIMIT,
        slope_micro: 300_000,
    };
    let spec = MuscleSpec::new(force, recruitment);
    let muscle = Request::Muscle { channel: 0, spec };
    let mut steps = vec![wearer(), channel(0, TRAIN), channel(9, octuplet)];
    let sync = Request::Sync { channel: Some(0) };
    steps.extend([Ask(sync), Ask(muscle)]);
    steps.push(Ask(Request::Subscribe { period_ms: 5 }));
    steps.extend(arm_and_start());
    steps.extend([amplitudes(0x201, 10_000), Wait(150)]);
    steps.extend([Ask(Request::KeepAlive), Wait(150)]);
    steps.extend([Request::Status, Request::Stop].map(Ask));
    steps.extend([Wait(100), Ask(Request::Clear)]);
    steps
}

/// Returns timed amplitude orders, two of them beyond the end, with sync and a trigger.
fn timed() -> Vec<Step> {
    let sync = Request::Sync { channel: Some(0) };
    let mut steps = vec![wearer(), channel(0, TRAIN), Ask(sync)];
    steps.extend(arm_and_start());
    let passed_us: u32 = steps.iter().map(Step::length_us).sum();
    let ahead = |ahead_us, ua| amplitudes_at(Some(BOOTED + us(passed_us + ahead_us)), 1, ua);
    steps.extend([amplitudes(1, 5_000), ahead(10_000, 10_000)]);
    steps.extend([ahead(20_100, 15_000), ahead(400_000, 20_000), Wait(150)]);
    steps.extend([Ask(Request::KeepAlive), Trigger, Wait(150), ahead(0, 2_000)]);
    steps.extend([
        Wait(60),
        ahead(900_000, 1_000),
        Wait(20),
        Ask(Request::Stop),
        Wait(100),
    ]);
    steps
}

fn group_and_trigger() -> Vec<Step> {
    let single = TrainSpec {
        shape: Shape::MonophasicCathodic,
        gap_us: 0,
        ground_us: 1_000,
        period_us: 10_000,
        ..TRAIN
    };
    let once = TrainSpec {
        repeats: 2,
        trigger: Some(firmware::pulse::Trigger::Start),
        ..TRAIN
    };
    let other = TrainSpec {
        offset_us: 3_000,
        ..single
    };
    let (members, partner) = (0b11, Partner::Conducted);
    let groups = [GroupSpec { members, partner }].into_iter().collect();
    let mut steps = vec![wearer(), channel(0, single), channel(1, other)];
    steps.extend([channel(5, once), Ask(Request::Groups(groups))]);
    steps.extend(arm_and_start());
    steps.extend([amplitudes(0x23, 5_000), Wait(50), Trigger, Wait(100)]);
    steps.extend([Inputs(2), Wait(100)]); // the hand-held stop opens
    steps
}

fn joint() -> Vec<Step> {
    let point = |channel| PointSpec {
        channel,
        threshold: Amplitude::new(4_000),
        max: LIMIT,
    };
    let spec = JointSpec {
        law: LawSpec::Recommended {
            lambda_milli: 12_700,
            k1_milli: 605,
            k2_milli: 6_620,
            b_milli: 91_600,
            k3_milli: 0,
            ki_milli: 0,
        },
        law_period_ms: 11,
        cutoff_mhz: 6_000,
        flexors: [point(0)].into_iter().collect(),
        extensor: point(1),
        hold: HoldPolicy::Extrapolate { max_ms: 100 },
        angle_min_mdeg: 0,
        angle_max_mdeg: 100_000,
        sensor: SensorSource::Adc {
            code_at_0: 500,
            code_at_100: 3_500,
        },
        stale_after_ms: 100,
        wearer: None,
        response: None,
    };
    let angle = |centideg| Request::Angle {
        at: None,
        centideg,
        centideg_per_s: None,
    };
    let mut steps = vec![wearer(), channel(0, TRAIN), channel(1, TRAIN)];
    steps.extend([Ask(Request::Joint(spec)), Joint(900)]);
    steps.push(Ask(Request::Subscribe { period_ms: 1 }));
    steps.extend(arm_and_start());
    for (code, centideg) in [(900, 4_500), (1_000, 4_600), (1_200, 4_700)] {
        steps.extend([Joint(code), Ask(angle(centideg)), Wait(111)]);
    }
    steps.push(Ask(Request::Stop));
    steps
}

fn fault() -> Vec<Step> {
    let mut steps = vec![wearer(), channel(3, TRAIN)];
    steps.extend(arm_and_start());
    steps.extend([amplitudes(0x08, 20_000), Wait(60)]);
    steps.extend([Inputs(4), Wait(10), Inputs(0)]); // over-current comes and goes
    steps.extend([Ask(Request::Acknowledge), Wait(200), Ask(Request::Status)]);
    steps
}

fn lists() -> Vec<Step> {
    let train = TrainSpec {
        max_width_us: 300,
        period_us: 20_000,
        lists: true,
        ..TRAIN
    };
    let pulse = |after_us, ua, width_us| ListedPulse {
        after_us,
        amplitude: Amplitude::new(ua),
        width_us,
    };
    let pulses = [
        pulse(1_000, 8_000, 200),
        pulse(20_000, 12_000, 150),
        pulse(21_234, 5_000, 300),
    ];
    let order = Request::Pulses {
        channel: 2,
        pulses: pulses.into_iter().collect(),
    };
    let mut steps = vec![wearer(), channel(2, train)];
    steps.extend(arm_and_start());
    let alive = || [Wait(150), Ask(Request::KeepAlive)];
    steps.push(amplitudes(1 << 2, 5_000));
    steps.extend((0..4).flat_map(|_| alive()));
    steps.push(Ask(order));
    steps.extend((0..6).flat_map(|_| alive()));
    steps.extend([Ask(Request::Stop), Wait(100)]);
    steps
}
