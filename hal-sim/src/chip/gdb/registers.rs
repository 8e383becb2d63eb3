//! The registers as gdb numbers them: our own target description, M-profile
//! with its system registers and single-precision floating point.

use crate::chip::cpu::Registers;
use gdbstub::arch::Arch;

/// Core registers in the order of R0–R12, SP, LR, PC, xPSR; then MSP, PSP;
/// the four masks, a byte each; D0–D15, of which gdb makes S0–S31; FPSCR.
const CORE: usize = 17;
const STACKS: usize = 2;
const MASKS: usize = 4;
const FLOATS: usize = 32;
const BYTES: usize = 4 * (CORE + STACKS) + MASKS + 4 * FLOATS + 4;

/// All of them, as bytes in gdb's order.
#[derive(Clone, Debug, PartialEq)]
pub struct Packed(Vec<u8>);

impl Default for Packed {
    fn default() -> Self {
        Self(vec![0; BYTES])
    }
}

impl Packed {
    /// `registers`, with `xpsr` made up from them.
    pub fn pack(registers: &Registers, xpsr: u32) -> Self {
        let mut bytes = Vec::with_capacity(BYTES);
        let stacks = [xpsr, registers.msp(), registers.psp()];
        for word in registers.r.into_iter().chain(stacks) {
            bytes.extend(word.to_le_bytes());
        }
        let [primask, faultmask] = [registers.primask, registers.faultmask].map(u8::from);
        bytes.extend([primask, registers.basepri, faultmask, registers.control]);
        for word in registers.s.into_iter().chain([registers.fpscr]) {
            bytes.extend(word.to_le_bytes());
        }
        Self(bytes)
    }

    fn word(&self, at: usize) -> u32 {
        let bytes = self.0.get(at..).and_then(<[u8]>::first_chunk);
        bytes.map_or(0, |&bytes| u32::from_le_bytes(bytes))
    }

    /// Puts them into `registers`. The exception number stays: nothing but an
    /// exception changes it.
    pub fn unpack(&self, registers: &mut Registers) {
        for (n, register) in registers.r.iter_mut().enumerate() {
            *register = self.word(4 * n);
        }
        registers.r[15] &= !1;
        let xpsr = self.word(4 * 16);
        registers.apsr = xpsr & 0xF80F_0000;
        registers.it = (xpsr >> 25 & 3 | xpsr >> 8 & 0xFC) as u8;
        // The one in use is SP.
        let other = if registers.uses_psp() { 17 } else { 18 };
        registers.other_sp = self.word(4 * other);
        let masks = 4 * (CORE + STACKS);
        let mask = |n: usize| self.0.get(masks + n).copied().unwrap_or(0);
        registers.primask = mask(0) & 1 != 0;
        registers.basepri = mask(1) & 0xF0;
        registers.faultmask = mask(2) & 1 != 0;
        for (n, register) in registers.s.iter_mut().enumerate() {
            *register = self.word(masks + MASKS + 4 * n);
        }
        registers.fpscr = self.word(masks + MASKS + 4 * FLOATS);
    }
}

impl gdbstub::arch::Registers for Packed {
    type ProgramCounter = u32;

    fn pc(&self) -> u32 {
        self.word(4 * 15)
    }

    fn gdb_serialize(&self, mut write_byte: impl FnMut(Option<u8>)) {
        self.0.iter().for_each(|&byte| write_byte(Some(byte)));
    }

    fn gdb_deserialize(&mut self, bytes: &[u8]) -> Result<(), ()> {
        self.0 = bytes.get(..BYTES).ok_or(())?.to_vec();
        Ok(())
    }
}

/// A Cortex-M4F.
#[derive(Debug)]
pub enum CortexM4F {}

impl Arch for CortexM4F {
    type Usize = u32;
    type Registers = Packed;
    type BreakpointKind = usize;
    type RegId = ();

    fn target_description_xml() -> Option<&'static str> {
        Some(include_str!("target.xml"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use gdbstub::arch::Registers as _;

    #[test]
    fn the_description_has_as_many_bits_as_are_sent() {
        let xml = include_str!("target.xml");
        let bits = xml.split("bitsize=\"").skip(1);
        let bits = bits.filter_map(|rest| rest.split('"').next()?.parse::<usize>().ok());
        assert_eq!(bits.sum::<usize>(), 8 * BYTES);
        assert_eq!(Packed::default().0.len(), BYTES);
    }

    #[test]
    fn what_is_packed_comes_back() {
        let mut before = Registers::default();
        for (n, register) in (0..).zip(&mut before.r) {
            *register = 0x1111_1110 * n;
        }
        for (n, register) in (1..).zip(&mut before.s) {
            *register = 0x0101_0101 * n;
        }
        (before.other_sp, before.apsr, before.it) = (0x2000_1000, 0xA000_0000, 0x47);
        (before.primask, before.basepri, before.exception) = (true, 0x40, 44);
        before.fpscr = 0x0300_0000;
        let packed = Packed::pack(&before, 0xA600_4400 | 1 << 24 | 44);
        assert_eq!(packed.pc(), 0xFFFF_FFF0);
        let mut after = Registers {
            exception: 44,
            ..Registers::default()
        };
        packed.unpack(&mut after);
        assert_eq!(format!("{after:?}"), format!("{before:?}"));
    }
}
