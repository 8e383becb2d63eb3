//! USART2, with the core asleep while the line is silent. QEMU takes a byte from the line only when
//! the data register is empty. No byte is lost, however long a command takes, and no buffer is
//! needed.

use core::ptr::{read_volatile, write_volatile};
use cortex_m::{asm::wfi, interrupt};

/// Address of RCC_APB1ENR (RM0090 section 7.3.13).
const RCC_APB1ENR: *mut u32 = 0x4002_3840 as *mut u32;
const USART2EN: u32 = 1 << 17;

/// Status register of USART2 (RM0090 section 30.6).
const SR: *mut u32 = 0x4000_4400 as *mut u32;
/// Data register of USART2.
const DR: *mut u32 = 0x4000_4404 as *mut u32;
/// First control register of USART2.
const CR1: *mut u32 = 0x4000_440C as *mut u32;
const RXNE: u32 = 1 << 5;
const TXE: u32 = 1 << 7;
/// UE, RXNEIE, TE and RE of USART_CR1.
const ENABLE: u32 = 1 << 13 | 1 << 5 | 1 << 3 | 1 << 2;

/// NVIC_ISER1, which enables interrupts (PM0214 section 4.3); USART2 is interrupt 38.
const NVIC_ISER1: *mut u32 = 0xE000_E104 as *mut u32;
/// NVIC_ICPR1, which clears pending interrupts.
const NVIC_ICPR1: *mut u32 = 0xE000_E284 as *mut u32;
const USART2_IRQ: u32 = 1 << (38 - 32);

/// USART2 after [`Self::enable`].
pub struct Usart(());

impl Usart {
    /// Enables the peripheral with 8 data bits; QEMU has no baud rate. The interrupt wakes the core
    /// and is never taken.
    pub fn enable() -> Self {
        interrupt::disable();
        set(RCC_APB1ENR, read(RCC_APB1ENR) | USART2EN);
        set(CR1, ENABLE);
        set(NVIC_ISER1, USART2_IRQ);
        Self(())
    }

    /// Waits for a byte and returns it.
    pub fn read(&mut self) -> u8 {
        // Sleeps instead of polling: polling holds the lock under which QEMU would deliver the
        // byte, and takes ten times as long. A byte that arrives after the check is pending, so
        // `wfi` returns at once.
        while read(SR) & RXNE == 0 {
            wfi();
        }
        let byte = read(DR) as u8; // bits 0-7
        set(NVIC_ICPR1, USART2_IRQ);
        byte
    }

    /// Sends bytes, and returns when the last byte is in the data register.
    pub fn write(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            while read(SR) & TXE == 0 {}
            set(DR, byte.into());
        }
    }
}

fn read(register: *mut u32) -> u32 {
    // SAFETY: callers pass only the registers above, which are existing, aligned words. This image
    // has one execution context.
    unsafe { read_volatile(register) }
}

fn set(register: *mut u32, value: u32) {
    // SAFETY: as in `read`. No value written here causes an access to memory: DMA is off, and the
    // one enabled interrupt stays masked.
    unsafe { write_volatile(register, value) }
}
