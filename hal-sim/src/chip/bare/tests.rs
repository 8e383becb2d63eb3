//! Runs small hand-assembled images, as other projects build them, to their end.

use super::*;
use crate::chip::board::wiring::CORE_HZ;
use crate::chip::image::tests::{CODE, program};

/// Encodes MOVW and MOVT that load `value` into R`d`.
fn set(d: u16, value: u32) -> [u16; 4] {
    let half = |opcode: u16, value: u32| {
        let imm = value as u16;
        let first = opcode | (imm >> 11 & 1) << 10 | imm >> 12;
        [first, (imm >> 8 & 7) << 12 | d << 8 | imm & 0xFF]
    };
    let [low, high] = [half(0xF240, value & 0xFFFF), half(0xF2C0, value >> 16)];
    [low[0], low[1], high[0], high[1]]
}

/// Encodes a write of `value` to `address` with `store`, which stores R1 at R0.
fn put(store: u16, address: u32, value: u32) -> Vec<u16> {
    [&set(0, address)[..], &set(1, value), &[store]].concat()
}

/// Encodes a loop that waits until the word at `address` has `bit` set.
fn until(address: u32, bit: u32) -> Vec<u16> {
    // ldr r1,[r0]; tst r1,r2; beq to the load
    [
        &set(0, address)[..],
        &set(2, bit),
        &[0x6801, 0x4211, 0xD0FC],
    ]
    .concat()
}

const STR: u16 = 0x6001;
const STRH: u16 = 0x8001;
const LDR: u16 = 0x6801;
const STOP: u16 = 0xE7FE; // b .
const WFI: u16 = 0xBF30;
const SEMIHOSTING: u16 = 0xBEAB; // bkpt 0xAB

const RCC_AHB1ENR: u32 = 0x4002_3830;
const RCC_APB1ENR: u32 = 0x4002_3840;
const GPIOA: u32 = 0x4002_0000;

/// Runs the code as `main`, followed by `b .` as `HardFault_Handler`, which takes hard faults.
fn with_handler(code: &[u16]) -> Bare {
    let length = 2 * code.len() as u32;
    let names = [
        ("main", CODE, length),
        ("HardFault_Handler", CODE + length, 2),
    ];
    let mut image = program(&[code, &[STOP]].concat(), &names);
    image.flash[12..16].copy_from_slice(&(CODE + length + 1).to_le_bytes());
    Bare::power_on(image, false).unwrap()
}

fn running(code: &[u16]) -> Bare {
    let main = [("main", CODE, 2 * code.len() as u32)];
    Bare::power_on(program(code, &main), false).unwrap()
}

const MS: u64 = 1_000_000;

/// Sets the clock up as ST's HAL does: the crystal, the PLL through its bit's alias, the flash's
/// latency by a byte write; then drives PA5 through the halves of BSRR.
#[test]
fn a_pin_moves_after_a_clock_that_was_set_up_through_an_alias() {
    const RCC_CR: u32 = 0x4002_3800;
    let plloncfg = 8 | 336 << 6 | 1 << 22 | 7 << 24;
    let code = [
        put(STR, RCC_CR, 0x0001_0083),
        until(RCC_CR, 1 << 17),
        put(STR, RCC_CR + 4, plloncfg),
        put(STR, 0x4247_0060, 1),
        until(0x4247_0064, 1), // PLLRDY through its alias
        put(0x7001, 0x4002_3C00, 5),
        put(STR, RCC_CR + 8, 0x9402), // APB1 divided by 4, APB2 by 2; the PLL as source
        put(STR, RCC_AHB1ENR, 1),
        vec![LDR],
        put(STRH, GPIOA, 1 << 10),
        put(STRH, GPIOA + 0x18, 1 << 5),
        put(STRH, GPIOA + 0x1A, 1 << 5),
        vec![STOP],
    ]
    .concat();
    let mut bare = running(&code);
    assert_eq!(bare.run_to(5 * MS), Ok(()));
    assert_eq!(bare.wires.soc.hz(), CORE_HZ);
    let edges: Vec<_> = bare
        .wires
        .edges()
        .filter(|pin_edge| pin_edge.changed & 1 << 5 != 0)
        .collect();
    let levels = edges
        .iter()
        .map(|pin_edge| (pin_edge.port, pin_edge.levels >> 5 & 1));
    assert_eq!(levels.collect::<Vec<_>>(), [(0, 1), (0, 0)]);
    // The HSE takes 2 ms and the PLL 0.3 ms; about six instructions at 168 MHz are between the
    // edges.
    assert!((2_300_000..2_400_000).contains(&edges[0].ns), "{edges:?}");
    assert!(
        (20..200).contains(&(edges[1].ns - edges[0].ns)),
        "{edges:?}"
    );
    assert_eq!(bare.wires.toggles()[0][5], 2);
    assert!(bare.now_ns().abs_diff(5 * MS) < 21_000, "{}", bare.now_ns());
    assert!(bare.faults().is_empty());
}

#[test]
fn a_fault_is_named_with_its_place_and_ends_the_run_in_its_handler() {
    let mut bare = with_handler(&put(STR, 0x4247_0060, 1));
    assert_eq!(bare.run_to(MS), Ok(()), "the write is well");
    let code = [&set(3, 7)[..], &set(0, 0x4002_5000), &[LDR]].concat();
    let mut bare = with_handler(&code);
    assert_eq!(bare.run_to(1_000 * MS), Err(EarlyEnd::InHandler));
    let limit = HANDLER_NS..HANDLER_NS + 10 * MS;
    assert!(limit.contains(&bare.now_ns()), "{}", bare.now_ns());
    let [fault] = bare.faults() else {
        panic!("{:?}", bare.faults())
    };
    let load = CODE + 16;
    assert_eq!((fault.name(), fault.pc()), ("HardFault", Some(load)));
    assert_eq!((fault.cfsr, fault.hfsr), (0x8200, 1 << 30));
    let words = fault.describe(&bare.image().symbols);
    assert_eq!(
        words,
        "HardFault: a bus error at a data access at 0x40025000, pc 0x08000050 (in main + 0x10)"
    );
    assert!(fault.registers().contains(&("r3", 7)));
    assert_eq!(bare.location().1, "HardFault_Handler + 0x0");
}

#[test]
fn a_fault_without_a_handler_locks_the_core_up_and_is_named_all_the_same() {
    let mut bare = running(&[0xDE00]); // udf
    let ended = bare.run_to(MS);
    assert!(
        matches!(ended, Err(EarlyEnd::Stopped(Stop::LockUp { .. }))),
        "{ended:?}"
    );
    let words = bare.faults()[0].describe(&bare.image().symbols);
    assert!(words.contains("undefined instruction"), "{words}");
    assert!(words.contains("(in main + 0x0)"), "{words}");
}

/// A handler that returns behind the faulting instruction does not end the run.
#[test]
fn a_fault_whose_handler_returns_is_counted_only() {
    // The code below runs with UsageFault's frame: ldr r0,[sp,#24]; adds r0,#2; str r0,[sp,#24]; bx
    // lr
    let main = [&[0xDE00_u16][..], &[STOP]].concat();
    let mut bare = with_handler(&main);
    let handler = CODE + 4;
    for (n, half) in [0x9806_u16, 0x3002, 0x9006, 0x4770].into_iter().enumerate() {
        let at = (handler - 0x0800_0000) as usize + 2 * n;
        bare.wires
            .soc
            .flash
            .load(0x0800_0000 + at as u32, &half.to_le_bytes())
            .unwrap();
    }
    assert_eq!(bare.run_to(300 * MS), Ok(()));
    assert_eq!(bare.faults().len(), 1);
    assert!(!bare.is_in_handler());
    assert_eq!(bare.location().1, "main + 0x2");
}

#[test]
fn a_core_that_sleeps_for_good_is_told_from_one_that_waits() {
    let mut bare = running(&[WFI, 0xE7FD]);
    assert_eq!(bare.run_to(100 * MS), Ok(()));
    assert!(bare.sleeps_for_good());
    assert_eq!(bare.instructions(), 1);
    // SysTick every 16,000 cycles.
    let code = [
        put(STR, 0xE000_E014, 15_999),
        put(STR, 0xE000_E010, 7),
        vec![0xB672, WFI, 0xE7FD], // cpsid i
    ];
    let mut bare = running(&code.concat());
    assert_eq!(bare.run_to(100 * MS), Ok(()));
    assert!(!bare.sleeps_for_good());
}

#[test]
fn a_program_ends_itself_with_a_status_and_prints() {
    const BLOCK: u32 = 0x2000_0100;
    let code = [
        put(STR, BLOCK, u32::from_le_bytes(*b"hey\0")),
        set(1, BLOCK).to_vec(),
        vec![0x2004, SEMIHOSTING], // movs r0,#4: WRITE0
        put(STR, BLOCK, 0x2_0026),
        put(STR, BLOCK + 4, 42),
        set(1, BLOCK).to_vec(),
        vec![0x2020, SEMIHOSTING],
    ];
    let mut bare = running(&code.concat());
    assert_eq!(bare.run_to(MS), Err(EarlyEnd::Exit(42)));
    assert_eq!(bare.console(), b"hey");
    assert_eq!(bare.console(), b"");
}

#[test]
fn a_refusal_names_peripheral_register_and_function() {
    let code = [
        put(STR, RCC_APB1ENR, 1 << 19),
        put(STRH, 0x4000_4C08, 0x16D),
        vec![STOP],
    ];
    let mut bare = running(&code.concat());
    let Err(EarlyEnd::Stopped(stop)) = bare.run_to(MS) else {
        panic!("{:?}", bare.location())
    };
    assert_eq!(
        stop.to_string(),
        "this peripheral is not modelled: UART4_BRR, 0x40004c08, a half-word written with \
         0x016d by the instruction at 0x08000062"
    );
    assert_eq!(bare.location().1, "main + 0x22");
    // The error names the register for partly modelled features, too.
    let code = [put(STR, RCC_APB1ENR, 2), put(STR, 0x4000_0408, 4)].concat();
    let mut bare = running(&[code, put(STR, 0x4000_0418, 2)].concat());
    let ended = format!(
        "{:?}",
        bare.run_to(MS).map_err(|error| match error {
            EarlyEnd::Stopped(stop) => stop.to_string(),
            other => format!("{other:?}"),
        })
    );
    assert!(ended.contains("TIM3_"), "{ended}");
}

#[test]
fn resets_are_gone_through_and_counted_with_their_cause() {
    let mut bare = running(&put(STR, 0xE000_ED0C, 0x05FA_0004));
    assert_eq!(bare.run_to(MS / 10), Ok(()));
    assert!(bare.resets().len() > 3);
    let causes = bare.resets().iter().map(|(_, cause)| *cause);
    assert!(causes.into_iter().all(|cause| cause == Cause::Software));
}

#[test]
fn usart2_is_heard() {
    let code = [
        put(STR, RCC_APB1ENR, 1 << 17),
        put(STR, 0x4000_4408, 16),
        put(STR, 0x4000_440C, 0x2008),
        put(0x7001, 0x4000_4404, b'h'.into()),
        put(0x7001, 0x4000_4404, b'i'.into()),
        vec![STOP],
    ];
    let mut bare = running(&code.concat());
    assert_eq!(bare.run_to(MS), Ok(()));
    assert_eq!(bare.wires.serial(), b"hi");
}
