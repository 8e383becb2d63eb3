//! Measures how often the laboratory's searches are wrong on wearers with known values.

use host_core::search::Search;
use studies::laboratory::search::{Curve, JUDGED, SearchCases, SearchCounts, judge};

/// Prints every case, and checks the judged ones against the declaration.
fn judged(first_seed: u64, searches: u64) {
    let declared = SearchCases::parse(JUDGED).unwrap();
    for case in &declared.cases {
        let tally = judge(case, first_seed, searches).unwrap();
        let SearchCounts {
            searches,
            early,
            missed,
            findable,
            within,
            covered,
            ..
        } = tally;
        let per = |total: u64| total as f64 / searches as f64;
        println!(
            "{:30} false {early} + {missed} of {searches}, within a step {within} of {findable} \
             ({:.1} %), interval {covered}, worst {:.2} steps; {:.1} presentations, {:.0} pulses; \
             false alarms calculated {:.1e}",
            case.name,
            1e2 * tally.within_share(),
            tally.worst_steps,
            per(tally.presentations),
            per(tally.pulses),
            Search::new(case.search.clone()).unwrap().false_alarm(),
        );
        if case.correlation > 0.0 {
            continue; // printed, not judged
        }
        assert!(tally.false_share() < 0.01, "{}", case.name);
        if case.curve != Curve::Still {
            assert!(tally.within_share() >= 0.95, "{}", case.name);
        }
    }
}

/// Uses development seeds.
#[test]
fn drawn_wearers_are_searched_rightly() {
    judged(1, 300);
}

/// Uses the declared seeds, which no development has used.
#[test]
fn the_judged_run_holds() {
    let declared = SearchCases::parse(JUDGED).unwrap();
    assert!(declared.searches >= 1000);
    judged(declared.first_seed, declared.searches);
}
