//! Benchmarks of the muscle models.

use super::{Bench, Checksum, Clock, Random};
use crate::muscle::{
    CalciumForce, CalciumForceSpec, FatigueSpec, Gain, Model, MuscleLevel, MuscleModel,
    MuscleModelState, Recruitment, RecruitmentSpec, TablePlan, TabulatedForce,
};
use crate::units::{Amplitude, Force, Micros, us};
use fixed::types::{I16F16, U1F31};

/// A muscle within the ranges of table 4 of Lee 2020 except for its strength, but not one of that
/// table. The duration of a step hardly depends on the muscle.
pub(super) const FORCE: CalciumForceSpec = CalciumForceSpec {
    a_mn_per_s: 1_007_000,
    k_micro: 177_000,
    tau_c_us: 27_000,
    tau1_us: 26_000,
    tau2_us: 60_000,
};

/// Recruitment from 6 mA to 20 mA.
pub(super) const RECRUITMENT: RecruitmentSpec = RecruitmentSpec {
    motor_threshold: Amplitude::new(6_000),
    limit: Amplitude::new(20_000),
    reference: Amplitude::new(20_000),
    slope_micro: 250_000,
};

/// Length of a tick, µs.
const TICK_US: u32 = 1000;

/// A moving muscle: its state, and the end of its next tick.
#[derive(Clone)]
struct MovingMuscle<M: Model> {
    muscle: M,
    state: M::State,
    to: Micros,
}

impl<M: Model> MovingMuscle<M> {
    fn new(muscle: M) -> Self {
        let to = Micros::new(0);
        let state = muscle.at_rest(to);
        Self { muscle, state, to }
    }

    /// Advances by a millisecond, and returns a random pulse within it.
    fn next(&mut self, random: &mut Random) -> (Micros, Gain) {
        let at = self.to + us(random.between(1, TICK_US));
        self.to += us(TICK_US);
        (at, Gain::new(U1F31::from_bits(random.word() >> 1)))
    }

    fn tick(&mut self) {
        self.muscle.advance(&mut self.state, self.to);
    }

    fn tick_with_pulse(&mut self, (at, gain): (Micros, Gain)) {
        self.muscle.pulse(&mut self.state, at, gain);
        self.tick();
    }

    fn force(&self) -> u32 {
        let force = self.muscle.force(&self.state);
        force.get().to_bits().cast_unsigned()
    }
}

/// A muscle with its table, as the controller runs it.
#[derive(Clone)]
struct TabledMuscle {
    model: MuscleModel,
    table: TabulatedForce,
}

impl Model for TabledMuscle {
    type State = MuscleModelState;
    fn at_rest(&self, at: Micros) -> MuscleModelState {
        let mut state = self.model.at_rest(at);
        if self.model.plan().is_some() {
            self.model.adopt(&self.table, &mut state);
        }
        state
    }
    #[inline(always)]
    fn pulse(&self, state: &mut MuscleModelState, at: Micros, gain: Gain) {
        self.model.pulse_by(&self.table, state, at, gain);
    }
    #[inline(always)]
    fn advance(&self, state: &mut MuscleModelState, to: Micros) {
        self.model.advance_by(&self.table, state, to);
    }
    fn force(&self, state: &MuscleModelState) -> Force {
        let force = self.model.predicted_force(&self.table, state);
        force.unwrap_or_default()
    }
}

pub(super) fn run_benchmarks<C: Clock>(bench: &mut Bench<'_, C>) -> Option<()> {
    let active = MovingMuscle::new(CalciumForce::new(FORCE).ok()?);
    calcium_force(bench, active);
    let table = TabulatedForce::new(&FORCE)?;
    let fatigue = FatigueSpec::scaled_to(FORCE.a_mn_per_s);
    for (level, fatigue, tick, tick_and_pulse) in [
        (
            MuscleLevel::CalciumForce,
            None,
            "rung_tick",
            "rung_tick_and_pulse",
        ),
        (
            MuscleLevel::CalciumForceFatigue,
            Some(fatigue),
            "fatigue_tick",
            "fatigue_tick_and_pulse",
        ),
    ] {
        let climbing = MovingMuscle::new(TabledMuscle {
            model: MuscleModel::new(FORCE, fatigue, level).ok()?,
            table: table.clone(),
        });
        measure_model_level(bench, climbing, tick, tick_and_pulse);
    }
    table_row(bench, table)?;
    recruitment(bench, Recruitment::new(RECRUITMENT).ok()?);
    Some(())
}

/// Measures one row of a table, which the controller solves in one tick.
fn table_row<C: Clock>(bench: &mut Bench<'_, C>, table: TabulatedForce) -> Option<()> {
    let plan = TablePlan::new(&FORCE).ok()?;
    bench.measure(
        "tabulated_row",
        100,
        table,
        |table, random| {
            table.begin(plan);
            for _ in 0..random.between(0, 16) {
                table.solve_next();
            }
        },
        |table, ()| table.solve_next(),
        |_, is_complete, sum| sum.add_word(u32::from(*is_complete)),
    );
    Some(())
}

/// Measures one control tick of an active muscle, without a pulse inside the tick and with one. In
/// the second case every measured tick has a pulse, as at 1 kHz, which no train reaches: a thousand
/// samples, with C near its maximum.
fn calcium_force<C: Clock>(bench: &mut Bench<'_, C>, active: MovingMuscle<CalciumForce>) {
    let digest = |active: &MovingMuscle<CalciumForce>, (): &(), sum: &mut Checksum| {
        sum.add_word(active.muscle.calcium(&active.state).to_bits());
        sum.add_word(active.force());
    };
    bench.measure(
        "calcium_force_tick",
        1000,
        active.clone(),
        |active, random| {
            let (begin, (_, gain)) = (active.to, active.next(random));
            // Every 25 ms a pulse at the beginning of the tick, as in a train at 40 Hz; it is not
            // measured.
            if active.to.get().is_multiple_of(25 * TICK_US) {
                active.muscle.pulse(&mut active.state, begin, gain);
            }
        },
        |active, ()| active.tick(),
        digest,
    );
    bench.measure(
        "calcium_force_tick_and_pulse",
        1000,
        active,
        MovingMuscle::next,
        |active, pulse| active.tick_with_pulse(*pulse),
        digest,
    );
}

/// Measures a muscle at one model level, as the device runs it.
fn measure_model_level<C: Clock>(
    bench: &mut Bench<'_, C>,
    climbing: MovingMuscle<TabledMuscle>,
    tick: &'static str,
    tick_and_pulse: &'static str,
) {
    let digest = |climbing: &MovingMuscle<TabledMuscle>, (): &(), sum: &mut Checksum| {
        sum.add_word(climbing.force());
    };
    bench.measure(
        tick,
        1000,
        (climbing.clone(), Gain::ZERO),
        |(climbing, gain), random| {
            if climbing.to.get().is_multiple_of(25 * TICK_US) {
                let at = climbing.to;
                climbing.muscle.pulse(&mut climbing.state, at, *gain);
            }
            *gain = climbing.next(random).1;
        },
        |(climbing, _), ()| climbing.tick(),
        |(climbing, _), (), sum| digest(climbing, &(), sum),
    );
    bench.measure(
        tick_and_pulse,
        1000,
        climbing,
        MovingMuscle::next,
        |climbing, pulse| climbing.tick_with_pulse(*pulse),
        digest,
    );
}

/// Measures amplitude → gain (one exponential), gain → amplitude (one logarithm), and effort →
/// amplitude, as a controller needs it.
fn recruitment<C: Clock>(bench: &mut Bench<'_, C>, curve: Recruitment) {
    let digest = |_: &Recruitment, answer: &u32, sum: &mut Checksum| sum.add_word(*answer);
    bench.measure(
        "recruitment_gain",
        1000,
        curve,
        |_, random| Amplitude::new(random.between(6_000, 20_000)),
        |curve, amplitude| curve.gain(*amplitude).get().to_bits(),
        digest,
    );
    bench.measure(
        "recruitment_amplitude",
        1000,
        curve,
        // The gain at threshold is e^-3.5 of the reference.
        |_, random| random.between(1 << 26, 1 << 31),
        |curve, gain| {
            let gain = Gain::new(U1F31::from_bits(*gain));
            curve.amplitude_for_gain(gain).get()
        },
        digest,
    );
    bench.measure(
        "recruitment_effort",
        1000,
        curve,
        |_, random| I16F16::from_bits(random.between(0, 1 << 16).cast_signed()),
        |curve, effort| curve.amplitude_for_effort(*effort).get(),
        digest,
    );
}
