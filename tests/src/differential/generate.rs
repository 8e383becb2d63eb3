//! Random cases: a few instructions, and the preceding register contents.

use super::encodings::{Encodings, Form, Kind, Pattern};
use super::random::Random;

/// Address of the scratch memory, which cases load from and store to.
pub(super) const SCRATCH: u32 = 0x2000_1000;
/// Size of the scratch memory; it also holds the stack, and accesses of cases stay inside.
pub(super) const SCRATCH_BYTES: u32 = 256;

/// Register contents with which a case starts.
#[derive(Clone, Debug)]
pub struct Input {
    /// Floating-point status and control register (FPSCR) at the start: rounding and other modes,
    /// flags.
    pub fpscr: u32,
    /// Flags N, Z, C, V, Q and GE at the start.
    pub apsr: u32,
    /// Single-precision registers S0–S31 at the start.
    pub s: [u32; 32],
    /// Core registers R0–R12 at the start.
    pub r: [u32; 13],
    /// Link register, R14, at the start.
    pub lr: u32,
}

/// Test case for the core.
#[derive(Clone, Debug)]
pub struct Case {
    /// Registers before the case.
    pub input: Input,
    /// Machine code, without the branch back to the harness.
    pub code: Vec<u16>,
}

/// Instruction with its width in bits.
pub(super) type Instruction = (u32, u32);

/// Builder of one case.
pub(super) struct Builder<'a> {
    pub(super) random: &'a mut Random,
    encodings: &'a Encodings,
    /// Number of uses planned for each encoding in all cases.
    planned: &'a mut [u32],
    /// Address of the case's code.
    address: u32,
    pub(super) code: Vec<u16>,
    /// Register that accesses are relative to, one of R0–R7. Instructions write to it only by an
    /// access's write-back.
    pub(super) base: u32,
    /// Index register, one of R0–R7, never written.
    pub(super) index: u32,
    index_value: u32,
    /// Value of the base register, once an access has fixed it.
    base_value: Option<u32>,
    /// Whether a write-back has happened, after which no access follows.
    closed: bool,
}

/// Generates a case whose code is at `address`.
pub(super) fn case(
    random: &mut Random,
    encodings: &Encodings,
    planned: &mut [u32],
    address: u32,
) -> Case {
    let base = random.within(0..8);
    let index = (base + random.within(1..8)) % 8;
    let index_value = random.within(0..8);
    let mut builder = Builder {
        random,
        encodings,
        planned,
        address,
        code: Vec::new(),
        base,
        index,
        index_value,
        base_value: None,
        closed: false,
    };
    let units = builder.random.within(1..5);
    for _ in 0..units {
        builder.push_any();
    }
    let (base_value, code) = (builder.base_value, builder.code);
    let mut input = Input {
        fpscr: random.fpscr(),
        apsr: random.word() & 0xF80F_0000,
        s: random.floats(),
        r: std::array::from_fn(|_| random.integer()),
        lr: random.integer(),
    };
    input.r[index as usize] = index_value;
    if let Some(value) = base_value {
        input.r[base as usize] = value;
    }
    Case { input, code }
}

impl Builder<'_> {
    /// Appends a random encoding: of three, the one planned least often so far.
    fn push_any(&mut self) {
        let count = self.encodings.0.len() as u32;
        let candidates = [(); 3].map(|()| self.random.within(0..count) as usize);
        let Some(id) = candidates.into_iter().min_by_key(|id| self.planned[*id]) else {
            return;
        };
        match self.encodings.0[id].encoding.kind {
            Kind::Left(_) => {}
            Kind::Unit(unit) => {
                self.planned[id] += 1;
                self.unit(unit, id);
            }
            _ => {
                if let Some(instruction) = self.try_draw(id, true) {
                    self.push(instruction);
                }
            }
        }
    }

    /// Generates an instruction that neither branches nor writes back.
    pub(super) fn draw_simple(&mut self) -> Instruction {
        let count = self.encodings.0.len() as u32;
        loop {
            let id = self.random.within(0..count) as usize;
            let kind = self.encodings.0[id].encoding.kind;
            let is_simple = matches!(kind, Kind::Plain | Kind::Valid(_) | Kind::Memory(..));
            if is_simple && let Some(instruction) = self.try_draw(id, false) {
                return instruction;
            }
        }
    }

    pub(super) fn pattern(&self, id: usize) -> &Pattern {
        &self.encodings.0[id]
    }

    /// Generates an instruction called `name` with random fields.
    pub(super) fn draw_named(&mut self, name: &str) -> Instruction {
        let pattern = self.encodings.by_name(name).clone();
        (pattern.width, self.fill(&pattern))
    }

    pub(super) fn push(&mut self, (width, word): Instruction) {
        if width == 32 {
            self.code.push((word >> 16) as u16);
        }
        self.code.push(word as u16);
    }

    /// Returns the address of the next instruction.
    pub(super) fn next_address(&self) -> u32 {
        self.address + self.code.len() as u32 * 2
    }

    /// Generates an instruction of the encoding `id` that the architecture defines and whose
    /// accesses stay within the scratch memory; `None` after 40 failed attempts.
    fn try_draw(&mut self, id: usize, may_write_back: bool) -> Option<Instruction> {
        let pattern = self.encodings.0[id].clone();
        for _ in 0..40 {
            let word = self.fill(&pattern);
            let allowed = match pattern.encoding.kind {
                Kind::Valid(is) => is(word),
                Kind::Memory(form, size) => {
                    let Some(access) = Access::of(&pattern, form, size, word, self.index_value)
                    else {
                        continue;
                    };
                    (may_write_back || !access.writes_back) && self.place_access(access)
                }
                _ => true,
            };
            if allowed {
                self.planned[id] += 1;
                return Some((pattern.width, word));
            }
        }
        None
    }

    /// Returns whether the access is possible, and fixes the base register's value for it.
    pub(super) fn place_access(&mut self, access: Access) -> bool {
        if !access.uses_base {
            return true;
        }
        let inside = 0..=SCRATCH_BYTES.saturating_sub(access.bytes);
        let base = self.base_value.unwrap_or_else(|| {
            let align = if self.random.once_in(2) { 3 } else { 0 };
            let at = self.random.within(0..SCRATCH_BYTES) & !align;
            (SCRATCH + at).wrapping_add_signed(-access.offset)
        });
        let address = base.wrapping_add_signed(access.offset);
        let fits = inside.contains(&address.wrapping_sub(SCRATCH));
        if self.closed || !fits || access.aligned && !address.is_multiple_of(4) {
            return false;
        }
        self.base_value = Some(base);
        self.closed = access.writes_back;
        true
    }

    /// Fills all fields at random, and registers according to their letters.
    pub(super) fn fill(&mut self, pattern: &Pattern) -> u32 {
        let mut word = pattern.fixed_bits();
        let mut used: Vec<u32> = Vec::new();
        for letter in pattern.fields() {
            let bits = pattern.field_width(letter);
            let value = match letter {
                'b' => self.base,
                'x' => self.index,
                'n' | 'm' | 'a' => self.source(bits),
                'd' | 'e' | 't' | 'u' => {
                    let register = self.destination(bits, &used);
                    used.push(register);
                    register
                }
                'r' | 'q' => self.source_except_base(bits),
                'c' => self.random.within(0..14),
                'k' => self.random.within(0..16),
                'l' => self.register_list(bits, pattern.encoding.name),
                _ => self.random.word() & ((1 << bits) - 1),
            };
            word = pattern.set_field(word, letter, value);
        }
        word
    }

    /// Chooses one of R0–R12 and R14, or of R0–R7 if there are only three bits.
    fn source(&mut self, bits: u32) -> u32 {
        loop {
            let register = self.random.within(0..1 << bits);
            if register != 13 && register != 15 {
                return register;
            }
        }
    }

    fn source_except_base(&mut self, bits: u32) -> u32 {
        loop {
            let register = self.source(bits);
            if register != self.base {
                return register;
            }
        }
    }

    /// Chooses a register that may be written and is not in `used`.
    pub(super) fn destination(&mut self, bits: u32, used: &[u32]) -> u32 {
        loop {
            let register = self.source_except_base(bits);
            if register != self.index && !used.contains(&register) {
                return register;
            }
        }
    }

    /// Generates the bits of a list of two or more registers for the instruction called `name`;
    /// with more than eight bits, the highest is R14.
    pub(super) fn register_list(&mut self, bits: u32, name: &str) -> u32 {
        let mut kept = 1 << self.base;
        if !name.starts_with("ST") && !name.starts_with("PUSH") {
            kept |= 1 << self.index;
        }
        let mask = if bits == 8 { 0xFF } else { (1 << bits) - 1 };
        loop {
            let list = self.random.word() & self.random.word() & mask & !kept;
            if list.count_ones() >= 2 {
                return list;
            }
        }
    }
}

/// Memory access relative to the base register.
#[derive(Clone, Copy, Debug)]
pub(super) struct Access {
    pub(super) offset: i32,
    pub(super) bytes: u32,
    pub(super) aligned: bool,
    pub(super) writes_back: bool,
    pub(super) uses_base: bool,
}

impl Access {
    /// Computes the access of the instruction `w`; returns `None` if the access is UNPREDICTABLE or
    /// too long.
    fn of(pattern: &Pattern, form: Form, size: u32, w: u32, index: u32) -> Option<Self> {
        let bit = |n: u32| w >> n & 1 != 0;
        let byte = (w & 0xFF) as i32;
        let either = |up: bool, offset: i32| if up { offset } else { -offset };
        let list = || pattern.field(w, 'l').count_ones();
        let mut access = Self {
            offset: 0,
            bytes: size,
            aligned: false,
            writes_back: false,
            uses_base: true,
        };
        match form {
            Form::Stack | Form::Literal => access.uses_base = false,
            Form::Scaled => access.offset = ((w >> 6 & 31) * size) as i32,
            Form::Offset => access.offset = (w & 0xFFF) as i32,
            Form::Register => access.offset = index as i32,
            Form::ShiftedRegister => access.offset = (index << (w >> 4 & 3)) as i32,
            Form::Indexed => {
                access.offset = if bit(10) { either(bit(9), byte) } else { 0 };
                access.writes_back = bit(8);
            }
            Form::Dual => {
                access.offset = if bit(24) {
                    either(bit(23), byte * 4)
                } else {
                    0
                };
                (access.writes_back, access.aligned) = (bit(21), true);
            }
            Form::Float => (access.offset, access.aligned) = (either(bit(23), byte * 4), true),
            Form::Up | Form::Down => {
                access.bytes = list() * 4;
                access.writes_back = pattern.width == 16 || bit(21);
            }
            Form::FloatsUp | Form::FloatsDown => {
                let first = if bit(8) {
                    (w >> 12 & 15) * 2
                } else {
                    (w >> 12 & 15) << 1 | w >> 22 & 1
                };
                access.bytes = w & 0xFF;
                if access.bytes == 0 || access.bytes > 16 || first + access.bytes > 32 {
                    return None;
                }
                access.bytes *= 4;
                access.writes_back = bit(21);
            }
        }
        if matches!(
            form,
            Form::Up | Form::Down | Form::FloatsUp | Form::FloatsDown
        ) {
            access.aligned = true;
            if matches!(form, Form::Down | Form::FloatsDown) {
                access.offset = -(access.bytes as i32);
            }
        }
        Some(access)
    }
}
