//! Failures before USB can report them, as an image keeps them in the chip's backup registers. Images
//! write them, and the host program explains them (docs/evidence/faults.md, Details of a fault).

/// Register with the failure: [`MAGIC`] in its upper half, the number of equal failures in a row (bits
/// 8 to 15) and the code (bits 0 to 7); 0 after a boot without one.
pub const REGISTER: usize = 15;
/// Register with the value that belongs to the failure: the measured frequency of the crystal, Hz.
pub const VALUE_REGISTER: usize = 16;
/// "BU", in the upper half of a valid [`REGISTER`].
pub const MAGIC: u32 = 0x4255_0000;

/// A failure before USB can report it. A breadboard's diode blinks the code.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[repr(u8)]
pub enum Failure {
    /// The crystal does not start.
    CrystalMissing = 1,
    /// The crystal has another frequency than the board's.
    CrystalWrong = 2,
    /// RAM does not keep its content.
    Ram = 3,
    /// The supply is too low to start.
    SupplyLow = 4,
}

impl Failure {
    /// Every failure.
    pub const ALL: [Self; 4] = [
        Self::CrystalMissing,
        Self::CrystalWrong,
        Self::Ram,
        Self::SupplyLow,
    ];
}

/// Returns the code in the content `word` of [`REGISTER`]; `None` if it contains no failure.
#[must_use]
pub const fn code(word: u32) -> Option<u8> {
    if word & 0xFFFF_0000 == MAGIC {
        return Some((word & 0xFF) as u8);
    }
    None
}
