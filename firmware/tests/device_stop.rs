//! `Stop` is never refused or delayed: requests before it become void, and requests after it are
//! judged after it.

use crate::device_desk::*;
use firmware::link::{Code, Event, Request, SCHEMA};
use firmware::safety::{State, StopCause};
use firmware::units::Micros;

const BOOT: Micros = Micros::new(u32::MAX - 300_000);

/// Stimulates on two channels and discards the responses.
fn stimulating() -> TestHost {
    let mut desk = TestHost::open(BOOT);
    desk.run(wearer(), &[channel(PLAIN); 2], 10_000);
    desk.wait(30_000);
    desk.take_messages();
    desk
}

fn armed() -> TestHost {
    let mut desk = TestHost::open(BOOT);
    desk.prepare(wearer(), &[channel(PLAIN); 2]);
    desk.expect_ok(ARM);
    desk.take_messages();
    desk
}

/// Returns the answer to request `seq`.
fn answer(heard: &[OwnedResponse], seq: u16) -> Result<Micros, Code> {
    let mut answers = heard.iter().filter_map(|h| match h {
        OwnedResponse::Ack(s, at) if *s == seq => Some(Ok(*at)),
        OwnedResponse::Refused(Some(s), code, _) if *s == seq => Some(Err(*code)),
        _ => None,
    });
    let first = answers
        .next()
        .unwrap_or_else(|| panic!("no answer to {seq}"));
    assert_eq!(answers.next(), None, "{seq} has two answers");
    first
}

/// Returns the reported start of the fall.
fn stopping(heard: &[OwnedResponse]) -> Option<Micros> {
    heard.iter().find_map(|h| match h {
        OwnedResponse::Event(at, Event::Stopping(StopCause::Request)) => Some(*at),
        _ => None,
    })
}

#[test]
fn forty_keep_alives_do_not_keep_a_stop_out() {
    let mut desk = stimulating();
    let mut requests = vec![Request::KeepAlive; 40];
    requests.push(Request::Stop);
    let numbers = desk.write(requests);
    desk.wait(1_000);
    let heard = desk.take_messages();
    assert_eq!(answer(&heard, numbers[40]).ok(), stopping(&heard));
    assert_eq!(desk.state(), State::Stopping);
    let codes = numbers.iter().filter_map(|&n| answer(&heard, n).err());
    assert_eq!(codes.collect::<Vec<_>>(), [Code::DeviceBusy; 9]);
}

#[test]
fn a_start_ahead_of_a_stop_plays_no_pulse() {
    let mut desk = armed();
    let (t, edges) = (desk.since_boot_us(), desk.record.levels.len());
    let numbers = desk.write([Request::Start, equal_amplitudes(2, 10_000), Request::Stop]);
    desk.wait(200_000);
    let heard = desk.take_messages();
    assert_eq!(answer(&heard, numbers[0]), Err(Code::Stopped));
    assert_eq!(answer(&heard, numbers[1]), Err(Code::Stopped));
    assert!(answer(&heard, numbers[2]).is_ok());
    assert_eq!(desk.state(), State::Idle);
    let after = &desk.record.levels[edges..];
    assert!(
        driven_starts(after, 0)
            .iter()
            .chain(&driven_starts(after, 1))
            .all(|&d| d < t)
    );
    assert!(desk.isolated_since().is_some());
    // It can be armed again, and nothing of the voided start remains.
    desk.expect_ok(ARM);
    desk.expect_ok(Request::Start);
    assert_eq!(desk.state(), State::Stimulating);
}

#[test]
fn orders_behind_a_stop_are_judged_after_it() {
    let mut desk = stimulating();
    let requests = [
        equal_amplitudes(2, 5_000),
        Request::Stop,
        equal_amplitudes(2, 6_000),
        Request::Stop,
        equal_amplitudes(2, 7_000),
        Request::Start,
        Request::KeepAlive,
    ];
    let n = desk.write(requests);
    desk.wait(1_000);
    let heard = desk.take_messages();
    assert_eq!(answer(&heard, n[0]), Err(Code::Stopped));
    assert_eq!(answer(&heard, n[1]), answer(&heard, n[3]));
    assert_eq!(answer(&heard, n[1]).ok(), stopping(&heard));
    assert_eq!(answer(&heard, n[2]), Err(Code::Stopped));
    assert_eq!(answer(&heard, n[4]), Err(Code::NotArmed));
    assert_eq!(answer(&heard, n[5]), Err(Code::WrongState));
    assert!(answer(&heard, n[6]).is_ok());
}

#[test]
fn a_stop_ends_arming_wherever_it_is() {
    for wait in [0, 100, 1_000, 10_000] {
        let mut desk = TestHost::open(BOOT);
        desk.prepare(wearer(), &[channel(PLAIN); 2]);
        let arm = desk.write([ARM])[0];
        desk.wait(wait);
        let stop = desk.write([Request::Stop])[0];
        desk.wait(30_000);
        let heard = desk.take_messages();
        assert_eq!(answer(&heard, arm), Err(Code::Cancelled), "{wait}");
        assert!(answer(&heard, stop).is_ok());
        assert_eq!(desk.state(), State::Idle);
        desk.expect_ok(ARM); // no part of the cancelled order blocks it
    }
}

/// A thousand orders, a stop, a thousand more: the stop is carried out in the next window, and
/// every request gets exactly one answer.
#[test]
fn a_thousand_orders_do_not_delay_a_stop() {
    let mut desk = stimulating();
    let flood = |n: u32| match n % 4 {
        0 => Request::KeepAlive,
        1 => Request::Status,
        2 => equal_amplitudes(2, n),
        _ => Request::MuscleLevel {
            channel: 0,
            level: firmware::muscle::MuscleLevel::None,
        },
    };
    let mut requests: Vec<Request> = (0..1_000).map(flood).collect();
    requests.push(Request::Stop);
    requests.extend((0..1_000).map(flood));
    let arrived = desk.now();
    let count = requests.len();
    let numbers = desk.write(requests);
    desk.wait(2_000);
    let heard = desk.take_messages();
    let at = answer(&heard, numbers[1_000]).unwrap();
    println!(
        "stop carried out {} us after its arrival",
        (at - arrived).us()
    );
    // The window that is rendered next begins within two windows.
    assert!((at - arrived).us() <= 500);
    assert_eq!(stopping(&heard), Some(at));
    assert_eq!(desk.state(), State::Stopping);
    let answers = heard.iter().filter(|h| match h {
        OwnedResponse::Ack(seq, _)
        | OwnedResponse::Refused(Some(seq), ..)
        | OwnedResponse::Status(seq, _) => numbers.contains(seq),
        _ => false,
    });
    assert_eq!(answers.count(), count);
    desk.wait(100_000);
    assert_eq!(desk.state(), State::Idle);
    assert_eq!(desk.status().counters.lost_posts, 0);
}

#[test]
fn more_stops_than_the_session_remembers_are_all_answered() {
    let mut desk = stimulating();
    let numbers = desk.write(vec![Request::Stop; 20]);
    desk.wait(1_000);
    let heard = desk.take_messages();
    assert!(numbers.iter().all(|&n| answer(&heard, n).is_ok()));
    assert_eq!(desk.state(), State::Stopping);
}

/// `Stop` from another session, or from none, is never refused. It is counted.
#[test]
fn a_stranger_s_stop_stops() {
    let mut desk = stimulating();
    let own = core::mem::replace(&mut desk.session, 7_777);
    let stop = desk.write([Request::KeepAlive, Request::Stop]);
    desk.wait(1_000);
    let heard = desk.take_messages();
    assert_eq!(answer(&heard, stop[0]), Err(Code::SessionTaken));
    assert!(answer(&heard, stop[1]).is_ok());
    assert_eq!(desk.state(), State::Stopping);
    desk.session = own;
    assert_eq!(desk.status().counters.unknown_sessions, 2);
    // Before any session there is nothing to stop and nothing to refuse.
    let mut desk = TestHost::boot(BOOT, None);
    desk.expect_ok(Request::Stop);
    assert_eq!(desk.state(), State::Idle);
}

/// A setpoint that the controller has not taken yet becomes void as well.
#[test]
fn a_queued_angle_is_void() {
    let mut desk = stimulating();
    let n = desk.write([angle(100), Request::Stop, angle(100)]);
    desk.wait(2_000);
    let heard = desk.take_messages();
    assert_eq!(answer(&heard, n[0]), Err(Code::Stopped));
    assert!(answer(&heard, n[1]).is_ok());
    assert_eq!(answer(&heard, n[2]), Err(Code::NoJoint));
}

/// Twenty requests fill the controller's mailbox. The following `Hello` is refused, because
/// otherwise telemetry of the previous session would continue in the new one.
#[test]
fn a_hello_that_could_not_end_a_subscription_is_refused() {
    let mut desk = TestHost::open(BOOT);
    let mut requests = vec![Request::Subscribe { period_ms: 10 }; 20];
    requests.push(Request::Hello { schema: SCHEMA });
    let n = desk.write(requests);
    desk.wait(2_000);
    let heard = desk.take_messages();
    assert_eq!(answer(&heard, n[14]).map(|_| ()), Ok(()));
    assert_eq!(answer(&heard, n[15]), Err(Code::DeviceBusy));
    assert_eq!(answer(&heard, n[20]), Err(Code::DeviceBusy));
    desk.hello();
    desk.take_messages();
    desk.wait(50_000);
    assert_eq!(desk.take_messages(), []);
}

#[test]
fn no_table_is_made_while_a_stop_may_come() {
    let setup = || Request::Channel {
        channel: 0,
        spec: channel(PLAIN),
    };
    let mut desk = armed();
    desk.expect_ok(setup());
    let numbers = desk.write([Request::Start, setup(), Request::Stop]);
    desk.wait(200_000);
    let heard = desk.take_messages();
    assert_eq!(answer(&heard, numbers[1]), Err(Code::WrongState));
    assert_eq!(desk.state(), State::Idle);
    desk.expect_ok(setup());

    let mut desk = stimulating();
    assert_eq!(
        desk.expect_refusal(setup()),
        refusal(Code::WrongState, "state")
    );
    desk.expect_ok(Request::Stop);
    assert_eq!(desk.state(), State::Stopping);
    assert_eq!(desk.refusal_code(setup()), Some(Code::WrongState));
    desk.wait(2_000_000);
    assert_eq!(desk.state(), State::Idle);
    desk.expect_ok(setup());
}
