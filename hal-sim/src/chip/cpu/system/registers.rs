//! Maps addresses to private registers.

use super::nvic::{Nvic, bit, numbers};
use super::{System, number};
use crate::chip::Cycle;
use crate::chip::cpu::Size;
use crate::chip::cpu::bus::{Modelled, Unmodelled, refuse_if};

/// Exceptions of SHCSR with their bits: (exception, active, pending, enable); 0 if there is no such
/// bit (Arm ARM B3.2.13).
const SHCSR: [(u16, u32, u32, u32); 6] = [
    (number::MEM_MANAGE, 1, 1 << 13, 1 << 16),
    (number::BUS_FAULT, 1 << 1, 1 << 14, 1 << 17),
    (number::USAGE_FAULT, 1 << 3, 1 << 12, 1 << 18),
    (number::SV_CALL, 1 << 7, 1 << 15, 0),
    (number::PEND_SV, 1 << 10, 0, 0),
    (number::SYS_TICK, 1 << 11, 0, 0),
];

/// Bits of ICSR (Arm ARM B3.2.4).
mod icsr {
    pub const PENDSTCLR: u32 = 1 << 25;
    pub const PENDSTSET: u32 = 1 << 26;
    pub const PENDSVCLR: u32 = 1 << 27;
    pub const PENDSVSET: u32 = 1 << 28;
    pub const NMIPENDSET: u32 = 1 << 31;
    pub const ISRPENDING: u32 = 1 << 22;
    pub const RETTOBASE: u32 = 1 << 11;
}

/// Address of the application interrupt and reset control register, which a key protects.
const AIRCR: u32 = 0xE000_ED0C;

/// Returns whether the register may also be accessed by bytes and half-words: priorities and CFSR
/// (Arm ARM B3.2.2, B3.4.2).
const fn is_byte_accessible(address: u32) -> bool {
    matches!(address, 0xE000_E400..=0xE000_E7FF | 0xE000_ED18..=0xE000_ED23 | 0xE000_ED28..=0xE000_ED2B)
}

const fn mask(size: Size) -> u32 {
    match size {
        Size::Byte => 0xFF,
        Size::Half => 0xFFFF,
        Size::Word => u32::MAX,
    }
}

impl System {
    /// Reads a register of the private peripherals at cycle `at`; `address` is aligned to `size`.
    pub fn read(&mut self, address: u32, size: Size, at: Cycle) -> Modelled<u32> {
        check_size(address, size)?;
        let word = self.read_word(address & !3, at)?;
        Ok(word >> (8 * (address & 3)) & mask(size))
    }

    /// Writes a register of the private peripherals at cycle `at`. The caller takes pending
    /// exceptions afterwards.
    pub fn write(&mut self, address: u32, size: Size, value: u32, at: Cycle) -> Modelled {
        check_size(address, size)?;
        self.fp_is_ready = false;
        let value = value & mask(size);
        match address {
            0xE000_E400..=0xE000_E7FF => {
                self.write_priorities(number::LINE_0, address & 0x3FF, size, value);
            }
            0xE000_ED18..=0xE000_ED23 => {
                self.write_priorities(number::MEM_MANAGE, address - 0xE000_ED18, size, value);
            }
            _ => {
                let shift = 8 * (address & 3);
                self.write_word(address & !3, value << shift, at)?;
            }
        }
        Ok(())
    }

    /// Inverts `bits` of the private register at `address` at `at`, as a glitch may do, including
    /// bits that no write can change in that direction. The caller takes pending exceptions
    /// afterwards.
    ///
    /// # Errors
    /// Fails if the effect is not modelled.
    pub fn upset(&mut self, address: u32, bits: u32, at: Cycle) -> Modelled {
        let exceptions = Nvic::exceptions(bits, address >> 2 & 7);
        self.fp_is_ready = false;
        match address {
            0xE000_E100..=0xE000_E11C => {
                let off = exceptions & self.nvic.enabled;
                self.nvic.enable(exceptions & !off, true, at);
                self.nvic.enable(off, false, at);
            }
            0xE000_E200..=0xE000_E21C => {
                let off = exceptions & self.nvic.pending;
                self.pend(exceptions & !off, at);
                self.nvic.unpend(off);
            }
            AIRCR => {
                let fields = self.read_word(address, at)? ^ bits;
                self.write_word(address, fields & 0xFFFF | 0x05FA_0000, at)?;
            }
            _ => {
                let old = self.read(address, Size::Word, at)?;
                self.write(address, Size::Word, old ^ bits, at)?;
            }
        }
        Ok(())
    }

    fn read_word(&mut self, address: u32, at: Cycle) -> Modelled<u32> {
        let word = address >> 2 & 7;
        Ok(match address {
            // ICTR: 96 lines or fewer.
            0xE000_E004 => 2,
            0xE000_E010..=0xE000_E01C => {
                self.advance_systick(at);
                self.systick.read(address & 0xF)
            }
            0xE000_E100..=0xE000_E11C | 0xE000_E180..=0xE000_E19C => {
                Nvic::word(self.nvic.enabled, word)
            }
            0xE000_E200..=0xE000_E21C | 0xE000_E280..=0xE000_E29C => {
                Nvic::word(self.nvic.pending, word)
            }
            0xE000_E300..=0xE000_E31C => Nvic::word(self.nvic.active, word),
            0xE000_E400..=0xE000_E7FF => self.read_priorities(number::LINE_0, address & 0x3FF),
            0xE000_ED04 => self.read_icsr(),
            0xE000_ED18..=0xE000_ED23 => {
                self.read_priorities(number::MEM_MANAGE, address - 0xE000_ED18)
            }
            0xE000_ED24 => self.read_shcsr(),
            0xE000_ED90..=0xE000_EDB8 => self.mpu.read(address - 0xE000_ED90),
            _ => self
                .scb
                .read(address)
                .or_else(|| self.floating.read(address))
                .or_else(|| self.trace.read(address, at))
                .ok_or_else(|| unmodelled(address))?,
        })
    }

    fn write_word(&mut self, address: u32, value: u32, at: Cycle) -> Modelled {
        let exceptions = Nvic::exceptions(value, address >> 2 & 7);
        match address {
            0xE000_E010..=0xE000_E01C => {
                self.advance_systick(at);
                self.systick.write(address & 0xF, value);
            }
            0xE000_E100..=0xE000_E11C => self.nvic.enable(exceptions, true, at),
            0xE000_E180..=0xE000_E19C => self.nvic.enable(exceptions, false, at),
            0xE000_E200..=0xE000_E21C => self.pend(exceptions, at),
            0xE000_E280..=0xE000_E29C => self.nvic.unpend(exceptions),
            0xE000_E004 | 0xE000_E300..=0xE000_E31C => {}
            0xE000_ED04 => self.write_icsr(value, at),
            0xE000_ED24 => self.write_shcsr(value, at)?,
            0xE000_ED90..=0xE000_EDB8 => self.mpu.write(address - 0xE000_ED90, value),
            0xE000_EF00 => {
                let line = value & 0x1FF;
                self.pend(Nvic::exceptions(1 << (line & 31), line >> 5), at);
            }
            _ => {
                if let Some(written) = self.scb.write(address, value, at) {
                    written?;
                    self.nvic.set_prigroup(self.scb.prigroup >> 8);
                } else if let Some(written) = self.trace.write(address, value, at) {
                    self.follow_comparators();
                    written?;
                } else if self.floating.write(address, value).is_none() {
                    return Err(unmodelled(address));
                }
            }
        }
        Ok(())
    }

    fn read_priorities(&self, first: u16, offset: u32) -> u32 {
        let bytes = [0, 1, 2, 3].map(|byte| self.nvic.priority(first + (offset + byte) as u16));
        u32::from_le_bytes(bytes)
    }

    fn write_priorities(&mut self, first: u16, offset: u32, size: Size, value: u32) {
        let bytes = value.to_le_bytes();
        for (byte, priority) in (0..size.bytes()).zip(bytes) {
            self.nvic
                .set_priority(first + (offset + byte) as u16, priority);
        }
    }

    /// Reads ICSR; VECTPENDING ignores BASEPRI and FAULTMASK.
    fn read_icsr(&self) -> u32 {
        let pending = self.nvic.pending;
        let others = self.nvic.active & !bit(self.running);
        let bits = [
            (pending & bit(number::SYS_TICK) != 0, icsr::PENDSTSET),
            (pending & bit(number::PEND_SV) != 0, icsr::PENDSVSET),
            (pending & bit(number::NMI) != 0, icsr::NMIPENDSET),
            (pending >> number::LINE_0 != 0, icsr::ISRPENDING),
            (others == 0, icsr::RETTOBASE),
        ];
        let bits = bits.iter().filter(|(set, _)| *set);
        let vector = u32::from(self.nvic.first_pending().unwrap_or(0));
        bits.fold(u32::from(self.running) | vector << 12, |value, (_, bit)| {
            value | bit
        })
    }

    fn write_icsr(&mut self, value: u32, at: Cycle) {
        let clear = [
            (icsr::PENDSTCLR, number::SYS_TICK),
            (icsr::PENDSVCLR, number::PEND_SV),
        ];
        let set = [
            (icsr::PENDSTSET, number::SYS_TICK),
            (icsr::PENDSVSET, number::PEND_SV),
            (icsr::NMIPENDSET, number::NMI),
        ];
        for (_, number) in clear.into_iter().filter(|(mask, _)| value & mask != 0) {
            self.nvic.unpend(bit(number));
        }
        for (_, number) in set.into_iter().filter(|(mask, _)| value & mask != 0) {
            self.pend(bit(number), at);
        }
    }

    fn read_shcsr(&self) -> u32 {
        let (active, pending, enabled) = (self.nvic.active, self.nvic.pending, self.nvic.enabled);
        SHCSR.iter().fold(0, |value, &(exception, a, p, e)| {
            let part = |state: u128, mask| if state & bit(exception) != 0 { mask } else { 0 };
            value | part(active, a) | part(pending, p) | part(enabled, e)
        })
    }

    fn write_shcsr(&mut self, value: u32, at: Cycle) -> Modelled {
        let actives = SHCSR
            .iter()
            .fold(0, |flags, (_, active, ..)| flags | active);
        refuse_if(
            (value ^ self.read_shcsr()) & actives != 0,
            "SCB_SHCSR: a change of the active exceptions",
        )?;
        for (exception, _, pending, enable) in SHCSR {
            let exception = bit(exception);
            if enable != 0 {
                self.nvic.enable(exception, value & enable != 0, at);
            }
            if value & pending != 0 {
                self.pend(exception, at);
            } else if pending != 0 {
                self.nvic.unpend(exception);
            }
        }
        Ok(())
    }

    /// Returns the numbers of the active exceptions.
    pub fn active(&self) -> impl Iterator<Item = u16> {
        numbers(self.nvic.active)
    }
}

fn check_size(address: u32, size: Size) -> Modelled {
    if size == Size::Word || is_byte_accessible(address) {
        Ok(())
    } else {
        Err(Unmodelled(
            "an access to a private peripheral register that is narrower than a word",
        ))
    }
}

/// Returns the error that names the feature to which the register at `address` belongs.
const fn unmodelled(address: u32) -> Unmodelled {
    Unmodelled(match address {
        0xE000_0000..=0xE000_0FFF => "ITM",
        0xE000_1000..=0xE000_1FFF => "DWT, except CTRL, CYCCNT and the comparators,",
        0xE000_2000..=0xE000_2FFF => "FPB",
        0xE000_ED40..=0xE000_ED7F => "SCB feature registers",
        0xE000_EDF0 => "writing DHCSR",
        0xE000_EDF4 => "DCRSR",
        0xE000_EDF8 => "DCRDR",
        0xE000_EFD0..=0xE000_EFFF => "SCS identification registers",
        0xE004_0000..=0xE004_0FFF => "TPIU",
        0xE004_1000..=0xE004_1FFF => "ETM",
        0xE00F_F000..=0xE00F_FFFF => "ROM table",
        _ => "this register of the private peripheral bus",
    })
}
