//! Special registers: the instructions MRS, MSR and CPS (Arm ARM B5.2).
//!
//! MRS and MSR select a special register by its number (`SYSm`). Unprivileged code has
//! restricted access.

use crate::chip::cpu::Cpu;
use crate::chip::cpu::registers::control;
use crate::chip::cpu::system::nvic::PRIORITY_BITS;

/// Flags N, Z, C, V and Q of APSR.
const NZCVQ: u32 = 0xF800_0000;
/// The four GE flags of APSR.
const GE: u32 = 0x000F_0000;

impl Cpu {
    /// Returns xPSR as exception entry stacks it: flags, IT state, Thumb bit and exception
    /// number.
    pub(in crate::chip) const fn xpsr(&self) -> u32 {
        let value = self.registers.it as u32;
        self.registers.apsr
            | (value & 3) << 25
            | (value & 0xFC) << 8
            | 1 << 24
            | self.registers.exception as u32
    }

    /// Executes MRS: returns the special register with number `sysm`, as encoded in the
    /// instruction.
    ///
    /// In unprivileged code, all registers except APSR and CONTROL read 0.
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

    /// Executes MSR: writes `value` to the special register with number `sysm`, as encoded in the
    /// instruction.
    ///
    /// `mask` holds bits 11:10 of the encoding, which select the flags of APSR to write.
    /// Unprivileged code can write only these flags. The caller must afterwards take any
    /// exception that the write unmasked.
    pub(in crate::chip::cpu) fn write_special(&mut self, sysm: u8, mask: u8, value: u32) {
        let registers = &mut self.registers;
        let priority = (value & u32::from(PRIORITY_BITS)) as u8;
        match sysm {
            0..=3 => {
                let writable = [0, GE, NZCVQ, NZCVQ | GE][usize::from(mask & 3)];
                registers.apsr = registers.apsr & !writable | value & writable;
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
            // BASEPRI_MAX is written only if the new value masks more. 0 masks nothing.
            18 if priority != 0 && priority.wrapping_sub(1) < registers.basepri.wrapping_sub(1) => {
                registers.basepri = priority;
            }
            19 => self.set_faultmask(value & 1 != 0),
            20 => self.write_control(value),
            _ => {}
        }
    }

    /// Executes CPS: sets (`disable`) or clears PRIMASK (if `i`) and FAULTMASK (if `f`).
    ///
    /// CPS has no effect in unprivileged code. The caller must afterwards take any exception
    /// that the change unmasked.
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

    /// Sets or clears FAULTMASK. It cannot be set at a priority of −1 or higher (hard fault,
    /// NMI).
    fn set_faultmask(&mut self, faultmask: bool) {
        if !faultmask || self.execution_priority() > -1 {
            self.registers.faultmask = faultmask;
            self.system.update(&self.registers);
        }
    }

    /// Sets PRIMASK, FAULTMASK, BASEPRI and CONTROL as an injected fault does. The values may be
    /// those that no instruction could write.
    ///
    /// In thread mode, a change of SPSEL switches the stack pointer. The caller must afterwards
    /// take any exception that the change unmasked.
    pub fn upset_special(&mut self, primask: bool, faultmask: bool, basepri: u8, control: u32) {
        (self.registers.primask, self.registers.faultmask) = (primask, faultmask);
        self.registers.basepri = basepri & PRIORITY_BITS;
        self.write_control(control);
    }

    /// Writes the bits of CONTROL that the current mode allows, and switches the stack pointer
    /// if SPSEL changes.
    fn write_control(&mut self, value: u32) {
        let registers = &mut self.registers;
        let value = value as u8;
        let mut writable = control::NPRIV | control::FPCA;
        if registers.exception == 0 {
            writable |= control::SPSEL;
        }
        let used_psp = registers.uses_psp();
        registers.control = registers.control & !writable | value & writable;
        if used_psp != registers.uses_psp() {
            std::mem::swap(&mut registers.r[13], &mut registers.other_sp);
        }
        self.system.update(&self.registers);
    }
}
