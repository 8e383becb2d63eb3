//! Instructions that need other instructions around them.

use super::encodings::Unit;
use super::generate::{Access, Builder, Instruction};

impl Builder<'_> {
    /// Appends the encoding `id` and its surroundings.
    pub(super) fn unit(&mut self, unit: Unit, id: usize) {
        let pattern = self.pattern(id).clone();
        let word = self.fill(&pattern);
        let instruction = (pattern.width, word);
        let name = pattern.encoding.name;
        match unit {
            Unit::Alone => self.push(instruction),
            Unit::Skip => self.push_branch(name, instruction),
            Unit::Block => self.push_it_block(word),
            Unit::ToRegister => {
                let target = self.destination(4, &[]);
                let after = self.next_address() + 12;
                self.load_constant(target, after | 1);
                self.push((16, pattern.set_field(word, 'm', target)));
                self.push_skipped();
            }
            Unit::ToLoaded => self.load_counter(name, instruction),
            Unit::Table => self.push_table_branch(instruction),
            Unit::Stack => self.stack(name),
            Unit::Adjust => self.push_stack_adjustment(name),
            Unit::Exclusive => self.exclusive(name),
            Unit::Event => {
                self.push((16, 0xBF40)); // sev
                self.push((16, 0xBF20)); // wfe
            }
            Unit::Mask => self.mask(instruction),
        }
    }

    /// Loads `value` into `register` with MOVW and MOVT.
    fn load_constant(&mut self, register: u32, value: u32) {
        for (name, half) in [("MOVW", value & 0xFFFF), ("MOVT", value >> 16)] {
            let (width, word) = self.draw_named(name);
            let word = word & !0x040F_7FFF | register << 8;
            let immediate = half >> 12 << 16 | (half >> 11 & 1) << 26;
            let immediate = immediate | (half >> 8 & 7) << 12 | half & 0xFF;
            self.push((width, word | immediate));
        }
    }

    /// Appends a half-word that must be skipped; its execution would show in the results.
    fn push_skipped(&mut self) {
        let register = self.destination(3, &[]);
        self.push((16, 0x2000 | register << 8 | 0xA5)); // movs
    }

    /// Appends a branch over one to three instructions, taken or not.
    fn push_branch(&mut self, name: &str, (width, word): Instruction) {
        let body: Vec<Instruction> = (0..self.random.within(1..4))
            .map(|_| self.draw_simple())
            .collect();
        let halves: u32 = body.iter().map(|(width, _)| width / 16).sum();
        // Relative to the instruction's address + 4, in half-words.
        let offset = width / 16 + halves - 2;
        let word = match name {
            "CBZ" | "CBNZ" => word & !0x02F8 | (offset & 31) << 3 | offset >> 5 << 9,
            "B (cond, T1)" => word & !0xFF | offset,
            "B (T2)" => word & !0x7FF | offset,
            "B (cond, T3)" => word & !0x043F_2FFF | offset,
            // J1 and J2 are set if the offset is not negative.
            _ => word & !0x07FF_07FF | 0x2800 | offset,
        };
        self.push((width, word));
        for instruction in body {
            self.push(instruction);
        }
    }

    /// Appends IT and its one to four instructions.
    fn push_it_block(&mut self, value: u32) {
        let mask = value & 15;
        let mask = if mask == 0 { 8 } else { mask };
        self.push((16, value & !15 | mask));
        for _ in 0..4 - mask.trailing_zeros() {
            let instruction = self.draw_simple();
            self.push(instruction);
        }
    }

    /// Loads the program counter, or moves a register to it.
    fn load_counter(&mut self, name: &str, (width, word): Instruction) {
        let lr = 14;
        // At least three half-words lie before the target, which is odd for loads.
        let (before, load): (Option<Instruction>, Instruction) = match name {
            "MOV (reg to PC, T1)" => (None, (width, word & !0x78 | lr << 3)),
            "POP (with PC, T1)" => (Some((16, 0xB500 | word & 0xFF)), (width, word)),
            "POP (with PC, T2)" => {
                let list = word & 0x1FFF;
                (Some((32, 0xE92D_4000 | list)), (width, word))
            }
            _ => (Some((32, 0xF84D_ED04)), (width, word)), // str lr, [sp, #-4]!
        };
        let halves = 4 + before.map_or(0, |(width, _)| width / 16) + width / 16 + 1;
        let after = self.next_address() + halves * 2;
        self.load_constant(lr, after | 1);
        if let Some(store) = before {
            self.push(store);
        }
        self.push(load);
        self.push_skipped();
    }

    /// Appends TBB or TBH with eight targets.
    fn push_table_branch(&mut self, instruction: Instruction) {
        self.push(instruction);
        let wide = instruction.1 & 0x10 != 0;
        let start: u16 = if wide { 8 } else { 4 };
        for entry in 0..start {
            self.code.push(if wide {
                start + entry
            } else {
                (start + 2 * entry) | (start + 2 * entry + 1) << 8
            });
        }
        for _ in 0..8 {
            let register = self.destination(3, &[]);
            let immediate = self.random.word() & 0xFF;
            self.push((16, 0x3000 | register << 8 | immediate)); // adds
        }
    }

    /// Pushes, executes another instruction, and pops the same amount.
    fn stack(&mut self, name: &str) {
        let (push, pop) = match name {
            "PUSH (T1)" | "POP (T1)" => self.core_stack(16),
            "PUSH (T2)" | "POP (T2)" => self.core_stack(32),
            "PUSH (T3)" | "POP (T3)" => (self.draw_named("PUSH (T3)"), self.draw_named("POP (T3)")),
            _ => self.float_stack(name.ends_with("(D)")),
        };
        self.push(push);
        if self.random.once_in(2) {
            let between = self.draw_simple();
            self.push(between);
        }
        self.push(pop);
    }

    /// Returns a push and a pop of the same number of registers, not of the same registers.
    fn core_stack(&mut self, width: u32) -> (Instruction, Instruction) {
        let bits = if width == 16 { 8 } else { 14 };
        let load = self.register_list(bits, "POP");
        let store = loop {
            let list = self.register_list(bits, "PUSH");
            if list.count_ones() == load.count_ones() {
                break list;
            }
        };
        if width == 16 {
            return ((16, 0xB400 | store), (16, 0xBC00 | load));
        }
        let place = |list: u32| list & 0x1FFF | (list >> 13 & 1) << 14;
        (
            (32, 0xE92D_0000 | place(store)),
            (32, 0xE8BD_0000 | place(load)),
        )
    }

    fn float_stack(&mut self, double: bool) -> (Instruction, Instruction) {
        let count = if double {
            self.random.within(1..9) * 2
        } else {
            self.random.within(1..17)
        };
        let mut place = || {
            let first = self.random.within(0..33 - count);
            if double {
                (first / 2) << 12 | 0xB00 | count
            } else {
                (first >> 1) << 12 | (first & 1) << 22 | 0xA00 | count
            }
        };
        ((32, 0xED2D_0000 | place()), (32, 0xECBD_0000 | place()))
    }

    /// Appends instructions that move the stack pointer down, copy it, and move it up again.
    fn push_stack_adjustment(&mut self, name: &str) {
        let immediate = self.random.within(0..128);
        let (down, up) = match name {
            "ADD (SP + imm, T2)" | "SUB (SP - imm, T1)" => {
                ((16, 0xB080 | immediate), (16, 0xB000 | immediate))
            }
            "ADD (SP to SP, T3)" | "SUB (SP to SP, T2)" => {
                let bytes = (immediate * 2) & !3;
                ((32, 0xF1AD_0D00 | bytes), (32, 0xF10D_0D00 | bytes))
            }
            _ => {
                let bytes = (immediate * 2) & !3;
                ((32, 0xF2AD_0D00 | bytes), (32, 0xF20D_0D00 | bytes))
            }
        };
        self.push(down);
        let read = self.draw_named("ADD (SP + imm, T1)");
        self.push(read);
        self.push(up);
    }

    /// Loads exclusively, and stores to the same address.
    fn exclusive(&mut self, name: &str) {
        let suffix = name.trim_start_matches("LDREX").trim_start_matches("STREX");
        let (width, mut load) = self.draw_named(&format!("LDREX{suffix}"));
        let (_, mut store) = self.draw_named(&format!("STREX{suffix}"));
        let offset = if suffix.is_empty() { load & 0xFF } else { 0 };
        store = store & !0xFF
            | if suffix.is_empty() {
                offset
            } else {
                store & 0xFF
            };
        let access = Access {
            offset: offset as i32 * 4,
            bytes: 4,
            aligned: true,
            writes_back: false,
            uses_base: true,
        };
        if !self.place_access(access) {
            return;
        }
        // The status register differs from all other registers.
        let stored = store >> 12 & 15;
        let status = self.destination(4, &[stored]);
        let at = if suffix.is_empty() { 8 } else { 0 };
        store = store & !(15 << at) | status << at;
        if self.random.once_in(8) {
            load = 0xF3BF_8F2F; // clrex: the store must fail
        }
        self.push((width, load));
        self.push((width, store));
    }

    /// Writes or reads a mask register, then clears all mask registers.
    ///
    /// A written value has its lowest four bits clear: QEMU keeps those of BASEPRI, which this
    /// chip, with four bits of priority, does not have (Arm ARM B1.4.3; PM0214: bits 3:0 reserved).
    fn mask(&mut self, (width, word): Instruction) {
        let zero = self.destination(4, &[]);
        let instruction = if word >> 20 == 0xF38 {
            let value = self.random.word() & 0xF0;
            self.load_constant(zero, value);
            (width, word & !0xF_0000 | zero << 16)
        } else {
            (width, word)
        };
        self.push(instruction);
        let read = self.draw_named("MRS (PRIMASK, BASEPRI)");
        self.push(read);
        self.push((16, 0xB662)); // cpsie i
        self.load_constant(zero, 0);
        self.push((32, 0xF380_8811 | zero << 16)); // msr basepri
    }
}
