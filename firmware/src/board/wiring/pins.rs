//! Pins, and the input lines.

/// GPIO port of the chip.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[repr(u8)]
pub enum Port {
    /// Port A, 16 pins.
    A,
    /// Port B, 16 pins.
    B,
    /// Port C, 16 pins.
    C,
    /// Port D, 16 pins.
    D,
    /// Port E, in packages of 100 pins or more.
    E,
}

impl Port {
    /// Every port, in ascending order of [`Self::index`].
    pub const ALL: [Self; 5] = [Self::A, Self::B, Self::C, Self::D, Self::E];

    /// Returns 0 for port A, and so on, as RCC and SYSCFG number ports.
    #[must_use]
    pub const fn index(self) -> usize {
        self as usize
    }
}

/// Pin of a GPIO port.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Pin {
    /// Port that has the pin.
    pub port: Port,
    /// Number of the pin in its port, 0–15.
    pub number: u8,
}

impl Pin {
    /// Creates pin `number` of `port`; the build fails from 16 on.
    #[must_use]
    pub const fn new(port: Port, number: u8) -> Self {
        assert!(number < 16, "a port has 16 pins");
        Self { port, number }
    }

    /// Returns the pin's bit in registers with one bit per pin.
    #[must_use]
    pub const fn bit(self) -> u32 {
        1 << self.number
    }

    /// Returns whether both are the same pin.
    pub(super) const fn is(self, other: Self) -> bool {
        self.is_on(other.port) && self.number == other.number
    }

    /// Returns whether the pin belongs to `port`.
    #[must_use]
    pub const fn is_on(self, port: Port) -> bool {
        self.port as u8 == port as u8
    }
}

/// Pin used by a peripheral.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Alternate {
    /// Pin that carries the signal.
    pub pin: Pin,
    /// Number of the alternate function, 0–15 (DS8626 table 9).
    pub function: u8,
}

impl Alternate {
    /// Creates an alternate use of `pin`; the build fails if `function` exceeds 15.
    #[must_use]
    pub const fn new(pin: Pin, function: u8) -> Self {
        assert!(function < 16, "a pin has 16 alternate functions");
        Self { pin, function }
    }
}

/// Pin that ADC1 converts.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Analogue {
    /// Pin that carries the voltage.
    pub pin: Pin,
    /// Number of the ADC's input.
    pub channel: u8,
}

impl Analogue {
    /// Returns `pin` with its input of ADC1 (DS8626 table 7, ADC123_IN).
    #[must_use]
    pub const fn new(pin: Pin) -> Self {
        let (first, pins) = match pin.port {
            Port::A => (0, 8),
            Port::B => (8, 2),
            Port::C => (10, 6),
            Port::D | Port::E => (0, 0),
        };
        assert!(pin.number < pins, "ADC1 has no input on this pin");
        Self {
            pin,
            channel: first + pin.number,
        }
    }
}

/// Input lines. The three safety inputs and the trigger are on one port, so that one read samples
/// all of them at the same instant.
///
/// On every board the low level of a safety input is its safe side: with the cable off, the
/// pull-down reads as "stop".
#[derive(Clone, Copy, Debug)]
pub struct Inputs {
    /// Arm key; high when closed.
    pub arm: Pin,
    /// Over-current latch of the comparators; low when tripped or the cable is off.
    pub over_current: Pin,
    /// Hand-held stop; high when closed, which allows stimulation.
    pub hand_stop: Pin,
    /// Trigger, on its rising edge, at channel 1 of TIM2.
    pub trigger: Alternate,
    /// Input of the joint-angle sensor.
    pub angle: Analogue,
    /// Input of the current sense.
    pub current: Analogue,
    /// Analogue inputs that this image does not read.
    pub spare: [Option<Pin>; 2],
}
