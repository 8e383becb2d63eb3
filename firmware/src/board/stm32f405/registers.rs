//! Registers that decide edges, read back while anything may play: half of them in
//! each window, held against what set-up means them to be.
//!
//! What is written once at set-up stands here a second time, on purpose and as
//! numbers: a check that shared the code of what it checks would share its mistakes.
//! Left out is what shows by what it does: most of TIM1 and what clocks TIM2, in the
//! tape's positions and TIM11's count (`Tape::check`); TIM11, in what it captures
//! (`Crystal`); the refill's interrupt, in the second clock.
//!
//! Bits that debuggers write too are put back, and are no fault: nothing that plays depends
//! on them before the next reading does so.

use super::clock;
use crate::safety::Fault;
use crate::seal::fold;
use cortex_m::register::basepri;

const TIM1: u32 = 0x4001_0000;
const TIM2: u32 = 0x4000_0000;
const SPI3: u32 = 0x4000_3C00;
const PWR: u32 = 0x4000_7000;
const ADC1: u32 = 0x4001_2000;
const SYSCFG: u32 = 0x4001_3800;
const EXTI: u32 = 0x4001_3C00;
const GPIOA: u32 = 0x4002_0000;
const GPIOB: u32 = 0x4002_0400;
const GPIOC: u32 = 0x4002_0800;
const GPIOD: u32 = 0x4002_0C00;
const RCC: u32 = 0x4002_3800;
const FLASH: u32 = 0x4002_3C00;
const DMA2: u32 = 0x4002_6400;
const DWT: u32 = 0xE000_1000;
const SYST: u32 = 0xE000_E010;
const DEMCR: u32 = 0xE000_EDFC;
const DBGMCU: u32 = 0xE004_2000;
const NVIC: u32 = 0xE000_E100;

/// The tape in SRAM2 (memory.x): B, C and the isolated words for each.
const TAPE_B: u32 = 0x2001_C000;
const TAPE_C: u32 = TAPE_B + 2_000;
const ISOLATED_B: u32 = TAPE_C + 2_000;
const ISOLATED_C: u32 = ISOLATED_B + 4;

/// Whether registers are what they must be: addresses, bits that count, values. One
/// comparison of sums, in straight code: a loop over a table takes three times as long.
macro_rules! hold {
    ($($address:expr, $bits:expr => $value:expr;)*) => {{
        const MUST_BE: u32 = {
            let sum = 0;
            $(let sum = fold(sum, $value);)*
            sum
        };
        let sum = 0;
        $(let sum = fold(sum, read($address) & $bits);)*
        sum == MUST_BE
    }};
}

/// Pins and what paces them.
fn pins_hold() -> bool {
    hold! {
        GPIOA, 0xC003_FF0F => 0x8000_0F0F; // MODER: 0, 1, 4, 5 analogue, 6–8 in, 15 TIM2
        GPIOB, 0xFF3F_FC0F => 0x5515_5405; // MODER: all outputs
        GPIOC, 0x03FF_FFFF => 0x0265_5555; // MODER: 0–9, 11 outputs, 10, 12 SPI3
        GPIOD, 0x0000_0030 => 0x0000_0010; // MODER: 2 output
        GPIOB + 0x04, 0xF7E3 => 0; // OTYPER: push-pull
        GPIOC + 0x04, 0x0BFF => 0;
        GPIOA + 0x24, 0xF000_0000 => 0x1000_0000; // AFRH: 15 is TIM2's
        GPIOC + 0x24, 0x000F_0F00 => 0x0006_0600; // AFRH: 10, 12 are SPI3's
        RCC, 0x010D_0001 => 0x0109_0001; // CR: HSI, HSE, CSS, PLL; no bypass
        RCC + 0x04, 0x0F43_7FFF => 0x0740_2A04; // PLLCFGR: 8 MHz / 4 · 168 / 2, / 7
        RCC + 0x08, 0x0000_FCFF => 0x0000_940A; // CFGR: PLL; AHB / 1, APB1 / 4, APB2 / 2
        FLASH, 0x0707 => 0x0705; // ACR: 5 wait states, caches on
        TIM1 + 0x34, 0xFFFF => 8; // CCR1: when in its microsecond port C moves
        TIM1 + 0x38, 0xFFFF => 20; // CCR2: when tape B is erased
        TIM1 + 0x3C, 0xFFFF => 32; // CCR3: and tape C
    }
}

/// Where the tape is played from and to, and how. CR: channel 6, priority very high, words,
/// the memory's address increments, circular, to the port, on. That FCR asks for direct mode
/// shows in the positions, which a FIFO would fetch ahead of.
fn play_holds() -> bool {
    hold! {
        stream(1), 0x0FEF_FFFF => 0x0C03_5541; // CR
        stream(5), 0x0FEF_FFFF => 0x0C03_5541;
        stream(1) + 0x08, u32::MAX => GPIOC + 0x18; // PAR: BSRR
        stream(5) + 0x08, u32::MAX => GPIOB + 0x18;
        stream(1) + 0x0C, u32::MAX => TAPE_C; // M0AR
        stream(5) + 0x0C, u32::MAX => TAPE_B;
    }
}

/// What erases it. CR: as there, but from the isolated word.
fn erase_holds() -> bool {
    hold! {
        stream(2), 0x0FEF_FFFF => 0x0C03_5501;
        stream(6), 0x0FEF_FFFF => 0x0C03_5501;
        stream(2) + 0x08, u32::MAX => ISOLATED_B;
        stream(6) + 0x08, u32::MAX => ISOLATED_C;
        stream(2) + 0x0C, u32::MAX => TAPE_B;
        stream(6) + 0x0C, u32::MAX => TAPE_C;
    }
}

/// Registers of stream `n` of DMA2 (RM0090 section 10.5.5).
const fn stream(n: u32) -> u32 {
    DMA2 + 0x10 + 0x18 * n
}

/// What stops and what is measured.
fn inputs_hold() -> bool {
    hold! {
        RCC + 0x30, 0x0040_000F => 0x0040_000F; // AHB1ENR: GPIOA–D, DMA2
        RCC + 0x40, 0x1000_8009 => 0x1000_8009; // APB1ENR: PWR, SPI3, TIM5, TIM2
        RCC + 0x44, 0x0000_4101 => 0x0000_4101; // APB2ENR: SYSCFG, ADC1, TIM1
        TIM2 + 0x04, 0x70 => 0x60; // CR2: TRGO is OC3REF
        TIM2 + 0x18, 0xFFFF => 0x31; // CCMR1: capture, filtered
        TIM2 + 0x20, 0x3 => 0x1; // CCER: rising edge
        ADC1 + 0x04, 0x03C0_FFFF => 0x0100; // CR1: twelve bits, scan
        ADC1 + 0x08, 0x003F_0801 => 0x0013_0001; // CR2: TIM2's TRGO, rising, to the right, on
        ADC1 + 0x38, 0x003F_FFFF => 0x0010_0400; // JSQR: current, then angle
        SPI3, 0xFFFF => 0xCB45; // CR1: master, 16 bits, mode 1
        EXTI, 0x0001_0080 => 0x0001_0080; // IMR: over-current, supply
        EXTI + 0x0C, 0x80 => 0x80; // FTSR: over-current falls
        SYSCFG + 0x0C, 0xF000 => 0; // EXTICR2: line 7 is port A's
        PWR, 0xF0 => 0xD0; // CR: supply watch at level 6
        NVIC, 0x0080_0002 => 0x0080_0002; // ISER0: EXTI9_5, PVD
        SYST, 0x7 => 0x7; // CSR: core clock, interrupt, on
        SYST + 0x04, 0x00FF_FFFF => 50_399; // RVR: overdue after 300 µs
    }
}

/// What lets CYCCNT count and clocks run in sleep, and what keeps running under a halt.
fn debug_holds(is_odd: bool) -> bool {
    if is_odd {
        hold! {
            DBGMCU + 0x04, 0x0000_0001 => 1; // CR: clocks in sleep
            DBGMCU + 0x08, 0x0000_1001 => 0; // APB1FZR: TIM2, watchdog
            DBGMCU + 0x0C, 0x0004_0001 => 0; // APB2FZR: TIM1, TIM11
        }
    } else {
        hold! {
            DEMCR, 1 << 24 => 1 << 24; // TRCENA
            DWT, 1 => 1; // CTRL: CYCCNTENA
        }
    }
}

/// Puts the bits that a debugger may have changed back, half of them in each window.
pub fn keep_debug_bits(is_odd: bool) {
    if !debug_holds(is_odd) {
        clock::keep_debug_bits();
    }
}

/// Reads the registers of this window, which are those of every other.
///
/// # Errors
/// [`Fault::Registers`].
pub fn check(is_odd: bool) -> Result<(), Fault> {
    let holds = if is_odd {
        pins_hold() && play_holds()
    } else {
        inputs_hold() && erase_holds() && basepri::read() == 0 // which this program never sets
    };
    if holds { Ok(()) } else { Err(Fault::Registers) }
}

#[inline(always)]
fn read(address: u32) -> u32 {
    // SAFETY: only the addresses above: registers of this chip that reading does not
    // change (RM0090; none of them is a flag or data register).
    unsafe { (address as *const u32).read_volatile() }
}
