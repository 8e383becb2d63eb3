//! Generates random arms around the nominal arm, and random postures of the nominal arm.

use super::declared::{Arms, LimbDeclaration};
use firmware::bench::limb::{before_the_trunk, nominal_limb};
use firmware::limb::{AXES, LimbSpec, Posture};
use firmware::units::Angle;
use hal_sim::random;

/// Sequence of random numbers that are uniform from −1 to 1.
struct UniformDeviates {
    seed: u64,
    index: u64,
}

impl UniformDeviates {
    /// Starts the sequence of arm `n`. The sequences of different arms do not overlap, as long as
    /// an arm uses at most 1000 numbers.
    const fn for_arm(seed: u64, n: u64) -> Self {
        Self {
            seed,
            index: n * 1000,
        }
    }

    fn next(&mut self) -> f64 {
        self.index += 1;
        2.0 * random::unit(self.seed, self.index) - 1.0
    }

    /// Returns `number`, randomly changed by up to `percent` % of it.
    fn percent(&mut self, number: i32, percent: f64) -> i32 {
        let factor = 1.0 + self.next() * percent / 100.0;
        (f64::from(number) * factor).round() as i32
    }
}

/// Returns random arm `n`, and the posture in which its methods are asked for forces.
pub(super) fn random_arm(declared: &LimbDeclaration, n: u64) -> (LimbSpec, Posture) {
    let Arms {
        bones_percent,
        points_mm,
        gains_percent,
        posture_deg,
        ..
    } = declared.arms;
    let mut deviates = UniformDeviates::for_arm(declared.seed, n);
    let mut spec = nominal_limb();
    for way in &mut spec.offsets_um {
        let factor = 1.0 + deviates.next() * bones_percent / 100.0;
        *way = way.map(|um| (f64::from(um) * factor).round() as i32);
    }
    for line in &mut spec.lines {
        let points = line.vias.iter_mut().flat_map(|via| &mut via.at_um);
        for um in points {
            *um += (deviates.next() * points_mm * 1000.0).round() as i32;
        }
        let gain = deviates.percent(line.gain_mn_per_ma.cast_signed(), gains_percent);
        line.gain_mn_per_ma = gain.cast_unsigned();
    }
    let mut posture = before_the_trunk();
    for (angle, &(low, high)) in posture.iter_mut().zip(&spec.ranges_mdeg) {
        let mdeg = angle.to_millideg() + (deviates.next() * posture_deg * 1000.0) as i32;
        *angle = Angle::from_millideg(mdeg.clamp(low, high));
    }
    (spec, posture)
}

/// Returns random posture `n` within the joint ranges of the nominal arm, and a random direction as
/// a vector of length 1.
pub(super) fn random_posture(declared: &LimbDeclaration, n: u64) -> (Posture, [f64; 3]) {
    // The changed seed keeps this sequence apart from that of the arms.
    let mut deviates = UniformDeviates::for_arm(declared.seed ^ 0x5EED, n);
    let mut posture = Posture::default();
    let ranges: [(i32, i32); AXES] = nominal_limb().ranges_mdeg;
    for (angle, (low, high)) in posture.iter_mut().zip(ranges) {
        let middle = f64::from(low) + f64::from(high);
        let span = f64::from(high) - f64::from(low);
        let mdeg = 0.5 * (middle + deviates.next() * span);
        *angle = Angle::from_millideg(mdeg as i32);
    }
    // A uniform height with a uniform azimuth is uniform on the sphere (Archimedes).
    let (up, azimuth) = (deviates.next(), deviates.next() * std::f64::consts::PI);
    let around = (1.0 - up * up).sqrt();
    (
        posture,
        [around * libm::cos(azimuth), around * libm::sin(azimuth), up],
    )
}
