//! Muscle models.

use super::{Algorithm, Checksum, Random};
use crate::muscle::{
    CalciumForce, CalciumForceSpec, CalciumForceState, FatigueSpec, Gain, Ladder, LadderState,
    Model, Recruitment, RecruitmentSpec, Rung,
};
use crate::units::{Amplitude, Micros};
use fixed::types::{I16F16, U1F31};

/// A muscle within the ranges of table 4 of Lee 2020 but for its strength; none of
/// that table. What a step takes hardly depends on it.
pub(super) const FORCE: CalciumForceSpec = CalciumForceSpec {
    a_mn_per_s: 1_007_000,
    k_micro: 177_000,
    tau_c_us: 27_000,
    tau1_us: 26_000,
    tau2_us: 60_000,
};

/// From 6 mA to 20 mA.
pub(super) const RECRUITMENT: RecruitmentSpec = RecruitmentSpec {
    motor_threshold: Amplitude(6_000),
    limit: Amplitude(20_000),
    reference: Amplitude(20_000),
    slope_micro: 250_000,
};

/// A tick's length, µs.
const TICK_US: u32 = 1000;

/// A muscle at work.
struct Active {
    muscle: Option<CalciumForce>,
    state: CalciumForceState,
    pulse: (Micros, Gain),
    to: Micros,
}

impl Active {
    fn new() -> Self {
        Self {
            // The constants are within their ranges; else checksums tell.
            muscle: CalciumForce::new(FORCE).ok(),
            state: CalciumForceState::at_rest(Micros(0)),
            pulse: (Micros(0), Gain::ZERO),
            to: Micros(0),
        }
    }

    /// A millisecond on, with a pulse somewhere inside it.
    fn prepare(&mut self, random: &mut Random) {
        let at = self.to.plus(random.between(1, TICK_US));
        let gain = Gain::new(U1F31::from_bits(random.word() >> 1));
        self.pulse = (at, gain);
        self.to = self.to.plus(TICK_US);
    }

    fn digest(&self, sum: &mut Checksum) {
        sum.word(self.state.calcium().to_bits());
        if let Some(muscle) = &self.muscle {
            sum.word(muscle.force(&self.state).0.to_bits().cast_unsigned());
        }
    }
}

/// One control tick of an active muscle.
pub(super) struct Tick(Active);

impl Tick {
    pub(super) fn new() -> Self {
        Self(Active::new())
    }
}

impl Algorithm for Tick {
    fn prepare(&mut self, random: &mut Random) {
        let active = &mut self.0;
        active.prepare(random);
        // Every 25th tick, a pulse at its beginning: 40 Hz.
        if active.to.0.is_multiple_of(25 * TICK_US)
            && let Some(muscle) = &active.muscle
        {
            let begin = active.to.minus(TICK_US);
            muscle.pulse(&mut active.state, begin, active.pulse.1);
        }
    }
    fn run(&mut self) {
        if let Some(muscle) = &self.0.muscle {
            muscle.advance(&mut self.0.state, self.0.to);
        }
    }
    fn digest(&self, sum: &mut Checksum) {
        self.0.digest(sum);
    }
}

/// One control tick with a pulse inside it. Every tick measured has one, as at
/// 1 kHz, which no train reaches: a thousand samples, C near its largest.
pub(super) struct TickWithPulse(Active);

impl TickWithPulse {
    pub(super) fn new() -> Self {
        Self(Active::new())
    }
}

impl Algorithm for TickWithPulse {
    fn prepare(&mut self, random: &mut Random) {
        self.0.prepare(random);
    }
    fn run(&mut self) {
        let active = &mut self.0;
        if let Some(muscle) = &active.muscle {
            muscle.pulse(&mut active.state, active.pulse.0, active.pulse.1);
            muscle.advance(&mut active.state, active.to);
        }
    }
    fn digest(&self, sum: &mut Checksum) {
        self.0.digest(sum);
    }
}

/// A muscle on some rung, as the device runs it, in a 40 Hz train.
struct Climbing {
    ladder: Option<Ladder>,
    state: Option<LadderState>,
    pulse: (Micros, Gain),
    to: Micros,
    ticks: u32,
}

impl Climbing {
    fn new(rung: Rung) -> Self {
        let fatigue = Some(FatigueSpec::scaled_to(FORCE.a_mn_per_s));
        // The constants are within their ranges; else checksums tell.
        let ladder = Ladder::new(FORCE, fatigue, rung).ok();
        Self {
            ladder,
            state: ladder.map(|ladder| ladder.at_rest(Micros(0))),
            pulse: (Micros(0), Gain::ZERO),
            to: Micros(0),
            ticks: 0,
        }
    }

    fn prepare(&mut self, random: &mut Random) {
        let at = self.to.plus(random.between(1, TICK_US));
        self.pulse = (at, Gain::new(U1F31::from_bits(random.word() >> 1)));
        self.to = self.to.plus(TICK_US);
        self.ticks = self.ticks.wrapping_add(1);
    }

    fn digest(&self, sum: &mut Checksum) {
        if let (Some(ladder), Some(state)) = (&self.ladder, &self.state) {
            sum.word(ladder.force(state).0.to_bits().cast_unsigned());
        }
    }
}

/// One control tick on a rung; every 25th has a pulse, which is not measured.
pub(super) struct RungTick(Climbing);

impl RungTick {
    pub(super) fn new(rung: Rung) -> Self {
        Self(Climbing::new(rung))
    }
}

impl Algorithm for RungTick {
    fn prepare(&mut self, random: &mut Random) {
        let Climbing {
            ladder,
            state,
            pulse,
            to,
            ticks,
        } = &mut self.0;
        if ticks.is_multiple_of(25)
            && let (Some(ladder), Some(state)) = (ladder, state)
        {
            ladder.pulse(state, *to, pulse.1);
        }
        self.0.prepare(random);
    }
    fn run(&mut self) {
        let active = &mut self.0;
        if let (Some(ladder), Some(state)) = (&active.ladder, &mut active.state) {
            ladder.advance(state, active.to);
        }
    }
    fn digest(&self, sum: &mut Checksum) {
        self.0.digest(sum);
    }
}

/// One control tick with a pulse inside it, every pulse with an interval of its
/// own: the cheap rungs derive their drive anew.
pub(super) struct RungTickWithPulse(Climbing);

impl RungTickWithPulse {
    pub(super) fn new(rung: Rung) -> Self {
        Self(Climbing::new(rung))
    }
}

impl Algorithm for RungTickWithPulse {
    fn prepare(&mut self, random: &mut Random) {
        self.0.prepare(random);
    }
    fn run(&mut self) {
        let active = &mut self.0;
        if let (Some(ladder), Some(state)) = (&active.ladder, &mut active.state) {
            ladder.pulse(state, active.pulse.0, active.pulse.1);
            ladder.advance(state, active.to);
        }
    }
    fn digest(&self, sum: &mut Checksum) {
        self.0.digest(sum);
    }
}

/// A curve with its next argument and its last answer.
struct Curve {
    recruitment: Option<Recruitment>,
    argument: u32,
    answer: u32,
}

impl Curve {
    fn new() -> Self {
        Self {
            recruitment: Recruitment::new(RECRUITMENT).ok(),
            argument: 0,
            answer: 0,
        }
    }
}

/// Amplitude → gain: one exponential.
pub(super) struct GainOfAmplitude(Curve);

impl GainOfAmplitude {
    pub(super) fn new() -> Self {
        Self(Curve::new())
    }
}

impl Algorithm for GainOfAmplitude {
    fn prepare(&mut self, random: &mut Random) {
        self.0.argument = random.between(6_000, 20_000);
    }
    fn run(&mut self) {
        if let Some(curve) = &self.0.recruitment {
            let gain = curve.gain(Amplitude(self.0.argument));
            self.0.answer = gain.get().to_bits();
        }
    }
    fn digest(&self, sum: &mut Checksum) {
        sum.word(self.0.answer);
    }
}

/// Gain → amplitude: one logarithm.
pub(super) struct AmplitudeForGain(Curve);

impl AmplitudeForGain {
    pub(super) fn new() -> Self {
        Self(Curve::new())
    }
}

impl Algorithm for AmplitudeForGain {
    fn prepare(&mut self, random: &mut Random) {
        // e^-3.5 of the reference is the gain at threshold.
        self.0.argument = random.between(1 << 26, 1 << 31);
    }
    fn run(&mut self) {
        if let Some(curve) = &self.0.recruitment {
            let gain = Gain::new(U1F31::from_bits(self.0.argument));
            self.0.answer = curve.amplitude_for_gain(gain).0;
        }
    }
    fn digest(&self, sum: &mut Checksum) {
        sum.word(self.0.answer);
    }
}

/// Effort → amplitude, as a control law asks.
pub(super) struct AmplitudeForEffort(Curve);

impl AmplitudeForEffort {
    pub(super) fn new() -> Self {
        Self(Curve::new())
    }
}

impl Algorithm for AmplitudeForEffort {
    fn prepare(&mut self, random: &mut Random) {
        self.0.argument = random.between(0, 1 << 16);
    }
    fn run(&mut self) {
        if let Some(curve) = &self.0.recruitment {
            let effort = I16F16::from_bits(self.0.argument.cast_signed());
            self.0.answer = curve.amplitude_for_effort(effort).0;
        }
    }
    fn digest(&self, sum: &mut Checksum) {
        sum.word(self.0.answer);
    }
}
