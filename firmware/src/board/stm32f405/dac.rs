//! Two AD5668-class octal DACs on SPI3, written by the CPU. DMA2 may not serve an APB peripheral,
//! and DMA1 would save nothing at 1.6 µs per write.

use super::pac::spi::vals;
use super::pac::{RCC, SPI3};
use super::pins::{self, Dac};
use crate::board::wiring::{BOARD, DacOutput};
use crate::pulse::{BANKS, CHANNELS};
use crate::units::DacCode;

/// DAC output that sets the amplitude of each channel.
const OUTPUTS: [DacOutput; CHANNELS] = BOARD.dacs.channels;
/// DAC output that sets the trip level of each bank's comparators.
const TRIPS: [DacOutput; BANKS] = BOARD.dacs.trips;
/// Command "write to and update channel n" (AD5668 data sheet, command definitions).
const WRITE_AND_UPDATE: u32 = 0b0011;
/// Command "reset to power-on state", which is zero scale.
const RESET: u32 = 0b0111;
/// Command "internal reference set-up"; DB0 = 1 turns the reference on.
const REFERENCE: u32 = 0b1000;
/// Largest number of polls for one 16-bit frame, at least 5 µs. The frame takes 0.76 µs, at most
/// 130 core cycles.
const PATIENCE: usize = 200;

/// Configures SPI3 and sets both DACs to zero with their internal reference.
///
/// SPI3 is master at 42 MHz / 2 = 21 MHz, with 16-bit frames and a clock that idles low; the DAC
/// samples data on the falling edge (CPOL 0, CPHA 1).
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

/// Writes `code` to the output of `channel` (below [`CHANNELS`], others are ignored), effective at
/// the end of the write.
pub fn write(channel: u8, code: DacCode) {
    if let Some(&output) = OUTPUTS.get(usize::from(channel)) {
        put(output, code);
    }
}

/// Writes the trip level of each bank's comparators.
pub fn write_trips(codes: &[DacCode; BANKS]) {
    for (output, &code) in TRIPS.into_iter().zip(codes) {
        put(output, code);
    }
}

fn put(DacOutput { dac, output }: DacOutput, code: DacCode) {
    let dac = if dac == 0 { Dac::One } else { Dac::Two };
    // Frame: 4 bits unused, 4 command, 4 address, 16 data, 4 unused.
    send(
        dac,
        WRITE_AND_UPDATE << 24 | u32::from(output) << 20 | u32::from(code.get()) << 4,
    );
}

/// Sets every channel's output to zero.
pub fn clear() {
    (0..CHANNELS as u8).for_each(|channel| write(channel, DacCode::new(0)));
}

#[inline]
fn send(dac: Dac, word: u32) {
    pins::select_dac(Some(dac));
    for half in [word >> 16, word & 0xFFFF] {
        wait(|| SPI3.sr().read().txe());
        // The value has at most 16 bits after the line above.
        SPI3.dr().write(|w| w.set_dr(half as u16));
    }
    // The last frame has been sent when TXE is set and BSY is clear (RM0090 28.3.9).
    wait(|| SPI3.sr().read().txe());
    wait(|| !SPI3.sr().read().bsy());
    pins::select_dac(None);
    // /SYNC must stay high for at least 15 ns (AD5668, t8): 4 cycles are 24 ns.
    cortex_m::asm::delay(4);
}

fn wait(mut ready: impl FnMut() -> bool) {
    // A missing DAC cannot be detected here. A dead SPI must not block the refill, and the missing
    // amplitude shows in the mid-phase current.
    let _ = (0..PATIENCE).any(|_| ready());
}
