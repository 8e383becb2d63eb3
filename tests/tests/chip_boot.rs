//! Boot tests of the flashed image before anything can be armed: RAM, its own flash, the watchdog's
//! oscillator; and the storage of a fault through resets.

use crate::chip_faults::Bench;
use firmware::link::message::ResetCause;
use firmware::link::{Code, HelloInfo, Request};
use firmware::safety::{Fault, FaultRecord, State};
use hal_sim::chip::board::{Board, CYCLES_PER_US};
use hal_sim::chip::cpu::{Bus, Size};
use hal_sim::chip::image::{FLASH, Image};
use hal_sim::chip::soc::Pace;
use hal_sim::images;
use tests::desk;

fn powered(image: Image) -> Board<()> {
    Board::power_on(image, desk::stages(24.0), Pace::Lazy, ()).unwrap()
}

/// Checks that the fault is reported by its number, and that neither acknowledging nor arming
/// works.
fn assert_refused(bench: &mut Bench, hello: &HelloInfo, fault: Fault) {
    let found = hello.last_fault.unwrap();
    let fault_record = FaultRecord {
        found_at_boot: true,
        detail: found.detail,
        ..FaultRecord::new(fault, found.at)
    };
    assert_eq!(
        (hello.state, hello.last_fault),
        (State::Fault, Some(fault_record))
    );
    let number = i32::from(fault.number());
    let latched = Some((Code::FaultLatched as u16, "fault".to_owned(), number));
    for request in [Request::Acknowledge, Request::Start] {
        assert_eq!(bench.refusal(request), latched);
    }
    assert_eq!(bench.refusal_to_arm(), latched);
    assert!(!bench.drives_within(20));
}

fn resets(bench: &mut Bench) {
    let cycle = bench.board.cpu.cycle;
    bench.board.around.soc.request_reset(cycle);
    bench.run_us(1_000);
}

/// A bit flips in an unused vector, after the last string, in a variable's initial value, or in the
/// checksum.
#[test]
fn a_turned_bit_in_flash_is_told_and_nothing_is_armed() {
    let image = desk::flashed_image();
    let length = image.flash.len() as u32;
    let variables = length - 4 - 0x100;
    for (at, bit) in [(0x184, 0), (0x184, 31), (variables, 3), (length - 4, 7)] {
        let (mut board, address) = (powered(image.clone()), FLASH.start + at);
        let flash = &mut board.around.soc.flash;
        let word = flash.peek(address, Size::Word);
        let turned = word ^ 1 << bit;
        flash.load(address, &turned.to_le_bytes()).unwrap();
        let (mut bench, hello) = Bench::boot_and_greet(board);
        println!("{address:#x} bit {bit}: {:?}", hello.last_fault);
        assert_refused(&mut bench, &hello, Fault::Flash);
        // After the flash is rewritten, the device still remembers the fault, as any other.
        let flash = &mut bench.board.around.soc.flash;
        flash.load(address, &word.to_le_bytes()).unwrap();
        resets(&mut bench);
        bench.recovers_after(ResetCause::Software, Fault::Flash);
    }
}

/// Another stream of DMA2 runs when the tape is about to start. The boot goes on without the tape, and
/// USB reports the fault with its detail.
#[test]
fn a_tape_that_does_not_start_is_told_and_nothing_is_armed() {
    const AHB1ENR: u32 = 0x4002_3830;
    /// DMA2_S0CR.
    const OTHER_STREAM: u32 = 0x4002_6410;
    let mut board = powered(desk::flashed_image());
    // After the check of the image; the tape's start switches DMA2 on.
    cycles_until(&mut board, AHB1ENR, 1 << 12, true);
    cycles_until(&mut board, AHB1ENR, 1 << 12, false);
    loop {
        let to = board.cpu.cycle + 4;
        board.run_to(to).unwrap();
        let read = board.around.soc.read(AHB1ENR, Size::Word, to).unwrap();
        if read.value & 1 << 22 != 0 {
            break;
        }
    }
    let at = board.cpu.cycle + 10;
    let soc = &mut board.around.soc;
    // TIM1_TRIG (channel 6), one word from SRAM to GPIOA_BSRR.
    let setting = 6 << 25 | 2 << 13 | 2 << 11 | 1 << 10 | 1 << 6;
    for (register, value) in [
        (OTHER_STREAM + 4, 1),
        (OTHER_STREAM + 8, 0x4002_0018),
        (OTHER_STREAM + 12, 0x2000_0000),
        (OTHER_STREAM, setting),
        (OTHER_STREAM, setting | 1),
    ] {
        soc.write(register, Size::Word, value, at).unwrap();
    }
    let (mut bench, hello) = Bench::boot_and_greet(board);
    println!("{:?}", hello.last_fault);
    assert_refused(&mut bench, &hello, Fault::TapeSlip);
    assert_eq!(hello.last_fault.unwrap().detail, 1 << 23);
    resets(&mut bench);
    bench.recovers_after(ResetCause::Software, Fault::TapeSlip);
}

#[test]
fn an_image_without_its_sum_is_not_whole() {
    let mut image = desk::flashed_image();
    let (rest, sum) = image.flash.split_last_chunk_mut::<4>().unwrap();
    assert_eq!(*sum, images::sum(rest).to_le_bytes());
    *sum = [0xFF; 4];
    let (mut bench, hello) = Bench::boot_and_greet(powered(image));
    assert_refused(&mut bench, &hello, Fault::Flash);
}

/// Tests the first and last word, statics, stack and tape.
#[test]
fn a_stuck_cell_of_ram_starts_nothing_and_is_recorded() {
    for (at, bit, is_high) in [
        (0x2000_0000, 0, true),
        (0x2000_4321, 5, false),
        (0x2001_BFF0, 7, true),
        (0x2001_C123, 1, false),
        (0x2001_FFFF, 7, false),
    ] {
        let mut board = powered(desk::flashed_image());
        board.around.soc.ram.stick(at, bit, is_high);
        board.run_to(4 * 16_000_000).unwrap(); // 4 s of HSI
        let cycle = board.cpu.cycle;
        let soc = &mut board.around.soc;
        let mut word = |address| soc.read(address, Size::Word, cycle).unwrap().value;
        let head = 0x4658_0000 | u32::from(Fault::Ram.number());
        // BKP0R and BKP12R: the fault and the address of the word.
        assert_eq!(word(0x4000_2850), head, "{at:#x}");
        assert_eq!(word(0x4000_2880), at & !3);
        // Ports B and C have no clock, so their pins are still inputs. The core sleeps.
        assert_eq!(word(0x4002_3830) & 0b110, 0);
        assert!(board.cpu.is_asleep());
        // After the cell recovers, the fault is reported and can be acknowledged.
        board.around.soc.ram.heal();
        board.around.soc.request_reset(cycle);
        board.run_to(cycle + 1_000).unwrap();
        let (mut bench, hello) = Bench::boot_and_greet(board);
        assert_eq!(hello.last_fault.map(|f| f.fault), Some(Fault::Ram));
        bench.expect_recovery();
    }
}

/// DS8626: 17 to 47 kHz.
#[test]
fn an_oscillator_outside_its_range_is_told_and_nothing_is_armed() {
    for (hz, is_whole) in [
        (1, false),
        (10_000, false),
        (16_900, false),
        (17_000, true),
        (32_000, true),
        (47_000, true),
        (47_200, false),
        (60_000, false),
    ] {
        let mut board = powered(desk::flashed_image());
        let cycle = board.cpu.cycle;
        board.around.soc.set_lsi_hz(hz, cycle);
        let (mut bench, hello) = Bench::boot_and_greet(board);
        println!("{hz} Hz: {:?}", hello.last_fault);
        if is_whole {
            assert_eq!(hello.last_fault, None);
        } else {
            assert_refused(&mut bench, &hello, Fault::Oscillator);
        }
    }
}

#[test]
fn the_first_fault_is_kept_with_what_came_after_it() {
    let (mut bench, at) = Bench::stimulating_in_pulse();
    bench.sensors.over_current = true;
    bench.expect_isolated(at, 5);
    bench.sensors.over_current = false;
    assert_eq!(bench.fault(), Some(Fault::OverCurrent));
    // A second fault, which resets; then power fails.
    bench.board.around.soc.supply(2_880);
    bench.run_us(100);
    bench.board.around.soc.supply(3_300);
    bench.run_us(1_000);
    let hello = bench.after_reset();
    let first = hello.last_fault.unwrap();
    assert_eq!(
        (hello.reset, first.fault),
        (ResetCause::Software, Fault::OverCurrent)
    );
    assert_ne!(first.residual, [0; 10]);
    assert_eq!(
        (first.later_faults, first.power_lost),
        (Fault::BrownOut.bit(), false)
    );
    bench.board.around.soc.lose_power();
    bench.run_us(1_000);
    let hello = bench.after_reset();
    let kept = FaultRecord {
        power_lost: true,
        ..first
    };
    assert_eq!(
        (hello.reset, hello.last_fault),
        (ResetCause::PowerOn, Some(kept))
    );
    bench.expect_recovery();
    // After the acknowledgement, the next fault counts as a first one again.
    bench.board.around.soc.supply(2_880);
    bench.run_us(100);
    bench.board.around.soc.supply(3_300);
    bench.run_us(1_000);
    let next = bench.after_reset().last_fault.unwrap();
    assert_eq!(next.fault, Fault::BrownOut);
    assert_eq!((next.later_faults, next.power_lost), (0, false));
}

/// Returns the core cycles from power-on until `bits` at `address` are set or clear, according to
/// `set`.
fn cycles_until(board: &mut Board<()>, address: u32, bits: u32, set: bool) -> u64 {
    loop {
        let to = board.cpu.cycle + 500;
        board.run_to(to).unwrap();
        let read = board.around.soc.read(address, Size::Word, to).unwrap();
        if (read.value & bits != 0) == set {
            return to;
        }
    }
}

/// Printed for docs/reference/hardware.md: 16 MHz before the crystal runs, the board's clock after.
#[test]
fn the_checks_take_less_than_a_tenth_of_a_second() {
    let mut board = powered(desk::flashed_image());
    const AHB1ENR: u32 = 0x4002_3830;
    const CSR: u32 = 0x4002_3874;
    // The march test ends before the first port has its clock.
    let ports = cycles_until(&mut board, AHB1ENR, 0b110, true);
    let crc = cycles_until(&mut board, AHB1ENR, 1 << 12, true);
    let lsi = cycles_until(&mut board, CSR, 1, true);
    let end = cycles_until(&mut board, CSR, 1, false);
    let us = |cycles: u64, mhz: u64| cycles / mhz;
    let (march, flash, oscillator) = (
        us(ports, 16),
        us(lsi - crc, CYCLES_PER_US),
        us(end - lsi, CYCLES_PER_US),
    );
    println!("RAM {march} us, flash {flash} us, LSI at 32 kHz {oscillator} us");
    assert!((90_000..120_000).contains(&march), "{march}"); // 192 KiB at 16 MHz
    assert!(flash < 10_000, "{flash}");
    assert!(oscillator < 5_000, "{oscillator}");
}
