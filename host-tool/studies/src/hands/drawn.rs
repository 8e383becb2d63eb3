//! Prepares a random hand for control: searches its voltages and measures the angles that it can
//! hold.

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
use hal_sim::body::hand::spec::{A, B, E, HandSpec, RETURN};
use hal_sim::body::hand::{Hand, InvalidHand, MovingHand};
use std::f64::consts::TAU;

/// Channels of the two flexor electrodes A and B and of the extensor electrode E.
const CHANNELS: [usize; RETURN] = [A, B, E];
/// Time over which a held angle is averaged, ms.
const HELD_MS: usize = 1_000;
/// Time at which the held angle of a rested muscle is measured, ms: the average ends here. Another
/// ends with the trial.
const FRESH_MS: usize = 3_000;
/// Smallest range of angles that a hand must hold to take part, °. The noise of the glove is 0.3°.
const LEAST_DEG: f64 = 1.0;
/// Middle of the sinusoidal reference, as a fraction of the range that the hand holds.
const MIDDLE: f64 = 0.5;
/// Amplitude of the reference as a fraction of that range; the reference thus goes from 15 % to 85
/// %.
const SWING: f64 = 0.35;
/// Frequency of the reference, Hz (Hamana 2022).
const HZ: f64 = 0.2;

/// A way to actuate the finger: its stimulation points with their voltages, and the angles that it
/// holds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Actuation {
    pub points: Points,
    /// Threshold and largest voltage of the electrodes A, B and E, V; `None` for an unused
    /// electrode.
    pub ranges_v: [Option<[f64; 2]>; RETURN],
    /// Angle that full flexion holds in a rested hand, after 3 s, °.
    pub fresh_deg: f64,
    /// Smallest and largest angle that this actuation can hold throughout a trial, °. At each end
    /// it is the less extreme of the angles that full effort holds after 3 s and after 30 s.
    pub held_deg: [f64; 2],
}

/// A hand that controllers can drive, with its reference.
#[derive(Clone, Debug)]
pub struct DrivenHand {
    hand: Hand,
    line: Line,
    seed: u64,
    /// Actuation with one point, which is the one that holds the larger range, and actuation with
    /// two points.
    pub ways: [Actuation; 2],
    /// Smallest and largest angle that the hand holds with either actuation, °. The reference is
    /// scaled to this range.
    pub holds_deg: [f64; 2],
    /// Reference angle at each millisecond of the trial, °.
    pub wanted: Vec<f64>,
}

impl Actuation {
    /// Returns which leads this actuation uses.
    pub const fn leads(&self) -> Leads {
        let [a, b, e] = &self.ranges_v;
        Leads {
            used: [a.is_some(), b.is_some(), e.is_some()],
        }
    }

    /// Returns the voltages of full flexion, or of full extension. The antagonist is at its
    /// threshold, as in the device (Hamana 2022, equations 7 to 12).
    fn full_effort_volts(&self, flexion: bool) -> Volts {
        let at = |point: usize| {
            let works = (point == E) != flexion;
            self.ranges_v[point].map_or(0.0, |range| range[usize::from(works)])
        };
        [at(A), at(B), at(E)]
    }

    /// Returns the width of the range of angles that this actuation holds, °.
    fn span_deg(&self) -> f64 {
        self.held_deg[1] - self.held_deg[0]
    }
}

impl DrivenHand {
    /// Generates hand `index` of the population and prepares it for control, or returns the reason
    /// why no law can drive it. Delays and losses of the link are those of the simulated finger
    /// with the same seed and index.
    ///
    /// # Errors
    /// Fails if the declaration cannot be read or the hand is invalid.
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
        let extensor_v = search_extensor(&mut hand, known.most_v)?;
        let wearer = Wearer {
            hand,
            voltages,
            extensor_v,
        };
        Self::from_wearer(wearer, seed, index)
    }

    /// Generates draw `index` of the first person of `whom`, whose forearm is random except for
    /// what is known about the person, and prepares it. Returns the reason if no law can drive it.
    /// The link is that of [`Self::draw`].
    ///
    /// # Errors
    /// Fails if the declaration cannot be read, `whom` is empty, or the hand is invalid.
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

    /// Prepares a forearm whose voltages are known, with the link of this draw, or returns the
    /// reason why no law can drive it.
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
        let Some(extensor_v) = extensor_v else {
            return Ok(Err("nothing extends the finger, or the wrist comes first"));
        };
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

    /// Measures the actuation with point A, with point B and with both. Returns that with the
    /// better single point and that with both points, or the reason why there are none.
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
        let mut better_point: Option<Actuation> = None;
        for ranges in [[Some([a, most_a]), None], [None, Some([b, most_b])]] {
            if ranges.iter().flatten().all(|range| is_range(*range)) {
                let way =
                    self.measure_range(Actuation::from_ranges(Points::One, ranges, extensor_v))?;
                better_point = better_point
                    .filter(|trajectory| trajectory.span_deg() >= way.span_deg())
                    .or(Some(way));
            }
        }
        let Some(one_point) = better_point.filter(|_| pair.into_iter().all(is_range)) else {
            return Ok(Err("threshold and greatest voltage are one"));
        };
        let two = self.measure_range(Actuation::from_ranges(
            Points::Two,
            pair.map(Some),
            extensor_v,
        ))?;
        Ok(Ok([one_point, two]))
    }

    /// Adds the reference, scaled to the range that the hand holds with either actuation; returns
    /// the reason if that range is too small.
    fn with_target(mut self) -> Result<Self, &'static str> {
        let [one, two] = self.ways.map(|way| way.held_deg);
        let [low, high] = [one[0].max(two[0]), one[1].min(two[1])];
        if high - low < LEAST_DEG {
            return Err("holds a range of less than 1°");
        }
        self.holds_deg = [low, high];
        let at = |ms: usize| {
            let wave = libm::sin(TAU * HZ * ms as f64 / 1000.0);
            low + (high - low) * (MIDDLE + SWING * wave)
        };
        self.wanted = (0..TRIAL_MS).map(at).collect();
        Ok(self)
    }

    /// Measures the angles that `way` holds and returns it with them.
    fn measure_range(&self, way: Actuation) -> Result<Actuation, TwoPointsError> {
        let extended = self.held_angles_deg(&way, way.full_effort_volts(false))?;
        let flexed = self.held_angles_deg(&way, way.full_effort_volts(true))?;
        Ok(Actuation {
            fresh_deg: flexed[0],
            held_deg: [extended[0].max(extended[1]), flexed[0].min(flexed[1])],
            ..way
        })
    }

    /// Returns the mean angle at which these constant voltages hold the finger in the third second
    /// and in the last second of a trial, °.
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

    /// Returns the parameters of the hand, which no control law knows.
    pub const fn spec(&self) -> &HandSpec {
        self.hand.spec()
    }

    /// Returns the torques of flexors and extensor of the index finger while these voltages are
    /// applied to a rested hand: means over the third second, N·m.
    ///
    /// # Errors
    /// Fails if the circuit cannot be solved.
    pub fn torques_nm(&self, way: &Actuation, volts: Volts) -> Result<[f64; 2], TwoPointsError> {
        let (mut hand, leads) = (self.moving()?, way.leads());
        leads.ground_used(&mut hand);
        let mut sums = [0.0; 2];
        for ms in 0..FRESH_MS {
            leads.pulse(&mut hand, ms, volts);
            hand.advance((ms as u64 + 1) * 1000);
            if ms >= FRESH_MS - HELD_MS {
                let torques = hand.torques();
                sums[0] += torques.flexors_nm[INDEX];
                sums[1] += torques.extensor_nm;
            }
        }
        Ok(sums.map(|sum| sum / HELD_MS as f64))
    }

    /// Returns the rested hand with its electrodes A, B and E on channels 0, 1 and 2.
    ///
    /// # Errors
    /// Fails if the circuit cannot be solved.
    pub fn moving(&self) -> Result<MovingHand, TwoPointsError> {
        let moving = MovingHand::new(&self.hand, CHANNELS, self.seed);
        moving.map_err(|e| TwoPointsError::Hand(InvalidHand::Segment(e)))
    }

    /// Runs one trial in which `driver` makes the finger follow the reference. Returns the attempt,
    /// and the number of time intervals in which the simulation found no consistent currents.
    ///
    /// # Errors
    /// Fails if the hand is invalid.
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

    /// RMSE from 10 to 30 s of a finger that stays in the middle of the reference, as a fraction of
    /// the range that the hand holds. Every law should do better.
    pub const STILL: f64 = SWING * std::f64::consts::FRAC_1_SQRT_2;

    /// Returns the RMSE from 10 to 30 s of a finger that is not stimulated and stays at rest, °.
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
