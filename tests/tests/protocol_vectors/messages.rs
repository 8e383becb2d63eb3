//! One message of every kind, with every variant of every type inside.

use firmware::bench::limb::nominal_limb;
use firmware::board::wiring::BOARD;
use firmware::control::{
    EndpointSpec, ForceGap, ForceSpec, HoldPolicy, JointSpec, LawSpec, PointSpec, PostureSpec,
    SensorSource,
};
use firmware::haptics::{
    CoContraction, Form, Hold, ModulatedSpec, ModulationSpec, MotionPhase, PreWall, QuarticSpec,
    Side, WallSpec,
};
use firmware::limb::LineSpec;
use firmware::link::message::{OptionBytes, ResetCause};
use firmware::link::{
    Code, Counters, Event, HelloInfo, Kind, Refusal, Request, Response, SCHEMA, Status, Telemetry,
    ToDevice,
};
use firmware::link::{ForceSample, JointSample, LiftSample, WrenchSample};
use firmware::muscle::{CalciumForceSpec, FatigueSpec, MuscleLevel, MuscleSpec, RecruitmentSpec};
use firmware::pulse::CHANNELS;
use firmware::pulse::{GroupSpec, Partner, Shape, TrainSpec, Trigger};
use firmware::safety::{
    ChannelSpec, Fault, FaultRecord, ListedPulse, Origin, RemainingAllowance, StageKind, StageSpec,
    StageSupply, StageTable, Stages, StagesFault, State, StopCause, WearerSpec,
};
use firmware::units::{Amplitude, Micros};
use tests::desk;

const BIPHASIC: TrainSpec = TrainSpec::biphasic(200, 50, 20_000);
const MONOPHASIC: TrainSpec = TrainSpec {
    shape: Shape::MonophasicCathodic,
    gap_us: 0,
    ground_us: 1_000,
    offset_us: 2_000,
    ..BIPHASIC
};
const DOUBLETS: TrainSpec = TrainSpec {
    shape: Shape::BiphasicAnodicFirst,
    period_us: 2_000_000,
    burst_count: 2,
    burst_interval_us: 5_000,
    repeats: 300,
    ..BIPHASIC
};
const TRIGGERED: TrainSpec = TrainSpec {
    shape: Shape::MonophasicAnodic,
    repeats: 10,
    trigger: Some(Trigger::Start),
    ..MONOPHASIC
};
const TOGGLED: TrainSpec = TrainSpec {
    trigger: Some(Trigger::Toggle),
    ..BIPHASIC
};
const GATED: TrainSpec = TrainSpec {
    trigger: Some(Trigger::Gated),
    ..BIPHASIC
};
const LIVE: TrainSpec = TrainSpec {
    max_width_us: 300,
    lists: true,
    ..BIPHASIC
};
const AMPS: StageSpec = StageSpec::Current {
    full_scale_ua: 100_000,
};
const VOLTS: StageSpec = StageSpec::Voltage {
    full_scale_mv: 60_000,
    load_ohm: 2_000,
};

/// Returns the channel of the example session.
pub fn channel(channel: u8, train: TrainSpec, stage: StageSpec) -> Request {
    let spec = ChannelSpec {
        stage,
        ..desk::channel(train, 100_000, 20_000)
    };
    Request::Channel { channel, spec }
}

pub fn plain_channel() -> Request {
    channel(0, BIPHASIC, AMPS)
}

fn joint(law: LawSpec, flexors: &[PointSpec], sensor: SensorSource) -> Request {
    Request::Joint(JointSpec {
        law,
        law_period_ms: law.default_period_ms(),
        cutoff_mhz: law.default_cutoff_mhz(),
        flexors: flexors.iter().copied().collect(),
        extensor: PointSpec {
            channel: 2,
            threshold: Amplitude::new(14_000),
            max: Amplitude::new(26_000),
        },
        hold: match sensor {
            SensorSource::Adc { .. } => HoldPolicy::Extrapolate { max_ms: 100 },
            SensorSource::Host => HoldPolicy::Hold,
        },
        angle_min_mdeg: -5_000,
        angle_max_mdeg: 100_000,
        sensor,
        stale_after_ms: 50,
        wearer: None,
        response: None,
    })
}

#[rustfmt::skip]
fn joints() -> [(&'static str, Request); 3] {
    let a = PointSpec { channel: 0, threshold: Amplitude::new(20_000), max: Amplitude::new(28_000) };
    let b = PointSpec { channel: 1, threshold: Amplitude::new(25_000), max: Amplitude::new(36_000) };
    let adc = SensorSource::Adc { code_at_0: 800, code_at_100: 3_300 };
    [
        ("joint, recommended law, two flexor points, board's sensor", joint(LawSpec::ALONE, &[a, b], adc)),
        (
            "joint, the paper's law, one flexor point, host's sensor",
            joint(LawSpec::PAPER, &[a], SensorSource::Host),
        ),
        ("joint, PID", joint(LawSpec::PID, &[b], adc)),
    ]
}

/// Returns the nominal arm.
fn endpoint(posture: PostureSpec) -> EndpointSpec {
    let limb = nominal_limb();
    EndpointSpec {
        offsets_um: limb.offsets_um,
        ranges_mdeg: limb.ranges_mdeg,
        recruit_ms: 5,
        posture,
    }
}

/// Returns line `n` of the nominal arm.
fn line(n: usize) -> LineSpec {
    nominal_limb().lines[n].clone()
}

fn groups(partners: &[Partner]) -> Request {
    let specs = partners.iter().enumerate().map(|(index, &partner)| {
        let members = 0b11 << (2 * index);
        GroupSpec { members, partner }
    });
    Request::Groups(specs.collect())
}

fn muscle() -> MuscleSpec {
    let force = CalciumForceSpec {
        a_mn_per_s: 200_000,
        k_micro: 200_000,
        tau_c_us: 20_000,
        tau1_us: 50_000,
        tau2_us: 100_000,
    };
    let recruitment = RecruitmentSpec {
        motor_threshold: Amplitude::new(8_000),
        limit: Amplitude::new(20_000),
        reference: Amplitude::new(20_000),
        slope_micro: 300_000,
    };
    MuscleSpec::new(force, recruitment)
}

#[rustfmt::skip]
fn muscles() -> Vec<(&'static str, Request)> {
    let request = |channel, spec| Request::Muscle { channel, spec };
    let tires = MuscleSpec {
        fatigue: Some(FatigueSpec::QUADRICEPS),
        level: MuscleLevel::CalciumForceFatigue,
        ..muscle()
    };
    let held = MuscleSpec { level: MuscleLevel::None, ..muscle() };
    vec![
        ("muscle", request(0, muscle())),
        ("muscle that tires", request(9, tires)),
        ("muscle without dynamics", request(1, held)),
    ]
}

#[rustfmt::skip]
fn modulated(joint: u8, phase_joint: u8) -> ModulationSpec {
    let base = Amplitude::new(16_000);
    let share = QuarticSpec([200_000, 350_000, -1_250_000, 900_000, 800_000]);
    ModulationSpec {
        joint,
        phase_joint,
        dead_band_centideg_per_s: 800,
        cutoff_mhz: 2_000,
        angle_min_mdeg: -10_000,
        angle_max_mdeg: 125_000,
        stale_after_ms: 50,
        max_hold_ms: 30_000,
        flexor: ModulatedSpec { channel: 2 * joint, base, form: Form::Scaled, lift: Some(share), drop: None },
        extensor: ModulatedSpec {
            channel: 2 * joint + 1,
            base,
            form: Form::AboveThreshold { threshold: Amplitude::new(6_000) },
            lift: Some(share),
            drop: Some(QuarticSpec([1_000_000; 5])),
        },
    }
}

fn walls() -> [(&'static str, Request); 2] {
    let plain = WallSpec {
        at_mdeg: 70_000,
        side: Side::Flexion,
        channel: 1,
        max: Amplitude::new(20_000),
        stiffness: 2_000,
        damping: 0,
        cutoff_mhz: 6_000,
        pre_wall: None,
        co_contraction: None,
        angle_min_mdeg: 0,
        angle_max_mdeg: 140_000,
        sensor: SensorSource::Host,
        stale_after_ms: 50,
    };
    let full = WallSpec {
        side: Side::Extension,
        damping: 10,
        pre_wall: Some(PreWall {
            depth_mdeg: 9_000,
            begin: Amplitude::new(6_000),
            end: Amplitude::new(20_000),
        }),
        co_contraction: Some(CoContraction {
            channel: 0,
            amplitude: Amplitude::new(8_000),
        }),
        ..plain
    };
    [
        ("wall", Request::Wall(plain)),
        (
            "wall, with pre-wall and co-contraction",
            Request::Wall(full),
        ),
    ]
}

/// Returns a configuration of force control, and two force setpoints.
#[rustfmt::skip]
fn forces() -> [(&'static str, Request); 4] {
    let force = |at, millinewton_per_s| Request::Force {
        channel: 9,
        at,
        millinewton: 2_500,
        millinewton_per_s,
    };
    let spec = ForceSpec {
        min_period_us: 10_000,
        hold: HoldPolicy::Extrapolate { max_ms: 100 },
        max_period_us: None,
    };
    let slower = ForceSpec { max_period_us: Some(1_000_000), ..spec };
    [
        ("force control", Request::ForceControl { channel: 9, spec }),
        ("force control, down to a pulse a second", Request::ForceControl { channel: 8, spec: slower }),
        ("force, on arrival", force(None, None)),
        ("force, timed, with its rate", force(Some(Micros::new(1_000_000)), Some(-400))),
    ]
}

#[rustfmt::skip]
pub fn requests() -> Vec<(&'static str, ToDevice)> {
    let mut vectors = vec![
        ("hello", Request::Hello { schema: SCHEMA }),
        ("keep-alive", Request::KeepAlive),
        ("status", Request::Status),
        ("clear", Request::Clear),
        ("wearer, defaults", Request::Wearer(WearerSpec::default())),
        ("channel, biphasic, current stage", plain_channel()),
        ("channel, doublets, voltage stage", channel(9, DOUBLETS, VOLTS)),
        ("channel, monophasic", channel(1, MONOPHASIC, VOLTS)),
        ("channel, triggered", channel(2, TRIGGERED, AMPS)),
        ("channel, toggled", channel(3, TOGGLED, AMPS)),
        ("channel, gated", channel(5, GATED, AMPS)),
        ("channel, live width and lists", channel(4, LIVE, AMPS)),
        ("groups", groups(&[Partner::Conducted, Partner::Isolated])),
        ("no groups", groups(&[])),
        ("sync", Request::Sync { channel: Some(9) }),
        ("no sync", Request::Sync { channel: None }),
    ];
    vectors.extend(muscles());
    vectors.extend(joints());
    vectors.extend(walls());
    vectors.extend(forces());
    vectors.extend([
        ("arm", Request::Arm { setup: 0xDEAD_BEEF }),
        ("start", Request::Start),
        ("stop", Request::Stop),
        ("acknowledge", Request::Acknowledge),
        ("amplitudes", amplitudes(&[(0, 10_000), (9, 0)])),
        (
            "amplitudes and widths",
            Request::Amplitudes {
                at: None,
                mask: 0b10_0000_0001,
                values: [10_000, 0].map(Amplitude::new).into_iter().collect(),
                widths: [300, 10].into_iter().collect(),
            },
        ),
        (
            "amplitudes, timed",
            Request::Amplitudes {
                at: Some(Micros::new(3_000_000_000)),
                mask: 0b1,
                values: [Amplitude::new(10_000)].into_iter().collect(),
                widths: Default::default(),
            },
        ),
        ("pulses", Request::Pulses { channel: 9, pulses: [listed(0, 10_000, 300), listed(20_000, 1, 10)].into_iter().collect() }),
        ("no pulses", Request::Pulses { channel: 0, pulses: Default::default() }),
        ("angle, on arrival", Request::Angle { at: None, centideg: 4_500, centideg_per_s: None }),
        (
            "angle, timed, with its rate",
            Request::Angle {
                at: Some(Micros::new(4_294_967_295)),
                centideg: -1_250,
                centideg_per_s: Some(-5_027),
            },
        ),
        ("arm, held", Request::Limb(endpoint(PostureSpec::Fixed([0, 0, 0, 4_500, 3_000, 2_000, 8_000, 0, 0])))),
        ("arm, measured", Request::Limb(endpoint(PostureSpec::Measured { stale_after_ms: 100 }))),
        ("line over the elbow", Request::Line(line(0))),
        ("line over the shoulder", Request::Line(line(2))),
        ("line over the girdle", Request::Line(line(7))),
        ("wrench", Request::Wrench { at: None, force_mn: [-2_000, 3_000, 0] }),
        ("wrench, timed", Request::Wrench { at: Some(Micros::new(5)), force_mn: [1_000_000, -1_000_000, 1] }),
        ("modulated elbow", Request::Modulation(modulated(2, 2))),
        ("modulated shoulder", Request::Modulation(modulated(3, 2))),
        ("held", Request::ObjectHeld { held: true }),
        ("released", Request::ObjectHeld { held: false }),
        ("measurement of an arm", Request::Measurement { joint: 8, centideg: -1, at: Micros::new(1_000_000) }),
        ("measurement", Request::Measurement { joint: 0, centideg: 4_321, at: Micros::new(1_000_000) }),
        ("subscribe", Request::Subscribe { period_ms: 20 }),
        ("muscle level", Request::MuscleLevel { channel: 9, level: MuscleLevel::CalciumForce }),
        ("simulated trigger", Request::SimulateTrigger),
        ("stages", Request::StoreStages { stages: table(), supply: StageSupply::Common }),
        ("boot loader", Request::EnterBootLoader),
        ("stages, separate", Request::StoreStages { stages: table(), supply: StageSupply::Separate }),
        ("channel, live width and lists, in place of the first", channel(0, LIVE, AMPS)),
    ]);
    let number = |(seq, (name, request)): (u16, _)| {
        let session = if seq == 0 { 0 } else { 1 };
        let message = ToDevice { session, seq, request };
        (name, message)
    };
    (0u16..).zip(vectors).map(number).collect()
}

pub fn amplitudes(list: &[(u8, u32)]) -> Request {
    Request::Amplitudes {
        at: None,
        mask: list.iter().map(|(channel, _)| 1 << channel).sum(),
        values: list
            .iter()
            .map(|&(_, value)| Amplitude::new(value))
            .collect(),
        widths: Default::default(),
    }
}

const fn listed(after_us: u32, ua: u32, width_us: u16) -> ListedPulse {
    ListedPulse {
        after_us,
        amplitude: Amplitude::new(ua),
        width_us,
    }
}

fn fault(fault: Fault) -> FaultRecord {
    FaultRecord {
        residual: [-1_310_600, 0, 0, 0, 0, 0, 0, 0, 0, 65_535],
        later_faults: Fault::Watchdog.bit(),
        power_lost: true,
        detail: 0x0801_2344,
        ..FaultRecord::new(fault, Micros::new(123_456_789))
    }
}

pub fn responses() -> Vec<(String, Response<'static>)> {
    let mut vectors = vec![];
    let mut add = |name: String, response| vectors.push((name, response));
    for hello in hellos() {
        add(format!("hello, {:?}", hello.state), Response::Hello(hello));
    }
    let at = Micros::new(2_000_000);
    add("acknowledged".into(), Response::Ack { seq: 300, at });
    let width = Refusal::new(Code::OutOfRange, "width_us").with_channel(3);
    let refusals = [
        (Some(7), width.with_range(10, 500)),
        (None, Refusal::new(Code::BadCrc, "frame")),
    ];
    for (seq, refusal) in refusals {
        let name = format!("refused, {}", refusal.code);
        add(name, Response::Refused { seq, refusal });
    }
    for fault in [None, Some(fault(Fault::OverCurrent))] {
        let status = Status {
            at,
            state: State::Stimulating,
            fault,
            counters: Counters {
                frames: 12_000,
                pulses: 100_000,
                ..Counters::default()
            },
            remaining: fault.is_none().then_some(RemainingAllowance {
                time_ms: 3_599_000,
                channel: 2,
                dose_uc: 810_000,
            }),
        };
        add("status".into(), Response::Status { seq: 2, status });
    }
    for event in events() {
        let name = format!("event, {event:?}").chars().take(40).collect();
        add(name, Response::Event { at, event });
    }
    for channels in [0, 3, 4, 5] {
        let name = format!("telemetry, {channels} channels");
        add(name, Response::Telemetry(telemetry(at, channels)));
    }
    vectors
}

/// Returns telemetry of `channels` channels with all values, or without any for 0.
fn telemetry(at: Micros, channels: u32) -> Telemetry {
    let is_full = channels != 0;
    let gap = ForceGap {
        lower_mn: 0,
        upper_mn: 4_096,
    };
    let force = |c| ForceSample {
        reference_mn: (c != 0).then_some(2_500),
        period_us: (c != 0).then_some(20_000),
        gap: (c != 0).then_some(gap),
    };
    let amplitude = |c| (c != 0).then_some(Amplitude::new(c * 10_000));
    Telemetry {
        at,
        reference_centideg: is_full.then_some(4_500),
        measured_centideg: is_full.then_some(-120),
        effort_milli: is_full.then_some(-999),
        limiting: is_full,
        amplitudes: (0..channels).map(amplitude).collect(),
        widths_us: (0..channels.min(2))
            .map(|c| (c != 0).then_some(250))
            .collect(),
        forces_mn: (0..channels).map(|c| (c != 0).then_some(c * 100)).collect(),
        force_control: (0..channels.min(2)).map(force).collect(),
        wrench: is_full.then_some(WrenchSample {
            reference_mn: [-2_000, 3_000, 0],
            achievable_permille: 988,
        }),
        lift: is_full.then(|| LiftSample {
            hold: [Hold::Released, Hold::Held, Hold::Expired][channels as usize % 3],
            joints: [Some(MotionPhase::Lift), Some(MotionPhase::Drop), None]
                .map(|phase| JointSample {
                    measured_centideg: phase.map(|_| 6_310),
                    phase,
                })
                .into_iter()
                .collect(),
        }),
        state: [State::Idle, State::Stimulating][usize::from(is_full)],
    }
}

/// Returns one value of each variant.
fn stages() -> [Stages; 9] {
    use StagesFault::{Damaged, Erased, Incomplete, OtherBoard, Version};
    let declared = [
        (Origin::Owner, Some(StageSupply::Common)),
        (Origin::Session, Some(StageSupply::Separate)),
    ];
    let [owner, session] = declared.map(|(origin, supply)| {
        let stages = table();
        Stages::Stored(StageTable {
            origin,
            supply,
            stages,
        })
    });
    let faults = [Erased, Incomplete, Damaged, Version, OtherBoard];
    let [a, b, c, d, e] = faults.map(Stages::Unknown);
    let simulated = Stages::Simulated { channels: 0x28E };
    [
        owner,
        Stages::AsConfigured,
        session,
        simulated,
        a,
        b,
        c,
        d,
        e,
    ]
}

/// Returns nine stages, one of them a voltage stage, and a missing tenth.
fn table() -> [Option<StageKind>; CHANNELS] {
    let full_scale_ua = 100_000;
    let mut stages = [Some(StageKind::Current { full_scale_ua }); CHANNELS];
    let full_scale_mv = 60_000;
    (stages[3], stages[9]) = (Some(StageKind::Voltage { full_scale_mv }), None);
    stages
}

fn hellos() -> impl Iterator<Item = HelloInfo> {
    use ResetCause::{BrownOut, Pin, PowerOn, Software, Watchdog};
    use State::{Armed, Boot, Idle, Stimulating, Stopping};
    let states = [Boot, Idle, Armed, Stimulating, Stopping, State::Fault];
    let resets = [PowerOn, Pin, BrownOut, Software, PowerOn, Watchdog];
    let kinds = [Kind::Board, Kind::Native, Kind::Qemu, Kind::Breadboard]
        .into_iter()
        .cycle();
    let states = states.into_iter().zip(resets).cycle();
    (states.zip(kinds).zip(stages())).map(|(((state, reset), kind), stages)| HelloInfo {
        seq: 0,
        session: 1,
        schema: SCHEMA,
        version: [0, 1, 0],
        kind,
        unique_id: [0x0031_0020, 0x3436_5101, 0x2036_3643],
        at: Micros::new(10_040),
        state,
        reset,
        last_fault: (reset == Watchdog).then(|| fault(Fault::Watchdog)),
        dead_time_us: 5,
        stages,
        option_bytes: (kind == Kind::Board).then_some(OptionBytes::WANTED),
        board: match kind {
            Kind::Board | Kind::Breadboard => BOARD.name,
            Kind::Native | Kind::Qemu => "",
        }
        .try_into()
        .unwrap(),
        crystal_hz: if kind == Kind::Board { 7_987_421 } else { 0 },
    })
}

fn events() -> Vec<Event> {
    use StopCause::{ArmExpired, ArmKey, DoseReached, Finished, HandStop, HostSilent, TimeOver};
    let causes = [
        StopCause::Request,
        HostSilent,
        HandStop,
        ArmExpired,
        ArmKey,
        Finished,
        TimeOver,
        DoseReached,
    ];
    let faults = (1..=24).filter_map(Fault::from_number);
    let stops = causes.map(|c| [Event::Stopping(c), Event::Stopped(c)]);
    let mut event_list = stops.concat();
    event_list.extend(faults.map(|f| Event::Faulted(fault(f))));
    let electrode = Event::Electrode {
        channel: 9,
        applied: Amplitude::new(2_000),
        current_ua: 996,
    };
    let limit_cycle = Event::LimitCycle {
        swing_centideg: 668,
        period_ms: 310,
        gain_milli: 700,
    };
    event_list.extend([
        Event::Recovered,
        electrode,
        limit_cycle,
        Event::HoldExpired,
        Event::TriggerEdge,
        Event::SyncEdge,
    ]);
    event_list
}
