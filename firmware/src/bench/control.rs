//! Control of one joint.

use super::inverse::FINGER;
use super::{Algorithm, Checksum, Random};
use crate::control::differentiator::{Differentiator, DifferentiatorState};
use crate::control::law::{Law, LawState, Q};
use crate::control::response::Course;
use crate::control::{
    Effort, HoldPolicy, Joint, JointSpec, JointState, LawSpec, PointSpec, ResponseSpec,
    SensorSource,
};
use crate::units::{Amplitude, Angle, Micros};

/// A finger on channels 0, 1 (flexors) and 2, its sensor on the board.
pub(super) fn finger(law: LawSpec, law_period_ms: u8) -> JointSpec {
    let point = |channel| PointSpec {
        channel,
        threshold: Amplitude(6_000),
        max: Amplitude(20_000),
    };
    let mut flexors = heapless::Vec::new();
    // Two of two.
    let _ = flexors.push(point(0));
    let _ = flexors.push(point(1));
    let is_default = law == LawSpec::RECOMMENDED;
    JointSpec {
        law,
        law_period_ms,
        cutoff_mhz: law.default_cutoff_mhz(),
        flexors,
        extensor: point(2),
        hold: HoldPolicy::Extrapolate { max_ms: 200 },
        angle_min_mdeg: 0,
        angle_max_mdeg: 100_000,
        sensor: SensorSource::Adc {
            code_at_0: 400,
            code_at_100: 3_600,
        },
        stale_after_ms: 50,
        // All that the default law can use; the others stay bare.
        wearer: is_default.then_some(FINGER),
        response: is_default.then_some(ResponseSpec::RECOMMENDED),
    }
}

/// The pseudo-differentiator alone.
pub(super) struct Differentiation {
    filter: Option<Differentiator>,
    state: DifferentiatorState,
    x: Angle,
    rate: i32,
}

impl Differentiation {
    pub(super) fn new() -> Self {
        Self {
            filter: Differentiator::new(6_000, 2),
            state: DifferentiatorState::default(),
            x: Angle::default(),
            rate: 0,
        }
    }
}

impl Algorithm for Differentiation {
    fn prepare(&mut self, random: &mut Random) {
        // 0…100°, in 0.01°; fits i16.
        self.x = Angle::from_centideg(random.between(0, 10_000) as i16);
    }
    fn run(&mut self) {
        if let Some(filter) = &self.filter {
            self.rate = filter.step(&mut self.state, self.x).0.to_bits();
        }
    }
    fn digest(&self, sum: &mut Checksum) {
        sum.word(self.rate.cast_unsigned());
    }
}

/// A law with its differentiator, and with its predictor and learning or not,
/// without a joint around it.
pub(super) struct LawAlone {
    law: Option<Law>,
    state: LawState,
    error: Angle,
    effort: Effort,
}

impl LawAlone {
    pub(super) fn new(law: LawSpec, response: Option<ResponseSpec>) -> Self {
        let spec = JointSpec {
            response,
            ..finger(law, 1)
        };
        Self {
            law: spec.law().ok(),
            state: LawState::default(),
            error: Angle::default(),
            effort: Effort::Fraction(Q::ZERO),
        }
    }
}

impl Algorithm for LawAlone {
    fn prepare(&mut self, random: &mut Random) {
        // ±20°, in 0.01°; fits i16.
        self.error = Angle::from_centideg(random.between(0, 4_000) as i16 - 2_000);
    }
    fn run(&mut self) {
        if let Some(law) = &self.law {
            self.effort = law.step(&mut self.state, self.error, &Course::default());
        }
    }
    fn digest(&self, sum: &mut Checksum) {
        sum.word(self.effort.to_milli().cast_unsigned());
    }
}

/// A joint in motion, ticked every millisecond; its law runs every `period_ms`.
pub(super) struct Moving {
    joint: Option<Joint>,
    state: JointState,
    now: Micros,
    angle: Angle,
    answer: Checksum,
}

impl Moving {
    pub(super) fn new(law: LawSpec, period_ms: u8) -> Self {
        Self {
            joint: Joint::new(&finger(law, period_ms)).ok(),
            state: JointState::default(),
            now: Micros(0),
            angle: Angle::default(),
            answer: Checksum::new(),
        }
    }

    /// A millisecond on; a new setpoint every 11 ms, as a glove sends them.
    fn step(&mut self, random: &mut Random) {
        self.now = self.now.plus(1000);
        // Sweeps 0…100° in 0.4 s, with noise; fits i16.
        let sweep = self.now.0 / 1000 * 25 % 10_000;
        self.angle = Angle::from_centideg((sweep + random.between(0, 200)) as i16);
        if let Some(joint) = &self.joint
            && (self.now.0 / 1000) % 11 == 1
        {
            let wanted = Angle::from_centideg(random.between(2_000, 8_000) as i16);
            // In order, in range: always taken.
            let _ = joint.setpoint(&mut self.state, self.now, self.now, wanted, None);
        }
    }

    fn tick(&mut self) {
        let Some(joint) = &self.joint else { return };
        if let Ok(orders) = joint.tick(&mut self.state, self.now, Some(self.angle)) {
            self.answer = Checksum::new();
            for (channel, amplitude) in orders.amplitudes {
                self.answer.word(u32::from(channel));
                self.answer.word(amplitude.0);
            }
            self.answer.word(orders.effort.to_milli().cast_unsigned());
        }
    }
}

impl Algorithm for Moving {
    fn prepare(&mut self, random: &mut Random) {
        self.step(random);
    }
    fn run(&mut self) {
        self.tick();
    }
    fn digest(&self, sum: &mut Checksum) {
        sum.word(self.answer.0);
    }
}

/// A tick in which the law rests: setpoint track, sensor, mapping.
pub(super) struct Mapping(Moving);

impl Mapping {
    pub(super) fn new() -> Self {
        Self(Moving::new(LawSpec::RECOMMENDED, 20))
    }
}

impl Algorithm for Mapping {
    fn prepare(&mut self, random: &mut Random) {
        self.0.step(random);
        // The law's own ticks, unmeasured: the first and every 20th after it.
        if (self.0.now.0 / 1000) % 20 == 1 {
            self.0.tick();
            self.0.step(random);
        }
    }
    fn run(&mut self) {
        self.0.tick();
    }
    fn digest(&self, sum: &mut Checksum) {
        sum.word(self.0.answer.0);
    }
}
