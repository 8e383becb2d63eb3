//! Requests that any program may send to a board's endpoint 0, on the flashed image in the chip
//! simulator.

use crate::desk;
use crate::record::Record;
use firmware::device::Draft;
use firmware::link::{BROADCAST, Request, Response, SCHEMA};
use firmware::lockstep::Sensors;
use firmware::pulse::TrainSpec;
use firmware::safety::State;
use firmware::units::{Amplitude, Micros};
use hal_sim::chip::board::{Board, CYCLES_PER_US};
use hal_sim::chip::soc::Pace;
use hal_sim::chip::usb::Failure;
use hal_sim::lockstep::Device;
use std::sync::LazyLock;

/// Fuzzes control requests with any SETUP packet and any data: the device never stops or resets,
/// never answers with more bytes than requested, its outputs stay unchanged to the microsecond, and
/// after the cable was out it enumerates and answers.
///
/// The first byte selects the case: a board that is not enumerated, one that is, or one that
/// stimulates; and whether the cable is pulled at the end ([`Place`]). Then each request has eight
/// bytes of SETUP, one `n` and `n` modulo 70 bytes of data.
pub fn usb(data: &[u8]) {
    let Some((first, mut rest)) = data.split_first() else {
        return;
    };
    let place = Place::from_byte(*first);
    let case = &CASES[place.case];
    let mut board = case.board.clone();
    let before = board.last_reset();
    let mut asked = 0;
    while let Some((setup, tail)) = rest.split_first_chunk::<8>()
        && asked < MOST
    {
        let length = tail.first().map_or(0, |n| usize::from(*n) % 70);
        let (data, tail) = tail
            .get(1..)
            .unwrap_or_default()
            .split_at_checked(length)
            .unwrap_or((tail.get(1..).unwrap_or_default(), &[]));
        let (at, around) = (board.cpu.cycle, &mut board.around);
        around.host.control(*setup, data.to_vec(), at);
        around.soc.reschedule();
        (rest, asked) = (tail, asked + 1);
    }
    check_served(&mut board, &case.outputs);
    let failure = board.around.host.failure();
    let is_fair = matches!(
        failure,
        None | Some(Failure::NoAnswer(_) | Failure::Stalled(_))
    );
    assert!(is_fair || case.is_new, "{failure:?}");
    if place.is_pulled {
        replug(&mut board);
    }
    assert_eq!(board.last_reset(), before, "the board was reset");
}

/// First byte of an input: the case, modulo 3, and a flag in its highest bit.
struct Place {
    case: usize,
    /// Whether the cable is pulled once the requests are served. This takes twenty times as long,
    /// because a host waits before it enumerates a new device.
    is_pulled: bool,
}

impl Place {
    fn from_byte(byte: u8) -> Self {
        Self {
            case: usize::from(byte & 0x7F) % CASES.len(),
            is_pulled: byte & 0x80 != 0,
        }
    }
}

/// Largest number of requests in one input.
const MOST: usize = 8;

/// Shortest time for which requests are served, ms of the chip's time.
const SERVED_MS: u64 = 12;

/// State of a board when requests arrive.
struct Case {
    board: Board<()>,
    /// Outputs within [`SERVED_MS`] without any request.
    outputs: Vec<(u64, u32)>,
    is_new: bool,
}

static CASES: LazyLock<[Case; 3]> = LazyLock::new(|| {
    [new(), enumerated(), stimulating()].map(|board| {
        let mut alone = board.clone();
        Case {
            is_new: !has_started(&board),
            outputs: line_changes(&mut alone),
            board,
        }
    })
});

/// Returns whether device time is known, so that outputs can be reported.
fn has_started(board: &Board<()>) -> bool {
    board.now_us() > 0
}

/// Returns a board whose host sends frames but no request yet.
fn new() -> Board<()> {
    let (image, outputs) = (desk::flashed_image(), desk::stages(100.0));
    let mut board = Board::power_on(image, outputs, Pace::Lazy, ()).expect("it starts");
    while board.around.host.frame(board.cpu.cycle).is_none() {
        let to = board.cpu.cycle + MS;
        board.run_to(to).expect("it boots");
    }
    board
}

fn enumerated() -> Board<()> {
    let mut board = new();
    board.boot(&Sensors::default()).expect("it enumerates");
    board
}

/// Returns a board that stimulates on two channels at 200 Hz, whose host may be silent for a
/// second.
fn stimulating() -> Board<()> {
    let mut board = enumerated();
    let session = hello(&mut board);
    let train = |offset_us| TrainSpec {
        offset_us,
        ..TrainSpec::biphasic(200, 50, 5_000)
    };
    let wearer = Request::Wearer(desk::wearer(1_000));
    let [first, second] = [(0, 0), (9, 1_700)].map(|(channel, offset_us)| {
        let spec = desk::channel(train(offset_us), 100_000, 20_000);
        Request::Channel { channel, spec }
    });
    let amplitudes = Request::Amplitudes {
        at: None,
        mask: 0x201,
        values: [Amplitude::new(10_000); 2].into_iter().collect(),
        widths: Default::default(),
    };
    let mut draft = Draft::default();
    let orders = [wearer, first, second, desk::ARM, Request::Start, amplitudes];
    for (seq, request) in (1..).zip(orders) {
        let is_arm = matches!(request, Request::Arm { .. });
        let frame = desk::frame(session, seq, draft.prepare_request(request));
        exchange(&mut board, &frame, if is_arm { 40 } else { 5 });
    }
    let messages = answers(&mut board, &desk::frame(session, 7, Request::Status));
    let is_on = |message: &Vec<u8>| {
        matches!(
            postcard::from_bytes(message),
            Ok(Response::Status { status, .. }) if status.state == State::Stimulating
        )
    };
    assert!(messages.iter().any(is_on), "nothing would be watched");
    board
}

const MS: u64 = 1_000 * CYCLES_PER_US;

/// Sends bytes to the board, and records its output for `ms`.
fn exchange(board: &mut Board<()>, bytes: &[u8], ms: u64) -> Record {
    let (sensors, now) = (Sensors::default(), board.now_us());
    let (at, to) = (
        Micros::new(now as u32),
        Micros::new((now + 1_000 * ms) as u32),
    );
    let mut record = Record::starting_at(at);
    let done = board.receive(at, bytes, &sensors, &mut record);
    let done = done.and_then(|()| board.advance(to, &sensors, &mut record));
    done.unwrap_or_else(|why| panic!("{why}"));
    record
}

/// Sends a frame, and returns the board's messages within 10 ms.
fn answers(board: &mut Board<()>, frame: &[u8]) -> Vec<Vec<u8>> {
    let record = exchange(board, frame, 10);
    desk::messages(&record.bytes).collect()
}

/// Opens a session, and returns its number.
fn hello(board: &mut Board<()>) -> u16 {
    let messages = answers(board, &hello_frame());
    let session = messages.iter().find_map(|message| {
        match postcard::from_bytes(message).expect("a response") {
            Response::Hello(info) => Some(info.session),
            _ => None,
        }
    });
    session.expect("an answer to Hello")
}

fn hello_frame() -> Vec<u8> {
    let request = Request::Hello { schema: SCHEMA };
    [&[0][..], &desk::frame(BROADCAST, 0, request)].concat()
}

/// Returns the changes of all output lines from now on.
fn line_changes(board: &mut Board<()>) -> Vec<(u64, u32)> {
    if !has_started(board) {
        let to = board.cpu.cycle + SERVED_MS * MS;
        board.run_to(to).unwrap_or_else(|why| panic!("{why}"));
        return Vec::new();
    }
    let levels = exchange(board, &[], SERVED_MS).trace.levels;
    levels
        .into_iter()
        .map(|(t, levels)| (t, levels.0))
        .collect()
}

/// Waits until the requests are served, and compares the outputs with those of a board without
/// requests. Requests are served no faster than the host's frames.
fn check_served(board: &mut Board<()>, outputs: &[(u64, u32)]) {
    assert_eq!(line_changes(board), outputs, "the outputs changed");
    for _ in 0..4 {
        if board.around.host.pending_requests() == 0 || board.around.host.failure().is_some() {
            return;
        }
        line_changes(board);
    }
}

/// Removes the cable and connects it again.
fn replug(board: &mut Board<()>) {
    board.around.plug(false, board.cpu.cycle);
    let to = board.cpu.cycle + 5 * MS;
    board.run_to(to).unwrap_or_else(|why| panic!("{why}"));
    board.around.plug(true, board.cpu.cycle);
    let open = board.boot(&Sensors::default());
    open.unwrap_or_else(|why| panic!("it does not enumerate again: {why}"));
    // A board that still stimulates refuses a new host.
    let messages = answers(board, &hello_frame());
    let is_answer = |message: &Vec<u8>| {
        matches!(
            postcard::from_bytes(message).expect("a response"),
            Response::Hello(_) | Response::Refused { .. }
        )
    };
    assert!(
        messages.iter().any(is_answer),
        "it does not answer: {messages:02x?}"
    );
}
