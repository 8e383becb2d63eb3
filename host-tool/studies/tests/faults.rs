//! Campaigns of faults on a small scale: the same bytes each time, and nothing severe.
//! Seeds from 1000 on: the judged one is looked at by the command alone.

use host_core::run::chip_image;
use studies::faults::{Campaign, Class, Declaration, Outcome, csv};

const SEED: u64 = 1_000;

/// The first `count` cases of a class.
fn played(class: Class, count: u64) -> (Outcome, Vec<u8>) {
    let declaration = Declaration::of(class).unwrap();
    let image = chip_image(None).unwrap();
    let campaign = Campaign::on_chip(SEED, &declaration, &image).unwrap();
    let cases = campaign.play(count, &mut |_| true).unwrap();
    let last = cases.len() - 1;
    let alone = campaign.case(last as u64).unwrap();
    let rows = csv(class, &cases).unwrap();
    let again = csv(class, &[alone]).unwrap();
    let row = |bytes: &[u8]| {
        String::from_utf8_lossy(bytes)
            .lines()
            .last()
            .map(str::to_owned)
    };
    assert_eq!(row(&rows), row(&again), "a case alone is the same case");
    (Outcome::of(class, &cases), rows)
}

#[test]
fn flips_are_found_and_not_severe() {
    let (outcome, _) = played(Class::Flips, 8);
    println!("{}\n{}", Outcome::head(), outcome.lines());
    assert_eq!((outcome.severe, outcome.stopped), (0, 0));
    assert_eq!(outcome.found, outcome.to_find);
    assert!(outcome.to_find > 0);
}
