//! Encodings of ARMv7E-M with FPv4-SP from which test programs are built, and recognition of an
//! instruction's encoding.
//!
//! A pattern has a letter for every bit. `0` and `1` are fixed. `d` and `e` are registers written,
//! `n`, `m`, `a` registers read, `t`, `u` loaded, `r`, `q` stored, `b` the base and `x` the index
//! of an access, `l` a list, `i` an immediate, `k` one that stays below 16, `c` a condition; others
//! are free.

mod float;
mod integer_16;
mod integer_32;
mod memory_32;

/// Instruction encoding with its use in test programs.
#[derive(Clone, Copy, Debug)]
pub struct Encoding {
    /// Mnemonic and form.
    pub name: &'static str,
    /// Pattern of 16 or 32 letters; spaces do not count.
    pub pattern: &'static str,
    /// Condition for its use in a program.
    pub kind: Kind,
}

/// Condition under which a program contains an encoding.
#[derive(Clone, Copy, Debug)]
pub enum Kind {
    /// Anywhere, with any fields.
    Plain,
    /// Anywhere, with fields that are not UNPREDICTABLE.
    Valid(fn(u32) -> bool),
    /// An access of this many bytes to the scratch memory.
    Memory(Form, u32),
    /// Only with other instructions around it.
    Unit(Unit),
    /// In no program, for this reason.
    Left(&'static str),
}

/// Address computation of an access.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Form {
    /// Base plus bits 10:6 times the size.
    Scaled,
    /// Stack pointer plus the lowest byte times 4.
    Stack,
    /// Base plus the lowest 12 bits.
    Offset,
    /// Base plus or minus the lowest byte, which applies before or after the access.
    Indexed,
    /// Base plus index.
    Register,
    /// Base plus index, shifted left by bits 5:4.
    ShiftedRegister,
    /// Base plus or minus the lowest byte times 4, which applies before or after the access;
    /// aligned.
    Dual,
    /// Base plus or minus the lowest byte times 4; aligned.
    Float,
    /// List of core registers at rising addresses from the base on.
    Up,
    /// List of core registers below the base address.
    Down,
    /// Floating-point registers from the base on; the lowest byte is the number of words.
    FloatsUp,
    /// Floating-point registers below the base; the lowest byte is the number of words.
    FloatsDown,
    /// Program counter plus or minus an immediate: the program itself.
    Literal,
}

/// Surroundings that an instruction needs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unit {
    /// For a branch: instructions that it may skip.
    Skip,
    /// For IT: one to four instructions that become conditional.
    Block,
    /// A place outside an IT block.
    Alone,
    /// For BX and BLX: the address of the target in a register.
    ToRegister,
    /// For a load or move to the program counter: the address of the target.
    ToLoaded,
    /// For TBB and TBH: a table of branch targets.
    Table,
    /// A register list stored to the stack, and loaded again.
    Stack,
    /// The stack pointer moved down, read, and moved up again.
    Adjust,
    /// An exclusive load, and an exclusive store.
    Exclusive,
    /// For WFE and SEV: an event that is set before WFE waits for it.
    Event,
    /// Code that clears the mask registers after it.
    Mask,
}

const fn plain(name: &'static str, pattern: &'static str) -> Encoding {
    row(name, pattern, Kind::Plain)
}

const fn valid(name: &'static str, pattern: &'static str, is: fn(u32) -> bool) -> Encoding {
    row(name, pattern, Kind::Valid(is))
}

const fn memory(name: &'static str, pattern: &'static str, form: Form, size: u32) -> Encoding {
    row(name, pattern, Kind::Memory(form, size))
}

const fn unit(name: &'static str, pattern: &'static str, unit: Unit) -> Encoding {
    row(name, pattern, Kind::Unit(unit))
}

const fn excluded(name: &'static str, pattern: &'static str, why: &'static str) -> Encoding {
    row(name, pattern, Kind::Left(why))
}

const fn row(name: &'static str, pattern: &'static str, kind: Kind) -> Encoding {
    Encoding {
        name,
        pattern,
        kind,
    }
}

/// Encoding whose pattern was parsed into fixed bits and fields.
#[derive(Clone, Debug)]
pub struct Pattern {
    /// Encoding that was parsed.
    pub encoding: Encoding,
    /// Width in bits, 16 or 32.
    pub width: u32,
    fixed: u32,
    value: u32,
    letters: Vec<char>,
}

impl Pattern {
    fn new(encoding: Encoding) -> Self {
        let letters: Vec<char> = encoding.pattern.chars().filter(|c| *c != ' ').collect();
        let width = letters.len() as u32;
        assert!(width == 16 || width == 32, "{}", encoding.name);
        let bits = |is: fn(char) -> bool| {
            letters
                .iter()
                .fold(0, |mask, c| mask << 1 | u32::from(is(*c)))
        };
        Self {
            encoding,
            width,
            fixed: bits(|c| c == '0' || c == '1'),
            value: bits(|c| c == '1'),
            letters,
        }
    }

    /// Returns whether `word`, of `width` bits, has this encoding.
    #[must_use]
    pub fn matches(&self, width: u32, word: u32) -> bool {
        width == self.width && word & self.fixed == self.value
    }

    /// Returns the letters that are fields, each once, in order.
    #[must_use]
    pub fn fields(&self) -> Vec<char> {
        let mut fields: Vec<char> = Vec::new();
        for &letter in &self.letters {
            if letter != '0' && letter != '1' && !fields.contains(&letter) {
                fields.push(letter);
            }
        }
        fields
    }

    /// Returns the width of the field `letter` in bits.
    #[must_use]
    pub fn field_width(&self, letter: char) -> u32 {
        self.letters.iter().filter(|c| **c == letter).count() as u32
    }

    /// Returns the pattern's ones; all other bits are zero.
    #[must_use]
    pub const fn fixed_bits(&self) -> u32 {
        self.value
    }

    /// Replaces the field's bits, wherever they lie in `word`.
    #[must_use]
    pub fn set_field(&self, word: u32, letter: char, value: u32) -> u32 {
        let (mut word, mut left) = (word, self.field_width(letter));
        for (at, _) in self
            .letters
            .iter()
            .enumerate()
            .filter(|(_, c)| **c == letter)
        {
            left -= 1;
            let place = self.width - 1 - at as u32;
            word = word & !(1 << place) | (value >> left & 1) << place;
        }
        word
    }

    /// Extracts the field's bits, wherever they lie in `word`.
    #[must_use]
    pub fn field(&self, word: u32, letter: char) -> u32 {
        let places = self.letters.iter().enumerate();
        places
            .filter(|(_, c)| **c == letter)
            .fold(0, |bits, (at, _)| {
                bits << 1 | word >> (self.width - 1 - at as u32) & 1
            })
    }
}

/// All encodings, special cases before general ones.
#[derive(Clone, Debug)]
pub struct Encodings(pub Vec<Pattern>);

impl Encodings {
    /// Parses all tables.
    #[must_use]
    pub fn new() -> Self {
        let tables = [
            integer_16::ENCODINGS,
            integer_32::ENCODINGS,
            memory_32::ENCODINGS,
            float::ENCODINGS,
        ];
        Self(tables.concat().into_iter().map(Pattern::new).collect())
    }

    /// Returns the index of the encoding of the instruction `word` of `width` bits.
    #[must_use]
    pub fn find(&self, width: u32, word: u32) -> Option<usize> {
        self.0.iter().position(|p| p.matches(width, word))
    }

    /// Returns the encoding called `name`.
    ///
    /// # Panics
    /// Panics if there is none.
    #[must_use]
    pub fn by_name(&self, name: &str) -> &Pattern {
        let found = self.0.iter().find(|p| p.encoding.name == name);
        found.unwrap_or_else(|| panic!("no encoding {name}"))
    }
}

impl Default for Encodings {
    fn default() -> Self {
        Self::new()
    }
}

/// Returns whether a half-word is the first of a 32-bit instruction.
#[must_use]
pub const fn is_wide(first: u16) -> bool {
    first >> 11 >= 0b11101
}
