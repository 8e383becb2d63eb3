//! Requests closer together than the tape ever makes them.

use super::scene::*;
use crate::chip::Cycle;
use crate::chip::soc::dma::{offset as dma, stream_offset};
use crate::chip::soc::gpio::{Edge, offset as gpio};
use crate::chip::soc::playback::{Block, PERIPHERAL, Pace};
use crate::chip::soc::timer::offset as tim;
use proptest::prelude::*;

const ON: u32 = 2 << 13 | 2 << 11 | 1 << 10 | 1;
const CIRCULAR: u32 = 1 << 8;
const PLAYS: u32 = 1 << 6;
const FEIF: u32 = 1;
const TCIF: u32 = 1 << 5;

/// Starts `streams` (number, CR, peripheral address, NDTR), each with its own 64 words of memory
/// that count up; ports B and C are outputs, TIM1 matches at `ccr` and has the requests `dier`.
/// Returns the cycle of the first overflow.
fn crowd(scene: &mut Scene, streams: &[(usize, u32, u32, u32)], ccr: [u32; 4], dier: u32) -> Cycle {
    scene.write(Block::Gpio(B), gpio::MODER, 0x5555_5555);
    scene.write(Block::Gpio(C), gpio::MODER, 0x5555_5555);
    for word in 0..1024 {
        scene.set_word(SRAM2 + 4 * word, (!word & 0xFFFF) << 16 | word);
    }
    for &(stream, cr, far, ndtr) in streams {
        let at = |register| stream_offset(stream, register);
        scene.write(Block::Dma2, at(dma::PAR), far);
        scene.write(Block::Dma2, at(dma::M0AR), SRAM2 + 256 * stream as u32);
        scene.write(Block::Dma2, at(dma::NDTR), ndtr);
        scene.write(Block::Dma2, at(dma::FCR), 0);
        scene.write(Block::Dma2, at(dma::CR), cr);
    }
    scene.tim1(tim::ARR, 167);
    for (n, at) in ccr.into_iter().enumerate() {
        scene.tim1(tim::CCR1 + 4 * n as u32, at);
    }
    scene.tim1(tim::CNT, 160);
    scene.tim1(tim::DIER, dier << 8);
    scene.start()
}

const BSRR_B: u32 = 0x4002_0418;
const BSRR_C: u32 = 0x4002_0818;
const FAR_WORD: u32 = SRAM2 + 0x1000;

fn edges_of(edges: &[Edge], port: usize, from: Cycle) -> Vec<Cycle> {
    let of_port = edges
        .iter()
        .filter(|e| usize::from(e.port) == port && e.cycle >= from);
    of_port.map(|e| e.cycle - from).collect()
}

/// Two requests in one cycle: the higher level comes first, then the lower number.
#[test]
fn the_arbiter_decides_between_requests_of_one_cycle() {
    for (level_1, level_5, first, second) in [(3, 3, C, B), (2, 3, B, C), (0, 0, C, B)] {
        let mut scene = Scene::new(Pace::Lazy);
        let cr = |level: u32| 6 << 25 | level << 16 | PLAYS | CIRCULAR | ON;
        let streams = [(5, cr(level_5), BSRR_B, 64), (1, cr(level_1), BSRR_C, 64)];
        let overflow = crowd(&mut scene, &streams, [0; 4], 0b11);
        scene.sleep(overflow + 160);
        // Grant, address, change of master, write; then the same without a change.
        assert_eq!(edges_of(&scene.edges, first, overflow), [4]);
        assert_eq!(edges_of(&scene.edges, second, overflow), [4 + 3]);
    }
}

/// Channel 0 of stream 6 serves three events: the second comes while the next word is being
/// fetched, the third is lost in the second (RM0090 10.3.18).
#[test]
fn a_request_before_the_word_is_there_raises_feif() {
    for (dier, transfers, flag) in [(0b0010, 1, 0), (0b0110, 2, FEIF), (0b1110, 2, FEIF)] {
        let mut scene = Scene::new(Pace::Lazy);
        let streams = [(6, PLAYS | CIRCULAR | ON, BSRR_B, 64)];
        let overflow = crowd(&mut scene, &streams, [50, 56, 57, 0], dier);
        scene.sleep(overflow + 160);
        assert_eq!(scene.playback.transfers, transfers);
        assert_eq!(scene.flags()[1] >> 16 & FEIF, flag);
    }
}

/// The opposite direction: the word is not written yet. Requested at 50, stream 6 is granted at 50
/// and reads from 52 (53: change of master) to 54; it is granted again at 54 and writes from 56
/// (57) to 58. A request before 58 waits until then.
#[test]
fn a_request_before_the_word_is_gone_waits_for_it() {
    for (second, flag, granted) in [(55, FEIF, 58), (57, FEIF, 58), (58, 0, 58), (60, 0, 60)] {
        let mut scene = Scene::new(Pace::Lazy);
        let streams = [
            (6, CIRCULAR | ON, FAR_WORD, 64),
            (5, 6 << 25 | PLAYS | CIRCULAR | ON, BSRR_B, 64),
        ];
        // Port B's item at the overflow leaves SRAM2 to the memory port.
        let overflow = crowd(&mut scene, &streams, [50, second, 0, 0], 0b0111);
        scene.sleep(overflow + 160);
        assert_eq!(scene.playback.transfers, 3);
        assert_eq!(scene.flags()[1] >> 16 & FEIF, flag, "{second}");
        // The second read: grant, address, change of master, access.
        let expected = granted + 4;
        assert_eq!(scene.playback.ports[PERIPHERAL].free - overflow, expected);
    }
}

/// Stream 2 reads SRAM2 from 53 to 54 (change of master at 52). Its write and stream 6's read are
/// both requested at 56: the memory port comes first, because the peripheral port was last. Write
/// from 57 to 58, read from 59 to 60.
#[test]
fn the_ports_take_turns_on_one_slave() {
    let mut scene = Scene::new(Pace::Lazy);
    let cr = 6 << 25 | CIRCULAR | ON;
    let streams = [(2, cr, FAR_WORD, 64), (6, cr, FAR_WORD, 64)];
    let overflow = crowd(&mut scene, &streams, [0, 50, 51, 0], 0b1100);
    scene.sleep(overflow + 160);
    assert_eq!(scene.playback.ports[PERIPHERAL].free - overflow, 60);
}

/// The core's write of DIER occupies AHB1 while stream 5's item waits for it and stream 1 waits for
/// the port: the item is moved, the request is dropped.
#[test]
fn a_request_that_is_disabled_before_its_grant_is_dropped() {
    for (dier, transfers) in [(0b11, 2), (0b01, 1)] {
        let mut scene = Scene::new(Pace::Lazy);
        let cr = 6 << 25 | PLAYS | CIRCULAR | ON;
        let streams = [(5, cr, BSRR_B, 64), (1, cr, BSRR_C, 64)];
        let overflow = crowd(&mut scene, &streams, [1, 0, 0, 0], 0b11);
        scene.sleep(overflow);
        scene.tim1(tim::DIER, dier << 8);
        scene.sleep(overflow + 160);
        assert_eq!(scene.playback.transfers, transfers);
    }
}

#[test]
fn a_stream_that_is_not_circular_ends_off_and_complete() {
    for (cr, far) in [(PLAYS, BSRR_B), (0, FAR_WORD)] {
        let mut scene = Scene::new(Pace::Lazy);
        let overflow = crowd(&mut scene, &[(5, 6 << 25 | cr | ON, far, 3)], [0; 4], 1);
        scene.sleep(overflow + 168 + 100);
        let place = |register| stream_offset(5, register);
        assert_eq!(scene.read(Block::Dma2, place(dma::NDTR)), 1);
        assert_eq!(scene.read(Block::Dma2, place(dma::CR)) & 1, 1);
        scene.sleep(overflow + 20 * 168);
        assert_eq!(scene.playback.transfers, 3);
        assert_eq!(scene.read(Block::Dma2, place(dma::NDTR)), 0);
        assert_eq!(scene.read(Block::Dma2, place(dma::CR)) & 1, 0);
        assert_eq!(scene.flags()[1] >> 6 & TCIF, TCIF);
        let erased: Vec<u32> = (0..4)
            .map(|n| scene.word(SRAM2 + 256 * 5 + 4 * n))
            .collect();
        let (from, own) = (scene.word(FAR_WORD), 64 * 5);
        let counted = |n: u32| (!(own + n) & 0xFFFF) << 16 | (own + n);
        let expected = if cr == 0 {
            [from, from, from, counted(3)]
        } else {
            [0, 1, 2, 3].map(counted)
        };
        assert_eq!(erased, expected);
    }
}

#[test]
fn requests_that_nobody_serves_are_kept_and_merged() {
    let mut scene = Scene::new(Pace::Lazy);
    let overflow = crowd(&mut scene, &[], [0; 4], 1);
    scene.sleep(overflow + 10 * 168 + 80);
    let at = |register| stream_offset(5, register);
    scene.write(Block::Dma2, at(dma::PAR), BSRR_B);
    scene.write(Block::Dma2, at(dma::M0AR), SRAM2);
    scene.write(Block::Dma2, at(dma::NDTR), 64);
    scene.write(Block::Dma2, at(dma::CR), 6 << 25 | PLAYS | CIRCULAR | ON);
    scene.sleep(overflow + 10 * 168 + 160);
    assert_eq!(scene.playback.transfers, 1);
}

#[test]
fn a_prescaler_slows_requests_down_from_the_next_update_on() {
    let stream = [(5, 6 << 25 | PLAYS | CIRCULAR | ON, BSRR_B, 64)];
    for step in [7, 168, 40_000] {
        let mut scene = Scene::new(Pace::Lazy);
        let overflow = crowd(&mut scene, &stream, [0; 4], 1);
        scene.sleep(overflow + 10 * 168 - 60);
        let before = scene.playback.transfers;
        scene.write(Block::Timer(1), tim::PSC, 3);
        let end = scene.at + 40 * 168;
        while scene.at < end {
            let to = (scene.at + step).min(end);
            scene.sleep(to);
        }
        // One with the update, then one in four laps.
        assert_eq!(scene.playback.transfers - before, 10, "{step}");
    }
}

fn streams() -> impl Strategy<Value = Vec<(usize, u32, u32, u32)>> {
    let stream = (
        any::<bool>(),
        0u32..4,
        any::<bool>(),
        any::<bool>(),
        1u32..64,
    );
    prop::collection::vec(stream, 5).prop_map(|draws| {
        let numbers = [(5, 6u32), (1, 6), (2, 6), (6, 6), (4, 6)];
        let cr = |plays, level, circular| {
            u32::from(plays) << 6 | level << 16 | u32::from(circular) << 8 | ON
        };
        let every = draws.into_iter().zip(numbers);
        every
            .map(|((plays, level, circular, b, ndtr), (number, channel))| {
                let far = match (plays, b) {
                    (true, true) => BSRR_B,
                    (true, false) => BSRR_C,
                    (false, _) => FAR_WORD + 4 * number as u32,
                };
                (
                    number,
                    channel << 25 | cr(plays, level, circular),
                    far,
                    ndtr,
                )
            })
            .collect()
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    /// Skipping whole laps gives the same result as single cycles.
    #[test]
    fn a_leap_does_what_single_cycles_do(
        streams in streams(),
        ccr in [0u32..60, 0..60, 0..60, 0..60],
        cycles in 1u64..3000,
    ) {
        let mut seen = Vec::new();
        for step in [1, cycles] {
            let mut scene = Scene::new(Pace::Lazy);
            crowd(&mut scene, &streams, ccr, 0x1F);
            let end = scene.at + cycles;
            while scene.at < end {
                let to = scene.at + step;
                scene.sleep(to);
            }
            let ndtr: Vec<u32> = (0..8)
                .map(|s| scene.read(Block::Dma2, stream_offset(s, dma::NDTR)))
                .collect();
            let flags = scene.flags();
            scene.sleep(scene.at + 20);
            seen.push((scene.edges, ndtr, flags, scene.ram.bytes.to_vec()));
        }
        prop_assert_eq!(&seen[0].0, &seen[1].0);
        prop_assert_eq!(&seen[0].1, &seen[1].1);
        prop_assert_eq!(seen[0].2, seen[1].2);
        prop_assert!(seen[0].3 == seen[1].3);
    }
}
