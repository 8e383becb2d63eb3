//! Compares the ADC with RM0090 chapter 13.

use super::*;
use crate::chip::soc::peripheral::{Peripheral, WordAccess};

const SR: u32 = 0;
const CR1: u32 = 4;
const CR2: u32 = 8;
const SMPR2: u32 = 0x10;
const JSQR: u32 = 0x38;
const JDR1: u32 = 0x3C;
const JDR2: u32 = 0x40;
const CCR: u32 = 0x304;
/// JEXTSEL TIM2_TRGO, JEXTEN rising, ADON.
const ARMED: u32 = 0x0013_0001;

/// Settings of the board: 168 MHz, APB2 / 2, / 4: 8 cycles per clock; channel 1 for 15 clocks, then
/// channel 0 for 84.
fn board() -> Adc {
    let mut adc = Adc::default();
    adc.set_clock(168_000_000, 2);
    adc.set(CCR, 1 << 16, 0);
    adc.set(CR1, 1 << 8, 0);
    adc.set(SMPR2, 1 << 3 | 4, 0);
    adc.set(JSQR, 1 << 20 | 1 << 10, 0);
    adc.set(CR2, ARMED, 0);
    adc
}

#[test]
fn a_trigger_converts_both_channels_at_their_exact_times() {
    let mut adc = board();
    adc.trigger(1000).unwrap();
    let first = 1000 + 8 * (3 + 15);
    assert_eq!(
        adc.next_sample(),
        Some(Sample {
            at: first,
            channel: 1
        })
    );
    assert_eq!(adc.next_event(), first);
    adc.deliver_sample(0x123);
    assert_eq!(adc.next_sample(), None);
    assert_eq!(adc.get(SR, first), 8, "JSTRT");
    let second = first + 8 * (12 + 84);
    adc.advance(first + 8 * 12).unwrap();
    assert_eq!(adc.get(JDR1, first + 8 * 12), 0x123);
    assert_eq!(
        adc.next_sample(),
        Some(Sample {
            at: second,
            channel: 0
        })
    );
    adc.deliver_sample(0xFFF);
    let end = second + 8 * 12;
    assert_eq!(adc.next_event(), end);
    assert_eq!(adc.get(SR, end - 1), 8);
    assert_eq!(adc.get(SR, end), 8 | 4, "JEOC");
    assert_eq!(adc.get(JDR2, end), 0xFFF);
    assert_eq!(adc.next_event(), Cycle::MAX);
    // Within the 8 µs that the firmware allows.
    assert!((end - 1000) < 8 * 168);
}

#[test]
fn flags_clear_by_writing_0_and_ignore_1() {
    let mut adc = board();
    adc.trigger(1000).unwrap();
    adc.deliver_sample(1);
    adc.advance(1300).unwrap();
    adc.deliver_sample(2);
    adc.advance(3000).unwrap();
    adc.set(SR, u32::MAX, 3000);
    assert_eq!(adc.get(SR, 3000), 0xC);
    adc.set(SR, !4, 3000);
    assert_eq!(adc.get(SR, 3000), 8);
    adc.set(SR, !8, 3000);
    assert_eq!(adc.get(SR, 3000), 0);
    assert_eq!(adc.get(0x300, 3000), 0);
}

#[test]
fn the_interrupt_follows_jeoc_and_jeocie() {
    let mut adc = board();
    adc.set(CR1, 1 << 8 | 1 << 7, 0);
    adc.trigger(1000).unwrap();
    adc.deliver_sample(1);
    adc.advance(1300).unwrap();
    adc.deliver_sample(2);
    assert!(!adc.interrupt());
    adc.advance(3000).unwrap();
    assert!(adc.interrupt());
    adc.set(SR, 0, 3000);
    assert!(!adc.interrupt());
}

#[test]
fn a_group_of_one_is_jsq4_and_of_four_starts_at_jsq1() {
    let mut adc = board();
    adc.set(JSQR, 7 << 15, 0);
    adc.trigger(1000).unwrap();
    assert_eq!(adc.next_sample().map(|s| s.channel), Some(7));
    let mut adc = board();
    adc.set(JSQR, 3 << 20 | 4 << 15 | 3 << 10 | 2 << 5 | 1, 0);
    adc.trigger(1000).unwrap();
    for channel in 1..=4 {
        let sample = adc.next_sample().unwrap();
        assert_eq!(sample.channel, channel);
        adc.deliver_sample(100 + u16::from(channel));
        adc.advance(adc.next_event()).unwrap();
    }
    assert_eq!(adc.next_sample(), None);
    let results = [0, 4, 8, 12].map(|n| adc.get(JDR1 + n, 9000));
    assert_eq!(results, [101, 102, 103, 104]);
}

#[test]
fn sampling_times_resolutions_offsets_and_alignment() {
    for (bits, clocks) in [
        (0, 3),
        (1, 15),
        (2, 28),
        (3, 56),
        (4, 84),
        (5, 112),
        (6, 144),
        (7, 480),
    ] {
        let mut adc = board();
        adc.set(SMPR2, bits << 3, 0);
        adc.trigger(1000).unwrap();
        let expected = Some(1000 + 8 * (3 + clocks));
        assert_eq!(adc.next_sample().map(|s| s.at), expected);
    }
    // RES, ALIGN, offset, JDR1 for 0xABC.
    for (res, align, offset, jdr, clocks) in [
        (0, 0, 0, 0x0ABC, 12),
        (0, 1, 0, 0x55E0, 12),
        (0, 0, 0xABD, 0xFFFF, 12),
        (0, 1, 0xABD, 0xFFF8, 12),
        (1, 0, 0, 0x02AF, 10),
        (2, 0, 0, 0x00AB, 8),
        (2, 1, 0, 0x5580, 8),
        (3, 0, 0, 0x002A, 6),
        (3, 1, 0, 0x0054, 6),
    ] {
        let mut adc = board();
        adc.set(CR1, res << 24, 0);
        adc.set(0x14, offset, 0);
        adc.set(JSQR, 1 << 15, 0);
        adc.set(CR2, ARMED | align << 11, 0);
        adc.trigger(1000).unwrap();
        let held = adc.next_sample().unwrap().at;
        adc.deliver_sample(0xABC);
        assert_eq!(adc.next_event(), held + 8 * clocks);
        assert_eq!(adc.get(JDR1, 5000), jdr, "RES {res} ALIGN {align}");
    }
}

#[test]
fn triggers_that_do_not_count_and_those_that_stop_the_run() {
    let mut adc = board();
    assert!(adc.clone().trigger(503).is_err(), "3 us after ADON");
    assert!(adc.clone().trigger(504).is_ok());
    adc.trigger(1000).unwrap();
    assert!(adc.clone().trigger(1200).is_err(), "converting");
    assert!(adc.clone().advance(5000).is_err(), "no input");
    assert!(adc.write(SMPR2, 0, 1001).is_err(), "converting");
    adc.set(CR2, 0, 1002);
    assert_eq!(adc.next_sample(), None, "ADON off aborts");
    adc.trigger(1100).unwrap();
    assert_eq!(adc.next_sample(), None, "off");
    let mut adc = board();
    adc.set(CCR, 0, 0);
    assert!(adc.trigger(1000).is_err(), "42 MHz");
}

/// Section 13.3.3: a new group begins at once; 13.3.8: without SCAN only the first channel is
/// converted.
#[test]
fn a_group_that_changes_begins_anew_and_without_scan_its_first_is_all() {
    let mut adc = board();
    adc.trigger(1000).unwrap();
    adc.deliver_sample(1);
    adc.advance(1300).unwrap();
    adc.set(JSQR, 7 << 15, 1310);
    let sample = adc.next_sample();
    assert_eq!(
        sample.map(|sample| (sample.at, sample.channel)),
        Some((1310 + 8 * 3, 7))
    );
    let mut adc = board();
    adc.trigger(1000).unwrap();
    adc.set(CR1, 0, 1001);
    assert!(adc.write(CR1, 1 << 24, 1001).is_err(), "RES");
    adc.deliver_sample(5);
    assert_eq!(adc.get(SR, 1000 + 8 * 30), 8 | 4, "JEOC");
    assert_eq!((adc.get(JDR1, 1300), adc.next_sample()), (5, None));
}

#[test]
fn the_rest_is_not_modelled() {
    let mut adc = board();
    for (offset, value) in [
        (CR2, ARMED | 1 << 30), // SWSTART
        (CR2, ARMED | 1 << 22), // JSWSTART
        (CR1, 1 << 10),         // JAUTO
        (CCR, 1 << 23),         // TSVREFE
        (0x34, 0),              // SQR3
        (0x108, 1),             // ADC2
    ] {
        assert!(adc.write(offset, value, 0).is_err(), "{offset:#x}");
    }
    assert!(adc.read(0x4C, 0).is_err());
    // With another trigger source, TIM2's trigger is ignored.
    adc.set(CR2, 0x0011_0001, 0);
    adc.trigger(1_000_000).unwrap();
    assert_eq!(adc.next_sample(), None);
}
