//! The tape: one BSRR word per port and microsecond (design: "play back
//! states, not events"), and the pin map that turns levels into words.
//!
//! Port C: PC0–9 are channels 1–5. Port B: PB0,1,5–9,12–14 are channels 6–10,
//! PB15 is sync out, PB10 the pump. A word carries the complete state of the
//! port's channel lines: set bits below, reset bits above (RM0090, GPIOx_BSRR).

use super::plan::{Levels, WindowPlan};
use super::{CHANNELS, WINDOW_US};

/// Words of one window.
pub const SLOTS: usize = WINDOW_US as usize;

/// Distance of pump edges in slots: a 20 kHz square wave.
pub const PUMP_SLOTS: usize = 25;

const LINES_C: u32 = 0x03FF;
const LINES_B: u32 = 0b0111_0011_1110_0011;
const SYNC_B: u32 = 1 << 15;
const PUMP_B: u32 = 1 << 10;

/// The word that isolates every channel of port C.
pub const ISOLATED_C: u32 = LINES_C << 16;
/// The word that isolates every channel of port B and drops sync. It leaves
/// the pump bit alone: an erased slot does not pump.
pub const ISOLATED_B: u32 = (LINES_B | SYNC_B) << 16;

/// One window of both ports.
pub struct Window<'a> {
    /// Words for GPIOB_BSRR.
    pub b: &'a mut [u32; SLOTS],
    /// Words for GPIOC_BSRR.
    pub c: &'a mut [u32; SLOTS],
}

/// Words (port B, port C) for `levels`; the pump bit is untouched.
#[must_use]
pub const fn words(levels: Levels) -> (u32, u32) {
    let c = levels.0 & LINES_C;
    let upper = levels.0 >> 10;
    let lines = upper & 0b11 | (upper & 0b0111_1100) << 3 | (upper & 0b11_1000_0000) << 5;
    let b = lines
        | if levels.0 & Levels::SYNC == 0 {
            0
        } else {
            SYNC_B
        };
    (
        (((LINES_B | SYNC_B) & !b) << 16) | b,
        ((LINES_C & !c) << 16) | c,
    )
}

/// Levels that a pair of words puts on the pins; `None` if a word does not
/// carry the complete state of its port.
#[must_use]
pub const fn levels(b: u32, c: u32) -> Option<Levels> {
    let (b_set, c_set) = (b & (LINES_B | SYNC_B), c & LINES_C);
    let complete = (b_set | (b >> 16) & (LINES_B | SYNC_B)) == LINES_B | SYNC_B
        && b_set & (b >> 16) == 0
        && c == ((LINES_C & !c_set) << 16) | c_set;
    if !complete {
        return None;
    }
    let upper = b_set & 0b11 | (b_set >> 3) & 0b0111_1100 | (b_set >> 5) & 0b11_1000_0000;
    let sync = if b & SYNC_B == 0 { 0 } else { Levels::SYNC };
    Some(Levels(c_set | upper << CHANNELS | sync))
}

/// Paints `plan` on an erased window: only slots that are not isolated and
/// the pump's edges are written.
#[inline]
pub fn paint(plan: &WindowPlan, window: &mut Window<'_>) {
    let mut current = plan.initial;
    let mut from = 0usize;
    for change in &plan.changes {
        let to = usize::from(change.slot);
        fill(window, from, to, current);
        (from, current) = (to, change.levels);
    }
    fill(window, from, SLOTS, current);
    if plan.pump {
        let mut high = true;
        for word in window.b.iter_mut().step_by(PUMP_SLOTS) {
            *word |= if high { PUMP_B } else { PUMP_B << 16 };
            high = !high;
        }
    }
}

/// The window is erased: a port that stays isolated is not written.
fn fill(window: &mut Window<'_>, from: usize, to: usize, levels: Levels) {
    if levels == Levels::ISOLATED {
        return;
    }
    let (b, c) = words(levels);
    // `get_mut` so that a malformed plan cannot panic; `paint` keeps from <= to <= SLOTS.
    if b != ISOLATED_B
        && let Some(slots) = window.b.get_mut(from..to)
    {
        fill_words(slots, b);
    }
    if c != ISOLATED_C
        && let Some(slots) = window.c.get_mut(from..to)
    {
        fill_words(slots, c);
    }
}

/// Eight stores in a row: a third of the time of a loop with one.
fn fill_words(slots: &mut [u32], word: u32) {
    let (eights, rest) = slots.as_chunks_mut::<8>();
    for eight in eights {
        *eight = [word; 8];
    }
    rest.fill(word);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pulse::{Change, State};
    use crate::units::Micros;

    #[test]
    fn every_channel_state_survives_the_pin_map() {
        for bits in 0..1u32 << 21 {
            let (b, c) = words(Levels(bits));
            assert_eq!(levels(b, c), Some(Levels(bits)));
            assert_eq!((b | b >> 16) & PUMP_B, 0);
        }
        assert_eq!(words(Levels::ISOLATED), (ISOLATED_B, ISOLATED_C));
    }

    #[test]
    fn painting_an_erased_window_gives_the_plan_back() {
        let mut plan = WindowPlan::new();
        let driven = Levels::ISOLATED
            .with(3, State::Cathodic)
            .with(8, State::Anodic);
        plan.reset(Micros::new(0), Levels::GROUNDED);
        plan.pump = true;
        plan.changes
            .push(Change {
                slot: 7,
                levels: driven,
            })
            .unwrap();
        plan.changes
            .push(Change {
                slot: 207,
                levels: Levels::ISOLATED,
            })
            .unwrap();
        let (mut b, mut c) = ([ISOLATED_B; SLOTS], [ISOLATED_C; SLOTS]);
        paint(
            &plan,
            &mut Window {
                b: &mut b,
                c: &mut c,
            },
        );
        for slot in 0..SLOTS {
            let expected = match slot {
                0..7 => Levels::GROUNDED,
                7..207 => driven,
                _ => Levels::ISOLATED,
            };
            assert_eq!(levels(b[slot], c[slot]), Some(expected), "slot {slot}");
            let pump = (b[slot] | b[slot] >> 16) & PUMP_B != 0;
            assert_eq!(pump, slot % PUMP_SLOTS == 0);
        }
    }
}
