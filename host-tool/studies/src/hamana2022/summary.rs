//! Summarises the random wearers of a cell: a line of the table, and rows and shares for
//! `result.json`.

use super::claims::{LATE, TOGETHER};
use super::population::Population;
use super::study::{Cell, DrawOutcome, Numbers};
use crate::laboratory::{Row, Share};
use host_core::statistics;

/// A cell and the outcomes of its random wearers.
#[derive(Clone, Debug)]
pub struct Summary {
    pub cell: Cell,
    /// Outcomes of the wearers, from index 0.
    pub drawn: Vec<DrawOutcome>,
}

/// Column heads of the claims, short enough for a table of 80 columns.
const SHORT: [&str; 8] = [
    "sel", "500us", "two>1", "C>I", "I=1", "C=I,1", "r_th", "post",
];

/// Wording of the share of draws whose searches succeed; the other shares count only these.
const FOUND: &str = "points and voltages found; only these draws are judged";

/// Function that returns a quantity of a wearer; `None` if the wearer has no value of it.
type Measure = fn(&Numbers) -> Option<f64>;

const TWO_ONE: &str = "two points over one, torque";
const APART: &str = "two points conducted over isolated, torque";
const ALIKE: &str = "one point conducted over isolated, torque";
/// Id, wording, unit and getter of each quantity.
const MEASURES: [(&str, &str, &str, Measure); 9] = [
    (TWO_ONE, "torque, two points / one point", "", |numbers| {
        Some(numbers.torques.two / numbers.torques.one)
    }),
    (
        APART,
        "torque of two points, conducted / isolated",
        "",
        |numbers| Some(numbers.torques.two / numbers.torques.apart),
    ),
    (
        "isolated two points over one, torque",
        "torque, two isolated points / one point",
        "",
        |numbers| Some(numbers.torques.apart / numbers.torques.one),
    ),
    (
        ALIKE,
        "torque of one point, conducted / isolated",
        "",
        |numbers| Some(numbers.torques.one / numbers.torques.one_isolated),
    ),
    (
        "individuation, both together",
        "individuation index, pulses 0 µs apart",
        "",
        |numbers| numbers.individuations[TOGETHER],
    ),
    (
        "individuation, 2000 µs apart",
        "individuation index, pulses 2000 µs apart",
        "",
        |numbers| numbers.individuations[LATE],
    ),
    ("r_th", "r_th", "", |numbers| numbers.voltages.ratio),
    (
        "one point loses by pronation",
        "angle lost by pronation, one point",
        "°",
        |numbers| Some(numbers.postures[0][0] - numbers.postures[0][2]),
    ),
    (
        "two points lose by pronation",
        "angle lost by pronation, two points",
        "°",
        |numbers| Some(numbers.postures[1][0] - numbers.postures[1][2]),
    ),
];

impl Cell {
    /// Returns the name in the table and in `draws.csv`, such as `curvature 1 searched`.
    #[must_use]
    pub fn name(&self) -> String {
        let volts = match self.volts {
            0.0 => "searched".to_owned(),
            part => format!("+{:.0} %", 100.0 * part),
        };
        match &self.without {
            Some(ablation) => format!("no {ablation}"),
            None => match self.balanced_skin {
                Some(skin) => format!("balanced {} skin {skin}", self.return_factor),
                None => format!("{} {} {volts}", self.rule, self.return_factor),
            },
        }
    }
}

impl Summary {
    fn complete_draws(&self) -> impl Iterator<Item = &Numbers> + Clone {
        self.drawn.iter().filter_map(|draw| match draw {
            DrawOutcome::Whole(numbers) => Some(&**numbers),
            DrawOutcome::NoPoints
            | DrawOutcome::NoCoupling
            | DrawOutcome::Held
            | DrawOutcome::NoVoltages => None,
        })
    }

    /// Counts the wearers for whom claim `index` holds, and those for whom it can be judged.
    fn holds(&self, index: usize) -> (u64, u64) {
        let judged = self
            .complete_draws()
            .filter_map(|numbers| numbers.claims()[index]);
        (
            judged.clone().filter(|flag| *flag).count() as u64,
            judged.count() as u64,
        )
    }

    /// Counts the wearers for whom every claim holds, and the wearers whose searches succeeded. A
    /// claim that cannot be judged counts as not holding.
    fn holds_jointly(&self) -> (u64, u64) {
        let joint_draws = self
            .complete_draws()
            .filter(|numbers| numbers.claims().iter().all(|c| *c == Some(true)));
        (
            joint_draws.count() as u64,
            self.complete_draws().count() as u64,
        )
    }

    /// Returns the column heads of the table that [`Self::line`] fills.
    #[must_use]
    pub fn head() -> String {
        let claims = SHORT.map(|short| format!("{short:>6}")).concat();
        format!("{:<23}{:>4}{claims}{:>5}", "cell", "n", "all")
    }

    /// Returns the cell's line of the table: the number of wearers with all numbers, and the
    /// percentage for whom each claim holds.
    #[must_use]
    pub fn line(&self) -> String {
        let percent = |(holds, total): (u64, u64)| match total {
            0 => "-".to_owned(),
            _ => format!("{:.0}", 100.0 * holds as f64 / total as f64),
        };
        let claims = (0..SHORT.len()).map(|index| format!("{:>6}", percent(self.holds(index))));
        let (claims, n) = (claims.collect::<String>(), self.complete_draws().count());
        let joint_share = percent(self.holds_jointly());
        format!("{:<23}{n:>4}{claims}{joint_share:>5}", self.cell.name())
    }

    /// Describes why wearers are missing, and the medians of the quantities that the claims
    /// compare.
    #[must_use]
    pub fn details(&self) -> String {
        let median = |id: &str| {
            let measure = MEASURES.iter().find(|measure| measure.0 == id);
            let middle =
                measure.and_then(|(_, _, _, quantity)| statistics::median(self.sorted(*quantity)));
            middle.map_or_else(|| "-".to_owned(), |value| format!("{value:.2}"))
        };
        format!(
            "  {}\n  median torque ratios: two points/one {}, C/I {}, C/I of one point {}",
            self.missing(),
            median(TWO_ONE),
            median(APART),
            median(ALIKE)
        )
    }

    /// Describes how many draws have no numbers, by reason.
    #[must_use]
    pub fn missing(&self) -> String {
        let count =
            |is: fn(&DrawOutcome) -> bool| self.drawn.iter().filter(|draw| is(draw)).count();
        let no_points = count(|draw| matches!(draw, DrawOutcome::NoPoints));
        let no_volts = count(|draw| matches!(draw, DrawOutcome::NoVoltages));
        // This reason exists only if thresholds other than A's are known.
        let unlike = match count(|draw| matches!(draw, DrawOutcome::NoCoupling | DrawOutcome::Held))
        {
            0 => String::new(),
            some => format!(", without the given thresholds {some}"),
        };
        format!("draws without points {no_points}{unlike}, without voltages {no_volts}")
    }

    /// Returns the finite values of a quantity in ascending order.
    fn sorted(&self, measure: Measure) -> Vec<f64> {
        let values = self.complete_draws().filter_map(measure);
        let mut finite_values: Vec<f64> = values.filter(|value| value.is_finite()).collect();
        finite_values.sort_unstable_by(f64::total_cmp);
        finite_values
    }

    /// Returns for each quantity its median and range over the wearers. The paper prints none of
    /// them for a population.
    #[must_use]
    pub fn rows(&self) -> Vec<Row> {
        let name = self.cell.name();
        let row = |(id, words, unit, measure): &(&str, &str, &str, Measure)| {
            let (id, quantity) = (format!("{name}/{id}"), format!("{words}: {name}"));
            Row::from_numbers(id, quantity, unit, None, self.sorted(*measure))
        };
        MEASURES.iter().map(row).collect()
    }

    /// Returns the share of wearers for whom each claim holds, the share for whom all claims hold,
    /// and the share whose searches succeed.
    #[must_use]
    pub fn shares(&self, population: &Population) -> Vec<Share> {
        let claims = population.claims.iter().enumerate();
        let judgements = claims.map(|(index, claim)| (&*claim.id, &*claim.says, self.holds(index)));
        let jointly = ("all", "all claims in one wearer", self.holds_jointly());
        let share = |(id, says, cases): (&str, &str, (u64, u64))| Share {
            at: self.cell.name(),
            ..Share::from_counts(id.to_owned(), says.to_owned(), Some(true), cases)
        };
        let found = (
            self.complete_draws().count() as u64,
            self.drawn.len() as u64,
        );
        let found = Share {
            paper: None,
            ..share(("found", FOUND, found))
        };
        judgements
            .chain([jointly])
            .map(share)
            .chain([found])
            .collect()
    }
}
