//! Sequence answers: the procedure ends within a bounded number of transfers and keeps the rules.

use crate::fixture::{Contents, chip, classify, firmware, image};
use dfu::chip::STM32F405;
use dfu::flash::{Finish, flash};
use dfu::protocol::Session;
use dfu::simulated::HostileDevice;
use hal_sim::random::Sequence;

/// Upper bound of transfers. A run without faults takes about 180 and an endless operation adds at most
/// 1,800.
const MOST: u64 = 2_000;

#[test]
fn ten_thousand_random_devices() {
    let old = firmware(20_000, 1);
    let new = image(&firmware(9_000, 2));
    let (prepared, _) = chip(&old);
    let before = prepared.memory.bytes().to_vec();
    let (mut succeeded, mut most, mut changed) = (0, 0, 0);
    let mut random = Sequence::new(99);
    for seed in 0..10_000 {
        // From all answers random to about one in a run.
        let rarity = 1 + random.below(400);
        let (mut fresh, clock) = chip(&[]);
        fresh.memory = prepared.memory.clone();
        let device = HostileDevice::new(fresh, seed, rarity);
        let mut session = Session::new(device, clock, 2048, STM32F405.firmware());
        let result = flash(&mut session, &new, Finish::Stay, &mut |_| {});
        most = most.max(session.transfers());
        let device = session.into_transport();
        let contents = classify(device.inner(), &before, &new);
        if result.is_ok() {
            succeeded += 1;
            assert_eq!(contents, Contents::New, "seed {seed}");
        }
        changed += u32::from(contents != Contents::Old);
    }
    println!("10000 devices: {succeeded} succeeded, {changed} changed, at most {most} transfers");
    assert!(succeeded > 100 && changed > 1_000);
    assert!(most < MOST, "{most}");
}
