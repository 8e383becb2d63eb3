//! What the chip must be able to do before anything may be armed, tried at each boot:
//! hold the image that was flashed.

use super::pac::{CRC, RCC};
use super::record;
use crate::safety::{Fault, FaultRecord};
use crate::units::Micros;

/// What the chip cannot do, recorded: latched until a boot does not find it.
#[must_use]
pub fn failure() -> Option<FaultRecord> {
    let (fault, detail) = flash()?;
    let found = FaultRecord::new(fault, Micros::new(0));
    record::keep(&found, detail);
    Some(FaultRecord {
        lasts: true,
        ..found
    })
}

/// The last word that is loaded (memory.x): the CRC of all before it, written after
/// linking. An image that nobody wrote it into is not whole.
#[used]
#[unsafe(link_section = ".image_sum")]
static IMAGE_SUM: u32 = u32::MAX;

/// What the linker puts first.
const IMAGE: *const u32 = 0x0800_0000 as *const u32;

/// The chip's CRC unit over image and sum leaves 0 (RM0090 section 4); the detail is what
/// it leaves.
fn flash() -> Option<(Fault, u32)> {
    RCC.ahb1enr().modify(|w| w.set_crcen(true));
    let _ = RCC.ahb1enr().read(); // ES0182: delay after clock enabling
    CRC.cr().write(|w| w.set_reset(true));
    let end = (&raw const IMAGE_SUM).wrapping_add(1);
    let mut at = IMAGE;
    while at < end {
        // SAFETY: flash from its start to the sum, which `end` is one past; aligned.
        // Volatile: the compiler knows what the image holds.
        CRC.dr().write_value(unsafe { at.read_volatile() });
        at = at.wrapping_add(1);
    }
    let left = CRC.dr().read();
    RCC.ahb1enr().modify(|w| w.set_crcen(false));
    (left != 0).then_some((Fault::Flash, left))
}
