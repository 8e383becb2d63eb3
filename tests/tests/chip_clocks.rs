//! Clocks and registers of the flashed image: a deviation from the configured state is detected
//! within two windows.

use crate::chip_faults::{Bench, TWO_WINDOWS_US};
use firmware::safety::Fault;
use hal_sim::chip::board::wiring::CORE_HZ;
use hal_sim::chip::cpu::{Bus, Size};
use hal_sim::trace::Levels;

/// Registers that determine edges (RM0090), and bits of each to flip. Left out because the
/// simulator does not model them: both timers' prescalers, a TIM1 of 167 counts, the SPI's bit
/// order, other triggers of the ADC.
const UPSETS: [(&str, u32, u32); 29] = [
    ("GPIOA_MODER: trigger", 0x4002_0000, 1 << 30),
    ("GPIOB_MODER: a line of channel 6", 0x4002_0400, 1 << 1),
    ("GPIOC_MODER: a line of channel 1", 0x4002_0800, 1),
    ("GPIOC_MODER: a line of channel 2", 0x4002_0800, 1 << 5),
    ("GPIOB_OTYPER", 0x4002_0404, 1 << 1),
    ("GPIOC_OTYPER", 0x4002_0804, 1),
    ("GPIOC_AFRH: the DACs' clock", 0x4002_0824, 1 << 8),
    ("DMA2_S1PAR", 0x4002_6430, 1 << 10),
    ("DMA2_S2PAR", 0x4002_6448, 1 << 4),
    ("DMA2_S5PAR", 0x4002_6490, 1 << 10),
    ("DMA2_S6PAR", 0x4002_64A8, 1 << 4),
    ("DMA2_S1M0AR", 0x4002_6434, 1 << 7),
    ("DMA2_S2M0AR", 0x4002_644C, 1 << 9),
    ("DMA2_S5M0AR", 0x4002_6494, 1 << 10),
    ("DMA2_S6M0AR", 0x4002_64AC, 1 << 7),
    ("TIM1_CR2: what clocks TIM2", 0x4001_0004, 1 << 4),
    ("TIM1_DIER: a stream's requests", 0x4001_000C, 1 << 9),
    ("TIM1_ARR: 167 to 231", 0x4001_002C, 1 << 6),
    ("TIM1_CCR1", 0x4001_0034, 1 << 4),
    ("TIM2_SMCR: the internal clock", 0x4000_0008, 7),
    ("TIM2_DIER: the refill", 0x4000_000C, 1 << 2),
    ("TIM2_CCMR1: the trigger's filter", 0x4000_0018, 1 << 4),
    (
        "ADC1_CR2: nothing starts a conversion",
        0x4001_2008,
        1 << 20,
    ),
    ("ADC1_JSQR: what is converted", 0x4001_2038, 1 << 10),
    ("EXTI_IMR: over-current", 0x4001_3C00, 1 << 7),
    ("EXTI_IMR: supply", 0x4001_3C00, 1 << 16),
    ("EXTI_FTSR", 0x4001_3C0C, 1 << 7),
    ("SYSCFG_EXTICR2", 0x4001_380C, 1 << 12),
    ("PWR_CR: supply watch", 0x4000_7000, 1 << 6),
];

#[test]
fn a_register_that_changes_isolates_within_two_windows() {
    let (bench, _) = Bench::stimulating_in_pulse();
    let mut missed = Vec::new();
    for (register, address, bits) in UPSETS {
        let mut bench = bench.clone();
        let (cycle, at) = (bench.board.cpu.cycle, bench.board.now_us());
        let soc = &mut bench.board.around.soc;
        soc.upset(address, bits, cycle).unwrap();
        bench.run_us(13_000);
        let (since, last) = *bench.record.trace.levels.last().unwrap();
        let late = since.saturating_sub(at);
        // If refills stop, the watchdog detects it.
        let fault = bench
            .fault()
            .or_else(|| bench.after_reset().last_fault.map(|f| f.fault));
        println!("{register:<36} isolated after {late:>4} us, {fault:?}");
        if last != Levels::ISOLATED || late > TWO_WINDOWS_US || fault.is_none() {
            missed.push(register);
        }
    }
    assert!(missed.is_empty(), "{missed:?}");
}

/// Sets BASEPRI to every priority, which this program never does. If the refill still runs, USB
/// alone may be blocked, and nothing else would detect that.
#[test]
fn a_priority_that_is_masked_isolates_within_two_windows() {
    let (bench, at) = Bench::stimulating_in_pulse();
    for basepri in (1..16).map(|priority| priority << 4) {
        let mut bench = bench.clone();
        bench.board.cpu.registers.basepri = basepri;
        bench.run_us(3_000); // the watchdog resets after 4 ms
        let (since, last) = *bench.record.trace.levels.last().unwrap();
        let late = since.saturating_sub(at);
        bench.board.cpu.registers.basepri = 0;
        bench.run_us(3_000);
        let fault = bench.fault();
        println!("{basepri:#04x}: isolated after {late} us, {fault:?}");
        assert_eq!(last, Levels::ISOLATED, "{basepri:#04x}");
        assert!(late <= TWO_WINDOWS_US, "{basepri:#04x}: {late} us");
        assert!(fault.is_some(), "{basepri:#04x}");
    }
}

/// A crystal or multiplier that is 0.3 % off is detected by the host's frames within 4 s; a
/// deviation of 0.1 % is not.
#[test]
fn the_hosts_frames_tell_of_a_wrong_clock() {
    for (hz, is_found) in [
        (168_504_000, true),
        (167_496_000, true),
        (168_168_000, false),
        (167_832_000, false),
    ] {
        let mut bench = Bench::idle();
        let cycle = bench.board.cpu.cycle;
        bench.board.around.host.set_hz(hz, cycle);
        bench.run_us(4_200_000);
        assert_eq!(bench.fault().is_some(), is_found, "{hz} Hz");
    }
}

/// A PLL that multiplies by another factor makes every phase longer or shorter. The comparison with
/// the crystal detects it within two windows, whose length changes as well.
#[test]
fn a_pll_that_runs_at_another_speed_isolates_within_two_windows() {
    let (bench, at) = Bench::stimulating_in_pulse();
    for thousandths in [500, 501, 550, 667, 750, 990, 997, 1003, 1050, 1125, 1250] {
        let mut bench = bench.clone();
        bench
            .board
            .set_pll_hz(CORE_HZ / 1_000 * thousandths)
            .unwrap();
        bench.run_us(10_000);
        let (since, last) = *bench.record.trace.levels.last().unwrap();
        let late = since.saturating_sub(at);
        println!("{thousandths} / 1000: isolated after {late} us");
        assert_eq!(last, Levels::ISOLATED, "{thousandths}");
        let windows_us = TWO_WINDOWS_US * 1000 / u64::from(thousandths);
        assert!(late <= windows_us, "{thousandths}: {late} us");
        assert_eq!(bench.fault(), Some(Fault::TimeBase), "{thousandths}");
    }
}

/// The tape plays the disconnect word in each slot, so a line that its port raises by itself falls
/// with the next.
#[test]
fn an_output_that_flips_is_over_with_the_slot() {
    let (mut bench, _) = Bench::stimulating_in_pulse();
    bench.run_us(2_500); // between two pulses
    bench.record.trace.levels.clear();
    let (cycle, at) = (bench.board.cpu.cycle, bench.board.now_us());
    let odr_of_port_b = 0x4002_0414;
    let soc = &mut bench.board.around.soc;
    soc.upset(odr_of_port_b, 1, cycle).unwrap();
    bench.run_us(1_000);
    let trace = &bench.record.trace;
    println!("{:?}", trace.levels);
    assert_eq!(trace.last_levels(), Levels::ISOLATED);
    assert!(trace.levels.iter().all(|(t, _)| *t <= at + 1));
}

/// Registers that debuggers write when they attach and detach (DBGMCU_CR, APB1FZR, APB2FZR, DEMCR,
/// DWT_CTRL), with the bits that count and the value that the firmware needs.
const DEBUG: [(u32, u32, u32); 5] = [
    (0xE004_2004, 1, 1),
    (0xE004_2008, 0x1001, 0),
    (0xE004_200C, 0x0004_0001, 0),
    (0xE000_EDFC, 1 << 24, 1 << 24),
    (0xE000_1000, 1, 1),
];

fn write_debug(bench: &mut Bench, address: u32, value: u32) {
    let cycle = bench.board.cpu.cycle;
    if address >> 12 == 0xE_0042 {
        let soc = &mut bench.board.around.soc;
        soc.write(address, Size::Word, value, cycle).unwrap();
    } else {
        let system = &mut bench.board.cpu.system;
        system.write(address, Size::Word, value, cycle).unwrap();
    }
}

fn read_debug(bench: &mut Bench, address: u32) -> u32 {
    let cycle = bench.board.cpu.cycle;
    if address >> 12 == 0xE_0042 {
        let soc = &mut bench.board.around.soc;
        soc.read(address, Size::Word, cycle).unwrap().value
    } else {
        let system = &mut bench.board.cpu.system;
        system.read(address, Size::Word, cycle).unwrap()
    }
}

/// A debugger that detaches restores DBGMCU_CR, which stops CYCCNT in sleep, and clears DEMCR,
/// which stops it permanently. A debugger that attaches freezes timers and watchdog during a halt.
/// Stimulation continues, and within two windows all bits are restored.
#[test]
fn what_a_debugger_writes_ends_nothing_and_is_put_back() {
    let (bench, _) = Bench::stimulating_in_pulse();
    let detach: &[(u32, u32)] = &[(0xE004_2004, 0), (0xE000_EDFC, 0)];
    let cases: [&[(u32, u32)]; 6] = [
        &[(0xE004_2004, 0)],
        &[(0xE004_2008, 0x1801), (0xE004_200C, 0x0007_0003)],
        &[(0xE000_EDFC, 0)],
        &[(0xE000_1000, 0)],
        &[(0xE000_1004, 12_345)], // CYCCNT itself
        detach,
    ];
    for writes in cases {
        let mut bench = bench.clone();
        // At different moments of a window: every 1.013 ms.
        for _ in 0..70 {
            for &(address, value) in writes {
                write_debug(&mut bench, address, value);
            }
            bench.run_us(1_013);
            assert_eq!(bench.fault(), None, "{writes:x?}");
            for (address, bits, value) in DEBUG {
                let found = read_debug(&mut bench, address) & bits;
                assert_eq!(found, value, "{address:#x} after {writes:x?}");
            }
        }
        assert!(bench.drives_within(10), "{writes:x?}");
    }
}

/// Without the debug bits, CYCCNT misses the cycles in which the core sleeps.
#[test]
fn the_cycle_counter_stands_while_the_image_sleeps_without_debug_bits() {
    let mut bench = Bench::idle();
    let since = bench.board.cpu.cycle;
    let before = read_debug(&mut bench, 0xE000_1004);
    for _ in 0..10 {
        write_debug(&mut bench, 0xE004_2004, 0);
        bench.run_us(100);
    }
    let passed = (bench.board.cpu.cycle - since) as u32;
    let counted = read_debug(&mut bench, 0xE000_1004).wrapping_sub(before);
    println!("counted {counted} of {passed} cycles");
    assert!(counted < passed / 2, "{counted} of {passed}");
}
