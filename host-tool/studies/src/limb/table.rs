//! Presents the study as rows, verdicts and CSV.

use super::compared::spread;
use super::{ArmScore, ArmScores, Method, Spread, Study};
use host_core::statistics::wilson_share;
use serde::Serialize;

/// Row of the result table: one quantity with its spread over arms or postures.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    /// Unique key of the row.
    pub id: String,
    /// Description of the quantity, with its method or number format.
    pub quantity: String,
    /// Unit of `ours`, `p95` and `most`.
    pub unit: &'static str,
    /// Always `None`: the paper prints none of these quantities.
    pub paper: Option<f64>,
    /// Median over arms or postures.
    pub ours: f64,
    /// 95th percentile over arms or postures.
    pub p95: f64,
    /// Maximum over arms or postures.
    pub most: f64,
    /// Number of arms or postures.
    pub n: u64,
}

/// A claim, with the number of random arms on which it holds.
#[derive(Clone, Debug, Serialize)]
pub struct Verdict {
    /// The claim as a sentence.
    pub claim: String,
    /// Number of arms on which the claim holds.
    pub holds: u64,
    /// Number of arms on which the claim was judged.
    pub of: u64,
    /// Share of arms on which the claim holds, and both ends of its 95 % interval by Wilson, 0 to
    /// 1.
    pub share: [f64; 3],
}

/// Quantity in an arm's score: its key, description, unit, and a function that returns it.
type Quantity = (
    &'static str,
    &'static str,
    &'static str,
    fn(&ArmScore) -> f64,
);

const QUANTITIES: [Quantity; 5] = [
    ("targets", "error at 12 targets, RMS", "%", |s| {
        s.targets_rmse_percent
    }),
    ("walk", "walk error, 200 Hz, RMS", "%", |s| {
        s.walk_rmse_percent
    }),
    ("held", "walk error, 20 Hz, RMS", "%", |s| {
        s.held_rmse_percent
    }),
    ("step", "largest step, of maximum", "%", |s| {
        s.largest_step_percent
    }),
    ("switches", "on/off changes per walk", "", |s| s.switches),
];

impl Study {
    /// Returns one row for each quantity and method, then the rows about the device's number
    /// format.
    #[must_use]
    pub fn rows(&self) -> Vec<Row> {
        let mut rows = Vec::new();
        let row = |id: String, quantity: String, unit, spread: Spread, n| Row {
            id,
            quantity,
            unit,
            paper: None,
            ours: spread.median,
            p95: spread.p95,
            most: spread.most,
            n,
        };
        let arms = self.arms.len() as u64;
        for (key, words, unit, quantity) in QUANTITIES {
            for (n, method) in Method::ALL.into_iter().enumerate() {
                let spread = spread(&self.arms, n, quantity);
                let words = format!("{}: {words}", method.name());
                rows.push(row(
                    format!("{method:?}_{key}").to_lowercase(),
                    words,
                    unit,
                    spread,
                    arms,
                ));
            }
        }
        let numbers = &self.numbers;
        let mut number = |id: &str, words: &str, unit, spread| {
            rows.push(row(
                id.to_owned(),
                words.to_owned(),
                unit,
                spread,
                numbers.n,
            ));
        };
        let missed = "nearest neighbour, exact: relative force error";
        number(
            "numbers_recruitment",
            missed,
            "%",
            numbers.recruitment_percent,
        );
        for (key, kind, error) in [
            ("device", "device (micromath)", &numbers.device),
            ("rounding", "rounding alone", &numbers.rounding),
        ] {
            number(
                &format!("{key}_hand"),
                &format!("{kind}: error of hand position"),
                "mm",
                error.hand_mm,
            );
            let words = format!("{kind}: relative force error");
            number(&format!("{key}_force"), &words, "%", error.force_percent);
            let words = format!("{kind}: share of what is missed");
            number(&format!("{key}_share"), &words, "%", error.share_percent);
        }
        rows
    }

    /// Judges the declared claims; claims without a rule are left out.
    #[must_use]
    pub fn verdicts(&self) -> Vec<Verdict> {
        let claims = self.declared.claim.iter();
        claims
            .filter_map(|claim| {
                let holds = rule(&claim.name)?;
                let held = self.arms.iter().filter(|arm| holds(arm)).count() as u64;
                let total = self.arms.len() as u64;
                let wilson = wilson_share(held as f64, total, 0.95).ok()?;
                Some(Verdict {
                    claim: claim.says.clone(),
                    holds: held,
                    of: total,
                    share: [wilson.share, wilson.low, wilson.high],
                })
            })
            .collect()
    }

    /// Formats all rows, then all verdicts, as CSV.
    #[must_use]
    pub fn csv(&self) -> String {
        let mut csv = "id,unit,median,p95,most,n\n".to_owned();
        for row in self.rows() {
            let Row {
                id,
                unit,
                ours,
                p95,
                most,
                n,
                ..
            } = row;
            csv.push_str(&format!("{id},{unit},{ours:.4},{p95:.4},{most:.4},{n}\n"));
        }
        for verdict in self.verdicts() {
            let Verdict {
                claim, holds, of, ..
            } = verdict;
            csv.push_str(&format!("\"{claim}\",arms,{holds},,,{of}\n"));
        }
        csv
    }
}

/// Returns the rule that judges the claim `name` on one arm, or `None` if there is none.
fn rule(name: &str) -> Option<fn(&ArmScores) -> bool> {
    Some(match name {
        "misses_less" => {
            |[nearest, squares, _]| squares.targets_rmse_percent < nearest.targets_rmse_percent
        }
        "switches_less" => {
            |[nearest, squares, _]| squares.largest_step_percent < nearest.largest_step_percent
        }
        "smooth_switches_less" => {
            |[_, squares, smooth]| smooth.largest_step_percent < squares.largest_step_percent
        }
        "slow_is_no_worse" => {
            |[nearest, ..]| nearest.held_rmse_percent <= 1.1 * nearest.walk_rmse_percent
        }
        _ => return None,
    })
}
