//! Simulates how steadily a hand holds during ten seconds of one pattern (Hamana 2022, III-D6b).

use super::error::TwoPointsError;
use super::pattern::Pattern;
use super::population::Population;
use super::wearers::Wearer;
use hal_sim::body::hand::digits::INDEX;
use hal_sim::body::hand::network::Terminal;
use hal_sim::body::hand::pools::DIGITS;
use hal_sim::body::hand::spec::{A, B};
use hal_sim::body::hand::{Hand, InvalidHand, MovingHand, Segment};
use hal_sim::body::{Body, Drive, Lead};
use serde::{Deserialize, Serialize};

/// Duration of the stimulation during which the finger should keep its angle, µs.
const HOLD_US: u64 = 10_000_000;
/// Time between two recorded angles, µs.
const ROW_US: u64 = 20_000;

/// Angle of the index finger during ten seconds of one pattern.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Hold {
    /// Pattern that was stimulated.
    pub pattern: Pattern,
    /// Angle every 20 ms from the first pulse on, °.
    pub course_deg: Vec<f64>,
}

impl Hold {
    /// Returns the largest angle of the ten seconds, °.
    #[must_use]
    pub fn greatest_deg(&self) -> f64 {
        self.course_deg.iter().copied().fold(0.0, f64::max)
    }

    /// Returns the angle at 10 s, °.
    #[must_use]
    pub fn last_deg(&self) -> f64 {
        self.course_deg.last().copied().unwrap_or(0.0)
    }

    /// Returns the loss from the largest angle to that at 10 s, °.
    #[must_use]
    pub fn drop_deg(&self) -> f64 {
        self.greatest_deg() - self.last_deg()
    }
}

/// Repeats `period` on `hand` for `lasts_us` and returns the angles of all digits every 20 ms, °.
fn course(
    hand: &mut MovingHand,
    channels: [usize; 3],
    period: &[Segment],
    lasts_us: u64,
) -> Vec<[f64; DIGITS]> {
    let (mut at_us, mut course) = (0, Vec::new());
    while at_us < lasts_us {
        for segment in period {
            for (channel, terminal) in channels.into_iter().zip(segment.terminals) {
                let lead = match terminal {
                    Terminal::Driven(v) if v < 0.0 => Lead::Cathodic(Drive::Volts(-v)),
                    Terminal::Driven(v) => Lead::Anodic(Drive::Volts(v)),
                    Terminal::Grounded => Lead::Grounded,
                    Terminal::Floating => Lead::Floating,
                };
                hand.set_lead(at_us, channel, lead);
            }
            at_us += u64::from(segment.lasts_us);
        }
        hand.advance(at_us);
        if at_us.is_multiple_of(ROW_US) {
            course.push(hand.angles_deg());
        }
    }
    course
}

impl Wearer {
    /// Returns the angles of all digits of the moving hand, thumb first, every 20 ms for `lasts_us`
    /// from the first pulse on, °. In trial `number`, stimulates `pattern` at the largest voltages
    /// with the forearm at `pronated_deg`.
    ///
    /// # Errors
    /// Fails if the hand is invalid.
    pub fn digit_angles(
        &self,
        population: &Population,
        number: u64,
        (pattern, pronated_deg): (Pattern, f64),
        lasts_us: u64,
    ) -> Result<Vec<[f64; DIGITS]>, TwoPointsError> {
        let fitted = self.fit_for_trial(population, number);
        let mut hand = Hand::new(fitted.spec.clone(), fitted.points)?;
        hand.factor = fitted.factor;
        hand.shift(pronated_deg, fitted.shift_m);
        let mut moving = MovingHand::new(&hand, fitted.channels, number)?;
        let period = pattern.period(self.voltages.most_v);
        let angles = course(&mut moving, fitted.channels, &period, lasts_us);
        match moving.uncomputed_intervals() {
            0 => Ok(angles),
            _ => Err(TwoPointsError::Hand(InvalidHand::Segment(UNSETTLED))),
        }
    }

    /// Stimulates a pattern for ten seconds and records the angle of the index finger. The
    /// arguments are those of [`Self::digit_angles`].
    ///
    /// # Errors
    /// Fails if the hand is invalid.
    pub fn hold_pattern(
        &self,
        population: &Population,
        number: u64,
        (pattern, pronated_deg): (Pattern, f64),
    ) -> Result<Hold, TwoPointsError> {
        let angles = self.digit_angles(population, number, (pattern, pronated_deg), HOLD_US)?;
        Ok(Hold {
            pattern,
            course_deg: angles.iter().map(|values| values[INDEX]).collect(),
        })
    }

    /// Stimulates one point and then two points, each for ten seconds at the largest voltages, in
    /// trial `number`. The one point is A or B, isolated, whichever bends the finger further.
    ///
    /// # Errors
    /// Fails if the hand is invalid.
    pub fn hold(&self, population: &Population, number: u64) -> Result<[Hold; 2], TwoPointsError> {
        let play = |pattern: Pattern| self.hold_pattern(population, number, (pattern, 0.0));
        let [a, b] = [
            play(Pattern::isolated_point(A))?,
            play(Pattern::isolated_point(B))?,
        ];
        let better = match a.greatest_deg() >= b.greatest_deg() {
            true => a,
            false => b,
        };
        Ok([better, play(Pattern::default_two_point())?])
    }
}

const UNSETTLED: hal_sim::body::hand::network::InvalidSegment =
    hal_sim::body::hand::network::InvalidSegment::Unsettled;
