//! The board's stored table of output stages: a channel configured with a wrong stage is refused by
//! name, and a corrupt table allows no stimulation. On the flashed image, which stores the table in
//! its flash.

use firmware::device::Draft;
use firmware::link::message::OptionBytes;
use firmware::link::{BROADCAST, Code, HelloInfo, Refusal, Request, Response, SCHEMA};
use firmware::lockstep::Sensors;
use firmware::pulse::{CHANNELS, TrainSpec};
use firmware::safety::{
    ChannelSpec, Origin, StageKind, StageSpec, StageSupply, StageTable, StageWords, Stages,
    StagesFault, State,
};
use firmware::units::{Amplitude, Micros};
use hal_sim::chip::board::{Board, stages};
use hal_sim::chip::soc::Pace;
use hal_sim::lockstep::Device;
use tests::desk;
use tests::record::Record;

const AMPS: StageKind = StageKind::Current {
    full_scale_ua: 100_000,
};
const VOLTS: StageKind = StageKind::Voltage {
    full_scale_mv: 60_000,
};

/// Board in service, and its host.
struct Bench {
    board: Board<()>,
    record: Record,
    session: u16,
    seq: u16,
    /// Setup that the host has sent.
    draft: Draft,
    said: Vec<ResponseKind>,
}

/// Kinds of responses that the tests distinguish.
#[derive(Debug)]
enum ResponseKind {
    Hello(Box<HelloInfo>),
    Ack,
    Refused(u16, String, i32),
    Event,
}

impl Bench {
    /// Boots a board of ten 100 mA stages, after `prepare` has changed its flash.
    fn booted(prepare: impl FnOnce(&mut Board<()>)) -> Self {
        let (image, outputs) = (desk::flashed_image(), desk::stages(100.0));
        let mut board = Board::power_on(image, outputs, Pace::Lazy, ()).unwrap();
        prepare(&mut board);
        let booted = board.boot(&Sensors::default());
        booted.unwrap_or_else(|e| panic!("{e}"));
        Self {
            board,
            record: Record::default(),
            session: BROADCAST,
            seq: 0,
            draft: Draft::default(),
            said: Vec::new(),
        }
    }

    /// Sends `request` and returns the last response within `us`.
    fn ask(&mut self, request: Request, us: u64) -> ResponseKind {
        let before = self.draft.clone();
        self.say(Some(request), us);
        let response = self.said.pop().expect("an answer");
        if let ResponseKind::Refused(..) = response {
            self.draft = before; // a host's checksum covers accepted requests
        }
        response
    }

    /// Sends `request`, if any, and collects the responses within `us`.
    fn say(&mut self, request: Option<Request>, us: u64) {
        let (sensors, now) = (Sensors::default(), self.board.now_us());
        let at = |us: u64| Micros::new(us as u32);
        if let Some(request) = request {
            if let Request::Hello { .. } = request {
                self.session = BROADCAST;
            }
            let frame = desk::frame(self.session, self.seq, self.draft.prepare_request(request));
            self.seq = self.seq.wrapping_add(1);
            let done = self
                .board
                .receive(at(now), &frame, &sensors, &mut self.record);
            done.unwrap_or_else(|e| panic!("{e}"));
        }
        let done = self.board.advance(at(now + us), &sensors, &mut self.record);
        done.unwrap_or_else(|e| panic!("{e}"));
        if self.record.bytes.last() != Some(&0) {
            return; // no answer, or half of one
        }
        for message in desk::messages(&std::mem::take(&mut self.record.bytes)) {
            self.said.push(match postcard::from_bytes(&message) {
                Ok(Response::Hello(hello)) => {
                    self.session = hello.session;
                    ResponseKind::Hello(Box::new(hello))
                }
                Ok(Response::Ack { .. }) => ResponseKind::Ack,
                Ok(Response::Refused { refusal, .. }) => {
                    let Refusal {
                        code, field, max, ..
                    } = refusal;
                    ResponseKind::Refused(code, field.to_owned(), max)
                }
                Ok(Response::Event { .. }) => ResponseKind::Event,
                _ => continue,
            });
        }
    }

    fn greet(&mut self) -> Box<HelloInfo> {
        match self.ask(Request::Hello { schema: SCHEMA }, 5_000) {
            ResponseKind::Hello(hello) => hello,
            other => panic!("{other:?}"),
        }
    }

    /// Configures channel 1 with `stage`.
    fn declare(&mut self, stage: StageSpec) -> ResponseKind {
        let spec = ChannelSpec {
            train: TrainSpec::biphasic(200, 100, 20_000),
            stage,
            limit: Amplitude::new(5_000),
            start: Amplitude::new(0),
            area_mm2: ChannelSpec::ASSUMED_AREA_MM2,
        };
        self.ask(Request::Channel { channel: 0, spec }, 5_000)
    }

    /// Checks that no output has been driven since boot.
    fn expect_never_driven(&self) {
        let mut levels = self.record.trace.levels.iter();
        assert!(levels.all(|(_, l)| (0..10).all(|c| !l.state(c).is_driven())));
    }
}

fn write(board: &mut Board<()>, copies: [&StageWords; 2]) {
    for (copy, words) in stages::COPIES.into_iter().zip(copies) {
        stages::write(&mut board.around.soc.flash, copy, words).unwrap();
    }
}

fn table(stages: [Option<StageKind>; CHANNELS]) -> StageTable {
    StageTable {
        origin: Origin::Owner,
        supply: Some(StageSupply::Separate),
        stages,
    }
}

/// Returns a request that stores this table.
fn store(stages: [Option<StageKind>; CHANNELS]) -> Request {
    let supply = StageSupply::Separate;
    Request::StoreStages { stages, supply }
}

fn is_refused(response: &ResponseKind, code: Code, named: &str, max: i32) {
    let ResponseKind::Refused(number, field, has) = response else {
        panic!("{response:?}");
    };
    assert_eq!((*number, &**field, *has), (code as u16, named, max));
}

#[test]
fn a_false_declaration_is_refused_by_name() {
    let mut bench = Bench::booted(|_| ());
    let hello = bench.greet();
    let Stages::Stored(stored_table) = hello.stages else {
        panic!("{:?}", hello.stages);
    };
    let of_session = (Origin::Session, [Some(AMPS); CHANNELS]);
    assert_eq!((stored_table.origin, stored_table.stages), of_session);
    // 60 V on a stage of 100 mA: three times the requested current.
    let response = bench.declare(StageSpec::Voltage {
        full_scale_mv: 60_000,
        load_ohm: 2_000,
    });
    is_refused(&response, Code::OtherStage, "stage", 0);
    let response = bench.declare(StageSpec::Current {
        full_scale_ua: 50_000,
    });
    is_refused(&response, Code::OtherStage, "full_scale_ua", 100_000);
    // Nothing was kept, so there is nothing to arm.
    is_refused(
        &bench.ask(desk::ARM, 30_000),
        Code::NothingToArm,
        "channels",
        0,
    );
    let response = bench.declare(StageSpec::Current {
        full_scale_ua: 100_000,
    });
    assert!(matches!(response, ResponseKind::Ack), "{response:?}");
    bench.expect_never_driven();
    assert!(matches!(bench.ask(desk::ARM, 30_000), ResponseKind::Ack));
}

/// Channel 1's second phase meets channel 2's first. A board whose stages share a supply, or whose
/// table predates that setting, refuses to arm and names both.
#[test]
fn opposite_directions_at_once_are_refused_unless_supplies_are_separate() {
    let common = Some(StageSupply::Common);
    for (supply, is_armed) in [
        (None, false),
        (common, false),
        (Some(StageSupply::Separate), true),
    ] {
        let mut bench = Bench::booted(|board| {
            let stages = [Some(AMPS); CHANNELS];
            let declared = StageTable {
                supply,
                ..table(stages)
            };
            let words = declared.to_words(board.around.soc.signature.uid);
            write(board, [&words; 2]);
        });
        let Stages::Stored(stored_table) = bench.greet().stages else {
            panic!("a table was stored");
        };
        assert_eq!(stored_table.supply, supply);
        let stage = StageSpec::Current {
            full_scale_ua: 100_000,
        };
        for (channel, offset_us) in [(0, 0), (1, 300)] {
            let spec = ChannelSpec {
                train: TrainSpec {
                    offset_us,
                    ..TrainSpec::biphasic(200, 100, 20_000)
                },
                stage,
                limit: Amplitude::new(5_000),
                start: Amplitude::new(0),
                area_mm2: ChannelSpec::ASSUMED_AREA_MM2,
            };
            let response = bench.ask(Request::Channel { channel, spec }, 5_000);
            assert!(matches!(response, ResponseKind::Ack), "{response:?}");
        }
        let response = bench.ask(desk::ARM, 60_000);
        if is_armed {
            assert!(matches!(response, ResponseKind::Ack), "{response:?}");
        } else {
            is_refused(&response, Code::OppositePhases, "supply", 1);
            bench.expect_never_driven();
        }
    }
}

#[test]
fn option_bytes_are_told() {
    let hello = Bench::booted(|_| ()).greet();
    assert_eq!(hello.option_bytes, Some(OptionBytes::WANTED));
    // As delivered: RM0090 3.9.7, FLASH_OPTCR, reset value.
    let delivered = |board: &mut Board<()>| board.around.soc.flash.set_options(0x0FFF_AAED);
    let off = OptionBytes {
        brown_out_level: 0,
        ..OptionBytes::WANTED
    };
    assert_eq!(Bench::booted(delivered).greet().option_bytes, Some(off));
    // Level 1 (BOR_LEV 10), watchdog by hardware, read protection.
    for (rdp, read_protection) in [(0x00, 1), (0xCC, 2)] {
        let set =
            |board: &mut Board<()>| board.around.soc.flash.set_options(0x0FFF_00C9 | rdp << 8);
        let found = OptionBytes {
            brown_out_level: 1,
            hardware_watchdog: true,
            read_protection,
        };
        assert_eq!(Bench::booted(set).greet().option_bytes, Some(found));
    }
}

#[test]
fn an_unreliable_table_arms_nothing() {
    let erased = [u32::MAX; size_of::<StageWords>() / 4];
    let uid = |board: &Board<()>| board.around.soc.signature.uid;
    /// Builds both copies from a complete table and an erased one.
    type Copies = fn(&StageWords, &StageWords) -> [StageWords; 2];
    let cases: [(StagesFault, Copies); 5] = [
        (StagesFault::Erased, |_, erased| [*erased; 2]),
        (StagesFault::Incomplete, |complete_words, erased| {
            [*complete_words, *erased]
        }),
        (StagesFault::Incomplete, |complete_words, erased| {
            [*erased, *complete_words]
        }),
        (StagesFault::Damaged, |complete_words, _| {
            let mut cut = *complete_words;
            cut[7..].fill(u32::MAX); // power failed during programming
            [cut; 2]
        }),
        (StagesFault::OtherBoard, |_, _| {
            [table([Some(AMPS); CHANNELS]).to_words([1, 2, 3]); 2]
        }),
    ];
    for (fault, copies) in cases {
        let mut bench = Bench::booted(|board| {
            let complete_words = table([Some(AMPS); CHANNELS]).to_words(uid(board));
            let [first, second] = copies(&complete_words, &erased);
            write(board, [&first, &second]);
        });
        assert_eq!(bench.greet().stages, Stages::Unknown(fault));
        let response = bench.declare(StageSpec::Current {
            full_scale_ua: 100_000,
        });
        is_refused(&response, Code::StagesUnknown, "stages", 0);
        is_refused(
            &bench.ask(desk::ARM, 30_000),
            Code::NothingToArm,
            "channels",
            0,
        );
        bench.expect_never_driven();
    }
}

#[test]
fn a_table_is_stored_and_found_after_the_restart() {
    let mut bench = Bench::booted(|board| {
        write(board, [&[u32::MAX; 16]; 2]);
    });
    bench.greet();
    let mut ten = [Some(VOLTS); CHANNELS];
    (ten[0], ten[9]) = (Some(AMPS), None);
    // A value out of its range is named, and nothing is stored.
    let mut wild = ten;
    wild[1] = Some(StageKind::Current { full_scale_ua: 999 });
    let response = bench.ask(store(wild), 5_000);
    is_refused(&response, Code::OutOfRange, "full_scale_ua", 100_000);
    // After accepting, the board restarts by itself; erasing two sectors takes 2 s each.
    let response = bench.ask(store(ten), 5_000_000);
    assert!(matches!(response, ResponseKind::Ack), "{response:?}");
    let hello = bench.greet();
    assert_eq!(hello.stages, Stages::Stored(table(ten)));
    assert_eq!(hello.state, State::Idle, "{:?}", hello.last_fault);
    let response = bench.declare(StageSpec::Current {
        full_scale_ua: 100_000,
    });
    assert!(matches!(response, ResponseKind::Ack), "{response:?}");
    // Refused while armed.
    assert!(matches!(bench.ask(desk::ARM, 30_000), ResponseKind::Ack));
    let response = bench.ask(store(ten), 5_000);
    is_refused(&response, Code::WrongState, "state", 0);
}

/// Sends the largest possible setup with a wrong checksum, and measures the session's time from the
/// frame's arrival to the answer.
#[test]
fn the_sum_of_a_full_setup_takes_less_than_a_millisecond() {
    let mut bench = Bench::booted(|_| ());
    bench.greet();
    let mut sent = 0;
    for mut request in desk::load_session("ten_forces.toml")
        .session
        .setup_requests()
    {
        if let Request::Channel { spec, .. } = &mut request {
            let full_scale_ua = 100_000; // full scale of the board's stages
            spec.stage = StageSpec::Current { full_scale_ua };
        }
        let response = bench.ask(request, 5_000);
        assert!(matches!(response, ResponseKind::Ack), "{response:?}");
        sent += 1;
    }
    assert!(sent >= 30, "ten trains, muscles and force controls");
    // The host polls for answers once a millisecond. The mean wait over this many phases is the
    // device's time plus half a millisecond.
    let mut took_us = |request: &Request| {
        let phases = 0..50;
        let waits = phases.map(|phase| {
            bench.say(None, 1_000 + 20 * phase);
            bench.said.clear();
            let begin = bench.board.now_us();
            bench.say(Some(request.clone()), 20);
            while bench.said.is_empty() {
                bench.say(None, 20);
            }
            (bench.said.remove(0), bench.board.now_us() - begin)
        });
        let (responses, waits): (Vec<_>, Vec<_>) = waits.unzip();
        let total_us: u64 = waits.iter().sum();
        (responses, total_us / 50)
    };
    // Refused as well, but for another reason.
    let (shape, plain_us) = took_us(&Request::Subscribe { period_ms: 1_001 });
    let (other, sum_us) = took_us(&Request::Arm { setup: 1 });
    for (shape, other) in shape.iter().zip(&other) {
        is_refused(shape, Code::OutOfRange, "period_ms", 1_000);
        is_refused(other, Code::OtherSetup, "setup", 0);
    }
    println!("refused after {plain_us} us, and for its sum after {sum_us} us");
    assert!(sum_us < plain_us + 1_000);
    // The setup that was sent can be armed.
    assert!(matches!(bench.ask(desk::ARM, 60_000), ResponseKind::Ack));
}
