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

/// Returns what is known of `board`.
#[must_use]
pub const fn pack(board: Board) -> Pack {
    match board {
        Board::Reference => Pack {
            title: "reference board with output stages (docs/hardware.md; nobody has built one)",
            boot_loader: "use a debug probe: cargo program",
            notes: &["Wearers may be connected only after all of docs/hardware.md."],
        },
        Board::Weact => Pack {
            title: "WeAct Studio 64-pin core board, STM32F405RGT6",
            boot_loader: "hold B0, press and release NR, release B0",
            notes: &[
                "Leave the card socket empty: its lines are channel 5 and the DACs' lines.",
                "Connect the hand-held stop's switch without a resistor: the card socket pulls A8 \
                 down by 10 kOhm.",
                "The key and the debug header are not used.",
            ],
        },
        Board::Feather => Pack {
            title: "Adafruit Feather STM32F405 Express, product 4382",
            boot_loader: "connect B0 to 3.3V, press reset, disconnect B0",
            notes: &[
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

/// Returns the pin table of a breadboard, in the order in which people wire it.
#[must_use]
pub fn rows(board: Board) -> Vec<Row> {
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
    if let Some(breadboard) = wiring.breadboard {
        let wire = "wire to 3.3 V";
        add(
            "strap".to_owned(),
            breadboard.strap,
            Connection::Supply,
            wire,
        );
    }
    let inputs = &wiring.inputs;
    let stop = "switch to 3.3 V; open stops";
    add(
        "hand-held stop".to_owned(),
        inputs.hand_stop,
        Connection::Supply,
        stop,
    );
    for (n, lines) in wiring.outputs.channels.iter().enumerate() {
        let Some(lines) = lines else { continue };
        let wire = "LED and 1 kOhm to GND, or analyser";
        for (direction, pin) in [("cathodic", lines.cathodic), ("anodic", lines.anodic)] {
            let usage = format!("channel {} {direction}", n + 1);
            add(usage, pin, Connection::Output, wire);
        }
    }
    let wire = "analyser";
    add(
        "sync".to_owned(),
        wiring.outputs.sync,
        Connection::Output,
        wire,
    );
    let signal = "pulses of 3.3 V (optional)";
    add(
        "trigger".to_owned(),
        inputs.trigger.pin,
        Connection::Signal,
        signal,
    );
    let signal = "0 to 3.3 V (optional)";
    add(
        "joint sensor".to_owned(),
        inputs.angle.pin,
        Connection::Signal,
        signal,
    );
    if wiring.breadboard.is_some() {
        let open = "leave open";
        let driven = "leave open: high at start is fault 24";
        add("arm key".to_owned(), inputs.arm, Connection::Open, open);
        add(
            "over-current".to_owned(),
            inputs.over_current,
            Connection::Open,
            driven,
        );
        add(
            "pump".to_owned(),
            wiring.outputs.pump.pin(),
            Connection::Open,
            "leave open: an input",
        );
    }
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
