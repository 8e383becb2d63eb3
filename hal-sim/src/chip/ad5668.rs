//! Models the AD5668, an octal 16-bit DAC on SPI (AD5668 data sheet, rev. J), in the -1 and -2
//! versions, which start at zero scale. /LDAC is high or open, and /CLR is high.
//!
//! Outputs are codes: settling, glitches and the voltage are not modelled.

use super::Cycle;
use super::cpu::bus::{Modelled, Unmodelled};

/// Number of outputs of one DAC, A–H.
pub const OUTPUTS: usize = 8;

/// A change of the code at one output, which sets its voltage.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Change {
    /// Cycle of the clock edge that completed the command.
    pub at: Cycle,
    /// Output 0–7 (A–H).
    pub output: u8,
    /// Code after the change; 0 if the output is powered down.
    pub code: u16,
}

/// Simulated digital-to-analogue converter AD5668 with eight outputs.
#[derive(Clone, PartialEq, Debug)]
pub struct Ad5668 {
    selected: bool,
    shift: u32,
    /// Number of falling clock edges since /SYNC fell; counting stops at 32.
    edges: u8,
    inputs: [u16; OUTPUTS],
    codes: [u16; OUTPUTS],
    powered: u8,
    /// Mask of the outputs that follow their input register at once, as the LDAC register sets it;
    /// bit n is output n.
    transparent: u8,
    /// Whether the internal reference voltage is on. Without any reference, all outputs are at 0 V.
    pub(crate) reference: bool,
    /// Number of frames that were ignored because they had only 1–31 clock edges.
    pub(crate) ignored: u32,
    changes: Vec<Change>,
}

impl Default for Ad5668 {
    /// Returns the state after power-on: all codes are 0, and the internal reference is off.
    fn default() -> Self {
        Self {
            selected: false,
            shift: 0,
            edges: 0,
            inputs: [0; OUTPUTS],
            codes: [0; OUTPUTS],
            powered: 0xFF,
            transparent: 0,
            reference: false,
            ignored: 0,
            changes: Vec::new(),
        }
    }
}

impl Ad5668 {
    /// Sets the level of /SYNC: `low` selects the chip. A frame with fewer than 32 clock edges is
    /// ignored.
    pub fn select(&mut self, low: bool) {
        if self.selected && !low && (1..32).contains(&self.edges) {
            self.ignored += 1; // one per frame: no run has 2^32 frames
        }
        if low && !self.selected {
            self.edges = 0;
            self.shift = 0;
        }
        self.selected = low;
    }

    /// Returns whether /SYNC is low.
    pub const fn is_selected(&self) -> bool {
        self.selected
    }

    /// Clocks in the lower `count` bits of `bits`, highest bit first; the last clock edge is at
    /// `at`. Does nothing unless /SYNC is low, and ignores edges after the 32nd of a frame.
    ///
    /// # Errors
    /// Fails if the data sheet reserves the command.
    pub fn shift(&mut self, bits: u16, count: u8, at: Cycle) -> Modelled {
        if !self.selected {
            return Ok(());
        }
        for bit in (0..count.min(16)).rev() {
            if self.edges == 32 {
                return Ok(());
            }
            self.shift = self.shift << 1 | u32::from(bits >> bit & 1);
            self.edges += 1;
            if self.edges == 32 {
                self.execute(self.shift, at)?;
            }
        }
        Ok(())
    }

    /// Returns the code of output `n`; 0 if the output is powered down or `n` exceeds 7.
    pub fn output(&self, n: usize) -> u16 {
        match self.codes.get(n) {
            Some(code) if self.powered & 1 << n != 0 => *code,
            _ => 0,
        }
    }

    /// Takes the output changes since the last call, oldest first.
    pub fn changes(&mut self) -> impl Iterator<Item = Change> + '_ {
        self.changes.drain(..)
    }

    /// Executes a frame: bits 31–28 are unused, 27–24 are the command, 23–20 the address, 19–4 the
    /// data (figure 57).
    fn execute(&mut self, frame: u32, at: Cycle) -> Modelled {
        let before: [u16; OUTPUTS] = std::array::from_fn(|n| self.output(n));
        let command = frame >> 24 & 0xF;
        let chosen: u8 = match frame >> 20 & 0xF {
            address @ 0..=7 => 1 << address,
            0xF => 0xFF,
            _ if command <= 3 => return Err(Unmodelled("AD5668: reserved address")),
            _ => 0,
        };
        let data = (frame >> 4 & 0xFFFF) as u16;
        match command {
            0 => self.write(chosen, data, self.transparent),
            1 => self.update(chosen),
            2 => self.write(chosen, data, 0xFF),
            3 => self.write(chosen, data, chosen | self.transparent),
            4 => self.power(frame),
            // The clear code matters only to /CLR, which is not driven.
            5 => {}
            6 => self.transparent = (frame & 0xFF) as u8,
            7 => {
                *self = Self {
                    selected: self.selected,
                    edges: self.edges,
                    ignored: self.ignored,
                    changes: std::mem::take(&mut self.changes),
                    ..Self::default()
                }
            }
            8 => self.reference = frame & 1 != 0,
            _ => return Err(Unmodelled("AD5668: reserved command")),
        }
        for (output, before) in before.into_iter().enumerate() {
            let code = self.output(output);
            if code != before {
                self.changes.push(Change {
                    at,
                    output: output as u8, // 0–7
                    code,
                });
            }
        }
        Ok(())
    }

    fn write(&mut self, chosen: u8, data: u16, update: u8) {
        for (n, input) in self.inputs.iter_mut().enumerate() {
            if chosen & 1 << n != 0 {
                *input = data;
            }
        }
        self.update(update);
    }

    fn update(&mut self, chosen: u8) {
        for (n, code) in self.codes.iter_mut().enumerate() {
            if chosen & 1 << n != 0 {
                *code = self.inputs[n];
            }
        }
    }

    /// Powers outputs up or down: DB9–8 are 0 for normal operation, DB7–0 select the outputs.
    fn power(&mut self, frame: u32) {
        let chosen = (frame & 0xFF) as u8;
        if frame >> 8 & 3 == 0 {
            self.powered |= chosen;
        } else {
            self.powered &= !chosen;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn send(dac: &mut Ad5668, frame: u32, at: Cycle) {
        dac.select(true);
        dac.shift((frame >> 16) as u16, 16, at - 128).unwrap();
        dac.shift(frame as u16, 16, at).unwrap();
        dac.select(false);
    }

    fn outputs(dac: &Ad5668) -> [u16; 8] {
        std::array::from_fn(|n| dac.output(n))
    }

    #[test]
    fn write_and_update_changes_one_output_at_the_32nd_edge() {
        let mut dac = Ad5668::default();
        send(&mut dac, 0x0325_6780, 1000);
        assert_eq!(outputs(&dac), [0, 0, 0x5678, 0, 0, 0, 0, 0]);
        let change = Change {
            at: 1000,
            output: 2,
            code: 0x5678,
        };
        assert_eq!(dac.changes().collect::<Vec<_>>(), [change]);
        send(&mut dac, 0x0325_6780, 2000);
        assert_eq!(dac.changes().count(), 0, "the same code again");
        send(&mut dac, 0xF3FF_FFFF, 3000);
        assert_eq!(outputs(&dac), [0xFFFF; 8]);
        assert_eq!(dac.changes().count(), 8);
    }

    #[test]
    fn input_registers_wait_for_an_update() {
        let mut dac = Ad5668::default();
        send(&mut dac, 0x0000_0010, 500);
        send(&mut dac, 0x0010_0020, 1000);
        assert_eq!(outputs(&dac), [0; 8]);
        send(&mut dac, 0x0110_0000, 1500);
        assert_eq!(outputs(&dac), [0, 2, 0, 0, 0, 0, 0, 0]);
        send(&mut dac, 0x0270_0030, 2000);
        assert_eq!(outputs(&dac), [1, 2, 0, 0, 0, 0, 0, 3]);
        send(&mut dac, 0x0600_0004, 2500); // LDAC register: output C is transparent
        send(&mut dac, 0x0020_0040, 3000);
        assert_eq!(outputs(&dac), [1, 2, 4, 0, 0, 0, 0, 3]);
    }

    #[test]
    fn frames_that_are_too_short_are_ignored_and_further_edges_too() {
        let mut dac = Ad5668::default();
        dac.select(true);
        dac.shift(0x030F, 16, 100).unwrap();
        dac.shift(0x7FFF, 15, 200).unwrap();
        dac.select(false);
        assert_eq!((outputs(&dac), dac.ignored), ([0; 8], 1));
        dac.shift(1, 1, 300).unwrap();
        assert_eq!(outputs(&dac), [0; 8], "not selected");
        dac.select(true);
        for half in [0x0300, 0x0010, 0x0300, 0x0020] {
            dac.shift(half, 16, 400).unwrap();
        }
        dac.select(false);
        assert_eq!((outputs(&dac)[0], dac.ignored), (1, 1));
        dac.select(true);
        dac.select(false);
        assert_eq!(dac.ignored, 1, "no edge, no frame");
    }

    #[test]
    fn power_reference_and_reset() {
        let mut dac = Ad5668::default();
        assert!(!dac.reference);
        send(&mut dac, 0x0800_0001, 500);
        assert!(dac.reference);
        send(&mut dac, 0x03F1_2340, 1000);
        send(&mut dac, 0x0400_0102, 1500);
        assert_eq!(dac.output(1), 0, "1 kOhm to ground");
        send(&mut dac, 0x0400_0002, 2000);
        assert_eq!(dac.output(1), 0x1234);
        assert_eq!(dac.changes().count(), 10);
        send(&mut dac, 0x0700_0000, 2500);
        assert_eq!(outputs(&dac), [0; 8]);
        assert!(!dac.reference);
        assert_eq!(dac.changes().map(|c| c.at).collect::<Vec<_>>(), [2500; 8]);
        dac.select(true);
        dac.shift(0x0900, 16, 2600).unwrap();
        assert!(dac.shift(0, 16, 2700).is_err(), "reserved");
    }
}
