//! Storage for the first unacknowledged fault in the backup registers, which a reset preserves;
//! also reset cause and chip ID.

use super::pac::{PWR, RCC, RTC, UID};
use crate::board::boot_failure::{self, REGISTER, VALUE_REGISTER};
use crate::link::message::ResetCause;
use crate::pulse::CHANNELS;
use crate::safety::{Fault, FaultRecord};
use crate::units::Micros;

/// Marks a valid record: "FX" in the upper half, the fault's number in the lower.
const MAGIC: u32 = 0x4658_0000;
const HEAD: usize = 0;
const AT: usize = 1;
const RESIDUAL: usize = 2;
const DETAIL: usize = RESIDUAL + CHANNELS;
const CHECK: usize = DETAIL + 1;
/// Word for events after the record. It is not part of the check word, so that an interrupted write
/// costs only this word. Its lower bits hold [`FaultRecord::later_faults`].
const LATER: usize = CHECK + 1;
/// Word of a request to the next boot, which [`super::boot_loader`] reads and clears; only a
/// breadboard has one.
pub const REQUEST: usize = VALUE_REGISTER + 1;
const POWER_LOST: u32 = 1 << 31;
const ACKNOWLEDGED: u32 = 1 << 30;
const _: () = assert!(
    LATER < REGISTER && VALUE_REGISTER < REQUEST && REQUEST < 20,
    "as many registers are there (RM0090 section 26.6.20)"
);

/// Returns the cause of the last reset (RM0090 RCC_CSR), the most specific flag first. Illegal
/// low-power entry and the window watchdog, which are not in use, would be reported as `Pin`.
#[must_use]
pub fn read_reset_cause() -> ResetCause {
    let flags = RCC.csr().read();
    // Every reset also sets the pin flag; every power-on also sets the brown-out flag.
    if flags.porrstf() {
        ResetCause::PowerOn
    } else if flags.borrstf() {
        ResetCause::BrownOut
    } else if flags.wdgrstf() {
        ResetCause::Watchdog
    } else if flags.sftrstf() {
        ResetCause::Software
    } else {
        ResetCause::Pin
    }
}

/// Clears the flags of [`read_reset_cause`], so that the next boot sees only its own cause.
pub fn forget_reset_cause() {
    RCC.csr().modify(|w| w.set_rmvf(true));
}

/// Makes the backup registers and backup SRAM writable (RM0090 section 5.1.2).
pub fn unlock() {
    RCC.apb1enr().modify(|w| w.set_pwren(true));
    let _ = RCC.apb1enr().read(); // ES0182: delay after clock enabling
    PWR.cr1().modify(|w| w.set_dbp(true));
    let _ = PWR.cr1().read(); // waits until the write has arrived
}

/// Stores `record`. If an unacknowledged record is stored already, that record stays and notes the
/// later fault.
pub fn keep(record: &FaultRecord) {
    unlock();
    if !is_whole() || read(LATER) & ACKNOWLEDGED != 0 {
        return store(record);
    }
    // Faults before device time starts are all recorded at time 0, and each counts as a new one.
    let at = record.at.get();
    let is_same = at != 0 && read(AT) == at && read(HEAD) == head(record.fault);
    let own = if is_same { 0 } else { record.fault.bit() };
    write(LATER, read(LATER) | record.later_faults | own);
}

/// Stores a fault that was found at boot, before device time runs, and returns its record.
pub fn keep_found_at_boot(fault: Fault, detail: u32) -> FaultRecord {
    let found = FaultRecord {
        detail,
        ..FaultRecord::new(fault, Micros::new(0))
    };
    keep(&found);
    FaultRecord {
        found_at_boot: true,
        ..found
    }
}

/// Stores a failure before USB can report it, with its value, and returns how often it has come in
/// a row, this time included.
pub fn note_bring_up(code: u8, value: u32) -> u8 {
    unlock();
    let word = boot_failure::MAGIC | u32::from(code);
    let before = read(REGISTER);
    let is_same = before & !0xFF00 == word && read(VALUE_REGISTER) == value;
    let count = if is_same { (before >> 8) as u8 } else { 0 };
    let count = count.saturating_add(1);
    write(VALUE_REGISTER, value);
    write(REGISTER, word | u32::from(count) << 8);
    count
}

/// Forgets the failures that [`note_bring_up`] stored.
pub fn forget_bring_up() {
    unlock();
    write(REGISTER, 0);
}

/// Writes the check word last, so that an interrupted write leaves no valid record.
fn store(record: &FaultRecord) {
    write(CHECK, 0);
    write(HEAD, head(record.fault));
    write(AT, record.at.get());
    for (index, charge) in record.residual.iter().enumerate() {
        write(RESIDUAL + index, charge.cast_unsigned());
    }
    write(DETAIL, record.detail);
    write(LATER, record.later_faults);
    write(CHECK, check());
}

const fn head(fault: Fault) -> u32 {
    MAGIC | fault.number() as u32
}

/// Returns the record from before the last reset, if any.
#[must_use]
pub fn load() -> Option<FaultRecord> {
    if !is_whole() {
        return None;
    }
    let mut residual = [0; CHANNELS];
    for (index, charge) in residual.iter_mut().enumerate() {
        *charge = read(RESIDUAL + index).cast_signed();
    }
    let fault = Fault::from_number((read(HEAD) & 0xFFFF) as u16)?;
    let later = read(LATER);
    Some(FaultRecord {
        residual,
        detail: read(DETAIL),
        later_faults: later & !(POWER_LOST | ACKNOWLEDGED),
        power_lost: later & POWER_LOST != 0,
        ..FaultRecord::new(fault, Micros::new(read(AT)))
    })
}

/// Notes a boot: latches an acknowledged fault again if it was not cleared, and notes a loss of
/// power.
pub fn note_boot(power_lost: bool) {
    let lost = if power_lost { POWER_LOST } else { 0 };
    write(LATER, read(LATER) & !ACKNOWLEDGED | lost);
}

/// Acknowledges the fault. The record stays until the next fault replaces it or until [`clear`].
pub fn acknowledge() {
    unlock();
    write(LATER, read(LATER) | ACKNOWLEDGED);
}

/// Clears the record once the acknowledged fault is over.
pub fn clear() {
    unlock();
    write(HEAD, 0);
    write(CHECK, 0);
}

/// Returns the chip's 96-bit unique ID (RM0090 section 39.1).
#[must_use]
pub fn unique_id() -> [u32; 3] {
    [0, 1, 2].map(|n| UID.uid(n).read())
}

fn is_whole() -> bool {
    read(HEAD) & 0xFFFF_0000 == MAGIC && read(CHECK) == check()
}

/// Computes the checksum of the record, which differs from the zero of an erased register.
fn check() -> u32 {
    (HEAD..CHECK).fold(u32::MAX, |sum, index| sum.rotate_left(5) ^ read(index))
}

fn read(index: usize) -> u32 {
    RTC.bkpr(index).read().bkp()
}

/// Writes a backup register; [`unlock`] must have been called.
pub fn write(index: usize, value: u32) {
    RTC.bkpr(index).write(|w| w.set_bkp(value));
}
