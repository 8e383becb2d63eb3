//! Requests of an arm, and their results at arming. Channel 0 stimulates the biceps.

use crate::bad_input::bench::{Bench, LIMIT, joint};
use crate::bad_input::table::{Row, all, field, refused, row};
use firmware::bench::limb::{before_the_trunk, nominal_limb};
use firmware::control::{
    Endpoint, EndpointSpec, EndpointState, ForceImpossible, PostureSpec, SensorSource, WrenchError,
};
use firmware::limb::LineSpec;
use firmware::link::{Code, Request};
use firmware::units::{Amplitude, Micros};
use tests::desk;

fn spec() -> EndpointSpec {
    let limb = nominal_limb();
    EndpointSpec {
        offsets_um: limb.offsets_um,
        ranges_mdeg: limb.ranges_mdeg,
        recruit_ms: 5,
        posture: PostureSpec::Fixed(before_the_trunk().map(|angle| angle.to_centideg())),
    }
}

fn biceps() -> LineSpec {
    LineSpec {
        threshold: Amplitude::new(1_000),
        limit: LIMIT,
        ..nominal_limb().lines[0].clone()
    }
}

fn wrench(force_mn: [i32; 3]) -> Request {
    Request::Wrench { at: None, force_mn }
}

const TOO_STRONG: [i32; 3] = [0, 0, 1_000_000];

/// Returns the feasible share of that force, in thousandths.
fn share() -> i32 {
    let endpoint = Endpoint::new(&spec(), &[biceps()].into_iter().collect()).unwrap();
    let (mut state, now) = (EndpointState::default(), Micros::new(0));
    match endpoint.accept_force(&mut state, now, now, TOO_STRONG) {
        Err(WrenchError::Unmade(ForceImpossible::TooStrong { permille, .. })) => permille.into(),
        other => panic!("{other:?}"),
    }
}

fn draft() -> Bench {
    Bench::draft().after_requests([Request::Line(biceps())])
}

fn armed() -> Bench {
    draft().after_requests([Request::Limb(spec())]).arm()
}

fn measured() -> Bench {
    let posture = PostureSpec::Measured {
        stale_after_ms: 100,
    };
    draft()
        .after_requests([Request::Limb(EndpointSpec { posture, ..spec() })])
        .arm()
}

fn beside() -> Bench {
    let joint = Request::Joint(joint(SensorSource::Host));
    draft().after_requests([Request::Limb(spec()), joint])
}

#[rustfmt::skip]
pub fn rows() -> Vec<Row> {
    let bones = |name, min, max| field(Bench::draft, name, min, max);
    let line = |name, min, max| field(Bench::draft, name, min, max).on(1);
    let mut rows = all([
        bones("recruit_ms", 5, 50).rows(|v| {
            Some(Request::Limb(EndpointSpec { recruit_ms: v.try_into().ok()?, ..spec() }))
        }),
        bones("stale_after_ms", 2, 500).rows(|v| {
            let posture = PostureSpec::Measured { stale_after_ms: v.try_into().ok()? };
            Some(Request::Limb(EndpointSpec { posture, ..spec() }))
        }),
        line("gain_mn_per_ma", 1, 100_000_000).rows(|v| {
            Some(Request::Line(LineSpec { gain_mn_per_ma: v.try_into().ok()?, ..biceps() }))
        }),
        field(armed, "force_mn", -1_000_000, 1_000_000).rows(|v| {
            let v: i32 = v.try_into().ok()?;
            // Values within the range cause another refusal.
            (v.unsigned_abs() > 1_000_000).then(|| wrench([0, 0, v]))
        }),
    ]);
    rows.extend([
        row("a line alone", draft, desk::ARM, refused(Code::NoLimb, "limb")),
        row("an arm beside a joint", beside, desk::ARM, refused(Code::JointAndLimb, "limb")),
        row("a force without an arm", Bench::armed, wrench([0; 3]), refused(Code::NoLimb, "limb")),
        row("a force before the posture", measured, wrench([0; 3]), refused(Code::NoPosture, "sc_protraction")),
        row("a force that is too strong", armed, wrench(TOO_STRONG), refused(Code::WrenchOutOfReach, "force_mn").on(1).allowed(0, share())),
        row("a force that no muscle makes", armed, wrench([0, 0, -5_000]), refused(Code::NoMuscleHelps, "force_mn")),
    ]);
    rows
}
