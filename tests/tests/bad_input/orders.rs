//! Requests whose answer depends on the state: arming, starting, setpoints, measurements,
//! telemetry, a second host.

use crate::bad_input::bench::{Bench, LIMIT, channel, joint};
use crate::bad_input::setup;
use crate::bad_input::table::{Expect, Row, all, dynamic_row, field, refused, row};
use firmware::control::SensorSource;
use firmware::link::{Code, Request, SCHEMA};
use firmware::muscle::{FatigueSpec, MuscleLevel, MuscleSpec};
use firmware::pulse::TrainSpec;
use firmware::safety::{ChannelSpec, ListedPulse, StageSpec, StageSupply, WearerSpec};
use firmware::units::{Amplitude, us};
use hal_sim::body::Load;
use tests::desk;

pub fn rows() -> Vec<Row> {
    all([
        session_rows(),
        arm_rows(),
        state_rows(),
        amplitude_rows(),
        width_rows(),
        list_rows(),
        angle_rows(),
        measurement_rows(),
        rung_rows(),
        subscribe_rows(),
        stages_rows(),
    ])
}

fn session_rows() -> Vec<Row> {
    let schema = |name, schema| {
        let expect = refused(Code::SchemaMismatch, "schema");
        row(name, Bench::stimulating, Request::Hello { schema }, expect)
    };
    vec![
        schema("an old schema", SCHEMA.wrapping_sub(1)),
        schema("no schema", 0),
    ]
}

fn loaded(load: Load) -> Bench {
    let mut bench = Bench::draft();
    bench.client.port().world.body.loads_mut()[1] = load;
    bench
}

/// Configures a voltage stage up to `limit_mv` for 2 kΩ, with an actual load of `ohm`.
fn volts_on(limit_mv: u32, ohm: f64) -> Bench {
    let mut spec = channel(0);
    spec.stage = StageSpec::Voltage {
        full_scale_mv: 60_000,
        load_ohm: 2_000,
    };
    spec.limit = Amplitude::new(limit_mv);
    let mut bench = Bench::open().after_requests([Request::Channel { channel: 0, spec }]);
    bench.client.port().world.body.loads_mut()[0] = Load::Ohms(ohm);
    bench
}

fn shorted() -> Bench {
    volts_on(1_000, 20.0)
}

/// Sets a load of 1 kΩ instead of the configured 2 kΩ: twice the current that the wearer allows.
fn low_load() -> Bench {
    volts_on(40_000, 1_000.0)
}

fn open_inputs() -> Bench {
    let mut bench = Bench::draft();
    let sensors = &mut bench.client.port().world.sensors;
    (sensors.arm, sensors.hand_stop) = (false, false);
    bench
}

/// Requires the hand-held stop, where only the arm key is closed.
fn key_only() -> Bench {
    let careful = WearerSpec {
        hand_stop_required: true,
        ..desk::wearer(1_000)
    };
    let mut bench = Bench::draft().after_requests([Request::Wearer(careful)]);
    bench.client.port().world.sensors.hand_stop = false;
    bench
}

fn tightened() -> Bench {
    let tight = WearerSpec {
        max_current_ua: 19_999,
        ..WearerSpec::default()
    };
    Bench::draft().after_requests([Request::Wearer(tight)])
}

/// Configures three channels of [`LIMIT`](super::bench::LIMIT) at different times, with these
/// limits of their sum.
fn together(max_sum_ua: u32, max_sum_rms_ua: u32) -> Bench {
    summed(Bench::draft(), max_sum_ua, max_sum_rms_ua)
}

fn summed(bench: Bench, max_sum_ua: u32, max_sum_rms_ua: u32) -> Bench {
    let tight = WearerSpec {
        max_sum_ua,
        max_sum_rms_ua,
        ..WearerSpec::default()
    };
    bench.after_requests([Request::Wearer(tight)])
}

/// Adds 10 mA through the configured load, which is 19.3 mA through the measured one.
fn more_together(max_sum_ua: u32, max_sum_rms_ua: u32) -> Bench {
    summed(volts_on(20_000, 1_000.0), max_sum_ua, max_sum_rms_ua)
}

#[rustfmt::skip]
fn arm_rows() -> Vec<Row> {
    let arm = |name, scene, expect| row(name, scene, desk::ARM, expect);
    vec![
        arm("arm", Bench::draft, Expect::Done),
        row("another setup", Bench::draft, Request::Arm { setup: 1 }, refused(Code::OtherSetup, "setup")),
        arm("nothing to arm", Bench::open, refused(Code::NothingToArm, "channels")),
        arm("the key without the stop", key_only, refused(Code::HandStopOpen, "hand_stop_required")),
        arm("arm input open", open_inputs, refused(Code::ArmInputOpen, "arm input")),
        arm("electrode off", || loaded(Load::Open), refused(Code::ElectrodeOff, "electrode").on(2)),
        arm("electrodes shorted", shorted, refused(Code::ElectrodeShort, "electrode").on(1)),
        arm("a lower load than declared", low_load, refused(Code::LoadTooLow, "load_ohm").on(1).allowed(1_035, 1_035)),
        arm("limit tightened after its channel", tightened, refused(Code::CurrentLimit, "limit").on(1).allowed(0, 19_999)),
        arm("20 mA over the common return", || together(20_000, 4_899), Expect::Done),
        arm("too much at once", || together(19_999, 4_899), refused(Code::SumLimit, "limit").allowed(20_000, 19_999)),
        arm("too much rms", || together(20_000, 4_898), refused(Code::SumRmsLimit, "limit").allowed(4_899, 4_898)),
        arm("too much at once through the loads", || more_together(15_000, 50_000), refused(Code::SumLimit, "limit").allowed(19_324, 15_000)),
        arm("too much rms through the loads", || more_together(20_000, 2_000), refused(Code::SumRmsLimit, "limit").allowed(2_734, 2_000)),
        arm("through the loads", || more_together(19_324, 2_734), Expect::Done),
        arm("a fixed number of pulses that is controlled", counted_joint, refused(Code::CountedControlled, "repeats").on(1)),
        arm("arm twice", Bench::armed, refused(Code::WrongState, "state")),
        arm("arm in use", Bench::stimulating, refused(Code::WrongState, "state")),
    ]
}

#[rustfmt::skip]
fn state_rows() -> Vec<Row> {
    use Request::{Acknowledge, Clear, KeepAlive, Start, Stop};
    let zero = || amplitudes(1, &[0]);
    let wrong = || refused(Code::WrongState, "state");
    let latched = || refused(Code::FaultLatched, "fault").allowed(6, 6);
    let not_armed = || refused(Code::NotArmed, "state");
    vec![
        row("start before arming", Bench::draft, Start, wrong()),
        row("start twice", Bench::stimulating, Start, wrong()),
        row("acknowledge nothing", Bench::draft, Acknowledge, wrong()),
        row("acknowledge in use", Bench::stimulating, Acknowledge, wrong()),
        row("setpoint before arming", Bench::draft, zero(), not_armed()),
        row("angle before arming", Bench::joint_draft, angle(0), not_armed()),
        row("arm in fault", Bench::faulted, desk::ARM, latched()),
        row("start in fault", Bench::faulted, Start, latched()),
        row("setpoint in fault", Bench::faulted, zero(), latched()),
        row("angle in fault", Bench::faulted, angle(0), not_armed()),
        row("acknowledge a fault", Bench::faulted, Acknowledge, Expect::Done),
        row("stop in fault", Bench::faulted, Stop, Expect::Done),
        row("stop in idle", Bench::draft, Stop, Expect::Done),
        row("keep alive in idle", Bench::open, KeepAlive, Expect::Done),
        row("clear in use", Bench::stimulating, Clear, Expect::Done),
    ]
}

fn amplitudes(mask: u16, values: &[u32]) -> Request {
    let values = values.iter().map(|&v| Amplitude::new(v)).collect();
    Request::Amplitudes {
        at: None,
        mask,
        values,
        widths: Default::default(),
    }
}

#[rustfmt::skip]
fn amplitude_rows() -> Vec<Row> {
    let mask = || refused(Code::OutOfRange, "mask").allowed(1, 1023);
    let count = |n| refused(Code::AmplitudeCount, "values").allowed(n, n);
    let above = || refused(Code::AboveWearerLimit, "values").on(3).allowed(0, 20_000);
    let (top, over) = (LIMIT.get(), LIMIT.get() + 1);
    let mut rows = vec![
        row("no amplitudes", Bench::armed, amplitudes(0, &[]), mask()),
        row("no amplitudes in idle", Bench::draft, amplitudes(0, &[]), mask()),
        row("no amplitudes in use", Bench::stimulating, amplitudes(0, &[]), mask()),
        row("ten amplitudes", Bench::ten_armed, amplitudes(1023, &[top; 10]), Expect::Done),
        row("amplitude of channel 11", Bench::ten_armed, amplitudes(1024, &[0]), mask()),
        row("all bits", Bench::ten_armed, amplitudes(u16::MAX, &[0; 10]), mask()),
        row("a fixed number of pulses up to its start", counted, amplitudes(1, &[2_000]), Expect::Done),
        row("a fixed number of pulses above it", counted, amplitudes(1, &[2_001]), refused(Code::AboveStart, "start").on(1).allowed(1, 2_000)),
        row("a channel of the joint", Bench::joint_armed, amplitudes(0b10, &[0]), refused(Code::Controlled, "channel").on(2)),
    ];
    for scene in [Bench::armed as fn() -> Bench, Bench::stimulating] {
        rows.extend([
            row("the limit itself", scene, amplitudes(0b100, &[top]), Expect::Done),
            row("above the limit", scene, amplitudes(0b100, &[over]), above()),
            // An order is accepted as a whole or not at all: the first two are within their limits.
            row("one of three above", scene, amplitudes(0b111, &[0, 1, over]), above()),
            row("the largest number", scene, amplitudes(0b100, &[u32::MAX]), above()),
            row("too few values", scene, amplitudes(0b111, &[0, 1]), count(3)),
            row("too many values", scene, amplitudes(0b1, &[0, 1]), count(1)),
            row("values for nobody", scene, amplitudes(0, &[0]), mask()),
            row("a channel without a train", scene, amplitudes(0b1001, &[0, 0]), refused(Code::NoTrain, "channel").on(4)),
        ]);
    }
    rows
}

/// Returns an order of amplitudes in µA and widths in µs for the first channels.
fn stimuli(pairs: &[(u32, u16)]) -> Request {
    Request::Amplitudes {
        at: None,
        mask: (1 << pairs.len()) - 1,
        values: pairs.iter().map(|(ua, _)| Amplitude::new(*ua)).collect(),
        widths: pairs.iter().map(|(_, us)| *us).collect(),
    }
}

/// Stimulates on one channel with 200 µs up to 400 that has completed its rise and takes lists; 4
/// µC per phase.
fn widening() -> Bench {
    let train = TrainSpec {
        max_width_us: 400,
        lists: true,
        ..channel(0).train
    };
    let spec = ChannelSpec {
        train,
        ..channel(0)
    };
    let wearer = WearerSpec {
        max_charge_nc: 4_000,
        rise_ms: 1,
        ..desk::wearer(1_000)
    };
    let setup = [
        Request::Wearer(wearer),
        Request::Channel { channel: 0, spec },
        desk::ARM,
        Request::Start,
        stimuli(&[(1_000, 200)]),
    ];
    let mut bench = Bench::draft().after_requests(setup);
    for _ in 0..5 {
        bench.wait(20_000);
        bench = bench.after_requests([Request::KeepAlive]);
    }
    bench
}

/// Arms one channel of seven pulses that reaches 2 mA at once.
fn counted() -> Bench {
    let train = TrainSpec {
        repeats: 7,
        ..channel(0).train
    };
    let spec = ChannelSpec {
        train,
        start: Amplitude::new(2_000),
        ..channel(0)
    };
    Bench::draft().after_requests([Request::Channel { channel: 0, spec }, desk::ARM])
}

/// Configures a joint, one of whose channels has a train of seven pulses.
fn counted_joint() -> Bench {
    let train = TrainSpec {
        repeats: 7,
        ..channel(0).train
    };
    let spec = ChannelSpec {
        train,
        ..channel(0)
    };
    Bench::draft().after_requests([
        Request::Channel { channel: 0, spec },
        Request::Joint(joint(SensorSource::Host)),
    ])
}

#[rustfmt::skip]
fn width_rows() -> Vec<Row> {
    let range = || refused(Code::OutOfRange, "widths").allowed(10, 500);
    let own = || refused(Code::OutOfRange, "widths").on(1);
    let count = |n| refused(Code::AmplitudeCount, "widths").allowed(n, n);
    let charge = |highest| refused(Code::ChargeAtWidth, "max_charge_nc").on(1).allowed(0, highest);
    let one_width = |mask: u16, values: &[u32]| match amplitudes(mask, values) {
        Request::Amplitudes { mask, values, .. } => Request::Amplitudes { at: None, mask, values, widths: [200].into_iter().collect() },
        other => other,
    };
    vec![
        row("width 0", widening, stimuli(&[(1_000, 0)]), range()),
        row("width 9", widening, stimuli(&[(1_000, 9)]), range()),
        row("width 501", widening, stimuli(&[(1_000, 501)]), range()),
        row("width 65535", widening, stimuli(&[(1_000, u16::MAX)]), range()),
        row("the shortest width", widening, stimuli(&[(1_000, 10)]), Expect::Done),
        row("the largest width", widening, stimuli(&[(1_000, 400)]), Expect::Done),
        row("above the largest width", widening, stimuli(&[(1_000, 401)]), own().allowed(10, 400)),
        row("the charge limit itself", widening, stimuli(&[(10_000, 400)]), Expect::Done),
        row("above the charge limit", widening, stimuli(&[(10_001, 400)]), charge(10_000)),
        row("another width of a fixed train", Bench::stimulating, stimuli(&[(1_000, 201)]), own().allowed(200, 200)),
        row("a fixed train's own width", Bench::stimulating, stimuli(&[(1_000, 200)]), Expect::Done),
        row("too few widths", Bench::stimulating, one_width(0b11, &[0, 0]), count(2)),
        row("a muscle under a live width", muscle_under_widths, desk::ARM, refused(Code::WidthChanges, "max_width_us").on(1)),
        row("widths for nobody", Bench::stimulating, one_width(0, &[]), refused(Code::OutOfRange, "mask").allowed(1, 1023)),
    ]
}

/// Configures a muscle on a channel with a live width.
fn muscle_under_widths() -> Bench {
    let train = TrainSpec {
        max_width_us: 400,
        ..channel(0).train
    };
    let spec = ChannelSpec {
        train,
        ..channel(0)
    };
    let muscle = setup::MUSCLE;
    Bench::open().after_requests([
        Request::Channel { channel: 0, spec },
        Request::Muscle {
            channel: 0,
            spec: muscle,
        },
    ])
}

fn list(channel: u8, pulses: &[(u32, u32, u16)]) -> Request {
    let pulses = pulses.iter().map(|&(after_us, ua, width_us)| ListedPulse {
        after_us,
        amplitude: Amplitude::new(ua),
        width_us,
    });
    Request::Pulses {
        channel,
        pulses: pulses.collect(),
    }
}

/// Plays a list on the channel of [`widening`].
fn listing() -> Bench {
    widening().after_requests([list(0, &[(20_000, 1_000, 200); 16])])
}

/// Leaves out a burst in [`widening`], so that another rise follows.
fn unrisen() -> Bench {
    let mut bench = widening().after_requests([stimuli(&[(0, 200)])]);
    bench.wait(40_000);
    bench
}

#[rustfmt::skip]
fn list_rows() -> Vec<Row> {
    let out = |field| refused(Code::OutOfRange, field);
    let single_pulse = |after_us, ua, width_us| list(0, &[(after_us, ua, width_us)]);
    vec![
        row("a list of nothing", widening, list(0, &[]), out("pulses").allowed(1, 16)),
        row("a list", widening, list(0, &[(0, 1_000, 400); 1]), Expect::Done),
        row("a list of sixteen", widening, list(0, &[(20_000, 1_000, 10); 16]), Expect::Done),
        row("a list after a pause", widening, single_pulse(20_001, 1_000, 200), refused(Code::ListTooSteep, "amplitude").on(1).allowed(0, 500)),
        row("a list that waits too long", widening, single_pulse(2_000_001, 1_000, 200), out("after_us").allowed(0, 2_000_000)),
        row("a list too fast", widening, list(0, &[(0, 1_000, 200), (19_999, 1_000, 200)]), out("after_us").on(1).allowed(20_000, 2_000_000)),
        row("a list of amplitude 0", widening, single_pulse(0, 0, 200), out("amplitude").allowed(1, i32::MAX)),
        row("a list of width 9", widening, single_pulse(0, 1_000, 9), out("width_us").allowed(10, 500)),
        row("a list above the largest width", widening, single_pulse(0, 1_000, 401), out("width_us").on(1).allowed(10, 400)),
        row("a list above the charge limit", widening, single_pulse(0, 10_001, 400), refused(Code::ChargeAtWidth, "max_charge_nc").on(1).allowed(0, 10_000)),
        row("a list above the limit", widening, single_pulse(0, 20_001, 10), refused(Code::AboveWearerLimit, "values").on(1).allowed(0, 20_000)),
        row("a list of channel 11", widening, list(10, &[(0, 1_000, 200)]), out("channel").allowed(0, 9)),
        row("a list where none is taken", Bench::stimulating, single_pulse(0, 1_000, 200), refused(Code::NoLists, "lists").on(1)),
        row("a list before arming", Bench::draft, single_pulse(0, 1_000, 200), refused(Code::NotArmed, "state")),
        row("a list before the start", Bench::armed, single_pulse(0, 1_000, 200), refused(Code::WrongState, "state")),
        row("a list while one plays", listing, single_pulse(0, 1_000, 200), refused(Code::ListPlays, "pulses")),
        row("a list before the rise", unrisen, single_pulse(0, 1_000, 200), refused(Code::NotRisen, "pulses").on(1)),
    ]
}

fn angle(centideg: i16) -> Request {
    Request::Angle {
        at: None,
        centideg,
        centideg_per_s: None,
    }
}

/// Returns a row with an angle `ahead` µs after the device's present time.
fn timed_angle(name: &str, scene: fn() -> Bench, ahead: i32, expect: Expect) -> Row {
    let request = move |bench: &mut Bench| Request::Angle {
        at: Some(bench.now() + us(ahead.cast_unsigned())),
        centideg: 0,
        centideg_per_s: None,
    };
    dynamic_row(name, scene, request, expect)
}

/// Configures angles from 0.011° to 89.989°, neither of which is a whole hundredth of a degree.
fn odd_range() -> Bench {
    let mut spec = joint(SensorSource::Host);
    (spec.angle_min_mdeg, spec.angle_max_mdeg) = (-89_989, -11);
    Bench::draft().after_requests([Request::Joint(spec)]).arm()
}

/// Sends `count` timed angles, which wait.
fn waiting(count: i32) -> Bench {
    let mut bench = Bench::joint_armed();
    for n in 1..=count {
        let at = bench.now() + us(500_000 + n.cast_unsigned());
        bench.client.angle(Some(at), 0, None).unwrap();
    }
    bench
}

#[rustfmt::skip]
fn angle_rows() -> Vec<Row> {
    let time = || refused(Code::SetpointTime, "at");
    let centideg = |v: i64| Some(angle(v.try_into().ok()?));
    let rate = |v: i64| {
        let centideg_per_s = Some(v.try_into().ok()?);
        Some(Request::Angle { at: None, centideg: 0, centideg_per_s })
    };
    let armed = Bench::joint_armed as fn() -> Bench;
    let mut rows = vec![
        row("an angle without a joint", Bench::armed, angle(0), refused(Code::NoJoint, "joint")),
        // A control tick, 1 ms, passes before an angle is judged.
        timed_angle("990 ms ahead", armed, 990_000, Expect::Done),
        timed_angle("1010 ms ahead", armed, 1_010_000, time()),
        timed_angle("990 ms old", armed, -990_000, Expect::Done),
        timed_angle("1010 ms old", armed, -1_010_000, time()),
        timed_angle("half the clock away", armed, i32::MIN, time()),
        timed_angle("seven wait", || waiting(7), 600_000, Expect::Done),
        timed_angle("eight wait", || waiting(8), 600_000, time()),
        timed_angle("out of order", || waiting(1), 400_000, time()),
    ];
    rows.extend(field(armed, "centideg", 0, 9_000).rows(centideg));
    rows.extend(field(odd_range, "centideg", -8_998, -2).rows(centideg));
    rows.extend(field(armed, "centideg_per_s", -2_000_000, 2_000_000).rows(rate));
    rows
}

/// Returns a row with a measurement of `joint` made `ahead` µs after the device's present time.
fn measurement(name: &str, scene: fn() -> Bench, joint: u8, ahead: i32, expect: Expect) -> Row {
    let request = move |bench: &mut Bench| Request::Measurement {
        joint,
        centideg: 0,
        at: bench.now() + us(ahead.cast_unsigned()),
    };
    dynamic_row(name, scene, request, expect)
}

fn measured() -> Bench {
    let mut bench = Bench::joint_armed();
    let at = bench.now();
    bench.client.measurement(0, at).unwrap();
    bench
}

#[rustfmt::skip]
fn measurement_rows() -> Vec<Row> {
    let time = || refused(Code::MeasurementTime, "at");
    let no_joint = || refused(Code::OutOfRange, "joint").allowed(0, 0);
    vec![
        measurement("joint 0", Bench::joint_armed, 0, 0, Expect::Done),
        measurement("joint 1", Bench::joint_armed, 1, 0, no_joint()),
        measurement("joint 255", Bench::joint_armed, 255, 0, refused(Code::OutOfRange, "joint").allowed(0, 8)),
        measurement("before arming", Bench::joint_draft, 0, 0, refused(Code::NotArmed, "state")),
        measurement("without a joint", Bench::armed, 0, 0, refused(Code::NoJoint, "joint")),
        measurement("with its own", Bench::adc_joint_armed, 0, 0, refused(Code::SensorNotHost, "sensor")),
        measurement("4 ms ahead", Bench::joint_armed, 0, 4_000, Expect::Done),
        measurement("10 ms ahead", Bench::joint_armed, 0, 10_000, time()),
        measurement("older than the last", measured, 0, -50_000, time()),
    ]
}

/// Configures a muscle on channel 0 and a muscle with fatigue on channel 1.
fn muscles() -> Bench {
    let tires = MuscleSpec {
        fatigue: Some(FatigueSpec::QUADRICEPS),
        ..setup::MUSCLE
    };
    let specs = (0..).zip([setup::MUSCLE, tires]);
    Bench::draft().after_requests(specs.map(|(channel, spec)| Request::Muscle { channel, spec }))
}

fn muscles_armed() -> Bench {
    muscles().arm()
}

fn muscles_stimulating() -> Bench {
    muscles_armed().after_requests([Request::Start])
}

fn muscles_stopped() -> Bench {
    let mut bench = muscles_stimulating().after_requests([Request::Stop]);
    bench.wait(300_000);
    bench
}
#[rustfmt::skip]
fn rung_rows() -> Vec<Row> {
    const PLAIN: MuscleLevel = MuscleLevel::CalciumForce;
    const TIRES: MuscleLevel = MuscleLevel::CalciumForceFatigue;
    let ask = |name: &str, scene: fn() -> Bench, channel, level, expect| {
        row(name, scene, Request::MuscleLevel { channel, level }, expect)
    };
    let not_armed = || refused(Code::NotArmed, "state");
    let no_muscle = |channel| refused(Code::NoMuscle, "muscle").on(channel);
    let no_fatigue = refused(Code::NoFatigue, "fatigue").on(1);
    let mut rows = vec![
        ask("a model level before arming", muscles, 0, PLAIN, not_armed()),
        ask("a model level after a stop", muscles_stopped, 0, PLAIN, not_armed()),
        ask("a model level, armed", muscles_armed, 0, PLAIN, Expect::Done),
        ask("a model level, stimulating", muscles_stimulating, 1, TIRES, Expect::Done),
        ask("a model level of a bare channel", muscles_armed, 2, PLAIN, no_muscle(3)),
        ask("a model level of no channel", muscles_stimulating, 9, PLAIN, no_muscle(10)),
        ask("fatigue that is not there", muscles_armed, 0, TIRES, no_fatigue),
    ];
    let plain = |v: i64| Some(Request::MuscleLevel { channel: v.try_into().ok()?, level: PLAIN });
    rows.extend(field(Bench::ten_muscles_armed, "channel", 0, 9).rows(plain));
    rows
}

/// Returns rows on restarts. A simulator stores no stage table: its stages are those of the session.
fn stages_rows() -> Vec<Row> {
    let store = Request::StoreStages {
        stages: [None; 10],
        supply: StageSupply::Common,
    };
    let none = refused(Code::NoStageMemory, "stages");
    // A simulator has no boot loader either.
    let no_loader = refused(Code::NoBootLoader, "boot_loader");
    let enter = Request::EnterBootLoader;
    vec![
        row("stages", Bench::draft, store, none),
        row("boot loader", Bench::draft, enter, no_loader),
    ]
}

fn subscribe_rows() -> Vec<Row> {
    field(Bench::stimulating, "period_ms", 0, 1_000).rows(|v| {
        let period_ms = v.try_into().ok()?;
        Some(Request::Subscribe { period_ms })
    })
}
