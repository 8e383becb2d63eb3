//! How steady a hand holds (Hamana 2022, III-D6b): ten seconds of one pattern.

use super::error::TwoPointsError;
use super::pattern::Pattern;
use super::population::Population;
use super::wearers::Wearer;
use hal_sim::body::hand::network::Terminal;
use hal_sim::body::hand::spec::{A, B};
use hal_sim::body::hand::{InvalidHand, MovingHand, Segment};
use hal_sim::body::{Body, Drive, Lead};

/// How long, µs.
const HOLD_US: u64 = 10_000_000;
/// Rows of a course, µs.
const ROW_US: u64 = 20_000;

/// The index finger's angle over ten seconds, every 20 ms, °.
#[derive(Clone, Debug, PartialEq)]
pub struct Hold {
    /// From the first pulse on.
    pub course_deg: Vec<f64>,
}

impl Hold {
    /// Its greatest angle, °.
    #[must_use]
    pub fn greatest_deg(&self) -> f64 {
        self.course_deg.iter().copied().fold(0.0, f64::max)
    }

    /// From the greatest angle to that at 10 s, °.
    #[must_use]
    pub fn sinks_deg(&self) -> f64 {
        let last = self.course_deg.last().copied().unwrap_or(0.0);
        self.greatest_deg() - last
    }
}

/// Lets `hand` feel `period` over and over.
fn course(hand: &mut MovingHand, channels: [usize; 3], period: &[Segment]) -> Vec<f64> {
    let (mut at_us, mut course) = (0, Vec::new());
    while at_us < HOLD_US {
        for segment in period {
            for (channel, terminal) in channels.into_iter().zip(segment.terminals) {
                let lead = match terminal {
                    Terminal::Driven(v) if v < 0.0 => Lead::Cathodic(Drive::Volts(-v)),
                    Terminal::Driven(v) => Lead::Anodic(Drive::Volts(v)),
                    Terminal::Grounded => Lead::Grounded,
                    Terminal::Floating => Lead::Floating,
                };
                hand.lead(at_us, channel, lead);
            }
            at_us += u64::from(segment.lasts_us);
        }
        hand.advance(at_us);
        if at_us.is_multiple_of(ROW_US) {
            course.push(hand.angle_deg());
        }
    }
    course
}

impl Wearer {
    /// One point (the one that bends further, isolated) and two, each at their greatest
    /// voltages, in trial `number`.
    ///
    /// # Errors
    /// The hand cannot be.
    pub fn hold(&self, population: &Population, number: u64) -> Result<[Hold; 2], TwoPointsError> {
        let fitted = self.fitted(population, number);
        let play = |pattern: Pattern| {
            let mut hand = fitted.moving(number).map_err(TwoPointsError::Hand)?;
            let period = pattern.period(self.voltages.most_v);
            let course_deg = course(&mut hand, fitted.channels, &period);
            match hand.unsettled() {
                0 => Ok(Hold { course_deg }),
                _ => Err(TwoPointsError::Hand(InvalidHand::Segment(UNSETTLED))),
            }
        };
        let [a, b] = [play(Pattern::alone(A))?, play(Pattern::alone(B))?];
        let better = match a.greatest_deg() >= b.greatest_deg() {
            true => a,
            false => b,
        };
        Ok([better, play(Pattern::usual())?])
    }
}

const UNSETTLED: hal_sim::body::hand::network::InvalidSegment =
    hal_sim::body::hand::network::InvalidSegment::Unsettled;
