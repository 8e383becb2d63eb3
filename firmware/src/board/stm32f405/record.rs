//! The last fault, in the backup registers, which a reset leaves alone; why
//! the device last reset; who it is.

use super::pac::{PWR, RCC, RTC, UID};
use crate::link::message::ResetCause;
use crate::pulse::CHANNELS;
use crate::safety::{Fault, FaultRecord};
use crate::units::Micros;

/// Marks a record as ours: "FX", then the fault's number below.
const MAGIC: u32 = 0x4658_0000;
const HEAD: usize = 0;
const AT: usize = 1;
const RESIDUAL: usize = 2;
const DETAIL: usize = RESIDUAL + CHANNELS;
const CHECK: usize = DETAIL + 1;

/// Why the device last reset (RM0090 RCC_CSR), most telling cause first; clears
/// it for the next time. Illegal low-power entry and the window watchdog, which
/// are not in use, would show as `Pin`.
#[must_use]
pub fn read_reset_cause() -> ResetCause {
    let flags = RCC.csr().read();
    RCC.csr().modify(|w| w.set_rmvf(true));
    // Every reset also pulls the pin; every power-on also sets brown-out.
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

/// Makes the backup registers writable (RM0090 section 5.1.2).
pub fn unlock() {
    RCC.apb1enr().modify(|w| w.set_pwren(true));
    let _ = RCC.apb1enr().read(); // ES0182: delay after clock enabling
    PWR.cr1().modify(|w| w.set_dbp(true));
    let _ = PWR.cr1().read(); // the write has arrived
}

/// Keeps `record`; `detail` is for people (a line, an address, a register).
/// The check word goes last, so that a record cut short is no record.
pub fn store(record: &FaultRecord, detail: u32) {
    unlock();
    write(CHECK, 0);
    write(HEAD, MAGIC | u32::from(record.fault.number()));
    write(AT, record.at.get());
    for (index, charge) in record.residual.iter().enumerate() {
        write(RESIDUAL + index, charge.cast_unsigned());
    }
    write(DETAIL, detail);
    write(CHECK, check());
}

/// The record and detail that the last reset left, if any.
#[must_use]
pub fn load() -> Option<(FaultRecord, u32)> {
    let head = read(HEAD);
    if head & 0xFFFF_0000 != MAGIC || read(CHECK) != check() {
        return None;
    }
    let mut residual = [0; CHANNELS];
    for (index, charge) in residual.iter_mut().enumerate() {
        *charge = read(RESIDUAL + index).cast_signed();
    }
    Some((
        FaultRecord {
            fault: Fault::from_number((head & 0xFFFF) as u16)?,
            at: Micros::new(read(AT)),
            residual,
        },
        read(DETAIL),
    ))
}

/// The fault was acknowledged.
pub fn clear() {
    unlock();
    write(HEAD, 0);
    write(CHECK, 0);
}

/// The chip's 96-bit number (RM0090 section 39.1).
#[must_use]
pub fn unique_id() -> [u32; 3] {
    [0, 1, 2].map(|n| UID.uid(n).read())
}

/// A sum that differs from an erased register's zero.
fn check() -> u32 {
    (HEAD..CHECK).fold(u32::MAX, |sum, index| sum.rotate_left(5) ^ read(index))
}

fn read(index: usize) -> u32 {
    RTC.bkpr(index).read().bkp()
}

fn write(index: usize, value: u32) {
    RTC.bkpr(index).write(|w| w.set_bkp(value));
}
