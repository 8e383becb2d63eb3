//! Benchmarks of the control of one joint.

use super::inverse::FINGER;
use super::{Bench, Checksum, Clock, Random};
use crate::control::differentiator::{Differentiator, DifferentiatorState};
use crate::control::gain::Gain;
use crate::control::law::LawState;
use crate::control::response::Course;
use crate::control::{
    Effort, HoldPolicy, Joint, JointSpec, JointState, LawSpec, PointSpec, ResponseSpec,
    SensorSource,
};
use crate::units::{Amplitude, Angle, Micros, us};

/// Returns the specification of a finger on channels 0, 1 (flexors) and 2, whose sensor is on the
/// board.
pub(super) fn finger(law: LawSpec, law_period_ms: u8) -> JointSpec {
    let point = |channel| PointSpec {
        channel,
        threshold: Amplitude::new(6_000),
        max: Amplitude::new(20_000),
    };
    let mut flexors = heapless::Vec::new();
    // Two of two places.
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
        // The default controller uses a wearer's model and response; the others run without.
        wearer: is_default.then_some(FINGER),
        response: is_default.then_some(ResponseSpec::RECOMMENDED),
    }
}

pub(super) fn run_benchmarks<C: Clock>(bench: &mut Bench<'_, C>) -> Option<()> {
    measure_differentiator(bench, "differentiator", 1000)?;
    let learning = Some(ResponseSpec::RECOMMENDED);
    measure_law(bench, "law_super_twisting", 1000, None)?;
    measure_law(bench, "law_and_response", 1000, learning)?;
    for (name, law) in [
        ("joint_super_twisting", LawSpec::RECOMMENDED),
        ("joint_paper", LawSpec::PAPER),
        ("joint_pid", LawSpec::PID),
    ] {
        let joint = MovingJoint::new(law, 1)?;
        bench.measure(
            name,
            1000,
            joint,
            MovingJoint::next,
            MovingJoint::tick,
            MovingJoint::digest,
        );
    }
    // A tick in which the controller rests: setpoint track, sensor, mapping.
    bench.measure(
        "joint_without_law",
        1000,
        MovingJoint::new(LawSpec::RECOMMENDED, 20)?,
        |joint, random| {
            let angle = joint.next(random);
            // Ticks of the controller are not measured: the first and every 20th after it.
            if (joint.now.get() / 1000) % 20 == 1 {
                joint.tick(&angle);
                return joint.next(random);
            }
            angle
        },
        MovingJoint::tick,
        MovingJoint::digest,
    );
    Some(())
}

/// Measures the pseudo-differentiator alone.
pub fn measure_differentiator<C: Clock, N>(
    bench: &mut Bench<'_, C, N>,
    name: N,
    runs: u32,
) -> Option<()> {
    bench.measure(
        name,
        runs,
        (
            Differentiator::new(6_000, 2).ok()?,
            DifferentiatorState::default(),
        ),
        // 0…100°, in 0.01°; fits i16.
        |_, random| Angle::from_centideg(random.between(0, 10_000) as i16),
        |(filter, state), x| filter.step(state, *x).get().to_bits(),
        |_, rate, sum| sum.add_word(rate.cast_unsigned()),
    );
    Some(())
}

/// Measures the default controller with its differentiator, with or without predictor and learning,
/// and without a joint around it.
pub fn measure_law<C: Clock, N>(
    bench: &mut Bench<'_, C, N>,
    name: N,
    runs: u32,
    response: Option<ResponseSpec>,
) -> Option<()> {
    let spec = JointSpec {
        response,
        ..finger(LawSpec::RECOMMENDED, 1)
    };
    bench.measure(
        name,
        runs,
        (spec.law().ok()?, LawState::default()),
        // ±20°, in 0.01°; fits i16.
        |_, random| Angle::from_centideg(random.between(0, 4_000) as i16 - 2_000),
        |(law, state), error| Some(law.step(state, *error, &Course::default(), Gain::ONE)),
        |_, effort, sum| sum.add_word(effort.map_or(0, Effort::to_milli).cast_unsigned()),
    );
    Some(())
}

/// A moving joint with a tick every millisecond.
struct MovingJoint {
    joint: Joint,
    state: JointState,
    now: Micros,
}

impl MovingJoint {
    /// Creates a joint whose controller runs every `period_ms`.
    fn new(law: LawSpec, period_ms: u8) -> Option<Self> {
        Some(Self {
            joint: Joint::new(&finger(law, period_ms)).ok()?,
            state: JointState::default(),
            now: Micros::new(0),
        })
    }

    /// Advances by a millisecond, with a new setpoint every 11 ms, as a glove sends them. Returns
    /// the measured angle.
    fn next(&mut self, random: &mut Random) -> Angle {
        self.now += us(1000);
        // Sweeps 0…100° in 0.4 s, with noise; fits i16.
        let sweep = self.now.get() / 1000 * 25 % 10_000;
        let angle = Angle::from_centideg((sweep + random.between(0, 200)) as i16);
        if (self.now.get() / 1000) % 11 == 1 {
            let wanted = Angle::from_centideg(random.between(2_000, 8_000) as i16);
            let (state, now) = (&mut self.state, self.now);
            // In order and in range, so always accepted.
            let _ = self.joint.accept_setpoint(state, now, now, wanted, None);
        }
        angle
    }

    fn tick(&mut self, angle: &Angle) -> Checksum {
        let mut answer = Checksum::default();
        if let Ok(orders) = self.joint.tick(&mut self.state, self.now, Some(*angle)) {
            answer.add_amplitudes(&orders.amplitudes);
            answer.add_word(orders.effort.to_milli().cast_unsigned());
        }
        answer
    }

    fn digest(&self, answer: &Checksum, sum: &mut Checksum) {
        sum.add_word(answer.value());
    }
}
