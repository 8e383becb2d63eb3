//! Two AD5668-class octal DACs on SPI3, written by the CPU: DMA2 may not serve
//! an APB peripheral, and DMA1 would gain nothing over 1.6 µs a write.

use super::pac::spi::vals;
use super::pac::{RCC, SPI3};
use super::pins::{self, Dac};
use crate::board::wiring::{BOARD, DacOutput};
use crate::pulse::{BANKS, CHANNELS};
use crate::units::DacCode;

/// What each channel's amplitude, and each bank's level, is set by.
const OUTPUTS: [DacOutput; CHANNELS] = BOARD.dacs.channels;
const TRIPS: [DacOutput; BANKS] = BOARD.dacs.trips;
/// AD5668 data sheet, command definitions: write to and update channel n.
const WRITE_AND_UPDATE: u32 = 0b0011;
/// The same: reset to power-on state, zero scale.
const RESET: u32 = 0b0111;
/// The same: internal reference set-up; DB0 = 1 switches it on.
const REFERENCE: u32 = 0b1000;
/// Polls for one 16-bit frame: 0.76 µs, at most 130 core cycles, is awaited
/// for at least 5 µs.
const PATIENCE: usize = 200;

/// SPI3 as master, 42 MHz / 2 = 21 MHz, 16-bit frames, clock idle low, data
/// sampled by the DAC on the falling edge (CPOL 0, CPHA 1); then both DACs to
/// zero with their own reference.
pub fn init() {
    RCC.apb1enr().modify(|w| w.set_spi3en(true));
    let _ = RCC.apb1enr().read(); // ES0182: delay after clock enabling
    SPI3.cr1().write(|w| {
        w.set_cpol(vals::Cpol::IDLE_LOW);
        w.set_cpha(vals::Cpha::SECOND_EDGE);
        w.set_mstr(vals::Mstr::MASTER);
        w.set_br(vals::Br::DIV2);
        w.set_dff(vals::Dff::BITS16);
        w.set_ssm(true);
        w.set_ssi(true);
        w.set_bidimode(vals::Bidimode::BIDIRECTIONAL);
        w.set_bidioe(vals::Bidioe::TRANSMIT);
        w.set_spe(true);
    });
    for dac in [Dac::One, Dac::Two] {
        send(dac, RESET << 24);
        send(dac, REFERENCE << 24 | 1);
    }
}

/// Writes `code` to the output of `channel` (below [`CHANNELS`], others are
/// ignored), effective at the end of the write.
pub fn write(channel: u8, code: DacCode) {
    if let Some(&output) = OUTPUTS.get(usize::from(channel)) {
        put(output, code);
    }
}

/// Writes the level of each bank's comparators.
pub fn write_trips(codes: &[DacCode; BANKS]) {
    for (output, &code) in TRIPS.into_iter().zip(codes) {
        put(output, code);
    }
}

fn put(DacOutput { dac, output }: DacOutput, code: DacCode) {
    let dac = if dac == 0 { Dac::One } else { Dac::Two };
    // 4 bits unused, 4 command, 4 address, 16 data, 4 unused.
    send(
        dac,
        WRITE_AND_UPDATE << 24 | u32::from(output) << 20 | u32::from(code.get()) << 4,
    );
}

/// Every output to zero.
pub fn clear() {
    (0..CHANNELS as u8).for_each(|channel| write(channel, DacCode::new(0)));
}

#[inline]
fn send(dac: Dac, word: u32) {
    pins::select_dac(Some(dac));
    for half in [word >> 16, word & 0xFFFF] {
        wait(|| SPI3.sr().read().txe());
        // At most 16 bits by the line above.
        SPI3.dr().write(|w| w.set_dr(half as u16));
    }
    // RM0090 28.3.9: the last frame is out when TXE is set and BSY is clear.
    wait(|| SPI3.sr().read().txe());
    wait(|| !SPI3.sr().read().bsy());
    pins::select_dac(None);
    // /SYNC stays high at least 15 ns (AD5668, t8): 4 cycles are 24 ns.
    cortex_m::asm::delay(4);
}

fn wait(mut ready: impl FnMut() -> bool) {
    // A DAC that does not answer cannot be noticed; a dead SPI must not hang
    // the refill, and the missing amplitude shows in the mid-phase current.
    let _ = (0..PATIENCE).any(|_| ready());
}
