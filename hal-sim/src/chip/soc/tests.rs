//! Tests of the whole chip, with a core and a few instructions or by its registers.

use super::Soc;
use crate::chip::Cycle;
use crate::chip::cpu::bus::Bus;
use crate::chip::cpu::{Cpu, Size, Stop};
use crate::chip::soc::{Pace, flash};

const RCC_AHB1ENR: u32 = 0x4002_3830;
const RCC_AHB1RSTR: u32 = 0x4002_3810;
const IWDG_KR: u32 = 0x4000_3000;
const CRC_DR: u32 = 0x4002_3000;
const GPIOB_ODR: u32 = 0x4002_0414;
/// Core cycles per second at HSI.
const SECOND: Cycle = 16_000_000;

fn set(soc: &mut Soc, address: u32, value: u32, at: Cycle) -> u32 {
    soc.advance(at).unwrap();
    soc.write(address, Size::Word, value, at).unwrap()
}

fn get(soc: &mut Soc, address: u32, at: Cycle) -> u32 {
    soc.advance(at).unwrap();
    soc.read(address, Size::Word, at).unwrap().value
}

/// Creates a chip with `code` at its reset vector, and its core after reset.
fn running(code: &[u16]) -> (Soc, Cpu) {
    let mut soc = Soc::new(Pace::Lazy);
    let vectors = [0x2001_0000_u32, flash::BASE + 9].map(u32::to_le_bytes);
    let code = code.iter().flat_map(|half| half.to_le_bytes());
    let bytes: Vec<u8> = vectors.concat().into_iter().chain(code).collect();
    soc.flash.load(flash::BASE, &bytes).unwrap();
    let mut cpu = Cpu::default();
    cpu.reset(&mut soc).unwrap();
    (soc, cpu)
}

#[test]
fn the_watchdog_resets_a_core_that_sleeps_with_all_interrupts_off() {
    // cpsid i; cpsid f; wfi; b wfi
    let (mut soc, mut cpu) = running(&[0xB672, 0xB671, 0xBF30, 0xE7FD]);
    let begin = cpu.cycle;
    set(&mut soc, IWDG_KR, 0xCCCC, begin);
    let stopped = cpu.run(&mut soc, begin + 10 * SECOND);
    assert!(matches!(stopped, Err(Stop::Reset { .. })), "{stopped:?}");
    // 512 ms at LSI's 32 kHz and the shortest prescaler (RM0090 table 107).
    let slept = (cpu.cycle - begin) / 16;
    assert!((512_000..512_200).contains(&slept), "{slept} us");
    let at = cpu.cycle;
    soc.reset(crate::chip::soc::rcc::Cause::Watchdog, at)
        .unwrap();
    cpu.reset(&mut soc).unwrap();
    let before = cpu.instructions;
    assert_eq!(cpu.run(&mut soc, at + SECOND), Ok(()), "it stands now");
    assert_eq!(cpu.instructions, before + 3, "awake, until it sleeps again");
}

#[test]
fn a_peripheral_without_its_clock_reads_zero_and_loses_writes() {
    let mut soc = Soc::new(Pace::Lazy);
    set(&mut soc, GPIOB_ODR, 5, 10);
    assert_eq!(get(&mut soc, GPIOB_ODR, 20), 0);
    assert_eq!(get(&mut soc, 0x4000_0024, 30), 0, "TIM2");
    assert_eq!(soc.unclocked, 3);
    set(&mut soc, RCC_AHB1ENR, 1 << 1, 40);
    assert_eq!(get(&mut soc, GPIOB_ODR, 50), 0, "the write was lost");
    set(&mut soc, GPIOB_ODR, 5, 60);
    assert_eq!(get(&mut soc, GPIOB_ODR, 70), 5);
    // With the clock off again, the register keeps its value but reads 0.
    set(&mut soc, RCC_AHB1ENR, 0, 80);
    assert_eq!(get(&mut soc, GPIOB_ODR, 90), 0);
    set(&mut soc, RCC_AHB1ENR, 1 << 1, 100);
    assert_eq!(get(&mut soc, GPIOB_ODR, 110), 5);
    assert_eq!(soc.unclocked, 4);
}

#[test]
fn backup_sram_has_a_clock_a_protection_and_outlives_resets_but_not_power() {
    use crate::chip::soc::rcc::Cause;
    const PWR_CR: u32 = 0x4000_7000;
    const RCC_APB1ENR: u32 = 0x4002_3840;
    const WORD: u32 = 0x4002_4FFC;
    let open = |soc: &mut Soc, at| {
        set(soc, RCC_AHB1ENR, 1 << 18, at);
        set(soc, RCC_APB1ENR, 1 << 28, at + 10);
        set(soc, PWR_CR, 1 << 14 | 1 << 8, at + 20);
    };
    let mut soc = Soc::new(Pace::Lazy);
    assert_eq!(get(&mut soc, WORD, 10), 0, "no clock");
    set(&mut soc, RCC_AHB1ENR, 1 << 18, 20);
    let faded = get(&mut soc, WORD, 30);
    set(&mut soc, WORD, 5, 40);
    assert_eq!(get(&mut soc, WORD, 50), faded, "DBP is off");
    open(&mut soc, 60);
    set(&mut soc, WORD, 5, 100);
    assert_eq!(get(&mut soc, WORD, 110), 5);
    for (n, cause) in [
        Cause::Software,
        Cause::Watchdog,
        Cause::Pin,
        Cause::BrownOut,
    ]
    .into_iter()
    .enumerate()
    {
        let at = 1_000 * (n as Cycle + 1);
        soc.reset(cause, at).unwrap();
        assert_eq!(get(&mut soc, WORD, at + 10), 0, "its clock is off again");
        set(&mut soc, RCC_AHB1ENR, 1 << 18, at + 20);
        set(&mut soc, WORD, 6, at + 30);
        assert_eq!(
            get(&mut soc, WORD, at + 40),
            5,
            "{cause:?}: DBP is off again"
        );
    }
    soc.reset(Cause::PowerOn, 10_000).unwrap();
    open(&mut soc, 10_010);
    assert_eq!(get(&mut soc, WORD, 10_100), faded);
}

#[test]
fn the_crc_unit_has_clock_reset_and_four_cycles_a_word() {
    let mut soc = Soc::new(Pace::Lazy);
    assert_eq!(get(&mut soc, CRC_DR, 10), 0, "no clock");
    set(&mut soc, RCC_AHB1ENR, 1 << 12, 20);
    assert_eq!(get(&mut soc, CRC_DR, 30), u32::MAX);
    assert_eq!(set(&mut soc, CRC_DR, 0, 40), 0);
    let sum = soc.read(CRC_DR, Size::Word, 41).unwrap();
    assert_eq!((sum.value, sum.wait), (0xC704_DD7B, 3));
    set(&mut soc, RCC_AHB1RSTR, 1 << 12, 60);
    set(&mut soc, RCC_AHB1RSTR, 0, 70);
    assert_eq!(get(&mut soc, CRC_DR, 80), u32::MAX);
}

/// movs r0, #1; lsls r0, #29; movs r1, #0; loop: adds r1, #1; str r1, [r0]; b loop.
const COUNT: [u16; 6] = [0x2001, 0x0740, 0x2100, 0x3101, 0x6001, 0xE7FC];

#[test]
fn a_fork_and_its_original_stay_identical_for_a_second() {
    let (mut soc, mut cpu) = running(&COUNT);
    set(&mut soc, IWDG_KR, 0xCCCC, cpu.cycle);
    cpu.run(&mut soc, SECOND / 3).unwrap();
    let begin = std::time::Instant::now();
    let (mut fork, mut its) = (soc.clone(), cpu.clone());
    println!("a fork took {:?}", begin.elapsed());
    // One runs in one piece, the other in many, across the watchdog's reset.
    let end = cpu.cycle + SECOND;
    let run = |soc: &mut Soc, cpu: &mut Cpu, step: Cycle| {
        let mut bites = 0;
        while cpu.cycle < end {
            match cpu.run(soc, end.min(cpu.cycle + step)) {
                Ok(()) => {}
                Err(Stop::Reset { .. }) => {
                    bites += 1;
                    let at = cpu.cycle;
                    soc.reset(crate::chip::soc::rcc::Cause::Watchdog, at)
                        .unwrap();
                    cpu.reset(soc).unwrap();
                }
                Err(stop) => panic!("{stop}"),
            }
        }
        bites
    };
    assert_eq!(run(&mut soc, &mut cpu, SECOND), 1);
    assert_eq!(run(&mut fork, &mut its, 12_345), 1);
    assert_eq!(
        format!("{:?}", cpu.registers),
        format!("{:?}", its.registers)
    );
    assert_eq!((cpu.cycle, cpu.instructions), (its.cycle, its.instructions));
    assert_eq!(soc.ram.bytes, fork.ram.bytes);
    assert!(get(&mut soc, 0x2000_0000, cpu.cycle) > 1_000_000);
}

#[test]
fn a_bit_that_flips_in_a_fork_does_not_touch_its_original() {
    // loop: ldr r2, [r0, #4]; adds r1, r1, r2; str r1, [r0]; b loop, r0 as above.
    let (mut soc, mut cpu) = running(&[0x2001, 0x0740, 0x6842, 0x1889, 0x6001, 0xE7FB]);
    soc.ram.bytes[4] = 1;
    cpu.run(&mut soc, 100_000).unwrap();
    let mut forks = [(); 2].map(|()| (soc.clone(), cpu.clone()));
    forks[0].0.ram.bytes[4] ^= 2;
    cpu.run(&mut soc, 200_000).unwrap();
    let counted = get(&mut soc, 0x2000_0000, 200_100);
    let counts = forks.map(|(mut soc, mut cpu)| {
        cpu.run(&mut soc, 200_000).unwrap();
        get(&mut soc, 0x2000_0000, 200_100)
    });
    assert_eq!(counts[1], counted);
    // The second half counts by three.
    assert!(counts[0].abs_diff(2 * counted) < 10, "{counts:?}");
}
