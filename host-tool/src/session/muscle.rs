//! `[channel.muscle]`: its force model, its recruitment, how it tires, and
//! which rung of the ladder predicts its force.

use firmware::muscle::{
    CalciumForceSpec, FatigueSpec, LadderError, MuscleSpec, OutOfRange, Parameter, RecruitmentSpec,
    Rung,
};
use firmware::units::Amplitude;

use super::error::{Problem, SessionError};
use super::table::Table;

/// The muscle under a channel.
#[derive(Clone, PartialEq, Debug)]
pub struct Muscle {
    /// Its force model.
    pub force: CalciumForceSpec,
    /// How amplitude recruits it, up to the channel's limit.
    pub recruitment: RecruitmentSpec,
    /// How it tires, if the file says so.
    pub fatigue: Option<FatigueSpec>,
    /// Which rung it starts on.
    pub model: Model,
    /// What `"auto"` comes to in this session; see [`super::scene`].
    pub auto: Rung,
    /// Later rungs, each from its µs after the start on, rising.
    pub changes: Vec<(u64, Rung)>,
}

/// What a file says of a muscle's rung.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Model {
    /// The lowest that is good enough.
    Auto,
    /// This one.
    Fixed(Rung),
}

impl Muscle {
    /// The rung that the muscle starts on.
    #[must_use]
    pub const fn rung(&self) -> Rung {
        match self.model {
            Model::Auto => self.auto,
            Model::Fixed(rung) => rung,
        }
    }

    /// The muscle as the device gets it.
    #[must_use]
    pub const fn spec(&self) -> MuscleSpec {
        MuscleSpec {
            force: self.force,
            recruitment: self.recruitment,
            fatigue: self.fatigue,
            rung: self.rung(),
        }
    }
}

/// A rung's name in a file.
const RUNGS: [(&str, Rung); 4] = [
    ("static", Rung::Static),
    ("lag", Rung::Lag),
    ("calcium-force", Rung::CalciumForce),
    ("calcium-force-fatigue", Rung::CalciumForceFatigue),
];

/// Reads a `muscle` table; the recruitment curve ends at the channel's limit,
/// changes of rung end with the session.
pub(super) fn read_muscle(
    t: &Table<'_>,
    channel: &Table<'_>,
    limit: Amplitude,
    duration_us: u64,
) -> Result<Muscle, SessionError> {
    t.only(&[
        "a_n_per_s",
        "k",
        "tau_c_ms",
        "tau1_ms",
        "tau2_ms",
        "motor_threshold",
        "reference",
        "slope_per_unit",
        "fatigue",
        "model",
        "changes",
    ])?;
    let force = CalciumForceSpec {
        a_mn_per_s: t.whole("a_n_per_s", 3)?.required()?,
        k_micro: t.whole("k", 6)?.required()?,
        tau_c_us: t.whole("tau_c_ms", 3)?.required()?,
        tau1_us: t.whole("tau1_ms", 3)?.required()?,
        tau2_us: t.whole("tau2_ms", 3)?.required()?,
    };
    let recruitment = RecruitmentSpec {
        motor_threshold: Amplitude(t.whole("motor_threshold", 3)?.required()?),
        limit,
        reference: Amplitude(t.whole("reference", 3)?.required()?),
        slope_micro: t.whole("slope_per_unit", 6)?.required()?,
    };
    let fatigue = t.table("fatigue")?.optional();
    let mut muscle = Muscle {
        force,
        recruitment,
        fatigue: fatigue
            .as_ref()
            .map(|f| read_fatigue(f, force.a_mn_per_s))
            .transpose()?,
        model: Model::Auto,
        // Until the whole session is read.
        auto: Rung::CalciumForce,
        changes: Vec::new(),
    };
    let refused = |e| muscle_error(t, channel, fatigue.as_ref().unwrap_or(t), e);
    muscle.spec().validate().map_err(refused)?;
    let models: Vec<_> = std::iter::once(("auto", Model::Auto))
        .chain(RUNGS.map(|(name, rung)| (name, Model::Fixed(rung))))
        .collect();
    muscle.model = t.choice("model", &models)?.or(Model::Auto);
    can_be(t, "model", &muscle, muscle.rung())?;
    muscle.changes = read_changes(t, &muscle, duration_us)?;
    Ok(muscle)
}

/// Reads `fatigue`; what is left out is the quadriceps', scaled to A.
fn read_fatigue(t: &Table<'_>, a_mn_per_s: u32) -> Result<FatigueSpec, SessionError> {
    t.only(&[
        "alpha_a_per_s2",
        "alpha_k_per_n_s",
        "alpha_tau1_per_n",
        "tau_fat_s",
    ])?;
    let scaled = FatigueSpec::scaled_to(a_mn_per_s);
    Ok(FatigueSpec {
        alpha_a_milli_per_s2: t
            .whole("alpha_a_per_s2", 3)?
            .or(scaled.alpha_a_milli_per_s2),
        alpha_k_nano_per_n_s: t
            .whole("alpha_k_per_n_s", 9)?
            .or(scaled.alpha_k_nano_per_n_s),
        alpha_tau1_nano_per_n: t
            .whole("alpha_tau1_per_n", 9)?
            .or(scaled.alpha_tau1_nano_per_n),
        tau_fat_ms: t.whole("tau_fat_s", 3)?.or(scaled.tau_fat_ms),
    })
}

fn read_changes(
    t: &Table<'_>,
    muscle: &Muscle,
    duration_us: u64,
) -> Result<Vec<(u64, Rung)>, SessionError> {
    let mut changes: Vec<(u64, Rung)> = Vec::new();
    for item in t.tables("changes")?.or(Vec::new()) {
        item.only(&["at_s", "model"])?;
        let end = duration_us as i64; // at most a day
        let at_us = item.within("at_s", 6, 1, end)?.required()? as u64; // not negative
        let rung = item.choice("model", &RUNGS)?.required()?;
        can_be(&item, "model", muscle, rung)?;
        if let Some(&(before, _)) = changes.last()
            && at_us <= before
        {
            let problem = Problem::NotInOrder {
                field: item.path_of("at_s"),
                given: item.given("at_s"),
                after: format!("the change at {} s", before as f64 / 1e6),
            };
            return Err(item.error("at_s", problem));
        }
        changes.push((at_us, rung));
    }
    Ok(changes)
}

/// Refuses the rung that tires where nothing says how.
fn can_be(t: &Table<'_>, name: &str, muscle: &Muscle, rung: Rung) -> Result<(), SessionError> {
    if rung == Rung::CalciumForceFatigue && muscle.fatigue.is_none() {
        let field = t.path_of(name);
        return Err(t.error(name, Problem::NoFatigue { field }));
    }
    Ok(())
}

fn muscle_error(
    t: &Table<'_>,
    channel: &Table<'_>,
    fatigue: &Table<'_>,
    e: LadderError,
) -> SessionError {
    let LadderError::Range(OutOfRange {
        parameter,
        min,
        max,
        ..
    }) = e
    else {
        let field = t.path_of("model");
        return t.error("model", Problem::NoFatigue { field });
    };
    let (t, name, places) = match parameter {
        Parameter::A => (t, "a_n_per_s", 3),
        Parameter::K => (t, "k", 6),
        Parameter::TauC => (t, "tau_c_ms", 3),
        Parameter::Tau1 => (t, "tau1_ms", 3),
        Parameter::Tau2 => (t, "tau2_ms", 3),
        Parameter::AlphaA => (fatigue, "alpha_a_per_s2", 3),
        Parameter::AlphaK => (fatigue, "alpha_k_per_n_s", 9),
        Parameter::AlphaTau1 => (fatigue, "alpha_tau1_per_n", 9),
        Parameter::TauFat => (fatigue, "tau_fat_s", 3),
        Parameter::MotorThreshold => (t, "motor_threshold", 3),
        // Full scales stay far below the recruitment curve's own bound, so a
        // limit can only be too low for the threshold.
        Parameter::Limit => {
            let allowed = format!("below the channel's limit of {}", channel.given("limit"));
            return t.out_of_range("motor_threshold", allowed);
        }
        Parameter::Reference => (t, "reference", 3),
        Parameter::Slope => (t, "slope_per_unit", 6),
        // Not a muscle's: a period belongs to force control.
        Parameter::Period | Parameter::ShortestPeriod | Parameter::LongestPeriod => {
            (t, "period_us", 0)
        }
    };
    t.not_within(name, min.into(), max.into(), places)
}
