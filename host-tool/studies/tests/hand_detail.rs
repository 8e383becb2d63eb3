//! Judges how many motor units `[fidelity]` chooses for a simulated hand, in a short run of `flexor
//! chart hand-detail`, and compares docs/muscle.md with the committed chart.

use studies::hands::detail::{DEVELOPMENT, Summary, TOLERANCES, campaign, csv};

/// Checks both promises on a few sessions, none of which is judged.
#[test]
fn the_chosen_units_will_do_and_fewer_would_not() {
    let rows = campaign(DEVELOPMENT, 6, |_| ()).unwrap();
    assert_eq!(csv(&rows).lines().count(), 7);
    for row in &rows {
        for effects in [&row.tried, &row.judged] {
            assert_eq!((effects[0].setting, effects[0].error), (32, 0.0));
            assert!(effects.is_sorted_by(|a, b| a.setting > b.setting));
            assert!(effects.iter().any(|effect| effect.error > 0.0), "{row:?}");
        }
    }
    for tolerance in TOLERANCES {
        let sum = Summary::from_rows(&rows, tolerance);
        assert_eq!(sum.sessions, 6);
        assert!(sum.within >= 5, "{tolerance}: {sum:?}");
        assert!(
            sum.fewer_fails + 1 >= sum.with_fewer,
            "{tolerance}: {sum:?}"
        );
    }
}

/// Returns the share of `part` in `total` as the document shows it.
fn share(part: usize, total: usize) -> String {
    format!("{:.1} % of {total}", 100.0 * part as f64 / total as f64)
}

/// The table of docs/muscle.md is what docs/charts/hand_detail.csv says.
#[test]
fn the_document_says_what_the_chart_says() {
    let chart = include_str!("../../../docs/charts/hand_detail.csv");
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
    let document = include_str!("../../../docs/muscle.md");
    for percent in [1.0, 3.0, 10.0, 30.0] {
        let (mut within, mut with_fewer, mut fails) = (0, 0, 0);
        for row in &rows {
            let value = |column: usize| row[column].parse::<f64>().unwrap();
            let chosen = tried
                .iter()
                .take_while(|column| value(**column) <= percent)
                .count()
                - 1;
            within += usize::from(value(judged[chosen]) <= percent);
            if let Some(fewer) = judged.get(chosen + 1) {
                with_fewer += 1;
                fails += usize::from(value(*fewer) > percent);
            }
        }
        let line = format!(
            "| {percent} % | {} | {} |",
            share(within, rows.len()),
            share(fails, with_fewer)
        );
        assert!(document.contains(&line), "docs/muscle.md lacks {line}");
    }
    let costs = include_str!("../../../docs/charts/hand_detail_cost.csv");
    for cost in costs.lines().skip(1) {
        let (units, instructions) = cost.split_once(',').unwrap();
        let millions = instructions.parse::<f64>().unwrap() * 1e-6;
        let line = format!("| {units} | {millions:.1} |");
        assert!(document.contains(&line), "docs/muscle.md lacks {line}");
    }
}
