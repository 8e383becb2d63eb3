//! Tables of all replications beside those of the paper.

use super::declaration::Study;
use super::metrics::{Target, force, size};
use super::model::JOINT_NAMES;
use super::participant::DIRECTION_NAMES;
use super::regression::Score;
use super::replication::{CONDITIONS, Replication, people};
use crate::laboratory::{Grid, Sheet};
use host_core::statistics::mean;

/// Tabulates table 1: means over participants and C2 to C4.
pub(super) fn table_1(study: &Study, all: &[Replication]) -> Sheet {
    let names = ["force", "torque"].into_iter().chain(JOINT_NAMES);
    let cell = |of: &dyn Fn(&Score) -> f64, place: usize, way: usize| {
        let each = people(all).flat_map(|wearer| &wearer.conditions);
        let each: Vec<f64> = each
            .filter_map(|condition| condition.table_1.get(place))
            .map(|values| of(&values[way]))
            .collect();
        mean(&each).unwrap_or(f64::NAN)
    };
    let line = |(place, name): (usize, &str)| {
        let mut cells = vec![name.to_owned()];
        for way in 0..2 {
            cells.push(format!("{:.3}", cell(&|fit| fit.r_squared, place, way)));
            cells.push(format!("{:.3}", cell(&|fit| fit.nrmse, place, way)));
        }
        let paper = if place < 2 {
            study.paper.wrench
        } else {
            study.paper.joints
        };
        cells.extend(paper.map(|paper| format!("{paper:.3}")));
        cells
    };
    let heads = [
        "",
        "R²",
        "NRMSE",
        "R² out",
        "NRMSE out",
        "paper R²",
        "paper NRMSE",
    ];
    let grid = Grid {
        heads: heads.map(str::to_owned).to_vec(),
        rows: names.enumerate().map(line).collect(),
    };
    let caption = "Ridge regression with random Fourier features, which predicts the wrench and \
                   the joint torques from the currents: means over participants and over C2 to \
                   C4, simulated. R² and NRMSE: ten-fold cross-validation, as in the paper. R² \
                   out and NRMSE out: leaving out one of the twelve commands at a time (the 60 \
                   points are repetitions of twelve commands). The paper prints grand means over \
                   ten folds.";
    Sheet::table(
        "Table 1",
        "prediction from currents",
        caption.to_owned(),
        grid,
    )
}

/// Tabulates figure 7: the mean correlation matrix of each condition.
pub(super) fn figure_7(all: &[Replication]) -> Sheet {
    let axes = ["x", "y", "z"];
    let mut rows = Vec::new();
    for name in CONDITIONS {
        for (wanted, axis) in axes.iter().enumerate() {
            let mut cells = vec![format!("{name}, reference {axis}")];
            for measured in 0..3 {
                let each = people(all).filter_map(|wearer| wearer.condition(name));
                let each: Vec<f64> = each
                    .map(|condition| condition.measures.correlations[wanted][measured].r)
                    .collect();
                cells.push(format!("{:.3}", mean(&each).unwrap_or(f64::NAN)));
            }
            rows.push(cells);
        }
    }
    let heads = ["", "measured x", "measured y", "measured z"]
        .map(str::to_owned)
        .to_vec();
    let caption = "Correlation between reference and measured direction of force: means over \
                   participants, simulated; x forward, y left, z up. The paper's figure 7 has a \
                   matrix for each participant.";
    Sheet::table(
        "Figure 7",
        "correlation matrices",
        caption.to_owned(),
        Grid { heads, rows },
    )
}

/// Tabulates the reference force and the mean measured force of each direction at full magnitude,
/// for the first study.
pub(super) fn forces(all: &[Replication]) -> Option<Sheet> {
    let first = all.first()?;
    let names = DIRECTION_NAMES;
    let mut rows = Vec::new();
    for (at, person) in first.people.iter().enumerate() {
        for (place, name) in names.iter().enumerate() {
            let mut cells = vec![format!("S{}, {name}", at + 1)];
            for condition in ["C2", "C3"] {
                let Some(item) = person.condition(condition) else {
                    continue;
                };
                let of = item
                    .targets
                    .iter()
                    .filter(|target| target.command == 2 * place + 1);
                let of: Vec<&Target> = of.collect();
                let n = of.len().max(1) as f64;
                let mean: [f64; 3] = std::array::from_fn(|axis| {
                    of.iter()
                        .map(|target| force(target.measured)[axis])
                        .sum::<f64>()
                        / n
                });
                let wanted = of.first().map_or(0.0, |target| size(target.wanted_n));
                if condition == "C2" {
                    cells.push(format!("{wanted:.1}"));
                }
                cells.push(mean.map(|mean| format!("{mean:.1}")).join(" "));
            }
            rows.push(cells);
        }
    }
    let heads = ["", "reference N", "C2: x y z", "C3: x y z"]
        .map(str::to_owned)
        .to_vec();
    let caption = "Forces at full size in the first study, N, as means of five contractions; \
                   simulated. The page arms.html draws them with the arm.";
    Some(Sheet::table(
        "Forces",
        "reference and measured",
        caption.to_owned(),
        Grid { heads, rows },
    ))
}
