//! A drawn hand, its searches done, and what it holds.

use super::HandsError;
use super::leads::Leads;
use crate::tracking::driver::Driver;
use crate::tracking::plant::{Line, Plant};
use crate::tracking::trial::{Attempt, Frames, SCORED_FROM_MS, TRIAL_MS, device_time};
use crate::tracking::wearer::{Points, Volts};
use crate::two_points::{
    Known, Population, Prepared, TwoPointsError, Voltages, prepare, search_extensor,
};
use hal_sim::body::Body;
use hal_sim::body::hand::digits::{INDEX, REST_DEG};
use hal_sim::body::hand::spec::{A, B, E, RETURN};
use hal_sim::body::hand::{Hand, InvalidHand, MovingHand};
use std::f64::consts::TAU;

/// Electrodes A, B and E are on channels 0, 1, 2.
const CHANNELS: [usize; RETURN] = [A, B, E];
/// A rested hand is at its greatest angle within this time, ms.
const FRESH_MS: usize = 3_000;
/// What is held is the mean over this last time, ms.
const HELD_MS: usize = 1_000;
/// Who holds less in the end holds nothing, °: the glove's noise is 0.3.
const LEAST_DEG: f64 = 1.0;
/// The target, declared before any hand was driven: a sine between 15 % and 85 % of what
/// is held, at Hamana 2022's 0.2 Hz.
const MIDDLE: f64 = 0.5;
const SWING: f64 = 0.35;
const HZ: f64 = 0.2;

/// One way to bend the finger: one point or two.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Way {
    /// Which.
    pub points: Points,
    /// Threshold and greatest voltage of A, B and E, V; of a point that is used.
    pub ranges_v: [Option<[f64; 2]>; RETURN],
    /// How far above rest greatest voltages bend the finger at most in the first 3 s, °.
    pub fresh_deg: f64,
    /// How far they still hold it after 30 s without rest, °.
    pub held_deg: f64,
}

/// A hand that laws drive.
#[derive(Clone, Debug)]
pub struct Drawn {
    hand: Hand,
    line: Line,
    seed: u64,
    /// One-point (the point that holds further) and two-point.
    pub ways: [Way; 2],
    /// How far above rest it holds with either, °: what the target is made of.
    pub holds_deg: f64,
    /// The wanted angle each millisecond, °.
    pub wanted: Vec<f64>,
}

impl Way {
    /// The leads that are used.
    pub const fn leads(&self) -> Leads {
        let [a, b, e] = &self.ranges_v;
        Leads {
            used: [a.is_some(), b.is_some(), e.is_some()],
        }
    }

    /// Flexors at their greatest voltages, the extensor silent.
    fn flexing(&self) -> Volts {
        let greatest = |point: usize| self.ranges_v[point].map_or(0.0, |range| range[1]);
        [greatest(A), greatest(B), 0.0]
    }
}

impl Drawn {
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
        let person = population.person(seed, index)?;
        let known = Known::drawn(&person);
        let Prepared {
            mut hand, voltages, ..
        } = match prepare(&person.spec, known)? {
            Ok(prepared) => prepared,
            Err(_) => return Ok(Err("no two points that bend the finger alone")),
        };
        let Some(extensor_v) = search_extensor(&mut hand, known.most_v)? else {
            return Ok(Err("nothing extends the finger, or the wrist comes first"));
        };
        if !is_range(extensor_v) {
            return Ok(Err("threshold and greatest voltage are one"));
        }
        let Plant { line, seed, .. } = Plant::drawn(seed, index);
        let mut drawn = Self {
            hand,
            line,
            seed,
            ways: [Way::of(Points::One, [None; 2], extensor_v); 2],
            holds_deg: 0.0,
            wanted: Vec::new(),
        };
        Ok(match drawn.ways_of(&voltages, extensor_v)? {
            Ok(ways) => {
                drawn.ways = ways;
                drawn.aim()
            }
            Err(missing) => Err(missing),
        })
    }

    /// One point, the one that holds further, and two.
    fn ways_of(
        &self,
        voltages: &Voltages,
        extensor_v: [f64; 2],
    ) -> Result<Result<[Way; 2], &'static str>, TwoPointsError> {
        let Voltages {
            threshold_v: [a, b],
            most_v: [most_a, most_b],
            ratio,
        } = *voltages;
        let Some(r) = ratio else {
            return Ok(Err("both points together move nothing"));
        };
        let pair = [[r * most_a, most_a], [r * most_b, most_b]];
        let mut one: Option<Way> = None;
        for ranges in [[Some([a, most_a]), None], [None, Some([b, most_b])]] {
            if ranges.iter().flatten().all(|range| is_range(*range)) {
                let way = self.held(Way::of(Points::One, ranges, extensor_v))?;
                one = one.filter(|it| it.held_deg >= way.held_deg).or(Some(way));
            }
        }
        let Some(one) = one.filter(|_| pair.into_iter().all(is_range)) else {
            return Ok(Err("threshold and greatest voltage are one"));
        };
        let two = self.held(Way::of(Points::Two, pair.map(Some), extensor_v))?;
        Ok(Ok([one, two]))
    }

    /// With the target of what it holds.
    fn aim(mut self) -> Result<Self, &'static str> {
        let held = self.ways.map(|way| way.held_deg);
        self.holds_deg = held[0].min(held[1]);
        if self.holds_deg < LEAST_DEG {
            return Err("holds less than 1° in the end");
        }
        let at = |ms: usize| {
            let wave = (TAU * HZ * ms as f64 / 1000.0).sin();
            REST_DEG[INDEX] + self.holds_deg * (MIDDLE + SWING * wave)
        };
        self.wanted = (0..TRIAL_MS).map(at).collect();
        Ok(self)
    }

    /// How far above rest this way's greatest voltages bend and hold the finger.
    fn held(&self, way: Way) -> Result<Way, TwoPointsError> {
        let (mut hand, leads) = (self.moving()?, way.leads());
        leads.begin(&mut hand);
        let (mut fresh_deg, mut sum) = (0.0, 0.0);
        for ms in 0..TRIAL_MS {
            leads.pulse(&mut hand, ms, way.flexing());
            hand.advance((ms as u64 + 1) * 1000);
            let bent = hand.angle_deg() - REST_DEG[INDEX];
            if ms < FRESH_MS {
                fresh_deg = bent.max(fresh_deg);
            }
            if ms >= TRIAL_MS - HELD_MS {
                sum += bent;
            }
        }
        Ok(Way {
            fresh_deg,
            held_deg: sum / HELD_MS as f64,
            ..way
        })
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
    pub fn run(&self, way: &Way, driver: &mut dyn Driver) -> Result<(Attempt, u64), HandsError> {
        let (mut hand, leads) = (self.moving()?, way.leads());
        let mut frames = Frames::new(self.line, self.seed);
        let mut angles = Vec::with_capacity(TRIAL_MS);
        leads.begin(&mut hand);
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
        Ok((Attempt { angles, refused }, hand.unsettled()))
    }

    /// RMSE from 10 to 30 s of a finger that stays at rest, °: what any law should beat.
    pub fn at_rest_deg(&self) -> f64 {
        let scored = self.wanted.iter().skip(SCORED_FROM_MS);
        let squares = scored.map(|w| (w - REST_DEG[INDEX]).powi(2));
        (squares.sum::<f64>() / (TRIAL_MS - SCORED_FROM_MS) as f64).sqrt()
    }
}

impl Way {
    const fn of(points: Points, [a, b]: [Option<[f64; 2]>; 2], extensor_v: [f64; 2]) -> Self {
        Self {
            points,
            ranges_v: [a, b, Some(extensor_v)],
            fresh_deg: 0.0,
            held_deg: 0.0,
        }
    }
}

fn is_range([low, high]: [f64; 2]) -> bool {
    low < high
}
