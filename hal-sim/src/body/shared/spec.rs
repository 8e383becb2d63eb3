//! What a shared muscle is, and what its electrodes reach of it.

use crate::body::CHANNELS;
use crate::body::muscle::Parameters;
use crate::body::muscle::tiring::Fatigue;

/// A number that no shared muscle can have; names the field.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("shared muscle: `{0}` is out of range")]
pub struct InvalidShared(pub &'static str);

/// What an electrode does with a current, and what of each group it can reach.
#[derive(Debug, Clone, PartialEq)]
pub struct Electrode {
    /// Where its first units answer, mA, above 0.
    pub threshold_ma: f64,
    /// Where it has all that it reaches, mA, above the threshold.
    pub full_ma: f64,
    /// What answers at the threshold, as a part of what answers at `full_ma`: above 0,
    /// below 1. Between them recruitment is exponential (Lee 2020, equations 5 and 6).
    pub foot: f64,
    /// Part of each group that it reaches at `full_ma`, 0 to 1.
    pub reach: Vec<f64>,
}

impl Electrode {
    /// What a current reaches, as a part of what it reaches at most.
    #[must_use]
    pub fn strength(&self, ma: f64) -> f64 {
        let part = (ma - self.threshold_ma) / (self.full_ma - self.threshold_ma);
        match part {
            part if part < 0.0 => 0.0,
            part => self.foot.powf(1.0 - part.min(1.0)),
        }
    }

    /// b of Lee's equation 5, per mA.
    #[must_use]
    pub fn slope_per_ma(&self) -> f64 {
        -self.foot.ln() / (self.full_ma - self.threshold_ma)
    }
}

/// A muscle and its electrodes.
#[derive(Debug, Clone, PartialEq)]
pub struct SharedSpec {
    /// Force of the whole muscle, N, where `dynamics` give 1; above 0.
    pub strength_n: f64,
    /// Of every unit, its A in 1/s.
    pub dynamics: Parameters,
    /// How every unit tires, of a force of 1.
    pub fatigue: Fatigue,
    /// What a pulse takes of a unit's A whatever force it makes, 0 to below 1.
    pub pulse_takes: f64,
    /// Of equal size, 1 to 10.
    pub groups: usize,
    /// Motor units of each, 1 to 100.
    pub units_per_group: usize,
    /// By channel.
    pub electrodes: [Option<Electrode>; CHANNELS],
    /// Of the order in which each electrode recruits each group.
    pub seed: u64,
}

impl SharedSpec {
    /// Motor units of the muscle.
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
