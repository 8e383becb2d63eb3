//! The reference board, an STM32F405RG (LQFP64): docs/reference/hardware.md, pin map.

use super::Wiring;
use super::clocks::Clocks;
use super::outputs::{DacOutput, Dacs, Lines, Outputs, Pump, Stages, TapeStreams};
use super::pins::Port::{A, B, C, D};
use super::pins::{Alternate, Analogue, Inputs, Pin};

/// Wiring of the reference board. USB on PA9 (VBUS), PA11 (D−) and PA12 (D+), and SWD and SWO on
/// PA13, PA14 and PB3, are the same on every board. PA2 and PA3, USART2, are not used.
pub const FLEXOR_F405: Wiring = Wiring {
    name: "flexor-f405",
    product: "Flexor stimulator",
    breadboard: None,
    senses_vbus: true,
    // 8 MHz / 4 × 168 = 336 MHz; / 2 = 168 MHz for the core, / 7 = 48 MHz for USB.
    clocks: Clocks {
        crystal_hz: 8_000_000,
        divider: 4,
        multiplier: 168,
        core_divider: 2,
        usb_divider: 7,
    },
    outputs: Outputs {
        ports: [B, C],
        channels: [
            Some(Lines::new(C, 0, 1)),
            Some(Lines::new(C, 2, 3)),
            Some(Lines::new(C, 4, 5)),
            Some(Lines::new(C, 6, 7)),
            Some(Lines::new(C, 8, 9)),
            Some(Lines::new(B, 0, 1)),
            Some(Lines::new(B, 5, 6)),
            Some(Lines::new(B, 7, 8)),
            Some(Lines::new(B, 9, 12)),
            Some(Lines::new(B, 13, 14)),
        ],
        sync: Pin::new(B, 15),
        pump: Pump::Driven(Pin::new(B, 10)),
    },
    streams: TapeStreams {
        play: [5, 1],
        erase: [2, 6],
        channel: 6,
    },
    inputs: Inputs {
        arm: Pin::new(A, 6),
        over_current: Pin::new(A, 7),
        hand_stop: Pin::new(A, 8),
        trigger: Alternate::new(Pin::new(A, 15), 1), // TIM2_CH1
        angle: Analogue::new(Pin::new(A, 0)),
        current: Analogue::new(Pin::new(A, 1)),
        spare: [Some(Pin::new(A, 4)), Some(Pin::new(A, 5))],
    },
    dacs: Dacs {
        clock: Alternate::new(Pin::new(C, 10), 6), // SPI3_SCK
        data: Alternate::new(Pin::new(C, 12), 6),  // SPI3_MOSI
        select: [Pin::new(C, 11), Pin::new(D, 2)],
        // Channels 1 to 5 are on the first DAC, 6 to 10 on the second; outputs F to H of each set
        // three banks.
        channels: [
            DacOutput::new(0, 0),
            DacOutput::new(0, 1),
            DacOutput::new(0, 2),
            DacOutput::new(0, 3),
            DacOutput::new(0, 4),
            DacOutput::new(1, 0),
            DacOutput::new(1, 1),
            DacOutput::new(1, 2),
            DacOutput::new(1, 3),
            DacOutput::new(1, 4),
        ],
        trips: [
            DacOutput::new(0, 5),
            DacOutput::new(0, 6),
            DacOutput::new(0, 7),
            DacOutput::new(1, 5),
            DacOutput::new(1, 6),
            DacOutput::new(1, 7),
        ],
    },
    stages: Stages {
        dead_time_us: 5,
        sense_full_scale_ua: 120_000,
        trip_full_scale_ua: 100_000,
        // The first four of a DAC's five stages share two banks in pairs; the last has its own.
        banks: [0, 0, 1, 1, 2, 3, 3, 4, 4, 5],
    },
};

#[cfg(test)]
mod tests {
    use super::*;
    use crate::board::wiring::Bits;

    /// Register values written by hand from RM0090, and not computed by the functions under test.
    #[test]
    fn registers_are_as_the_manual_has_them_for_this_board() {
        let clocks = FLEXOR_F405.clocks;
        assert_eq!(clocks.pllcfgr(), 0x0740_2A04);
        assert_eq!(
            (clocks.core_hz(), clocks.usb_hz()),
            (168_000_000, 48_000_000)
        );
        assert_eq!((clocks.cycles_per_us(), clocks.wait_states()), (168, 5));
        let modes = [
            (A, 0xC003_FF0F, 0x8000_0F0F),
            (B, 0xFF3F_FC0F, 0x5515_5405),
            (C, 0x03FF_FFFF, 0x0265_5555),
            (D, 0x0000_0030, 0x0000_0010),
        ];
        for (port, bits, value) in modes {
            assert_eq!(FLEXOR_F405.modes(port), Bits { bits, value });
        }
        let functions = [
            (A, 0, 0),
            (B, 0, 0),
            (C, 0x000F_0F00, 0x0006_0600),
            (D, 0, 0),
        ];
        for (port, bits, value) in functions {
            assert_eq!(FLEXOR_F405.functions(port, 0), Bits::default());
            if port != A {
                assert_eq!(FLEXOR_F405.functions(port, 1), Bits { bits, value });
            }
        }
        let (bits, value) = (0xF000_0000, 0x1000_0000);
        assert_eq!(FLEXOR_F405.functions(A, 1), Bits { bits, value });
        assert_eq!(
            [B, C].map(|port| FLEXOR_F405.driven(port)),
            [0xF7E3, 0x0BFF]
        );
        let locked = [A, B, C, D].map(|port| FLEXOR_F405.locked(port));
        assert_eq!(locked, [0x81C3, 0xF7E3, 0x1FFF, 0x0004]);
    }
}
