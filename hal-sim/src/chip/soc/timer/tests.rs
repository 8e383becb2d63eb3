use super::offset as reg;
use super::*;

fn timer(number: u8, divider: u32) -> Timer {
    let mut timer = Timer::new(number);
    timer.set_divider(divider, 0).unwrap();
    timer
}

fn write(timer: &mut Timer, offset: u32, value: u32, done: Cycle) {
    timer.write(offset, value, done).unwrap();
}

fn read(timer: &mut Timer, offset: u32, done: Cycle) -> u32 {
    timer.read(offset, done).unwrap()
}

/// Returns the counter at `at`: a read complete from c on returns the value before c.
fn count(timer: &mut Timer, at: Cycle) -> u32 {
    read(timer, reg::CNT, at + 1)
}

/// RM0090 18.3.1: the counter enable follows CEN by one timer clock.
#[test]
fn counting_starts_a_clock_after_cen_and_stops_with_it() {
    let mut tim = timer(3, 2);
    write(&mut tim, reg::CR1, 1, 10);
    assert_eq!(count(&mut tim, 13), 0);
    assert_eq!(count(&mut tim, 14), 1);
    assert_eq!(count(&mut tim, 15), 1);
    assert_eq!(count(&mut tim, 16), 2);
    write(&mut tim, reg::CR1, 0, 20);
    assert_eq!(count(&mut tim, 1000), 3);
}

#[test]
fn the_prescaler_divides_by_psc_plus_one_from_the_update_on() {
    let mut tim = timer(5, 2);
    write(&mut tim, reg::PSC, 83, 0);
    write(&mut tim, reg::EGR, 1, 0);
    write(&mut tim, reg::CR1, 1, 0);
    // One clock to enable, then a count every 84 clocks of 2 cycles.
    assert_eq!(count(&mut tim, 169), 0);
    assert_eq!(count(&mut tim, 170), 1);
    assert_eq!(count(&mut tim, 170 + 167), 1);
    assert_eq!(count(&mut tim, 170 + 168 * 999_999), 1_000_000);
}

/// A prescaler written while counting takes effect at the update (RM0090 18.3.1).
#[test]
fn a_running_counter_takes_a_new_prescaler_at_its_overflow() {
    let mut tim = timer(3, 1);
    write(&mut tim, reg::ARR, 9, 0);
    write(&mut tim, reg::CR1, 1, 0); // counts at 2, 3, …; overflows at 11
    write(&mut tim, reg::PSC, 3, 5);
    assert_eq!(count(&mut tim, 10), 9);
    assert_eq!(count(&mut tim, 11), 0);
    assert_eq!(count(&mut tim, 14), 0);
    assert_eq!(count(&mut tim, 15), 1);
    assert_eq!(count(&mut tim, 19), 2);
}

#[test]
fn auto_reload_waits_for_the_update_only_with_arpe() {
    for (arpe, overflow) in [(0, 7), (bit::ARPE, 11)] {
        let mut tim = timer(3, 1);
        write(&mut tim, reg::ARR, 9, 0);
        write(&mut tim, reg::CR1, arpe | 1, 0);
        write(&mut tim, reg::ARR, 5, 4);
        assert_eq!(tim.next_update(), overflow);
        assert_eq!(count(&mut tim, overflow), 0);
        assert_eq!(tim.next_update(), overflow + 6);
    }
}

#[test]
fn one_pulse_mode_stops_at_the_update() {
    let mut tim = timer(3, 1);
    write(&mut tim, reg::ARR, 9, 0);
    write(&mut tim, reg::CR1, bit::OPM | 1, 0);
    assert_eq!(count(&mut tim, 10), 9);
    assert_eq!(count(&mut tim, 500), 0);
    assert_eq!(read(&mut tim, reg::CR1, 501), bit::OPM);
    assert_eq!(read(&mut tim, reg::SR, 501) & 1, 1);
}

#[test]
fn flags_rise_at_the_count_and_clear_by_zeros_only() {
    let mut tim = timer(3, 1);
    write(&mut tim, reg::ARR, 99, 0);
    write(&mut tim, reg::CCR1, 7, 0);
    write(&mut tim, reg::CCR1 + 4, 200, 0); // beyond ARR: never
    write(&mut tim, reg::CR1, 1, 0); // becomes n at n + 1
    assert_eq!(read(&mut tim, reg::SR, 8), 0);
    assert_eq!(read(&mut tim, reg::SR, 9), bit::CC1IF);
    write(&mut tim, reg::SR, u32::MAX, 10);
    assert_eq!(read(&mut tim, reg::SR, 11), bit::CC1IF);
    write(&mut tim, reg::SR, !bit::CC1IF, 12);
    assert_eq!(read(&mut tim, reg::SR, 101), 0);
    // CCR3 and CCR4 are 0: they match at the overflow.
    assert_eq!(read(&mut tim, reg::SR, 102), 0b11001);
    assert_eq!(count(&mut tim, 101), 0);
}

#[test]
fn the_next_event_is_the_cycle_at_which_the_line_rises() {
    let mut tim = timer(2, 2);
    write(&mut tim, reg::CCR1 + 4, 1000, 0);
    write(&mut tim, reg::CR1, 1, 0); // becomes n at 2 + 2n
    assert_eq!(tim.next_event(), Cycle::MAX, "nobody can see a flag");
    write(&mut tim, reg::DIER, 1 << 2, 100);
    assert_eq!(tim.next_event(), 2002);
    tim.advance(2001).unwrap();
    assert!(!tim.interrupt());
    tim.advance(2002).unwrap();
    assert!(tim.interrupt());
    assert_eq!(tim.next_event(), Cycle::MAX, "it is high already");
    write(&mut tim, reg::SR, !(1 << 2), 2100);
    assert!(!tim.interrupt());
    assert_eq!(tim.next_event(), 2002 + (1 << 33));
}

/// RM0090 18.3.2: with URS, only overflows set UIF.
#[test]
fn ug_restarts_and_raises_uif_unless_urs() {
    for (urs, flag) in [(bit::URS, 0), (0, 1)] {
        let mut tim = timer(3, 1);
        write(&mut tim, reg::CCR1, 5, 0);
        write(&mut tim, reg::CR1, urs | 1, 0);
        assert_eq!(count(&mut tim, 4), 3);
        write(&mut tim, reg::EGR, 1, 5);
        assert_eq!(read(&mut tim, reg::SR, 6) & 1, flag);
        assert_eq!(count(&mut tim, 5), 0);
        assert_eq!(count(&mut tim, 6), 1);
    }
}

#[test]
fn sixteen_and_thirty_two_bits() {
    for (number, top) in [(1, 0xFFFF), (2, u32::MAX), (4, 0xFFFF), (5, u32::MAX)] {
        let mut tim = timer(number, 1);
        assert_eq!(read(&mut tim, reg::ARR, 0), top);
        write(&mut tim, reg::CNT, u32::MAX, 0);
        write(&mut tim, reg::CR1, 1, 0);
        assert_eq!(count(&mut tim, 1), top);
        assert_eq!(count(&mut tim, 2), 0);
    }
}

/// PWM mode 1: high below CCR; TIM1's OC4REF as TRGO rises at each overflow.
#[test]
fn oc4ref_is_a_trigger_at_each_overflow() {
    let mut tim = timer(1, 1);
    write(&mut tim, reg::ARR, 167, 0);
    write(&mut tim, reg::CCR4, 84, 0);
    write(&mut tim, reg::CCMR2, 6 << 12, 0);
    assert!(!tim.trigger_level());
    write(&mut tim, reg::CR2, 7 << 4, 0);
    assert!(tim.trigger_level());
    write(&mut tim, reg::CNT, 160, 0);
    assert!(!tim.trigger_level());
    write(&mut tim, reg::CR1, 1, 0);
    assert_eq!(tim.trigger_edges(2), Ok(Some((9, 168))));
    tim.advance(9).unwrap();
    assert!(tim.trigger_level());
    tim.advance(9 + 83).unwrap();
    assert!(tim.trigger_level());
    tim.advance(9 + 84).unwrap();
    assert!(!tim.trigger_level());
    assert_eq!(tim.trigger_edges(2), Ok(Some((177, 168))));
    assert!(tim.trigger_edges(86).is_err(), "a slave that could miss it");
    // CC1IF as the trigger: when the counter becomes CCR1.
    write(&mut tim, reg::CCR1, 8, 200);
    write(&mut tim, reg::CR2, 3 << 4, 200);
    assert_eq!(tim.trigger_edges(2), Ok(Some((353, 168))));
}

/// RM0090 17.3.2 and 17.3.10: from ARR to 0; high up to and including CCR.
#[test]
fn a_timer_that_counts_down_comes_from_the_other_end() {
    let mut tim = timer(1, 1);
    write(&mut tim, reg::ARR, 9, 0);
    write(&mut tim, reg::CCR1, 7, 0);
    write(&mut tim, reg::CCR4, 4, 0);
    write(&mut tim, reg::CCMR2, 6 << 12, 0);
    write(&mut tim, reg::CR2, 7 << 4, 0);
    write(&mut tim, reg::CR1, 1, 0); // becomes n at n + 1
    write(&mut tim, reg::CR1, bit::DIR | 1, 4); // 2 at 3, then 1 at 4
    assert_eq!(
        [3, 4, 5, 6, 7].map(|at| count(&mut tim, at)),
        [2, 1, 0, 9, 8]
    );
    assert_eq!(read(&mut tim, reg::SR, 8) & 3, bit::UIF);
    assert_eq!((tim.next_match(0), tim.next_update()), (8, 16));
    assert_eq!(read(&mut tim, reg::SR, 9) & 3, bit::UIF | bit::CC1IF);
    assert_eq!(tim.trigger_edges(1), Ok(Some((11, 10))));
    assert_eq!(count(&mut tim, 116), 9, "ten laps on");
}

/// RM0090 17.4.1, CMS: the direction in which flags are set. The manual does not describe a change
/// of the mode while counting.
#[test]
fn a_centre_aligned_timer_flags_one_way_and_is_followed_up_to_its_turn() {
    for (cms, flag) in [(1, 0), (2, bit::CC1IF), (3, bit::CC1IF)] {
        let mut tim = timer(2, 1);
        write(&mut tim, reg::ARR, 99, 0);
        write(&mut tim, reg::CCR1, 50, 0);
        write(&mut tim, reg::CR1, 1, 0);
        write(&mut tim, reg::CR1, cms << 5 | bit::DIR | 1, 10);
        assert_eq!(
            read(&mut tim, reg::CR1, 11),
            cms << 5 | 1,
            "DIR is the counter's"
        );
        assert_eq!(read(&mut tim, reg::SR, 90) & bit::CC1IF, flag, "CMS {cms}");
        assert!(tim.advance(200).is_err());
    }
}

/// A counter beyond an ARR that was written too late counts to its maximum.
#[test]
fn a_counter_beyond_its_reload_counts_to_its_end() {
    let mut tim = timer(1, 1);
    write(&mut tim, reg::ARR, 9, 0);
    write(&mut tim, reg::CNT, 0xFFF0, 0);
    write(&mut tim, reg::CR1, 1, 0); // 0xFFF1 at 2
    assert_eq!(tim.next_update(), 17);
    assert_eq!(count(&mut tim, 16), 0xFFFF);
    assert_eq!([17, 26, 27].map(|at| count(&mut tim, at)), [0, 9, 0]);
}

fn slave() -> Timer {
    let mut tim = timer(2, 2);
    write(&mut tim, reg::SMCR, 7, 0);
    write(&mut tim, reg::CR1, 1, 0);
    tim
}

/// An edge is sampled at the next clock of TIM2 and counts two clocks later.
#[test]
fn a_slave_counts_edges_and_only_edges() {
    let mut tim = slave();
    tim.follow(Some((101, 168)), 0).unwrap();
    assert_eq!(count(&mut tim, 105), 0);
    assert_eq!(count(&mut tim, 106), 1);
    assert_eq!(count(&mut tim, 106 + 168 * 10 - 1), 10);
    assert_eq!(count(&mut tim, 106 + 168 * 10), 11);
}

/// A trigger with an odd lap, at half its clock: each edge is sampled separately.
#[test]
fn a_slave_counts_edges_that_fall_between_its_clocks() {
    let mut tim = slave();
    tim.follow(Some((101, 167)), 0).unwrap(); // 101, 268, 435: counted at 106, 272, 440
    let counts = [105, 106, 271, 272, 439, 440].map(|at| count(&mut tim, at));
    assert_eq!(counts, [0, 1, 1, 2, 2, 3]);
    assert_eq!(count(&mut tim, 101 + 167 * 1_000 + 5), 1_001);
}

/// RM0090 18.4.3, SMS 6: the trigger starts the counter, which counts its own clock.
#[test]
fn a_started_slave_counts_its_own_clock() {
    let mut tim = slave();
    tim.follow(Some((100, 168)), 0).unwrap();
    write(&mut tim, reg::SMCR, 6, 200);
    let before = count(&mut tim, 300);
    assert_eq!(count(&mut tim, 500), before + 100);
    assert!(tim.write(reg::CR1, 0, 600).is_err(), "set anew");
    assert!(slave().write(reg::SMCR, 5, 0).is_err(), "gated");
}

#[test]
fn an_edge_in_the_synchroniser_counts_although_its_source_stops() {
    for (now, counts) in [(101, 0), (102, 1)] {
        let mut tim = slave();
        tim.follow(Some((101, 168)), 0).unwrap();
        tim.advance(now - 1).unwrap();
        tim.follow(None, now).unwrap();
        assert_eq!(count(&mut tim, 10_000), counts);
        tim.trigger(20_000);
        assert_eq!(count(&mut tim, 20_004), counts + 1);
    }
}

#[test]
fn oc3ref_rises_on_its_match_and_is_forced_low() {
    let mut tim = slave();
    write(&mut tim, reg::CR2, 6 << 4, 0);
    tim.follow(Some((100, 168)), 0).unwrap(); // becomes n at 104 + 168 (n − 1)
    for (at, done) in [(5, 200), (9, 1000)] {
        write(&mut tim, reg::CCMR2, 4 << 4, done);
        write(&mut tim, reg::CCR1 + 8, at, done);
        write(&mut tim, reg::CCMR2, 1 << 4, done);
        assert_eq!(tim.next_event(), 104 + 168 * Cycle::from(at - 1));
        tim.advance(tim.next_event()).unwrap();
        assert_eq!(tim.next_event(), Cycle::MAX, "one edge only");
    }
    tim.advance(1 << 33).unwrap();
    assert_eq!(*tim.rises, [104 + 168 * 4, 104 + 168 * 8]);
}

fn capturing() -> Timer {
    let mut tim = timer(2, 2);
    write(&mut tim, reg::CCMR1, 3 << 4 | 1, 0);
    write(&mut tim, reg::CCER, 1, 0);
    write(&mut tim, reg::CR1, 1, 0); // becomes n at 2 + 2n
    tim
}

/// Two clocks of synchroniser, eight equal samples: ten clocks of 2 cycles.
#[test]
fn a_rising_edge_is_captured_after_the_filter() {
    let mut tim = capturing();
    tim.set_input(true, 1001).unwrap();
    assert_eq!(read(&mut tim, reg::SR, 1022) & bit::CC1IF, 0);
    assert_eq!(read(&mut tim, reg::SR, 1023) & bit::CC1IF, bit::CC1IF);
    assert_eq!(read(&mut tim, reg::CCR1, 1030), (1022 - 2) / 2);
    assert_eq!(read(&mut tim, reg::SR, 1031) & bit::CC1IF, 0);
    // Falling edges are not captured, and short pulses do not pass the filter.
    tim.set_input(false, 2000).unwrap();
    tim.set_input(true, 3000).unwrap();
    tim.set_input(false, 3019).unwrap();
    assert_eq!(read(&mut tim, reg::SR, 4000) & bit::CC1IF, 0);
}

#[test]
fn a_second_capture_before_the_first_is_read_says_so() {
    let mut tim = capturing();
    for start in [1000, 2000] {
        tim.set_input(true, start).unwrap();
        tim.set_input(false, start + 500).unwrap();
    }
    let flags = bit::CC1IF | bit::CC1OF;
    assert_eq!(read(&mut tim, reg::SR, 3000) & flags, flags);
    assert_eq!(read(&mut tim, reg::CCR1, 3000), (2020 - 2) / 2);
}

/// RM0090 18.4.7, IC1PSC: one edge in 1, 2, 4 or 8, from CC1E on.
#[test]
fn a_prescaler_captures_one_edge_in_so_many() {
    let mut tim = capturing();
    write(&mut tim, reg::CCMR1, 3 << 4 | 1 << 2 | 1, 0);
    for (start, flag) in [(1000, 0), (2000, bit::CC1IF)] {
        tim.set_input(true, start).unwrap();
        tim.set_input(false, start + 500).unwrap();
        assert_eq!(read(&mut tim, reg::SR, start + 900) & bit::CC1IF, flag);
    }
    assert_eq!(read(&mut tim, reg::CCR1, 3000), (2020 - 2) / 2);
}

/// CC1S 3 (the same section): the trigger is captured and counted.
#[test]
fn a_slave_may_capture_its_trigger() {
    let mut tim = slave();
    write(&mut tim, reg::CCMR1, 3, 0);
    write(&mut tim, reg::CCER, 1, 0);
    tim.follow(Some((100, 168)), 0).unwrap();
    assert_eq!(read(&mut tim, reg::SR, 100) & bit::CC1IF, 0);
    assert_eq!(
        read(&mut tim, reg::SR, 110) & (bit::CC1IF | bit::CC1OF),
        bit::CC1IF
    );
    assert_eq!(read(&mut tim, reg::CCR1, 110 + 168 * 9), 10);
    assert_ne!(read(&mut tim, reg::SR, 110 + 168 * 20) & bit::CC1OF, 0);
}

#[test]
fn a_clock_that_never_comes_holds_the_counter() {
    // External clock mode 1 on another trigger, encoder modes, external clock mode 2.
    for smcr in [7, 7 << 4 | 7, 1, 2, 3, 1 << 14] {
        let mut tim = timer(3, 1);
        write(&mut tim, reg::CR1, 1, 0);
        let before = read(&mut tim, reg::CNT, 100);
        write(&mut tim, reg::SMCR, smcr, 100);
        let held = read(&mut tim, reg::CNT, 101);
        assert!(held >= before);
        assert_eq!(read(&mut tim, reg::CNT, 10_000), held, "{smcr:#x}");
        write(&mut tim, reg::SMCR, 0, 10_000);
        assert!(read(&mut tim, reg::CNT, 10_100) > held);
    }
}

#[test]
fn a_preloaded_compare_waits_for_an_update() {
    let mut tim = timer(2, 1);
    write(&mut tim, reg::ARR, 999, 0);
    write(&mut tim, reg::CCMR1, 1 << 11, 0); // OC2PE
    write(&mut tim, reg::CR1, 1, 0);
    write(&mut tim, reg::CCR1 + 4, 500, 10);
    assert_eq!(read(&mut tim, reg::CCR1 + 4, 20), 500, "as written");
    assert_eq!(read(&mut tim, reg::SR, 900) & bit::CC1IF << 1, 0);
    write(&mut tim, reg::SR, 0, 1100);
    assert_eq!(read(&mut tim, reg::SR, 1400) & bit::CC1IF << 1, 0);
    assert_ne!(read(&mut tim, reg::SR, 1600) & bit::CC1IF << 1, 0);
}

#[test]
fn what_nobody_models_is_refused() {
    let refused = |number, offset, value| timer(number, 1).write(offset, value, 0).is_err();
    assert!(refused(2, reg::SMCR, 4), "reset mode");
    assert!(refused(2, reg::DIER, 1 << 13), "COM of TIM2");
    assert!(refused(3, reg::RCR, 0), "no such register");
    assert!(refused(1, reg::RCR, 1));
    assert!(refused(1, reg::BDTR, 1 << 15));
    assert!(
        refused(2, reg::CCER, 1 << 2),
        "a complementary output of TIM2"
    );
    assert!(refused(1, reg::CCMR1, 1 << 3), "a compare preload");
    let mut tim = timer(3, 1);
    tim.write(reg::PSC, 0x0003_0003, 0).unwrap();
    assert_eq!(tim.read(reg::PSC, 0), Ok(3), "16 bits");
}
