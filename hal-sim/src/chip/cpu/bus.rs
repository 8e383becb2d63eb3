//! What the core sees of the chip around it: memory, and time that goes on.

use crate::chip::Cycle;

/// Width of a data access.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Size {
    /// 8 bits.
    Byte,
    /// 16 bits.
    Half,
    /// 32 bits.
    Word,
}

impl Size {
    /// Number of bytes.
    pub const fn bytes(self) -> u32 {
        match self {
            Self::Byte => 1,
            Self::Half => 2,
            Self::Word => 4,
        }
    }
}

/// Something that nobody models; the run stops and names it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Unmodelled(pub &'static str);

/// What there is only where all that it takes is modelled.
pub type Modelled<T = ()> = Result<T, Unmodelled>;

/// Stops the run with `what` if `unmodelled`.
#[inline]
pub const fn refuse_if(unmodelled: bool, what: &'static str) -> Modelled {
    if unmodelled {
        Err(Unmodelled(what))
    } else {
        Ok(())
    }
}

/// Why an access got no answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AccessError {
    /// The slave answers with an error: the core takes a bus fault.
    Error,
    /// Nobody models it.
    Unmodelled(Unmodelled),
}

impl From<Unmodelled> for AccessError {
    fn from(what: Unmodelled) -> Self {
        Self::Unmodelled(what)
    }
}

/// A word read, and the wait states beyond a zero-wait-state access.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ReadResult {
    /// The data, zero-extended.
    pub value: u32,
    /// Wait states, cycles.
    pub wait: u32,
}

/// Number of words that hold the interrupt lines (82 on the STM32F405).
pub const LINE_WORDS: usize = 3;

/// All but the private peripheral bus (0xE000_0000–0xE00F_FFFF), which is the
/// core's own. Accesses come in the order of their cycles, naturally aligned.
pub trait Bus {
    /// A data read of `size` at `address` whose data phase begins at `at`.
    fn read(&mut self, address: u32, size: Size, at: Cycle) -> Result<ReadResult, AccessError>;

    /// A data write; gives its wait states.
    fn write(
        &mut self,
        address: u32,
        size: Size,
        value: u32,
        at: Cycle,
    ) -> Result<u32, AccessError>;

    /// A data read without wait states, told apart from others in a few steps;
    /// `None` where [`Self::read`] must look.
    fn read_without_wait(&self, _address: u32, _size: Size) -> Option<u32> {
        None
    }

    /// A data write without wait states, told apart from others in a few
    /// steps; otherwise does nothing, and [`Self::write`] must look.
    fn write_without_wait(&mut self, _address: u32, _size: Size, _value: u32) -> bool {
        false
    }

    /// The half-word of code at `address`, for decoding: no time passes.
    fn read_code(&mut self, address: u32) -> Result<u16, AccessError>;

    /// The core begins to need code of the 16-byte line at `line` (its address
    /// / 16) at `at`; gives the wait states until it has it.
    fn fetch(&mut self, line: u32, at: Cycle) -> u32;

    /// Whether code at `address` can change by a plain write (RAM), so that it
    /// must be decoded anew each time.
    fn is_writable_code(&self, address: u32) -> bool;

    /// Counts up when code in flash changed: decoded code is stale.
    fn code_version(&self) -> u32 {
        0
    }

    /// Lets everything outside the core happen up to `to`.
    fn advance(&mut self, to: Cycle) -> Modelled;

    /// Earliest cycle at which `advance` must be called: an interrupt line may
    /// change then. An access can make it earlier, even now.
    fn next_event(&self) -> Cycle;

    /// Level of every interrupt line, line n in bit n % 32 of word n / 32.
    fn interrupt_lines(&self) -> [u32; LINE_WORDS];

    /// Level of the non-maskable interrupt (clock security, RM0090 section
    /// 7.2.7).
    fn nmi(&self) -> bool {
        false
    }

    /// Whether the core's clock goes on while it sleeps, and the cycle counter with it.
    fn clocks_sleeping_core(&self) -> bool {
        true
    }

    /// The core asks for a system reset (AIRCR.SYSRESETREQ).
    fn request_reset(&mut self, at: Cycle);

    /// A reset was asked for and not carried out yet: the run ends with
    /// [`crate::chip::cpu::Stop::Reset`].
    fn is_reset_requested(&self) -> bool {
        false
    }
}
