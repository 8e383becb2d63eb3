//! Timed amplitude orders.

use crate::bad_input::bench::{Bench, LIMIT};
use crate::bad_input::table::{Expect, Row, dynamic_row, refused};
use firmware::link::{Code, Request};
use firmware::safety::MAX_TIMED;
use firmware::units::{Amplitude, us};

/// Returns an order of channel 1's amplitude from `ahead` µs after the device's present time on.
fn timed(bench: &mut Bench, ahead: i32, ua: u32) -> Request {
    Request::Amplitudes {
        at: Some(bench.now() + us(ahead.cast_unsigned())),
        mask: 1,
        values: [Amplitude::new(ua)].into_iter().collect(),
        widths: Default::default(),
    }
}

fn timed_row(name: &str, scene: fn() -> Bench, ahead: i32, ua: u32, expect: Expect) -> Row {
    let request = move |bench: &mut Bench| timed(bench, ahead, ua);
    dynamic_row(name, scene, request, expect)
}

/// Sends `count` timed orders, none of them due within half a second.
fn waiting(count: usize) -> Bench {
    let mut bench = Bench::armed();
    for n in 0..count as i32 {
        let order = timed(&mut bench, 600_000 + 10_000 * n, 1_000);
        bench = bench.after_requests([order]);
    }
    bench
}

#[rustfmt::skip]
pub fn rows() -> Vec<Row> {
    let far = || refused(Code::TooFarAhead, "at").allowed(0, 1_000_000);
    let above = || refused(Code::AboveWearerLimit, "values").on(1).allowed(0, 20_000);
    let full = || refused(Code::TooManyWaiting, "at").allowed(0, 16);
    let (top, over) = (LIMIT.get(), LIMIT.get() + 1);
    vec![
        timed_row("timed, before arming", Bench::draft, 100_000, 0, refused(Code::NotArmed, "state")),
        // Some milliseconds pass before the window that judges the order; the device's own tests
        // cover the exact microsecond.
        timed_row("timed, 1 s ahead", Bench::armed, 1_000_000, top, Expect::Done),
        timed_row("timed, 1.01 s ahead", Bench::armed, 1_010_000, top, far()),
        timed_row("timed, half the clock ahead", Bench::armed, i32::MAX, top, far()),
        timed_row("timed, half the clock old", Bench::armed, i32::MIN + 1_000_000, top, Expect::Done),
        timed_row("timed, now", Bench::stimulating, 0, top, Expect::Done),
        timed_row("timed, late and above the limit", Bench::stimulating, -1_000, over, above()),
        timed_row("timed, above the limit", Bench::stimulating, 100_000, over, above()),
        timed_row("timed, one may wait more", || waiting(MAX_TIMED - 1), 900_000, top, Expect::Done),
        timed_row("timed, as many wait as may", || waiting(MAX_TIMED), 900_000, top, full()),
    ]
}
