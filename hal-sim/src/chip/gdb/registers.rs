//! Reads and writes registers in gdb's numbering, with our own target description: M-profile with
//! its system registers and single-precision floating point.
//!
//! R0–R12, SP, LR, PC, xPSR; MSP, PSP; PRIMASK, BASEPRI, FAULTMASK, CONTROL, one byte each; D0–D15,
//! from which gdb derives S0–S31; FPSCR. Values are little-endian.

use crate::chip::cpu::Cpu;

/// Target description for gdb: names, order and widths of the registers.
pub const DESCRIPTION: &str = include_str!("target.xml");

/// Number of registers in the target description.
pub const COUNT: usize = 40;

/// A register, as its number in the target description selects it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Register {
    General(usize),
    Xpsr,
    Msp,
    Psp,
    Mask(usize),
    Double(usize),
    Fpscr,
}

impl Register {
    const fn from_number(number: usize) -> Option<Self> {
        Some(match number {
            0..=15 => Self::General(number),
            16 => Self::Xpsr,
            17 => Self::Msp,
            18 => Self::Psp,
            19..=22 => Self::Mask(number - 19),
            23..=38 => Self::Double(number - 23),
            39 => Self::Fpscr,
            _ => return None,
        })
    }

    const fn bytes(self) -> usize {
        match self {
            Self::Mask(_) => 1,
            Self::Double(_) => 8,
            _ => 4,
        }
    }
}

/// Returns the bytes of register `number`, the lowest byte first; `None` if there is no such
/// register.
pub fn read(cpu: &Cpu, number: usize) -> Option<Vec<u8>> {
    let registers = &cpu.registers;
    let word = match Register::from_number(number)? {
        Register::General(n) => registers.r[n],
        Register::Xpsr => cpu.xpsr(),
        Register::Msp => registers.msp(),
        Register::Psp => registers.psp(),
        Register::Mask(n) => return Some(vec![masks(cpu)[n]]),
        Register::Double(n) => {
            let halves = [registers.s[2 * n], registers.s[2 * n + 1]];
            return Some(halves.map(u32::to_le_bytes).concat());
        }
        Register::Fpscr => registers.fpscr,
    };
    Some(word.to_le_bytes().to_vec())
}

/// Returns PRIMASK, BASEPRI, FAULTMASK and CONTROL.
fn masks(cpu: &Cpu) -> [u8; 4] {
    let registers = &cpu.registers;
    let [primask, faultmask] = [registers.primask, registers.faultmask].map(u8::from);
    [primask, registers.basepri, faultmask, registers.control]
}

/// Sets register `number` to `bytes`; returns `None` if it does not exist or has another width.
/// Bits that the core does not have stay 0. The exception number stays, because only an exception
/// changes it.
pub fn write(cpu: &mut Cpu, number: usize, bytes: &[u8]) -> Option<()> {
    let register = Register::from_number(number)?;
    if bytes.len() != register.bytes() {
        return None;
    }
    let word = |at: usize| {
        let chunk = bytes.get(at..).and_then(<[u8]>::first_chunk);
        chunk.map_or(0, |&chunk| u32::from_le_bytes(chunk))
    };
    let registers = &mut cpu.registers;
    match register {
        Register::General(15) => registers.r[15] = word(0) & !1,
        Register::General(13) => registers.r[13] = word(0) & !3,
        Register::General(n) => registers.r[n] = word(0),
        Register::Xpsr => {
            registers.apsr = word(0) & 0xF80F_0000;
            registers.it = (word(0) >> 25 & 3 | word(0) >> 8 & 0xFC) as u8;
        }
        // SP is the stack pointer in use.
        Register::Msp if registers.uses_psp() => registers.other_sp = word(0) & !3,
        Register::Psp if !registers.uses_psp() => registers.other_sp = word(0) & !3,
        Register::Msp | Register::Psp => registers.r[13] = word(0) & !3,
        Register::Mask(n) => {
            let mut masks = masks(cpu);
            masks[n] = bytes[0];
            let [primask, basepri, faultmask, control] = masks;
            cpu.upset_special(
                primask & 1 != 0,
                faultmask & 1 != 0,
                basepri,
                control.into(),
            );
        }
        Register::Double(n) => {
            (registers.s[2 * n], registers.s[2 * n + 1]) = (word(0), word(4));
        }
        Register::Fpscr => registers.fpscr = word(0),
    }
    Some(())
}

/// Returns the bytes of all registers in the order of the target description.
pub fn read_all(cpu: &Cpu) -> Vec<u8> {
    let values = (0..COUNT).filter_map(|number| read(cpu, number));
    values.flatten().collect()
}

/// Sets all registers; returns `None` if the number of bytes is wrong. CONTROL, which selects the
/// stack pointer in use, is written first. SP is written last, so that its value wins over MSP's or
/// PSP's for the same stack pointer.
pub fn write_all(cpu: &mut Cpu, bytes: &[u8]) -> Option<()> {
    const CONTROL: usize = 22;
    const SP: usize = 13;
    let (mut rest, mut values) = (bytes, Vec::with_capacity(COUNT));
    for register in (0..COUNT).filter_map(Register::from_number) {
        let (own, others) = rest.split_at_checked(register.bytes())?;
        values.push(own);
        rest = others;
    }
    if !rest.is_empty() {
        return None;
    }
    write(cpu, CONTROL, values[CONTROL])?;
    for (number, own) in values.iter().enumerate() {
        write(cpu, number, own)?;
    }
    write(cpu, SP, values[SP])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_description_has_the_registers_that_are_sent() {
        let widths = DESCRIPTION.split("bitsize=\"").skip(1);
        let widths = widths.filter_map(|rest| rest.split('"').next()?.parse::<usize>().ok());
        let own = (0..)
            .map_while(Register::from_number)
            .map(|register| 8 * register.bytes());
        assert_eq!(widths.collect::<Vec<_>>(), own.collect::<Vec<_>>());
        assert_eq!((0..).map_while(Register::from_number).count(), COUNT);
    }

    #[test]
    fn what_is_written_is_read_register_by_register_and_all_at_once() {
        let mut cpu = Cpu::default();
        for number in 0..COUNT {
            let width = read(&cpu, number).unwrap().len();
            let value = [0x40 + number as u8 * 4; 8];
            write(&mut cpu, number, &value[..width]).unwrap();
            assert_eq!(write(&mut cpu, number, &value[..width - 1]), None);
        }
        // Implemented bits: flags, IT state and T; one of PRIMASK, four of BASEPRI.
        let shown = |number| u32::from_le_bytes(read(&cpu, number).unwrap().try_into().unwrap());
        assert_eq!((shown(0), shown(15)), (0x4040_4040, 0x7C7C_7C7C));
        assert_eq!(shown(16), 0x8000_8000 | 1 << 24);
        assert_eq!(
            [19, 20, 21, 22].map(|n| read(&cpu, n).unwrap()[0]),
            [0, 0x90, 0, 0]
        );
        assert_eq!(read(&cpu, 38), Some(vec![0xD8; 8]));
        assert_eq!(
            (read(&cpu, COUNT), write(&mut cpu, COUNT, &[0; 4])),
            (None, None)
        );
        let bytes = read_all(&cpu);
        let mut other = Cpu::default();
        write_all(&mut other, &bytes).unwrap();
        assert_eq!(other.registers, cpu.registers);
        assert_eq!(write_all(&mut other, &bytes[1..]), None);
        assert_eq!(write_all(&mut other, &[&bytes[..], &[0]].concat()), None);
    }

    #[test]
    fn stack_pointers_are_those_of_their_stacks_whichever_is_in_use() {
        let mut cpu = Cpu::default();
        let word = |value: u32| value.to_le_bytes();
        let read = |cpu: &Cpu, n| u32::from_le_bytes(read(cpu, n).unwrap().try_into().unwrap());
        write(&mut cpu, 17, &word(0x2000_1000)).unwrap();
        write(&mut cpu, 18, &word(0x2000_2000)).unwrap();
        assert_eq!(
            [13, 17, 18].map(|n| read(&cpu, n)),
            [0x2000_1000, 0x2000_1000, 0x2000_2000]
        );
        write(&mut cpu, 22, &[2]).unwrap();
        assert_eq!(
            [13, 17, 18].map(|n| read(&cpu, n)),
            [0x2000_2000, 0x2000_1000, 0x2000_2000]
        );
        write(&mut cpu, 13, &word(0x2000_3000)).unwrap();
        assert_eq!(
            [13, 17, 18].map(|n| read(&cpu, n)),
            [0x2000_3000, 0x2000_1000, 0x2000_3000]
        );
    }
}
