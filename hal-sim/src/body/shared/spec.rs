//! Parameters of a shared muscle and of its electrodes.

use crate::body::CHANNELS;
use crate::body::muscle::Parameters;
use crate::body::muscle::tiring::Fatigue;

/// Error: the value of a field of a [`SharedSpec`] is out of range. Contains the name of the field.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("shared muscle: `{0}` is out of range")]
pub struct InvalidShared(pub &'static str);

/// Recruitment curve of an electrode, and the share of each group of motor units that it can reach.
#[derive(Debug, Clone, PartialEq)]
pub struct Electrode {
    /// Current at which the first units respond, mA, above 0.
    pub threshold_ma: f64,
    /// Current at which all reachable units respond, mA, above the threshold.
    pub full_ma: f64,
    /// Recruitment at the threshold relative to that at `full_ma`: above 0, below 1. Recruitment
    /// between them is exponential (Lee 2020, equations 5 and 6).
    pub foot: f64,
    /// Share of each group that the electrode reaches at `full_ma`, 0 to 1.
    pub reach: Vec<f64>,
}

impl Electrode {
    /// Returns the recruitment at a current, relative to that at `full_ma`, 0 to 1.
    #[must_use]
    pub fn strength(&self, ma: f64) -> f64 {
        let part = (ma - self.threshold_ma) / (self.full_ma - self.threshold_ma);
        match part {
            part if part < 0.0 => 0.0,
            part => libm::pow(self.foot, 1.0 - part.min(1.0)),
        }
    }

    /// Returns the exponent b of Lee 2020's recruitment curve (equation 5), per mA.
    #[must_use]
    pub fn slope_per_ma(&self) -> f64 {
        -libm::log(self.foot) / (self.full_ma - self.threshold_ma)
    }
}

/// Parameters of a muscle and its electrodes.
#[derive(Debug, Clone, PartialEq)]
pub struct SharedSpec {
    /// Force of the whole muscle at a normalised force of 1 of `dynamics`, N; above 0.
    pub strength_n: f64,
    /// Calcium-force dynamics of every unit, with A in 1/s.
    pub dynamics: Parameters,
    /// Fatigue of every unit, for a force normalised to 1.
    pub fatigue: Fatigue,
    /// Share by which a pulse reduces the A of a unit, whatever force it evokes; 0 to below 1.
    pub pulse_takes: f64,
    /// Number of groups of equal size, 1 to 10.
    pub groups: usize,
    /// Number of motor units per group, 1 to 100.
    pub units_per_group: usize,
    /// Electrode of each channel, or `None` for a channel without one.
    pub electrodes: [Option<Electrode>; CHANNELS],
    /// Seed of the order in which each electrode recruits each group.
    pub seed: u64,
}

impl SharedSpec {
    /// Returns the number of motor units of the muscle.
    #[must_use]
    pub const fn units(&self) -> usize {
        self.groups * self.units_per_group
    }

    pub(super) fn check(&self) -> Result<(), InvalidShared> {
        let ensure = |holds: bool, field| {
            if holds {
                Ok(())
            } else {
                Err(InvalidShared(field))
            }
        };
        let is_above = |value: f64| value > 0.0 && value.is_finite();
        ensure(is_above(self.strength_n), "strength_n")?;
        ensure(self.dynamics.all().into_iter().all(is_above), "dynamics")?;
        ensure((0.0..1.0).contains(&self.pulse_takes), "pulse_takes")?;
        ensure((1..=CHANNELS).contains(&self.groups), "groups")?;
        ensure((1..=100).contains(&self.units_per_group), "units_per_group")?;
        ensure(is_above(self.fatigue.tau_fat_s), "tau_fat_s")?;
        for electrode in self.electrodes.iter().flatten() {
            ensure(is_above(electrode.threshold_ma), "threshold_ma")?;
            let span = electrode.full_ma - electrode.threshold_ma;
            ensure(is_above(span), "full_ma")?;
            let foot = electrode.foot;
            ensure(foot > 0.0 && foot < 1.0, "foot")?;
            let is_part = |part: &f64| (0.0..=1.0).contains(part);
            let reach = &electrode.reach;
            let reaches = reach.len() == self.groups && reach.iter().all(is_part);
            ensure(reaches, "reach")?;
        }
        Ok(())
    }
}
