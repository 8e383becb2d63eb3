//! Check of the registers that determine edges, while anything may play: half of them are read in
//! each window and compared with their configured values.
//!
//! The values are deliberately repeated here: as numbers, or derived from the board's wiring by
//! code that set-up does not use, because a check that shares code with set-up would share its
//! mistakes. Registers whose effect is checked elsewhere are left out: most of TIM1 and the clock
//! source of TIM2, by the tape's positions and TIM11's count (`Tape::check`); TIM11, by its
//! captures (`Crystal`); the refill's interrupt, by the refill watchdog.
//!
//! Bits that debuggers write too are restored and are no fault: nothing that plays depends on them
//! before the next check restores them.

use super::clock::{self, SUPPLY_LINE};
use crate::board::wiring::{BOARD, Bits, Clocks, Pin, Port};
use crate::safety::Fault;
use crate::seal::fold;
use cortex_m::register::basepri;

const TIM1: u32 = 0x4001_0000;
const TIM2: u32 = 0x4000_0000;
const SPI3: u32 = 0x4000_3C00;
const PWR: u32 = 0x4000_7000;
const ADC1: u32 = 0x4001_2000;
/// SYSCFG_EXTICR of the over-current line.
const EXTICR: u32 = 0x4001_3808 + (OVER_CURRENT.number / 4 * 4) as u32;
const EXTI: u32 = 0x4001_3C00;
const RCC: u32 = 0x4002_3800;
const FLASH: u32 = 0x4002_3C00;
const DMA2: u32 = 0x4002_6400;
const DWT: u32 = 0xE000_1000;
const SYST: u32 = 0xE000_E010;
const DEMCR: u32 = 0xE000_EDFC;
const DBGMCU: u32 = 0xE004_2000;
const NVIC: u32 = 0xE000_E100;

/// Addresses of the tape in SRAM2 (memory.x): the words of the first port, then those of the
/// second.
const TAPE: [u32; 2] = [0x2001_C000, 0x2001_C000 + 2_000];
/// Addresses of the disconnect word of each port, behind the tape.
const ISOLATED: [u32; 2] = [TAPE[1] + 2_000, TAPE[1] + 2_004];

const PORTS: [Port; 2] = BOARD.outputs.ports;
const OVER_CURRENT: Pin = BOARD.inputs.over_current;

/// Returns the base address of the GPIO registers of `port` (RM0090 section 2.3).
const fn gpio(port: Port) -> u32 {
    0x4002_0000 + 0x400 * port.index() as u32
}

/// Returns whether registers have their values, from lines of `address, bits => value`; a register
/// with `bits` 0 is not read. Compares one sum in straight-line code, because a loop over a table
/// takes three times as long.
macro_rules! hold {
    ($($address:expr, $bits:expr => $value:expr;)*) => {{
        const MUST_BE: u32 = {
            let sum = 0;
            $(let sum = if $bits == 0 { sum } else { fold(sum, $value) };)*
            sum
        };
        let sum = 0;
        $(let sum = match const { $bits } {
            0 => sum,
            bits => fold(sum, read(const { $address }) & bits),
        };)*
        sum == MUST_BE
    }};
}

const MODES: [Bits; 5] = {
    let mut modes = [Bits { bits: 0, value: 0 }; 5];
    let mut n = 0;
    while n < modes.len() {
        modes[n] = BOARD.modes(Port::ALL[n]);
        n += 1;
    }
    modes
};
const LOW_PINS: [Bits; 5] = functions(0);
const HIGH_PINS: [Bits; 5] = functions(1);

const fn functions(half: u8) -> [Bits; 5] {
    let (mut functions, mut n) = ([Bits { bits: 0, value: 0 }; 5], 0);
    while n < functions.len() {
        functions[n] = BOARD.functions(Port::ALL[n], half);
        n += 1;
    }
    functions
}

/// Returns whether the registers of the pins and of their timing are correct.
fn pins_hold() -> bool {
    hold! {
        gpio(Port::A), MODES[0].bits => MODES[0].value; // MODER
        gpio(Port::B), MODES[1].bits => MODES[1].value;
        gpio(Port::C), MODES[2].bits => MODES[2].value;
        gpio(Port::D), MODES[3].bits => MODES[3].value;
        gpio(Port::E), MODES[4].bits => MODES[4].value;
        gpio(PORTS[0]) + 0x04, BOARD.driven(PORTS[0]) => 0; // OTYPER: push-pull
        gpio(PORTS[1]) + 0x04, BOARD.driven(PORTS[1]) => 0;
        gpio(Port::A) + 0x20, LOW_PINS[0].bits => LOW_PINS[0].value; // AFRL
        gpio(Port::B) + 0x20, LOW_PINS[1].bits => LOW_PINS[1].value;
        gpio(Port::C) + 0x20, LOW_PINS[2].bits => LOW_PINS[2].value;
        gpio(Port::D) + 0x20, LOW_PINS[3].bits => LOW_PINS[3].value;
        gpio(Port::E) + 0x20, LOW_PINS[4].bits => LOW_PINS[4].value;
        gpio(Port::A) + 0x24, HIGH_PINS[0].bits => HIGH_PINS[0].value; // AFRH
        gpio(Port::B) + 0x24, HIGH_PINS[1].bits => HIGH_PINS[1].value;
        gpio(Port::C) + 0x24, HIGH_PINS[2].bits => HIGH_PINS[2].value;
        gpio(Port::D) + 0x24, HIGH_PINS[3].bits => HIGH_PINS[3].value;
        gpio(Port::E) + 0x24, HIGH_PINS[4].bits => HIGH_PINS[4].value;
        RCC, 0x010D_0001 => 0x0109_0001; // CR: HSI, HSE, CSS, PLL; no bypass
        RCC + 0x04, Clocks::PLLCFGR_BITS => BOARD.clocks.pllcfgr(); // PLLCFGR
        RCC + 0x08, 0x0000_FCFF => 0x0000_940A; // CFGR: PLL; AHB / 1, APB1 / 4, APB2 / 2
        FLASH, 0x0707 => 0x0700 | BOARD.clocks.wait_states(); // ACR: caches on
        TIM1 + 0x34, 0xFFFF => 8; // CCR1: when the second port moves within its microsecond
        TIM1 + 0x38, 0xFFFF => 20; // CCR2: when the first tape is erased
        TIM1 + 0x3C, 0xFFFF => 32; // CCR3: when the second tape is erased
    }
}

/// Returns whether the play streams are configured correctly: source, destination and mode. CR:
/// request channel, priority very high, 32-bit words, memory address increments, circular, memory
/// to port, enabled. FCR is not read: a FIFO, instead of direct mode, would fetch ahead, which the
/// positions show.
fn play_holds() -> bool {
    hold! {
        stream(PLAY[1]), 0x0FEF_FFFF => REQUEST | 0x0003_5541; // CR
        stream(PLAY[0]), 0x0FEF_FFFF => REQUEST | 0x0003_5541;
        stream(PLAY[1]) + 0x08, u32::MAX => gpio(PORTS[1]) + 0x18; // PAR: BSRR
        stream(PLAY[0]) + 0x08, u32::MAX => gpio(PORTS[0]) + 0x18;
        stream(PLAY[1]) + 0x0C, u32::MAX => TAPE[1]; // M0AR
        stream(PLAY[0]) + 0x0C, u32::MAX => TAPE[0];
    }
}

/// Returns whether the erase streams are configured correctly. CR is that of the play streams,
/// except that the source is the disconnect word.
fn erase_holds() -> bool {
    hold! {
        stream(ERASE[0]), 0x0FEF_FFFF => REQUEST | 0x0003_5501;
        stream(ERASE[1]), 0x0FEF_FFFF => REQUEST | 0x0003_5501;
        stream(ERASE[0]) + 0x08, u32::MAX => ISOLATED[0];
        stream(ERASE[1]) + 0x08, u32::MAX => ISOLATED[1];
        stream(ERASE[0]) + 0x0C, u32::MAX => TAPE[0];
        stream(ERASE[1]) + 0x0C, u32::MAX => TAPE[1];
    }
}

const PLAY: [u8; 2] = BOARD.streams.play;
const ERASE: [u8; 2] = BOARD.streams.erase;
/// CHSEL field of CR: the request channel.
const REQUEST: u32 = (BOARD.streams.channel as u32) << 25;

/// Returns the address of the registers of DMA2's stream `n` (RM0090 section 10.5.5).
const fn stream(n: u8) -> u32 {
    DMA2 + 0x10 + 0x18 * n as u32
}

/// EXTI lines of over-current and of the supply monitor.
const STOPS: u32 = OVER_CURRENT.bit() | 1 << SUPPLY_LINE;
/// Position of the over-current line in its EXTICR, bits (RM0090 section 9.2.3).
const EXTI_PLACE: u32 = (4 * (OVER_CURRENT.number % 4)) as u32;
const CYCLES_PER_US: u32 = BOARD.clocks.cycles_per_us();
/// Clock enable bits of all ports in use and of DMA2.
const AHB1: u32 = BOARD.ports() | 1 << 22;
/// JSQR: two conversions, current, then angle (RM0090 section 13.13.12).
const SEQUENCE: u32 = 1 << 20
    | (BOARD.inputs.angle.channel as u32) << 15
    | (BOARD.inputs.current.channel as u32) << 10;

/// Returns whether the registers of the stop inputs, the trigger, the ADC and the DACs are correct.
fn inputs_hold() -> bool {
    hold! {
        RCC + 0x30, AHB1 => AHB1; // AHB1ENR
        RCC + 0x40, 0x1000_8009 => 0x1000_8009; // APB1ENR: PWR, SPI3, TIM5, TIM2
        RCC + 0x44, 0x0000_4101 => 0x0000_4101; // APB2ENR: SYSCFG, ADC1, TIM1
        TIM2 + 0x04, 0x70 => 0x60; // CR2: TRGO is OC3REF
        TIM2 + 0x18, 0xFFFF => 0x31; // CCMR1: capture, filtered
        TIM2 + 0x20, 0x3 => 0x1; // CCER: rising edge
        ADC1 + 0x04, 0x03C0_FFFF => 0x0100; // CR1: twelve bits, scan
        ADC1 + 0x08, 0x003F_0801 => 0x0013_0001; // CR2: TIM2's TRGO, rising, to the right, on
        ADC1 + 0x38, 0x003F_FFFF => SEQUENCE; // JSQR
        SPI3, 0xFFFF => 0xCB45; // CR1: master, 16 bits, mode 1
        EXTI, STOPS => STOPS; // IMR: over-current, supply
        EXTI + 0x0C, OVER_CURRENT.bit() => OVER_CURRENT.bit(); // FTSR: over-current falls
        EXTICR, 0xF << EXTI_PLACE => (OVER_CURRENT.port.index() as u32) << EXTI_PLACE;
        PWR, 0xF0 => 0xD0; // CR: supply monitor at level 6
        NVIC, 0x0080_0002 => 0x0080_0002; // ISER0: EXTI9_5, PVD
        SYST, 0x7 => 0x7; // CSR: core clock, interrupt, on
        // RVR: 300 µs until a refill is overdue
        SYST + 0x04, 0x00FF_FFFF => 300 * CYCLES_PER_US - 1;
    }
}

/// Returns whether CYCCNT counts, clocks run in sleep, and timers run while the core is halted.
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

/// Restores the bits that a debugger may have changed, one half of them in each window.
pub fn keep_debug_bits(is_odd: bool) {
    if !debug_holds(is_odd) {
        clock::keep_debug_bits();
    }
}

/// Checks the registers of this window; they alternate between odd and even windows.
///
/// # Errors
/// Returns [`Fault::Registers`] if one differs, with the number of its group as detail: 1 pins and
/// clocks, 2 play streams, 3 stop inputs, trigger, ADC and DACs, 4 erase streams, 5 BASEPRI.
pub fn check(is_odd: bool) -> Result<(), (Fault, u32)> {
    let found = if is_odd {
        match () {
            () if !pins_hold() => 1,
            () if !play_holds() => 2,
            () => return Ok(()),
        }
    } else {
        match () {
            () if !inputs_hold() => 3,
            () if !erase_holds() => 4,
            () if basepri::read() != 0 => 5, // this program never sets BASEPRI
            () => return Ok(()),
        }
    };
    Err((Fault::Registers, found))
}

#[inline(always)]
fn read(address: u32) -> u32 {
    // SAFETY: only the addresses above are read: registers of this chip that reading does not
    // change (RM0090; none of them is a flag or data register).
    unsafe { (address as *const u32).read_volatile() }
}
