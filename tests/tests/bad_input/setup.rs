//! Configuring requests: wearer, channels, groups, sync, muscles.

use crate::bad_input::bench::{Bench, channel};
use crate::bad_input::table::{self, Expect, Field, Row, all, refused, row};
use firmware::link::{Code, Request};
use firmware::muscle::{CalciumForceSpec, FatigueSpec, MuscleLevel, MuscleSpec, RecruitmentSpec};
use firmware::pulse::{GroupSpec, Partner, Shape};
use firmware::safety::{ChannelSpec, StageSpec};
use firmware::units::Amplitude;
use tests::desk;

pub fn rows() -> Vec<Row> {
    all([
        wearer_rows(),
        train_rows(),
        stage_rows(),
        channel_rows(),
        group_rows(),
        muscle_rows(),
        sync_rows(),
    ])
}

fn field(name: &'static str, min: i32, max: i32) -> Field {
    table::field(Bench::draft, name, min, max)
}

fn on_channel_1(name: &'static str, min: i32, max: i32) -> Field {
    field(name, min, max).on(1)
}

fn wearer_rows() -> Vec<Row> {
    /// Sets one field from a number that may exceed the field's type.
    macro_rules! set {
        ($field:ident) => {
            |v: i64| {
                let mut spec = desk::wearer(1_000);
                spec.$field = v.try_into().ok()?;
                Some(Request::Wearer(spec))
            }
        };
    }
    all([
        field("max_current_ua", 100, 100_000).rows(set!(max_current_ua)),
        field("max_charge_nc", 1, 40_000).rows(set!(max_charge_nc)),
        field("max_rms_ua", 10, 50_000).rows(set!(max_rms_ua)),
        field("rise_ms", 1, 5_000).rows(set!(rise_ms)),
        field("fall_ms", 5, 100).rows(set!(fall_ms)),
        field("host_timeout_ms", 20, 1_000).rows(set!(host_timeout_ms)),
        field("max_sum_ua", 100, 200_000).rows(set!(max_sum_ua)),
        field("max_sum_rms_ua", 10, 50_000).rows(set!(max_sum_rms_ua)),
        field("return_area_mm2", 10, 40_000).rows(set!(return_area_mm2)),
        field("rise_bursts", 1, 1_000).rows(set!(rise_bursts)),
        field("max_session_s", 1, 86_400).rows(set!(max_session_s)),
        field("max_dose_mc", 1, 4_320_000).rows(set!(max_dose_mc)),
        field("max_step_ua", 10, 100_000).rows(set!(max_step_ua)),
        field("max_step_ua_per_s", 10, 100_000).rows(set!(max_step_ua_per_s)),
    ])
}

/// Returns a channel far below every limit of the wearer.
fn faint() -> ChannelSpec {
    let mut spec = channel(0);
    spec.limit = Amplitude::new(1_000);
    spec.train.width_us = 10;
    spec.train.gap_us = 0;
    spec.train.period_us = 2_000_000;
    spec
}

fn monophasic() -> ChannelSpec {
    let mut spec = faint();
    spec.train.shape = Shape::MonophasicCathodic;
    spec.train.ground_us = 1_000;
    spec
}

fn on_first(spec: ChannelSpec) -> Request {
    Request::Channel { channel: 0, spec }
}

fn train_rows() -> Vec<Row> {
    macro_rules! set {
        ($base:expr, $field:ident) => {
            |v: i64| {
                let mut spec = $base;
                spec.train.$field = v.try_into().ok()?;
                Some(on_first(spec))
            }
        };
    }
    let burst = || {
        let mut spec = faint();
        (spec.train.burst_count, spec.train.burst_interval_us) = (2, 2_000);
        spec
    };
    let count = |v: i64| {
        let mut spec = faint();
        spec.train.burst_count = v.try_into().ok()?;
        spec.train.burst_interval_us = if v > 1 { 2_000 } else { 0 };
        Some(on_first(spec))
    };
    all([
        on_channel_1("width_us", 10, 500).rows(set!(faint(), width_us)),
        on_channel_1("gap_us", 0, 200).rows(set!(faint(), gap_us)),
        on_channel_1("gap_us", 0, 0).rows(set!(monophasic(), gap_us)),
        on_channel_1("ground_us", 1_000, 20_000).rows(set!(faint(), ground_us)),
        on_channel_1("ground_us", 1_000, 20_000).rows(set!(monophasic(), ground_us)),
        on_channel_1("period_us", 5_000, 2_000_000).rows(set!(faint(), period_us)),
        on_channel_1("offset_us", 0, 20_000).rows(set!(channel(0), offset_us)),
        on_channel_1("burst_count", 1, 8).rows(count),
        on_channel_1("burst_interval_us", 200, 50_000).rows(set!(burst(), burst_interval_us)),
        on_channel_1("burst_interval_us", 0, 0).rows(set!(faint(), burst_interval_us)),
        on_channel_1("repeats", 0, 65_535).rows(set!(faint(), repeats)),
    ])
}

#[rustfmt::skip]
fn stage_rows() -> Vec<Row> {
    let current = |v: i64| {
        let full_scale_ua = v.try_into().ok()?;
        let stage = StageSpec::Current { full_scale_ua };
        Some(on_first(ChannelSpec { stage, ..faint() }))
    };
    let voltage = |full_scale_mv, load_ohm| {
        let stage = StageSpec::Voltage { full_scale_mv, load_ohm };
        on_first(ChannelSpec { stage, ..faint() })
    };
    let volts = |v: i64| Some(voltage(v.try_into().ok()?, 2_000));
    let load = |v: i64| Some(voltage(60_000, v.try_into().ok()?));
    let limit = |v: i64| {
        let limit = Amplitude::new(v.try_into().ok()?);
        Some(on_first(ChannelSpec { limit, ..faint() }))
    };
    let area = |v: i64| {
        let area_mm2 = v.try_into().ok()?;
        Some(on_first(ChannelSpec { area_mm2, ..faint() }))
    };
    all([
        on_channel_1("full_scale_ua", 1_000, 100_000).rows(current),
        on_channel_1("full_scale_mv", 1_000, 150_000).rows(volts),
        on_channel_1("load_ohm", 200, 100_000).rows(load),
        on_channel_1("limit", 1, 100_000).rows(limit),
        on_channel_1("area_mm2", 10, 20_000).rows(area),
    ])
}

#[rustfmt::skip]
fn channel_rows() -> Vec<Row> {
    let at = |v: i64| {
        let channel = v.try_into().ok()?;
        let spec = faint();
        Some(Request::Channel { channel, spec })
    };
    let edited = |edit: fn(&mut ChannelSpec)| {
        let mut spec = channel(0);
        edit(&mut spec);
        on_first(spec)
    };
    let refusal = |name, edit, code, field, min, max| {
        let expect = refused(code, field).on(1).allowed(min, max);
        row(name, Bench::draft, edited(edit), expect)
    };
    // The burst's pulses take 2 · 200 + 100 µs and 5 µs of dead time.
    let close = |s: &mut ChannelSpec| (s.train.burst_count, s.train.burst_interval_us) = (3, 504);
    // 7 · 2500 + 500 µs and two windows of 250 µs.
    let long = |s: &mut ChannelSpec| {
        (s.train.burst_count, s.train.burst_interval_us) = (8, 2_500);
        s.train.period_us = 18_499;
    };
    let volts = |s: &mut ChannelSpec| {
        s.stage = StageSpec::Voltage { full_scale_mv: 60_000, load_ohm: 2_000 };
        s.limit = Amplitude::new(40_001);
    };
    let charge = |s: &mut ChannelSpec| (s.limit, s.train.width_us) = (Amplitude::new(80_001), 500);
    let rms = |s: &mut ChannelSpec| {
        (s.limit, s.train.width_us) = (Amplitude::new(80_000), 500);
        (s.train.burst_count, s.train.burst_interval_us) = (8, 1_200);
    };
    let mut rows = field("channel", 0, 9).rows(at);
    rows.extend([
        refusal("burst overlaps", close, Code::BurstOverlaps, "burst_interval_us", 505, 50_000),
        refusal("burst too long", long, Code::BurstTooLong, "period_us", 18_500, 2_000_000),
        refusal("40.001 V into 2 kΩ", volts, Code::CurrentLimit, "limit", 0, 20_000),
        refusal("80.001 mA for 500 µs", charge, Code::ChargeLimit, "limit", 0, 40_000),
        refusal("50.6 mA rms", rms, Code::RmsLimit, "limit", 0, 50_000),
        refusal("2.8 mA rms under 1 cm²", |s| s.area_mm2 = 100, Code::DensityLimit, "area_mm2", 0, 2_000),
    ]);
    rows
}

/// Configures three trains after `edit`, and `groups` of them.
fn grouped(groups: &[(u16, Partner)], edit: fn(&mut [ChannelSpec; 3])) -> Bench {
    let mut specs = [channel(0), channel(1_500), channel(3_000)];
    edit(&mut specs);
    let spec = |&(members, partner)| GroupSpec { members, partner };
    let groups = Request::Groups(groups.iter().map(spec).collect());
    let channels = (0..).zip(specs);
    let channels = channels.map(|(channel, spec)| Request::Channel { channel, spec });
    Bench::draft()
        .after_requests(channels)
        .after_requests([groups])
}

fn long_to_ground() -> Bench {
    grouped(&[(0b011, Partner::Isolated)], |s| {
        s[0].train.shape = Shape::MonophasicCathodic;
        (s[0].train.gap_us, s[0].train.ground_us) = (0, 10_000);
        s[1].train.offset_us = 10_000;
    })
}

/// Returns rows on groups, which are checked on arrival, and together with their trains at arming.
#[rustfmt::skip]
fn group_rows() -> Vec<Row> {
    use Partner::{Conducted, Isolated};
    let arm = |name, scene, expect| row(name, scene, desk::ARM, expect);
    let groups = |name, masks: &[u16], expect| {
        let spec = |&members| GroupSpec { members, partner: Conducted };
        let groups = masks.iter().map(spec).collect();
        row(name, Bench::draft, Request::Groups(groups), expect)
    };
    let members = || refused(Code::OutOfRange, "members");
    vec![
        arm("conducted pair", || grouped(&[(0b11, Conducted)], |_| ()), Expect::Done),
        arm("isolated trio", || grouped(&[(0b111, Isolated)], |_| ()), Expect::Done),
        groups("no member", &[0], refused(Code::OutOfRange, "number of members").allowed(2, 10)),
        groups("a lone member", &[0b100], refused(Code::OutOfRange, "number of members").allowed(2, 10)),
        groups("an eleventh channel", &[1 << 10 | 1], members().allowed(0, 1023)),
        arm("a member without a train", || grouped(&[(0b1001, Conducted)], |_| ()), refused(Code::NoTrain, "groups").on(4)),
        groups("a member of two groups", &[0b011, 0b110], refused(Code::TwoGroups, "groups").on(2)),
        arm("isolated and overlapping", || grouped(&[(0b011, Isolated)], |s| s[1].train.offset_us = 499), refused(Code::IsolationOverlaps, "groups").on(1)),
        arm("isolated too long to ground", long_to_ground, refused(Code::NoTimeToGround, "groups").on(1)),
    ]
}

fn sync_of_none() -> Bench {
    Bench::draft().after_requests([Request::Sync { channel: Some(7) }])
}

#[rustfmt::skip]
fn sync_rows() -> Vec<Row> {
    let some = |v: i64| {
        let channel = Some(v.try_into().ok()?);
        Some(Request::Sync { channel })
    };
    let mut rows = field("channel", 0, 9).rows(some);
    rows.push(row("no sync", Bench::draft, Request::Sync { channel: None }, Expect::Done));
    rows.push(row("sync on a channel without a train", sync_of_none, desk::ARM, refused(Code::NoTrain, "sync").on(8)));
    rows
}

const FORCE: CalciumForceSpec = CalciumForceSpec {
    a_mn_per_s: 265_100,
    k_micro: 200_000,
    tau_c_us: 20_000,
    tau1_us: 50_500,
    tau2_us: 100_000,
};

const RECRUITMENT: RecruitmentSpec = RecruitmentSpec {
    motor_threshold: Amplitude::new(5_000),
    limit: Amplitude::new(10_000),
    reference: Amplitude::new(15_000),
    slope_micro: 300_000,
};

/// Muscle that the device accepts.
pub const MUSCLE: MuscleSpec = MuscleSpec::new(FORCE, RECRUITMENT);

fn slow_calcium() -> Bench {
    let mut bursts = channel(0);
    (bursts.train.burst_count, bursts.train.burst_interval_us) = (8, 1_000);
    let mut slow = FORCE;
    slow.tau_c_us = 60_000;
    let spec = MuscleSpec::new(slow, RECRUITMENT);
    Bench::draft().after_requests([on_first(bursts), Request::Muscle { channel: 0, spec }])
}

#[rustfmt::skip]
fn muscle_rows() -> Vec<Row> {
    let request = |channel, force, recruitment| Request::Muscle {
        channel,
        spec: MuscleSpec {
            fatigue: Some(FatigueSpec::QUADRICEPS),
            level: MuscleLevel::CalciumForceFatigue,
            ..MuscleSpec::new(force, recruitment)
        },
    };
    macro_rules! tires {
        ($field:ident) => {
            |v: i64| {
                let mut fatigue = FatigueSpec::QUADRICEPS;
                fatigue.$field = v.try_into().ok()?;
                let spec = MuscleSpec { fatigue: Some(fatigue), ..MuscleSpec::new(FORCE, RECRUITMENT) };
                Some(Request::Muscle { channel: 0, spec })
            }
        };
    }
    macro_rules! force {
        ($field:ident) => {
            |v: i64| {
                let mut spec = FORCE;
                spec.$field = v.try_into().ok()?;
                Some(request(0, spec, RECRUITMENT))
            }
        };
    }
    let recruits = |edit: fn(&mut RecruitmentSpec, u32)| {
        move |v: i64| {
            let mut spec = RECRUITMENT;
            edit(&mut spec, v.try_into().ok()?);
            Some(request(0, FORCE, spec))
        }
    };
    // Limit and reference must exceed the highest threshold.
    let threshold = recruits(|s, v| {
        s.motor_threshold = Amplitude::new(v);
        s.slope_micro = 10_000;
        (s.limit, s.reference) = (Amplitude::new(1_000_000), Amplitude::new(1_000_000));
    });
    let limit = recruits(|s, v| {
        s.slope_micro = 10_000;
        (s.limit, s.reference) = (Amplitude::new(v), Amplitude::new(1_000_000));
    });
    let reference = recruits(|s, v| (s.slope_micro, s.reference) = (10_000, Amplitude::new(v)));
    let slope = recruits(|s, v| s.slope_micro = v);
    let gentle = recruits(|s, v| (s.slope_micro, s.reference) = (v, Amplitude::new(10_000)));
    let at = |v: i64| Some(request(v.try_into().ok()?, FORCE, RECRUITMENT));
    all([
        field("channel", 0, 9).rows(at),
        on_channel_1("a_mn_per_s", 100, 10_000_000).rows(force!(a_mn_per_s)),
        on_channel_1("k_micro", 2_000, 5_000_000).rows(force!(k_micro)),
        on_channel_1("tau_c_us", 5_000, 100_000).rows(force!(tau_c_us)),
        on_channel_1("tau1_us", 2_000, 200_000).rows(force!(tau1_us)),
        on_channel_1("tau2_us", 1_000, 1_000_000).rows(force!(tau2_us)),
        on_channel_1("alpha_a_milli_per_s2", 0, 10_000).rows(tires!(alpha_a_milli_per_s2)),
        on_channel_1("alpha_k_nano_per_n_s", 0, 100_000_000).rows(tires!(alpha_k_nano_per_n_s)),
        on_channel_1("alpha_tau1_nano_per_n", 0, 100_000_000).rows(tires!(alpha_tau1_nano_per_n)),
        on_channel_1("tau_fat_ms", 10_000, 1_000_000).rows(tires!(tau_fat_ms)),
        on_channel_1("motor_threshold", 1, 999_999).rows(threshold),
        on_channel_1("limit", 5_001, 1_000_000).rows(limit),
        on_channel_1("reference", 10_000, 1_000_000).rows(reference),
        // 16 octaves over the 10 and 5 mA from threshold to reference.
        on_channel_1("slope_micro", 10_000, 1_109_035).rows(slope),
        on_channel_1("slope_micro", 10_000, 2_218_070).rows(gentle),
        // 20 ms / ln(24/(24 − 8)).
        vec![row(
            "a muscle whose calcium bursts would carry past 24 pulses",
            slow_calcium, desk::ARM, refused(Code::OutOfRange, "tau_c_us").on(1).allowed(5_000, 49_320),
        )],
    ])
}
