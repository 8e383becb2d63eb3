//! Groups the phases at an electrode into pulses.

use crate::trace::pulses::MAX_GAP_US;

/// Maximum length of a commanded phase, µs (hardware.md, one-shot).
pub(super) const COMMANDED_US: u64 = 500;
/// Maximum relative difference between the charges of two phases of a pulse, as a fraction of the
/// larger one.
const BALANCED: f64 = 0.05;
/// Time without a second phase after which a pulse counts as having only one, µs. It is long,
/// because the grounding of a member of an isolated group may have to wait for other members.
const ALONE_US: u64 = 5_000;

/// An interval of current in one direction.
#[derive(Clone, Copy, Debug)]
pub(super) struct Phase {
    pub start_us: u64,
    pub sign: i64,
    /// Charge of the phase itself, C, without the charge that the capacitor held before the pulse
    /// and gives back.
    pub charge: f64,
}

/// One or two phases that belong together, and the charge that they leave.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pulse {
    pub start_us: u64,
    pub end_us: u64,
    /// Start of the latest phase, µs.
    pub phase_us: u64,
    /// Direction of the latest phase: 1 anodic, −1 cathodic.
    sign: i64,
    phases: u8,
    /// Sum of the charges of all phases, C.
    pub net: f64,
    /// Largest magnitude of the charge of a phase, C.
    greatest: f64,
    /// Whether a phase was longer than any commanded one.
    pub is_long: bool,
}

impl Pulse {
    /// Creates a pulse whose first phase begins at `t_us`.
    pub const fn new(t_us: u64, sign: i64) -> Self {
        Self {
            start_us: t_us,
            end_us: t_us,
            phase_us: t_us,
            sign,
            phases: 1,
            net: 0.0,
            greatest: 0.0,
            is_long: false,
        }
    }

    /// Returns whether a current of `sign` continues the latest phase after a loss of high voltage,
    /// load or code: the lines have not changed since `lines_us`.
    pub const fn is_interrupted(&self, sign: i64, lines_us: u64) -> bool {
        self.sign == sign && lines_us <= self.phase_us
    }

    /// Returns whether the pulse has no second phase yet.
    pub const fn is_lone(&self) -> bool {
        self.phases == 1
    }

    /// Returns whether a phase of `sign` could be the second phase.
    pub const fn lacks(&self, sign: i64) -> bool {
        self.is_lone() && self.sign != sign
    }

    /// Returns whether a second phase may begin as late as `t_us`, counted from the start of the
    /// pulse: the first phase may have been truncated. A fault that slows or stops a clock can
    /// delay the second phase beyond that.
    pub const fn awaits(&self, t_us: u64) -> bool {
        t_us - self.start_us <= COMMANDED_US + MAX_GAP_US
    }

    /// Begins the second phase at `t_us`.
    pub const fn begin_second(&mut self, t_us: u64) {
        (self.phases, self.phase_us, self.sign) = (2, t_us, -self.sign);
    }

    /// Adds the latest phase, or a part of it, which ends at `t_us`.
    pub fn end_phase(&mut self, t_us: u64, phase: Phase) {
        self.end_us = t_us;
        self.net += phase.charge;
        self.greatest = self.greatest.max(phase.charge.abs());
        self.is_long |= t_us - phase.start_us > COMMANDED_US;
    }

    /// Returns the time without a further phase after which the pulse is over, µs.
    pub const fn max_wait_us(&self) -> u64 {
        match self.phases {
            1 => ALONE_US,
            _ => MAX_GAP_US + 1,
        }
    }

    /// Returns whether the charges of the phases do not balance.
    pub const fn is_cut(&self) -> bool {
        self.net.abs() > BALANCED * self.greatest
    }
}
