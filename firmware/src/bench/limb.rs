//! Benchmarks of the arm: update of the Jacobians for a posture, and conversion of a wrench into
//! amplitudes.

use super::{Bench, Checksum, Clock, Random};
use crate::limb::{
    AXES, Jacobians, JointName, Limb, LimbSpec, LineSpec, Number, Posture, ReachError, ViaSpec,
    Wrench,
};
use crate::units::{Amplitude, Angle};
use heapless::Vec;

/// Number of the thorax, as in [`ViaSpec::segment`]; those of the other segments follow.
const THORAX: u8 = 0;
const GIRDLE: u8 = 1;
const UPPER_ARM: u8 = 2;
const FOREARM: u8 = 3;

/// Creates a point from its position in mm.
const fn via(segment: u8, [x, y, z]: [i32; 3]) -> ViaSpec {
    ViaSpec {
        segment,
        at_um: [x * 1000, y * 1000, z * 1000], // below a metre
    }
}

/// Returns the nine muscle groups of Sierotowicz 2023, section 2.4, on an arm of average size.
///
/// All values are assumed: the paper prints neither lengths nor points nor gains. The bones are
/// those of a person of 1.76 m, to the centimetre; the points were placed by eye on a drawing of a
/// skeleton.
#[must_use]
pub fn nominal_limb() -> LimbSpec {
    use JointName::{Elbow, Glenohumeral, Sternoclavicular};
    let biceps = [via(UPPER_ARM, [-30, 0, -130]), via(FOREARM, [-15, 0, -50])];
    let triceps = [
        via(UPPER_ARM, [25, 0, -150]),
        via(UPPER_ARM, [25, 0, -290]),
        via(FOREARM, [20, 0, 15]),
    ];
    let deltoid = |origin, insertion| [via(GIRDLE, origin), via(UPPER_ARM, insertion)];
    let superior = deltoid([30, 165, 45], [0, 15, -120]);
    let anterior = deltoid([0, 130, 35], [-12, 10, -120]);
    let posterior = deltoid([70, 120, 30], [12, 10, -120]);
    let clavicular = deltoid([-10, 40, 5], [-15, -5, -60]);
    let sternocostal = [via(THORAX, [-60, 20, -100]), via(UPPER_ARM, [-15, -5, -60])];
    let trapezius = [via(THORAX, [90, 0, 60]), via(GIRDLE, [55, 120, 40])];
    let latissimus = [via(THORAX, [60, 60, -250]), via(UPPER_ARM, [-8, -12, -50])];
    let lines: [(JointName, &[ViaSpec], u32); 9] = [
        (Elbow, &biceps, 9_000),
        (Elbow, &triceps, 9_000),
        (Glenohumeral, &superior, 7_000),
        (Glenohumeral, &anterior, 6_000),
        (Glenohumeral, &posterior, 6_000),
        (Glenohumeral, &clavicular, 6_000),
        (Glenohumeral, &sternocostal, 7_000),
        (Sternoclavicular, &trapezius, 8_000),
        (Glenohumeral, &latissimus, 7_000),
    ];
    let lines = (0u8..).zip(lines);
    LimbSpec {
        offsets_um: [
            [-40_000, 20_000, 0],
            [30_000, 150_000, 20_000],
            [0, 0, -300_000],
            [0, 0, -260_000],
        ],
        ranges_mdeg: RANGES_MDEG,
        lines: lines
            .map(|(channel, (joint, vias, gain_mn_per_ma))| LineSpec {
                channel,
                joint,
                vias: vias.iter().copied().collect(),
                gain_mn_per_ma,
                threshold: Amplitude::new(8_000),
                limit: Amplitude::new(25_000),
            })
            .collect(),
    }
}

/// Ranges of the nominal arm, m°: SC protraction, elevation, roll; GH flexion, abduction, internal
/// rotation; elbow flexion, bend, pronation.
const RANGES_MDEG: [(i32, i32); AXES] = [
    (-30_000, 30_000),
    (-10_000, 40_000),
    (-30_000, 30_000),
    (-40_000, 120_000),
    (0, 80_000),
    (-60_000, 80_000),
    (0, 130_000),
    (-10_000, 10_000),
    (-80_000, 80_000),
];

/// Posture with the hand in front of the trunk, in hundredths of a degree: shoulder 45° flexed, 30°
/// abducted, 20° rotated inward, elbow 80° flexed. Assumed: the paper prints no posture.
const BEFORE_THE_TRUNK: [i16; AXES] = [0, 0, 0, 4_500, 3_000, 2_000, 8_000, 0, 0];

/// Returns the posture in which wrenches are requested, with the hand in front of the trunk.
#[must_use]
pub fn before_the_trunk() -> Posture {
    BEFORE_THE_TRUNK.map(Angle::from_centideg)
}

/// Returns a random posture of the nominal arm.
fn random_posture(random: &mut Random) -> Posture {
    RANGES_MDEG.map(|(low, high)| {
        // Both are within ±180 000.
        let mdeg = random.between(0, high.abs_diff(low)).cast_signed() + low;
        Angle::from_millideg(mdeg)
    })
}

/// Returns a random force of up to 10 N along each axis.
fn random_wrench(random: &mut Random) -> Wrench<f32> {
    let mut part = || f32::ratio(random.between(0, 20_000).cast_signed() - 10_000, 1000);
    Wrench::from_force(part(), part(), part())
}

pub(super) fn run_benchmarks<C: Clock>(bench: &mut Bench<'_, C>) -> Option<()> {
    let limb = Limb::<f32>::new(&nominal_limb()).ok()?;
    let given = limb.jacobians_at_posture(&before_the_trunk()).ok()?;
    // Sine and cosine of one angle.
    bench.measure(
        "limb_sine_and_cosine",
        1000,
        (),
        // ±π in 2^-20.
        |(), random| {
            f32::ratio(
                random.between(0, 6_588_397).cast_signed() - 3_294_198,
                1 << 20,
            )
        },
        |(), radians| radians.sine_and_cosine(),
        |(), (sine, cosine), sum| {
            sum.add_word(sine.to_bits());
            sum.add_word(cosine.to_bits());
        },
    );
    // Algorithm 1 with given Jacobians, up to amplitudes.
    bench.measure(
        "limb_nearest",
        1000,
        (limb.clone(), given),
        |_, random| random_wrench(random),
        |(limb, given), wanted| match limb.recruit(given, wanted) {
            Ok(recruited) => (recruited.orders, 0.0),
            Err(ReachError::TooStrong { share, .. }) => (Vec::new(), share),
            Err(ReachError::NoMuscleHelps) => (Vec::new(), 0.0),
        },
        |_, (orders, share), sum| {
            for (channel, amplitude) in orders {
                sum.add_word(u32::from(*channel));
                sum.add_word(amplitude.get());
            }
            sum.add_word(share.to_bits());
        },
    );
    // Both Jacobians in another posture.
    bench.measure(
        "limb_refresh",
        300,
        limb,
        |_, random| random_posture(random),
        |limb, posture| limb.jacobians_at_posture(posture).unwrap_or_default(),
        |_, jacobians, sum| digest(jacobians, sum),
    );
    Some(())
}

/// Adds every number of both Jacobians to the checksum.
fn digest(jacobians: &Jacobians<f32>, sum: &mut Checksum) {
    for axis in jacobians.arm() {
        for part in axis.linear.to_array() {
            sum.add_word(part.to_bits());
        }
    }
    for part in jacobians.muscles().flatten() {
        sum.add_word(part.to_bits());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Otherwise rows would measure refusals.
    #[test]
    fn most_wrenches_can_be_made_and_every_posture_taken() {
        let limb = Limb::<f32>::new(&nominal_limb()).unwrap();
        let given = limb.jacobians_at_posture(&before_the_trunk()).unwrap();
        let mut random = Random::default();
        let made = (0..1000).filter(|_| limb.recruit(&given, &random_wrench(&mut random)).is_ok());
        let made = made.count();
        std::println!("{made} of 1000 wrenches can be made");
        assert!(made > 500);
        assert!((0..300).all(|_| {
            limb.jacobians_at_posture(&random_posture(&mut random))
                .is_ok()
        }));
    }
}
