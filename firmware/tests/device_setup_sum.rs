//! An arm order names the checksum of its setup. Another setup is refused, and no part of it
//! stimulates.

use crate::device_desk::*;
use crate::device_fuzz::hosts::request;
use firmware::control::{ForceSpec, HoldPolicy};
use firmware::device::Draft;
use firmware::link::{Code, Request, SetupSum};
use firmware::pulse::Partner;
use firmware::safety::{State, WearerSpec};
use firmware::units::Micros;
use proptest::collection::vec;
use proptest::prelude::*;

/// Returns two channels in a group and sync, all with different settings.
fn parts() -> Vec<Request> {
    let mono = channel(MONO);
    vec![
        Request::Wearer(wearer()),
        Request::Channel {
            channel: 0,
            spec: channel(PLAIN),
        },
        Request::Channel {
            channel: 1,
            spec: mono,
        },
        group(0b11, Partner::Conducted),
        Request::Sync { channel: Some(1) },
    ]
}

fn sum<'a>(parts: impl IntoIterator<Item = &'a Request>) -> u32 {
    let mut sum = SetupSum::default();
    for part in parts {
        sum.note(part);
    }
    sum.total()
}

/// Expects a refusal by number and name. Nothing is emitted, and the checksum of the device's setup
/// arms it afterwards.
fn expect_setup_refused(desk: &mut TestHost, setup: u32) {
    let before = desk.record.levels.len();
    let refused = desk.expect_refusal(Request::Arm { setup });
    assert_eq!(refused, refusal(Code::OtherSetup, "setup"));
    assert_eq!(desk.refusal_code(Request::Start), Some(Code::WrongState));
    desk.wait(50_000);
    assert_eq!(desk.state(), State::Idle);
    assert_eq!(desk.record.levels.len(), before, "something was put out");
}

#[test]
fn the_sum_of_an_older_setup_arms_nothing() {
    let mut desk = TestHost::open(Micros::new(0));
    desk.expect_all_ok(parts());
    let older = sum(&parts());
    desk.expect_ok(Request::Arm { setup: older });
    desk.expect_ok(Request::Stop);
    desk.wait(1_000);
    // Sends one request that is unknown to the host of `older`.
    desk.expect_ok(Request::Channel {
        channel: 1,
        spec: channel(PLAIN),
    });
    expect_setup_refused(&mut desk, older);
    desk.expect_ok(ARM);
}

#[test]
fn every_request_between_two_arm_orders_is_noticed() {
    let narrow = WearerSpec {
        rise_ms: 7,
        ..wearer()
    };
    let changes = [
        Request::Clear,
        Request::Wearer(narrow),
        Request::Groups(heapless::Vec::new()),
        Request::Sync { channel: None },
        joint(0, 1, 1_000, 2_000),
    ];
    for change in changes {
        let mut desk = TestHost::open(Micros::new(0));
        desk.expect_all_ok(parts());
        desk.expect_ok(change.clone());
        if change == Request::Clear {
            desk.expect_all_ok(parts().into_iter().skip(1));
        }
        expect_setup_refused(&mut desk, sum(&parts()));
        // The request that undoes the change restores the checksum.
        desk.expect_ok(Request::Clear);
        desk.expect_all_ok(parts().into_iter().rev());
        desk.expect_ok(Request::Arm {
            setup: sum(&parts()),
        });
    }
}

#[test]
fn what_stands_anyway_adds_nothing() {
    let silent = [
        Request::Wearer(WearerSpec::default()),
        Request::Groups(heapless::Vec::new()),
        Request::Sync { channel: None },
        Request::KeepAlive,
        Request::Start,
    ];
    assert_eq!(sum(&silent), sum([]));
    assert_eq!(Draft::default().checksum(), sum([]));
    assert_eq!(sum(parts().iter().chain(&[Request::Clear])), sum([]));
}

/// Generates configuring requests, valid or not.
fn part() -> impl Strategy<Value = Request> {
    let force =
        (0u8..10, 5_000u32..2_000_000).prop_map(|(channel, period)| Request::ForceControl {
            channel,
            spec: ForceSpec {
                min_period_us: period,
                hold: HoldPolicy::Hold,
                max_period_us: None,
            },
        });
    let configures = |request: &Request| sum([request]) != sum([]);
    prop_oneof![1 => force, 5 => request().prop_filter("configures", configures)]
}

fn encoded(request: &Request) -> Vec<u8> {
    let mut buffer = [0; 384];
    postcard::to_slice(request, &mut buffer).unwrap().to_vec()
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, ..ProptestConfig::default() })]

    /// A change of any bit in any part changes the checksum.
    #[test]
    fn every_bit_of_every_part_counts(
        others in vec(part(), 0..6),
        part in part(),
    ) {
        let whole = sum(others.iter().chain([&part]));
        let bytes = encoded(&part);
        for bit in 0..8 * bytes.len() {
            let mut flipped = bytes.clone();
            flipped[bit / 8] ^= 1 << (bit % 8);
            let Ok((other, [])) = postcard::take_from_bytes::<Request>(&flipped) else {
                continue;
            };
            // A number may have more than one encoding.
            if other == part || other == Request::Clear {
                continue;
            }
            let found = sum(others.iter().chain([&other]));
            prop_assert_ne!(found, whole, "bit {} of {:?}: {:?}", bit, part, other);
        }
    }

    /// The device's checksum, encoded again from its stored setup, equals the host's, in any order
    /// and with any requests refused.
    #[test]
    fn the_draft_s_sum_is_the_host_s(
        sent in vec(part(), 1..12),
        swap in any::<prop::sample::Index>(),
    ) {
        let mut draft = Draft::default();
        let mut accepted: Vec<Request> = Vec::new();
        for request in &sent {
            if let Some(Ok(())) = draft.configure(request) {
                accepted.push(request.clone());
            }
        }
        prop_assert_eq!(draft.checksum(), sum(&accepted));
        // Only the last of each part counts, whatever its place among the others.
        let mut last: Vec<Request> = Vec::new();
        for request in accepted.iter().rev() {
            let is_new = |of: &Request| replaced_part(of) != replaced_part(request);
            if last.iter().all(is_new) {
                last.push(request.clone());
            }
        }
        if !last.is_empty() {
            let at = swap.index(last.len());
            last.rotate_left(at);
        }
        prop_assert_eq!(draft.checksum(), sum(&last));
    }
}

/// Returns the part that a request replaces: the same variant for the same channel.
fn replaced_part(request: &Request) -> (u8, Option<u8>) {
    let channel = match request {
        Request::Channel { channel, .. }
        | Request::Muscle { channel, .. }
        | Request::ForceControl { channel, .. } => Some(*channel),
        Request::Line(spec) => Some(spec.channel),
        _ => None,
    };
    (encoded(request)[0], channel)
}
