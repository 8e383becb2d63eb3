//! Entry into the chip's boot loader, and an image that a boot loader starts.

use super::{BREADBOARDS, powered};
use crate::chip_faults::Bench;
use firmware::link::message::ResetCause;
use firmware::link::{Code, Request};
use firmware::lockstep::Sensors;
use hal_sim::chip::board::{Board as SimulatedBoard, BoardError};
use hal_sim::chip::cpu::{Bus, Size, Stop};
use host_core::run::Board;

/// Backup register of the request, and the request (docs/guides/breadboard.md).
const REQUEST: usize = 17;
const WORD: u32 = 0x424F_4F54;

/// Runs until the boot loader starts, at most 1 s.
fn run_into_boot_loader(board: &mut SimulatedBoard<()>) {
    let end = board.cpu.cycle + 168_000_000;
    let error = loop {
        let to = board.cpu.cycle + 10_000;
        if let Err(error) = board.run_to(to) {
            break error;
        }
        assert!(to < end, "the boot loader did not start");
    };
    let BoardError::Stopped { stop, .. } = error else {
        panic!("{error}");
    };
    let Stop::Outside { pc, what } = stop else {
        panic!("{stop}");
    };
    assert_eq!((pc, what), (0x1FFF_3DB4, "the chip's boot loader"));
}

#[test]
fn a_request_enters_the_boot_loader_from_the_reset_state() {
    for board in BREADBOARDS {
        let (mut bench, _) = Bench::boot_and_greet(powered(board));
        bench.sensors = Sensors {
            arm: false,
            hand_stop: false,
            ..Sensors::default()
        };
        bench.run_us(5_000);
        bench.send(Request::EnterBootLoader);
        let resets = bench.board.last_reset();
        run_into_boot_loader(&mut bench.board);
        assert_ne!(bench.board.last_reset(), resets);
        assert_eq!(bench.board.around.soc.backup.word(REQUEST), 0, "used up");
        // Clocks, ports, MPU and watchdog are as after reset; only the boot loader's memory is at 0.
        let at = bench.board.cpu.cycle;
        let soc = &mut bench.board.around.soc;
        let mut word = |address| soc.read(address, Size::Word, at).unwrap().value;
        assert_eq!(word(0x4002_3808) & 0xC, 0, "HSI");
        assert_eq!(word(0x4002_3830) & 0x1FF, 0, "ports");
        assert_eq!(word(0x4001_3800), 1, "MEMRMP");
        assert_eq!(soc.hz(), 16_000_000);
        let cpu = &mut bench.board.cpu;
        assert_eq!(cpu.registers.r[13], 0x2000_2D40, "the boot loader's stack");
        let mpu = cpu.system.read(0xE000_ED94, Size::Word, at).unwrap();
        assert_eq!(mpu, 0, "MPU_CTRL");
        let vtor = cpu.system.read(0xE000_ED08, Size::Word, at).unwrap();
        assert_eq!(vtor, 0, "VTOR: the vectors at 0 are the boot loader's");
    }
}

#[test]
fn a_request_is_refused_unless_the_inputs_are_open_and_the_device_idle() {
    let (mut bench, _) = Bench::boot_and_greet(powered(Board::Weact));
    bench.sensors.hand_stop = true;
    bench.run_us(5_000);
    let closed = bench.refusal(Request::EnterBootLoader).unwrap();
    assert_eq!(closed.0, Code::InputsClosed as u16);
    let (mut bench, _) = Bench::boot_and_greet(powered(Board::Reference));
    bench.sensors.hand_stop = false;
    bench.sensors.arm = false;
    bench.run_us(5_000);
    let none = bench.refusal(Request::EnterBootLoader).unwrap();
    assert_eq!(none.0, Code::NoBootLoader as u16);
    bench.run_us(200_000);
    assert_eq!(bench.board.last_reset(), None);
}

/// A word that is left in the register is cleared, and followed only after a reset by software.
#[test]
fn a_word_that_is_left_over_is_cleared_and_not_followed() {
    for cause in [
        ResetCause::PowerOn,
        ResetCause::Pin,
        ResetCause::BrownOut,
        ResetCause::Watchdog,
    ] {
        let (mut bench, _) = Bench::boot_and_greet(powered(Board::Weact));
        bench.board.around.soc.backup.put(REQUEST, WORD);
        bench.board.reset_with_cause(cause).unwrap();
        bench.run_on_ms(1);
        let hello = bench.after_reset();
        assert_eq!(hello.reset, cause);
        assert_eq!(bench.board.around.soc.backup.word(REQUEST), 0, "{cause:?}");
    }
    let (mut bench, _) = Bench::boot_and_greet(powered(Board::Weact));
    bench.board.around.soc.backup.put(REQUEST, WORD ^ 1);
    bench.board.reset_with_cause(ResetCause::Software).unwrap();
    bench.run_on_ms(1);
    bench.after_reset();
    bench.board.around.soc.backup.put(REQUEST, WORD);
    bench.board.reset_with_cause(ResetCause::Software).unwrap();
    run_into_boot_loader(&mut bench.board);
}

/// The boot loader of the chip starts an image without a reset, with the PLL on.
#[test]
fn an_image_that_starts_with_the_pll_on_resets_once_more() {
    for board in Board::ALL {
        let (mut bench, _) = Bench::boot_and_greet(powered(board));
        let reset = bench.board.image().reset;
        bench.leave_critical_section();
        bench.send_thread_to(reset, []);
        // The core may sleep until the next window's refill.
        bench.run_on_ms(1);
        assert!(bench.board.last_reset().is_some(), "{}", board.name());
        let hello = bench.after_reset();
        assert_eq!(hello.reset, ResetCause::Software);
    }
}
