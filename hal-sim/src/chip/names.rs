//! Names registers by their address, for messages. The names come from RM0090's register maps and,
//! for the core, from the Arm ARM. Blocks that are not modelled are included.

use super::cpu::bit_band::Bit;
use super::cpu::bus::Size;

/// Layout of the registers in a block.
enum Registers {
    /// One name per word from the block's first address on; "" where there is no register.
    Listed(&'static [&'static str]),
    /// Registers of a DMA controller: flag registers, then the registers of each stream.
    Streams,
    /// One kind of register for every word; a number distinguishes them.
    Numbered,
    /// No names; messages show the offset instead.
    Unlisted,
}

use Registers::{Listed, Numbered, Streams, Unlisted};

/// A block of registers: first address, length in bytes, name, layout.
type Block = (u32, u32, &'static str, Registers);

const TIM: &[&str] = &[
    "CR1", "CR2", "SMCR", "DIER", "SR", "EGR", "CCMR1", "CCMR2", "CCER", "CNT", "PSC", "ARR",
    "RCR", "CCR1", "CCR2", "CCR3", "CCR4", "BDTR", "DCR", "DMAR", "OR",
];
const USART: &[&str] = &["SR", "DR", "BRR", "CR1", "CR2", "CR3", "GTPR"];
const SPI: &[&str] = &[
    "CR1", "CR2", "SR", "DR", "CRCPR", "RXCRCR", "TXCRCR", "I2SCFGR", "I2SPR",
];
const I2C: &[&str] = &[
    "CR1", "CR2", "OAR1", "OAR2", "DR", "SR1", "SR2", "CCR", "TRISE", "FLTR",
];
const CAN: &[&str] = &["MCR", "MSR", "TSR", "RF0R", "RF1R", "IER", "ESR", "BTR"];
const GPIO: &[&str] = &[
    "MODER", "OTYPER", "OSPEEDR", "PUPDR", "IDR", "ODR", "BSRR", "LCKR", "AFRL", "AFRH",
];
const ADC: &[&str] = &[
    "SR", "CR1", "CR2", "SMPR1", "SMPR2", "JOFR1", "JOFR2", "JOFR3", "JOFR4", "HTR", "LTR", "SQR1",
    "SQR2", "SQR3", "JSQR", "JDR1", "JDR2", "JDR3", "JDR4", "DR",
];
const DAC: &[&str] = &[
    "CR", "SWTRIGR", "DHR12R1", "DHR12L1", "DHR8R1", "DHR12R2", "DHR12L2", "DHR8R2", "DHR12RD",
    "DHR12LD", "DHR8RD", "DOR1", "DOR2", "SR",
];
const RTC: &[&str] = &[
    "TR", "DR", "CR", "ISR", "PRER", "WUTR", "CALIBR", "ALRMAR", "ALRMBR", "WPR", "SSR", "SHIFTR",
    "TSTR", "TSDR", "TSSSR", "CALR", "TAFCR", "ALRMASSR", "ALRMBSSR", "",
];
const SDIO: &[&str] = &[
    "POWER", "CLKCR", "ARG", "CMD", "RESPCMD", "RESP1", "RESP2", "RESP3", "RESP4", "DTIMER",
    "DLEN", "DCTRL", "DCOUNT", "STA", "ICR", "MASK", "", "", "FIFOCNT",
];
const RCC: &[&str] = &[
    "CR",
    "PLLCFGR",
    "CFGR",
    "CIR",
    "AHB1RSTR",
    "AHB2RSTR",
    "AHB3RSTR",
    "",
    "APB1RSTR",
    "APB2RSTR",
    "",
    "",
    "AHB1ENR",
    "AHB2ENR",
    "AHB3ENR",
    "",
    "APB1ENR",
    "APB2ENR",
    "",
    "",
    "AHB1LPENR",
    "AHB2LPENR",
    "AHB3LPENR",
    "",
    "APB1LPENR",
    "APB2LPENR",
    "",
    "",
    "BDCR",
    "CSR",
    "",
    "",
    "SSCGR",
    "PLLI2SCFGR",
];
const DWT: &[&str] = &[
    "CTRL",
    "CYCCNT",
    "CPICNT",
    "EXCCNT",
    "SLEEPCNT",
    "LSUCNT",
    "FOLDCNT",
    "PCSR",
    "COMP0",
    "MASK0",
    "FUNCTION0",
    "",
    "COMP1",
    "MASK1",
    "FUNCTION1",
    "",
    "COMP2",
    "MASK2",
    "FUNCTION2",
    "",
    "COMP3",
    "MASK3",
    "FUNCTION3",
];
const SCB: &[&str] = &[
    "CPUID", "ICSR", "VTOR", "AIRCR", "SCR", "CCR", "SHPR1", "SHPR2", "SHPR3", "SHCSR", "CFSR",
    "HFSR", "DFSR", "MMFAR", "BFAR", "AFSR",
];

/// Blocks by rising first address (RM0090 table 1; Arm ARM B3.2 to B3.5, C1).
#[rustfmt::skip]
const BLOCKS: &[Block] = &[
    (0x4000_0000, 0x400, "TIM2", Listed(TIM)),
    (0x4000_0400, 0x400, "TIM3", Listed(TIM)),
    (0x4000_0800, 0x400, "TIM4", Listed(TIM)),
    (0x4000_0C00, 0x400, "TIM5", Listed(TIM)),
    (0x4000_1000, 0x400, "TIM6", Listed(TIM)),
    (0x4000_1400, 0x400, "TIM7", Listed(TIM)),
    (0x4000_1800, 0x400, "TIM12", Listed(TIM)),
    (0x4000_1C00, 0x400, "TIM13", Listed(TIM)),
    (0x4000_2000, 0x400, "TIM14", Listed(TIM)),
    (0x4000_2800, 0x50, "RTC", Listed(RTC)),
    (0x4000_2850, 0x50, "RTC_BKPR", Numbered),
    (0x4000_2C00, 0x400, "WWDG", Listed(&["CR", "CFR", "SR"])),
    (0x4000_3000, 0x400, "IWDG", Listed(&["KR", "PR", "RLR", "SR"])),
    (0x4000_3400, 0x400, "I2S2ext", Listed(SPI)),
    (0x4000_3800, 0x400, "SPI2", Listed(SPI)),
    (0x4000_3C00, 0x400, "SPI3", Listed(SPI)),
    (0x4000_4000, 0x400, "I2S3ext", Listed(SPI)),
    (0x4000_4400, 0x400, "USART2", Listed(USART)),
    (0x4000_4800, 0x400, "USART3", Listed(USART)),
    (0x4000_4C00, 0x400, "UART4", Listed(USART)),
    (0x4000_5000, 0x400, "UART5", Listed(USART)),
    (0x4000_5400, 0x400, "I2C1", Listed(I2C)),
    (0x4000_5800, 0x400, "I2C2", Listed(I2C)),
    (0x4000_5C00, 0x400, "I2C3", Listed(I2C)),
    (0x4000_6400, 0x400, "CAN1", Listed(CAN)),
    (0x4000_6800, 0x400, "CAN2", Listed(CAN)),
    (0x4000_7000, 0x400, "PWR", Listed(&["CR", "CSR"])),
    (0x4000_7400, 0x400, "DAC", Listed(DAC)),
    (0x4001_0000, 0x400, "TIM1", Listed(TIM)),
    (0x4001_0400, 0x400, "TIM8", Listed(TIM)),
    (0x4001_1000, 0x400, "USART1", Listed(USART)),
    (0x4001_1400, 0x400, "USART6", Listed(USART)),
    (0x4001_2000, 0x100, "ADC1", Listed(ADC)),
    (0x4001_2100, 0x100, "ADC2", Listed(ADC)),
    (0x4001_2200, 0x100, "ADC3", Listed(ADC)),
    (0x4001_2300, 0x100, "ADC", Listed(&["CSR", "CCR", "CDR"])),
    (0x4001_2C00, 0x400, "SDIO", Listed(SDIO)),
    (0x4001_3000, 0x400, "SPI1", Listed(SPI)),
    (0x4001_3800, 0x400, "SYSCFG", Listed(&["MEMRMP", "PMC", "EXTICR1", "EXTICR2", "EXTICR3", "EXTICR4", "", "", "CMPCR"])),
    (0x4001_3C00, 0x400, "EXTI", Listed(&["IMR", "EMR", "RTSR", "FTSR", "SWIER", "PR"])),
    (0x4001_4000, 0x400, "TIM9", Listed(TIM)),
    (0x4001_4400, 0x400, "TIM10", Listed(TIM)),
    (0x4001_4800, 0x400, "TIM11", Listed(TIM)),
    (0x4002_0000, 0x400, "GPIOA", Listed(GPIO)),
    (0x4002_0400, 0x400, "GPIOB", Listed(GPIO)),
    (0x4002_0800, 0x400, "GPIOC", Listed(GPIO)),
    (0x4002_0C00, 0x400, "GPIOD", Listed(GPIO)),
    (0x4002_1000, 0x400, "GPIOE", Listed(GPIO)),
    (0x4002_1400, 0x400, "GPIOF", Listed(GPIO)),
    (0x4002_1800, 0x400, "GPIOG", Listed(GPIO)),
    (0x4002_1C00, 0x400, "GPIOH", Listed(GPIO)),
    (0x4002_2000, 0x400, "GPIOI", Listed(GPIO)),
    (0x4002_3000, 0x400, "CRC", Listed(&["DR", "IDR", "CR"])),
    (0x4002_3800, 0x400, "RCC", Listed(RCC)),
    (0x4002_3C00, 0x400, "FLASH", Listed(&["ACR", "KEYR", "OPTKEYR", "SR", "CR", "OPTCR"])),
    (0x4002_4000, 0x1000, "BKPSRAM", Unlisted),
    (0x4002_6000, 0x400, "DMA1", Streams),
    (0x4002_6400, 0x400, "DMA2", Streams),
    (0x4002_8000, 0x1400, "ETH", Unlisted),
    (0x4004_0000, 0x4_0000, "OTG_HS", Unlisted),
    (0x5000_0000, 0x4_0000, "OTG_FS", Unlisted),
    (0x5005_0000, 0x400, "DCMI", Unlisted),
    (0x5006_0000, 0x400, "CRYP", Unlisted),
    (0x5006_0400, 0x400, "HASH", Unlisted),
    (0x5006_0800, 0x400, "RNG", Listed(&["CR", "SR", "DR"])),
    (0xA000_0000, 0x1000, "FSMC", Unlisted),
    (0xE000_0000, 0x1000, "ITM", Unlisted),
    (0xE000_1000, 0x1000, "DWT", Listed(DWT)),
    (0xE000_2000, 0x1000, "FPB", Listed(&["CTRL", "REMAP"])),
    (0xE000_E004, 4, "NVIC", Listed(&["ICTR"])),
    (0xE000_E008, 4, "SCB", Listed(&["ACTLR"])),
    (0xE000_E010, 0x10, "SysTick", Listed(&["CTRL", "LOAD", "VAL", "CALIB"])),
    (0xE000_E100, 0x80, "NVIC_ISER", Numbered),
    (0xE000_E180, 0x80, "NVIC_ICER", Numbered),
    (0xE000_E200, 0x80, "NVIC_ISPR", Numbered),
    (0xE000_E280, 0x80, "NVIC_ICPR", Numbered),
    (0xE000_E300, 0x80, "NVIC_IABR", Numbered),
    (0xE000_E400, 0x400, "NVIC_IPR", Numbered),
    (0xE000_ED00, 0x40, "SCB", Listed(SCB)),
    (0xE000_ED40, 0x40, "ID", Unlisted),
    (0xE000_ED88, 4, "SCB", Listed(&["CPACR"])),
    (0xE000_ED90, 0x2C, "MPU", Listed(&["TYPE", "CTRL", "RNR", "RBAR", "RASR", "RBAR_A1", "RASR_A1", "RBAR_A2", "RASR_A2", "RBAR_A3", "RASR_A3"])),
    (0xE000_EDF0, 0x10, "CoreDebug", Listed(&["DHCSR", "DCRSR", "DCRDR", "DEMCR"])),
    (0xE000_EF00, 4, "NVIC", Listed(&["STIR"])),
    (0xE000_EF34, 0x14, "FPU", Listed(&["FPCCR", "FPCAR", "FPDSCR", "MVFR0", "MVFR1"])),
    (0xE004_0000, 0x1000, "TPIU", Unlisted),
    (0xE004_1000, 0x1000, "ETM", Unlisted),
    (0xE004_2000, 0x400, "DBGMCU", Listed(&["IDCODE", "CR", "APB1_FZ", "APB2_FZ"])),
];

/// Returns the name of the register that holds the byte at `address`, for example `UART4_BRR`. A
/// bit-band alias gives `RCC_CR bit 24`; an unlisted register gives its block and offset, `CAN1 +
/// 0x640`. Returns `None` outside the blocks.
pub fn register(address: u32) -> Option<String> {
    if let Some(bit) = Bit::from_alias(address, Size::Word) {
        return Some(format!("{} bit {}", register(bit.address)?, bit.number));
    }
    let after = BLOCKS.partition_point(|block| block.0 <= address);
    let (first, length, block, registers) = BLOCKS.get(after.checked_sub(1)?)?;
    let offset = address - first;
    if offset >= *length {
        return None;
    }
    let named = match registers {
        Listed(names) => names.get(offset as usize / 4).copied().unwrap_or_default(),
        Streams => return Some(format!("{block}_{}", stream(offset))),
        Numbered => return Some(format!("{block}{}", offset / 4)),
        Unlisted => "",
    };
    Some(match named {
        "" => format!("{block} + {offset:#x}"),
        name => format!("{block}_{name}"),
    })
}

/// Returns the name of the DMA register at `offset` (RM0090 10.5.11).
fn stream(offset: u32) -> String {
    const FLAGS: [&str; 4] = ["LISR", "HISR", "LIFCR", "HIFCR"];
    const OF_STREAM: [&str; 6] = ["CR", "NDTR", "PAR", "M0AR", "M1AR", "FCR"];
    let register = offset as usize / 4;
    match register.checked_sub(FLAGS.len()) {
        None => FLAGS[register].to_owned(),
        Some(word) => format!(
            "S{}{}",
            word / OF_STREAM.len(),
            OF_STREAM[word % OF_STREAM.len()]
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn registers_have_the_manual_s_names() {
        for (address, name) in [
            (0x4000_4C08, "UART4_BRR"),
            (0x4000_3800, "SPI2_CR1"),
            (0x4000_7408, "DAC_DHR12R1"),
            (0x4001_2034, "ADC1_SQR3"),
            (0x4001_2304, "ADC_CCR"),
            (0x4002_001A, "GPIOA_BSRR"),
            (0x4002_3844, "RCC_APB2ENR"),
            (0x4002_6410, "DMA2_S0CR"),
            (0x4002_64CC, "DMA2_S7FCR"),
            (0x4000_2854, "RTC_BKPR1"),
            (0x4000_6640, "CAN1 + 0x240"),
            (0xE000_E104, "NVIC_ISER1"),
            (0xE000_ED28, "SCB_CFSR"),
            (0x4247_0060, "RCC_CR bit 24"),
        ] {
            assert_eq!(register(address).as_deref(), Some(name), "{address:#x}");
        }
        for none in [
            0x2000_0000,
            0x2200_0000,
            0x4000_2400,
            0x4001_5000,
            0xFFFF_FFFF,
        ] {
            assert_eq!(register(none), None, "{none:#x}");
        }
    }

    #[test]
    fn blocks_ascend_and_do_not_overlap() {
        for pair in BLOCKS.windows(2) {
            assert!(pair[0].0 + pair[0].1 <= pair[1].0, "{}", pair[1].2);
        }
    }
}
