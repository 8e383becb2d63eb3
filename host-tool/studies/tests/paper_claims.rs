//! Tests of the claims on a page, which are judged by the intervals of their parts.

use serde_json::{Value, json};
use studies::buatier2024;
use studies::experiments::load_experiment;
use studies::laboratory::{
    ClaimStanding, Outcome, Reach, Share, Verdict, comparison, headline, paper_claims, publish,
};

/// Makes a result of these shares: id, text, the paper's verdict, holds, of.
fn result(study: &str, shares: &[(String, String, Option<bool>, u64, u64)]) -> Outcome {
    let shares = shares
        .iter()
        .map(|(id, says, paper, holds, of)| {
            Share::from_counts(id.clone(), says.clone(), *paper, (*holds, *of))
        })
        .collect();
    let declared = json!({ "sha256": {}, "source": "a paper", "draws": 16, "as_declared": true });
    let empty = json!({
        "name": study, "title": "A study", "seed": 1, "simulated": true, "declared": declared,
        "conditions": [], "rows": [], "shares": [], "notes": [],
    });
    let outcome: Outcome = serde_json::from_value(empty).unwrap();
    Outcome { shares, ..outcome }
}

fn owned(all: &[(&str, &str, bool, u64, u64)]) -> Vec<(String, String, Option<bool>, u64, u64)> {
    let own = |(id, says, paper, holds, of): &(&str, &str, bool, u64, u64)| {
        (
            (*id).to_owned(),
            (*says).to_owned(),
            Some(*paper),
            *holds,
            *of,
        )
    };
    all.iter().map(own).collect()
}

/// Shares of participants, of studies and of significance are parts of one claim each.
#[test]
fn a_lift_s_page_counts_the_eleven_claims_of_its_paper() {
    let declared = buatier2024::Study::load_embedded().unwrap();
    let mut shares = Vec::new();
    for claim in &declared.claims {
        let share = |more: &str, says: String, paper| {
            (format!("{}{more}", claim.id), says, paper, 120, 128)
        };
        shares.push(share("", format!("persons: {}", claim.says), claim.paper));
        shares.push(share(
            "/studies",
            format!("studies: {}", claim.says),
            claim.paper,
        ));
        let says = format!("p < 0.05: {}, or less", claim.says);
        shares.push(share("/significant", says, claim.significant));
    }
    let outcome = result("buatier", &shares);
    let (claims, _) = paper_claims(&outcome);
    assert_eq!(claims.len(), 11);
    assert_eq!(claims[0].says, "resist costs more than none");
    let said = headline(&outcome);
    // Four differences that the paper does not find significant are significant here.
    assert!(
        said.starts_with("The result agrees with 7 of the paper's 11 claims"),
        "{said}"
    );
}

#[test]
fn a_declaration_s_claims_are_those_of_its_paper() {
    for (name, count) in [
        ("hamana-4", 1),
        ("harris-wall", 7),
        ("harris-wall-decides", 2),
        ("harris-wall-gentle", 2),
        ("harris-wall-why", 1),
        ("harris-wall-yields", 2),
        ("open-trains", 0),
    ] {
        let experiment = load_experiment(name).unwrap();
        let claims = experiment.declaration.claims.iter();
        let shares = claims.map(|claim| (claim.id.clone(), claim.says.clone(), claim.paper, 9, 16));
        let outcome = result(name, &shares.collect::<Vec<_>>());
        assert_eq!(paper_claims(&outcome).0.len(), count, "{name}");
    }
}

/// All parts must hold; 9 of 16 is undecided, whatever the other part.
#[test]
fn a_claim_is_as_its_worst_part() {
    let of = |first: u64, second: u64| {
        let shares = owned(&[
            (
                "c3-c2",
                "C3: lower median error than C2 (wearers)",
                true,
                first,
                16,
            ),
            (
                "mann-whitney",
                "a study: C3 errs less, p < 0.05",
                true,
                second,
                16,
            ),
        ]);
        let outcome = result("sierotowicz", &shares);
        let (claims, beside) = paper_claims(&outcome);
        assert_eq!((claims.len(), beside.len()), (1, 0));
        claims[0].standing()
    };
    assert_eq!(of(16, 16), ClaimStanding::Judged(Verdict::Like));
    assert_eq!(of(16, 9), ClaimStanding::Judged(Verdict::Undecided));
    assert_eq!(of(16, 1), ClaimStanding::Judged(Verdict::Unlike));
}

/// "All studies together" is one case, which is shown but not counted.
#[test]
fn one_case_is_not_counted() {
    let shares = owned(&[
        ("c4-c2", "C4: lower median error than C2", true, 30, 32),
        ("c4-sign", "all: C4 correlates less than C2", true, 1, 1),
        ("c1-sign", "all: C1 correlates most", true, 0, 1),
    ]);
    let outcome = result("sierotowicz", &shares);
    let said = headline(&outcome);
    assert_eq!(
        said,
        "The result agrees with 1 of the paper's 3 claims in most cases; n = 1, not counted: all: \
         C4 correlates less than C2 (100.0 %); all: C1 correlates most (0.0 %)."
    );
    // Several cases of one wearer count as one, too.
    let one = Share::from_counts("a".into(), "a".into(), Some(true), (1, 1));
    let several = Share {
        holds: 4,
        of: 4,
        ..one.clone()
    };
    assert!(one.is_single() && several.is_single());
    assert_eq!(several.verdict(), None);
    let two = Share::from_counts("a".into(), "a".into(), Some(true), (4, 4));
    assert!(!two.is_single());
}

/// 15 of 16 are 94 %, with an interval from 72 to 99 %: 90 % are neither met nor missed.
#[test]
fn the_least_share_is_judged_by_the_interval() {
    let of = |holds, of| {
        let share = Share::from_counts("a".into(), "a".into(), Some(true), (holds, of));
        share.reaches(0.9)
    };
    assert_eq!(of(15, 16), Some(Reach::Undecided));
    assert_eq!(of(79, 100), Some(Reach::Missed));
    assert_eq!(of(98, 100), Some(Reach::Met));
    assert_eq!(of(0, 0), None);
}

/// Makes rows of two points and of one point under two control laws, with the paper's numbers.
fn finger() -> Outcome {
    let mut outcome = result("hamana-4", &[]);
    let (mut rows, mut conditions) = (Vec::new(), Vec::new());
    for (points, paper, ours) in [
        ("one point, A", 17.6, [41.68, 41.83]),
        ("one point, B", 17.6, [9.55, 15.23]),
        ("two points", 10.68, [5.92, 13.13]),
    ] {
        for (law, ours) in ["recommended law", "paper's law"].into_iter().zip(ours) {
            conditions.push(json!({ "levels": [points, law], "trial": null }));
            rows.push(json!({
                "id": format!("{points}, {law}/rmse_deg"), "quantity": "RMSE", "unit": "°",
                "paper": paper, "ours": ours, "low": ours, "high": ours, "n": 1,
            }));
        }
    }
    outcome.rows = serde_json::from_value(Value::from(rows)).unwrap();
    outcome.conditions = serde_json::from_value(Value::from(conditions)).unwrap();
    outcome
}

#[test]
fn the_finger_s_page_begins_with_two_points_against_the_better_one() {
    let mut outcome = finger();
    let of_wearers = headline(&outcome);
    assert!(of_wearers.starts_with("Median RMSE of 16 wearers, with two points against"));
    outcome.declared.draws = 0;
    let said = headline(&outcome);
    assert!(
        said.starts_with(
            "RMSE with two points against the better point alone: 5.92° against 9.55° \
             (recommended law), 13.1° against 15.2° (paper's law); in the paper: 10.7° against \
             17.6°."
        ),
        "{said}"
    );
    let columns = comparison(&outcome).unwrap().in_columns();
    assert!(columns.starts_with("RMSE, °"), "{columns}");
    assert!(columns.contains("9.55 (one point, B)"), "{columns}");
    assert!(columns.lines().all(|line| line.chars().count() <= 80));
}

/// A page has the claim, its parts, the rule and units, and no t of thousands.
#[test]
fn a_page_has_a_row_for_each_claim_and_no_enormous_t() {
    let mut outcome = result(
        "sierotowicz",
        &owned(&[
            (
                "c3-c2",
                "C3: lower median error than C2 (wearers)",
                true,
                31,
                32,
            ),
            (
                "mann-whitney",
                "a study: C3 errs less, p < 0.05",
                true,
                15,
                16,
            ),
        ]),
    );
    let row = json!({
        "id": "isolation", "quantity": "conducted against isolated, t", "unit": "",
        "paper": 0.358, "ours": -22.5, "low": -2236.0, "high": 1063.7, "n": 9,
    });
    outcome.rows = vec![serde_json::from_value(row).unwrap()];
    let dir = crate::laboratory::folder("paper_claims");
    std::fs::create_dir_all(&dir).unwrap();
    publish(&dir, &outcome, &[]).unwrap();
    let page = std::fs::read_to_string(dir.join("result.html")).unwrap();
    for part in [
        "C3: lower error than C2</th>",
        "agrees in 2 of 2 counted parts",
        "· a study: C3 errs less, p &lt; 0.05</th>",
        "only if all of its parts agree",
        "<td>1</td>",
        "&lt; −100 to &gt; 100",
        "A t statistic beyond ±100 is not printed",
    ] {
        assert!(page.contains(part), "{part}");
    }
    assert!(!page.contains("2236"));
    // The numbers themselves stay in the file.
    let json = std::fs::read_to_string(dir.join("result.json")).unwrap();
    assert!(json.contains("-2236.0"));
}
