//! Narrow accesses and bit-band aliases at the whole chip's registers.

use crate::chip::Cycle;
use crate::chip::cpu::bit_band::Bit;
use crate::chip::cpu::bus::{AccessError, Bus, Unmodelled};
use crate::chip::cpu::{
    Size,
    Size::{Byte, Half, Word},
};
use crate::chip::soc::rcc::HSI_HZ;
use crate::chip::soc::{Pace, Soc};

const RCC_CR: u32 = 0x4002_3800;
const RCC_PLLCFGR: u32 = 0x4002_3804;
const RCC_CFGR: u32 = 0x4002_3808;
const RCC_AHB1ENR: u32 = 0x4002_3830;
const RCC_APB1ENR: u32 = 0x4002_3840;
const RCC_APB2ENR: u32 = 0x4002_3844;
const FLASH_ACR: u32 = 0x4002_3C00;
const FLASH_KEYR: u32 = 0x4002_3C04;
const GPIOA: u32 = 0x4002_0000;
const MODER: u32 = GPIOA;
const ODR: u32 = GPIOA + 0x14;
const BSRR: u32 = GPIOA + 0x18;
const LCKR: u32 = GPIOA + 0x1C;
const AFRL: u32 = GPIOA + 0x20;

/// Chip whose blocks have their clocks, with the accesses of a core.
struct Chip {
    soc: Soc,
    at: Cycle,
}

impl Chip {
    fn new() -> Self {
        let mut chip = Self {
            soc: Soc::new(Pace::Lazy),
            at: 100,
        };
        // Ports, CRC, backup SRAM, DMA; TIM2-5, SPI3, USART2, PWR; TIM1, ADC1, SYSCFG, TIM11.
        chip.set(Word, RCC_AHB1ENR, 0x0064_11FF);
        chip.set(Word, RCC_APB1ENR, 0x1002_800F);
        chip.set(Word, RCC_APB2ENR, 0x0004_4101);
        chip
    }

    fn next(&mut self) -> Cycle {
        self.at += 100;
        self.soc.advance(self.at).unwrap();
        self.at
    }

    fn write(&mut self, size: Size, address: u32, value: u32) -> Result<u32, AccessError> {
        let at = self.next();
        self.soc.write(address, size, value, at)
    }

    #[track_caller]
    fn set(&mut self, size: Size, address: u32, value: u32) {
        self.write(size, address, value).unwrap();
    }

    fn read(&mut self, size: Size, address: u32) -> Result<u32, AccessError> {
        let at = self.next();
        self.soc.read(address, size, at).map(|read| read.value)
    }

    #[track_caller]
    fn get(&mut self, address: u32) -> u32 {
        self.read(Word, address).unwrap()
    }

    /// Writes bit `number` of the word at `address` through its alias, as the core does.
    fn set_bit(&mut self, size: Size, address: u32, number: u32, value: u32) {
        let alias = 0x4200_0000 + (address - 0x4000_0000) * 32 + number * 4;
        let at = self.next();
        let bit = Bit::from_alias(alias, size).unwrap();
        bit.write(&mut self.soc, size, value, at).unwrap();
    }

    #[track_caller]
    fn refused(&mut self, size: Size, address: u32) -> &'static str {
        match self.write(size, address, 1) {
            Err(AccessError::Unmodelled(Unmodelled(what))) => what,
            other => panic!("{address:#x}: {other:?}"),
        }
    }
}

/// RM0090 8.4 and 8.4.7: the halves of BSRR, and each of its bytes.
#[test]
fn ports_take_bytes_and_half_words() {
    let mut chip = Chip::new();
    chip.set(Half, BSRR, 1 << 5);
    assert_eq!(chip.get(ODR), 1 << 5);
    chip.set(Byte, BSRR + 1, 1 << 3);
    assert_eq!(chip.get(ODR), 1 << 11 | 1 << 5);
    chip.set(Half, BSRR + 2, 1 << 5);
    assert_eq!(chip.get(ODR), 1 << 11);
    chip.set(Byte, BSRR + 3, 1 << 3);
    assert_eq!(chip.get(ODR), 0);
    chip.set(Byte, ODR + 1, 0xA5);
    chip.set(Byte, ODR, 0x5A);
    assert_eq!(chip.get(ODR), 0xA55A);
    chip.set(Half, ODR, 0x1234);
    assert_eq!(chip.get(ODR), 0x1234);
    assert_eq!(chip.read(Byte, ODR + 1), Ok(0x12));
    let moder = chip.get(MODER);
    chip.set(Byte, MODER + 1, 0x04);
    assert_eq!(chip.get(MODER), moder & !0xFF00 | 0x0400, "PA5 an output");
    chip.set(Half, MODER + 2, 0x1234);
    assert_eq!(chip.read(Half, MODER + 2), Ok(0x1234));
    chip.set(Byte, AFRL + 2, 0x70);
    assert_eq!(chip.get(AFRL), 0x0070_0000);
    // The upper bytes of a 16-bit register are reserved.
    chip.set(Half, ODR + 2, 0xFFFF);
    assert_eq!(chip.get(ODR), 0x1234);
}

/// RM0090 8.3.6 and 8.4.8: the key consists of whole words; any other write aborts it.
#[test]
fn a_port_s_lock_takes_words_only() {
    let mut chip = Chip::new();
    let [on, off] = [1 << 16 | 2, 2];
    for narrow in [None, Some((Half, LCKR)), Some((Byte, LCKR + 3))] {
        for value in [on, off, on] {
            if let Some((size, address)) = narrow.filter(|_| value == off) {
                chip.set(size, address, 2);
            } else {
                chip.set(Word, LCKR, value);
            }
        }
        chip.get(LCKR);
        let is_locked = chip.get(LCKR) >> 16 != 0;
        assert_eq!(is_locked, narrow.is_none(), "{narrow:?}");
        chip = Chip::new();
    }
    // A narrow write within a correct key also aborts it, and changes no pin.
    for value in [on, off] {
        chip.set(Word, LCKR, value);
    }
    chip.set(Byte, LCKR, 0xFF);
    chip.set(Word, LCKR, on);
    chip.get(LCKR);
    assert_eq!(chip.get(LCKR), 2);
}

/// RM0090 7.3 and 3.9: ST's libraries set the latency, HSEON and CIR by bytes.
#[test]
fn rcc_and_the_flash_interface_take_bytes() {
    let mut chip = Chip::new();
    chip.set(Word, FLASH_ACR, 0x0700);
    chip.set(Byte, FLASH_ACR, 5);
    assert_eq!(chip.get(FLASH_ACR), 0x0705);
    assert_eq!(chip.read(Byte, FLASH_ACR + 1), Ok(7));
    chip.set(Byte, RCC_CR + 2, 1);
    assert_eq!(chip.get(RCC_CR) & 0x0001_00FF, 0x0001_0083, "HSEON, HSI on");
    chip.set(Half, RCC_CFGR, 0x1000);
    assert_eq!(chip.get(RCC_CFGR), 0x1000, "APB1 by 2");
    chip.set(Byte, 0x4002_380E, 0x80);
    assert_eq!(chip.get(0x4002_380C), 0, "CIR's CSSC");
    assert!(chip.refused(Byte, RCC_PLLCFGR).contains("RCC_PLLCFGR"));
    chip.set(Half, RCC_PLLCFGR + 2, 0x0740);
    assert_eq!(chip.get(RCC_PLLCFGR) >> 16, 0x2740, "HSE, Q 7");
    for size in [Byte, Half] {
        assert!(chip.refused(size, FLASH_KEYR).contains("FLASH key"));
    }
}

/// RM0090 2.1.11: the bridge duplicates the written data; the address within a word is ignored.
#[test]
fn a_bridge_to_apb_makes_words_of_what_is_written() {
    let mut chip = Chip::new();
    const PSC: u32 = 0x4000_0428; // TIM3
    for address in [PSC, PSC + 2] {
        chip.set(Word, PSC, 0);
        chip.set(Half, address, 0x1234);
        assert_eq!(chip.get(PSC), 0x1234, "{address:#x}");
    }
    assert_eq!(chip.read(Byte, PSC + 1), Ok(0x12));
    assert_eq!(chip.read(Half, PSC + 2), Ok(0));
    const EXTICR1: u32 = 0x4001_3808;
    chip.set(Byte, EXTICR1 + 1, 0x21);
    assert_eq!(chip.get(EXTICR1), 0x2121);
    const EXTI_IMR: u32 = 0x4001_3C00;
    chip.set(Byte, EXTI_IMR, 0x41);
    assert_eq!(chip.get(EXTI_IMR), 0x0041_4141, "23 lines");
    assert_eq!(chip.read(Half, EXTI_IMR), Ok(0x4141));
    const USART2_BRR: u32 = 0x4000_4408;
    chip.set(Half, USART2_BRR, 365);
    assert_eq!(chip.get(USART2_BRR), 365);
    chip.set(Half, USART2_BRR + 4, 0x200C);
    assert_eq!(chip.get(USART2_BRR + 4), 0x200C, "CR1 has no upper half");
}

/// A byte written to SPI_DR is sent as a byte; the data registers accept the writes of ST's
/// drivers.
#[test]
fn data_registers_of_serial_blocks_take_bytes() {
    let mut chip = Chip::new();
    chip.set(Word, 0x4000_3C00, 0xC345); // SPI3: master, one line, 8 bits
    chip.set(Byte, 0x4000_3C0C, 0xA5);
    chip.set(Word, 0x4000_4408, 16); // USART2
    chip.set(Word, 0x4000_440C, 0x2008);
    chip.set(Byte, 0x4000_4404, b'x'.into());
    chip.at += Cycle::from(HSI_HZ) / 1_000;
    chip.next();
    let words: Vec<_> = chip
        .soc
        .spi3
        .words()
        .map(|word| (word.value, word.bits))
        .collect();
    assert_eq!(words, [(0xA5, 8)]);
    let sent: Vec<u8> = chip.soc.usart2.sent().map(|(_, byte)| byte).collect();
    assert_eq!(sent, [b'x']);
}

/// Accesses that a chapter forbids, by block.
#[test]
fn what_a_chapter_forbids_is_refused_by_name() {
    let mut chip = Chip::new();
    for (size, address, name) in [
        (Byte, 0x4000_0428, "half-words"), // TIM3_PSC
        (Byte, 0x4001_4828, "half-words"), // TIM11_PSC
        (Half, 0x4000_0024, "TIM"),        // TIM2_CNT
        (Half, 0x4000_0C2C, "TIM"),        // TIM5_ARR
        (Byte, 0x4000_3000, "half-words"), // IWDG_KR
        (Byte, 0x4000_3C00, "half-words"), // SPI3_CR1
        (Byte, 0x4000_4408, "half-words"), // USART2_BRR
        (Half, 0x4001_2004, "ADC"),        // ADC1_CR1
        (Half, 0x4000_2850, "RTC"),        // RTC_BKP0R
        (Byte, 0x4002_6410, "DMA"),        // DMA2_S0CR
        (Half, 0x4002_3000, "CRC"),        // CRC_DR
        (Half, 0xE004_2004, "DBGMCU"),
    ] {
        assert!(chip.refused(size, address).contains(name), "{address:#x}");
    }
    for address in [0x4002_6400, 0x4002_3000] {
        let read = chip.read(Byte, address);
        assert!(
            matches!(read, Err(AccessError::Unmodelled(_))),
            "{address:#x}"
        );
    }
    // TIM2's other registers have 16 bits; CRC_IDR is a byte; the others can be read in any width.
    chip.set(Half, 0x4000_0028, 7);
    chip.set(Byte, 0x4002_3004, 0x5A);
    assert_eq!(chip.get(0x4002_3004), 0x5A);
    for (address, value) in [(0xE004_2002, 0x1007), (0x4000_0028, 7), (0x4001_2004, 0)] {
        assert_eq!(chip.read(Half, address), Ok(value), "{address:#x}");
    }
}

/// Backup SRAM is memory.
#[test]
fn backup_sram_takes_bytes() {
    let mut chip = Chip::new();
    chip.set(Word, 0x4000_7000, 1 << 14 | 1 << 8); // DBP
    chip.set(Word, 0x4002_4010, 0x0403_0201);
    chip.set(Byte, 0x4002_4012, 0xFF);
    chip.set(Half, 0x4002_4010, 0xABCD);
    assert_eq!(chip.get(0x4002_4010), 0x04FF_ABCD);
    assert_eq!(chip.read(Byte, 0x4002_4013), Ok(4));
}

/// TRM 3.7.1: an alias access reads and writes the register, with all side effects.
#[test]
fn an_alias_of_a_register_reads_and_writes_it() {
    let mut chip = Chip::new();
    chip.set_bit(Word, RCC_CR, 16, 1);
    assert_eq!(chip.get(RCC_CR) >> 16 & 1, 1, "HSEON");
    chip.set_bit(Word, ODR, 9, 1);
    chip.set_bit(Byte, ODR, 4, 1);
    assert_eq!(chip.get(ODR), 1 << 9 | 1 << 4);
    chip.set_bit(Word, ODR, 9, 0xFE);
    assert_eq!(chip.get(ODR), 1 << 4);
    // BSRR reads as 0, so only one bit is written.
    chip.set_bit(Word, BSRR, 20, 1);
    assert_eq!(chip.get(ODR), 0);
    // All flags of TIM3_SR except the cleared one read 1 and are written 1; a register cleared by
    // ones loses all flags.
    chip.set(Word, 0x4000_0414, 1); // EGR.UG: UIF, and CC1-4IF, their CCR being 0
    assert_eq!(chip.get(0x4000_0410), 0x1F);
    chip.set_bit(Word, 0x4000_0410, 2, 0);
    assert_eq!(chip.get(0x4000_0410), 0x1B);
    const EXTI_IMR: u32 = 0x4001_3C00;
    const EXTI_SWIER: u32 = EXTI_IMR + 0x10;
    const EXTI_PR: u32 = EXTI_IMR + 0x14;
    chip.set(Word, EXTI_IMR, 3);
    chip.set(Word, EXTI_SWIER, 3);
    assert_eq!(chip.get(EXTI_PR), 3);
    chip.set_bit(Word, EXTI_PR, 0, 1);
    assert_eq!(chip.get(EXTI_PR), 0, "bit 1 was read as 1, and written");
    // Reading USART2_DR removes the byte, whichever bit the alias selects.
    chip.set(Word, 0x4000_4408, 16);
    chip.set(Word, 0x4000_440C, 0x200C);
    chip.soc.usart2.receive(b'x', chip.at);
    chip.at += 10_000;
    assert_ne!(chip.get(0x4000_4400) & 1 << 5, 0, "RXNE");
    let at = chip.next();
    let dr = Bit::from_alias(0x4200_0000 + 0x4404 * 32, Word).unwrap();
    chip.soc.read(dr.address, Word, at).unwrap();
    assert_eq!(chip.get(0x4000_4400) & 1 << 5, 0);
}

/// An alias of an address without a block faults like its memory; a block without clock ignores
/// accesses.
#[test]
fn an_alias_of_nothing_is_a_bus_error() {
    let mut soc = Soc::new(Pace::Lazy);
    let mut write = |address: u32| {
        let base = address & 0xF000_0000;
        let alias = base + 0x0200_0000 + (address - base) * 32;
        let bit = Bit::from_alias(alias, Word).unwrap();
        bit.write(&mut soc, Word, 1, 100)
    };
    assert_eq!(write(0x4002_2400), Err(AccessError::Error), "beyond port I");
    assert_eq!(write(0x400F_FFFC), Err(AccessError::Error));
    assert_eq!(write(0x2002_0000), Err(AccessError::Error), "beyond SRAM2");
    assert!(write(0x2001_FFFC).is_ok());
    assert!(write(ODR).is_ok(), "without its clock");
    assert_eq!(soc.unclocked, 2);
}
