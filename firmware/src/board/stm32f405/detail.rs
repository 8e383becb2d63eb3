//! Details of faults (docs/evidence/faults.md): bits of fault 2, `TapeSlip`, and of fault 24, `Board`, and
//! numbers of faults 15 and 16.
//!
//! Bits 0 to 15 of a tape slip are four bits for each stream of the tape, in the order first port,
//! second port, and the erasers of both: FEIF, DMEIF, TEIF and [`OFF`].

/// The stream is disabled.
pub const OFF: u32 = 1 << 3;
/// The first stream's position disagrees; the next bits are those of the other streams.
pub const POSITION: u32 = 1 << 16;
/// A disconnect word has changed.
pub const DISCONNECT_WORD: u32 = 1 << 20;
/// TIM1 does not reach the quiet part of a microsecond.
pub const NOT_QUIET: u32 = 1 << 21;
/// A stream does not stop.
pub const NOT_STOPPED: u32 = 1 << 22;
/// DMA2 carries another stream.
pub const OTHER_STREAM: u32 = 1 << 23;
/// A stream starts from an impossible position.
pub const START: u32 = 1 << 24;
/// A stream is more than two slots from its position.
pub const FAR: u32 = 1 << 25;
/// Time base: the core's clock disagrees with the crystal.
pub const TIME_BASE_CRYSTAL: u32 = 1;
/// Time base: device time disagrees with the host's frames.
pub const TIME_BASE_USB: u32 = 2;
/// Time base: device time disagrees with the core's clock.
pub const TIME_BASE_TAPE: u32 = 3;
/// Registers: the pins could not be locked at boot.
pub const NOT_LOCKED: u32 = 6;
/// Board: the strap is open, or something pulls it low.
#[cfg(feature = "breadboard")]
pub const STRAP_OPEN: u32 = 1;
/// Board: the over-current line is high, as output stages drive it.
#[cfg(feature = "breadboard")]
pub const OVER_CURRENT_HIGH: u32 = 1 << 1;
