//! Compile-time checks of rules for every board.

use super::pins::{Pin, Port};
use super::{
    BANKS, BOARD_NAME, CHANNELS, Clocks, DacOutput, Dacs, Inputs, Outputs, TapeStreams, Wiring,
};

/// Fails the build if `board` cannot work.
pub(super) const fn check(board: &Wiring) {
    check_clocks(&board.clocks);
    let (pins, count) = board.pins();
    check_pins(pins.split_at(count).0);
    check_outputs(&board.outputs);
    check_streams(&board.streams);
    check_inputs(&board.inputs);
    check_dacs(&board.dacs);
    assert!(board.stages.are_banked(), "a channel's bank is 0 to 5");
    assert!(
        board.breadboard.is_none() == board.outputs.pump.is_driven(),
        "a board drives the pump, a breadboard never does"
    );
    assert!(
        matches!(board.name.len(), 1..=BOARD_NAME) && board.name.is_ascii(),
        "a board's name has 1 to 16 ASCII characters"
    );
    assert!(
        board.product.len() <= 31 && board.product.is_ascii(),
        "a product's name fits the buffer of USB's string descriptors"
    );
}

/// Fails the build if a user who wires `board` as documented closes the strap of `image`'s board: an
/// image for another board must find its strap open.
pub(super) const fn check_pair(image: &Wiring, board: &Wiring) {
    let (Some(own), Some(other)) = (&image.breadboard, &board.breadboard) else {
        return;
    };
    let inputs = &board.inputs;
    assert!(
        !own.strap.is(other.strap)
            && !own.strap.is(inputs.hand_stop)
            && !own.strap.is(inputs.trigger.pin),
        "a breadboard's strap is no pin that another breadboard's user drives"
    );
}

/// Checks the limits of crystal and PLL (DS8626, PLL characteristics; RM0090 sections 7.2.1, 7.3.2
/// and 7.3.3).
const fn check_clocks(clocks: &Clocks) {
    assert!(
        clocks.crystal_hz.is_multiple_of(1_000_000) && matches!(clocks.crystal_mhz(), 4..=26),
        "the crystal has a whole number of MHz, 4 to 26"
    );
    assert!(
        clocks.crystal_hz.is_multiple_of(clocks.divider)
            && matches!(clocks.vco_input_hz(), 1_000_000..=2_000_000),
        "the VCO's input has 1 to 2 MHz"
    );
    assert!(
        matches!(clocks.vco_hz(), 100_000_000..=432_000_000),
        "the VCO has 100 to 432 MHz"
    );
    assert!(
        matches!(clocks.core_divider, 2 | 4 | 6 | 8) && matches!(clocks.usb_divider, 2..=15),
        "PLLP is 2, 4, 6 or 8, PLLQ 2 to 15"
    );
    assert!(
        clocks.core_hz() <= 168_000_000,
        "the core has at most 168 MHz"
    );
    assert!(
        clocks.core_hz().is_multiple_of(1_000_000),
        "a microsecond has a whole number of cycles"
    );
    assert!(clocks.usb_hz() == 48_000_000, "USB has 48 MHz");
}

/// Pins that every board needs for USB and the debugger.
const TAKEN: [Pin; 6] = [
    Pin::new(Port::A, 9),
    Pin::new(Port::A, 11),
    Pin::new(Port::A, 12),
    Pin::new(Port::A, 13),
    Pin::new(Port::A, 14),
    Pin::new(Port::B, 3),
];

const fn check_pins(pins: &[Pin]) {
    let mut n = 0;
    while n < pins.len() {
        let mut other = n + 1;
        while other < pins.len() {
            assert!(!pins[n].is(pins[other]), "a pin is used twice");
            other += 1;
        }
        other = 0;
        while other < TAKEN.len() {
            assert!(
                !pins[n].is(TAKEN[other]),
                "PA9, PA11 to PA14 and PB3 are USB's and the debugger's"
            );
            other += 1;
        }
        n += 1;
    }
}

const fn check_outputs(outputs: &Outputs) {
    let [first, second] = outputs.ports;
    assert!(first as u8 != second as u8, "the tape plays two ports");
    let mut n = 0;
    while n < CHANNELS {
        let Some(lines) = outputs.channels[n] else {
            n += 1;
            continue;
        };
        assert!(
            lines.cathodic.is_on(lines.anodic.port),
            "both lines of a channel move at once: they are on one port"
        );
        assert!(
            lines.anodic.is_on(first) || lines.anodic.is_on(second),
            "a channel's lines are on the ports that the tape plays"
        );
        n += 1;
    }
    assert!(
        outputs.sync.is_on(first) || outputs.sync.is_on(second),
        "sync out is on a port that the tape plays"
    );
    assert!(
        !outputs.pump.is_driven()
            || outputs.pump.pin().is_on(first)
            || outputs.pump.pin().is_on(second),
        "the pump is on a port that the tape plays"
    );
}

/// Checks that the streams match TIM1's requests on DMA2's channel 6 (RM0090 table 43).
const fn check_streams(streams: &TapeStreams) {
    let [update, channel_1] = streams.play;
    let [channel_2, channel_3] = streams.erase;
    assert!(
        streams.channel == 6
            && update == 5
            && matches!(channel_1, 1 | 3)
            && channel_2 == 2
            && channel_3 == 6,
        "no such requests of TIM1 on these streams of DMA2"
    );
}

const fn check_dacs(dacs: &Dacs) {
    let (mut used, mut n) = ([0u32; 2], 0);
    while n < CHANNELS + BANKS {
        let DacOutput { dac, output } = if n < CHANNELS {
            dacs.channels[n]
        } else {
            dacs.trips[n - CHANNELS]
        };
        assert!(
            used[dac as usize] & 1 << output == 0,
            "an output of a DAC is used twice"
        );
        used[dac as usize] |= 1 << output;
        n += 1;
    }
}

const fn check_inputs(inputs: &Inputs) {
    let port = inputs.arm.port;
    assert!(
        inputs.over_current.is_on(port)
            && inputs.hand_stop.is_on(port)
            && inputs.trigger.pin.is_on(port),
        "arm key, over-current, hand-held stop and trigger are on one port"
    );
    assert!(
        matches!(inputs.over_current.number, 5..=9),
        "over-current interrupts by EXTI9_5: its pin is 5 to 9"
    );
    assert!(
        inputs.trigger.pin.is_on(Port::A)
            && matches!(inputs.trigger.pin.number, 0 | 5 | 15)
            && inputs.trigger.function == 1,
        "the trigger is TIM2_CH1: PA0, PA5 or PA15, alternate function 1"
    );
    assert!(
        inputs.angle.channel < 10 && inputs.current.channel < 10,
        "angle and current are on inputs 0 to 9 of ADC1"
    );
}
