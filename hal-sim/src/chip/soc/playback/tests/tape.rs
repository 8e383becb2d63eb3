//! The tape without disturbances.

use super::scene::*;
use crate::chip::Cycle;
use crate::chip::soc::playback::{Block, Pace};
use crate::chip::soc::timer::offset as tim;

const US: Cycle = 168;

/// Writes words into a slot that differ from their neighbours on both ports.
pub fn paint(scene: &mut Scene, slot: u32, step: u32) {
    let bit = |lines: &[u32]| 1 << lines[step as usize % lines.len()];
    let (b, c) = (bit(&[0, 1, 5, 6, 7, 8, 9]), bit(&[0, 1, 2, 3, 4, 5]));
    scene.set_word(TAPE_B + 4 * slot, ISOLATED_B & !(b << 16) | b);
    scene.set_word(TAPE_C + 4 * slot, ISOLATED_C & !(c << 16) | c);
}

/// Plays a tape whose slots all differ, and returns the cycle of the first overflow.
pub fn playing(pace: Pace) -> (Scene, Cycle) {
    let mut scene = Scene::new(pace);
    scene.erase();
    for slot in 0..LENGTH {
        paint(&mut scene, slot, slot);
    }
    scene.prepare(0);
    let first = scene.start();
    (scene, first)
}

#[test]
fn all_slots_play_in_order_erase_themselves_and_count_down() {
    let mut scene = Scene::new(Pace::Lazy);
    scene.erase();
    for slot in 0..LENGTH {
        paint(&mut scene, slot, slot);
    }
    scene.prepare(0);
    let first = scene.start();
    for us in 0..3 * LENGTH {
        // The quiet part: TIM1 counts 72..100.
        let overflow = first + US * Cycle::from(us);
        scene.sleep(overflow + 75);
        assert_eq!(scene.read(Block::Timer(2), tim::CNT), us);
        let played = (us + 1) % LENGTH;
        assert_eq!(scene.ndtr(), [LENGTH - played; 4], "microsecond {us}");
        assert_eq!(scene.word(TAPE_B + 4 * (us % LENGTH)), ISOLATED_B);
        assert_eq!(scene.word(TAPE_C + 4 * (us % LENGTH)), ISOLATED_C);
        paint(&mut scene, us % LENGTH, us + LENGTH);
    }
    let flags = scene.flags();
    let errors = 0b1101 | 0b1101 << 6 | 0b1101 << 16 | 0b1101 << 22;
    assert_eq!(flags.map(|f| f & errors), [0, 0]);
    let edges = std::mem::take(&mut scene.edges);
    for (port, lines) in [(B, &[0u32, 1, 5, 6, 7, 8, 9][..]), (C, &[0, 1, 2, 3, 4, 5])] {
        let seen: Vec<_> = edges
            .iter()
            .filter(|e| usize::from(e.port) == port)
            .collect();
        assert_eq!(seen.len(), 3 * LENGTH as usize);
        for (us, edge) in seen.iter().enumerate() {
            let painted = lines.iter().fold(0, |mask, l| mask | 1u16 << l);
            assert_eq!(edge.levels & painted, 1 << lines[us % lines.len()]);
            let overflow = first + US * us as Cycle;
            // Arbitration, address, change of master, write; port C's request comes at TIM1's 8,
            // when DMA2 still is AHB1's master.
            let expected = if port == B { 4 } else { 8 + 3 };
            assert_eq!(edge.cycle - overflow, expected);
        }
    }
}
