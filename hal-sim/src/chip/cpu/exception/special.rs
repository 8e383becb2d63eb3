//! MRS, MSR, CPS (Arm ARM B5.2): special registers by their number, with the
//! rules of privilege.

use crate::chip::cpu::Cpu;
use crate::chip::cpu::registers::control;
use crate::chip::cpu::system::nvic::PRIORITY_BITS;

/// N, Z, C, V, Q.
const NZCVQ: u32 = 0xF800_0000;
const GE: u32 = 0x000F_0000;

impl Cpu {
    /// xPSR as stacked: flags, IT state, Thumb bit, exception number.
    pub(in crate::chip) const fn xpsr(&self) -> u32 {
        let it = self.registers.it as u32;
        self.registers.apsr
            | (it & 3) << 25
            | (it & 0xFC) << 8
            | 1 << 24
            | self.registers.exception as u32
    }

    /// MRS: special register `sysm`. Without privilege all but APSR and
    /// CONTROL read 0.
    pub(in crate::chip::cpu) fn read_special(&self, sysm: u8) -> u32 {
        let registers = &self.registers;
        let privileged = registers.is_privileged();
        match sysm {
            0..=7 => {
                let flags = if sysm & 4 == 0 { registers.apsr } else { 0 };
                let number = if sysm & 1 != 0 && privileged {
                    u32::from(registers.exception)
                } else {
                    0
                };
                flags & (NZCVQ | GE) | number
            }
            20 => u32::from(registers.control),
            _ if !privileged => 0,
            8 => registers.msp(),
            9 => registers.psp(),
            16 => u32::from(registers.primask),
            17 | 18 => u32::from(registers.basepri),
            19 => u32::from(registers.faultmask),
            _ => 0,
        }
    }

    /// MSR with `mask` (bits 11:10 of the encoding). The caller takes what is
    /// pending afterwards. Without privilege only the flags can be written.
    pub(in crate::chip::cpu) fn write_special(&mut self, sysm: u8, mask: u8, value: u32) {
        let registers = &mut self.registers;
        let priority = (value & u32::from(PRIORITY_BITS)) as u8;
        match sysm {
            0..=3 => {
                let written = [0, GE, NZCVQ, NZCVQ | GE][usize::from(mask & 3)];
                registers.apsr = registers.apsr & !written | value & written;
            }
            _ if !registers.is_privileged() => {}
            8 | 9 => {
                let in_use = (sysm == 9) == registers.uses_psp();
                let sp = if in_use {
                    &mut registers.r[13]
                } else {
                    &mut registers.other_sp
                };
                *sp = value & !3;
            }
            16 => registers.primask = value & 1 != 0,
            17 => registers.basepri = priority,
            // BASEPRI_MAX only makes the mask stricter; 0, no mask, is the laxest.
            18 if priority != 0 && priority.wrapping_sub(1) < registers.basepri.wrapping_sub(1) => {
                registers.basepri = priority;
            }
            19 => self.set_faultmask(value & 1 != 0),
            20 => self.write_control(value),
            _ => {}
        }
    }

    /// CPS: sets (`disable`) or clears PRIMASK (`i`) and FAULTMASK (`f`);
    /// nothing without privilege. The caller takes what is pending afterwards.
    pub(in crate::chip::cpu) fn change_masks(&mut self, disable: bool, i: bool, f: bool) {
        if !self.registers.is_privileged() {
            return;
        }
        if i {
            self.registers.primask = disable;
        }
        if f {
            self.set_faultmask(disable);
        }
    }

    /// Not from hard fault or NMI, where it cannot be set.
    fn set_faultmask(&mut self, to: bool) {
        if !to || self.execution_priority() > -1 {
            self.registers.faultmask = to;
            self.system.update(&self.registers);
        }
    }

    /// Sets masks and CONTROL to what no instruction may have written; in thread mode the
    /// other stack comes with SPSEL. The caller takes what is pending afterwards.
    pub fn upset_special(&mut self, primask: bool, faultmask: bool, basepri: u8, control: u32) {
        (self.registers.primask, self.registers.faultmask) = (primask, faultmask);
        self.registers.basepri = basepri & PRIORITY_BITS;
        self.write_control(control);
    }

    fn write_control(&mut self, value: u32) {
        let registers = &mut self.registers;
        let value = value as u8;
        let mut written = control::NPRIV | control::FPCA;
        if registers.exception == 0 {
            written |= control::SPSEL;
        }
        let used_psp = registers.uses_psp();
        registers.control = registers.control & !written | value & written;
        if used_psp != registers.uses_psp() {
            std::mem::swap(&mut registers.r[13], &mut registers.other_sp);
        }
        self.system.update(&self.registers);
    }
}
