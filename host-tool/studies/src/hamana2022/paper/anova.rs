//! Analysis of variance of experiment 4 (Hamana 2022, III-D5, table 9) with the fixed factors
//! number of points and participant, and trials as replications.

use super::{Part, find_draw};
use crate::hamana2022::printed::TABLE_8;
use host_core::statistics::two_way;
use std::collections::BTreeSet;

/// F and p of the number of points, of the participant, and of their interaction.
pub(super) type Anova = [[f64; 2]; 3];

/// Names of the effects in the order of [`Anova`].
pub(super) const SOURCES: [&str; 3] = ["number of points", "participant", "interaction"];

/// Analyses the values of all trials, indexed by number of points, participant and trial; `None` if
/// they allow no analysis of variance.
fn two_way_anova(cells: &[Vec<Vec<f64>>]) -> Option<Anova> {
    let analysis = two_way(cells).ok()?;
    Some([analysis.first, analysis.second, analysis.interaction].map(|effect| [effect.f, effect.p]))
}

/// Computes the analysis of variance from the trials that table 8 prints. Its first F is 4.32;
/// table 9 prints 4.30, because the paper computed it from numbers with more digits.
pub(super) fn published() -> Option<Anova> {
    let points = [0, 1].map(|place| {
        let participants = TABLE_8.iter().map(|(_, trials)| trials[place].to_vec());
        participants.collect::<Vec<_>>()
    });
    two_way_anova(&points)
}

/// Returns whether P, Q and S, the participants of table 8, are all among these names.
pub(super) fn has_all<'a>(names: impl Iterator<Item = &'a str>) -> bool {
    let names: BTreeSet<&str> = names.collect();
    TABLE_8.iter().all(|(name, _)| names.contains(name))
}

/// Computes an analysis of variance for each draw under the controller `law`. Skips draws in which
/// P, Q or S lacks the RMSE of a trial with one point or with two.
pub(super) fn replications(parts: &[Part], law: &str) -> Vec<Anova> {
    let draws: BTreeSet<u64> = parts.iter().map(|part| part.draw).collect();
    let replication = |draw: u64| {
        let (mut one_point, mut two) = (Vec::new(), Vec::new());
        for (name, _) in &TABLE_8 {
            let tracking = find_draw(parts, name, draw)?.tracking()?;
            one_point.push(tracking.one_point_rmse(law)?.1);
            two.push(tracking.two_point_rmse(law)?);
        }
        two_way_anova(&[one_point, two])
    };
    draws.into_iter().filter_map(replication).collect()
}

/// Returns the mean RMSE with one point and with two of P, Q and S, °. Skips draws in which one of
/// these means is missing.
pub(super) fn complete_means(parts: &[Part], law: &str) -> Vec<Vec<[f64; 2]>> {
    let draws: BTreeSet<u64> = parts.iter().map(|part| part.draw).collect();
    let mean_pair = |name: &str, draw: u64| {
        let [one, two] = find_draw(parts, name, draw)?.tracking()?.means(law);
        Some([one?, two?])
    };
    let replication = |draw: u64| {
        TABLE_8
            .iter()
            .map(|(name, _)| mean_pair(name, draw))
            .collect()
    };
    draws.into_iter().filter_map(replication).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::hamana2022::printed::TABLE_9;

    /// Table 9 follows from table 8 except for rounding: F is 4.30 where the printed trials give
    /// 4.32.
    #[test]
    fn table_9_is_that_of_table_8() {
        let ours = published().unwrap();
        assert!((ours[0][0] - 4.32).abs() < 0.005, "{ours:?}");
        for (ours, printed) in ours.iter().zip(TABLE_9) {
            assert!((ours[0] - printed[0]).abs() < 0.025, "{ours:?} {printed:?}");
            assert!((ours[1] - printed[1]).abs() < 0.003, "{ours:?} {printed:?}");
        }
    }

    #[test]
    fn sums_of_squares_are_those_printed() {
        let points = [0, 1].map(|place| {
            let participants = TABLE_8.iter().map(|(_, trials)| trials[place].to_vec());
            participants.collect::<Vec<_>>()
        });
        let analysis = two_way(&points).unwrap();
        let effects = [analysis.first, analysis.second, analysis.interaction]
            .map(|effect| (effect.sum_squares, effect.df));
        for ((ours, df), (printed, printed_df)) in
            effects.into_iter().zip([(97.2, 1), (79.6, 2), (52.2, 2)])
        {
            assert!((ours - printed).abs() < 0.01 * printed, "{ours} {printed}");
            assert_eq!(df, printed_df);
        }
        assert!((analysis.first.error_sum_squares - 542.0).abs() < 5.0);
        assert_eq!(analysis.first.error_df, 24);
    }
}
