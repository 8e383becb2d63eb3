//! Judges the level of detail that `[fidelity]` chooses for a simulated hand or arm, in a short run
//! of `flexor chart limb-detail`, and compares docs/how/muscle.md with the committed charts.

use studies::detail::{DEVELOPMENT, Limb, Row, Summary, csv};

/// Checks both promises on a few sessions, none of which is judged.
fn judge(limb: Limb, finest: u32) -> Vec<Row> {
    let rows = limb.campaign(DEVELOPMENT, 6, |_| ()).unwrap();
    assert_eq!(csv(&rows).lines().count(), 7);
    for row in &rows {
        for effects in [&row.tried, &row.judged] {
            assert_eq!((effects[0].setting, effects[0].error), (finest, 0.0));
            assert!(effects.iter().any(|effect| effect.error > 0.0), "{row:?}");
        }
    }
    for tolerance in limb.tolerances() {
        let sum = Summary::from_rows(&rows, *tolerance);
        assert_eq!(sum.sessions, 6);
        assert!(sum.within >= 5, "{tolerance}: {sum:?}");
        assert!(
            sum.coarser_fails + 1 >= sum.with_coarser,
            "{tolerance}: {sum:?}"
        );
    }
    rows
}

#[test]
fn the_chosen_units_of_a_hand_will_do_and_fewer_would_not() {
    for row in judge(Limb::Hand, 32) {
        assert!(row.tried.is_sorted_by(|a, b| a.setting > b.setting));
    }
}

#[test]
fn the_chosen_step_of_an_arm_will_do_and_a_coarser_one_would_not() {
    for row in judge(Limb::Arm, 1) {
        assert!(row.tried.is_sorted_by(|a, b| a.setting < b.setting));
    }
}

/// Returns the share of `part` in `total` as the document shows it.
fn share(part: usize, total: usize) -> String {
    match total {
        0 => "–".to_owned(),
        _ => format!("{:.1} % of {total}", 100.0 * part as f64 / total as f64),
    }
}

/// The tables of docs/how/muscle.md are what the charts of this limb say.
fn compare_document(limb: Limb, chart: &str, costs: &str) {
    let mut lines = chart
        .lines()
        .map(|line| line.split(',').collect::<Vec<_>>());
    let head = lines.next().unwrap();
    let rows: Vec<Vec<&str>> = lines.collect();
    let columns = |kind: &str| -> Vec<usize> {
        let named = head.iter().enumerate();
        let own = named.filter(|(_, name)| name.starts_with(kind));
        own.map(|(column, _)| column).collect()
    };
    let (tried, judged) = (columns("tried_"), columns("judged_"));
    let document = include_str!("../../../docs/how/muscle.md");
    for tolerance in limb.tolerances() {
        let percent = f64::from(tolerance.0) / 100.0;
        let (mut within, mut with_coarser, mut fails) = (0, 0, 0);
        for row in &rows {
            let value = |column: usize| row[column].parse::<f64>().unwrap();
            let chosen = tried
                .iter()
                .take_while(|column| value(**column) <= percent)
                .count()
                - 1;
            within += usize::from(value(judged[chosen]) <= percent);
            if let Some(coarser) = judged.get(chosen + 1) {
                with_coarser += 1;
                fails += usize::from(value(*coarser) > percent);
            }
        }
        let line = format!(
            "| {percent} % | {} | {} |",
            share(within, rows.len()),
            share(fails, with_coarser)
        );
        assert!(document.contains(&line), "docs/how/muscle.md lacks {line}");
    }
    for cost in costs.lines().skip(1) {
        let (level, instructions) = cost.split_once(',').unwrap();
        let millions = instructions.parse::<f64>().unwrap() * 1e-6;
        let line = format!("| {level} | {millions:.1} |");
        assert!(document.contains(&line), "docs/how/muscle.md lacks {line}");
    }
}

#[test]
fn the_document_says_what_the_charts_say() {
    compare_document(
        Limb::Hand,
        include_str!("../../../docs/charts/hand_detail.csv"),
        include_str!("../../../docs/charts/hand_detail_cost.csv"),
    );
    compare_document(
        Limb::Arm,
        include_str!("../../../docs/charts/arm_detail.csv"),
        include_str!("../../../docs/charts/arm_detail_cost.csv"),
    );
}
