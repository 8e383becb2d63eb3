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
            Lines::new(Port::D, 15, 0),
            Lines::new(Port::E, 3, 2),
            Lines::new(Port::D, 7, 12),
            Lines::new(Port::E, 15, 1),
            Lines::new(Port::E, 0, 14),
            Lines::new(Port::D, 6, 5),
            Lines::new(Port::E, 4, 5),
            Lines::new(Port::D, 1, 8),
            Lines::new(Port::E, 13, 6),
            Lines::new(Port::D, 14, 13),
        ],
        sync: Pin::new(Port::D, 4),
        pump: Pin::new(Port::D, 9),
    };
}

/// Tests all states of all channels, and the effect of each word on each pin.
fn every_channel_state_survives<M: PinMap>() {
    for bits in 0..1u32 << LINES {
        let words = words::<M>(Levels(bits));
        assert_eq!(levels::<M>(words), Some(Levels(bits)));
    }
    assert_eq!(words::<M>(Levels::ISOLATED), isolated_words::<M>());
    let outputs = M::OUTPUTS;
    for (channel, lines) in outputs.channels.iter().enumerate() {
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
    for words in [words::<M>(Levels::ISOLATED), words::<M>(Levels::GROUNDED)] {
        let port = usize::from(outputs.pump.port != outputs.ports[0]);
        let pump = (words[port] | words[port] >> 16) & outputs.pump.bit();
        assert_eq!(pump, 0, "left alone");
    }
}

#[test]
fn every_channel_state_survives_the_pin_map() {
    every_channel_state_survives::<BoardPins>();
}

#[test]
fn every_channel_state_survives_another_pin_map() {
    every_channel_state_survives::<Permuted>();
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
        assert_eq!(levels::<M>(words), Some(expected), "slot {slot}");
        let port = usize::from(M::OUTPUTS.pump.port != M::OUTPUTS.ports[0]);
        let pump = words[port] & (M::OUTPUTS.pump.bit() * 0x1_0001);
        let edge = M::OUTPUTS.pump.bit() << if slot % (2 * PUMP_SLOTS) == 0 { 0 } else { 16 };
        assert_eq!(pump, if slot % PUMP_SLOTS == 0 { edge } else { 0 });
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
