//! WeAct Studio's 64-pin core board with an STM32F405RGT6, as a breadboard: docs/guides/breadboard.md, from
//! the maker's schematic, versions 1.0 and 1.1.
//!
//! All ten channels are where the reference board has them. The card socket must be empty: PC8 to
//! PC12 and PD2 are its lines. Its card detect pulls PA8, the hand-held stop, low by 10 kΩ.

use super::clocks::Clocks;
use super::outputs::{Outputs, Pump};
use super::pins::Port::{A, B};
use super::pins::{Inputs, Pin};
use super::{Breadboard, FLEXOR_F405, Led, Wiring};

/// Ten channels; a crystal of 8 MHz, as on the reference board.
pub const WEACT_F405: Wiring = Wiring {
    name: "weact-f405",
    product: "Flexor breadboard weact-f405",
    breadboard: Some(Breadboard {
        strap: Pin::new(A, 4),
        led: Led {
            pin: Pin::new(B, 2),
            is_active_high: true,
        },
    }),
    senses_vbus: false,
    clocks: Clocks {
        crystal_hz: 8_000_000,
        ..FLEXOR_F405.clocks
    },
    outputs: Outputs {
        pump: Pump::Input(Pin::new(B, 10)),
        ..FLEXOR_F405.outputs
    },
    inputs: Inputs {
        spare: [Some(Pin::new(A, 5)), None],
        ..FLEXOR_F405.inputs
    },
    ..FLEXOR_F405
};
