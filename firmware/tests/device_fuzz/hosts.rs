//! Random hosts, wearers and times.

use super::lifts::lift;
use super::walls::wall;
use crate::device_desk::*;
use firmware::bench::limb::{before_the_trunk, nominal_limb};
use firmware::control::{
    EndpointSpec, ForceSpec, HoldPolicy, JointSpec, LawSpec, PointSpec, PostureSpec, SensorSource,
};
use firmware::limb::{LimbSpec, LineSpec};
use firmware::link::Request;
use firmware::muscle::{CalciumForceSpec, FatigueSpec, MuscleLevel, MuscleSpec, RecruitmentSpec};
use firmware::pulse::{GroupSpec, Partner, Shape, TrainSpec, Trigger};
use firmware::safety::{ChannelSpec, ListedPulse, StageSpec, StageSupply, WearerSpec};
use firmware::units::{Amplitude, Micros};
use proptest::collection::vec;
use proptest::option;
use proptest::prelude::*;

/// Next action of a host, a wearer or the clock.
#[derive(Clone, Debug)]
pub enum Step {
    Send(Request),
    /// Several requests at once, in one chunk.
    Chunk(Vec<Request>),
    Raw(Vec<u8>),
    /// Request that is truncated or has one wrong bit.
    Broken(Request, u16),
    Session(u16),
    Seq(u16),
    Hello,
    Wait(u32),
    /// Stream of this many keep-alives at this interval, µs.
    Stream(u8, u32),
    Arm(bool),
    HandStop(bool),
    OverCurrent,
    Load(u8, u32),
    Joint(Option<u16>),
    Trigger(u32),
    /// Request with a time stamp that differs from now by this, µs.
    Stamped(Request, i32),
    /// Amplitudes that take effect this far from now, µs.
    Ahead(Request, i32),
}

/// Generates values that are mostly allowed, sometimes at or beyond a bound, sometimes arbitrary.
pub fn near(low: u32, high: u32) -> impl Strategy<Value = u32> {
    prop_oneof![
        60 => low..=high,
        1 => Just(low),
        1 => Just(high),
        1 => Just(low.wrapping_sub(1)),
        1 => Just(high.wrapping_add(1)),
        1 => any::<u32>(),
    ]
}

pub fn near16(low: u16, high: u16) -> impl Strategy<Value = u16> {
    near(low.into(), high.into()).prop_map(|v| v as u16)
}

pub fn shape() -> impl Strategy<Value = Shape> {
    prop_oneof![
        Just(Shape::BiphasicCathodicFirst),
        Just(Shape::BiphasicAnodicFirst),
        Just(Shape::MonophasicCathodic),
        Just(Shape::MonophasicAnodic),
    ]
}

/// Generates a train that is consistent unless `wild`.
pub fn train() -> impl Strategy<Value = TrainSpec> {
    let common = [5_000u32, 10_000, 20_000, 12_345];
    (
        (shape(), near16(10, 500), near16(0, 200), near16(1_000, 4_000)),
        prop_oneof![3 => prop::sample::select(common.to_vec()), 1 => near(5_000, 60_000), 1 => near(5_000, 2_000_000)],
        any::<u32>(),
        (near16(1, 8), near16(200, 3_000), prop_oneof![4 => Just(0), 1 => 0u16..9]),
        (option::weighted(0.2, prop::sample::select(vec![Trigger::Start, Trigger::Toggle, Trigger::Gated])), prop::bool::weighted(0.1), prop_oneof![2 => Just(0), 1 => near16(10, 500)]),
    )
        .prop_map(|((shape, width_us, gap, ground), period_us, offset, (count, interval, repeats), (trigger, wild, max_width_us))| {
            let biphasic = shape.is_biphasic();
            let mut spec = TrainSpec {
                shape,
                width_us,
                max_width_us: if wild || max_width_us > width_us { max_width_us } else { 0 },
                gap_us: if biphasic { gap } else { 0 },
                // Every other biphasic train is grounded too.
                ground_us: if biphasic && width_us % 2 == 0 { 0 } else { ground },
                period_us,
                offset_us: offset % period_us.max(1).saturating_add(1),
                burst_count: 1,
                burst_interval_us: 0,
                repeats,
                trigger,
                // Every third train that may have lists.
                lists: width_us % 3 == 0 && trigger.is_none() && repeats == 0 && count <= 1,
            };
            if wild {
                (spec.burst_count, spec.burst_interval_us) = (count as u8, interval);
                spec.offset_us = offset;
            } else if count > 1 && count <= 8 && !spec.lists {
                let pulse_us = u32::from(width_us.max(spec.max_width_us)) * 2 + u32::from(gap.max(5)) + 5
                    + u32::from(spec.ground_us);
                (spec.burst_count, spec.burst_interval_us) =
                    (count as u8, (pulse_us.max(200) as u16).max(interval.min(1_000)));
                spec.period_us = period_us.max(
                    u32::from(count) * u32::from(spec.burst_interval_us) + 600,
                ).min(2_000_000);
            }
            spec
        })
}

pub fn stage() -> impl Strategy<Value = StageSpec> {
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

pub fn channel_spec() -> impl Strategy<Value = ChannelSpec> {
    (
        train(),
        prop_oneof![3 => Just(StageSpec::Current { full_scale_ua: 100_000 }), 1 => stage()],
        prop_oneof![4 => Just(20_000), 1 => near(1, 20_000)],
    )
        .prop_map(|(train, stage, limit)| ChannelSpec {
            train,
            stage,
            limit: Amplitude::new(limit),
            start: Amplitude::new(0),
            area_mm2: ChannelSpec::ASSUMED_AREA_MM2,
        })
}

pub fn wearer_spec() -> impl Strategy<Value = WearerSpec> {
    (
        prop_oneof![5 => Just(100_000), 1 => near(100, 100_000)],
        prop_oneof![5 => Just(40_000), 1 => near(1, 40_000)],
        prop_oneof![5 => Just(50_000), 1 => near(10, 50_000)],
        near16(1, 300),
        near16(5, 100),
        near16(20, 400),
        prop::bool::weighted(0.1),
    )
        .prop_map(
            |(
                max_current_ua,
                max_charge_nc,
                max_rms_ua,
                rise_ms,
                fall_ms,
                host_timeout_ms,
                hand_stop_required,
            )| {
                WearerSpec {
                    max_current_ua,
                    max_charge_nc,
                    max_rms_ua,
                    rise_ms,
                    fall_ms,
                    host_timeout_ms,
                    hand_stop_required,
                    ..WearerSpec::default()
                }
            },
        )
}

pub fn point() -> impl Strategy<Value = PointSpec> {
    (near(0, 9), near(0, 3_000), near(0, 10_000)).prop_map(|(channel, threshold, max)| PointSpec {
        channel: channel as u8,
        threshold: Amplitude::new(threshold),
        max: Amplitude::new(max),
    })
}

pub fn joint() -> impl Strategy<Value = JointSpec> {
    let law = prop_oneof![
        Just(LawSpec::PAPER),
        Just(LawSpec::ALONE),
        Just(LawSpec::PID),
        any::<[u32; 6]>().prop_map(|gains| {
            let [
                lambda_milli,
                k1_milli,
                k2_milli,
                b_milli,
                k3_milli,
                ki_milli,
            ] = gains;
            LawSpec::Recommended {
                lambda_milli,
                k1_milli,
                k2_milli,
                b_milli,
                k3_milli,
                ki_milli,
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
        sensor(),
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
                wearer: None,
                response: None,
            },
        )
}

pub fn sensor() -> impl Strategy<Value = SensorSource> {
    prop_oneof![
        Just(SensorSource::Host),
        (near16(0, 4_095), near16(0, 4_095)).prop_map(|(code_at_0, code_at_100)| {
            SensorSource::Adc {
                code_at_0,
                code_at_100,
            }
        }),
    ]
}

pub fn muscle() -> impl Strategy<Value = Request> {
    (
        near(0, 9),
        near(100, 10_000_000),
        near(2_000, 5_000_000),
        near(5_000, 100_000),
        near(2_000, 200_000),
        near(1_000, 1_000_000),
        near(1, 5_000),
        near(10_000, 500_000),
        option::of(fatigue()),
        level(),
    )
        .prop_map(
            |(
                channel,
                a,
                k,
                tau_c_us,
                tau1_us,
                tau2_us,
                threshold,
                slope_micro,
                fatigue,
                level,
            )| {
                let force = CalciumForceSpec {
                    a_mn_per_s: a,
                    k_micro: k,
                    tau_c_us,
                    tau1_us,
                    tau2_us,
                };
                let recruitment = RecruitmentSpec {
                    motor_threshold: Amplitude::new(threshold),
                    limit: Amplitude::new(threshold.saturating_add(9_000)),
                    reference: Amplitude::new(threshold.saturating_add(9_000)),
                    slope_micro,
                };
                Request::Muscle {
                    channel: channel as u8,
                    spec: MuscleSpec {
                        force,
                        recruitment,
                        fatigue,
                        level,
                    },
                }
            },
        )
}

fn fatigue() -> impl Strategy<Value = FatigueSpec> {
    let alpha = || near(0, 100_000_000);
    (near(0, 10_000), alpha(), alpha(), near(10_000, 1_000_000)).prop_map(|(a, k, tau1, fat)| {
        FatigueSpec {
            alpha_a_milli_per_s2: a,
            alpha_k_nano_per_n_s: k,
            alpha_tau1_nano_per_n: tau1,
            tau_fat_ms: fat,
        }
    })
}

pub fn level() -> impl Strategy<Value = MuscleLevel> {
    prop::sample::select(MuscleLevel::ALL.to_vec())
}

pub fn groups() -> impl Strategy<Value = Request> {
    let partner = prop_oneof![Just(Partner::Conducted), Just(Partner::Isolated)];
    let members = prop_oneof![4 => prop::sample::select(vec![0b11u16, 0b1100, 0b111, 0b10_1000]), 1 => any::<u16>()];
    vec((members, partner), 0..=3).prop_map(|pairs| {
        let specs: Vec<GroupSpec> = pairs
            .into_iter()
            .map(|(members, partner)| GroupSpec { members, partner })
            .collect();
        Request::Groups(heapless::Vec::from_slice(&specs).unwrap())
    })
}

pub fn amplitudes() -> impl Strategy<Value = Request> {
    let masks = prop::sample::select(vec![1u16, 2, 3, 7, 15]);
    let sane = (masks, vec(0u32..=20_000, 10)).prop_map(|(mask, values)| {
        let count = mask.count_ones() as usize;
        (mask, values[..count].to_vec())
    });
    let any_mask = (any::<u16>(), vec(near(0, 20_000), 0..=10));
    // Mostly no width or one for each amplitude.
    let widths = prop_oneof![1 => Just(vec![]), 1 => vec(near16(10, 500), 10)];
    let amplitudes = (prop_oneof![3 => sane, 1 => any_mask], widths, any::<u8>());
    amplitudes.prop_map(|((mask, values), mut widths, odd)| {
        if odd != 0 {
            widths.truncate(values.len());
        }
        let values: Vec<Amplitude> = values.into_iter().map(Amplitude::new).collect();
        Request::Amplitudes {
            at: None,
            mask,
            values: heapless::Vec::from_slice(&values).unwrap(),
            widths: heapless::Vec::from_slice(&widths).unwrap(),
        }
    })
}

/// Generates lists of pulses that a channel mostly may have.
pub fn lists() -> impl Strategy<Value = Request> {
    let pulse = (
        prop_oneof![1 => Just(0), 3 => near(5_000, 60_000), 1 => near(0, 2_000_000)],
        near(1, 20_000),
        near16(10, 500),
    );
    (near(0, 3), vec(pulse, 0..=16)).prop_map(|(channel, pulses)| Request::Pulses {
        channel: channel as u8,
        pulses: pulses
            .into_iter()
            .map(|(after_us, amplitude, width_us)| ListedPulse {
                after_us,
                amplitude: Amplitude::new(amplitude),
                width_us,
            })
            .collect(),
    })
}

/// Generates requests. Device times are absolute, because a session does not know `now` here.
pub fn request() -> impl Strategy<Value = Request> {
    prop_oneof![
        6 => Just(Request::KeepAlive),
        2 => Just(Request::Status),
        1 => Just(Request::Clear),
        2 => wearer_spec().prop_map(Request::Wearer),
        6 => (near(0, 3), channel_spec()).prop_map(|(c, spec)| Request::Channel { channel: c as u8, spec }),
        1 => groups(),
        1 => option::of(any::<u8>().prop_map(|c| c % 12)).prop_map(|channel| Request::Sync { channel }),
        1 => muscle(),
        1 => (near(0, 3), level()).prop_map(|(channel, level)| Request::MuscleLevel { channel: channel as u8, level }),
        1 => joint().prop_map(Request::Joint),
        1 => wall().prop_map(Request::Wall),
        1 => lift().prop_map(Request::Modulation),
        3 => prop::bool::weighted(0.8).prop_map(|held| Request::ObjectHeld { held }),
        1 => Just(Request::StoreStages { stages: [None; 10], supply: StageSupply::Common }),
        5 => Just(ARM),
        5 => Just(Request::Start),
        2 => Just(Request::Stop),
        2 => Just(Request::Acknowledge),
        8 => amplitudes(),
        3 => lists(),
        2 => (option::of(any::<u32>()), any::<i16>(), option::of(any::<i32>())).prop_map(|(at, centideg, centideg_per_s)| Request::Angle { at: at.map(Micros::new), centideg, centideg_per_s }),
        2 => (0i16..9_000).prop_map(|centideg| Request::Angle { at: None, centideg, centideg_per_s: None }),
        2 => (near(0, 0), any::<i16>(), any::<u32>()).prop_map(|(joint, centideg, at)| Request::Measurement { joint: joint as u8, centideg, at: Micros::new(at) }),
        2 => (near(0, 3), near(12_500, 20_000), option::of(near(20_000, 2_000_000))).prop_map(|(channel, period_us, slowest)| Request::ForceControl { channel: channel as u8, spec: ForceSpec { min_period_us: period_us, hold: HoldPolicy::Extrapolate { max_ms: 100 }, max_period_us: slowest } }),
        3 => (near(0, 3), option::of(any::<u32>()), 0u32..30_000, option::of(any::<i32>())).prop_map(|(channel, at, millinewton, rate)| Request::Force { channel: channel as u8, at: at.map(Micros::new), millinewton, millinewton_per_s: rate }),
        1 => arm(),
        3 => (0usize..9, near(0, 3)).prop_map(|(n, channel)| line(n, channel as u8)),
        2 => (option::of(any::<u32>()), proptest::array::uniform3(-12_000i32..12_000)).prop_map(|(at, force_mn)| Request::Wrench { at: at.map(Micros::new), force_mn }),
        2 => (0u8..10, -3_000i16..9_000, any::<u32>()).prop_map(|(joint, centideg, at)| Request::Measurement { joint, centideg, at: Micros::new(at) }),
        1 => near16(0, 1_000).prop_map(|period_ms| Request::Subscribe { period_ms }),
        1 => any::<u64>().prop_map(|schema| Request::Hello { schema }),
    ]
}

/// Generates a nominal arm with a fixed or measured posture.
fn arm() -> impl Strategy<Value = Request> {
    (5u8..60, option::of(near16(2, 500))).prop_map(|(recruit_ms, stale_after_ms)| {
        let LimbSpec {
            offsets_um,
            ranges_mdeg,
            ..
        } = nominal_limb();
        let posed = before_the_trunk().map(|angle| angle.to_centideg());
        let posture = stale_after_ms.map_or(PostureSpec::Fixed(posed), |stale_after_ms| {
            PostureSpec::Measured { stale_after_ms }
        });
        Request::Limb(EndpointSpec {
            offsets_um,
            ranges_mdeg,
            recruit_ms,
            posture,
        })
    })
}

/// Returns a nominal muscle on another channel.
fn line(n: usize, channel: u8) -> Request {
    let line = nominal_limb().lines[n].clone();
    Request::Line(LineSpec {
        channel,
        limit: Amplitude::new(10_000),
        ..line
    })
}

pub fn step() -> impl Strategy<Value = Step> {
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
        12 => (amplitudes(), prop_oneof![1 => any::<i32>(), 8 => -2_000i32..1_001_000]).prop_map(|(r, d)| Step::Ahead(r, d)),
    ]
}

/// Generates a valid setup to begin with, so that most runs reach stimulation.
pub fn opening() -> impl Strategy<Value = Vec<Step>> {
    (
        wearer_spec(),
        vec(channel_spec(), 1..5),
        option::weighted(0.15, groups()),
        option::weighted(0.1, joint()),
        option::weighted(0.15, wall()),
        option::weighted(0.2, arm()),
        option::weighted(0.15, lift()),
        0u32..=20_000,
    )
        .prop_map(
            |(wearer, specs, groups, joint, wall, arm, lift, amplitude)| {
                let amplitudes = equal_amplitudes(specs.len(), amplitude);
                let mut steps = vec![Step::Hello, Step::Send(Request::Wearer(wearer))];
                for (channel, spec) in (0u8..).zip(specs) {
                    steps.push(Step::Send(Request::Channel { channel, spec }));
                }
                steps.extend(groups.map(Step::Send));
                steps.extend(joint.map(|j| Step::Send(Request::Joint(j))));
                steps.extend(wall.map(|w| Step::Send(Request::Wall(w))));
                steps.extend(lift.map(|l| Step::Send(Request::Modulation(l))));
                if let Some(arm) = arm {
                    steps.push(Step::Send(arm));
                    steps.push(Step::Send(line(3, 0)));
                }
                steps.push(Step::Send(ARM));
                steps.push(Step::Wait(24_000));
                steps.push(Step::Send(Request::Start));
                steps.push(Step::Send(amplitudes));
                steps
            },
        )
}
