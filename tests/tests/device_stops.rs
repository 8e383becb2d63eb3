//! Every pulse that has begun is completed, however a stimulation ends: random trains and groups on
//! a whole device, ended by the host, by its silence, by the hand-held stop or by themselves, twice
//! in a row, judged by the independent checker of traces.

use firmware::device::Draft;
use firmware::link::{Request, Response, SCHEMA};
use firmware::lockstep::{Lockstep, Sensors};
use firmware::pulse::{GroupSpec, Partner, Shape, TrainSpec};
use firmware::safety::{State, WearerSpec};
use firmware::units::{Amplitude, Micros, us};
use hal_sim::native::native;
use hal_sim::trace::{Unwrap, check};
use proptest::prelude::*;
use proptest::test_runner::TestRunner;
use std::cell::Cell;
use tests::desk;
use tests::expectation::{setup_expectation, trace_since};
use tests::record::Record;

const FULL_SCALE_UA: u32 = 100_000;
const LIMIT_UA: u32 = 20_000;

struct TestHost {
    board: Lockstep,
    record: Record,
    sensors: Sensors,
    session: u16,
    seq: u16,
    /// Setup that the host has sent.
    draft: Draft,
    clock: Unwrap,
}

impl TestHost {
    fn boot(at: Micros) -> Self {
        let mut clock = Unwrap::default();
        clock.unwrap_time(at.get());
        let mut desk = Self {
            board: native(at),
            record: Record::starting_at(at),
            sensors: Sensors::default(),
            session: 0,
            seq: 0,
            draft: Draft::default(),
            clock,
        };
        desk.wait(1_000);
        desk.ask(Request::Hello { schema: SCHEMA });
        desk.session = 1;
        desk
    }

    fn now(&mut self) -> u64 {
        self.clock.unwrap_time(self.board.now().get())
    }

    fn wait(&mut self, length_us: u32) {
        let to = self.board.now() + us(length_us);
        self.board.advance(to, &self.sensors, &mut self.record);
    }

    fn send(&mut self, request: Request) {
        let bytes = desk::frame(self.session, self.seq, self.draft.prepare_request(request));
        self.seq = self.seq.wrapping_add(1);
        let at = self.board.now();
        self.board
            .receive(at, &bytes, &self.sensors, &mut self.record);
    }

    /// Returns the time at which the device carried out the request; `None` if refused.
    fn ask(&mut self, request: Request) -> Option<u64> {
        self.record.bytes.clear();
        let seq = self.seq;
        self.send(request);
        self.wait(1_000);
        for _ in 0..500 {
            for message in desk::messages(&self.record.bytes) {
                match postcard::from_bytes(&message).unwrap() {
                    Response::Ack { seq: s, at } if s == seq => {
                        return Some(self.clock.unwrap_time(at.get()));
                    }
                    Response::Hello(_) => return Some(0),
                    Response::Refused { seq: Some(s), .. } if s == seq => return None,
                    _ => {}
                }
            }
            self.wait(1_000);
        }
        panic!("no answer");
    }
}

#[derive(Clone, Copy, Debug)]
enum End {
    Stop,
    Silence,
    HandStop,
    HandStopWhileStopping,
}

fn train() -> impl Strategy<Value = TrainSpec> {
    let shape = prop::sample::select(vec![
        Shape::BiphasicCathodicFirst,
        Shape::BiphasicAnodicFirst,
        Shape::MonophasicCathodic,
        Shape::MonophasicAnodic,
    ]);
    let period = prop::sample::select(vec![10_000u32, 20_000, 10_007, 7_500]);
    let offset = prop_oneof![0u32..=5_000, Just(10_000), Just(0)];
    (
        (shape, 10u16..=500, 0u16..=200, 1_000u16..=3_800),
        (period, offset, 1u8..=4, 0u16..=600),
    )
        .prop_map(
            |((shape, width_us, gap, ground), (period_us, offset, count, slack))| {
                let biphasic = shape.is_biphasic();
                let gap_us = if biphasic { gap } else { 0 };
                // Every other biphasic train is grounded too.
                let is_grounded = !biphasic || width_us % 2 == 1;
                let ground_us = if is_grounded { ground } else { 0 };
                let pulse_us = if biphasic {
                    2 * width_us + gap.max(5) + ground_us
                } else {
                    width_us + ground_us
                };
                let interval = (pulse_us + 5).max(200) + slack;
                let fits = u32::from(count) * u32::from(interval) + 500 <= period_us;
                let burst_count = if fits { count } else { 1 };
                TrainSpec {
                    shape,
                    width_us,
                    max_width_us: 0,
                    gap_us,
                    ground_us,
                    period_us,
                    offset_us: offset.min(period_us),
                    burst_count,
                    burst_interval_us: if burst_count > 1 { interval } else { 0 },
                    repeats: 0,
                    trigger: None,
                    lists: false,
                }
            },
        )
}

fn end() -> impl Strategy<Value = End> {
    use End::{HandStop, HandStopWhileStopping, Silence, Stop};
    prop::sample::select(vec![Stop, Silence, HandStop, HandStopWhileStopping])
}

/// Runs one stimulation of `us` µs and judges it. Returns the number of pulses.
fn run(
    desk: &mut TestHost,
    trains: &[TrainSpec],
    groups: &[GroupSpec],
    us: u32,
    end: End,
) -> Result<usize, TestCaseError> {
    desk.sensors.hand_stop = true;
    prop_assert!(desk.ask(desk::ARM).is_some());
    let epoch = desk.ask(Request::Start).unwrap();
    let values = trains.iter().map(|_| Amplitude::new(LIMIT_UA)).collect();
    let mask = (1 << trains.len()) - 1;
    desk.ask(Request::Amplitudes {
        at: None,
        mask,
        values,
        widths: Default::default(),
    })
    .unwrap();
    for _ in 0..us / 10_000 {
        desk.send(Request::KeepAlive);
        desk.wait(10_000);
    }
    desk.wait(us % 10_000);
    match end {
        End::Stop => desk.send(Request::Stop),
        End::Silence => {}
        End::HandStop => desk.sensors.hand_stop = false,
        End::HandStopWhileStopping => {
            desk.send(Request::Stop);
            desk.wait(us % 3_001);
            desk.sensors.hand_stop = false;
        }
    }
    desk.wait(60_000);
    prop_assert_eq!(desk.board.state(), State::Idle);
    let end_us = desk.now();
    let mut expected = setup_expectation(trains, groups, epoch, end_us);
    expected.complete = false;
    let limit = u64::from(LIMIT_UA) * 65_535 / u64::from(FULL_SCALE_UA);
    expected.max_code = [limit as u16; 10];
    let trace = trace_since(&desk.record.trace, epoch);
    let found = check(&trace, &expected);
    prop_assert!(found.is_empty(), "{:?}: {:?}", end, found.first());
    Ok(trace.levels.len())
}

#[test]
fn however_it_ends_every_pulse_is_whole() {
    let (armed, refused, changes) = (Cell::new(0), Cell::new(0), Cell::new(0));
    let partner = prop_oneof![Just(Partner::Conducted), Just(Partner::Isolated)];
    let strategy = (
        any::<u32>(),
        proptest::collection::vec(train(), 2..=4),
        proptest::option::of(partner),
        proptest::collection::vec((5_000u32..80_000, end()), 1..4),
    );
    let config = ProptestConfig {
        cases: 1_500,
        max_shrink_iters: 2_000,
        ..ProptestConfig::default()
    };
    let result = TestRunner::new(config).run(&strategy, |(boot, trains, partner, ends)| {
        let mut host = TestHost::boot(Micros::new(boot));
        let wearer = WearerSpec {
            rise_ms: 5,
            fall_ms: 5,
            host_timeout_ms: 25,
            ..WearerSpec::default()
        };
        host.ask(Request::Wearer(wearer)).unwrap();
        for (channel, &train) in (0u8..).zip(&trains) {
            let spec = desk::channel(train, FULL_SCALE_UA, LIMIT_UA);
            host.ask(Request::Channel { channel, spec }).unwrap();
        }
        let members = 0b11;
        let groups = partner.map(|partner| GroupSpec { members, partner });
        let groups: heapless::Vec<_, _> = groups.into_iter().collect();
        host.ask(Request::Groups(groups.clone())).unwrap();
        if host.ask(desk::ARM).is_none() {
            // Only an isolated group whose members overlap may be refused.
            prop_assert_eq!(partner, Some(Partner::Isolated));
            refused.set(refused.get() + 1);
            return Ok(());
        }
        host.ask(Request::Stop).unwrap();
        armed.set(armed.get() + 1);
        for &(us, end) in &ends {
            changes.set(changes.get() + run(&mut host, &trains, &groups, us, end)?);
        }
        Ok(())
    });
    println!(
        "{} setups stimulated, {} refused, {} changes of the pins judged",
        armed.get(),
        refused.get(),
        changes.get()
    );
    result.unwrap_or_else(|e| panic!("{e}"));
}
