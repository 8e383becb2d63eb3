//! A breadboard's image runs only with its strap, and never beside output stages.

use super::{BREADBOARDS, image, power_on};
use crate::chip_faults::Bench;
use firmware::link::{Code, Request};
use firmware::safety::{Fault, State};
use hal_sim::chip::board::{Board as SimulatedBoard, Hardware, wiring};
use hal_sim::chip::cpu::{Bus, Size};
use hal_sim::chip::soc::Pace;
use hal_sim::chip::soc::gpio::Level;
use host_core::run::Board;
use tests::desk;

/// Details of fault 24 (docs/evidence/faults.md).
const STRAP_OPEN: u32 = 1;
const OVER_CURRENT_HIGH: u32 = 2;

/// Checks that the boot ended with fault 24, that nothing can be armed, and that no pin of a channel
/// became an output.
fn assert_refused(board: SimulatedBoard<()>, detail: u32) {
    let (mut bench, hello) = Bench::boot_and_greet(board);
    let record = hello.last_fault.unwrap();
    assert_eq!((hello.state, record.fault), (State::Fault, Fault::Board));
    assert_eq!((record.detail, record.found_at_boot), (detail, true));
    let latched = Some((Code::FaultLatched as u16, "fault".to_owned(), 24));
    assert_eq!(bench.refusal(Request::Acknowledge), latched);
    assert_eq!(bench.refusal(Request::Start), latched);
    assert!(!bench.drives_within(20));
    for (port, base) in [(1, 0x4002_0400), (2, 0x4002_0800)] {
        let at = bench.board.cpu.cycle;
        let soc = &mut bench.board.around.soc;
        let moder = soc.read(base, Size::Word, at).unwrap().value;
        for (line, anodic) in bench.board.around.board().lines.into_iter().flatten() {
            for (_, pin) in [line, anodic].into_iter().filter(|p| p.0.index() == port) {
                assert_eq!(moder >> (2 * pin) & 0b11, 0, "port {port} pin {pin}");
            }
        }
    }
    assert!(bench.board.around.has_pump_stayed_input());
}

#[test]
fn an_open_strap_ends_in_a_fault_that_usb_reports() {
    for board in BREADBOARDS {
        let hardware = Hardware {
            is_strapped: false,
            ..Hardware::new(board.wiring())
        };
        assert_refused(power_on(board, &hardware), STRAP_OPEN);
    }
}

#[test]
fn a_healthy_over_current_line_ends_in_a_fault() {
    for board in BREADBOARDS {
        let mut simulated = super::powered(board);
        let (port, pin) = board.wiring().over_current;
        let soc = &mut simulated.around.soc;
        soc.drive(port.index(), pin.into(), Level::High, 0).unwrap();
        assert_refused(simulated, OVER_CURRENT_HIGH);
    }
}

/// The image for the WeAct board has the crystal of the reference board. On that board it finds no
/// strap, and output stages that drive the over-current line.
#[test]
fn a_breadboards_image_on_the_reference_board_drives_nothing() {
    let hardware = Hardware::new(&wiring::REFERENCE);
    let simulated = power_on(Board::Weact, &hardware);
    assert_refused(simulated, STRAP_OPEN | OVER_CURRENT_HIGH);
}

/// On a breadboard the reference image finds no stage table, so every channel is refused.
#[test]
fn the_reference_image_on_a_breadboard_knows_no_stages() {
    let hardware = Hardware {
        // It waits for VBUS, which the WeAct board does not sense.
        wiring: &wiring::Wiring {
            vbus: wiring::Vbus::Sensed,
            ..wiring::WEACT
        },
        ..Hardware::new(&wiring::WEACT)
    };
    let reference = image(Board::Reference);
    let stages = desk::stages(24.0);
    let board = SimulatedBoard::power_on_as(&hardware, reference, stages, Pace::Lazy, ()).unwrap();
    let (mut bench, hello) = Bench::boot_and_greet(board);
    assert_eq!(hello.kind, firmware::link::Kind::Board);
    let (channel, spec) = (0, crate::chip_faults::spec(0));
    let refused = bench.refusal(Request::Channel { channel, spec }).unwrap();
    assert_eq!(refused.0, Code::StagesUnknown as u16, "{refused:?}");
    assert!(!bench.drives_within(20));
}
