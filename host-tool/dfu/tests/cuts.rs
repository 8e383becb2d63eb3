//! Cuts of connection and supply at every point of the procedure.

use crate::fixture::{Contents, chip, classify, firmware, firmware_with, image, run};
use dfu::flash::{ChipState, Finish, FlashError, Image};
use dfu::simulated::{Cut, CutPoint, Simulated, SimulatedClock};
use hal_sim::random::Sequence;
use std::collections::HashMap;

const POINTS: [CutPoint; 3] = [CutPoint::Before, CutPoint::During, CutPoint::After];

/// Cuts a run, checks flash, and flashes again. Returns the contents after the cut.
fn cut_and_recover(
    prepared: &(Simulated, SimulatedClock),
    new: &Image,
    cut: Cut,
    again: Option<Cut>,
) -> Contents {
    let (mut device, clock) = prepared.clone();
    let before = device.memory.bytes().to_vec();
    device.cut = Some(cut);
    let (device, result) = run(device, &clock, new, Finish::Stay);
    let failure = result.expect_err("the cut lies inside the run");
    assert!(
        matches!(failure.error, FlashError::Unplugged { .. }),
        "{cut:?}: {failure}"
    );
    let contents = classify(&device, &before, new);
    let states: &[ChipState] = match contents {
        Contents::Old => &[
            ChipState::Unchanged,
            ChipState::Invalidating,
            ChipState::Unbootable,
        ],
        Contents::OldExceptVectors => &[ChipState::Invalidating, ChipState::Unbootable],
        Contents::Unbootable => &[
            ChipState::Invalidating,
            ChipState::Unbootable,
            ChipState::Committing,
        ],
        Contents::NewExceptVectors => &[ChipState::Committing],
        Contents::New => &[ChipState::Committing, ChipState::Complete],
    };
    assert!(
        states.contains(&failure.chip),
        "{cut:?}: {contents:?} {failure:?}"
    );
    let mut device = device.replugged();
    if let Some(again) = again {
        let middle = device.memory.bytes().to_vec();
        device.cut = Some(again);
        let (interrupted, result) = run(device, &clock, new, Finish::Stay);
        if result.is_err() {
            classify(&interrupted, &middle, new);
        }
        device = interrupted.replugged();
    }
    let (device, result) = run(device, &clock, new, Finish::Stay);
    result.unwrap_or_else(|failure| panic!("{cut:?}: the second run failed: {failure}"));
    assert_eq!(classify(&device, &before, new), Contents::New);
    contents
}

fn transfers(prepared: &(Simulated, SimulatedClock), new: &Image) -> u64 {
    let (device, clock) = prepared.clone();
    let (device, result) = run(device, &clock, new, Finish::Stay);
    result.unwrap();
    device.transfers
}

fn count(counts: &mut HashMap<Contents, u32>, contents: Contents) {
    *counts.entry(contents).or_default() += 1;
}

#[test]
fn a_cut_at_every_transfer_of_a_small_image() {
    let mut counts = HashMap::new();
    let mut total = 0;
    for (old, length) in [(40_000, 5_000), (3_000, 20_001), (0, 2_048), (70_000, 400)] {
        let old = if old == 0 {
            Vec::new()
        } else {
            firmware(old, 1)
        };
        let prepared = chip(&old);
        let new = image(&firmware(length, 2));
        let transfers = transfers(&prepared, &new);
        println!("image of {length} bytes: {transfers} transfers");
        for transfer in 0..transfers {
            for point in POINTS {
                for seed in 0..3 {
                    let seed = transfer * 3 + seed;
                    let cut = Cut {
                        transfer,
                        point,
                        seed,
                    };
                    count(&mut counts, cut_and_recover(&prepared, &new, cut, None));
                    total += 1;
                }
            }
        }
    }
    println!("{total} cuts: {counts:?}");
}

#[test]
fn two_hundred_random_cuts_of_a_large_image() {
    let mut counts = HashMap::new();
    let mut random = Sequence::new(200);
    let prepared = chip(&firmware(500_000, 3));
    let new = image(&firmware(300_000, 4));
    let transfers = transfers(&prepared, &new);
    println!("image of 300000 bytes: {transfers} transfers");
    for seed in 0..200 {
        let cut = Cut {
            transfer: random.below(transfers),
            point: POINTS[random.below(3) as usize],
            seed,
        };
        let again = (seed % 2 == 0).then(|| Cut {
            transfer: random.below(transfers),
            point: POINTS[random.below(3) as usize],
            seed: seed + 1000,
        });
        count(&mut counts, cut_and_recover(&prepared, &new, cut, again));
    }
    println!("{counts:?}");
}

/// The erase of sector 0, the invalidation and the commit hold the critical moments.
#[test]
fn many_seeds_at_the_operations_on_sector_0() {
    let mut counts = HashMap::new();
    let prepared = chip(&firmware(30_000, 5));
    let new = image(&firmware(3_000, 6));
    let transfers = transfers(&prepared, &new);
    for transfer in 0..transfers {
        for seed in 0..40 {
            let cut = Cut {
                transfer,
                point: CutPoint::During,
                seed: seed * 1_000 + transfer,
            };
            count(&mut counts, cut_and_recover(&prepared, &new, cut, None));
        }
    }
    println!("{counts:?}");
    for contents in [
        Contents::Old,
        Contents::New,
        Contents::OldExceptVectors,
        Contents::NewExceptVectors,
        Contents::Unbootable,
    ] {
        assert!(
            counts.contains_key(&contents),
            "{contents:?} never occurred"
        );
    }
}

/// Cuts each write of `prepared` at each byte that `lefts` gives bits for: the bits of this byte
/// that are not programmed yet. Returns the number of cuts.
fn cut_bytes(
    prepared: &(Simulated, SimulatedClock),
    new: &Image,
    lefts: impl Fn(usize) -> Vec<u8>,
    counts: &mut HashMap<Contents, u32>,
) -> u32 {
    let (device, clock) = prepared.clone();
    let (device, result) = run(device, &clock, new, Finish::Stay);
    result.unwrap();
    let mut cuts = 0;
    for (&transfer, &(_, length)) in device.writing.iter().zip(&device.written) {
        for byte in 0..length {
            for left in lefts(length) {
                let byte = u16::try_from(byte).unwrap();
                let cut = Cut {
                    transfer,
                    point: CutPoint::AtByte { byte, left },
                    seed: 0,
                };
                count(counts, cut_and_recover(prepared, new, cut, None));
                cuts += 1;
            }
        }
    }
    cuts
}

/// A ROM that programs bytes leaves words of which some bytes are written.
#[test]
fn a_cut_after_every_byte_that_is_written() {
    let mut counts = HashMap::new();
    let prepared = chip(&firmware(3_000, 1));
    let new = image(&firmware(2_500, 2));
    let cuts = cut_bytes(&prepared, &new, |_| vec![0], &mut counts);
    println!("{cuts} cuts: {counts:?}");
    assert!(cuts > 2_500);
}

/// Every set of bits of every byte of the vectors, and for stack pointers at the ends of both RAMs
/// sets of one bit and of all bits but one.
#[test]
fn a_cut_at_every_set_of_bits_of_the_vectors() {
    const COMMON: (u32, u32) = (0x2001_C000, 0x2001_C000);
    let mut counts = HashMap::new();
    let mut cuts = 0;
    for (old, new) in [
        COMMON,
        (0x2002_0000, 0x2001_FFFC),
        (0x1001_0000, 0x2002_0000),
        (0x2000_0004, 0x1001_0000),
        (0x1000_FFFC, 0x1000_0004),
        // An interrupted commit, and firmware that is none.
        (0x2801_C000, 0x2001_C000),
        (0xFFFF_FFFF, 0x2001_FFF0),
    ] {
        let prepared = chip(&firmware_with(old, 600, 1));
        let written = image(&firmware_with(new, 400, 2));
        let lefts = |length| match length {
            4 if (old, new) == COMMON => (0..=0xFF).collect(),
            4 => (0..8).flat_map(|bit| [1 << bit, !(1 << bit)]).collect(),
            _ => Vec::new(),
        };
        cuts += cut_bytes(&prepared, &written, lefts, &mut counts);
    }
    println!("{cuts} cuts: {counts:?}");
    for contents in [
        Contents::Old,
        Contents::New,
        Contents::OldExceptVectors,
        Contents::NewExceptVectors,
    ] {
        assert!(
            counts.contains_key(&contents),
            "{contents:?} never occurred"
        );
    }
}
