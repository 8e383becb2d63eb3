//! Self-test at each boot: verifies the image in flash and the watchdog's oscillator before
//! anything may be armed. RAM was tested before ([`super::march`]).

use super::image_record::{__vector_table, IMAGE_SUM};
use super::pac::timer::vals;
use super::pac::{CRC, RCC, TIM5};
use super::record;
use super::timebase::CYCLES_PER_US;
use super::wait::within;
use crate::safety::{Fault, FaultRecord};
use embassy_time::TICK_HZ;

/// Tests flash and oscillator. Records a failure and returns it; the fault stays latched until a
/// boot without it.
///
/// Called once and not inlined, because the caller's frame lies below every other frame.
#[must_use]
#[inline(never)]
pub fn failure() -> Option<FaultRecord> {
    let (fault, detail) = flash().or_else(oscillator)?;
    Some(record::keep_found_at_boot(fault, detail))
}

/// Computes the CRC of image and checksum with the chip's CRC unit; the remainder must be 0 (RM0090
/// section 4). The detail of a failure is the remainder.
fn flash() -> Option<(Fault, u32)> {
    RCC.ahb1enr().modify(|w| w.set_crcen(true));
    let _ = RCC.ahb1enr().read(); // ES0182: delay after clock enabling
    CRC.cr().write(|w| w.set_reset(true));
    let end = (&raw const IMAGE_SUM).wrapping_add(1);
    let mut at = &raw const __vector_table;
    while at < end {
        // SAFETY: `at` lies in flash between its start and `end`, one past the checksum, and is
        // aligned. The access is volatile because the compiler believes it knows the image's
        // content.
        CRC.dr().write_value(unsafe { at.read_volatile() });
        at = at.wrapping_add(1);
    }
    let left = CRC.dr().read();
    RCC.ahb1enr().modify(|w| w.set_crcen(false));
    (left != 0).then_some((Fault::Flash, left))
}

/// Range of the LSI, Hz (DS8626, LSI oscillator characteristics); within it the watchdog resets in
/// 4 to 12 ms.
const LSI_HZ: (u32, u32) = (17_000, 47_000);
/// Number of captures in one measurement.
const CAPTURES: u32 = 8;
/// Number of LSI periods in one measurement: channel 4 captures every eighth edge.
const PERIODS: u32 = 8 * CAPTURES;
/// Longest wait for one capture, core cycles: 2 ms, two and a half times the time at 10 kHz.
const PATIENCE: u32 = 2_000 * CYCLES_PER_US;

/// Checks that the number of TIM5 counts during [`PERIODS`] LSI periods fits [`LSI_HZ`], plus or
/// minus one count. The detail of a failure is that number, or 0 if nothing could be measured.
fn oscillator() -> Option<(Fault, u32)> {
    // No interrupt of TIM5 may clear the flag meanwhile; the counter keeps running.
    let counts = cortex_m::interrupt::free(|_| measure()).unwrap_or(0);
    let ticks = PERIODS * TICK_HZ as u32; // 64,000,000
    let (low, high) = LSI_HZ;
    let is_slow = counts.saturating_sub(1) > ticks / low;
    let is_fast = counts.saturating_add(1) < ticks / high;
    (counts == 0 || is_slow || is_fast).then_some((Fault::Oscillator, counts))
}

/// Returns the number of TIM5 counts during [`PERIODS`] LSI periods. TIM5 belongs to the time
/// driver, which counts microseconds of the crystal with it and uses channels 1 and 2. Channel 4 is
/// free, and its input can be the LSI (RM0090 section 18.4.21, TIM5_OR). Restores all settings at
/// the end.
fn measure() -> Option<u32> {
    RCC.csr().modify(|w| w.set_lsion(true));
    TIM5.or().write_value(0b01 << 6); // TI4_RMP: LSI
    TIM5.ccmr_input(1).write(|w| {
        w.set_ccs(1, vals::CcmrInputCcs::from_bits(0b01)); // CC4S: IC4 on TI4
        w.set_icpsc(1, 0b11); // every eighth edge
    });
    TIM5.ccer().write(|w| w.set_cce(3, true));
    let counts = periods();
    TIM5.ccer().write(|_| ());
    TIM5.ccmr_input(1).write(|_| ());
    TIM5.or().write_value(0);
    // The watchdog turns the LSI on by itself (section 21.3).
    RCC.csr().modify(|w| w.set_lsion(false));
    counts
}

/// Waits until the LSI has started, and returns the number of TIM5 counts during [`PERIODS`] LSI
/// periods.
fn periods() -> Option<u32> {
    within(PATIENCE, || RCC.csr().read().lsirdy())?;
    let first = capture()?;
    let mut last = first;
    for _ in 0..CAPTURES {
        last = capture()?;
    }
    // 16 bits: the time driver lets its counter wrap at 65,535.
    Some((last.wrapping_sub(first)) & 0xFFFF)
}

/// Waits for channel 4's next capture and returns it; reading clears the flag.
fn capture() -> Option<u32> {
    within(PATIENCE, || TIM5.sr().read().ccif(3))?;
    Some(TIM5.ccr(3).read())
}
