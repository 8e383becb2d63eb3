//! Compares RCC with RM0090 chapter 7.

use super::*;
use crate::chip::soc::peripheral::{Peripheral, WordAccess};

const CR: u32 = 0x00;
const PLLCFGR: u32 = 0x04;
const CFGR: u32 = 0x08;
const CIR: u32 = 0x0C;
const CSR: u32 = 0x74;

/// Clocks of the board: HSE 8 MHz, M 4, N 168, P 2, Q 7, APB1 / 4, APB2 / 2.
fn at_168_mhz() -> (Rcc, Cycle) {
    let mut rcc = Rcc::new(Crystal::new(8_000_000));
    rcc.set(CR, 0x0001_0083, 0);
    let at = rcc.next_event();
    assert_eq!(at, 32_000, "2 ms at 16 MHz");
    rcc.set(PLLCFGR, 0x2740_2A04, at);
    rcc.set(CR, 0x0101_0083, at);
    let at = rcc.next_event();
    assert_eq!(at, 36_800, "300 us more");
    rcc.set(CFGR, 0x9400 | 2, at);
    (rcc, at)
}

#[test]
fn reset_values_are_those_of_the_manual() {
    let mut rcc = Rcc::new(Crystal::new(8_000_000));
    for (offset, value) in [
        (CR, 0x83),
        (PLLCFGR, 0x2400_3010),
        (CFGR, 0),
        (CIR, 0),
        (0x10, 0),
        (0x30, 0x0010_0000),
        (0x40, 0),
        (0x44, 0),
        (0x50, 0x7E67_91FF),
        (0x54, 0xF1),
        (0x60, 0x36FE_C9FF),
        (0x64, 0x0007_5F33),
        (0x70, 0),
        (CSR, 0x0E00_0000),
        (0x84, 0x2000_3000),
    ] {
        assert_eq!(rcc.get(offset, 0), value, "offset {offset:#x}");
    }
}

#[test]
fn the_boards_clock_tree() {
    let (mut rcc, at) = at_168_mhz();
    let clocks = Clocks {
        hclk_hz: 168_000_000,
        pclk1_hz: 42_000_000,
        pclk2_hz: 84_000_000,
        timer1_hz: 84_000_000,
        timer2_hz: 168_000_000,
        usb_hz: 48_000_000,
    };
    assert_eq!(rcc.take_change(), Some(clocks));
    assert_eq!(rcc.take_change(), None);
    assert_eq!(rcc.get(CFGR, at), 0x940A, "SWS follows SW");
    assert_eq!(rcc.get(CR, at), 0x0303_0083);
    assert_eq!((clocks.apb1_divider(), clocks.timer1_divider()), (4, 2));
}

#[test]
fn each_oscillator_is_ready_after_its_start_up_and_not_before() {
    let mut rcc = Rcc::new(Crystal::new(8_000_000));
    rcc.set(CR, 0x0001_0083, 100);
    assert_eq!(rcc.get(CR, 32_099), 0x0001_0083);
    assert_eq!(rcc.get(CR, 32_100), 0x0003_0083);
    rcc.set(CSR, 1, 32_100);
    assert_eq!(rcc.get(CSR, 32_339) & 3, 1);
    assert_eq!(rcc.get(CSR, 32_340) & 3, 3, "15 us");
    rcc.set(CR, 0x0000_0083, 40_000);
    assert_eq!(rcc.get(CR, 40_000), 0x0000_0083, "off at once");
}

#[test]
fn the_switch_waits_for_its_source() {
    let mut rcc = Rcc::new(Crystal::new(8_000_000));
    rcc.set(CR, 0x0001_0083, 0);
    rcc.set(CFGR, 1, 10);
    assert_eq!(rcc.get(CFGR, 10), 1, "SWS is HSI still");
    assert_eq!(rcc.get(CFGR, 32_000), 5);
    assert_eq!(rcc.clocks.hclk_hz, 8_000_000);
}

#[test]
fn what_drives_the_core_stays_on() {
    let (mut rcc, at) = at_168_mhz();
    rcc.set(CR, 0x0000_0083, at);
    assert_eq!(rcc.get(CR, at), 0x0303_0083);
    rcc.set(CR, 0x0101_0082, at);
    assert_eq!(rcc.get(CR, at) & 3, 0, "HSI is not needed");
}

#[test]
fn clock_security_falls_back_to_hsi_with_nmi() {
    let (mut rcc, at) = at_168_mhz();
    rcc.set(CR, 0x0109_0083, at);
    rcc.take_change();
    rcc.stop_hse(at).unwrap();
    assert!(rcc.cssf);
    assert_eq!(rcc.get(CIR, at), 1 << 7);
    assert_eq!(rcc.get(CFGR, at), 0x9400, "HSI; prescalers stay");
    assert_eq!(rcc.get(CR, at), 0x0008_0083, "PLL and HSE are off");
    let clocks = rcc.take_change().unwrap();
    assert_eq!(clocks.hclk_hz, 16_000_000);
    assert_eq!((clocks.pclk1_hz, clocks.usb_hz), (4_000_000, 0));
    rcc.set(CIR, 1 << 23, at);
    assert!(!rcc.cssf);
}

#[test]
fn without_clock_security_a_failed_crystal_leaves_no_clock() {
    let (mut rcc, at) = at_168_mhz();
    assert!(rcc.stop_hse(at).is_err());
    let mut idle = Rcc::new(Crystal::new(8_000_000));
    idle.stop_hse(0).unwrap();
    idle.set(CR, 0x0001_0083, 0);
    assert_eq!(idle.get(CR, 1_000_000), 0x0001_0083, "never ready");
}

#[test]
fn limits_and_misuse_stop_the_run() {
    let (rcc, at) = at_168_mhz();
    for (offset, value) in [
        (PLLCFGR, 0x2740_2A05), // the PLL is on
        (CFGR, 0x9000 | 2),     // APB1 at 168 MHz
        (CFGR, 0x1400 | 2),     // APB2 at 168 MHz
        (CFGR, 3),              // no such source
        (0x58, 0),              // low-power enables
        (0x28, 0),              // no register there
    ] {
        let mut rcc = rcc.clone();
        assert!(rcc.write(offset, value, at).is_err(), "{value:#x}");
    }
    for pllcfgr in [0x2740_2A02, 0x2740_6C04, 0x2140_2A04, 0x2740_0184] {
        assert!(
            tree::Pll::decode(pllcfgr, 8_000_000, &Limits::DATA_SHEET).is_err(),
            "{pllcfgr:#x}"
        );
    }
}

#[test]
fn a_factor_that_turns_by_itself_multiplies_at_once() {
    let (mut rcc, at) = at_168_mhz();
    // PLLN 168 without bit 3: 160.
    assert_eq!(rcc.upset(PLLCFGR, 1 << 9, at), Ok(true));
    assert_eq!(rcc.clocks.hclk_hz, 160_000_000);
    assert!(!rcc.exceeds_data_sheet());
    assert_eq!(rcc.upset(CSR, 1, at), Ok(false), "a write does that");
    let mut off = Rcc::new(Crystal::new(8_000_000));
    assert_eq!(off.upset(PLLCFGR, 1 << 9, 0), Ok(false));
}

/// Beyond the data sheet, as far as the chip is known to run: [`Limits::KNOWN`].
#[test]
fn a_factor_that_turns_by_itself_may_leave_the_data_sheet() {
    let (board, at) = at_168_mhz();
    for (bit, hz) in [
        (6, 169_000_000),  // N 169
        (12, 232_000_000), // N 232: VCO 464 MHz
        (13, 40_000_000),  // N 40: VCO 80 MHz
        (5, 18_666_666),   // M 36: 0.2 MHz in
    ] {
        let mut rcc = board.clone();
        assert_eq!(rcc.upset(PLLCFGR, 1 << bit, at), Ok(true), "bit {bit}");
        assert_eq!((rcc.clocks.hclk_hz, rcc.exceeds_data_sheet()), (hz, true));
        assert_eq!(rcc.upset(PLLCFGR, 1 << bit, at), Ok(true));
        assert_eq!(
            (rcc.clocks.hclk_hz, rcc.exceeds_data_sheet()),
            (168_000_000, false)
        );
    }
    for (bit, hz) in [(10, 84_000_000), (12, 168_000_000)] {
        let mut rcc = board.clone();
        assert_eq!(rcc.upset(CFGR, 1 << bit, at), Ok(true));
        assert_eq!((rcc.clocks.pclk1_hz, rcc.exceeds_data_sheet()), (hz, true));
    }
    // M 0; N 424, VCO 848 MHz; HSI, VCO 672 MHz. SW 3; APB2 at 168 MHz.
    for (offset, bit) in [
        (PLLCFGR, 2),
        (PLLCFGR, 14),
        (PLLCFGR, 22),
        (CFGR, 0),
        (CFGR, 15),
    ] {
        assert!(board.clone().upset(offset, 1 << bit, at).is_err(), "{bit}");
    }
}

#[test]
fn blocks_are_enabled_and_reset_by_their_bits() {
    let mut rcc = Rcc::new(Crystal::new(8_000_000));
    assert_eq!(rcc.is_enabled(Block::Spi(3), 0), Ok(false));
    rcc.set(0x40, 1 << 15, 100);
    assert!(rcc.is_enabled(Block::Spi(3), 101).is_err(), "ES0182");
    assert_eq!(rcc.is_enabled(Block::Spi(3), 102), Ok(true));
    assert_eq!(rcc.is_enabled(Block::Timer(5), 101), Ok(false));
    rcc.set(0x20, 1 << 15 | 1 << 3, 200);
    assert_eq!(
        rcc.is_enabled(Block::Spi(3), 200),
        Ok(false),
        "held in reset"
    );
    let edges: Vec<_> = rcc.take_resets().collect();
    assert_eq!(edges, [Block::Timer(5), Block::Spi(3)]);
    rcc.set(0x20, 1 << 15, 201);
    assert_eq!(rcc.take_resets().count(), 0);
    rcc.set(0x20, 0, 202);
    assert_eq!(rcc.is_enabled(Block::Spi(3), 202), Ok(true));
    let mut places = Block::ALL.map(Block::place);
    places.sort_unstable();
    assert!(
        places.windows(2).all(|pair| pair[0] != pair[1]),
        "{places:?}"
    );
}

#[test]
fn causes_of_reset_add_up_until_they_are_removed() {
    let (mut rcc, _) = at_168_mhz();
    rcc.set(CSR, 1 << 24, 40_000);
    assert_eq!(rcc.get(CSR, 40_000), 0);
    for (cause, flags) in [
        (Cause::Watchdog, 0x2400_0000),
        (Cause::Software, 0x3400_0000),
        (Cause::Pin, 0x3400_0000),
        (Cause::BrownOut, 0x3600_0000),
        (Cause::PowerOn, 0x0E00_0000),
    ] {
        rcc.reset(cause);
        assert_eq!(rcc.get(CSR, 40_000), flags, "{cause:?}");
    }
    assert_eq!(rcc.take_change().map(|c| c.hclk_hz), Some(16_000_000));
}

#[test]
fn the_backup_domain_is_reset_only_when_it_can_be_written() {
    let mut rcc = Rcc::new(Crystal::new(8_000_000));
    rcc.set(0x70, 1 << 16, 0);
    assert!(!rcc.take_backup_reset());
    rcc.set_backup_writable(true);
    rcc.set(0x70, 1 << 16, 0);
    rcc.set(0x70, 0, 0);
    assert!(rcc.take_backup_reset());
    assert!(!rcc.take_backup_reset());
    assert!(rcc.write(0x70, 1, 0).is_err(), "LSE");
}

/// 210 MHz is above the data sheet, but the registers do not select it.
#[test]
fn a_pll_that_is_wrong_shows_in_no_register() {
    for hz in [84_000_000, 210_000_000] {
        let (mut rcc, at) = at_168_mhz();
        let registers = [CR, PLLCFGR, CFGR, CSR].map(|offset| rcc.get(offset, at));
        rcc.take_change();
        rcc.set_pll_hz(hz, at).unwrap();
        let clocks = rcc.take_change().unwrap();
        assert_eq!((clocks.hclk_hz, clocks.apb1_divider()), (hz, 4));
        assert_eq!(clocks.usb_hz, hz / 7 * 2);
        assert!(!rcc.matches_registers());
        let after = [CR, PLLCFGR, CFGR, CSR].map(|offset| rcc.get(offset, at));
        assert_eq!(after, registers);
    }
}
