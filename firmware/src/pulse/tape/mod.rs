//! The pulse tape: one BSRR word per port and microsecond (design: "play back states, not
//! events"), for any board's pin map ([`PinMap`]).
//!
//! A word carries the complete state of the port's lines (channels and sync output): set bits in
//! the lower half, reset bits in the upper half (RM0090, GPIOx_BSRR). The pump's bit is set or
//! reset only where it changes. All values that follow from the pin map are computed at compile
//! time.

use super::plan::{Levels, WindowPlan};
use super::{CHANNELS, WINDOW_US};
use crate::board::wiring::{Pin, PinMap, Pump, TAPE_PORTS};
use core::marker::PhantomData;

/// Number of words in one window, one per µs.
pub const SLOTS: usize = WINDOW_US as usize;

/// Distance between pump edges in slots: a 20 kHz square wave.
pub const PUMP_SLOTS: usize = 25;

/// Number of lines that follow [`Levels`]: two for each channel, and the sync output.
const LINES: usize = 2 * CHANNELS + 1;

/// The pin map `M`, converted to port words and shifts.
struct Map<M>(PhantomData<M>);

impl<M: PinMap> Map<M> {
    /// Pins of each port that follow [`Levels`], as a mask: bit n for pin n.
    const PINS: [u32; TAPE_PORTS] = {
        let (mut pins, mut n) = ([0; TAPE_PORTS], 0);
        while n < LINES {
            if let Some(pin) = Self::pin_of_bit(n) {
                pins[Self::port(pin)] |= pin.bit();
            }
            n += 1;
        }
        pins
    };

    /// Bit of the pump's pin on its port; 0 if the board has no pump.
    const PUMP: u32 = match M::OUTPUTS.pump {
        Pump::Driven(pin) => pin.bit(),
        Pump::Input(_) => 0,
    };

    /// Whether the pump is on the first port.
    const IS_PUMP_FIRST: bool = Self::port(M::OUTPUTS.pump.pin()) == 0;

    /// Moves of the bits of [`Levels`] to the pins of each port; bits that move by the same
    /// distance share a move. Unused entries move nothing.
    const MOVES: [[Move; LINES]; TAPE_PORTS] = {
        let mut moves = [[Move { bits: 0, by: 0 }; LINES]; TAPE_PORTS];
        let mut bit = 0;
        while bit < LINES {
            let Some(pin) = Self::pin_of_bit(bit) else {
                bit += 1;
                continue;
            };
            let (port, by) = (Self::port(pin), pin.number as i8 - bit as i8);
            let mut n = 0; // there are as many moves as lines
            while moves[port][n].bits != 0 && moves[port][n].by != by {
                n += 1;
            }
            moves[port][n].by = by;
            moves[port][n].bits |= 1 << bit;
            bit += 1;
        }
        moves
    };

    /// Returns the pin of bit `bit` of [`Levels`]; `None` for a line that the board lacks.
    const fn pin_of_bit(bit: usize) -> Option<Pin> {
        let outputs = M::OUTPUTS;
        if bit == LINES - 1 {
            return Some(outputs.sync);
        }
        match outputs.channels[bit / 2] {
            Some(lines) if bit.is_multiple_of(2) => Some(lines.cathodic),
            Some(lines) => Some(lines.anodic),
            None => None,
        }
    }

    /// Returns which port of the tape `pin` is on, 0 or 1.
    const fn port(pin: Pin) -> usize {
        !pin.is_on(M::OUTPUTS.ports[0]) as usize
    }
}

/// Bits that move up or down by the same distance.
#[derive(Clone, Copy)]
struct Move {
    bits: u32,
    by: i8,
}

impl Move {
    #[inline(always)]
    const fn apply(self, levels: u32) -> u32 {
        let bits = levels & self.bits;
        if self.by < 0 {
            bits >> -self.by
        } else {
            bits << self.by
        }
    }
}

/// Returns the words that disconnect every channel and set sync low, for each port. They do not
/// change the pump's bit: an erased slot does not pump.
#[must_use]
pub const fn isolated_words<M: PinMap>() -> [u32; TAPE_PORTS] {
    let [first, second] = Map::<M>::PINS;
    [first << 16, second << 16]
}

/// Returns the bits of each port's BSRR that set the pump low; 0 on a port without a pump.
#[must_use]
pub const fn pump_low<M: PinMap>() -> [u32; TAPE_PORTS] {
    let mut low = [0; TAPE_PORTS];
    low[!Map::<M>::IS_PUMP_FIRST as usize] = Map::<M>::PUMP << 16;
    low
}

/// One window of the pulse tape, for both ports.
pub struct Window<'a> {
    /// Words for the BSRR of the port that moves first.
    pub first: &'a mut [u32; SLOTS],
    /// Words for the BSRR of the other port.
    pub second: &'a mut [u32; SLOTS],
}

/// Returns the words of each port for `levels`; the pump's bit is not changed.
#[must_use]
#[inline]
pub const fn words<M: PinMap>(levels: Levels) -> [u32; TAPE_PORTS] {
    /// Applies all moves of a port to `levels`. Written out, because a loop over constants need not
    /// be unrolled.
    macro_rules! moved {
        ($port:literal, $($n:literal)*) => {
            0 $(| const { Map::<M>::MOVES[$port][$n] }.apply(levels.0))*
        };
    }
    let first = moved!(0, 0 1 2 3 4 5 6 7 8 9 10 11 12 13 14 15 16 17 18 19 20);
    let second = moved!(1, 0 1 2 3 4 5 6 7 8 9 10 11 12 13 14 15 16 17 18 19 20);
    let [all_first, all_second] = Map::<M>::PINS;
    [
        (all_first ^ first) << 16 | first, // lines of a port only: what is not set is reset
        (all_second ^ second) << 16 | second,
    ]
}

/// Returns the levels that a pair of words puts on the pins, isolated for channels that the board
/// lacks; `None` if a word does not carry the complete state of its port.
#[must_use]
pub const fn levels<M: PinMap>(words: [u32; TAPE_PORTS]) -> Option<Levels> {
    let pump = Map::<M>::PUMP | Map::<M>::PUMP << 16;
    let (mut levels, mut bit) = (0, 0);
    while bit < LINES {
        if let Some(pin) = Map::<M>::pin_of_bit(bit) {
            levels |= (words[Map::<M>::port(pin)] >> pin.number & 1) << bit;
        }
        bit += 1;
    }
    let levels = Levels(levels);
    let [first, second] = self::words::<M>(levels);
    let is_complete = if Map::<M>::IS_PUMP_FIRST {
        words[0] & !pump == first && words[1] == second
    } else {
        words[0] == first && words[1] & !pump == second
    };
    if is_complete { Some(levels) } else { None }
}

/// Paints `plan` on an erased window: only slots that are not disconnected and the pump's edges
/// are written.
#[inline]
pub fn paint<M: PinMap>(plan: &WindowPlan, window: &mut Window<'_>) {
    let mut current = plan.initial;
    let mut from = 0usize;
    for change in &plan.changes {
        let to = usize::from(change.slot);
        fill::<M>(window, from, to, current);
        (from, current) = (to, change.levels);
    }
    fill::<M>(window, from, SLOTS, current);
    if plan.pump && M::OUTPUTS.pump.is_driven() {
        let pumped = if Map::<M>::IS_PUMP_FIRST {
            &mut *window.first
        } else {
            &mut *window.second
        };
        let mut high = true;
        for word in pumped.iter_mut().step_by(PUMP_SLOTS) {
            *word |= if high {
                Map::<M>::PUMP
            } else {
                Map::<M>::PUMP << 16
            };
            high = !high;
        }
    }
}

/// Fills slots of an erased window; a port whose channels stay disconnected is not written.
fn fill<M: PinMap>(window: &mut Window<'_>, from: usize, to: usize, levels: Levels) {
    if levels == Levels::ISOLATED {
        return;
    }
    let [first, second] = words::<M>(levels);
    let [lines_first, lines_second] = Map::<M>::PINS;
    // A word that sets no line disconnects its port. `get_mut` so that a malformed plan cannot
    // panic; `paint` keeps from <= to <= SLOTS.
    if first & lines_first != 0
        && let Some(slots) = window.first.get_mut(from..to)
    {
        fill_words(slots, first);
    }
    if second & lines_second != 0
        && let Some(slots) = window.second.get_mut(from..to)
    {
        fill_words(slots, second);
    }
}

/// Fills `slots` with `word`, eight stores in a row: this takes a third of the time of a loop with
/// one store.
fn fill_words(slots: &mut [u32], word: u32) {
    let (eights, rest) = slots.as_chunks_mut::<8>();
    for eight in eights {
        *eight = [word; 8];
    }
    rest.fill(word);
}

#[cfg(test)]
mod tests;
