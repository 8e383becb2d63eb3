//! Statements in the text of docs/evidence/where_methods_fail.md: each number must be that of a map.

use super::{CONTROLLERS, Numbers, docs};
use std::collections::BTreeMap;

/// Returns the first of the labels that fails.
fn first_failing<'a>(
    labels: impl IntoIterator<Item = &'a str>,
    holds: impl Fn(&str) -> bool,
) -> &'a str {
    let mut labels = labels.into_iter();
    labels.find(|label| !holds(label)).expect("a label fails")
}

/// Returns the labels from `from` on.
fn from<'a>(labels: &[&'a str], from: &str) -> Vec<&'a str> {
    let rest = labels.iter().skip_while(|label| **label != from);
    rest.copied().collect()
}

#[test]
fn the_statements_in_the_text_are_those_of_the_maps() {
    let path = docs().join("evidence/where_methods_fail.md");
    let text = std::fs::read_to_string(path).unwrap();
    let words: Vec<&str> = text.split_whitespace().collect();
    let text = words.join(" ");
    let says = |statement: String| {
        let message = "docs/evidence/where_methods_fail.md does not say";
        assert!(text.contains(&statement), "{message} `{statement}`");
    };
    let [default, alone, paper, pid] = CONTROLLERS;
    let columns = |map: &Numbers| map.columns.clone();

    let lag = Numbers::read("muscle_lag");
    let mut slower = lag.rows(default);
    slower.reverse();
    let fast = first_failing(from(&slower, "1"), |row| lag.holds(default, row, "0"));
    says(format!(
        "swings where the muscle's lag is {fast} times the nominal one"
    ));
    let delays = columns(&lag);
    let delays: Vec<&str> = delays.iter().map(String::as_str).collect();
    let late = |panel| first_failing(delays.iter().copied(), |ms| lag.holds(panel, "1", ms));
    says(format!(
        "swings from {} ms of added delay on",
        late(default)
    ));
    let slow = first_failing(from(&lag.rows(pid), "1"), |row| lag.holds(pid, row, "0"));
    says(format!(
        "swings with {} ms of added delay and with {slow} times the lag",
        late(pid)
    ));
    let rests = |panel: &str| {
        let rows = lag.rows(panel);
        { rows.iter() }.any(|row| delays.iter().any(|ms| lag.holds(panel, row, ms)))
    };
    assert!(!rests(alone) && !rests(paper));

    let gain = Numbers::read("gain_delay");
    let strong = first_failing(from(&gain.rows(default), "1"), |row| {
        gain.holds(default, row, "50")
    });
    says(format!(
        "with 50 ms of added delay at {strong} times the strength"
    ));
    let swing = gain.number(alone, "1", "0");
    says(format!(
        "ends in a limit cycle, of {swing:.1}° on the nominal finger"
    ));

    let thresholds = Numbers::read("thresholds");
    let delays = columns(&thresholds);
    let follows = |ms: &&String| thresholds.holds(alone, "0", ms);
    let last = delays.iter().take_while(follows).last().unwrap();
    says(format!("within 3° up to {last} ms of added delay"));
    let high = first_failing(from(&thresholds.rows(pid), "0"), |row| {
        thresholds.holds(pid, row, "0")
    });
    says(format!(
        "fails with thresholds {high} % of the range too high"
    ));
    let [right, wrong] = ["0", "40"].map(|row| thresholds.number(default, row, "0"));
    says(format!(
        "from {right:.2}° to {wrong:.2}° if both lie 40 % of the range too high"
    ));
    let rows = thresholds.rows(paper);
    assert!({ rows.iter() }.all(|row| delays.iter().all(|ms| !thresholds.holds(paper, row, ms))));

    let points = Numbers::read("point_thresholds");
    let [right, wrong] = ["0", "40"].map(|row| points.number(default, row, "0"));
    says(format!(
        "40 % of its range too late, the RMSE grows from {right:.2}° to {wrong:.2}°"
    ));
    let delays = columns(&points);
    let late = first_failing(delays.iter().map(String::as_str), |ms| {
        points.holds(default, "40", ms)
    });
    says(format!(
        "and it fails from {late} ms of added delay on (`point_thresholds`)"
    ));

    let sensor = Numbers::read("sensor");
    let noise = columns(&sensor);
    let noise: Vec<&str> = noise.iter().map(String::as_str).collect();
    let [default_from, alone_from, pid_from] = [default, alone, pid]
        .map(|panel| first_failing(noise.iter().copied(), |deg| sensor.holds(panel, "90", deg)));
    says(format!(
        "at 90 frames a second it fails from {alone_from}° of noise on, the default controller \
         from {default_from}° and the PID controller from {pid_from}°"
    ));
    let [few, many] = ["20", "1000"].map(|row| sensor.number(default, row, "2"));
    says(format!(
        "2° of noise costs the default controller {few:.1}° at 20 and {many:.1}° at 1000"
    ));

    let fatigue = Numbers::read("fatigue");
    for panel in [default, alone, pid] {
        assert!(fatigue.holds(panel, "0.6", "10") && !fatigue.holds(panel, "0.5", "10"));
    }
    says(
        "fails where fatigue of 10 s leaves 0.5 of the force, as every controller does".to_owned(),
    );

    let snapped = Numbers::read("pulse_rate");
    let mean = "pulses snapped to calls; τc 21.2, τ1 28.6, τ2 131 ms";
    let rates = snapped.rows(mean);
    let cost = rates.iter().map(|rate| snapped.number(mean, rate, "1"));
    let cost = cost.fold(0.0, f64::max);
    says(format!(
        "pulses cost the shipped model up to {cost:.1} % on the mean subject"
    ));

    let small = Numbers::read("word_length");
    let train = "40 Hz for 1 s";
    let drives = columns(&small);
    let all_hold = |n: &&String| {
        small
            .rows(train)
            .iter()
            .all(|row| small.holds(train, row, n))
    };
    let last = drives.iter().take_while(all_hold).last().unwrap();
    says(format!("below a drive of 2^-{last} under a train"));

    let shipped = Numbers::read("shipped_muscle");
    let accepted = { shipped.lines.iter() }.filter(|line| line.2 == "number");
    let errors = accepted.flat_map(|line| line.3.iter().map(|text| text.parse::<f64>().unwrap()));
    let worst = errors.filter(|error| error.is_finite()).fold(0.0, f64::max);
    says(format!(
        "the error stays within {worst:.4} % for all others"
    ));

    let hands = chart("control_hands");
    let is = |row: &&BTreeMap<String, String>| {
        row["points"] == "one-point" && row["law"] == "default calibrated"
    };
    let row = hands.iter().find(is).unwrap();
    let (refused, all) = (&row["refused"], &row["hands"]);
    says(format!(
        "with one point {refused} of {all} hands are refused"
    ));
}

/// Returns the rows of a chart by column.
fn chart(name: &str) -> Vec<BTreeMap<String, String>> {
    let path = docs().join(format!("charts/{name}.csv"));
    let mut reader = csv::Reader::from_path(path).unwrap();
    reader.deserialize().map(Result::unwrap).collect()
}
