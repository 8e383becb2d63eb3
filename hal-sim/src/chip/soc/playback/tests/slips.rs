//! Missed and additional requests, and wrong clocks.

use super::scene::*;
use super::tape::playing;
use crate::chip::Cycle;
use crate::chip::soc::playback::{Block, Pace, Slip};
use crate::chip::soc::timer::Clocking;
use crate::chip::soc::timer::offset as tim;

const US: Cycle = 168;

/// Plays for a little more than 10 µs after the first overflow.
fn under_way(pace: Pace) -> (Scene, Cycle) {
    let (mut scene, first) = playing(pace);
    scene.sleep(first + 10 * US + 100);
    (scene, first)
}

#[test]
fn a_request_unseen_or_unasked_shifts_its_stream_by_one() {
    for pace in [Pace::Lazy, Pace::PerRequest] {
        for (place, stream) in STREAMS.into_iter().enumerate() {
            for (slip, shift) in [(Slip::Unseen, 1), (Slip::Unasked, LENGTH - 1)] {
                let (mut scene, first) = under_way(pace);
                let (at, ram) = (scene.at, &mut scene.ram);
                scene.playback.slip(stream, slip, at, ram).unwrap();
                scene.sleep(first + 20 * US + 100);
                let left = scene.ndtr();
                let others: Vec<_> = (0..4).filter(|&n| n != place).map(|n| left[n]).collect();
                assert!(others.iter().all(|&count| count == others[0]), "{left:?}");
                let expected = (others[0] + shift) % LENGTH;
                assert_eq!(left[place], expected, "{stream} {slip:?}");
            }
        }
    }
}

#[test]
fn a_timer_that_stands_asks_nobody_and_its_slave_stands() {
    let (mut scene, first) = under_way(Pace::Lazy);
    let (at, ram) = (scene.at, &mut scene.ram);
    scene
        .playback
        .misclock(1, Clocking::Stands, at, ram)
        .unwrap();
    let before = (scene.ndtr(), scene.read(Block::Timer(2), tim::CNT));
    scene.sleep(first + 1_000 * US);
    let after = (scene.ndtr(), scene.read(Block::Timer(2), tim::CNT));
    assert_eq!(before, after);
    assert_eq!(
        scene.read(Block::Timer(1), tim::CR1) & 1,
        1,
        "no register shows it"
    );
}

#[test]
fn a_slave_that_stands_leaves_its_master_alone() {
    let (mut scene, first) = under_way(Pace::Lazy);
    let (at, ram) = (scene.at, &mut scene.ram);
    scene
        .playback
        .misclock(2, Clocking::Stands, at, ram)
        .unwrap();
    let (left, count) = (scene.ndtr(), scene.read(Block::Timer(2), tim::CNT));
    scene.sleep(first + 110 * US + 100);
    assert_eq!(scene.ndtr(), left.map(|count| count - 100));
    assert_eq!(scene.read(Block::Timer(2), tim::CNT), count);
}

#[test]
fn one_edge_of_four_makes_a_lap_four_times_as_long() {
    let (mut scene, _) = under_way(Pace::Lazy);
    let (at, ram) = (scene.at, &mut scene.ram);
    scene
        .playback
        .misclock(1, Clocking::Every(4), at, ram)
        .unwrap();
    let before = scene.ndtr()[0];
    scene.sleep(at + 40 * US);
    let played = before - scene.ndtr()[0];
    assert!((9..=11).contains(&played), "{played}");
    let (mut scene, first) = under_way(Pace::Lazy);
    let (at, ram) = (scene.at, &mut scene.ram);
    scene
        .playback
        .misclock(2, Clocking::Every(4), at, ram)
        .unwrap();
    let before = scene.read(Block::Timer(2), tim::CNT);
    scene.sleep(first + 50 * US + 100);
    let counted = scene.read(Block::Timer(2), tim::CNT) - before;
    assert!((9..=11).contains(&counted), "{counted}");
}

#[test]
fn a_lap_of_another_length_shows_in_no_register() {
    for cycles in [84, 336] {
        let (mut scene, _) = under_way(Pace::Lazy);
        let lap = scene.playback.next_lap(scene.at);
        scene.sleep(lap + 1);
        let (at, ram) = (scene.at, &mut scene.ram);
        scene.playback.misreload(cycles, at, ram).unwrap();
        let before = scene.ndtr()[0];
        scene.sleep(lap + 40 * US);
        let played = u64::from(before - scene.ndtr()[0]);
        let expected = 40 * US / u64::from(cycles);
        assert!(played.abs_diff(expected) <= 1, "{played} of {expected}");
        assert_eq!(scene.read(Block::Timer(1), tim::ARR), 167);
        scene.tim1(tim::ARR, 167);
        let mended = scene.playback.next_lap(scene.at);
        assert!(mended - scene.at <= 168, "until it is written");
    }
    let (mut scene, _) = under_way(Pace::Lazy);
    let (at, ram) = (scene.at, &mut scene.ram);
    let passed = scene.playback.misreload(84, at, ram);
    assert!(passed.is_err(), "it has counted further");
}
