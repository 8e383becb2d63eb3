//! Compares the flash with RM0090 chapter 3 and the times of DS8626.

use super::*;
use crate::chip::soc::peripheral::{Peripheral, WordAccess};
use crate::chip::soc::uid::Signature;

const ACR: u32 = 0x00;
const KEYR: u32 = 0x04;
const SR: u32 = 0x0C;
const CR: u32 = 0x10;
const PRFTEN: u32 = 1 << 8;
const ICEN: u32 = 1 << 9;
const DCEN: u32 = 1 << 10;
const ICRST: u32 = 1 << 11;
const DCRST: u32 = 1 << 12;

/// Flash with 5 wait states and `bits` of ACR.
fn flash(bits: u32) -> Flash {
    let mut flash = Flash::default();
    flash.set(ACR, 5 | bits, 0);
    flash
}

fn data_wait(flash: &mut Flash, address: u32, at: Cycle) -> u32 {
    flash.read(address, Size::Word, at).unwrap().wait
}

/// Runs through lines from cycle `at` on, stays in each for `cycles` after its arrival, and returns
/// the wait states of each.
fn run(
    flash: &mut Flash,
    mut at: Cycle,
    lines: impl IntoIterator<Item = u32>,
    cycles: u64,
) -> Vec<u32> {
    lines
        .into_iter()
        .map(|line| {
            let wait = flash.fetch(line, at);
            at += u64::from(wait) + cycles;
            wait
        })
        .collect()
}

#[test]
fn without_help_each_line_costs_the_wait_states() {
    let lines = [7, 7, 8, 7, 7, 8];
    assert_eq!(run(&mut flash(0), 0, lines, 8), [5, 0, 5, 5, 0, 5]);
    let mut fast = Flash::default();
    assert_eq!(run(&mut fast, 0, [7, 8, 7], 8), [0, 0, 0], "LATENCY 0");
    fast.set(ACR, 7, 100);
    assert_eq!(run(&mut fast, 100, [8, 9], 8), [7, 7], "LATENCY 7");
}

#[test]
fn prften_hides_sequential_lines() {
    // 8 half-word instructions last longer than a read of 6 cycles. 4 words do not: the array reads
    // without a pause, one line in 6 cycles.
    assert_eq!(run(&mut flash(PRFTEN), 0, 0..5, 8), [5, 0, 0, 0, 0]);
    assert_eq!(run(&mut flash(PRFTEN), 0, 0..5, 4), [5, 2, 2, 2, 2]);
    assert_eq!(run(&mut flash(0), 0, 0..3, 4), [5, 5, 5]);
}

#[test]
fn a_branch_waits_for_the_prefetch_under_way() {
    // Line 0 arrives at 1005, the prefetch of line 1 takes 1006-1011.
    let mut flash = flash(PRFTEN);
    assert_eq!(flash.fetch(0, 1000), 5);
    let mut late = flash.clone();
    assert_eq!(flash.fetch(100, 1008), 4 + 5);
    assert_eq!(late.fetch(100, 1006), 5, "it has not started");
    assert_eq!(late.fetch(1, 1050), 5, "nor was it read later");
}

#[test]
fn icen_keeps_64_lines_and_replaces_the_least_recently_used() {
    let mut flash = flash(ICEN);
    assert_eq!(run(&mut flash, 0, 0..64, 8), [5; 64]);
    assert_eq!(run(&mut flash, 1000, 0..64, 8), [0; 64]);
    // 1000 replaces line 1, since 0 was just used; 1 then replaces 2, and so on.
    let lines = [0, 1000, 0, 1, 2, 3, 63, 0];
    let waits = [0, 5, 0, 5, 5, 5, 0, 0];
    assert_eq!(run(&mut flash, 2000, lines, 8), waits);
    assert_eq!(run(&mut self::flash(0), 0, [3, 4, 3, 4], 8), [5; 4], "off");
}

#[test]
fn a_prefetched_line_that_is_used_enters_the_cache() {
    // A loop over lines 10-12 with 4 cycles in each. Reads of the array: 10 in cycles 0-5, 11 in
    // 6-11, 12 in 12-17, 13 in 18-23. From 21 on all are cached.
    let lines = [10, 11, 12, 10, 11, 12, 10];
    let mut default = flash(ICEN | PRFTEN);
    assert_eq!(run(&mut default, 0, lines, 4), [5, 2, 2, 0, 0, 0, 0]);
    // Line 13 was prefetched but never used: the next prefetch discards it.
    assert_eq!(default.fetch(100, 1000), 5);
    assert_eq!(default.fetch(13, 2000), 5);
    // The other reading: line 10 is cached, requested at 21; 11 is prefetched in 24-29, requested
    // at 25; 12 in 30-35, requested at 33.
    let mut other = flash(ICEN | PRFTEN);
    other.set_prefetched(Prefetched::NotCached);
    assert_eq!(run(&mut other, 0, lines, 4), [5, 2, 2, 0, 4, 2, 0]);
    // Without prefetch all three are cached: with the other reading prefetch costs more than it
    // saves.
    let waits = [5, 5, 5, 0, 0, 0, 0];
    assert_eq!(run(&mut flash(ICEN), 0, lines, 4), waits);
}

#[test]
fn the_reading_outlives_a_reset() {
    let mut flash = Flash::default();
    flash.set_prefetched(Prefetched::NotCached);
    flash.reset(0);
    flash.set(ACR, 5 | ICEN | PRFTEN, 0);
    let lines = [10, 11, 12, 10, 11];
    assert_eq!(run(&mut flash, 0, lines, 4), [5, 2, 2, 0, 4]);
}

#[test]
fn icrst_and_dcrst_forget_and_are_refused_while_on() {
    let mut flash = flash(ICEN | DCEN);
    run(&mut flash, 1000, [1, 2], 8);
    data_wait(&mut flash, BASE + 0x100, 2000);
    assert!(Peripheral::write(&mut flash, ACR, 5 | ICEN | ICRST, 0).is_err());
    assert!(Peripheral::write(&mut flash, ACR, 5 | DCEN | DCRST, 0).is_err());
    flash.set(ACR, 5, 2000);
    flash.set(ACR, 5 | ICEN | DCEN, 2000);
    assert_eq!(run(&mut flash, 2000, [1], 8), [0], "kept while off");
    flash.set(ACR, 5, 3000);
    flash.set(ACR, 5 | ICRST, 3000);
    flash.set(ACR, 5 | ICEN | DCEN, 3000);
    assert_eq!(flash.fetch(2, 3000), 5);
    assert_eq!(data_wait(&mut flash, BASE + 0x10C, 3100), 0, "data stay");
    flash.set(ACR, 5, 3200);
    flash.set(ACR, 5 | DCRST, 3200);
    flash.set(ACR, 5 | ICEN | DCEN, 3200);
    assert_eq!(data_wait(&mut flash, BASE + 0x10C, 3200), 5);
    assert_eq!(flash.get(ACR, 3300), 5 | ICEN | DCEN);
}

#[test]
fn dcen_keeps_8_lines() {
    let mut flash = flash(DCEN);
    let mut at = 1000;
    let mut wait = |line: u32| {
        at += 100;
        data_wait(&mut flash, BASE + 16 * line, at)
    };
    assert_eq!([0, 1, 2, 3, 4, 5, 6, 7].map(&mut wait), [5; 8]);
    assert_eq!([0, 1, 2, 3, 4, 5, 6, 7].map(&mut wait), [0; 8]);
    assert_eq!([0, 8, 0, 1].map(&mut wait), [0, 5, 0, 5]);
    let mut off = self::flash(0);
    assert_eq!(data_wait(&mut off, BASE, 1000), 5);
    assert_eq!(data_wait(&mut off, BASE + 4, 1100), 5);
}

#[test]
fn data_and_code_share_the_array() {
    let mut flash = flash(0);
    assert_eq!(flash.fetch(1, 1000), 5);
    // The array is busy up to 1005.
    assert_eq!(data_wait(&mut flash, BASE, 1003), 3 + 5);
    assert_eq!(flash.fetch(2, 1010), 2 + 5);
}

#[test]
fn data_go_before_a_prefetch_that_has_not_started() {
    let mut flash = flash(PRFTEN);
    flash.fetch(1, 1000); // prefetch 1006-1011
    assert_eq!(data_wait(&mut flash, BASE, 1006), 5, "1006-1011");
    // The prefetch moved to 1012-1017.
    assert_eq!(flash.fetch(2, 1014), 3);
    let mut started = self::flash(PRFTEN);
    started.fetch(1, 1000);
    assert_eq!(data_wait(&mut started, BASE, 1007), 5 + 5);
}

#[test]
fn both_aliases_show_the_program() {
    let mut flash = Flash::default();
    flash.load(BASE + 4, &[1, 2, 3, 4]).unwrap();
    assert_eq!(flash.read(4, Size::Word, 0).unwrap().value, 0x0403_0201);
    assert_eq!(flash.read(BASE + 6, Size::Half, 0).unwrap().value, 0x0403);
    assert_eq!(flash.peek(BASE + 5, Size::Byte), 2);
    assert_eq!(flash.peek(BASE, Size::Word), u32::MAX, "erased");
    assert!(flash.load(BASE + SIZE as u32 - 1, &[0; 2]).is_err());
    assert!(flash.load(0x2000_0000, &[0]).is_err());
    let text = flash.load(0, &[0; 3]).unwrap_err().to_string();
    assert!(text.starts_with("3 bytes at 0x00000000"), "{text}");
}

#[test]
fn the_information_block_is_read() {
    let mut flash = flash(0);
    let signature = Signature { uid: [1, 2, 3] };
    let mut read = |address, size, at| flash.read_information(&signature, address, size, at);
    let uid = read(0x1FFF_7A14, Size::Word, 100);
    assert_eq!(uid, Some(ReadResult { value: 2, wait: 5 }));
    let options = read(0x1FFF_C000, Size::Half, 200).map(|r| r.value);
    assert_eq!(options, Some(0xAAEF));
    let protection = read(0x1FFF_C008, Size::Half, 300).map(|r| r.value);
    assert_eq!(protection, Some(0xFFFF));
    assert_eq!(read(0x1FFF_0000, Size::Word, 400), None);
}

#[test]
fn wait_states_must_suffice() {
    let mut flash = flash(0);
    flash.set_hz(168_000_000, 0);
    assert!(flash.check_wait_states(2700).is_ok());
    assert!(flash.check_wait_states(2699).is_err());
    flash.set(ACR, 4, 0);
    assert!(flash.check_wait_states(3300).is_err());
    flash.set_hz(150_000_000, 0);
    assert!(flash.check_wait_states(3300).is_ok());
    flash.set(ACR, 0, 0);
    for (hz, mv, ok) in [
        (30_000_000, 3300, true),
        (30_000_001, 3300, false),
        (24_000_000, 2400, true),
        (22_000_001, 2399, false),
        (20_000_000, 1800, true),
    ] {
        flash.set_hz(hz, 0);
        assert_eq!(flash.check_wait_states(mv).is_ok(), ok, "{hz} Hz {mv} mV");
    }
}

/// [`Flash::check_known`]: 25 ns, from 2.7 V on.
#[test]
fn what_turns_by_itself_may_read_faster_than_the_data_sheet() {
    let turned = |hz, bit: u32, supply_mv| {
        let mut flash = flash(ICEN);
        flash.set_hz(hz, 0);
        flash.upset(ACR, 1 << bit, supply_mv)
    };
    assert_eq!(turned(168_000_000, 0, 3300), Ok(true), "4: 29.8 ns");
    assert_eq!(turned(168_000_000, 1, 3300), Ok(true), "7");
    assert!(turned(168_000_000, 2, 3300).is_err(), "1: 11.9 ns");
    assert!(turned(168_000_000, 0, 2699).is_err());
    assert_eq!(turned(200_000_000, 0, 3300), Ok(true));
    assert!(turned(200_000_001, 0, 3300).is_err());
    assert_eq!(turned(200_000_001, 9, 3300), Ok(true), "no cache");
    assert_eq!(flash(0).upset(CR, 1, 3300), Ok(false));
}

/// Unlocked flash, x32, at 168 MHz.
fn unlocked() -> Flash {
    let mut flash = flash(0);
    flash.set_hz(168_000_000, 0);
    flash.set(KEYR, 0x4567_0123, 0);
    flash.set(KEYR, 0xCDEF_89AB, 0);
    flash.set(CR, 2 << 8, 0);
    flash
}

const US: Cycle = 168;

#[test]
fn keys_unlock_and_a_wrong_one_locks_until_reset() {
    let mut flash = flash(0);
    assert_eq!(flash.get(CR, 0), 1 << 31);
    flash.set(CR, 1, 0);
    assert_eq!(flash.get(CR, 0), 1 << 31, "locked");
    let mut flash = unlocked();
    assert_eq!(flash.get(CR, 0), 0x200);
    flash.set(CR, 1 << 31, 0);
    assert_eq!(flash.get(CR, 0), 1 << 31);
    assert!(Peripheral::write(&mut flash, KEYR, 1, 0).is_err());
    assert!(Peripheral::write(&mut flash, KEYR, 0x4567_0123, 0).is_err());
    flash.reset(0);
    flash.set(KEYR, 0x4567_0123, 0);
}

#[test]
fn programming_clears_bits_takes_its_time_and_stalls_reads() {
    let mut flash = unlocked();
    let before = flash.code_version();
    flash.set(CR, 0x201, 0);
    assert_eq!(flash.write(BASE + 8, Size::Word, 0xFFFF_0F0F, 1000), Ok(0));
    assert_eq!(flash.get(SR, 1001), 1 << 16);
    assert_ne!(flash.code_version(), before);
    let end = 1000 + 100 * US;
    assert_eq!(
        flash.read(BASE + 8, Size::Word, 2000).unwrap(),
        ReadResult {
            value: 0xFFFF_0F0F,
            wait: (end - 2000) as u32 + 5
        }
    );
    assert_eq!(flash.get(SR, end - 1), 1 << 16);
    assert_eq!(flash.next_event(), end);
    assert_eq!(flash.get(SR, end), 0, "EOP needs EOPIE");
    // A second write waits for the first.
    assert_eq!(flash.write(BASE + 8, Size::Word, 0x00FF_FFFF, end), Ok(0));
    let wait = flash.write(BASE + 12, Size::Word, 0, end + 10).unwrap();
    assert_eq!(u64::from(wait), 100 * US - 10);
    assert_eq!(flash.peek(BASE + 8, Size::Word), 0x00FF_0F0F);
    assert_eq!(flash.peek(BASE + 12, Size::Word), 0);
}

#[test]
fn sectors_are_erased_in_the_time_of_the_data_sheet() {
    let ms = 1000 * US;
    for (psize, small, medium, large) in [
        (0, 800, 2400, 4000),
        (1, 600, 1400, 2600),
        (2, 500, 1100, 2000),
    ] {
        for (sector, start, length, time) in [
            (3, 0xC000, 0x4000, small),
            (4, 0x1_0000, 0x1_0000, medium),
            (5, 0x2_0000, 0x2_0000, large),
            (11, 0xE_0000, 0x2_0000, large),
        ] {
            let mut flash = unlocked();
            flash.load(BASE, &[0; SIZE]).unwrap();
            flash.set(CR, psize << 8 | sector << 3 | 2 | 1 << 24 | 1 << 16, 0);
            assert_eq!(flash.next_event(), time * ms);
            assert!(!flash.interrupt());
            assert_eq!(flash.get(SR, time * ms), 1, "EOP");
            assert!(flash.interrupt());
            flash.set(SR, 1, time * ms);
            assert!(!flash.interrupt());
            assert_eq!(flash.get(CR, time * ms) & 1 << 16, 0, "STRT");
            let erased: Vec<_> = (0..SIZE as u32)
                .filter(|at| flash.peek(BASE + at, Size::Byte) == 0xFF)
                .collect();
            assert_eq!(erased, (start..start + length).collect::<Vec<_>>());
        }
    }
}

#[test]
fn errors_have_their_flags() {
    let status = |flash: &mut Flash| flash.get(SR, 0);
    let mut flash = unlocked();
    flash.write(BASE, Size::Word, 0, 0).unwrap();
    assert_eq!(status(&mut flash), 1 << 7, "PGSERR: PG is off");
    flash.set(SR, 1 << 7, 0);
    flash.set(CR, 0x201, 0);
    flash.write(BASE, Size::Half, 0, 0).unwrap();
    assert_eq!(status(&mut flash), 1 << 6, "PGPERR: PSIZE is x32");
    flash.set(SR, 1 << 6, 0);
    flash.protect(1 << 1);
    flash.set(CR, 0x201 | 1 << 25, 0);
    flash.write(BASE + 0x4000, Size::Word, 0, 0).unwrap();
    assert_eq!(status(&mut flash), 1 << 4 | 1 << 1, "WRPERR, OPERR");
    assert!(flash.interrupt());
    flash.set(SR, 0xF3, 0);
    flash.set(CR, 0x202 | 1 << 3 | 1 << 16, 0);
    assert_eq!(status(&mut flash), 1 << 4, "WRPERR of an erasure");
    assert_eq!(
        flash.peek(BASE, Size::Word),
        u32::MAX,
        "nothing was written"
    );
    assert_eq!(flash.get(0x14, 0), 0x0FFD_AAED);
}

#[test]
fn stale_cache_lines_are_found_out() {
    let mut flash = unlocked();
    flash.set(ACR, 5 | ICEN | DCEN, 0);
    flash.fetch(0x4000 / 16, 0);
    data_wait(&mut flash, BASE + 0x4100, 100);
    flash.set(CR, 0x202 | 1 << 3 | 1 << 16, 200);
    let end = flash.next_event();
    flash.advance(end).unwrap();
    assert!(flash.read(BASE + 0x4100, Size::Word, end).is_err());
    assert!(flash.read(BASE + 0x4200, Size::Word, end).is_ok());
    flash.fetch(0x4000 / 16, end + 100);
    assert!(flash.advance(end + 200).is_err());
    let mut flash = unlocked();
    flash.set(ACR, 5 | DCEN, 0);
    data_wait(&mut flash, BASE, 0);
    flash.set(CR, 0x201, 100);
    flash.write(BASE, Size::Word, 7, 100).unwrap();
    let seen = flash.read(BASE, Size::Word, 200).unwrap();
    let expected = ReadResult { value: 7, wait: 0 };
    assert_eq!(seen, expected, "programming reaches the data cache");
}

#[test]
fn a_new_core_clock_keeps_the_time_of_an_operation() {
    let mut flash = unlocked();
    flash.set(CR, 0x201, 0);
    flash.write(BASE, Size::Word, 0, 0).unwrap();
    assert_eq!(flash.next_event(), 16_800);
    flash.set_hz(16_000_000, 8_400);
    assert_eq!(flash.next_event(), 8_400 + 800);
    let mut done = flash.clone();
    done.reset(9_200);
    assert_eq!(done.peek(BASE, Size::Word), 0);
    flash.reset(9_000);
    assert_ne!(
        flash.peek(BASE, Size::Word),
        0,
        "800 cycles of it were left"
    );
}

#[test]
fn a_reset_cuts_off_what_it_meets() {
    let word = |seed, at| {
        let mut flash = unlocked();
        flash.seed = seed;
        flash
            .load(BASE + 4, &0xF0F0_FFFF_u32.to_le_bytes())
            .unwrap();
        flash.set(CR, 0x201, 0);
        flash.write(BASE + 4, Size::Word, 0x00FF_00FF, 0).unwrap();
        flash.reset(at);
        let beside = [BASE, BASE + 8].map(|address| flash.peek(address, Size::Word));
        assert_eq!(beside, [u32::MAX; 2]);
        assert_eq!(flash.get(SR, at), 0, "idle and locked");
        assert_eq!(flash.get(CR, at), 1 << 31);
        flash.peek(BASE + 4, Size::Word)
    };
    let (half, target) = (word(1, 8_000), 0x00F0_00FF);
    // Bits only change to 0, and only those that were to change.
    assert_eq!(half & !0xF0F0_FFFF, 0);
    assert_eq!(half & target, target);
    assert!(half != target && half != 0xF0F0_FFFF, "{half:#x}");
    assert_eq!(half, word(1, 8_000), "the same seed and moment");
    assert_ne!(half, word(2, 8_000));
    assert_ne!(half, word(1, 8_001));
    assert_eq!(word(1, 20_000), target, "over before");
}

#[test]
fn a_reset_leaves_a_sector_between_old_and_erased() {
    let old = [0x5A; 0x4000];
    let mut flash = unlocked();
    flash.load(BASE + 0x4000, &old).unwrap();
    flash.set(CR, 0x202 | 1 << 3 | 1 << 16, 0);
    flash.reset(1_000_000);
    let words = (0..0x1000).map(|n| flash.peek(BASE + 0x4000 + 4 * n, Size::Word));
    let words: Vec<_> = words.collect();
    assert!(words.iter().all(|word| word & 0x5A5A_5A5A == 0x5A5A_5A5A));
    let risen: u32 = words
        .iter()
        .map(|word| (word & !0x5A5A_5A5A).count_ones())
        .sum();
    // Half of 65,536 bits that were 0, within six standard deviations.
    assert!(risen.abs_diff(32_768) < 6 * 128, "{risen}");
    assert_eq!(flash.peek(BASE + 0x3FFC, Size::Word), u32::MAX);
}
