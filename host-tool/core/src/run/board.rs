//! Boards for which there is an image.

#[cfg(feature = "chip")]
use hal_sim::chip::board::wiring::{self, Wiring};
#[cfg(feature = "images")]
use hal_sim::images::Image;

/// A board for which there is an image.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Board {
    /// The reference board, with output stages (docs/reference/hardware.md).
    #[default]
    Reference,
    /// WeAct Studio's 64-pin core board with an STM32F405RGT6, as a breadboard.
    Weact,
    /// Adafruit's Feather STM32F405 Express, as a breadboard.
    Feather,
}

impl Board {
    /// Every board, the reference board first.
    pub const ALL: [Self; 3] = [Self::Reference, Self::Weact, Self::Feather];

    /// Returns the name by which `--board` selects it.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Reference => "reference",
            Self::Weact => "weact",
            Self::Feather => "feather",
        }
    }

    /// Returns the name that the board's image reports in `Hello`.
    #[must_use]
    pub const fn reported_name(self) -> &'static str {
        self.pins().name
    }

    /// Returns the board's wiring as the firmware has it.
    #[must_use]
    pub const fn pins(self) -> firmware::board::wiring::Wiring {
        match self {
            Self::Reference => firmware::board::wiring::FLEXOR_F405,
            Self::Weact => firmware::board::wiring::WEACT_F405,
            Self::Feather => firmware::board::wiring::FEATHER_F405,
        }
    }

    /// Returns the board's image.
    #[cfg(feature = "images")]
    #[must_use]
    pub const fn image(self) -> Image {
        match self {
            Self::Reference => Image::Stimulator,
            Self::Weact => Image::BreadboardWeact,
            Self::Feather => Image::BreadboardFeather,
        }
    }

    /// Returns the board's wiring as the simulator has it.
    #[cfg(feature = "chip")]
    #[must_use]
    pub const fn wiring(self) -> &'static Wiring {
        match self {
            Self::Reference => &wiring::REFERENCE,
            Self::Weact => &wiring::WEACT,
            Self::Feather => &wiring::FEATHER,
        }
    }
}

#[cfg(all(test, feature = "chip"))]
mod tests {
    use super::*;

    /// The firmware and the simulator have tables of their own; crystal and lines must agree here
    /// only because both describe the same board.
    #[test]
    fn both_tables_describe_the_same_board() {
        for board in Board::ALL {
            let (pins, wiring) = (board.pins(), board.wiring());
            assert_eq!(board.name(), wiring.name);
            assert_eq!(pins.clocks.crystal_hz, wiring.crystal_hz);
            assert_eq!(pins.breadboard.is_some(), wiring.is_breadboard());
            let present = pins.outputs.channels.map(|lines| lines.is_some());
            assert_eq!(present, wiring.lines.map(|lines| lines.is_some()));
        }
    }
}
