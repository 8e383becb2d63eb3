use super::*;
use crate::board::wiring::{BoardPins, Lines, Outputs, Port};
use crate::pulse::{Change, State};
use crate::units::Micros;

/// A fictitious board whose lines are arranged as differently from those of the reference board as
/// possible: other ports, channels in disorder over both, pins that rise and fall, sync and pump
/// on the second port.
struct Permuted;

impl PinMap for Permuted {
    const OUTPUTS: Outputs = Outputs {
        ports: [Port::E, Port::D],
        channels: [
            Some(Lines::new(Port::D, 15, 0)),
            Some(Lines::new(Port::E, 3, 2)),
            Some(Lines::new(Port::D, 7, 12)),
            Some(Lines::new(Port::E, 15, 1)),
            Some(Lines::new(Port::E, 0, 14)),
            Some(Lines::new(Port::D, 6, 5)),
            Some(Lines::new(Port::E, 4, 5)),
            Some(Lines::new(Port::D, 1, 8)),
            Some(Lines::new(Port::E, 13, 6)),
            Some(Lines::new(Port::D, 14, 13)),
        ],
        sync: Pin::new(Port::D, 4),
        pump: Pump::Driven(Pin::new(Port::D, 9)),
    };
}

/// A fictitious breadboard: five channels, no pump.
struct Sparse;

impl PinMap for Sparse {
    const OUTPUTS: Outputs = Outputs {
        ports: [Port::B, Port::C],
        channels: [
            None,
            Some(Lines::new(Port::C, 2, 3)),
            None,
            Some(Lines::new(Port::C, 6, 7)),
            None,
            None,
            Some(Lines::new(Port::B, 8, 7)),
            None,
            None,
            Some(Lines::new(Port::B, 13, 14)),
        ],
        sync: Pin::new(Port::B, 15),
        pump: Pump::Input(Pin::new(Port::B, 10)),
    };
}

/// Returns the bits of [`Levels`] that have a line on the board.
fn lines_of<M: PinMap>() -> u32 {
    let channels = M::OUTPUTS.channels.iter().enumerate();
    let present = channels.filter(|(_, lines)| lines.is_some());
    present.fold(1 << (LINES - 1), |bits, (n, _)| bits | 0b11 << (2 * n))
}

/// Returns the pins of each port that are neither a channel's line nor sync, in both halves of a
/// word. The pump is one of them.
fn other_pins<M: PinMap>() -> [u32; TAPE_PORTS] {
    let outputs = M::OUTPUTS;
    let mut others = [0xFFFF; TAPE_PORTS];
    let lines = outputs.channels.iter().flatten();
    let pins = lines.flat_map(|lines| [lines.cathodic, lines.anodic]);
    for pin in pins.chain([outputs.sync]) {
        others[usize::from(pin.port != outputs.ports[0])] &= !pin.bit();
    }
    others
}

/// Tests all states of all channels, and the effect of each word on each pin.
fn every_channel_state_survives<M: PinMap>() {
    let (present, others) = (lines_of::<M>(), other_pins::<M>());
    for bits in 0..1u32 << LINES {
        let words = words::<M>(Levels(bits));
        assert_eq!(levels::<M>(words), Some(Levels(bits & present)));
        assert_eq!((words[0] | words[0] >> 16) & others[0], 0, "other pins");
        assert_eq!((words[1] | words[1] >> 16) & others[1], 0, "other pins");
    }
    assert_eq!(words::<M>(Levels::ISOLATED), isolated_words::<M>());
    let outputs = M::OUTPUTS;
    for (channel, lines) in outputs.channels.iter().enumerate() {
        let Some(lines) = lines else { continue };
        let states = [
            (State::Isolated, false, false),
            (State::Cathodic, true, false),
            (State::Anodic, false, true),
            (State::Grounded, true, true),
        ];
        for (state, cathodic, anodic) in states {
            let words = words::<M>(Levels::ISOLATED.with_channel(channel, state));
            let mut high = [0; TAPE_PORTS];
            for (pin, is_high) in [(lines.cathodic, cathodic), (lines.anodic, anodic)] {
                let port = usize::from(pin.port != outputs.ports[0]);
                high[port] |= u32::from(is_high) << pin.number;
            }
            assert_eq!(words.map(|word| word & 0xFFFF), high, "{channel} {state:?}");
        }
    }
}

#[test]
fn every_channel_state_survives_the_pin_map() {
    every_channel_state_survives::<BoardPins>();
}

#[test]
fn every_channel_state_survives_another_pin_map() {
    every_channel_state_survives::<Permuted>();
    every_channel_state_survives::<Sparse>();
}

#[test]
fn an_incomplete_word_has_no_levels() {
    let [first, second] = words::<Permuted>(Levels::GROUNDED);
    assert_eq!(levels::<Permuted>([first & !1, second]), None);
    assert_eq!(levels::<Permuted>([first, second | 1 << 31]), None);
}

fn painting_gives_the_plan_back<M: PinMap>() {
    let mut plan = WindowPlan::new();
    let driven = Levels::ISOLATED
        .with_channel(3, State::Cathodic)
        .with_channel(8, State::Anodic);
    plan.reset(Micros::new(0), Levels::GROUNDED);
    plan.pump = true;
    for (slot, levels) in [(7, driven), (207, Levels::ISOLATED)] {
        plan.changes.push(Change { slot, levels }).unwrap();
    }
    let [mut first, mut second] = isolated_words::<M>().map(|word| [word; SLOTS]);
    let mut window = Window {
        first: &mut first,
        second: &mut second,
    };
    paint::<M>(&plan, &mut window);
    for slot in 0..SLOTS {
        let expected = match slot {
            0..7 => Levels::GROUNDED,
            7..207 => driven,
            _ => Levels::ISOLATED,
        };
        let words = [first[slot], second[slot]];
        let expected = Levels(expected.0 & lines_of::<M>());
        assert_eq!(levels::<M>(words), Some(expected), "slot {slot}");
        let pump = M::OUTPUTS.pump.pin();
        let word = words[usize::from(pump.port != M::OUTPUTS.ports[0])];
        let edge = pump.bit() << if slot % (2 * PUMP_SLOTS) == 0 { 0 } else { 16 };
        let is_edge = M::OUTPUTS.pump.is_driven() && slot % PUMP_SLOTS == 0;
        assert_eq!(
            word & (pump.bit() * 0x1_0001),
            if is_edge { edge } else { 0 }
        );
    }
}

#[test]
fn painting_an_erased_window_gives_the_plan_back() {
    painting_gives_the_plan_back::<BoardPins>();
}

#[test]
fn painting_by_another_pin_map_gives_the_plan_back() {
    painting_gives_the_plan_back::<Permuted>();
}

#[test]
fn a_breadboard_plays_its_own_channels_and_no_pump() {
    painting_gives_the_plan_back::<Sparse>();
}
