//! The first fault that nobody acknowledged yet, in the backup registers, which a reset
//! leaves alone; why the device last reset; who it is.

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
/// What came after the record; not under the check, so that a write cut short costs no
/// more than itself. Below: [`FaultRecord::later`].
const LATER: usize = CHECK + 1;
const POWER_LOST: u32 = 1 << 31;
const ACKNOWLEDGED: u32 = 1 << 30;
const _: () = assert!(
    LATER < 20,
    "as many registers are there (RM0090 section 26.6.20)"
);

/// Why the device last reset (RM0090 RCC_CSR), most telling cause first. Illegal low-power
/// entry and the window watchdog, which are not in use, would show as `Pin`.
#[must_use]
pub fn read_reset_cause() -> ResetCause {
    let flags = RCC.csr().read();
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

/// Clears the flags of [`read_reset_cause`] for the next time: what a power-on clears was.
pub fn forget_reset_cause() {
    RCC.csr().modify(|w| w.set_rmvf(true));
}

/// Makes the backup registers and backup SRAM writable (RM0090 section 5.1.2).
pub fn unlock() {
    RCC.apb1enr().modify(|w| w.set_pwren(true));
    let _ = RCC.apb1enr().read(); // ES0182: delay after clock enabling
    PWR.cr1().modify(|w| w.set_dbp(true));
    let _ = PWR.cr1().read(); // the write has arrived
}

/// Keeps `record`; `detail` is for people (a line, an address, a register). If one is kept
/// that nobody acknowledged, that one stays and notes what came after it.
pub fn keep(record: &FaultRecord, detail: u32) {
    unlock();
    if !is_whole() || read(LATER) & ACKNOWLEDGED != 0 {
        return store(record, detail);
    }
    // What comes before time runs comes at 0, each time anew.
    let at = record.at.get();
    let is_same = at != 0 && read(AT) == at && read(HEAD) == head(record.fault);
    let own = if is_same { 0 } else { record.fault.bit() };
    write(LATER, read(LATER) | record.later | own);
}

/// The check word goes last, so that a record cut short is no record.
fn store(record: &FaultRecord, detail: u32) {
    write(CHECK, 0);
    write(HEAD, head(record.fault));
    write(AT, record.at.get());
    for (index, charge) in record.residual.iter().enumerate() {
        write(RESIDUAL + index, charge.cast_unsigned());
    }
    write(DETAIL, detail);
    write(LATER, record.later);
    write(CHECK, check());
}

const fn head(fault: Fault) -> u32 {
    MAGIC | fault.number() as u32
}

/// The record and detail that the last reset left, if any.
#[must_use]
pub fn load() -> Option<(FaultRecord, u32)> {
    if !is_whole() {
        return None;
    }
    let mut residual = [0; CHANNELS];
    for (index, charge) in residual.iter_mut().enumerate() {
        *charge = read(RESIDUAL + index).cast_signed();
    }
    let fault = Fault::from_number((read(HEAD) & 0xFFFF) as u16)?;
    let later = read(LATER);
    let record = FaultRecord {
        residual,
        later: later & !(POWER_LOST | ACKNOWLEDGED),
        power_lost: later & POWER_LOST != 0,
        ..FaultRecord::new(fault, Micros::new(read(AT)))
    };
    Some((record, read(DETAIL)))
}

/// A boot: what was acknowledged and not over is latched again, and maybe power was lost.
pub fn note_boot(power_lost: bool) {
    let lost = if power_lost { POWER_LOST } else { 0 };
    write(LATER, read(LATER) & !ACKNOWLEDGED | lost);
}

/// The fault was acknowledged: the next one is kept in its place, this one until then or
/// until [`clear`].
pub fn acknowledge() {
    unlock();
    write(LATER, read(LATER) | ACKNOWLEDGED);
}

/// The acknowledged fault is over.
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

fn is_whole() -> bool {
    read(HEAD) & 0xFFFF_0000 == MAGIC && read(CHECK) == check()
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
