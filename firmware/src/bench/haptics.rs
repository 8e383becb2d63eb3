//! The virtual wall.

use super::{Algorithm, Checksum, Random};
use crate::control::SensorSource;
use crate::haptics::{CoContraction, PreWall, Side, Wall, WallSpec, WallState};
use crate::units::{Amplitude, Angle, Micros};

/// A limb that swings through pre-wall and wall, ticked every millisecond, with
/// everything that a wall can have.
pub(super) struct Swinging {
    wall: Option<Wall>,
    state: WallState,
    now: Micros,
    angle: Angle,
    answer: Checksum,
}

impl Swinging {
    pub(super) fn new() -> Self {
        let spec = WallSpec {
            at_mdeg: 90_000,
            side: Side::Flexion,
            channel: 0,
            max: Amplitude(80_000),
            stiffness: 8_900,
            damping: 200,
            cutoff_mhz: 10_000,
            pre_wall: Some(PreWall {
                depth_mdeg: 9_000,
                begin: Amplitude(20_000),
                end: Amplitude(40_000),
            }),
            co_contraction: Some(CoContraction {
                channel: 1,
                amplitude: Amplitude(40_000),
            }),
            angle_min_mdeg: 0,
            angle_max_mdeg: 150_000,
            sensor: SensorSource::Adc {
                code_at_0: 500,
                code_at_100: 2_500,
            },
            stale_after_ms: 10,
        };
        Self {
            wall: Wall::new(&spec).ok(),
            state: WallState::default(),
            now: Micros(0),
            angle: Angle::default(),
            answer: Checksum::new(),
        }
    }
}

impl Algorithm for Swinging {
    fn prepare(&mut self, random: &mut Random) {
        self.now = self.now.plus(1000);
        // Sweeps 75…105° in 0.3 s, with noise; fits i16.
        let sweep = 7_500 + self.now.0 / 1000 * 10 % 3_000;
        self.angle = Angle::from_centideg((sweep + random.between(0, 50)) as i16);
    }
    fn run(&mut self) {
        let Some(wall) = &self.wall else { return };
        if let Ok(orders) = wall.tick(&mut self.state, self.now, Some(self.angle)) {
            self.answer = Checksum::new();
            for (channel, amplitude) in orders.amplitudes {
                self.answer.word(u32::from(channel));
                self.answer.word(amplitude.0);
            }
            self.answer
                .word(orders.penetration.0.to_bits().cast_unsigned());
        }
    }
    fn digest(&self, sum: &mut Checksum) {
        sum.word(self.answer.0);
    }
}
