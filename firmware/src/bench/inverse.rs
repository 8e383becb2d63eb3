//! Models run backwards: wanted force → pulses, wanted angle → effort.

use super::muscle::{FORCE, RECRUITMENT};
use super::{Algorithm, Checksum, Random};
use crate::control::{FeedForward, WearerModel};
use crate::muscle::{CalciumForceSpec, Drive, Inverse, Recruitment};
use crate::units::{Amplitude, Angle, AngularRate, Force};
use fixed::types::I16F16;

/// 20 to 60 Hz.
const PERIODS_US: (u32, u32) = (50_000, 16_667);

/// The earlier plant's finger with two points.
pub(super) const FINGER: WearerModel = WearerModel {
    rest_mdeg: 5_000,
    stiffness_unm_per_rad: 120_000,
    damping_unm_s_per_rad: 18_000,
    flexion_unm: 484_000,
    extension_unm: 150_000,
    torque_loss_milli: 250,
    curvature_milli: 1_200,
    lead_ms: 100,
};

/// One tick of force control but for the setpoint track: ahead of the lag, then
/// amplitude and period.
pub(super) struct ForceToPulses {
    recruitment: Option<Recruitment>,
    inverse: Option<Inverse>,
    force: Force,
    rate: I16F16,
    drive: Drive,
}

impl ForceToPulses {
    pub(super) fn new() -> Self {
        // The constants are within their ranges; else checksums tell.
        let recruitment = Recruitment::new(RECRUITMENT).ok();
        let (slowest, fastest) = PERIODS_US;
        let inverse = recruitment
            .as_ref()
            .and_then(|curve| Inverse::new(FORCE, curve, slowest, fastest, slowest).ok());
        Self {
            recruitment,
            inverse,
            force: Force::default(),
            rate: I16F16::ZERO,
            drive: Drive {
                amplitude: Amplitude::ZERO,
                period_us: 0,
                limiting: None,
            },
        }
    }
}

impl Algorithm for ForceToPulses {
    fn prepare(&mut self, random: &mut Random) {
        if let Some(inverse) = &self.inverse {
            // Up to a tenth beyond reach; below 2^31.
            let most = inverse.reach().1.0.to_bits().cast_unsigned();
            let bits = random.between(0, most + most / 10);
            self.force = Force(I16F16::from_bits(bits.cast_signed()));
        }
        self.rate = I16F16::from_bits(random.between(0, 40 << 16).cast_signed() - (20 << 16));
    }
    fn run(&mut self) {
        if let (Some(recruitment), Some(inverse)) = (&self.recruitment, &self.inverse) {
            let ahead = inverse.ahead(self.force, self.rate);
            self.drive = inverse.drive(recruitment, ahead);
        }
    }
    fn digest(&self, sum: &mut Checksum) {
        sum.word(self.drive.amplitude.0);
        sum.word(self.drive.period_us);
    }
}

/// The table of one muscle, as the request that puts it under force control makes it.
pub(super) struct Tabling {
    recruitment: Option<Recruitment>,
    fastest_us: u32,
    most: Force,
}

impl Tabling {
    pub(super) fn new() -> Self {
        Self {
            recruitment: Recruitment::new(RECRUITMENT).ok(),
            fastest_us: 0,
            most: Force::default(),
        }
    }
}

impl Algorithm for Tabling {
    fn prepare(&mut self, random: &mut Random) {
        self.fastest_us = random.between(10_000, 20_000);
    }
    fn run(&mut self) {
        if let Some(curve) = &self.recruitment
            && let Ok(inverse) =
                Inverse::new(FORCE, curve, PERIODS_US.0, self.fastest_us, PERIODS_US.0)
        {
            self.most = inverse.reach().1;
        }
    }
    fn digest(&self, sum: &mut Checksum) {
        sum.word(self.most.0.to_bits().cast_unsigned());
    }
}

/// The longest table that any request asks for: as many periods as there are, each
/// in as many steps as it may have.
pub(super) struct SlowTabling {
    recruitment: Option<Recruitment>,
    periods_us: (u32, u32),
    reach: (Force, Force),
}

impl SlowTabling {
    /// τ1 at which the model's steps are the longest, and the train of 10 Hz.
    const MUSCLE: CalciumForceSpec = CalciumForceSpec {
        tau1_us: 4_000,
        tau2_us: 1_000_000,
        ..FORCE
    };
    const TRAIN_US: u32 = 100_000;

    pub(super) fn new() -> Self {
        Self {
            recruitment: Recruitment::new(RECRUITMENT).ok(),
            periods_us: (0, 0),
            reach: (Force::default(), Force::default()),
        }
    }
}

impl Algorithm for SlowTabling {
    fn prepare(&mut self, random: &mut Random) {
        // 50 steps of 2 ms each.
        let fastest_us = random.between(98_001, Self::TRAIN_US);
        self.periods_us = (fastest_us, random.between(500_000, 2_000_000));
    }
    fn run(&mut self) {
        let (fastest_us, slowest_us) = self.periods_us;
        if let Some(curve) = &self.recruitment
            && let Ok(inverse) =
                Inverse::new(Self::MUSCLE, curve, Self::TRAIN_US, fastest_us, slowest_us)
        {
            self.reach = inverse.reach();
        }
    }
    fn digest(&self, sum: &mut Checksum) {
        sum.word(self.reach.0.0.to_bits().cast_unsigned());
        sum.word(self.reach.1.0.to_bits().cast_unsigned());
    }
}

/// The nominal wearer's inverse.
pub(super) struct AngleToEffort {
    inverse: Option<FeedForward>,
    target: Angle,
    rate: AngularRate,
    effort: i64,
}

impl AngleToEffort {
    pub(super) fn new() -> Self {
        Self {
            inverse: FeedForward::new(&FINGER, 0, 100_000).ok(),
            target: Angle::default(),
            rate: AngularRate::default(),
            effort: 0,
        }
    }
}

impl Algorithm for AngleToEffort {
    fn prepare(&mut self, random: &mut Random) {
        // 0…100°, in 0.01°; fits i16. ±50 °/s.
        self.target = Angle::from_centideg(random.between(0, 10_000) as i16);
        let rate = random.between(0, 100 << 16).cast_signed() - (50 << 16);
        self.rate = AngularRate(I16F16::from_bits(rate));
    }
    fn run(&mut self) {
        if let Some(inverse) = &self.inverse {
            self.effort = inverse.effort(self.target, self.rate).to_bits();
        }
    }
    fn digest(&self, sum: &mut Checksum) {
        sum.word(self.effort as u32); // ±2^24
    }
}
