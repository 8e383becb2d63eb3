//! Requests of joints whose stimulation follows their angles, and of the held object. Channel 0
//! flexes an elbow, channel 1 extends it.

use crate::bad_input::bench::{Bench, LIMIT, joint};
use crate::bad_input::table::{Edit, Expect, Row, all, edit, field, refused, row};
use firmware::control::SensorSource;
use firmware::haptics::{Form, ModulatedSpec, ModulationSpec, QuarticSpec};
use firmware::link::{Code, Request};
use firmware::units::Amplitude;
use tests::desk;

/// Quartic with its peak of a half at half of the range.
const PEAK: QuarticSpec = QuarticSpec([0, 250_000, 1_000_000, 250_000, 0]);

fn spec() -> ModulationSpec {
    let muscle = |channel| ModulatedSpec {
        channel,
        base: LIMIT,
        form: Form::AboveThreshold {
            threshold: Amplitude::new(1_000),
        },
        lift: Some(PEAK),
        drop: None,
    };
    ModulationSpec {
        joint: 0,
        phase_joint: 0,
        dead_band_centideg_per_s: 800,
        cutoff_mhz: 2_000,
        angle_min_mdeg: 0,
        angle_max_mdeg: 140_000,
        stale_after_ms: 500,
        max_hold_ms: 100,
        flexor: muscle(0),
        extensor: muscle(1),
    }
}

fn modulation(edit: impl FnOnce(&mut ModulationSpec)) -> Request {
    let mut spec = spec();
    edit(&mut spec);
    Request::Modulation(spec)
}

const HELD: Request = Request::ObjectHeld { held: true };

fn draft() -> Bench {
    Bench::draft().after_requests([Request::Modulation(spec())])
}

fn armed() -> Bench {
    draft().arm()
}

/// Holds the object from before the start for longer than allowed.
fn held_too_long() -> Bench {
    let mut bench = armed();
    let at = bench.now();
    let angle = Request::Measurement {
        joint: 0,
        centideg: 7_000,
        at,
    };
    let mut bench = bench.after_requests([angle, HELD, Request::Start]);
    bench.wait(150_000);
    bench
}

fn beside() -> Bench {
    draft().after_requests([Request::Joint(joint(SensorSource::Host))])
}

/// Exceeds the limit at one angle only, by half of 2 µA.
fn above_at_one_angle() -> Bench {
    Bench::draft().after_requests([modulation(|spec| {
        let base = Amplitude::new(2 * LIMIT.get() + 2);
        (spec.flexor.base, spec.flexor.form) = (base, Form::Scaled);
    })])
}

fn without_elbow() -> Bench {
    Bench::draft().after_requests([modulation(|spec| (spec.joint, spec.phase_joint) = (3, 2))])
}

fn on_one_channel() -> Bench {
    draft().after_requests([modulation(|spec| {
        (spec.joint, spec.flexor.channel, spec.extensor.channel) = (1, 2, 0);
    })])
}

fn on_no_channel() -> Bench {
    Bench::draft().after_requests([modulation(|spec| spec.extensor.channel = 9)])
}

/// Returns rows of a field that `edit` sets, if it can hold the number.
fn rows_of(name: &'static str, min: i32, max: i32, edit: Edit<ModulationSpec>) -> Vec<Row> {
    field(Bench::draft, name, min, max).edits(spec, edit, Request::Modulation)
}

#[rustfmt::skip]
pub fn rows() -> Vec<Row> {
    let ten = |share: [i32; 5]| modulation(|spec| spec.flexor.lift = Some(QuarticSpec(share)));
    let mut rows = all([
        rows_of("joint", 0, 3, edit!(s, v => s.joint = v.try_into().ok()?)),
        rows_of("phase_joint", 0, 3, edit!(s, v => s.phase_joint = v.try_into().ok()?)),
        rows_of("dead_band_centideg_per_s", 10, 20_000, edit!(s, v => s.dead_band_centideg_per_s = v.try_into().ok()?)),
        rows_of("cutoff_mhz", 500, 20_000, edit!(s, v => s.cutoff_mhz = v.try_into().ok()?)),
        rows_of("angle_max_mdeg", 1, 180_000, edit!(s, v => s.angle_max_mdeg = v.try_into().ok()?)),
        rows_of("stale_after_ms", 2, 500, edit!(s, v => s.stale_after_ms = v.try_into().ok()?)),
        rows_of("max_hold_ms", 100, 600_000, edit!(s, v => s.max_hold_ms = v.try_into().ok()?)),
        rows_of("channel", 0, 9, edit!(s, v => {
            s.flexor.channel = v.try_into().ok()?;
            s.extensor.channel = u8::from(v == 0); // a different channel
        })),
        rows_of("base", 1, 200_000, edit!(s, v => {
            (s.flexor.base, s.flexor.form) = (Amplitude::new(v.try_into().ok()?), Form::Scaled);
        })),
        rows_of("threshold", 0, 19_999, edit!(s, v => {
            s.flexor.form = Form::AboveThreshold { threshold: Amplitude::new(v.try_into().ok()?) };
        })),
    ]);
    rows.extend([
        row("a share above 1 at its end", Bench::draft, ten([0, 0, 0, 0, 1_000_001]), refused(Code::ShareLimit, "lift").on(1).allowed(1_000_001, 1_000_000)),
        row("a share below 0 at one angle", Bench::draft, ten([4_000, -4_040, 4_000, -4_040, 4_000]), refused(Code::ShareLimit, "lift").on(1).allowed(-20, 0)),
        row("coefficients of no share", Bench::draft, ten([0, 0, 8_000_001, 0, 0]), refused(Code::OutOfRange, "lift").allowed(-8_000_000, 8_000_000)),
        row("one channel of both muscles", Bench::draft, modulation(|s| s.extensor.channel = 0), refused(Code::ChannelTwice, "modulation").on(1)),
        row("a peak above the limit", above_at_one_angle, desk::ARM, refused(Code::AboveWearerLimit, "lift").on(1).allowed(0, 20_000)),
        row("a shoulder without its elbow", without_elbow, desk::ARM, refused(Code::NoPhaseJoint, "phase_joint").allowed(2, 2)),
        row("one channel of two joints", on_one_channel, desk::ARM, refused(Code::ChannelTwice, "modulation").on(1)),
        row("a channel without a train", on_no_channel, desk::ARM, refused(Code::NoTrain, "modulation").on(10)),
        row("beside a joint", beside, desk::ARM, refused(Code::JointAndModulation, "modulation")),
        row("held, and nothing is modulated", Bench::armed, HELD, refused(Code::NoModulation, "modulation")),
        row("held without an angle", armed, HELD, refused(Code::NoAngle, "joint").allowed(0, 0)),
        row("released without an angle", armed, Request::ObjectHeld { held: false }, Expect::Done),
        row("held before arming", draft, HELD, refused(Code::NotArmed, "state")),
        row("held for too long", held_too_long, HELD, refused(Code::HoldExpired, "held")),
    ]);
    rows
}
