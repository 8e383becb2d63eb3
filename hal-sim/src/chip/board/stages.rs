//! Writes the table of output stages to the place in flash where the firmware reads it, as
//! commissioning does on a board.

use crate::body::Drive;
use crate::chip::soc::flash::{Flash, OutsideFlash};
use crate::lockstep::Output;
use crate::trace::CHANNELS;
use firmware::safety::{Origin, StageKind, StageSupply, StageTable, StageWords};

/// Addresses of the two copies of the stage table in flash: sectors 10 and 11 (docs/reference/hardware.md).
pub const COPIES: [u32; 2] = [0x080C_0000, 0x080E_0000];

/// Option bytes (OPTCR) of a commissioned board: brown-out level 3, watchdog by software, no
/// protection (docs/evidence/hil.md, part 7).
pub const OPTIONS: u32 = 0x0FFF_AAE1;

/// Returns the stage table of a simulated board with these stages, made for a session.
#[must_use]
pub fn table(outputs: &[Option<Output>; CHANNELS]) -> StageTable {
    StageTable {
        origin: Origin::Session,
        supply: Some(StageSupply::Separate), // each is simulated separately
        stages: outputs.map(|output| {
            // The full scale is at most 150 V or 100 mA, so thousandths fit.
            Some(match output?.full_scale {
                Drive::Milliamps(ma) => StageKind::Current {
                    full_scale_ua: (ma * 1e3).round() as u32,
                },
                Drive::Volts(v) => StageKind::Voltage {
                    full_scale_mv: (v * 1e3).round() as u32,
                },
            })
        }),
    }
}

/// Writes `words` to address `copy` as one copy of the stage table, as a programmer would.
///
/// # Errors
/// Fails if the address is not in flash.
pub fn write(flash: &mut Flash, copy: u32, words: &StageWords) -> Result<(), OutsideFlash> {
    let bytes: Vec<u8> = words.iter().flat_map(|word| word.to_le_bytes()).collect();
    flash.load(copy, &bytes)
}
