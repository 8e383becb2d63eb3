//! How fast the tape plays; printed, not judged: `cargo test -p hal-sim
//! --release --lib chip::soc::playback::tests::speed -- --ignored --nocapture`.

use super::scene::*;
use super::tape::paint;
use crate::chip::Cycle;
use crate::chip::soc::matrix::{Bridge, Slave};
use crate::chip::soc::playback::Pace;
use std::hint::black_box;
use std::time::{Duration, Instant};

fn playing(pace: Pace) -> (Scene, Cycle) {
    let mut scene = Scene::new(pace);
    scene.erase();
    scene.prepare(0);
    let first = scene.start();
    (scene, first)
}

fn per(elapsed: Duration, n: u64) -> f64 {
    elapsed.as_nanos() as f64 / n as f64
}

#[test]
#[ignore = "a measurement"]
fn print_time_per_transfer() {
    for (name, pace, step) in [
        ("lazy, 250 µs at once", Pace::Lazy, 250 * 168),
        ("lazy, 1 µs at once", Pace::Lazy, 168),
        ("per request", Pace::PerRequest, 250 * 168),
    ] {
        let (mut scene, first) = playing(pace);
        let (begun, before) = (Instant::now(), scene.playback.transfers());
        for n in 1..500_000 * 168 / step {
            let at = first + n * step;
            scene.sleep(at);
            if step > 1000 {
                for slot in 0..10 {
                    let us = (at / 168 + 100 + slot * 20) as u32;
                    paint(&mut scene, us % LENGTH, slot as u32);
                }
            }
            scene.edges.clear();
        }
        let transfers = scene.playback.transfers() - before;
        println!(
            "{name}: {:.1} ns per transfer",
            per(begun.elapsed(), transfers)
        );
    }
}

#[test]
#[ignore = "a measurement"]
fn print_time_per_access_of_the_core() {
    for (name, slave, bridge) in [
        ("SRAM2", Slave::Sram2, Bridge::None),
        ("AHB1", Slave::Ahb1, Bridge::None),
        ("APB1", Slave::Ahb1, Bridge::Apb1),
    ] {
        let (mut scene, mut at) = playing(Pace::Lazy);
        let (begun, count) = (Instant::now(), 1_000_000);
        for _ in 0..count {
            let Scene { playback, ram, .. } = &mut scene;
            let wait = playback.pass(slave, bridge, at, ram).unwrap();
            at += u64::from(wait) + 2;
        }
        println!("{name}: {:.1} ns per access", per(begun.elapsed(), count));
        let begun = Instant::now();
        for _ in 0..count {
            black_box(black_box(&scene.playback).next_event());
            black_box(black_box(&scene.playback).lines());
        }
        println!(
            "next event and lines: {:.1} ns",
            per(begun.elapsed(), count)
        );
    }
}
