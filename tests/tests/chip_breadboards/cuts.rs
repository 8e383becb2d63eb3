//! A board that loses its cable or its supply while an image is written: what is left in flash boots,
//! or does not start; no line moves, and writing again succeeds.

use super::image;
use dfu::chip::STM32F405;
use dfu::container::Segment;
use dfu::flash::{Finish, Image as Written, flash};
use dfu::protocol::Session;
use dfu::simulated::{Cut, CutPoint, Simulated, SimulatedClock};
use firmware::lockstep::Sensors;
use hal_sim::chip::board::{Board as SimulatedBoard, BoardError, Hardware, SharedPinLog, wiring};
use hal_sim::chip::image::Image;
use hal_sim::chip::soc::Pace;
use hal_sim::random::Sequence;
use host_core::run::Board;
use tests::desk;

/// Seed of the cuts.
const SEED: u64 = 47;

fn image_to_write(board: Board) -> Written {
    let segments = [Segment {
        address: STM32F405.origin,
        bytes: image(board).flash,
    }];
    Written::new(&STM32F405, &segments).unwrap()
}

/// Writes `new` into `device`, which may be cut, and returns the device, the transfers, and whether
/// the image is complete.
fn write(device: Simulated, clock: &SimulatedClock, new: &Written) -> (Simulated, u64, bool) {
    let size = device.transfer_size();
    let mut session = Session::new(device, clock.clone(), size, STM32F405.firmware());
    let done = flash(&mut session, new, Finish::Stay, &mut |_| ());
    let device = session.into_transport();
    (device.clone(), device.transfers, done.is_ok())
}

/// Result of starting what a cut left.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Start {
    /// The core has no vectors, or stops at once.
    Nothing,
    /// The image boots and is found by the host.
    Boots,
}

/// Starts a board with `flash` for 0.4 s, and checks that no line of a channel and no pump rises.
fn start(flash: &[u8], of: &Image) -> Start {
    let mut image = of.clone();
    image.flash = flash.to_vec();
    let hardware = Hardware::new(&wiring::WEACT);
    let board = SimulatedBoard::power_on_as(&hardware, image, desk::stages(24.0), Pace::Lazy, ());
    let mut board = match board {
        Err(BoardError::Stopped { .. }) => return Start::Nothing,
        other => other.unwrap(),
    };
    let log = SharedPinLog::default();
    board.around.log_pins(log.clone());
    board.set_sensors(&Sensors::default()).unwrap();
    let mut start = Start::Boots;
    for _ in 0..400 {
        let ms = u64::from(board.around.soc.hz()) / 1_000;
        if board.run_to(board.cpu.cycle + ms).is_err() {
            start = Start::Nothing;
            break;
        }
    }
    if start == Start::Boots && !board.around.host.is_open() {
        start = Start::Nothing;
    }
    let log = log.lock().unwrap();
    let lines = wiring::WEACT.lines.into_iter().flatten();
    let pins = lines.flat_map(|(c, a)| [c, a]).chain([wiring::PUMP]);
    for (port, pin) in pins {
        let mut rises = log.edges.iter().filter(|edge| {
            usize::from(edge.port) == port.index() && edge.changed & edge.levels & 1 << pin != 0
        });
        assert_eq!(rises.next(), None, "{port:?}{pin}");
    }
    assert!(board.around.has_pump_stayed_input());
    start
}

/// Cuts the writing of the image of `new` over that of `old`, and starts what is left on a WeAct
/// board. Returns how often it was nothing, and how often an image booted.
fn cuts(count: u64, old: Board, new: Board) -> [u64; 2] {
    let (old, new) = (image_to_write(old), image_to_write(new));
    let of = image(Board::Weact);
    let clock = SimulatedClock::default();
    let mut prepared = Simulated::new(clock.clone());
    prepared.memory.preset(STM32F405.origin, old.bytes());
    let (_, transfers, is_complete) = write(prepared.clone(), &clock, &new);
    assert!(is_complete);
    let mut random = Sequence::new(SEED);
    let mut counts = [0; 2];
    for seed in 0..count {
        let mut device = prepared.clone();
        device.cut = Some(Cut {
            // A fifth of them at the first transfers, which erase sector 0, or at the last, which
            // write the vectors.
            transfer: match seed % 10 {
                0 => random.below(20),
                1 => transfers - 1 - random.below(12),
                _ => random.below(transfers),
            },
            point: [CutPoint::Before, CutPoint::During, CutPoint::After][random.below(3) as usize],
            seed,
        });
        let (device, _, is_complete) = write(device, &clock, &new);
        assert!(!is_complete, "{:?}", device.cut);
        let start = start(device.memory.bytes(), &of);
        counts[usize::from(start == Start::Boots)] += 1;
        let (device, _, is_complete) = write(device.replugged(), &clock, &new);
        assert!(is_complete, "cut {seed}");
        assert_eq!(&device.memory.bytes()[..new.bytes().len()], new.bytes());
    }
    counts
}

#[test]
fn what_two_hundred_cuts_leave_starts_nothing_or_a_whole_image() {
    for (old, new) in [
        (Board::Weact, Board::Feather),
        (Board::Feather, Board::Weact),
    ] {
        let [nothing, boots] = cuts(100, old, new);
        println!(
            "{} over {}, 100 cuts: {nothing} start nothing, {boots} boot",
            new.name(),
            old.name()
        );
        assert!(nothing > 50);
    }
    // A complete image boots, so that `start` can tell.
    let old = image_to_write(Board::Weact);
    assert_eq!(start(old.bytes(), &image(Board::Weact)), Start::Boots);
}
