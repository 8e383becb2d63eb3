//! A host that disconnects in the middle of a request and reconnects, on the flashed image in the
//! chip simulator.

use firmware::lockstep::Sensors;
use hal_sim::chip::board::{Board, CYCLES_PER_US};
use hal_sim::chip::soc::Pace;
use tests::desk;

/// Core cycles per millisecond.
const MS: u64 = 1_000 * CYCLES_PER_US;

/// Interrupts a board's first enumeration at different moments of its first milliseconds, some of
/// them within a request. The port must open again each time.
fn opens_again_after(leave: fn(&mut Board<()>)) {
    let (image, stages) = (desk::flashed_image(), desk::stages(24.0));
    let mut board = Board::power_on(image, stages, Pace::Lazy, ()).unwrap();
    while board.around.host.frame(board.cpu.cycle).is_none() {
        board.run_to(board.cpu.cycle + MS).unwrap();
    }
    // The host sends its first request 10 ms after the reset.
    board.run_to(board.cpu.cycle + 19 * MS / 2).unwrap();
    for moment in 0..48 {
        board.run_to(board.cpu.cycle + MS / 16).unwrap();
        let mut fork = board.clone();
        leave(&mut fork);
        let open = fork.boot(&Sensors::default());
        assert!(open.is_ok(), "moment {moment}: {open:?}");
    }
}

#[test]
fn a_cable_pulled_within_a_request_is_seen() {
    opens_again_after(|board| {
        board.around.plug(false, board.cpu.cycle);
        board.run_to(board.cpu.cycle + MS).unwrap();
        board.around.plug(true, board.cpu.cycle);
    });
}

/// The host keeps the port powered, so the board sees only a bus reset.
#[test]
fn a_host_that_restarts_within_a_request_is_seen() {
    opens_again_after(|board| {
        let (at, around) = (board.cpu.cycle, &mut board.around);
        let mut nobody = around.soc.otg.clone();
        around.host.unplug(at, &mut nobody);
        around.host.plug(at, &mut nobody);
        around.soc.reschedule();
    });
}

/// A request with more data than the board accepts is refused, and an incomplete one ends with its
/// host; their data must not reach another request.
#[test]
fn data_of_a_request_that_came_to_nothing_are_dropped() {
    let too_long = [0xE0, 0x21, 0x20, 0, 0, 0, 0x17, 0, 7, 0, 0xC2, 0xF0, 0];
    let address_with_data = [0xCB, 0, 5, 9, 0, 0, 0, 9, 0];
    for input in [&too_long[..], &address_with_data] {
        tests::fuzz::usb(input);
    }
}
