//! Crystals: the board's own, another one, none, a late one, one that is off its frequency.

use super::{BREADBOARDS, HSI_MS, end_of_ram_test, power_on, run_until};
use crate::chip_faults::Bench;
use firmware::link::message::ResetCause;
use firmware::safety::Fault;
use hal_sim::chip::board::{Board as SimulatedBoard, Hardware};
use hal_sim::chip::soc::rcc::Crystal;
use host_core::run::Board;

/// Backup registers with the failure and its value, and the codes of the failures (docs/evidence/faults.md).
const FAILURE: usize = 15;
const VALUE: usize = 16;
const MISSING: u32 = 1;
const WRONG: u32 = 2;
const SUPPLY_LOW: u32 = 4;

fn with_crystal(board: Board, hz: u32, start_ns: Option<u64>) -> SimulatedBoard<()> {
    let hardware = Hardware {
        crystal: Crystal { hz, start_ns },
        ..Hardware::new(board.wiring())
    };
    power_on(board, &hardware)
}

/// Returns the code in the backup registers; `None` if there is none.
fn code(board: &SimulatedBoard<()>) -> Option<u32> {
    let word = board.around.soc.backup.word(FAILURE);
    (word >> 16 == 0x4255).then_some(word & 0xFF)
}

/// Returns the count of equal failures in the backup registers.
fn count(board: &SimulatedBoard<()>) -> u32 {
    board.around.soc.backup.word(FAILURE) >> 8 & 0xFF
}

const TYPICAL: Option<u64> = Some(2_000_000);

#[test]
fn another_crystal_is_reported_within_30_ms_of_the_ram_test() {
    for board in Board::ALL {
        for hz in [8_000_000, 12_000_000, 16_000_000, 25_000_000] {
            if hz == board.wiring().crystal_hz {
                continue;
            }
            let mut simulated = with_crystal(board, hz, TYPICAL);
            let ram = end_of_ram_test(&mut simulated);
            let at = run_until(&mut simulated, 100, |board| code(board).is_some());
            assert_eq!(code(&simulated), Some(WRONG), "{} {hz}", board.name());
            assert!(at - ram < 30 * HSI_MS, "{} ms", (at - ram) / HSI_MS);
            let measured = simulated.around.soc.backup.word(VALUE);
            assert!(measured.abs_diff(hz) < hz / 500, "{hz}: {measured}");
            println!(
                "{}, {hz} Hz: reported {:.1} ms after the RAM test as {measured} Hz",
                board.name(),
                (at - ram) as f64 / HSI_MS as f64
            );
            if board != Board::Reference {
                let lit = run_until(&mut simulated, 5, |b| is_lit(b));
                assert!(lit - ram < 30 * HSI_MS);
            }
            assert_eq!(
                blinks(&mut simulated, board),
                if board == Board::Reference { 0 } else { 2 }
            );
            assert!(!simulated.around.host.is_open());
            // The fault is kept: with the right crystal, the next boot reports it.
            assert_eq!(simulated.around.soc.backup.word(0) & 0xFFFF, 9);
            assert_eq!(simulated.around.soc.backup.word(12), measured);
        }
    }
}

fn is_lit(board: &SimulatedBoard<()>) -> bool {
    board.around.led().back().is_some_and(|change| change.1)
}

/// Returns how often the diode lights between two long pauses.
fn blinks(simulated: &mut SimulatedBoard<()>, board: Board) -> usize {
    simulated
        .run_to(simulated.cpu.cycle + 5_000 * HSI_MS)
        .unwrap();
    let changes: Vec<_> = simulated.around.led().iter().copied().collect();
    let lit: Vec<u64> = changes.iter().filter(|c| c.1).map(|c| c.0).collect();
    let pauses: Vec<usize> = (1..lit.len())
        .filter(|&n| lit[n] - lit[n - 1] > 700 * HSI_MS)
        .collect();
    if board == Board::Reference {
        assert!(lit.is_empty());
        return 0;
    }
    assert!(pauses.len() >= 2, "{lit:?}");
    pauses[1] - pauses[0]
}

#[test]
fn a_missing_crystal_is_tried_three_times_and_then_reported_for_ever() {
    for board in Board::ALL {
        let mut simulated = with_crystal(board, board.wiring().crystal_hz, None);
        let ram = end_of_ram_test(&mut simulated);
        let at = run_until(&mut simulated, 100, |board| code(board).is_some());
        assert_eq!((code(&simulated), count(&simulated)), (Some(MISSING), 1));
        println!(
            "{}: reported {:.1} ms after the RAM test",
            board.name(),
            (at - ram) as f64 / HSI_MS as f64
        );
        assert!(at - ram < 30 * HSI_MS, "{} ms", (at - ram) / HSI_MS);
        if board != Board::Reference {
            let lit = run_until(&mut simulated, 5, |b| is_lit(b));
            assert!(lit - ram < 30 * HSI_MS);
        }
        simulated
            .run_to(simulated.cpu.cycle + 1_000 * HSI_MS)
            .unwrap();
        assert_eq!((code(&simulated), count(&simulated)), (Some(MISSING), 3));
        let last = simulated.last_reset().unwrap();
        assert_eq!(
            blinks(&mut simulated, board),
            usize::from(board != Board::Reference)
        );
        assert_eq!(
            simulated.last_reset(),
            Some(last),
            "{}: it stays",
            board.name()
        );
        assert_eq!(simulated.around.soc.backup.word(0) & 0xFFFF, 9);
        assert!(!simulated.around.host.is_open());
    }
}

#[test]
fn a_late_crystal_boots_and_leaves_no_fault() {
    for ms in [1, 24, 26, 60, 99] {
        let mut simulated = with_crystal(Board::Weact, 8_000_000, Some(ms * 1_000_000));
        let ram = end_of_ram_test(&mut simulated);
        run_until(&mut simulated, 30, |b| b.cpu.cycle > ram + 27 * HSI_MS);
        let expected = (ms > 25).then_some(MISSING);
        assert_eq!(code(&simulated), expected, "{ms} ms");
        let (bench, hello) = Bench::boot_and_greet(simulated);
        assert_eq!(
            (hello.last_fault, hello.reset),
            (None, ResetCause::PowerOn),
            "{ms} ms"
        );
        assert_eq!(code(&bench.board), None, "{ms} ms");
    }
}

#[test]
fn a_low_supply_is_reported_while_the_board_waits_for_it() {
    for board in Board::ALL {
        let mut simulated = with_crystal(board, board.wiring().crystal_hz, TYPICAL);
        simulated.around.soc.supply(2_880);
        end_of_ram_test(&mut simulated);
        run_until(&mut simulated, 1_000, |board| code(board).is_some());
        assert_eq!(code(&simulated), Some(SUPPLY_LOW), "{}", board.name());
        if board != Board::Reference {
            // Three seconds at 168 MHz.
            run_until(&mut simulated, 31_500, |b| b.around.led().len() >= 9);
            let lit: Vec<u64> = simulated
                .around
                .led()
                .iter()
                .filter(|c| c.1)
                .map(|c| c.0)
                .collect();
            let gaps: Vec<_> = lit
                .windows(2)
                .map(|pair| (pair[1] - pair[0]) / 16_800_000)
                .collect();
            assert_eq!(
                gaps,
                [4, 4, 4, 12],
                "tenths of a second between four blinks, and then"
            );
        }
        assert!(!simulated.around.host.is_open());
        simulated.around.soc.supply(3_300);
        let (bench, hello) = Bench::boot_and_greet(simulated);
        assert_eq!((hello.last_fault, hello.reset), (None, ResetCause::PowerOn));
        assert_eq!(code(&bench.board), None);
    }
}

/// A crystal that is 1 % off is found by the host's frames, and one that is 50 ppm off by nothing.
#[test]
fn a_crystal_slightly_off_is_found_by_usb_or_not_at_all() {
    for (board, ppm, is_found) in [
        (Board::Weact, 50, false),
        (Board::Weact, -50, false),
        (Board::Feather, 50, false),
        (Board::Weact, 10_000, true),
        (Board::Feather, -10_000, true),
    ] {
        let nominal = i64::from(board.wiring().crystal_hz);
        let hz = (nominal + nominal * ppm / 1_000_000) as u32;
        let (mut bench, hello) = Bench::boot_and_greet(with_crystal(board, hz, TYPICAL));
        assert_eq!(hello.last_fault, None, "{ppm} ppm");
        assert!(hello.crystal_hz.abs_diff(hz) < hz / 500, "{hello:?}");
        bench.run_us(5_000_000);
        let fault = bench.fault();
        println!("{} {ppm} ppm: {fault:?}", board.name());
        assert_eq!(fault, is_found.then_some(Fault::TimeBase), "{ppm} ppm");
        if is_found {
            assert_eq!(bench.fault_detail(), Some(2), "by the host's frames");
        }
    }
}

#[test]
fn a_breadboard_needs_no_vbus_sense() {
    for board in BREADBOARDS {
        let (mut bench, _) = Bench::boot_and_greet(super::powered(board));
        let at = bench.board.cpu.cycle;
        bench.board.around.plug(false, at);
        bench.run_us(50_000);
        let at = bench.board.cpu.cycle;
        bench.board.around.plug(true, at);
        bench.after_reset(); // enumerates again, without a reset
        assert_eq!(bench.board.last_reset(), None);
    }
}
