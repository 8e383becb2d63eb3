//! Tests of the comparison of wearer files on a few wearers, and of its table in docs/evidence/control.md:
//! `FLEXOR_OVERWRITE=1 cargo test -p studies --test suite wearer_files` writes the table again.

use hal_sim::body::{RandomFinger, RandomFingerSpec};
use serde::Deserialize;
use std::path::{Path, PathBuf};
use studies::tracking::exercise::Wearers;
use studies::tracking::wearer::{Points, nominal};
use studies::wearer_files::{Comparison, Files, PlannedPoint, Population, calibrate_body, table};

/// Seed of development.
const SEED: u64 = 4;

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// The nominal wearer without a delay and friction begins to bend at the threshold of table 7.
#[test]
fn the_procedure_finds_the_nominal_fingers_threshold() {
    let finger = RandomFinger::new(RandomFingerSpec::nominal(), 1).unwrap();
    let a = nominal().flexor_a;
    let planned = PlannedPoint {
        channel: a.channel,
        movement: "index flexion",
        start_v: 10.0,
        ceiling_v: a.max_v,
    };
    let found = calibrate_body(Box::new(finger), &[planned], 1).unwrap();
    let [zero, most] = found.ranges_v[a.channel].unwrap();
    let threshold = zero / 0.85;
    assert!(
        (a.threshold_v..=a.threshold_v + 2.0).contains(&threshold),
        "{threshold}"
    );
    assert_eq!(most, a.max_v);
    assert_eq!(found.ranges_v[1], None);
}

#[test]
fn a_comparison_repeats_to_the_bit_and_leaves_nobody_out() {
    for (population, draws) in [
        (Population::Hands, 2),
        (Population::Fingers(Wearers::Earlier), 4),
    ] {
        let run = || Comparison::run(population, (SEED, draws), |_| {}).unwrap();
        let compared = run();
        assert_eq!(compared, run());
        assert!(!compared.cases.is_empty());
        for case in &compared.cases {
            let known = Files::ALL
                .into_iter()
                .filter(|files| population.has(*files));
            assert!(case.outcomes.keys().copied().eq(known));
            assert!(case.calibrated.presentations > 20);
        }
        let none = compared.score(Points::One, Files::Absent);
        assert_eq!(none.over_none.mean, 0.0);
        let all = [compared];
        let text = table::text(&all);
        println!("{text}");
        assert!(
            text.lines().all(|line| line.chars().count() <= 80),
            "{text}"
        );
        let rows = table::csv(&all).lines().count() - 1;
        assert_eq!(table::json(&all)["files"].as_array().unwrap().len(), rows);
    }
}

#[derive(Deserialize)]
struct Row {
    wearers: String,
    points: String,
    file: String,
    driven: u32,
    refused: u32,
    beyond_stage: u32,
    mean_deg: Option<f64>,
    p95_deg: Option<f64>,
    limit_cycles: Option<f64>,
    over_none_deg: Option<f64>,
    over_none_low_deg: Option<f64>,
    over_none_high_deg: Option<f64>,
}

impl Row {
    /// Returns the row of the table in the document.
    fn to_markdown(&self) -> String {
        let shown = |number: Option<f64>| number.map_or("–".to_owned(), |n| format!("{n:.2}"));
        let signed = |number: f64| format!("{number:+.2}").replace('-', "−");
        let ends = [self.over_none_low_deg, self.over_none_high_deg];
        let difference = match (self.over_none_deg, ends) {
            (Some(mean), [Some(low), Some(high)]) if self.file != "none" => {
                format!("{} [{} {}]", signed(mean), signed(low), signed(high))
            }
            _ => String::new(),
        };
        format!(
            "| {} | {} | {} | {} of {} | {} | {}, {} | {} | {difference} |\n",
            self.wearers,
            self.points,
            self.file,
            self.refused,
            self.driven,
            self.beyond_stage,
            shown(self.mean_deg),
            shown(self.p95_deg),
            shown(self.limit_cycles),
        )
    }
}

#[test]
fn the_documents_table_is_that_of_the_chart() {
    const HEAD: &str = "| wearers | points | file | refused | beyond stage | RMSE: mean, p95 | limit \
                        cycles in a trial | difference to no file |\n\
                        |---|---|---|---|---|---|---|---|\n";
    let chart = root().join("docs/charts/control_files.csv");
    let rows = csv::Reader::from_path(chart).unwrap().into_deserialize();
    let rows: Vec<Row> = rows.collect::<Result<_, _>>().unwrap();
    assert_eq!(rows.len(), 2 * (4 + 5 + 5));
    let table: String = rows.iter().map(Row::to_markdown).collect();
    let table = HEAD.to_owned() + &table;
    let path = root().join("docs/evidence/control.md");
    let text = std::fs::read_to_string(&path).unwrap();
    let begin = text.find(HEAD.lines().next().unwrap()).expect("the table");
    let end = begin + text[begin..].find("\n\n").unwrap() + 1;
    if text[begin..end] == table {
        return;
    }
    assert!(
        std::env::var_os("FLEXOR_OVERWRITE").is_some(),
        "docs/evidence/control.md differs from the chart: run this test with FLEXOR_OVERWRITE=1, and review \
         the text around the table; it should be\n{table}"
    );
    let new = format!("{}{table}{}", &text[..begin], &text[end..]);
    std::fs::write(path, new).unwrap();
}
