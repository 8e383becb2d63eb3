//! Pins, and the lines that come in.

/// A GPIO port.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[repr(u8)]
pub enum Port {
    /// Port A.
    A,
    /// Port B.
    B,
    /// Port C.
    C,
    /// Port D.
    D,
    /// Port E: packages of 100 pins and more.
    E,
}

impl Port {
    /// Every port.
    pub const ALL: [Self; 5] = [Self::A, Self::B, Self::C, Self::D, Self::E];

    /// 0 for port A, and so on, as RCC and SYSCFG number them.
    #[must_use]
    pub const fn index(self) -> usize {
        self as usize
    }
}

/// A pin of a port.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Pin {
    /// The port.
    pub port: Port,
    /// Number of the pin in its port, 0–15.
    pub number: u8,
}

impl Pin {
    /// Pin `number` of `port`.
    #[must_use]
    pub const fn new(port: Port, number: u8) -> Self {
        assert!(number < 16, "a port has 16 pins");
        Self { port, number }
    }

    /// The pin's bit in registers that have one bit for each pin.
    #[must_use]
    pub const fn bit(self) -> u32 {
        1 << self.number
    }

    /// Whether both are the same pin.
    pub(super) const fn is(self, other: Self) -> bool {
        self.is_on(other.port) && self.number == other.number
    }

    /// Whether the pin is on `port`.
    #[must_use]
    pub const fn is_on(self, port: Port) -> bool {
        self.port as u8 == port as u8
    }
}

/// A pin that a peripheral uses.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Alternate {
    /// The pin.
    pub pin: Pin,
    /// Number of the alternate function, 0–15 (DS8626 table 9).
    pub function: u8,
}

impl Alternate {
    /// `pin` with the alternate function `function`.
    #[must_use]
    pub const fn new(pin: Pin, function: u8) -> Self {
        assert!(function < 16, "a pin has 16 alternate functions");
        Self { pin, function }
    }
}

/// A pin that ADC1 converts.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Analogue {
    /// The pin.
    pub pin: Pin,
    /// Number of the ADC's input.
    pub channel: u8,
}

impl Analogue {
    /// `pin` with its input of ADC1 (DS8626 table 7, ADC123_IN).
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

/// Lines that come in. The three safety inputs and the trigger are on one port, so that one
/// reading takes all of them at one instant.
///
/// The low level of each safety input is its safe side, on every board: with its cable off,
/// the pull-down reads as "stop".
#[derive(Clone, Copy, Debug)]
pub struct Inputs {
    /// Arm key: high is closed.
    pub arm: Pin,
    /// Over-current latch of the comparators: low is tripped, or the cable is off.
    pub over_current: Pin,
    /// Hand-held stop: high is closed, stimulation is allowed.
    pub hand_stop: Pin,
    /// Trigger, rising edge, at channel 1 of TIM2.
    pub trigger: Alternate,
    /// Joint angle.
    pub angle: Analogue,
    /// Current sense.
    pub current: Analogue,
    /// Analogue inputs that this image does not read.
    pub spare: [Pin; 2],
}
