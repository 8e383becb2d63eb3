//! Requests of force control, and their results at arming.

use crate::bad_input::bench::{Bench, LIMIT, channel};
use crate::bad_input::setup;
use crate::bad_input::table::{Expect, Row, all, field, refused, row};
use firmware::control::{ForceControl, ForceSpec, HoldPolicy};
use firmware::link::{Code, Request};
use firmware::muscle::{MuscleSpec, Recruitment, RecruitmentSpec};
use firmware::pulse::{GroupSpec, Partner};
use firmware::units::Amplitude;
use tests::desk;

/// Force control from the channels' 50 Hz up to 100 Hz.
const FORCE: ForceSpec = ForceSpec {
    min_period_us: 10_000,
    hold: HoldPolicy::Hold,
    max_period_us: None,
};

/// Returns a muscle with the channels' limit.
fn muscle() -> MuscleSpec {
    MuscleSpec {
        recruitment: RecruitmentSpec {
            motor_threshold: Amplitude::new(10_000),
            limit: LIMIT,
            reference: LIMIT,
            slope_micro: 300_000,
        },
        ..setup::MUSCLE
    }
}

fn reach_mn() -> (u32, u32) {
    let recruitment = Recruitment::new(muscle().recruitment).unwrap();
    let control = ForceControl::new(0, &FORCE, muscle().force, recruitment, 20_000);
    control.unwrap().force_range_mn()
}

fn control(channel: u8, spec: ForceSpec) -> Request {
    Request::ForceControl { channel, spec }
}

fn force(channel: u8, millinewton: u32) -> Request {
    Request::Force {
        channel,
        at: None,
        millinewton,
        millinewton_per_s: None,
    }
}

fn draft() -> Bench {
    let spec = muscle();
    Bench::draft().after_requests([Request::Muscle { channel: 0, spec }])
}

fn controlled() -> Bench {
    draft().after_requests([control(0, FORCE)])
}

fn armed() -> Bench {
    controlled().arm()
}
#[rustfmt::skip]
pub fn rows() -> Vec<Row> {
    let first = |name, min, max| field(Bench::draft, name, min, max).on(1);
    let mut rows = all([
        field(Bench::draft, "channel", 0, 9).rows(|v| Some(control(v.try_into().ok()?, FORCE))),
        first("max_ms", 1, 1_000).rows(|v| {
            let hold = HoldPolicy::Extrapolate { max_ms: v.try_into().ok()? };
            Some(control(0, ForceSpec { hold, ..FORCE }))
        }),
        first("min_period_us", 5_000, 100_000).rows(|v| {
            Some(control(0, ForceSpec { min_period_us: v.try_into().ok()?, ..FORCE }))
        }),
        first("max_period_us", 5_000, 2_000_000).rows(|v| {
            Some(control(0, ForceSpec { max_period_us: Some(v.try_into().ok()?), ..FORCE }))
        }),
        field(armed, "millinewton_per_s", -32_767_000, 32_767_000).rows(|v| {
            let millinewton_per_s = Some(v.try_into().ok()?);
            Some(Request::Force { channel: 0, at: None, millinewton: 0, millinewton_per_s })
        }),
    ]);
    rows.extend(setpoint_rows());
    rows.extend(arm_rows());
    rows
}

#[rustfmt::skip]
fn setpoint_rows() -> [Row; 8] {
    let (least, most) = reach_mn();
    // Zero is allowed too, as "a force too weak" shows.
    let reach = || refused(Code::ForceOutOfReach, "millinewton").on(1).allowed(least.cast_signed(), most.cast_signed());
    let none = refused(Code::NoForceControl, "channel").on(2);
    let nowhere = refused(Code::OutOfRange, "channel").allowed(0, 9);
    [
        row("the most force", armed, force(0, most), Expect::Done),
        row("no force", armed, force(0, 0), Expect::Done),
        // Telemetry reports that the force is limited, and the force given.
        row("a force too weak", armed, force(0, least - 1), Expect::Done),
        row("a force beyond reach", armed, force(0, most + 1), reach()),
        row("a force beyond numbers", armed, force(0, u32::MAX), reach()),
        row("a force elsewhere", armed, force(1, 0), none),
        row("a force nowhere", armed, force(10, 0), nowhere),
        row("a force too early", controlled, force(0, 0), refused(Code::NotArmed, "state")),
    ]
}

fn no_muscle() -> Bench {
    Bench::draft().after_requests([control(0, FORCE)])
}

fn fastest(min_period_us: u32) -> Bench {
    let spec = ForceSpec {
        min_period_us,
        ..FORCE
    };
    draft().after_requests([control(0, spec)])
}

fn slowest(period_us: u32) -> Bench {
    let max_period_us = Some(period_us);
    let spec = ForceSpec {
        max_period_us,
        ..FORCE
    };
    draft().after_requests([control(0, spec)])
}

fn isolated() -> Bench {
    let (channel, spec) = (1, channel(10_000));
    let (members, partner) = (0b11, Partner::Isolated);
    let groups = [GroupSpec { members, partner }].into_iter().collect();
    controlled().after_requests([Request::Channel { channel, spec }, Request::Groups(groups)])
}

fn isolated_falling() -> Bench {
    let spec = ForceSpec {
        min_period_us: 20_000,
        max_period_us: Some(2_000_000),
        ..FORCE
    };
    isolated().after_requests([control(0, spec)])
}
/// Returns rows on rules that need the whole setup, which arming checks.
#[rustfmt::skip]
fn arm_rows() -> [Row; 7] {
    let arm = |name, scene, expect| row(name, scene, desk::ARM, expect);
    let rate = || refused(Code::RateChanges, "groups").on(1);
    let shortest = refused(Code::OutOfRange, "min_period_us").on(1).allowed(5_000, 20_000);
    let longest = refused(Code::OutOfRange, "max_period_us").on(1).allowed(20_000, 2_000_000);
    [
        arm("force without a muscle", no_muscle, refused(Code::NoMuscle, "muscle").on(1)),
        arm("a rate that changes in an isolated group", isolated, rate()),
        arm("a rate that falls in an isolated group", isolated_falling, rate()),
        arm("a lowest rate above the train's", || slowest(19_999), longest),
        arm("the lowest rate", || slowest(2_000_000), Expect::Done),
        arm("a rate below the train's", || fastest(20_001), shortest),
        arm("the highest rate", || fastest(5_000), Expect::Done),
    ]
}
