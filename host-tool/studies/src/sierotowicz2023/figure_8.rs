//! Draws figure 8: root mean square errors by axis and condition, and Mann–Whitney tests.

use super::course::Condition;
use super::metrics::{Target, force, median, size};
use super::replication::{Replication, people};
use crate::laboratory::{Bar, Grid, Plot, Plots, Sheet, SheetAxis};
use host_core::statistics::{Spread, mann_whitney, mean};

/// Labels of the components of a force, then of its magnitude.
const AXES: [&str; 4] = ["x", "y", "z", "norm"];
/// Conditions that the figure shows, as in the paper.
const SHOWN: [&str; 4] = ["C1", "C2", "C3", "C4"];
/// Pairs of conditions that are tested against each other, with the paper's p for each of [`AXES`].
const PAIRS: [(&str, &str, [&str; 4]); 3] = [
    (
        "C2",
        "C3",
        ["< 0.001, less", "< 0.05, more", "-", "< 0.01, less"],
    ),
    ("C2", "C4", ["?", "?", "-", "< 0.05"]),
    ("C3", "C4", ["?", "?", "-", "?"]),
];
/// Significance level of the paper.
const SIGNIFICANT: f64 = 0.05;

/// Returns the absolute error of a target along an axis, or the magnitude of the error for the last
/// of [`AXES`], N.
fn error_n(of: &Target, axis: usize) -> f64 {
    let off: [f64; 3] = std::array::from_fn(|at| force(of.measured)[at] - of.wanted_n[at]);
    off.get(axis).map_or_else(|| size(off), |value| value.abs())
}

/// Returns the errors of all targets of all participants of a study, N.
fn errors_n(of: &Replication, name: &str, axis: usize) -> Vec<f64> {
    let each = of.people.iter().filter_map(|wearer| wearer.condition(name));
    let targets = each.flat_map(|condition| &condition.targets);
    targets.map(|target| error_n(target, axis)).collect()
}

/// Plots each condition's error beside the largest reference force, along each axis.
pub(super) fn figure(all: &[Replication]) -> Sheet {
    let plots: Vec<Plot> = (0..AXES.len()).map(|axis| plot(all, axis)).collect();
    let caption = "Root mean square error (RMSE) and largest reference force of each condition, \
                   along x (forward), y (left) and z (up), and of the force vector (norm): means \
                   over participants, with the 5th to 95th percentile, simulated. The paper shows \
                   the same for its three participants, as a picture without numbers. The table \
                   below has the tests.";
    Sheet::figure(
        "Figure 8",
        "errors by axis and condition",
        caption.to_owned(),
        Plots {
            beside: 2,
            series: ["RMSE", "largest reference"].map(str::to_owned).to_vec(),
            plots,
        },
    )
}

fn plot(all: &[Replication], axis: usize) -> Plot {
    let of = |name: &str, pick: fn(&Condition) -> [f64; 4]| {
        let each = people(all).filter_map(|wearer| wearer.condition(name));
        each.map(|condition| pick(condition)[axis])
            .collect::<Vec<f64>>()
    };
    let (mut bars, mut most) = (Vec::new(), 0.0_f64);
    for (place, name) in SHOWN.into_iter().enumerate() {
        let picks: [fn(&Condition) -> [f64; 4]; 2] = [
            |condition| condition.measures.rmse_n,
            |condition| condition.measures.range_n,
        ];
        for (series, pick) in picks.into_iter().enumerate() {
            let each = of(name, pick);
            let Some((value, spread)) = mean(&each).zip(Spread::of(&each)) else {
                continue;
            };
            let left = place as f64 - 0.38 + 0.39 * series as f64;
            most = most.max(spread.high);
            bars.push(Bar {
                series,
                x: [left, left + 0.36],
                value,
                range: Some([spread.low, spread.high]),
            });
        }
    }
    Plot {
        title: AXES[axis].to_owned(),
        x: SheetAxis::categorical("", SHOWN.map(str::to_owned)),
        y: SheetAxis::linear("force (N)", [0.0, (1.05 * most).max(1.0)]),
        bars,
        ..Plot::default()
    }
}

/// Tabulates the tests of pairs of conditions. As in the paper, each study is tested along each
/// axis with the errors of all targets of all participants.
pub(super) fn tests(all: &[Replication]) -> Sheet {
    let mut rows = Vec::new();
    for (first, second, printed) in PAIRS {
        for (axis, paper) in printed.into_iter().enumerate() {
            let tested: Vec<(f64, bool)> = all
                .iter()
                .filter_map(|replication| {
                    let [a, b] = [first, second].map(|name| errors_n(replication, name, axis));
                    let p = mann_whitney(&a, &b).ok()?.p;
                    Some((p, median(&b) < median(&a)))
                })
                .collect();
            let p: Vec<f64> = tested.iter().map(|pair| pair.0).collect();
            let count = |is_less: bool| {
                let own = tested.iter();
                own.filter(|pair| pair.0 < SIGNIFICANT && pair.1 == is_less)
                    .count()
            };
            let middle = match median(&p) {
                _ if p.is_empty() => "-".to_owned(),
                small if small < 1e-4 => "< 0.0001".to_owned(),
                middle => format!("{middle:.4}"),
            };
            rows.push(vec![
                format!("{first} and {second}, {}", AXES[axis]),
                middle,
                count(true).to_string(),
                count(false).to_string(),
                tested.len().to_string(),
                paper.to_owned(),
            ]);
        }
    }
    let heads = [
        "",
        "median p",
        "less, p < 0.05",
        "more, p < 0.05",
        "studies",
        "paper's p",
    ];
    let caption = "Mann-Whitney U test of the errors of single targets, with all participants of \
                   a study together; simulated. less, more: the number of studies in which the \
                   second condition has a smaller, or a larger, error with p below 0.05, \
                   uncorrected as in the paper. Last column: - means that the paper finds no \
                   difference along z; ? means that the paper does not say. For C2 and C4 the \
                   paper does not say on which axis the difference lies.";
    let grid = Grid {
        heads: heads.map(str::to_owned).to_vec(),
        rows,
    };
    Sheet::table("Figure 8", "tests by axis", caption.to_owned(), grid)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_error_is_of_an_axis_or_of_the_whole_force() {
        let target = Target {
            command: 0,
            wanted_n: [1.0, 0.0, 2.0],
            measured: [4.0, -4.0, 2.0, 9.0, 9.0, 9.0],
            currents_ma: [0.0; 9],
            is_beyond: false,
        };
        let errors = [0, 1, 2, 3].map(|axis| error_n(&target, axis));
        assert_eq!(errors, [3.0, 4.0, 0.0, 5.0]);
    }
}
