//! Boards as people see them: the names of the pins on the headers, and how to enter the boot loader.
//! The use of each pin comes from the firmware's wiring.

use firmware::board::wiring::{Pin, Port, Wiring};
use host_core::run::Board;

/// Description of a board for its user, beside the wiring.
#[derive(Clone, Copy, Debug)]
pub struct Pack {
    /// Full name, by which shops list it.
    pub title: &'static str,
    /// Steps that start the boot loader of the chip.
    pub boot_loader: &'static str,
    /// Properties that matter for the wiring, one sentence each.
    pub notes: &'static [&'static str],
}

/// Polarity of an LED at an output.
const LED: &str = "LED: anode (long leg) through 1 kOhm to the pin, cathode to GND.";
/// Places of supply and ground on the headers.
const SUPPLY: &str = "3.3 V is a header pin labelled 3V3 (or 3.3V, 3V), ground one labelled GND.";

/// Returns what is known of `board`.
#[must_use]
pub const fn pack(board: Board) -> Pack {
    match board {
        Board::Reference => Pack {
            title: "reference board with output stages (docs/reference/hardware.md; nobody has built one)",
            boot_loader: "use a debug probe: cargo program",
            notes: &["Wearers may be connected only after all of docs/reference/hardware.md."],
        },
        Board::Weact => Pack {
            title: "WeAct Studio 64-pin core board, STM32F405RGT6",
            boot_loader: "hold button B0, press and release button NR, release button B0",
            notes: &[
                LED,
                SUPPLY,
                "Leave the card socket empty: its lines are channel 5 and the DACs' lines.",
                "Connect the hand-held stop's switch without a resistor: the card socket pulls A8 \
                 down by 10 kOhm.",
                "The key and the debug header are not used.",
            ],
        },
        Board::Feather => Pack {
            title: "Adafruit Feather STM32F405 Express, product 4382",
            boot_loader: "connect pin B0 (BOOT0) to 3.3 V, press reset, disconnect pin B0",
            notes: &[
                LED,
                SUPPLY,
                "Channels 1, 5, 6, 7 and 9 have no pins: they belong to the NeoPixel, the LED and \
                 the flash, or have no header.",
                "Leave the card socket and the STEMMA connector empty.",
                "SDA, a line of channel 8, has a pull-up of 10 kOhm: the line is high during reset \
                 and in the boot loader.",
                "There is no pin for a joint sensor.",
            ],
        },
    }
}

/// Returns the name of a pin on the board's headers; `None` if it is on none.
#[must_use]
pub fn header(board: Board, pin: Pin) -> Option<String> {
    match board {
        // The headers of the WeAct board name a pin by port and number.
        Board::Reference => Some(chip_name(pin)),
        Board::Weact => Some(chip_name(pin).trim_start_matches('P').to_owned()),
        Board::Feather => feather(pin).map(str::to_owned),
    }
}

/// Headers of the Feather (the maker's schematic and silkscreen).
const fn feather(pin: Pin) -> Option<&'static str> {
    Some(match (pin.port, pin.number) {
        (Port::A, 4) => "A0",
        (Port::A, 5) => "A1",
        (Port::A, 6) => "A2",
        (Port::A, 7) => "A3",
        (Port::B, 6) => "SCL",
        (Port::B, 7) => "SDA",
        (Port::B, 8) => "9",
        (Port::B, 9) => "10",
        (Port::B, 10) => "TX",
        (Port::B, 11) => "RX",
        (Port::B, 13) => "SCK",
        (Port::B, 14) => "MI",
        (Port::B, 15) => "MO",
        (Port::C, 1) => "13",
        (Port::C, 2) => "12",
        (Port::C, 3) => "11",
        (Port::C, 4) => "A4",
        (Port::C, 5) => "A5",
        (Port::C, 6) => "6",
        (Port::C, 7) => "5",
        _ => return None,
    })
}

/// Returns the chip's name of a pin, such as PA4.
#[must_use]
pub fn chip_name(pin: Pin) -> String {
    format!("P{:?}{}", pin.port, pin.number)
}

/// Kind of connection, which has a colour in the picture.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Connection {
    /// A line of a channel, or sync: an LED with a resistor, or an analyser.
    Output,
    /// A wire or a switch to 3.3 V.
    Supply,
    /// A signal that somebody else drives.
    Signal,
    /// Nothing may be connected.
    Open,
}

/// One row of a board's pin table.
#[derive(Clone, Debug)]
pub struct Row {
    /// Use of the pin.
    pub usage: String,
    /// Chip's name of the pin.
    pub chip: String,
    /// Name on the header; `None` if the pin is on none.
    pub header: Option<String>,
    /// Kind of connection.
    pub connection: Connection,
    /// Part or instrument that the pin is wired to.
    pub wire: &'static str,
}

/// Parts and instruments at the pins of a board.
struct Wires {
    /// Hand-held stop.
    stop: &'static str,
    /// Lines of the channels.
    line: &'static str,
    /// Sync output.
    sync: &'static str,
    /// Trigger input.
    trigger: &'static str,
    /// Joint sensor.
    angle: &'static str,
    /// Arm key.
    arm: &'static str,
    /// Over-current input.
    over_current: &'static str,
    /// Line that switches the high voltage of the output stages.
    pump: &'static str,
}

/// Texts for boards without output stages.
const BREADBOARD: Wires = Wires {
    stop: "switch to 3.3 V; open stops",
    line: "LED and 1 kOhm to GND, or analyser",
    sync: "analyser",
    trigger: "pulses of 3.3 V (optional)",
    angle: "0 to 3.3 V (optional)",
    arm: "leave open",
    over_current: "leave open: high at start is fault 24",
    pump: "leave open: an input",
};

/// Wires of the reference board (docs/reference/hardware.md, pins).
const REFERENCE: Wires = Wires {
    stop: "10 kOhm to 3.3 V by its contact",
    line: "its output stage; 10 kOhm to GND",
    sync: "isolator; 10 kOhm to GND",
    trigger: "isolator; 10 kOhm to GND",
    angle: "0 to 3.3 V; filter, clamp",
    arm: "10 kOhm to 3.3 V through the key",
    over_current: "latches: low = latched or cable off",
    pump: "detector of HV switch; 10 kOhm to GND",
};

/// Returns the pin table of a board, in the order in which people wire it.
#[must_use]
pub fn rows(board: Board) -> Vec<Row> {
    let wires = match board {
        Board::Reference => REFERENCE,
        Board::Weact | Board::Feather => BREADBOARD,
    };
    let wiring: Wiring = board.pins();
    let mut rows = Vec::new();
    let mut add = |usage: String, pin: Pin, connection: Connection, wire: &'static str| {
        rows.push(Row {
            usage,
            chip: chip_name(pin),
            header: header(board, pin),
            connection,
            wire,
        });
    };
    let is_breadboard = wiring.breadboard.is_some();
    // The reference board holds the strap of a breadboard low, so that its image starts nothing.
    let strap = match wiring.breadboard {
        Some(breadboard) => Some((breadboard.strap, Connection::Supply, "wire to 3.3 V")),
        None => Board::Weact.pins().breadboard.map(|weact| {
            let wire = "10 kOhm to GND: not a breadboard";
            (weact.strap, Connection::Open, wire)
        }),
    };
    if let Some((pin, connection, wire)) = strap {
        add("strap".to_owned(), pin, connection, wire);
    }
    let inputs = &wiring.inputs;
    let stop = "hand-held stop".to_owned();
    add(stop, inputs.hand_stop, Connection::Supply, wires.stop);
    for (n, lines) in wiring.outputs.channels.iter().enumerate() {
        let Some(lines) = lines else { continue };
        for (direction, pin) in [("cathodic", lines.cathodic), ("anodic", lines.anodic)] {
            let usage = format!("channel {} {direction}", n + 1);
            add(usage, pin, Connection::Output, wires.line);
        }
    }
    let open = match is_breadboard {
        true => Connection::Open,
        false => Connection::Signal,
    };
    let (sync, trigger) = (wiring.outputs.sync, inputs.trigger.pin);
    add("sync".to_owned(), sync, Connection::Output, wires.sync);
    let signal = Connection::Signal;
    add("trigger".to_owned(), trigger, signal, wires.trigger);
    let angle = "joint sensor".to_owned();
    add(angle, inputs.angle.pin, signal, wires.angle);
    if !is_breadboard {
        let wire = "0 to 3.3 V for 0 to 120 mA; clamp";
        add("current sense".to_owned(), inputs.current.pin, signal, wire);
    }
    add("arm key".to_owned(), inputs.arm, open, wires.arm);
    let over_current = "over-current".to_owned();
    add(over_current, inputs.over_current, open, wires.over_current);
    let pump = wiring.outputs.pump.pin();
    add("pump".to_owned(), pump, open, wires.pump);
    rows
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    /// Every pin that a person has to connect is on a header, and no header is named twice.
    #[test]
    fn what_must_be_connected_can_be() {
        for board in [Board::Weact, Board::Feather] {
            let rows = rows(board);
            for row in &rows {
                if matches!(row.connection, Connection::Supply | Connection::Output) {
                    assert!(row.header.is_some(), "{}: {}", board.name(), row.usage);
                }
            }
            let headers: Vec<_> = rows.iter().filter_map(|row| row.header.clone()).collect();
            let unique: BTreeSet<_> = headers.iter().cloned().collect();
            assert_eq!(unique.len(), headers.len(), "{headers:?}");
        }
        let lines = |board| {
            let rows = rows(board).into_iter();
            rows.filter(|row| row.usage.starts_with("channel")).count()
        };
        assert_eq!((lines(Board::Weact), lines(Board::Feather)), (20, 10));
    }
}
