//! Random hosts, wearers and moments against a whole device: it never panics,
//! and an observer of pins, requests and answers never sees a promise broken.

mod device_desk;

use device_desk::*;
use firmware::control::{HoldPolicy, JointSpec, LawSpec, PointSpec, SensorSource};
use firmware::link::{Event, Request, SCHEMA};
use firmware::muscle::{CalciumForceSpec, RecruitmentSpec};
use firmware::pulse::{CHANNELS, GroupSpec, Levels, Partner, Shape, State as Line, TrainSpec};
use firmware::safety::{ChannelSpec, StageSpec, WearerSpec};
use firmware::units::{Amplitude, Micros};
use proptest::collection::vec;
use proptest::option;
use proptest::prelude::*;
use proptest::test_runner::TestRunner;
use std::cell::Cell;
use std::collections::HashMap;

/// What a host, a wearer or time does next.
#[derive(Clone, Debug)]
enum Step {
    Send(Request),
    /// Several at once, in one chunk.
    Chunk(Vec<Request>),
    Raw(Vec<u8>),
    /// A request cut or with one bit wrong.
    Broken(Request, u16),
    Session(u16),
    Seq(u16),
    Hello,
    Wait(u32),
    /// A host that streams: so many keep-alives, so far apart.
    Stream(u8, u32),
    Arm(bool),
    HandStop(bool),
    OverCurrent,
    Load(u8, u32),
    Joint(Option<u16>),
    Trigger(u32),
    /// Bytes stamped with a time other than now.
    Stamped(Request, i32),
}

/// Mostly allowed, sometimes at or over an edge, sometimes anything.
fn near(low: u32, high: u32) -> impl Strategy<Value = u32> {
    prop_oneof![
        60 => low..=high,
        1 => Just(low),
        1 => Just(high),
        1 => Just(low.wrapping_sub(1)),
        1 => Just(high.wrapping_add(1)),
        1 => any::<u32>(),
    ]
}

fn near16(low: u16, high: u16) -> impl Strategy<Value = u16> {
    near(low.into(), high.into()).prop_map(|v| v as u16)
}

fn shape() -> impl Strategy<Value = Shape> {
    prop_oneof![
        Just(Shape::BiphasicCathodicFirst),
        Just(Shape::BiphasicAnodicFirst),
        Just(Shape::MonophasicCathodic),
        Just(Shape::MonophasicAnodic),
    ]
}

/// A train, made consistent unless `wild`.
fn train() -> impl Strategy<Value = TrainSpec> {
    let common = [5_000u32, 10_000, 20_000, 12_345];
    (
        (shape(), near16(10, 500), near16(0, 200), near16(1_000, 4_000)),
        prop_oneof![3 => prop::sample::select(common.to_vec()), 1 => near(5_000, 60_000), 1 => near(5_000, 2_000_000)],
        any::<u32>(),
        (near16(1, 8), near16(200, 3_000), prop_oneof![4 => Just(0), 1 => 0u16..9]),
        (prop::bool::weighted(0.2), prop::bool::weighted(0.1)),
    )
        .prop_map(|((shape, width_us, gap, ground), period_us, offset, (count, interval, repeats), (triggered, wild))| {
            let biphasic = shape.is_biphasic();
            let mut spec = TrainSpec {
                shape,
                width_us,
                gap_us: if biphasic { gap } else { 0 },
                ground_us: if biphasic { 0 } else { ground },
                period_us,
                offset_us: offset % period_us.max(1).saturating_add(1),
                burst_count: 1,
                burst_interval_us: 0,
                repeats,
                triggered,
            };
            if wild {
                (spec.burst_count, spec.burst_interval_us) = (count as u8, interval);
                spec.offset_us = offset;
            } else if count > 1 && count <= 8 {
                let one = u32::from(width_us) * 2 + u32::from(gap.max(5)) + 5
                    + u32::from(spec.ground_us);
                (spec.burst_count, spec.burst_interval_us) =
                    (count as u8, (one.max(200) as u16).max(interval.min(1_000)));
                spec.period_us = period_us.max(
                    u32::from(count) * u32::from(spec.burst_interval_us) + 600,
                ).min(2_000_000);
            }
            spec
        })
}

fn stage() -> impl Strategy<Value = StageSpec> {
    prop_oneof![
        near(1_000, 100_000).prop_map(|full_scale_ua| StageSpec::Current { full_scale_ua }),
        (near(1_000, 150_000), near(200, 100_000)).prop_map(|(full_scale_mv, load_ohm)| {
            StageSpec::Voltage {
                full_scale_mv,
                load_ohm,
            }
        }),
    ]
}

fn channel_spec() -> impl Strategy<Value = ChannelSpec> {
    (
        train(),
        prop_oneof![3 => Just(StageSpec::Current { full_scale_ua: 100_000 }), 1 => stage()],
        prop_oneof![4 => Just(20_000), 1 => near(1, 20_000)],
    )
        .prop_map(|(train, stage, limit)| ChannelSpec {
            train,
            stage,
            limit: Amplitude(limit),
        })
}

fn wearer_spec() -> impl Strategy<Value = WearerSpec> {
    (
        prop_oneof![5 => Just(100_000), 1 => near(100, 100_000)],
        prop_oneof![5 => Just(40_000), 1 => near(1, 40_000)],
        prop_oneof![5 => Just(50_000), 1 => near(10, 50_000)],
        near16(1, 300),
        near16(5, 100),
        near16(20, 400),
    )
        .prop_map(
            |(max_current_ua, max_charge_nc, max_rms_ua, rise_ms, fall_ms, host_timeout_ms)| {
                WearerSpec {
                    max_current_ua,
                    max_charge_nc,
                    max_rms_ua,
                    rise_ms,
                    fall_ms,
                    host_timeout_ms,
                }
            },
        )
}

fn point() -> impl Strategy<Value = PointSpec> {
    (near(0, 9), near(0, 3_000), near(0, 10_000)).prop_map(|(channel, threshold, max)| PointSpec {
        channel: channel as u8,
        threshold: Amplitude(threshold),
        max: Amplitude(max),
    })
}

fn joint() -> impl Strategy<Value = JointSpec> {
    let law = prop_oneof![
        Just(LawSpec::PAPER),
        Just(LawSpec::RECOMMENDED),
        Just(LawSpec::PID),
        (any::<u32>(), any::<u32>(), any::<u32>(), any::<u32>()).prop_map(
            |(lambda_milli, k1_milli, k2_milli, b_milli)| LawSpec::Recommended {
                lambda_milli,
                k1_milli,
                k2_milli,
                b_milli
            }
        ),
    ];
    let sensor = prop_oneof![
        Just(SensorSource::Host),
        (near16(0, 4_095), near16(0, 4_095)).prop_map(|(code_at_0, code_at_100)| {
            SensorSource::Adc {
                code_at_0,
                code_at_100,
            }
        }),
    ];
    let hold = prop_oneof![
        Just(HoldPolicy::Hold),
        near16(1, 1_000).prop_map(|max_ms| HoldPolicy::Extrapolate { max_ms })
    ];
    (
        law,
        near(1, 20),
        near(500, 20_000),
        vec(point(), 0..=2),
        point(),
        hold,
        prop_oneof![3 => Just((-10_000, 90_000)), 1 => any::<(i32, i32)>()],
        sensor,
        near16(2, 500),
    )
        .prop_map(
            |(law, period, cutoff_mhz, flexors, extensor, hold, angles, sensor, stale)| JointSpec {
                law,
                law_period_ms: period as u8,
                cutoff_mhz,
                flexors: heapless::Vec::from_slice(&flexors).unwrap(),
                extensor,
                hold,
                angle_min_mdeg: angles.0,
                angle_max_mdeg: angles.1,
                sensor,
                stale_after_ms: stale,
            },
        )
}

fn muscle() -> impl Strategy<Value = Request> {
    (
        near(0, 9),
        near(100, 10_000_000),
        near(2_000, 5_000_000),
        near(5_000, 100_000),
        near(2_000, 200_000),
        near(1_000, 1_000_000),
        near(1, 5_000),
        near(10_000, 500_000),
    )
        .prop_map(
            |(channel, a, k, tau_c_us, tau1_us, tau2_us, threshold, slope_micro)| Request::Muscle {
                channel: channel as u8,
                force: CalciumForceSpec {
                    a_mn_per_s: a,
                    k_micro: k,
                    tau_c_us,
                    tau1_us,
                    tau2_us,
                },
                recruitment: RecruitmentSpec {
                    motor_threshold: Amplitude(threshold),
                    limit: Amplitude(threshold.saturating_add(9_000)),
                    reference: Amplitude(threshold.saturating_add(9_000)),
                    slope_micro,
                },
            },
        )
}

fn groups() -> impl Strategy<Value = Request> {
    let partner = prop_oneof![Just(Partner::Conducted), Just(Partner::Isolated)];
    let members = prop_oneof![4 => prop::sample::select(vec![0b11u16, 0b1100, 0b111, 0b10_1000]), 1 => any::<u16>()];
    vec((members, partner), 0..=3).prop_map(|all| {
        let specs: Vec<GroupSpec> = all
            .into_iter()
            .map(|(members, partner)| GroupSpec { members, partner })
            .collect();
        Request::Groups(heapless::Vec::from_slice(&specs).unwrap())
    })
}

fn amplitudes() -> impl Strategy<Value = Request> {
    let masks = prop::sample::select(vec![1u16, 2, 3, 7, 15]);
    let sane = (masks, vec(0u32..=20_000, 10)).prop_map(|(mask, values)| {
        let count = mask.count_ones() as usize;
        (mask, values[..count].to_vec())
    });
    let any_mask = (any::<u16>(), vec(near(0, 20_000), 0..=10));
    prop_oneof![3 => sane, 1 => any_mask].prop_map(|(mask, values)| {
        let values: Vec<Amplitude> = values.into_iter().map(Amplitude).collect();
        Request::Amplitudes {
            mask,
            values: heapless::Vec::from_slice(&values).unwrap(),
        }
    })
}

/// Device times: absolute, since a session does not know `now` here.
fn request() -> impl Strategy<Value = Request> {
    prop_oneof![
        6 => Just(Request::KeepAlive),
        2 => Just(Request::Status),
        1 => Just(Request::Clear),
        2 => wearer_spec().prop_map(Request::Wearer),
        6 => (near(0, 3), channel_spec()).prop_map(|(c, spec)| Request::Channel { channel: c as u8, spec }),
        1 => groups(),
        1 => option::of(any::<u8>().prop_map(|c| c % 12)).prop_map(|channel| Request::Sync { channel }),
        1 => muscle(),
        1 => joint().prop_map(Request::Joint),
        5 => Just(Request::Arm),
        5 => Just(Request::Start),
        2 => Just(Request::Stop),
        2 => Just(Request::Acknowledge),
        8 => amplitudes(),
        2 => (option::of(any::<u32>()), any::<i16>(), option::of(any::<i32>())).prop_map(|(at, centideg, centideg_per_s)| Request::Angle { at: at.map(Micros), centideg, centideg_per_s }),
        2 => (0i16..9_000).prop_map(|centideg| Request::Angle { at: None, centideg, centideg_per_s: None }),
        2 => (near(0, 0), any::<i16>(), any::<u32>()).prop_map(|(joint, centideg, at)| Request::Measurement { joint: joint as u8, centideg, at: Micros(at) }),
        1 => near16(0, 1_000).prop_map(|period_ms| Request::Subscribe { period_ms }),
        1 => any::<u64>().prop_map(|schema| Request::Hello { schema }),
    ]
}

fn step() -> impl Strategy<Value = Step> {
    prop_oneof![
        40 => request().prop_map(Step::Send),
        4 => vec(request(), 1..45).prop_map(Step::Chunk),
        2 => vec(any::<u8>(), 0..400).prop_map(Step::Raw),
        1 => (request(), any::<u16>()).prop_map(|(r, n)| Step::Broken(r, n)),
        1 => any::<u16>().prop_map(Step::Session),
        1 => any::<u16>().prop_map(Step::Seq),
        2 => Just(Step::Hello),
        30 => prop_oneof![0u32..600, 0u32..30_000, 20_000u32..60_000].prop_map(Step::Wait),
        1 => prop_oneof![5 => Just(2_000_000u32), 1 => Just(11_000_000)].prop_map(Step::Wait),
        15 => (1u8..30, 1_000u32..19_000).prop_map(|(n, us)| Step::Stream(n, us)),
        1 => any::<bool>().prop_map(Step::Arm),
        2 => prop::bool::weighted(0.7).prop_map(Step::HandStop),
        1 => Just(Step::OverCurrent),
        2 => (0u8..4, prop_oneof![4 => Just(2_000), 1 => Just(u32::MAX), 1 => any::<u32>()]).prop_map(|(c, o)| Step::Load(c, o)),
        1 => option::of(any::<u16>()).prop_map(Step::Joint),
        4 => (0u32..30_000).prop_map(Step::Trigger),
        1 => (request(), any::<i32>()).prop_map(|(r, d)| Step::Stamped(r, d)),
    ]
}

/// A good draft to begin with, so that most runs get to stimulate.
fn opening() -> impl Strategy<Value = Vec<Step>> {
    (
        wearer_spec(),
        vec(channel_spec(), 1..5),
        option::weighted(0.15, groups()),
        option::weighted(0.1, joint()),
        0u32..=20_000,
    )
        .prop_map(|(wearer, specs, groups, joint, amplitude)| {
            let amplitudes = all(specs.len(), amplitude);
            let mut steps = vec![Step::Hello, Step::Send(Request::Wearer(wearer))];
            for (channel, spec) in (0u8..).zip(specs) {
                steps.push(Step::Send(Request::Channel { channel, spec }));
            }
            steps.extend(groups.map(Step::Send));
            steps.extend(joint.map(|j| Step::Send(Request::Joint(j))));
            steps.push(Step::Send(Request::Arm));
            steps.push(Step::Wait(24_000));
            steps.push(Step::Send(Request::Start));
            steps.push(Step::Send(amplitudes));
            steps
        })
}

fn apply(desk: &mut Desk, step: &Step, asked: &mut Vec<(u64, u16, Request)>) {
    let now = desk.now();
    let mut note = |desk: &mut Desk, request: &Request| {
        let t = desk.time();
        asked.push((t, desk.seq, request.clone()));
    };
    match step {
        Step::Send(request) => {
            note(desk, request);
            desk.send(request.clone());
        }
        Step::Chunk(requests) => {
            let mut bytes = Vec::new();
            for request in requests {
                note(desk, request);
                bytes.extend(frame(desk.session, desk.seq, request.clone()));
                desk.seq = desk.seq.wrapping_add(1);
            }
            desk.board
                .receive(now, &bytes, &desk.sensors, &mut desk.record);
        }
        Step::Raw(bytes) => desk
            .board
            .receive(now, bytes, &desk.sensors, &mut desk.record),
        Step::Broken(request, n) => {
            let mut bytes = frame(desk.session, desk.seq, request.clone());
            let bit = usize::from(*n) % (8 * bytes.len());
            bytes[bit / 8] ^= 1 << (bit % 8);
            desk.board
                .receive(now, &bytes, &desk.sensors, &mut desk.record);
        }
        Step::Session(session) => desk.session = *session,
        Step::Seq(seq) => desk.seq = *seq,
        Step::Hello => {
            desk.heard();
            desk.send(Request::Hello { schema: SCHEMA });
            for heard in desk.heard() {
                if let Heard::Hello(info) = heard {
                    desk.session = info.session;
                }
            }
        }
        Step::Wait(us) => desk.wait(*us),
        Step::Stream(n, us) => {
            for _ in 0..*n {
                note(desk, &Request::KeepAlive);
                desk.send(Request::KeepAlive);
                desk.wait(*us);
            }
        }
        Step::Arm(closed) => desk.sensors.arm = *closed,
        Step::HandStop(closed) => desk.sensors.hand_stop = *closed,
        Step::OverCurrent => {
            desk.sensors.over_current = true;
            desk.wait(1);
            desk.sensors.over_current = false;
        }
        Step::Load(channel, ohm) => desk.sensors.load_ohm[usize::from(*channel)] = *ohm,
        Step::Joint(code) => desk.sensors.joint = *code,
        Step::Trigger(us) => {
            desk.sensors.trigger = Some(now.plus(us / 2));
            desk.wait(*us);
            desk.sensors.trigger = None;
        }
        Step::Stamped(request, by) => {
            // Any past; the future only a little, or time would run there.
            let at = now.plus_signed((*by).min(5_000));
            let bytes = frame(desk.session, desk.seq, request.clone());
            let t = desk.time() + u64::from((*by).clamp(0, 5_000).cast_unsigned());
            asked.push((t, desk.seq, request.clone()));
            desk.seq = desk.seq.wrapping_add(1);
            desk.board
                .receive(at, &bytes, &desk.sensors, &mut desk.record);
        }
    }
}

trait PlusSigned {
    fn plus_signed(self, us: i32) -> Self;
}

impl PlusSigned for Micros {
    fn plus_signed(self, us: i32) -> Self {
        Micros(self.0.wrapping_add_signed(us))
    }
}

/// The laws of the pins that hold whatever was asked.
fn judge_pins(desk: &mut Desk) -> Result<(), TestCaseError> {
    let end = desk.time();
    let faults: Vec<u64> = desk_faults(desk);
    let record = &desk.record;
    let mut last = 0;
    for &(t, _) in &record.levels {
        prop_assert!(t >= last, "levels out of order");
        last = t;
    }
    prop_assert!(record.sent.is_sorted(), "bytes out of order");
    prop_assert!(record.dac.is_sorted_by_key(|d| d.0), "DAC out of order");
    for c in 0..CHANNELS {
        let all = stretches(&record.levels, c, end);
        judge_phases(&all, c, end, &faults)?;
        for &(t, _, _) in record.dac.iter().filter(|d| usize::from(d.1) == c) {
            // Never inside a pulse, and 20 µs before the next begins.
            let at = all.partition_point(|s| s.0 <= t) - 1;
            let is_driven = |s: Line| matches!(s, Line::Anodic | Line::Cathodic);
            prop_assert!(!is_driven(all[at].1), "DAC {c} written in a phase at {t}");
            if let Some(next) = all.get(at + 1) {
                prop_assert!(
                    !is_driven(next.1) || next.0 >= t + 20,
                    "DAC {c} written {} µs before a phase",
                    next.0 - t
                );
            }
        }
    }
    Ok(())
}

/// Device events of faults, as µs since boot, from everything ever said.
fn desk_faults(desk: &mut Desk) -> Vec<u64> {
    let said = decode(&desk.record.bytes);
    let end = desk.time();
    let now = desk.now();
    said.iter()
        .filter_map(|h| match h {
            Heard::Event(_, Event::Faulted(record)) => {
                Some(end.wrapping_add_signed(record.at.since(now).into()))
            }
            _ => None,
        })
        .collect()
}

fn judge_phases(
    all: &[(u64, Line, u64)],
    c: usize,
    end: u64,
    faults: &[u64],
) -> Result<(), TestCaseError> {
    let mut last_driven: Option<(Line, u64)> = None;
    for &(from, state, to) in all {
        if !matches!(state, Line::Anodic | Line::Cathodic) {
            continue;
        }
        let cut = to == end || faults.contains(&to);
        let width = to - from;
        prop_assert!(width <= 500, "channel {c}: {width} µs at {from}");
        prop_assert!(width >= 10 || cut, "channel {c}: {width} µs at {from}");
        if let Some((before, until)) = last_driven {
            prop_assert!(
                before == state || from - until >= 5,
                "channel {c}: no dead time at {from}"
            );
        }
        last_driven = Some((state, to));
    }
    Ok(())
}

/// Driven only between an acknowledged Arm and the end of stimulation, and
/// never above the charge or later than silence allows.
fn judge_permission(
    desk: &mut Desk,
    asked: &[(u64, u16, Request)],
    longest_us: u64,
) -> Result<(), TestCaseError> {
    let Some(first) =
        desk.record.levels.iter().find(|(_, l)| {
            (0..CHANNELS).any(|c| matches!(l.state(c), Line::Anodic | Line::Cathodic))
        })
    else {
        return Ok(());
    };
    let arm = asked.iter().find(|a| matches!(a.2, Request::Arm));
    prop_assert!(arm.is_some_and(|a| a.0 <= first.0), "driven before any Arm");
    // While outputs are driven, what counts as life is not older than the
    // longest timeout and fall armed in this run; an arm order starts a check
    // of 22 ms.
    let lives: Vec<u64> = asked
        .iter()
        .filter(|a| {
            matches!(
                a.2,
                Request::KeepAlive
                    | Request::Start
                    | Request::Amplitudes { .. }
                    | Request::Angle { .. }
                    | Request::Arm
            )
        })
        .map(|a| a.0)
        .collect();
    let mut before = Levels::ISOLATED;
    for &(t, levels) in &desk.record.levels {
        let is_driven =
            |l: Levels| (0..CHANNELS).any(|c| matches!(l.state(c), Line::Anodic | Line::Cathodic));
        if is_driven(levels) && !is_driven(before) {
            let heard = lives.iter().rev().find(|&&life| life <= t);
            prop_assert!(
                heard.is_some_and(|&life| t - life <= longest_us),
                "driven at {t} without a host"
            );
        }
        before = levels;
    }
    Ok(())
}

/// Every request of the session got exactly one answer, unless bytes to the
/// host were dropped, which only a host that does not read can cause.
fn judge_answers(desk: &mut Desk, asked: &[(u64, u16, Request)]) -> Result<(), TestCaseError> {
    let mut owed: HashMap<u16, i64> = HashMap::new();
    for (_, seq, _) in asked {
        *owed.entry(*seq).or_default() += 1;
    }
    for heard in decode(&desk.record.bytes) {
        let seq = match heard {
            Heard::Ack(seq, _) | Heard::Status(seq, _) => Some(seq),
            Heard::Refused(seq, ..) => seq,
            Heard::Hello(info) => Some(info.seq),
            _ => None,
        };
        if let Some(seq) = seq {
            *owed.entry(seq).or_default() -= 1;
        }
    }
    let unanswered: Vec<_> = owed.iter().filter(|o| *o.1 > 0).collect();
    prop_assert!(unanswered.is_empty(), "{unanswered:?}");
    Ok(())
}

fn config() -> ProptestConfig {
    let cases = std::env::var("FLEXOR_CASES")
        .ok()
        .and_then(|n| n.parse().ok())
        .unwrap_or(600);
    ProptestConfig {
        cases,
        failure_persistence: None,
        max_shrink_iters: 3_000,
        ..ProptestConfig::default()
    }
}

/// What the armed setups of a run allowed, by channel.
#[derive(Default)]
struct Allowed {
    code: [u16; CHANNELS],
    monophasic: [bool; CHANNELS],
    longest_us: u64,
}

impl Allowed {
    fn note(&mut self, desk: &Desk) {
        let Some(setup) = desk.board.setup() else {
            return;
        };
        let wearer = &setup.wearer;
        let silence = u64::from(wearer.host_timeout_us() + wearer.fall_us());
        self.longest_us = self.longest_us.max(silence);
        for (c, channel) in setup.channels.iter().enumerate() {
            let Some(channel) = channel else { continue };
            self.code[c] = self.code[c].max(channel.stage.code(channel.limit).0);
            self.monophasic[c] |= !channel.train.spec().shape.is_biphasic();
        }
    }

    fn judge(&self, desk: &mut Desk) -> Result<(), TestCaseError> {
        for &(t, c, code) in &desk.record.dac {
            prop_assert!(code <= self.code[usize::from(c)], "code {code} at {t}");
        }
        let end = desk.time();
        if !desk_faults(desk).is_empty() {
            return Ok(());
        }
        for c in (0..CHANNELS).filter(|&c| !self.monophasic[c]) {
            let mut net = 0;
            for (from, state, to) in stretches(&desk.record.levels, c, end) {
                let width = (to - from).cast_signed();
                net += match state {
                    Line::Anodic => width,
                    Line::Cathodic => -width,
                    _ => 0,
                };
                prop_assert!(net.abs() <= 500, "channel {c} at {from}");
            }
            prop_assert_eq!(net, 0, "channel {}", c);
        }
        Ok(())
    }
}

/// What the cases came to, so that a fuzz that never stimulates is noticed.
#[derive(Default, Debug)]
struct Tally {
    cases: Cell<u32>,
    stimulated: Cell<u32>,
    pulses: Cell<u64>,
    faulted: Cell<u32>,
    grounded: Cell<u32>,
    monophasic: Cell<u32>,
}

impl Tally {
    fn note(&self, desk: &mut Desk, allowed: &Allowed) {
        let add = |cell: &Cell<u32>, is: bool| cell.set(cell.get() + u32::from(is));
        let pulses = desk.status().counters.pulses;
        let levels = &desk.record.levels;
        add(&self.cases, true);
        // More than the checks' own.
        add(&self.stimulated, pulses > 10);
        self.pulses.set(self.pulses.get() + u64::from(pulses));
        add(
            &self.grounded,
            levels.iter().any(|l| l.1 == Levels::GROUNDED),
        );
        add(&self.monophasic, allowed.monophasic.contains(&true));
        let is_faulted = !desk_faults(desk).is_empty();
        add(&self.faulted, is_faulted);
    }
}

fn one_run(boot: u32, steps: &[Step], tally: &Tally) -> Result<(), TestCaseError> {
    let mut desk = Desk::boot(Micros(boot), None);
    let (mut asked, mut allowed) = (Vec::new(), Allowed::default());
    for step in steps {
        apply(&mut desk, step, &mut asked);
        allowed.note(&desk);
    }
    desk.wait(1_500_000);
    allowed.note(&desk);
    judge_pins(&mut desk)?;
    judge_permission(&mut desk, &asked, allowed.longest_us)?;
    allowed.judge(&mut desk)?;
    // A raw tail without a delimiter would swallow the next request.
    if !steps
        .iter()
        .any(|s| matches!(s, Step::Raw(_) | Step::Broken(..)))
    {
        judge_answers(&mut desk, &asked)?;
    }
    // Whatever happened, a session can be had and arming works.
    desk.sensors = firmware::device::lockstep::Sensors::default();
    desk.wait(11_000_000);
    let now = desk.now();
    desk.board
        .receive(now, &[0], &desk.sensors, &mut desk.record);
    desk.heard();
    desk.hello();
    tally.note(&mut desk, &allowed);
    if desk.state() == firmware::safety::State::Fault {
        desk.must(Request::Acknowledge);
        desk.wait(110_000);
    }
    desk.run(wearer(), &[channel(PLAIN)], 5_000);
    let before = desk.record.levels.len();
    desk.wait(60_000);
    prop_assert!(desk.record.levels.len() >= before + 8);
    Ok(())
}

#[test]
fn nothing_breaks_a_promise() {
    let tally = Tally::default();
    let strategy = (
        any::<u32>(),
        option::weighted(0.9, opening()),
        vec(step(), 1..80),
    );
    let result = TestRunner::new(config()).run(&strategy, |(boot, opening, steps)| {
        let steps: Vec<Step> = opening.into_iter().flatten().chain(steps).collect();
        one_run(boot, &steps, &tally)
    });
    if let Err(e) = result {
        panic!("{e}");
    }
    println!("{tally:?}");
    let share = |cell: &Cell<u32>| f64::from(cell.get()) / f64::from(tally.cases.get());
    assert!(share(&tally.stimulated) > 0.2, "the attack is too weak");
}

/// The same bytes, whole or cut anywhere, at the same instants.
fn split_run(requests: &[Request], cuts: &[u16]) -> Record {
    let mut desk = Desk::open(Micros(u32::MAX - 30_000));
    desk.prepare(wearer(), &[channel(PLAIN), channel(MONO)]);
    desk.must(Request::Arm);
    desk.must(Request::Start);
    for pair in requests.chunks(7) {
        let mut bytes = Vec::new();
        for request in pair {
            bytes.extend(frame(desk.session, desk.seq, request.clone()));
            desk.seq = desk.seq.wrapping_add(1);
        }
        let at = desk.now();
        let mut edges: Vec<usize> = cuts.iter().map(|&c| c as usize % bytes.len()).collect();
        edges.extend([0, bytes.len()]);
        edges.sort_unstable();
        for piece in edges.windows(2) {
            let piece = &bytes[piece[0]..piece[1]];
            desk.board
                .receive(at, piece, &desk.sensors, &mut desk.record);
        }
        desk.wait(9_137);
    }
    desk.wait(300_000);
    desk.record
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, ..config() })]

    #[test]
    fn bytes_may_be_split_anywhere(
        requests in vec(request(), 1..40),
        cuts in vec(any::<u16>(), 1..40),
    ) {
        let (whole, cut) = (split_run(&requests, &[]), split_run(&requests, &cuts));
        prop_assert_eq!(whole.bytes, cut.bytes);
        prop_assert_eq!(whole.levels, cut.levels);
        prop_assert_eq!(whole.dac, cut.dac);
    }
}
