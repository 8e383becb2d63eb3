//! One fault and what came of it.

use firmware::safety::Fault;

/// What was broken, and what came of it.
#[derive(Clone, Debug)]
pub struct Case {
    /// Its number, from 0: with class and seed, what repeats it.
    pub index: u64,
    /// When, device time in µs.
    pub moment_us: u64,
    /// What, for people.
    pub what: String,
    /// What came of it.
    pub fate: Fate,
}

/// What came of a fault.
#[derive(Clone, Debug, Default)]
pub struct Fate {
    /// The device must find it: it changes an edge, a declaration is false, an electrode
    /// broke in a way that something shows.
    pub must_find: bool,
    /// The device found it: it told a fault, was reset, or refused by the right name.
    pub found: bool,
    /// How long after it the first edge or code differs from what would have been, µs.
    pub changed_us: Option<u64>,
    /// The fault that the device told, or kept through a reset.
    pub fault: Option<Fault>,
    /// The chip was reset.
    pub reset: bool,
    /// How long after it the outputs were isolated for good, µs; nothing where they
    /// were not, or not by a fault.
    pub isolated_us: Option<u64>,
    /// What is severe with the stages as docs/hardware.md builds them.
    pub severe: Vec<String>,
    /// What is severe without what protects, and was not before anything broke.
    pub bare: Vec<String>,
    /// A stage isolated itself.
    pub latched: bool,
    /// Why the simulator could not go on: what it does not model.
    pub stopped: Option<String>,
}

impl Fate {
    /// Whether it is to be looked at.
    #[must_use]
    pub fn is_open(&self) -> bool {
        !self.severe.is_empty() || self.must_find != self.found && self.stopped.is_none()
    }
}
