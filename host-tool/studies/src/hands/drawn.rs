//! A drawn hand, its searches done, and what it holds.

use super::HandsError;
use super::leads::Leads;
use crate::hamana2022::{
    KnownThresholds, Participants, Population, PreparedHand, TwoPointsError, Voltages, Wearer,
    prepare, search_extensor,
};
use crate::tracking::driver::Driver;
use crate::tracking::plant::{Line, Plant};
use crate::tracking::trial::{Attempt, Frames, SCORED_FROM_MS, TRIAL_MS, device_time};
use crate::tracking::wearer::{Points, Volts};
use hal_sim::body::Body;
use hal_sim::body::hand::digits::{INDEX, REST_DEG};
use hal_sim::body::hand::spec::{A, B, E, RETURN};
use hal_sim::body::hand::{Hand, InvalidHand, MovingHand};
use std::f64::consts::TAU;

/// Electrodes A, B and E are on channels 0, 1, 2.
const CHANNELS: [usize; RETURN] = [A, B, E];
/// What is held is the mean over this last time, ms, of 3 s and of the whole trial.
const HELD_MS: usize = 1_000;
const FRESH_MS: usize = 3_000;
/// Who holds a range of less holds nothing, °: the glove's noise is 0.3.
const LEAST_DEG: f64 = 1.0;
/// The target: a sine between 15 % and 85 % of the range that is held, at Hamana 2022's
/// 0.2 Hz.
const MIDDLE: f64 = 0.5;
const SWING: f64 = 0.35;
const HZ: f64 = 0.2;

/// One way to bend the finger: one point or two.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Actuation {
    /// Which.
    pub points: Points,
    /// Threshold and greatest voltage of A, B and E, V; of a point that is used.
    pub ranges_v: [Option<[f64; 2]>; RETURN],
    /// Angle that all flexion holds after 3 s, °.
    pub fresh_deg: f64,
    /// Angles that all extension and all flexion still hold, rested as well as after 30 s
    /// without rest, °: the narrower of both.
    pub held_deg: [f64; 2],
}

/// A hand that laws drive.
#[derive(Clone, Debug)]
pub struct DrivenHand {
    hand: Hand,
    line: Line,
    seed: u64,
    /// One-point (the point that holds further) and two-point.
    pub ways: [Actuation; 2],
    /// Angles that it holds with either, low to high, °: what the target is made of.
    pub holds_deg: [f64; 2],
    /// The wanted angle each millisecond, °.
    pub wanted: Vec<f64>,
}

impl Actuation {
    /// The leads that are used.
    pub const fn leads(&self) -> Leads {
        let [a, b, e] = &self.ranges_v;
        Leads {
            used: [a.is_some(), b.is_some(), e.is_some()],
        }
    }

    /// All of an effort, its antagonist at threshold: the device has it so (Hamana 2022,
    /// (7) to (12)).
    fn full_effort_volts(&self, flexion: bool) -> Volts {
        let at = |point: usize| {
            let works = (point == E) != flexion;
            self.ranges_v[point].map_or(0.0, |range| range[usize::from(works)])
        };
        [at(A), at(B), at(E)]
    }

    /// The range that it holds, °.
    fn span_deg(&self) -> f64 {
        self.held_deg[1] - self.held_deg[0]
    }
}

impl DrivenHand {
    /// Hand `index` of the population, or why no law can drive it. Lines are those of
    /// the earlier wearers of the same seed.
    ///
    /// # Errors
    /// The declaration, or a hand that cannot be.
    pub fn draw(
        population: &Population,
        seed: u64,
        index: u64,
    ) -> Result<Result<Self, &'static str>, TwoPointsError> {
        let person = population.draw_person(seed, index)?;
        let known = KnownThresholds::from_person(&person);
        let PreparedHand {
            mut hand, voltages, ..
        } = match prepare(&person.spec, known)? {
            Ok(prepared) => prepared,
            Err(_) => return Ok(Err("no two points that bend the finger alone")),
        };
        let Some(extensor_v) = search_extensor(&mut hand, known.most_v)? else {
            return Ok(Err("nothing extends the finger, or the wrist comes first"));
        };
        let wearer = Wearer {
            hand,
            voltages,
            extensor_v,
        };
        Self::from_wearer(wearer, seed, index)
    }

    /// Draw `index` of the one person of `whom`, whose forearm is drawn but for what is
    /// known, or why no law can drive it. Lines are those of [`Self::draw`].
    ///
    /// # Errors
    /// The declaration, nobody, or a hand that cannot be.
    pub fn of_wearer(
        population: &Population,
        whom: &Participants,
        (seed, index): (u64, u64),
    ) -> Result<Result<Self, &'static str>, TwoPointsError> {
        let Some(person) = whom.all.first() else {
            return Err(TwoPointsError::Nobody(String::new()));
        };
        match whom.draw(person, population, (seed, index))? {
            Ok(wearer) => Self::from_wearer(wearer, seed, index),
            Err(missing) => Ok(Err(missing)),
        }
    }

    /// A forearm whose voltages are known, with the line of this draw.
    fn from_wearer(
        wearer: Wearer,
        seed: u64,
        index: u64,
    ) -> Result<Result<Self, &'static str>, TwoPointsError> {
        let Wearer {
            hand,
            voltages,
            extensor_v,
        } = wearer;
        if !is_range(extensor_v) {
            return Ok(Err("threshold and greatest voltage are one"));
        }
        let Plant { line, seed, .. } = Plant::random(seed, index);
        let mut drawn = Self {
            hand,
            line,
            seed,
            ways: [Actuation::from_ranges(Points::One, [None; 2], extensor_v); 2],
            holds_deg: [0.0; 2],
            wanted: Vec::new(),
        };
        Ok(match drawn.actuations(&voltages, extensor_v)? {
            Ok(ways) => {
                drawn.ways = ways;
                drawn.with_target()
            }
            Err(missing) => Err(missing),
        })
    }

    /// One point, the one that holds further, and two.
    fn actuations(
        &self,
        voltages: &Voltages,
        extensor_v: [f64; 2],
    ) -> Result<Result<[Actuation; 2], &'static str>, TwoPointsError> {
        let Voltages {
            threshold_v: [a, b],
            most_v: [most_a, most_b],
            ratio,
        } = *voltages;
        let Some(r) = ratio else {
            return Ok(Err("both points together move nothing"));
        };
        let pair = [[r * most_a, most_a], [r * most_b, most_b]];
        let mut one: Option<Actuation> = None;
        for ranges in [[Some([a, most_a]), None], [None, Some([b, most_b])]] {
            if ranges.iter().flatten().all(|range| is_range(*range)) {
                let way =
                    self.measure_range(Actuation::from_ranges(Points::One, ranges, extensor_v))?;
                one = one
                    .filter(|trajectory| trajectory.span_deg() >= way.span_deg())
                    .or(Some(way));
            }
        }
        let Some(one) = one.filter(|_| pair.into_iter().all(is_range)) else {
            return Ok(Err("threshold and greatest voltage are one"));
        };
        let two = self.measure_range(Actuation::from_ranges(
            Points::Two,
            pair.map(Some),
            extensor_v,
        ))?;
        Ok(Ok([one, two]))
    }

    /// With the target of what it holds.
    fn with_target(mut self) -> Result<Self, &'static str> {
        let [one, two] = self.ways.map(|way| way.held_deg);
        let [low, high] = [one[0].max(two[0]), one[1].min(two[1])];
        if high - low < LEAST_DEG {
            return Err("holds a range of less than 1°");
        }
        self.holds_deg = [low, high];
        let at = |ms: usize| {
            let wave = (TAU * HZ * ms as f64 / 1000.0).sin();
            low + (high - low) * (MIDDLE + SWING * wave)
        };
        self.wanted = (0..TRIAL_MS).map(at).collect();
        Ok(self)
    }

    /// This way with what it holds.
    fn measure_range(&self, way: Actuation) -> Result<Actuation, TwoPointsError> {
        let extended = self.held_angles_deg(&way, way.full_effort_volts(false))?;
        let flexed = self.held_angles_deg(&way, way.full_effort_volts(true))?;
        Ok(Actuation {
            fresh_deg: flexed[0],
            held_deg: [extended[0].max(extended[1]), flexed[0].min(flexed[1])],
            ..way
        })
    }

    /// Where these volts hold the finger in the third and in the last second, °.
    fn held_angles_deg(&self, way: &Actuation, volts: Volts) -> Result<[f64; 2], TwoPointsError> {
        let (mut hand, leads) = (self.moving()?, way.leads());
        leads.ground_used(&mut hand);
        let mut sums = [0.0; 2];
        for ms in 0..TRIAL_MS {
            leads.pulse(&mut hand, ms, volts);
            hand.advance((ms as u64 + 1) * 1000);
            for (sum, end) in sums.iter_mut().zip([FRESH_MS, TRIAL_MS]) {
                if (end - HELD_MS..end).contains(&ms) {
                    *sum += hand.angle_deg();
                }
            }
        }
        Ok(sums.map(|sum| sum / HELD_MS as f64))
    }

    fn moving(&self) -> Result<MovingHand, TwoPointsError> {
        let moving = MovingHand::new(&self.hand, CHANNELS, self.seed);
        moving.map_err(|e| TwoPointsError::Hand(InvalidHand::Segment(e)))
    }

    /// What happens while `driver` lets the finger follow, and stretches of time in
    /// which no consistent currents were found.
    ///
    /// # Errors
    /// The hand cannot be.
    pub fn run(
        &self,
        way: &Actuation,
        driver: &mut dyn Driver,
    ) -> Result<(Attempt, u64), HandsError> {
        let (mut hand, leads) = (self.moving()?, way.leads());
        let mut frames = Frames::new(self.line, self.seed);
        let mut angles = Vec::with_capacity(TRIAL_MS);
        leads.ground_used(&mut hand);
        for ms in 0..TRIAL_MS {
            let now_us = ms as u64 * 1000;
            frames.take(now_us, &self.wanted, hand.sensed_deg());
            frames.deliver(now_us, driver);
            let volts = driver.tick(device_time(now_us));
            leads.pulse(&mut hand, ms, volts);
            hand.advance(now_us + 1000);
            angles.push(hand.angle_deg() as f32);
        }
        let refused = driver.refused().map(str::to_owned);
        Ok((Attempt { angles, refused }, hand.uncomputed_intervals()))
    }

    /// RMSE from 10 to 30 s of a finger that is held in the middle of the target, as a
    /// part of the range: what any law should beat.
    pub const STILL: f64 = SWING * std::f64::consts::FRAC_1_SQRT_2;

    /// RMSE from 10 to 30 s of a finger that is not stimulated, °.
    pub fn at_rest_deg(&self) -> f64 {
        let scored = self.wanted.iter().skip(SCORED_FROM_MS);
        let squares = scored.map(|w| (w - REST_DEG[INDEX]).powi(2));
        (squares.sum::<f64>() / (TRIAL_MS - SCORED_FROM_MS) as f64).sqrt()
    }
}

impl Actuation {
    const fn from_ranges(
        points: Points,
        [a, b]: [Option<[f64; 2]>; 2],
        extensor_v: [f64; 2],
    ) -> Self {
        Self {
            points,
            ranges_v: [a, b, Some(extensor_v)],
            fresh_deg: 0.0,
            held_deg: [0.0; 2],
        }
    }
}

fn is_range([low, high]: [f64; 2]) -> bool {
    low < high
}
