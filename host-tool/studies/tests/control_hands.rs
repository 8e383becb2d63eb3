//! Tests of control laws on a few random hands: repeatable, no draw excluded.

use hal_sim::body::hand::spec::{A, B};
use studies::hamana2022::{Participants, Population};
use studies::hands::{Contender, DrivenHand, Hands, Plan, contenders, table};
use studies::tracking::wearer::Points;

/// Seed that no chart and no development has used.
const SEED: u64 = 4;
const DRAWS: u64 = 4;

fn campaign() -> Hands {
    let plan = Plan {
        seed: SEED,
        draws: DRAWS,
    };
    let mut few = contenders().unwrap();
    few.retain(|contender| contender.arithmetic() == "fixed");
    Hands::run(plan, None, few, |_| {}).unwrap()
}

#[test]
fn a_campaign_on_hands_repeats_to_the_bit_and_counts_every_draw() {
    let found = campaign();
    assert_eq!(found, campaign());
    let missing: u64 = found.missing.values().sum();
    assert_eq!(found.cases.len() as u64 + missing, DRAWS);
    assert!(
        !found.cases.is_empty(),
        "a seed without hands tests nothing"
    );
    assert_eq!(found.unsettled, 0);
    for case in &found.cases {
        assert!(case.holds_deg >= 1.0);
        assert!(case.held_deg.iter().all(|held| *held >= case.holds_deg));
        assert!(
            case.outcomes
                .iter()
                .flatten()
                .all(|outcome| outcome.rmse_deg.is_finite())
        );
    }
    let text = table::text(&found);
    println!("{text}");
    assert!(text.lines().all(|line| line.chars().count() <= 80));
    let rows = Points::ALL.len() * found.contenders.len();
    assert_eq!(table::csv(&found).lines().count(), 1 + rows);
    assert_eq!(table::json(&found)["drawn"], DRAWS);
}

/// Every draw of the paper's participant P has the thresholds and the forearm's size from the file,
/// and still is another forearm.
#[test]
fn a_wearer_files_hand_is_drawn_but_for_what_the_file_says() {
    let whom = Participants::load(Some("P")).unwrap();
    let population = Population::load_embedded().unwrap();
    let mut held = Vec::new();
    for index in 0..DRAWS {
        let Ok(drawn) = DrivenHand::of_wearer(&population, &whom, (SEED, index)).unwrap() else {
            continue;
        };
        let [one, _] = drawn.ways;
        let [a, b, extensor] = one.ranges_v.map(|range| range.map(|range| range[0]));
        assert_eq!(a.or(b), if a.is_some() { Some(24.0) } else { Some(28.0) });
        assert_eq!(extensor, Some(14.0));
        held.push(drawn.holds_deg);
    }
    assert!(held.len() >= 2, "{held:?}");
    assert!(held.windows(2).all(|pair| pair[0] != pair[1]), "{held:?}");
    let plan = Plan {
        seed: SEED,
        draws: DRAWS,
    };
    let mut few = contenders().unwrap();
    few.retain(|contender| contender.name() == "device default");
    let found = Hands::run(plan, Some(&whom), few, |_| {}).unwrap();
    assert_eq!(found.cases.len(), held.len());
    assert_eq!(found.file_stem(), "control_wearer_P");
    let text = table::text(&found);
    println!("{text}");
    assert!(text.starts_with("Wearer P; what the wearer file"), "{text}");
    assert!(text.lines().all(|line| line.chars().count() <= 80));
}

#[test]
fn the_contenders_are_the_default_the_papers_and_the_pid_controllers() {
    let contenders = contenders().unwrap();
    for (name, title) in [
        ("device default", "default controller"),
        ("default, calibrated", "default controller, calibrated"),
        ("paper", "paper's controller"),
        ("paper +", "paper's controller +"),
        ("pid", "PID controller"),
        ("pid +", "PID controller +"),
    ] {
        let found = contenders.iter().find(|known| known.name() == name);
        assert_eq!(found.map(Contender::title).as_deref(), Some(title));
    }
}

/// One point is used alone, and the hand's reference lies within the range that both ways can hold.
#[test]
fn a_drawn_hand_has_a_target_that_it_holds() {
    let population = Population::load_embedded().unwrap();
    let drawn = (0..DRAWS).find_map(|n| DrivenHand::draw(&population, SEED, n).unwrap().ok());
    let drawn = drawn.expect("a hand");
    let [one, two] = drawn.ways;
    assert_eq!((one.points, two.points), (Points::One, Points::Two));
    assert_ne!(one.leads().used[A], one.leads().used[B]);
    assert_eq!(two.leads().used, [true; 3]);
    for way in drawn.ways {
        let [low, high] = way.held_deg;
        assert!(way.fresh_deg >= high && low < high, "{way:?}");
    }
    let most = drawn.wanted.iter().copied().fold(0.0, f64::max);
    assert!(most < one.held_deg[1].min(two.held_deg[1]));
    let least = drawn.wanted.iter().copied().fold(100.0, f64::min);
    assert!(least > one.held_deg[0].max(two.held_deg[0]));
}
