//! Random hosts, wearers and times against a whole device: it never panics, and no rule for pins,
//! requests and answers is broken.

mod found;
pub mod hosts;
mod judges;
mod lifts;
mod walls;

use crate::device_desk::*;
use firmware::link::{Request, SCHEMA};
use firmware::pulse::Levels;
use firmware::units::{Micros, us};
use hosts::*;
use judges::*;
use proptest::collection::vec;
use proptest::option;
use proptest::prelude::*;
use proptest::test_runner::TestRunner;
use std::cell::Cell;

fn apply(desk: &mut TestHost, step: &Step, asked: &mut Vec<(u64, u16, Request)>) {
    let now = desk.now();
    let mut note = |desk: &mut TestHost, request: &Request| {
        let t = desk.since_boot_us();
        asked.push((t, desk.seq, request.clone()));
    };
    match step {
        Step::Send(request) => {
            note(desk, request);
            desk.send(request.clone());
        }
        Step::Chunk(requests) => {
            let mut bytes = Vec::new();
            for request in requests {
                note(desk, request);
                bytes.extend(desk.frame(request.clone()));
            }
            desk.board
                .receive(now, &bytes, &desk.sensors, &mut desk.record);
        }
        Step::Ahead(request, by) => {
            let mut request = request.clone();
            if let Request::Amplitudes { at, .. } = &mut request {
                *at = Some(now + us(by.cast_unsigned()));
            }
            note(desk, &request);
            desk.send(request);
        }
        Step::Raw(bytes) => desk
            .board
            .receive(now, bytes, &desk.sensors, &mut desk.record),
        Step::Broken(request, n) => {
            let mut bytes = frame(desk.session, desk.seq, request.clone());
            let bit = usize::from(*n) % (8 * bytes.len());
            bytes[bit / 8] ^= 1 << (bit % 8);
            desk.board
                .receive(now, &bytes, &desk.sensors, &mut desk.record);
        }
        Step::Session(session) => desk.session = *session,
        Step::Seq(seq) => desk.seq = *seq,
        Step::Hello => {
            desk.take_messages();
            desk.send(Request::Hello { schema: SCHEMA });
            for heard in desk.take_messages() {
                if let OwnedResponse::Hello(info) = heard {
                    desk.session = info.session;
                }
            }
        }
        Step::Wait(us) => desk.wait(*us),
        Step::Stream(n, us) => {
            for _ in 0..*n {
                note(desk, &Request::KeepAlive);
                desk.send(Request::KeepAlive);
                desk.wait(*us);
            }
        }
        Step::Arm(closed) => desk.sensors.arm = *closed,
        Step::HandStop(closed) => desk.sensors.hand_stop = *closed,
        Step::OverCurrent => {
            desk.sensors.over_current = true;
            desk.wait(1);
            desk.sensors.over_current = false;
        }
        Step::Load(channel, ohm) => desk.sensors.load_ohm[usize::from(*channel)] = *ohm,
        Step::Joint(code) => desk.sensors.joint = *code,
        Step::Trigger(apart_us) => {
            desk.sensors.trigger = Some(now + us(apart_us / 2));
            // After every other edge the input stays active until the next edge that ends it.
            desk.sensors.held = apart_us % 2 == 0;
            desk.wait(*apart_us);
            desk.sensors.trigger = None;
        }
        Step::Stamped(request, by) => {
            // Any past time; only slightly future times, because the simulated time would advance
            // to them.
            let at = now + us((*by).min(5_000).cast_unsigned());
            let t = desk.since_boot_us() + u64::from((*by).clamp(0, 5_000).cast_unsigned());
            asked.push((t, desk.seq, request.clone()));
            let bytes = desk.frame(request.clone());
            desk.board
                .receive(at, &bytes, &desk.sensors, &mut desk.record);
        }
    }
}

fn config() -> ProptestConfig {
    let cases = std::env::var("FLEXOR_CASES")
        .ok()
        .and_then(|n| n.parse().ok())
        .unwrap_or(600);
    ProptestConfig {
        cases,
        max_shrink_iters: 3_000,
        ..ProptestConfig::default()
    }
}

/// Counts over all cases, which show a fuzz test that never stimulates.
#[derive(Default, Debug)]
struct FuzzCounts {
    cases: Cell<u32>,
    stimulated: Cell<u32>,
    pulses: Cell<u64>,
    faulted: Cell<u32>,
    grounded: Cell<u32>,
    monophasic: Cell<u32>,
}

impl FuzzCounts {
    fn note(&self, desk: &mut TestHost, allowed: &Allowed) {
        let add = |cell: &Cell<u32>, is: bool| cell.set(cell.get() + u32::from(is));
        let pulses = desk.status().counters.pulses;
        let levels = &desk.record.levels;
        add(&self.cases, true);
        // More pulses than the electrode checks emit.
        add(&self.stimulated, pulses > 10);
        self.pulses.set(self.pulses.get() + u64::from(pulses));
        add(
            &self.grounded,
            levels.iter().any(|l| l.1 == Levels::GROUNDED),
        );
        add(&self.monophasic, allowed.monophasic.contains(&true));
        let is_faulted = !desk_faults(desk).is_empty();
        add(&self.faulted, is_faulted);
    }
}

fn one_run(boot: u32, steps: &[Step], tally: &FuzzCounts) -> Result<(), TestCaseError> {
    let mut desk = TestHost::boot(Micros::new(boot), None);
    let (mut asked, mut allowed) = (Vec::new(), Allowed::default());
    for step in steps {
        apply(&mut desk, step, &mut asked);
        allowed.note(&desk);
    }
    desk.wait(1_500_000);
    allowed.note(&desk);
    judge_pins(&mut desk)?;
    judge_permission(&mut desk, &asked, allowed.longest_us)?;
    allowed.judge(&mut desk)?;
    // Raw bytes without a delimiter would swallow the next request.
    if !steps
        .iter()
        .any(|s| matches!(s, Step::Raw(_) | Step::Broken(..)))
    {
        judge_answers(&mut desk, &asked)?;
    }
    // Whatever happened before, a session can be opened and arming works.
    desk.sensors = firmware::lockstep::Sensors::default();
    desk.wait(11_000_000);
    let now = desk.now();
    desk.board
        .receive(now, &[0], &desk.sensors, &mut desk.record);
    desk.take_messages();
    desk.hello();
    tally.note(&mut desk, &allowed);
    if desk.state() == firmware::safety::State::Fault {
        desk.expect_ok(Request::Acknowledge);
        desk.wait(110_000);
    }
    desk.run(wearer(), &[channel(PLAIN)], 5_000);
    let before = desk.record.levels.len();
    desk.wait(60_000);
    prop_assert!(desk.record.levels.len() >= before + 8);
    Ok(())
}

#[test]
fn nothing_breaks_a_promise() {
    let tally = FuzzCounts::default();
    let strategy = (
        any::<u32>(),
        option::weighted(0.9, opening()),
        vec(step(), 1..80),
    );
    let result = TestRunner::new(config()).run(&strategy, |(boot, opening, steps)| {
        let steps: Vec<Step> = opening.into_iter().flatten().chain(steps).collect();
        one_run(boot, &steps, &tally)
    });
    if let Err(e) = result {
        panic!("{e}");
    }
    println!("{tally:?}");
    let share = |cell: &Cell<u32>| f64::from(cell.get()) / f64::from(tally.cases.get());
    assert!(share(&tally.stimulated) > 0.2, "the attack is too weak");
}

/// Runs the same bytes, whole or split anywhere, at the same times.
fn split_run(requests: &[Request], cuts: &[u16]) -> Record {
    let mut desk = TestHost::open(Micros::new(u32::MAX - 30_000));
    desk.prepare(wearer(), &[channel(PLAIN), channel(MONO)]);
    desk.expect_ok(ARM);
    desk.expect_ok(Request::Start);
    for pair in requests.chunks(7) {
        let mut bytes = Vec::new();
        for request in pair {
            bytes.extend(desk.frame(request.clone()));
        }
        let at = desk.now();
        let mut edges: Vec<usize> = cuts.iter().map(|&c| c as usize % bytes.len()).collect();
        edges.extend([0, bytes.len()]);
        edges.sort_unstable();
        for piece in edges.windows(2) {
            let piece = &bytes[piece[0]..piece[1]];
            desk.board
                .receive(at, piece, &desk.sensors, &mut desk.record);
        }
        desk.wait(9_137);
    }
    desk.wait(300_000);
    desk.record
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, ..config() })]

    #[test]
    fn bytes_may_be_split_anywhere(
        requests in vec(request(), 1..40),
        cuts in vec(any::<u16>(), 1..40),
    ) {
        let (whole, cut) = (split_run(&requests, &[]), split_run(&requests, &cuts));
        prop_assert_eq!(whole.bytes, cut.bytes);
        prop_assert_eq!(whole.levels, cut.levels);
        prop_assert_eq!(whole.dac, cut.dac);
    }
}
