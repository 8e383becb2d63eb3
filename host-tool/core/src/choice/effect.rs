//! Errors of settings that `[fidelity]` makes coarser, and the choice among them.

/// Error that one setting causes, for instance one telemetry period.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Effect {
    /// The setting: a telemetry period, a period of the control law or a finger's step, µs; an
    /// arm's step, ms; the number of motor units that are simulated for each pool of a hand.
    pub setting: u32,
    /// Error of this setting compared with the finest. It is a share of the range of a force or
    /// angle for telemetry, of the largest true force for an arm in a support, and of the
    /// wanted angle's range for the other settings.
    pub error: f64,
}

/// Returns the coarsest setting for which it and all finer settings have an error of at most
/// `tolerance`. Returns the finest setting if its own error is larger, and `None` if no setting was
/// tried.
#[must_use]
pub fn coarsest(tried: &[Effect], tolerance: f64) -> Option<Effect> {
    let within = tried.iter().take_while(|effect| effect.error <= tolerance);
    within.last().or(tried.first()).copied()
}
