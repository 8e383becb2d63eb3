//! Two judges, written independently in two languages, judge the same cases: `hal_sim`'s and
//! tests/judge/judge.py. Where they differ, one of them is wrong.

use super::scene::Scene;
use hal_sim::trace::Trace;
use hal_sim::trace::judge::{Finding, OutputJudgement, Pump, Truth, Verdict, judge};
use serde_json::{Value, json};
use std::io::{ErrorKind, Write};
use std::process::{Command, Stdio};

const PROGRAM: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/judge/judge.py");
/// Largest difference of amounts between the judges, relative, and at least as much in their unit.
/// One uses small steps, the other exponentials; they differ by at most 3·10⁻⁶ as far as seen.
const ALIKE: f64 = 1e-4;

/// Returns the verdict of `hal_sim`, which the other judge must confirm.
///
/// # Panics
/// Panics if the judges differ.
pub fn judge_both(trace: &Trace, pump: &Pump, truth: &Truth, end_us: u64) -> Verdict {
    let verdict = [judge(trace, pump, truth, end_us)];
    let differ = compare(&[case(trace, pump, truth, end_us)], &verdict);
    assert!(differ.is_empty(), "{differ:#?}");
    let [verdict] = verdict;
    verdict
}

/// Returns the input of both judges.
pub fn case(trace: &Trace, pump: &Pump, truth: &Truth, end_us: u64) -> Value {
    json!({ "trace": trace, "pump": pump, "truth": truth, "end_us": end_us })
}

/// Returns the differences between the other judge's verdicts on `cases` and these.
pub fn compare(cases: &[Value], verdicts: &[Verdict]) -> Vec<String> {
    let others = python_verdicts(cases);
    assert_eq!(others.len(), verdicts.len());
    let mut differ = Vec::new();
    for (index, (verdict, other)) in verdicts.iter().zip(&others).enumerate() {
        for (name, account) in [("as_built", &verdict.as_built), ("bare", &verdict.bare)] {
            let found = differences(account, &other[name]);
            differ.extend(
                found
                    .iter()
                    .map(|text| format!("case {index}, {name}: {text}")),
            );
        }
    }
    differ
}

/// Returns the verdicts of the judge in Python.
fn python_verdicts(cases: &[Value]) -> Vec<Value> {
    let python = Command::new("python3")
        .arg("-B") // leaves no compiled file beside the program
        .arg(PROGRAM)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn();
    let mut python = match python {
        Ok(python) => python,
        Err(e) if e.kind() == ErrorKind::NotFound => {
            panic!("the second judge needs python3, which is not installed: {PROGRAM}")
        }
        Err(e) => panic!("python3 cannot be started for {PROGRAM}: {e}"),
    };
    let mut input = python.stdin.take().unwrap();
    let output = std::thread::scope(|scope| {
        scope.spawn(move || {
            for case in cases {
                writeln!(input, "{case}").unwrap();
            }
        });
        python.wait_with_output().unwrap()
    });
    assert!(
        output.status.success(),
        "the second judge gave up, see above"
    );
    let verdicts = serde_json::Deserializer::from_slice(&output.stdout).into_iter();
    verdicts.map(Result::unwrap).collect()
}

/// Returns the differences between `verdict` and `account`, rule by rule.
fn differences(account: &OutputJudgement, verdict: &Value) -> Vec<String> {
    let mut differs = Vec::new();
    let mut hold = |field: &str, mine: Vec<Value>, key: &dyn Fn(&Value) -> Value, amount: &str| {
        let mut others = verdict[field].as_array().unwrap().clone();
        for mine in mine {
            let place = others.iter().position(|value| key(value) == key(&mine));
            match place.map(|place| others.remove(place)) {
                Some(value) if is_alike(&mine[amount], &value[amount]) => {}
                other => differs.push(format!("{field}: {mine}, the other judge {other:?}")),
            }
        }
        differs.extend(
            others
                .iter()
                .map(|value| format!("{field}: only the other judge: {value}")),
        );
    };
    let selection =
        |value: &Value, keys: &[&str]| json!(keys.iter().map(|k| &value[*k]).collect::<Vec<_>>());
    let findings = account
        .findings
        .iter()
        .map(|finding| json!(finding))
        .collect();
    hold(
        "findings",
        findings,
        &|value| selection(value, &["rule", "channel", "t_us", "count"]),
        "amount",
    );
    let truncated = account
        .truncated
        .iter()
        .map(|truncated| json!(truncated))
        .collect();
    hold(
        "truncated",
        truncated,
        &|value| selection(value, &["channel", "t_us"]),
        "charge_uc",
    );
    let latched = account
        .latched
        .iter()
        .map(|latched| json!(latched))
        .collect();
    hold("latched", latched, &|value| value.clone(), "");
    let direct = verdict["direct_ua"].as_array().unwrap();
    for (channel, (mine, other)) in account.direct_ua.iter().zip(direct).enumerate() {
        if !is_alike(&json!(mine), other) {
            differs.push(format!(
                "direct current of channel {channel}: {mine}, {other}"
            ));
        }
    }
    differs
}

fn is_alike(a: &Value, b: &Value) -> bool {
    match (a.as_f64(), b.as_f64()) {
        (Some(a), Some(b)) => (a - b).abs() <= ALIKE * a.abs().max(b.abs()).max(1.0),
        _ => a == b,
    }
}

/// A comparison without differences proves something only if it can find one.
#[test]
fn a_judge_that_errs_is_told() {
    let scene = Scene::biphasic(60, 501);
    let heard = case(&scene.trace(), &scene.pump, &scene.truth, scene.end_us);
    let verdict = python_verdicts(&[heard]).remove(0);
    let account = scene.judged_once().as_built;
    assert_eq!(differences(&account, &verdict["as_built"]), [""; 0]);
    let err = |account: &dyn Fn(&mut OutputJudgement)| {
        let mut wrong = scene.judged_once().as_built;
        account(&mut wrong);
        differences(&wrong, &verdict["as_built"]).len()
    };
    assert_eq!(err(&|report| report.findings.clear()), 1);
    let first = |change: &dyn Fn(&mut Finding)| err(&|account| change(&mut account.findings[0]));
    // A finding that is missing, and a finding that the other judge does not have.
    assert_eq!(first(&|finding| finding.count += 1), 2);
    assert_eq!(first(&|finding| finding.t_us += 1), 2);
    assert_eq!(first(&|finding| finding.amount *= 1.001), 1);
    assert_eq!(err(&|report| report.direct_ua[0] += 0.01), 1);
}
