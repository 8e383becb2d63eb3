//! Adafruit's Feather STM32F405 Express, product 4382, as a breadboard: docs/guides/breadboard.md, from the
//! maker's schematic and board files.
//!
//! Five channels have both lines on headers. PC0 is the NeoPixel, PC1 the diode; PB3 to PB5 and PA15
//! belong to its flash; PB12 is connected to ground; PA0 to PA2, PA8, PB0 and PB1 have no header. PA9
//! and PA10 are connected to 3.3 V. The card socket must be empty.

use super::clocks::Clocks;
use super::outputs::{Lines, Outputs, Pump};
use super::pins::Port::{A, B, C};
use super::pins::{Alternate, Analogue, Inputs, Pin};
use super::{Breadboard, FLEXOR_F405, Led, Wiring};

/// Five channels; a crystal of 12 MHz.
pub const FEATHER_F405: Wiring = Wiring {
    name: "feather-f405",
    product: "Flexor breadboard feather-f405",
    breadboard: Some(Breadboard {
        strap: Pin::new(B, 9),
        led: Led {
            pin: Pin::new(C, 1),
            is_active_high: true,
        },
    }),
    senses_vbus: false,
    // 12 MHz / 6 × 168 = 336 MHz.
    clocks: Clocks {
        crystal_hz: 12_000_000,
        divider: 6,
        ..FLEXOR_F405.clocks
    },
    outputs: Outputs {
        channels: [
            None,
            Some(Lines::new(C, 2, 3)),
            Some(Lines::new(C, 4, 5)),
            Some(Lines::new(C, 6, 7)),
            None,
            None,
            None,
            Some(Lines::new(B, 7, 8)),
            None,
            Some(Lines::new(B, 13, 14)),
        ],
        pump: Pump::Input(Pin::new(B, 10)),
        ..FLEXOR_F405.outputs
    },
    inputs: Inputs {
        // PA4 stays open: it is the strap of the other breadboard.
        arm: Pin::new(A, 4),
        over_current: Pin::new(A, 7),
        hand_stop: Pin::new(A, 6),
        trigger: Alternate::new(Pin::new(A, 5), 1), // TIM2_CH1
        angle: Analogue::new(Pin::new(A, 3)),       // half of the battery's voltage
        current: Analogue::new(Pin::new(A, 1)),     // not connected
        spare: [None, None],
    },
    ..FLEXOR_F405
};
