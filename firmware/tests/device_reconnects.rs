//! Hosts that disconnect and reconnect: a new host does not inherit earlier orders.

use crate::device_desk::*;
use firmware::link::{Request, SCHEMA};
use firmware::safety::State;
use firmware::units::Micros;

const BOOT: Micros = Micros::new(u32::MAX - 100_000);

/// Hosts that connect, stay away longer than any silence, and connect again, in every state.
/// Nothing is driven after the old host's silence has ended stimulation, whatever the new host
/// requests, except arming.
#[test]
fn whoever_connects_again_puts_nothing_out_in_any_state() {
    type Reach = fn(&mut TestHost);
    let arm: Reach = |desk| {
        desk.prepare(wearer(), &[channel(PLAIN)]);
        desk.expect_ok(ARM);
    };
    let start: Reach = |desk| desk.run(wearer(), &[channel(PLAIN)], 5_000);
    let fault: Reach = |desk| {
        desk.run(wearer(), &[channel(PLAIN)], 5_000);
        desk.sensors.over_current = true;
        desk.wait(1_000);
        desk.sensors.over_current = false;
    };
    let states: [(State, Reach); 5] = [
        (State::Idle, |_| ()),
        (State::Armed, arm),
        (State::Stimulating, start),
        (State::Stopping, |desk| {
            desk.run(wearer(), &[channel(PLAIN)], 5_000);
            desk.expect_ok(Request::Stop);
        }),
        (State::Fault, fault),
    ];
    for (state, reach) in states {
        let mut desk = TestHost::open(BOOT);
        reach(&mut desk);
        assert_eq!(desk.state(), state);
        let silence_ms = wearer().host_timeout_ms + wearer().fall_ms;
        desk.wait(1_000 * u32::from(silence_ms) + 1_000);
        let since = desk.since_boot_us();
        for _ in 0..3 {
            // Refused where the session of another host continues.
            let heard = desk.exchange(Request::Hello { schema: SCHEMA });
            if let Some(OwnedResponse::Hello(info)) = heard.first() {
                desk.session = info.session;
            }
            for request in [
                Request::KeepAlive,
                equal_amplitudes(1, 15_000),
                Request::Start,
                Request::Status,
                Request::Subscribe { period_ms: 10 },
            ] {
                // From another host and from the owner; an armed board starts only for the owner.
                let stranger = desk.session.wrapping_add(7);
                let own = std::mem::replace(&mut desk.session, stranger);
                assert!(desk.answer(request.clone()).is_err());
                desk.session = own;
                if request != Request::Start || state != State::Armed {
                    desk.exchange(request);
                }
                desk.wait(20_000);
            }
        }
        let driven = driven_starts(&desk.record.levels, 0);
        let late: Vec<u64> = driven.into_iter().filter(|at| *at >= since).collect();
        assert!(late.is_empty(), "{state:?}: {late:?}");
    }
}
