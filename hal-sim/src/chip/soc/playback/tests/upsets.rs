//! Inverted bits in the registers of a playing stream (RM0090 10.5).

use super::scene::*;
use super::tape::playing;
use crate::chip::Cycle;
use crate::chip::cpu::bus::Modelled;
use crate::chip::soc::Lanes;
use crate::chip::soc::dma::{offset as dma, stream_offset};
use crate::chip::soc::gpio::offset as gpio;
use crate::chip::soc::playback::{Block, Pace};
use crate::chip::soc::timer::offset as tim;

const US: Cycle = 168;
const PLAY_B: usize = STREAMS[0];
const ERASE_B: usize = STREAMS[2];

/// Plays a little more than 10 µs after the first overflow, then inverts `bits` of `register` of
/// `stream`.
fn turned(stream: usize, register: u32, bits: u32) -> (Scene, Cycle, Modelled<bool>) {
    let (mut scene, first) = playing(Pace::Lazy);
    scene.sleep(first + 10 * US + 100);
    let (offset, at) = (stream_offset(stream, register), scene.at);
    let ram = &mut scene.ram;
    let upset = scene.playback.upset_stream(offset, bits, at, ram);
    (scene, first, upset)
}

/// Does the same with a bit of CR, which must be modelled.
fn turned_cr(stream: usize, bit: u32) -> (Scene, Cycle) {
    let (scene, first, upset) = turned(stream, dma::CR, 1 << bit);
    assert_eq!(upset, Ok(true), "bit {bit}");
    (scene, first)
}

fn cr(scene: &mut Scene, stream: usize) -> u32 {
    scene.read(Block::Dma2, stream_offset(stream, dma::CR))
}

/// Checks that no pin of port B changes in the 380 µs from `from` on.
fn assert_b_stands(scene: &mut Scene, from: Cycle) {
    scene.sleep(from);
    scene.edges.clear();
    scene.sleep(from + 380 * US);
    assert!(scene.edges.iter().all(|edge| usize::from(edge.port) != B));
}

#[test]
fn another_channel_asks_for_nothing() {
    for bit in 25..28 {
        let (mut scene, first) = turned_cr(PLAY_B, bit);
        scene.sleep(first + 30 * US + 100);
        let [play_b, others @ ..] = scene.ndtr();
        assert!(
            others.iter().all(|&count| count == play_b - 20),
            "bit {bit}"
        );
    }
}

/// In direct mode the hardware sets bursts and MSIZE; CT has no effect with one buffer, PINCOS none
/// without PINC; levels matter only when two streams request.
#[test]
fn what_has_no_meaning_in_direct_mode_changes_nothing() {
    let (mut unbroken, first) = playing(Pace::Lazy);
    unbroken.sleep(first + 600 * US + 100);
    let expected = (unbroken.edges.len(), unbroken.ndtr());
    for bit in [13, 14, 15, 16, 17, 19, 21, 22, 23, 24] {
        let (mut scene, first) = turned_cr(PLAY_B, bit);
        scene.sleep(first + 600 * US + 100);
        let found = (scene.edges.len(), scene.ndtr());
        assert_eq!(found, expected, "bit {bit}");
    }
}

#[test]
fn a_stream_ends_with_its_items_unless_it_is_circular() {
    // CIRC, and PFCTRL, which clears it.
    for bit in [8, 5] {
        let (mut scene, first) = turned_cr(PLAY_B, bit);
        scene.sleep(first + 490 * US + 100);
        assert_eq!(cr(&mut scene, PLAY_B) & 1, 1);
        scene.sleep(first + 510 * US + 100);
        assert_eq!(cr(&mut scene, PLAY_B) & 1, 0);
    }
}

#[test]
fn without_increment_one_word_is_played_again_and_again() {
    let (mut scene, first) = turned_cr(PLAY_B, 10);
    // Until the word has been erased.
    assert_b_stands(&mut scene, first + 16 * US);
}

#[test]
fn an_address_that_increments_leaves_its_register() {
    let (mut scene, first) = turned_cr(PLAY_B, 9);
    // The slot after the next is written to LCKR, then one to AFRL, one to AFRH.
    for (slot, word) in [(12, 0), (13, 0x8765_4321), (14, 0x0102_0304)] {
        scene.set_word(TAPE_B + 4 * slot, word);
    }
    scene.sleep(first + 14 * US + 100);
    let afr = [gpio::AFRL, gpio::AFRH].map(|value| scene.read(Block::Gpio(B), value));
    assert_eq!(afr, [0x8765_4321, 0x0102_0304]);
}

#[test]
fn a_stream_that_turns_round_writes_what_it_reads_there() {
    // BSRR reads 0, so port B's tape is filled with zeros.
    let (mut scene, first) = turned_cr(PLAY_B, 6);
    scene.sleep(first + 40 * US + 100);
    assert_eq!(scene.word(TAPE_B + 4 * 41), 0);
    // The words that were to be erased overwrite the isolated word.
    let (mut scene, first) = turned_cr(ERASE_B, 6);
    scene.set_word(TAPE_B + 4 * 35, 0xABCD);
    scene.sleep(first + 35 * US + 100);
    assert_eq!(scene.word(ISOLATED[0]), 0xABCD);
}

#[test]
fn items_of_a_byte_are_a_byte_apart() {
    let (mut scene, first) = turned_cr(PLAY_B, 12);
    let begin = scene.ndtr()[0];
    scene.edges.clear();
    scene.sleep(first + 30 * US + 100);
    assert_eq!(scene.ndtr()[0], begin - 20, "counted as before");
    // Only the lowest byte of BSRR is written: pins are set, none is reset.
    let edges = scene
        .edges
        .iter()
        .filter(|edge| usize::from(edge.port) == B);
    let late = edges.filter(|edge| edge.cycle > first + 12 * US);
    assert!(
        late.clone()
            .all(|edge| edge.changed & edge.levels == edge.changed)
    );
    assert!(late.count() > 0);
}

#[test]
fn two_buffers_change_places_at_the_end_of_one() {
    let (mut scene, first) = turned_cr(PLAY_B, 18);
    scene.sleep(first + 495 * US);
    assert_eq!(cr(&mut scene, PLAY_B) >> 19 & 1, 0);
    scene.sleep(first + 505 * US);
    assert_eq!(cr(&mut scene, PLAY_B) >> 19 & 1, 1, "CT");
    assert_b_stands(&mut scene, first + 506 * US);
}

/// RM0090 10.3.6: a memory-to-memory stream needs no requests.
#[test]
fn a_stream_that_copies_does_so_at_once_and_ends() {
    let (mut scene, first) = turned_cr(ERASE_B, 7);
    assert_eq!(cr(&mut scene, ERASE_B) & 1, 0);
    assert!((11..LENGTH).all(|slot| scene.word(TAPE_B + 4 * slot) == ISOLATED_B));
    assert_eq!(scene.flags()[0] >> 16 & 0x20, 0x20, "TCIF2");
    assert_b_stands(&mut scene, first + 14 * US);
}

/// The times of its requests are not modelled, not even until its counter is next read.
#[test]
fn a_centre_aligned_timer_asks_for_nothing_that_is_known() {
    let (mut scene, first) = playing(Pace::Lazy);
    scene.sleep(first + 10 * US + 100);
    let (at, ram) = (scene.at, &mut scene.ram);
    for mode in 1..4 {
        let (block, value) = (Block::Timer(1), mode << 5 | 0b101);
        let mut playback = scene.playback.clone();
        let wait = playback.write(block, tim::CR1, Lanes::whole(value), at, ram);
        assert!(wait.is_err(), "CMS {mode}");
    }
}

#[test]
fn codes_that_are_reserved_are_refused() {
    for (stream, bit) in [(PLAY_B, 7), (PLAY_B, 11), (ERASE_B, 11)] {
        assert!(
            turned(stream, dma::CR, 1 << bit).2.is_err(),
            "{stream} {bit}"
        );
    }
    // EN and interrupt enables can be written; FIFO mode is not modelled.
    for (register, bits) in [
        (dma::CR, 1),
        (dma::CR, 1 << 4),
        (dma::FCR, 4),
        (dma::NDTR, 1),
    ] {
        assert_eq!(turned(PLAY_B, register, bits).2, Ok(false));
    }
    assert_eq!(turned(PLAY_B, dma::FCR, 0x83).2, Ok(true));
}
