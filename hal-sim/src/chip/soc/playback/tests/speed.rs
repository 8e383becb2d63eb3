//! How fast the tape plays; printed, not judged: `cargo test -p hal-sim
//! --release --lib chip::soc::playback::tests::speed -- --ignored --nocapture`.

use super::scene::*;
use super::tape::paint;
use crate::chip::Cycle;
use crate::chip::soc::playback::Pace;
use std::time::Instant;

#[test]
#[ignore = "a measurement"]
fn print_time_per_transfer() {
    for (name, pace, step) in [
        ("lazy, 250 µs at once", Pace::Lazy, 250 * 168),
        ("lazy, 100 cycles at once", Pace::Lazy, 100),
        ("per request", Pace::PerRequest, 250 * 168),
    ] {
        for painted in [false, true] {
            let mut scene = Scene::new(pace);
            scene.erase();
            scene.prepare(0);
            let first = scene.start();
            let (begun, before) = (Instant::now(), scene.playback.transfers());
            let end = first + 168 * 500_000;
            let mut at: Cycle = first;
            while at < end {
                at += step;
                scene.sleep(at);
                if painted && step > 1000 {
                    for slot in 0..10 {
                        paint(
                            &mut scene,
                            (at / 168 + 100 + slot * 20) as u32 % LENGTH,
                            slot as u32,
                        );
                    }
                }
                scene.edges.clear();
            }
            let transfers = scene.playback.transfers() - before;
            let nanoseconds = begun.elapsed().as_nanos() as f64;
            println!(
                "{name}, painted {painted}: {:.1} ns per transfer, {:.1} × real time",
                nanoseconds / transfers as f64,
                0.5e9 / nanoseconds
            );
        }
    }
}
