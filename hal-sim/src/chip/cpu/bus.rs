//! Defines the core's view of the chip around it: memory, interrupt lines and the progress of time.

use crate::chip::Cycle;

/// Width of an access to memory or a register.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Size {
    /// An access of 8 bits.
    Byte,
    /// An access of 16 bits.
    Half,
    /// An access of 32 bits.
    Word,
}

impl Size {
    /// Returns the width in bytes: 1, 2 or 4.
    pub const fn bytes(self) -> u32 {
        match self {
            Self::Byte => 1,
            Self::Half => 2,
            Self::Word => 4,
        }
    }
}

/// A feature that is not modelled; the run stops with an error that names it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Unmodelled(pub &'static str);

/// Result of an operation that fails if it needs a feature that is not modelled.
pub type Modelled<T = ()> = Result<T, Unmodelled>;

/// Returns an error that names the feature `feature` if `unmodelled` is true.
#[inline]
pub const fn refuse_if(unmodelled: bool, feature: &'static str) -> Modelled {
    if unmodelled {
        Err(Unmodelled(feature))
    } else {
        Ok(())
    }
}

/// Reason why an access failed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AccessError {
    /// The slave answers with an error, so the core takes a bus fault.
    Error,
    /// The accessed feature is not modelled.
    Unmodelled(Unmodelled),
}

impl From<Unmodelled> for AccessError {
    fn from(what: Unmodelled) -> Self {
        Self::Unmodelled(what)
    }
}

/// Result of a read: the data, and the wait states beyond an access without wait states.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ReadResult {
    /// Data read, zero-extended.
    pub value: u32,
    /// Number of wait states, cycles.
    pub wait: u32,
}

/// Number of 32-bit words that hold the levels of the interrupt lines (82 on the STM32F405).
pub const LINE_WORDS: usize = 3;

/// Everything outside the core except its private peripheral bus (0xE000_0000–0xE00F_FFFF).
/// Accesses come in the order of their cycles, naturally aligned.
pub trait Bus {
    /// Reads `size` at `address`; the data phase begins at `at`.
    fn read(&mut self, address: u32, size: Size, at: Cycle) -> Result<ReadResult, AccessError>;

    /// Writes `size` of `value` at `address`, with the data phase beginning at `at`. Returns the
    /// number of wait states.
    fn write(
        &mut self,
        address: u32,
        size: Size,
        value: u32,
        at: Cycle,
    ) -> Result<u32, AccessError>;

    /// Reads data if this takes no wait states, after a fast check. Returns `None` if
    /// [`Self::read`] must be used.
    fn read_without_wait(&self, _address: u32, _size: Size) -> Option<u32> {
        None
    }

    /// Writes data if this takes no wait states, after a fast check. Does nothing and returns
    /// `false` if [`Self::write`] must be used.
    fn write_without_wait(&mut self, _address: u32, _size: Size, _value: u32) -> bool {
        false
    }

    /// Returns the half-word of code at `address`, for decoding; no time passes.
    fn read_code(&mut self, address: u32) -> Result<u16, AccessError>;

    /// Fetches the 16-byte line of code `line` (its address / 16), requested at `at`. Returns the
    /// number of wait states until the core has the line.
    fn fetch(&mut self, line: u32, at: Cycle) -> u32;

    /// Returns whether a plain write can change the code at `address` (RAM), so that it must be
    /// decoded each time.
    fn is_writable_code(&self, address: u32) -> bool;

    /// Returns a number that changes when code in flash has changed and decoded code is stale.
    fn code_version(&self) -> u32 {
        0
    }

    /// Advances everything outside the core to cycle `to`.
    fn advance(&mut self, to: Cycle) -> Modelled;

    /// Returns the earliest cycle at which `advance` must be called, because an interrupt line may
    /// change then. An access can make it earlier, even the present cycle.
    fn next_event(&self) -> Cycle;

    /// Returns the level of every interrupt line; line n is bit n % 32 of word n / 32.
    fn interrupt_lines(&self) -> [u32; LINE_WORDS];

    /// Returns the level of the non-maskable interrupt (clock security, RM0090 section 7.2.7).
    fn nmi(&self) -> bool {
        false
    }

    /// Returns whether the core's clock, and with it the cycle counter, continues during sleep.
    fn clocks_sleeping_core(&self) -> bool {
        true
    }

    /// Requests a system reset, as the core does with AIRCR.SYSRESETREQ.
    fn request_reset(&mut self, at: Cycle);

    /// Returns whether a requested reset is pending: the run ends with
    /// [`crate::chip::cpu::Stop::Reset`].
    fn is_reset_requested(&self) -> bool {
        false
    }
}
