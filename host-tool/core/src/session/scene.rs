//! What a session asks of each muscle, and which rung of the ladder that needs.

use crate::choice::{Choice, NoRung, Scene, Share, choose, expected_change, expected_error};
use firmware::muscle::Rung;

use super::channel::Channel;
use super::setpoints::{Course, ForceCourse};
use super::{Model, Session};

/// A contact with a virtual wall may be as short as this, ms. Assumed: the host
/// does not know how the wearer moves.
const CONTACT_MS: u32 = 100;
/// Microseconds in a second, and mHz in pulses per microsecond.
const MHZ_PER_US: u32 = 1_000_000_000;

/// What a channel's muscle needs and what it gets.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Needs {
    /// What is asked of it. Its session is 0 if the file does not say how the
    /// muscle tires.
    pub scene: Scene,
    /// The lowest sufficient rung, or why there is none.
    pub choice: Result<Choice, NoRung>,
    /// The rung it gets: the file's, or the chosen one, or else the best.
    pub rung: Rung,
    /// How much the top rung in its place is expected to change the true force in
    /// this scene.
    pub change: Share,
    /// The error to expect of that rung's prediction.
    pub error: Share,
    /// To how much that change can grow as the muscle tires, if nothing models
    /// that.
    pub change_if_it_tires: Option<Share>,
}

impl Session {
    /// What the muscle of a channel needs to be as accurate as `tolerance`;
    /// none if the channel has no muscle.
    #[must_use]
    pub fn needs(&self, channel: &Channel, tolerance: Share) -> Option<Needs> {
        let muscle = channel.muscle.as_ref()?;
        let seconds = self.duration_us.div_ceil(1_000_000) as u32; // at most a day
        let works = Scene {
            session_s: seconds,
            ..self.scene(channel)
        };
        let scene = match muscle.fatigue {
            Some(_) => works,
            None => Scene {
                session_s: 0,
                ..works
            },
        };
        let choice = choose(&scene, tolerance);
        let rung = match muscle.model {
            Model::Fixed(rung) => rung,
            Model::Auto => choice.map_or_else(|none| none.best, |choice| choice.rung),
        };
        let tires = muscle.fatigue.is_none();
        Some(Needs {
            scene,
            choice,
            rung,
            change: expected_change(&scene, rung),
            error: expected_error(&scene, rung),
            change_if_it_tires: tires.then(|| expected_change(&works, rung)),
        })
    }

    /// What is asked of a channel's muscle, fatigue aside.
    fn scene(&self, channel: &Channel) -> Scene {
        let train = &channel.spec.train;
        let rate = |period_us: u32| MHZ_PER_US / period_us.max(1);
        let slowest_us = channel.force.and_then(|force| force.max_period_us);
        let slowest_mhz = rate(slowest_us.unwrap_or(train.period_us));
        let mut fastest_mhz = match train.burst_count {
            0 | 1 => rate(train.period_us),
            _ => rate(train.burst_interval_us.into()),
        };
        if let Some(force) = &channel.force {
            fastest_mhz = fastest_mhz.max(rate(force.min_period_us));
        }
        let (burst_ms, ramp_ms) = self.drive(channel);
        // A train that ends by itself is a burst.
        let train_us = u64::from(train.repeats) * u64::from(train.period_us);
        let train_ms = match train.repeats {
            0 => Scene::UNBROKEN,
            _ => (train_us / 1000).min(Scene::UNBROKEN.into()) as u32,
        };
        Scene {
            burst_ms: burst_ms.min(train_ms),
            slowest_mhz,
            fastest_mhz,
            ramp_ms,
            session_s: 0,
        }
    }

    /// How long a channel is driven at a stretch, and how fast its drive goes
    /// all the way, ms. A joint's channel is taken to follow the wanted angle.
    fn drive(&self, channel: &Channel) -> (u32, u32) {
        let index = channel.index();
        let by_wall = self
            .wall
            .is_some_and(|wall| wall.demands().any(|(driven, ..)| driven == index));
        if by_wall {
            return (CONTACT_MS, 0);
        }
        let by_joint = self.joint.as_ref().is_some_and(|joint| {
            let mut points = joint.points();
            points.any(|point| point.channel == index)
        });
        match &self.setpoints.course {
            Course::AngleSine { frequency_hz, .. } if by_joint => sine(*frequency_hz, true),
            Course::AngleSteps(steps) if by_joint => {
                let stays = steps.windows(2).map(|two| (two[1].0 - two[0].0) / 1000);
                (
                    whole_ms(stays.min().map_or(f64::INFINITY, |ms| ms as f64)),
                    0,
                )
            }
            _ => self.setpoints.force_of(index).map_or(
                // Constant amplitudes rise once.
                (Scene::UNBROKEN, self.wearer.rise_ms.into()),
                force,
            ),
        }
    }
}

/// A sine goes all the way at its steepest in 1/(πf); if it also swings between
/// two muscles, each works for half a period.
fn sine(frequency_hz: f64, half_by_half: bool) -> (u32, u32) {
    let half_ms = 500.0 / frequency_hz;
    let burst_ms = if half_by_half { half_ms } else { f64::INFINITY };
    (
        whole_ms(burst_ms),
        whole_ms(half_ms * std::f64::consts::FRAC_2_PI),
    )
}

fn force(course: &ForceCourse) -> (u32, u32) {
    match course {
        ForceCourse::Sine {
            offset_n,
            amplitude_n,
            frequency_hz,
        } => sine(*frequency_hz, amplitude_n.abs() >= *offset_n),
        ForceCourse::Ramp(points) => ramps(points),
    }
}

/// The shortest stretch above zero and the whole way at the steepest slope, ms.
fn ramps(points: &[(u64, u32)]) -> (u32, u32) {
    let forces = points
        .iter()
        .map(|&(_, millinewton)| f64::from(millinewton));
    let (low, high) = forces.fold((f64::INFINITY, 0f64), |(low, high), f| {
        (low.min(f), high.max(f))
    });
    let steepest_per_ms = points
        .windows(2)
        .map(|two| {
            let ms = (two[1].0 - two[0].0) as f64 / 1e3; // rising times: checked
            f64::from(two[1].1.abs_diff(two[0].1)) / ms
        })
        .fold(0.0, f64::max);
    // From the last zero before to the first zero after.
    let mut shortest_us = f64::INFINITY;
    let mut zero = None;
    for &(at_us, millinewton) in points {
        if millinewton == 0 {
            if let Some((from_us, true)) = zero {
                shortest_us = shortest_us.min((at_us - from_us) as f64);
            }
            zero = Some((at_us, false));
        } else {
            zero = zero.map(|(from_us, _)| (from_us, true));
        }
    }
    // A force that begins at once is a step.
    let begins_high = points.first().is_some_and(|first| first.1 > 0);
    let ramp_ms = match (begins_high, steepest_per_ms > 0.0) {
        (true, _) => 0.0,
        (false, true) => (high - low) / steepest_per_ms,
        (false, false) => f64::INFINITY,
    };
    (whole_ms(shortest_us / 1e3), whole_ms(ramp_ms))
}

/// Whole ms, at most unbroken.
fn whole_ms(ms: f64) -> u32 {
    ms.min(Scene::UNBROKEN.into()) as u32
}
