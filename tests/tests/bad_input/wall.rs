//! Requests of the virtual wall.

use crate::bad_input::bench::{Bench, LIMIT};
use crate::bad_input::table::{Edit, Row, all, edit, field, refused, row};
use firmware::control::SensorSource;
use firmware::haptics::{CoContraction, PreWall, Side, WallSpec};
use firmware::link::{Code, Request};
use firmware::units::Amplitude;
use tests::desk;

fn wall() -> WallSpec {
    WallSpec {
        at_mdeg: 70_000,
        side: Side::Flexion,
        channel: 0,
        max: LIMIT,
        stiffness: 2_000,
        damping: 0,
        cutoff_mhz: 6_000,
        pre_wall: Some(PRE_WALL),
        co_contraction: None,
        angle_min_mdeg: 0,
        angle_max_mdeg: 140_000,
        sensor: SensorSource::Host,
        stale_after_ms: 50,
    }
}

const PRE_WALL: PreWall = PreWall {
    depth_mdeg: 9_000,
    begin: Amplitude::new(1_000),
    end: Amplitude::new(2_000),
};

/// Returns rows of a field that `edit` sets, if it can hold the number.
fn rows_of(name: &'static str, min: i32, max: i32, edit: Edit<WallSpec>) -> Vec<Row> {
    field(Bench::draft, name, min, max).edits(wall, edit, Request::Wall)
}

#[rustfmt::skip]
pub fn rows() -> Vec<Row> {
    let mut rows = all([
        rows_of("at_mdeg", 0, 140_000, edit!(s, v => s.at_mdeg = v.try_into().ok()?)),
        rows_of("channel", 0, 9, edit!(s, v => s.channel = v.try_into().ok()?)),
        rows_of("stiffness", 1, 200_000, edit!(s, v => s.stiffness = v.try_into().ok()?)),
        rows_of("damping", 0, 20_000, edit!(s, v => s.damping = v.try_into().ok()?)),
        rows_of("cutoff_mhz", 500, 20_000, edit!(s, v => s.cutoff_mhz = v.try_into().ok()?)),
        rows_of("depth_mdeg", 100, 45_000, edit!(s, v => {
            s.pre_wall = Some(PreWall { depth_mdeg: v.try_into().ok()?, ..PRE_WALL });
        })),
        rows_of("begin", 0, 2_000, edit!(s, v => {
            s.pre_wall = Some(PreWall { begin: Amplitude::new(v.try_into().ok()?), ..PRE_WALL });
        })),
        rows_of("stale_after_ms", 2, 500, edit!(s, v => s.stale_after_ms = v.try_into().ok()?)),
    ]);
    rows.extend(whole_rows());
    rows
}

fn beside_a_joint() -> Bench {
    Bench::joint_draft().after_requests([Request::Wall(wall())])
}

fn above_the_limit() -> Bench {
    let max = Amplitude::new(LIMIT.get() + 1);
    Bench::draft().after_requests([Request::Wall(WallSpec { max, ..wall() })])
}
/// Returns rows on rules that involve other settings.
#[rustfmt::skip]
fn whole_rows() -> [Row; 3] {
    let antagonist = CoContraction { channel: 0, amplitude: Amplitude::new(1_000) };
    let twice = Request::Wall(WallSpec { co_contraction: Some(antagonist), ..wall() });
    let limit = refused(Code::AboveWearerLimit, "max").on(1).allowed(0, LIMIT.get().cast_signed());
    [
        row("its own antagonist", Bench::draft, twice, refused(Code::ChannelTwice, "wall").on(1)),
        row("a wall beside a joint", beside_a_joint, desk::ARM, refused(Code::JointAndWall, "wall").on(1)),
        row("a wall above the channel's limit", above_the_limit, desk::ARM, limit),
    ]
}
