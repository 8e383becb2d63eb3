//! `[channel.muscle]`: the force model of a muscle, its recruitment, its fatigue, and the model
//! level that predicts its force.

use firmware::muscle::{CalciumForceSpec, FatigueSpec, MuscleLevel, MuscleSpec, RecruitmentSpec};
use firmware::units::Amplitude;

use super::fields::RUNGS;
use crate::fields::error::Problem;
use crate::fields::table::Table;
use crate::wearer::{Electrode, read_fatigue};

/// Model of the muscle under a channel, with which the device predicts or controls its force.
#[derive(Clone, PartialEq, Debug)]
pub struct Muscle {
    /// Parameters of the model that computes force from the times of the pulses.
    pub force: CalciumForceSpec,
    /// Share of the muscle's fibres that each amplitude activates, up to the channel's limit.
    pub recruitment: RecruitmentSpec,
    /// Fatigue of the muscle; `None` if neither the session file nor the wearer file gives it.
    pub fatigue: Option<FatigueSpec>,
    /// Whether the device reports the predicted force in its telemetry.
    pub report: bool,
    /// Model level at the start, as the file gives it.
    pub model: Model,
    /// Model level that `"auto"` selects in this session. Before the trial that selects it, this is
    /// the most detailed level that the muscle allows.
    pub auto: MuscleLevel,
    /// Later changes of the model level: each level is used from its time on, in µs after the
    /// start. The times rise.
    pub changes: Vec<(u64, MuscleLevel)>,
}

/// Model level of a muscle as the file gives it.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Model {
    /// Cheapest model level that is accurate enough in this session.
    Auto,
    /// Model level that the file prescribes.
    Fixed(MuscleLevel),
}

/// Names of the fields whose values come from the wearer file if the session file leaves them out.
const PARAMETERS: [&str; 8] = [
    "a_n_per_s",
    "k",
    "tau_c_ms",
    "tau1_ms",
    "tau2_ms",
    "motor_threshold",
    "reference",
    "slope_per_unit",
];

/// Returns the name of a model level in session files, for example "calcium-force".
#[must_use]
pub fn level_name(level: MuscleLevel) -> &'static str {
    let named = RUNGS.iter().find(|(_, known)| *known == level);
    named.map_or("", |(name, _)| name) // all are there
}

impl Muscle {
    /// Returns the model level at the start: the one that the file fixes, or [`Self::auto`].
    #[must_use]
    pub const fn initial_level(&self) -> MuscleLevel {
        match self.model {
            Model::Auto => self.auto,
            Model::Fixed(level) => level,
        }
    }

    /// Returns the muscle as the device receives it before the start.
    #[must_use]
    pub const fn spec(&self) -> MuscleSpec {
        MuscleSpec {
            force: self.force,
            recruitment: self.recruitment,
            fatigue: self.fatigue,
            level: self.initial_level(),
        }
    }

    /// Returns the muscle once for every model level that it uses: the one at the start and those
    /// of its changes. Each comes with the table of the file that sets the level.
    pub(super) fn specs_by_level<'t>(
        &self,
        t: &'t Table<'t>,
    ) -> impl Iterator<Item = (&'t Table<'t>, MuscleSpec)> {
        let spec = self.spec();
        let changes = self.changes.iter().map(|&(_, level)| level);
        let changes = t.tables("changes").iter().zip(changes);
        let levels = std::iter::once((t, spec.level)).chain(changes);
        levels.map(move |(t, level)| (t, MuscleSpec { level, ..spec }))
    }
}

/// Reads a `muscle` table. The wearer file gives the values that the table leaves out. The
/// recruitment curve ends at `limit`, the channel's limit. Changes of model level must be within
/// `duration_us`.
pub(super) fn read_muscle(
    t: &Table<'_>,
    electrode: Option<&Electrode>,
    limit: Amplitude,
    duration_us: u64,
) -> Option<Muscle> {
    let known =
        electrode.and_then(|electrode| Some((electrode.motor_threshold, electrode.muscle?)));
    let number = |name, file: fn(&CalciumForceSpec) -> u32| {
        t.integer_or(
            name,
            known.map_or(u32::MAX, |(_, muscle)| file(&muscle.force)),
        )
    };
    let force = CalciumForceSpec {
        a_mn_per_s: number("a_n_per_s", |calcium_force_spec| {
            calcium_force_spec.a_mn_per_s
        }),
        k_micro: number("k", |calcium_force_spec| calcium_force_spec.k_micro),
        tau_c_us: number("tau_c_ms", |calcium_force_spec| calcium_force_spec.tau_c_us),
        tau1_us: number("tau1_ms", |calcium_force_spec| calcium_force_spec.tau1_us),
        tau2_us: number("tau2_ms", |calcium_force_spec| calcium_force_spec.tau2_us),
    };
    let threshold = electrode.map(|electrode| electrode.motor_threshold);
    let amplitude = |name, file: Option<Amplitude>| {
        let file = file.map_or(u32::MAX, Amplitude::get);
        Amplitude::new(t.integer_or(name, file))
    };
    let recruitment = RecruitmentSpec {
        motor_threshold: amplitude("motor_threshold", threshold),
        limit,
        reference: amplitude("reference", known.map(|(_, muscle)| muscle.reference)),
        slope_micro: t.integer_or(
            "slope_per_unit",
            known.map_or(u32::MAX, |(_, muscle)| muscle.slope_micro),
        ),
    };
    let mut missing: Vec<&str> = match known {
        Some(_) => Vec::new(),
        None => PARAMETERS
            .into_iter()
            .filter(|parameter| !t.has(parameter))
            .collect(),
    };
    missing.retain(|name| *name != "motor_threshold" || threshold.is_none());
    for name in &missing {
        t.report(name, Problem::MissingField {});
    }
    if !missing.is_empty() {
        return None;
    }
    let own = known.and_then(|(_, muscle)| muscle.fatigue);
    let fatigue = t.optional_table("fatigue", |f| Some(read_fatigue(f, force.a_mn_per_s)))?;
    let fatigue = fatigue.or(own);
    let changes = read_changes(t, duration_us);
    let model = t.choice("model", &RUNGS).map_or(Model::Auto, Model::Fixed);
    let auto = match fatigue {
        Some(_) => MuscleLevel::CalciumForceFatigue,
        None => MuscleLevel::CalciumForce,
    };
    Some(Muscle {
        force,
        recruitment,
        fatigue,
        report: !t.has("report") || t.flag("report"),
        model,
        auto,
        changes: changes?,
    })
}

/// Reads `changes`, whose times must rise and be within the session.
fn read_changes(t: &Table<'_>, duration_us: u64) -> Option<Vec<(u64, MuscleLevel)>> {
    let mut changes: Vec<(u64, MuscleLevel)> = Vec::new();
    for item in t.tables("changes") {
        let level = item.choice("model", &RUNGS).filter(|_| item.is_valid())?;
        let at_us = item.time("at_s", 1, duration_us)?;
        if let Some(&(before, _)) = changes.last()
            && at_us <= before
        {
            let after = format!("the {} s of the change before it", before as f64 / 1e6);
            item.report_not_after("at_s", after);
            return None;
        }
        changes.push((at_us, level));
    }
    Some(changes)
}
