//! The tape next to a busy core, stopped, or slipped. The results do not depend on how often time
//! is advanced.

use super::scene::*;
use super::tape::{paint, playing};
use crate::chip::Cycle;
use crate::chip::soc::dma::{offset as dma, stream_offset};
use crate::chip::soc::gpio::{Edge, Level, offset as gpio};
use crate::chip::soc::matrix::{Bridge, Slave};
use crate::chip::soc::playback::{Block, Pace};
use crate::chip::soc::timer::offset as tim;
use proptest::prelude::*;

const US: Cycle = 168;

/// Returns the cycles from `overflow` to the only edge of `port` in that microsecond.
fn edge_after(scene: &Scene, port: usize, overflow: Cycle) -> Cycle {
    let in_it =
        |e: &&Edge| usize::from(e.port) == port && (overflow..overflow + US).contains(&e.cycle);
    let [edge] = scene.edges.iter().filter(in_it).collect::<Vec<_>>()[..] else {
        panic!("one edge a microsecond")
    };
    edge.cycle - overflow
}

/// The core reads at every cycle around port B's write, through each bridge: the write is delayed
/// by the rest of the core's access, and by nothing else.
#[test]
fn an_access_of_the_core_shifts_an_edge_by_its_own_length_at_most() {
    for (bridge, longest) in [(Bridge::None, 1), (Bridge::Apb2, 5), (Bridge::Apb1, 12)] {
        let mut late = Vec::new();
        for offset in 0..40u64 {
            let (mut scene, first) = playing(Pace::Lazy);
            let overflow = first + 10 * US;
            // The core is AHB1's last master in any case.
            scene.sleep(overflow - 60);
            let Scene { playback, ram, .. } = &mut scene;
            playback
                .access_slave(Slave::Ahb1, Bridge::None, overflow - 60, ram)
                .unwrap();
            let at = overflow - 20 + offset;
            let wait = playback.access_slave(Slave::Ahb1, bridge, at, ram).unwrap();
            let done = at + Cycle::from(wait) + 1;
            scene.sleep(overflow + 100);
            let shift = edge_after(&scene, B, overflow) - 4;
            // DMA2 requests AHB1 two cycles after the overflow.
            let expected = if at < overflow + 2 {
                done.saturating_sub(overflow + 2)
            } else {
                0
            };
            assert_eq!(shift, expected, "{bridge:?} {offset}");
            late.push(shift);
        }
        assert!(late.iter().max() <= Some(&longest), "{bridge:?}: {late:?}");
        assert!(
            late.iter().max() >= Some(&(longest - 1)),
            "{bridge:?}: {late:?}"
        );
    }
}

/// Conversely, a read of GPIO waits while DMA2 writes there.
#[test]
fn dma_makes_the_core_wait() {
    let waits: Vec<u32> = (0..6)
        .map(|offset| {
            let (mut scene, first) = playing(Pace::Lazy);
            let overflow = first + 10 * US;
            scene.sleep(overflow - 60);
            let Scene { playback, ram, .. } = &mut scene;
            playback
                .access_slave(Slave::Ahb1, Bridge::None, overflow - 60, ram)
                .unwrap();
            playback
                .access_slave(Slave::Ahb1, Bridge::None, overflow + offset, ram)
                .unwrap()
        })
        .collect();
    // DMA2 requests at 2 (and wins, since the core was last), changes master in 2, writes in 3; the
    // core's access after that costs a change of master.
    assert_eq!(waits, [0, 0, 3, 2, 1, 1]);
}

#[test]
fn sram1_is_never_contended_and_sram2_is() {
    let (scene, _) = playing(Pace::Lazy);
    assert!(!scene.playback.is_shared(Slave::Sram1));
    assert!(scene.playback.is_shared(Slave::Sram2));
}

#[test]
fn compare_interrupts_come_at_the_exact_cycle() {
    let (mut scene, first) = playing(Pace::Lazy);
    let line = 1 << 28;
    for us in [2u32, 252, 502, 752] {
        // Overflow, sampled by TIM2's next clock, two clocks to count.
        let expected = (first + US * Cycle::from(us)).next_multiple_of(2) + 4;
        assert_eq!(scene.playback.next_event(), expected);
        scene.sleep(expected - 1);
        assert_eq!(scene.playback.interrupt_lines()[0] & line, 0);
        scene.sleep(expected);
        assert_eq!(scene.playback.interrupt_lines()[0] & line, line);
        scene.at += 100;
        scene.refill_at(us + 250);
        assert_eq!(scene.playback.interrupt_lines()[0] & line, 0);
    }
}

#[test]
fn a_sample_trigger_comes_at_its_microsecond() {
    let (mut scene, first) = playing(Pace::Lazy);
    scene.sleep(first + 75);
    scene.tim2(tim::CCMR2, 4 << 4);
    scene.tim2(tim::CCR1 + 8, 125);
    scene.tim2(tim::CCMR2, 1 << 4);
    scene.sleep(first + 200 * US);
    let expected = (first + 125 * US).next_multiple_of(2) + 4;
    assert_eq!(*scene.playback.triggers_mut(), [expected]);
}

/// TIM2's channel 1 is on three pins (DS8626 table 9).
#[test]
fn the_trigger_input_is_captured_in_device_time_on_each_of_its_pins() {
    for pin in [0, 5, 15] {
        let (mut scene, first) = playing(Pace::Lazy);
        let functions = [gpio::AFRL, gpio::AFRH][pin / 8];
        scene.write(Block::Gpio(0), functions, 1 << (4 * (pin % 8)));
        scene.write(Block::Gpio(0), gpio::PUPDR, 2 << (2 * pin));
        scene.write(Block::Gpio(0), gpio::MODER, 2 << (2 * pin));
        scene.sleep(first + 50 * US);
        let edge = first + 100 * US + 80;
        let Scene { playback, ram, .. } = &mut scene;
        let expected = Ok(Some(true));
        assert_eq!(playback.drive(0, pin, Level::High, edge, ram), expected);
        scene.sleep(edge + 200);
        assert_eq!(scene.read(Block::Timer(2), tim::SR) & 2, 2, "PA{pin}");
        assert_eq!(scene.read(Block::Timer(2), tim::CCR1), 100, "PA{pin}");
        assert_eq!(scene.read(Block::Timer(2), tim::SR) & 2, 0, "PA{pin}");
    }
}

#[test]
fn a_stopped_timer_freezes_pins_tape_and_time() {
    let (mut scene, first) = playing(Pace::Lazy);
    scene.sleep(first + 20 * US + 75);
    scene.tim1(tim::CR1, 4);
    let ndtr = scene.ndtr();
    let levels = scene.playback.gpio.levels(B);
    scene.edges.clear();
    scene.sleep(first + 5000 * US);
    assert!(scene.edges.is_empty());
    assert_eq!(scene.ndtr(), ndtr);
    assert_eq!(scene.playback.gpio.levels(B), levels);
    assert_eq!(scene.read(Block::Timer(2), tim::CNT), 20);
    // It continues where it stopped.
    let again = scene.start() - 2 - 7;
    scene.sleep(again + 300);
    assert_eq!(scene.read(Block::Timer(2), tim::CNT), 21 + 1);
}

/// `tape::stop`: EN of a stream reads 0 at once unless a transfer is in progress, and requests of
/// the stopped stream wait in TIM1.
#[test]
fn a_stopped_stream_plays_no_more_and_says_complete() {
    let (mut scene, first) = playing(Pace::Lazy);
    scene.sleep(first + 20 * US + 75);
    let cr = stream_offset(STREAMS[0], dma::CR);
    let on = scene.read(Block::Dma2, cr);
    scene.write(Block::Dma2, cr, on & !1);
    assert_eq!(scene.read(Block::Dma2, cr) & 1, 0);
    assert_eq!(scene.flags()[1] >> 6 & 0x20, 0x20);
    scene.edges.clear();
    scene.sleep(first + 100 * US);
    assert!(scene.edges.iter().all(|e| usize::from(e.port) != B));
    // Its request is still set: enabled again, the stream plays one item at once.
    scene.sleep(first + 100 * US + 75);
    let before = scene.playback.transfers;
    scene.write(Block::Dma2, cr, on);
    scene.sleep(first + 100 * US + 120);
    assert_eq!(scene.playback.transfers - before, 1);
}

/// While a transfer is in progress EN reads 1, and the transfer is completed.
#[test]
fn a_stream_that_is_switched_off_finishes_its_transfer() {
    let (mut scene, first) = playing(Pace::Lazy);
    let overflow = first + 20 * US;
    let cr = stream_offset(STREAMS[0], dma::CR);
    scene.sleep(overflow - 60);
    let on = scene.read(Block::Dma2, cr);
    // Complete at 2: granted at 0, on the bus at 2.
    scene.at = overflow + 1;
    scene.write(Block::Dma2, cr, on & !1);
    scene.sleep(overflow + 100);
    assert_eq!(edge_after(&scene, B, overflow), 4);
    assert_eq!(scene.read(Block::Dma2, cr) & 1, 0);
    assert_eq!(scene.ndtr()[0], LENGTH - 21);
}

/// A reset of TIM1 drops its requests (`Tape::start`).
#[test]
fn a_timer_reset_drops_its_requests() {
    let (mut scene, first) = playing(Pace::Lazy);
    scene.sleep(first + 20 * US + 75);
    let cr = stream_offset(STREAMS[0], dma::CR);
    let on = scene.read(Block::Dma2, cr);
    scene.write(Block::Dma2, cr, on & !1);
    scene.sleep(first + 22 * US);
    let Scene {
        playback, ram, at, ..
    } = &mut scene;
    playback.reset(Block::Timer(1), *at + 1, ram).unwrap();
    let before = scene.playback.transfers;
    scene.at += 10;
    scene.write(Block::Dma2, cr, on);
    scene.sleep(first + 30 * US);
    assert_eq!(scene.playback.transfers, before);
}

/// A lost or an additional request shows only in that stream's NDTR: the firmware's check calls
/// this a tape slip.
#[test]
fn a_slip_shows_in_one_ndtr() {
    let (mut scene, first) = playing(Pace::Lazy);
    scene.sleep(first + 20 * US + 75);
    // Port C's request is off for two microseconds.
    scene.tim1(tim::DIER, 0xD << 8);
    scene.sleep(first + 22 * US + 75);
    scene.tim1(tim::DIER, 0xF << 8);
    scene.sleep(first + 30 * US + 75);
    let played = LENGTH - 31;
    assert_eq!(scene.ndtr(), [played, played + 2, played, played]);
}

/// Possible action of the core.
#[derive(Clone, Copy, Debug)]
enum Act {
    Sleep,
    Pass(Slave, Bridge),
    Read(Block, u32),
    SlotB(u32),
    Pin(Level),
    Toggle(u32),
    Refill,
}

fn act() -> impl Strategy<Value = Act> {
    prop_oneof![
        Just(Act::Sleep),
        Just(Act::Pass(Slave::Sram2, Bridge::None)),
        Just(Act::Pass(Slave::Ahb1, Bridge::None)),
        Just(Act::Pass(Slave::Ahb1, Bridge::Apb1)),
        Just(Act::Pass(Slave::Ahb1, Bridge::Apb2)),
        Just(Act::Read(Block::Timer(1), tim::CNT)),
        Just(Act::Read(Block::Timer(2), tim::SR)),
        (0..4usize).prop_map(|s| Act::Read(Block::Dma2, stream_offset(STREAMS[s], dma::NDTR))),
        Just(Act::Read(Block::Gpio(B), gpio::ODR)),
        (0..LENGTH).prop_map(Act::SlotB),
        prop_oneof![Just(Level::High), Just(Level::Low), Just(Level::Open)].prop_map(Act::Pin),
        (0..4u32).prop_map(Act::Toggle),
        Just(Act::Refill),
    ]
}

/// Runs `acts`, each some cycles after the last, and returns all observations.
fn run(pace: Pace, acts: &[(u64, Act)], naps: &[u64]) -> (Vec<Edge>, Vec<u64>, Vec<u8>) {
    let (mut scene, _) = playing(pace);
    scene.write(Block::Gpio(0), gpio::AFRH, 1 << 28);
    scene.write(Block::Gpio(0), gpio::MODER, 2 << 30);
    let mut seen = Vec::new();
    for (n, &(gap, act)) in acts.iter().enumerate() {
        let to = scene.at + gap;
        if pace == Pace::PerRequest {
            scene.sleep(to - (to - scene.at).min(naps[n % naps.len()]));
        }
        // The core advances time only when an event is due.
        if scene.playback.next_event() <= to {
            scene.sleep(to);
        }
        scene.at = to;
        match act {
            Act::Sleep => (),
            Act::Pass(slave, bridge) => {
                let wait = scene
                    .playback
                    .access_slave(slave, bridge, to, &mut scene.ram)
                    .unwrap();
                scene.at += u64::from(wait) + 1;
                seen.push(wait.into());
            }
            Act::Read(block, offset) => {
                let value = scene.read(block, offset);
                seen.push(value.into());
            }
            Act::SlotB(slot) => {
                let wait =
                    scene
                        .playback
                        .access_slave(Slave::Sram2, Bridge::None, to, &mut scene.ram);
                scene.at += u64::from(wait.unwrap()) + 1;
                seen.push(scene.word(TAPE_B + 4 * slot).into());
                paint(&mut scene, slot, slot + 1);
            }
            Act::Pin(level) => {
                let change = scene
                    .playback
                    .drive(0, 15, level, to, &mut scene.ram)
                    .unwrap();
                seen.push(change.map_or(2, u64::from));
            }
            Act::Toggle(n) => {
                let cr = stream_offset(STREAMS[n as usize], dma::CR);
                let value = scene.read(Block::Dma2, cr) ^ 1;
                scene.write(Block::Dma2, cr, value);
            }
            Act::Refill => scene.refill_at(0),
        }
        seen.push(scene.at);
    }
    scene.sleep(scene.at + 1);
    seen.extend(scene.ndtr().map(u64::from));
    seen.extend(scene.flags().map(u64::from));
    scene.sleep(scene.at + 1000);
    (scene.edges, seen, scene.ram.bytes.to_vec())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    /// The results do not depend on how often time is advanced in between.
    #[test]
    fn lazy_and_per_request_are_identical(
        acts in prop::collection::vec((1u64..400, act()), 1..60),
        naps in prop::collection::vec(0u64..200, 1..20),
    ) {
        let lazy = run(Pace::Lazy, &acts, &naps);
        let each = run(Pace::PerRequest, &acts, &naps);
        prop_assert_eq!(&lazy.0, &each.0);
        prop_assert_eq!(&lazy.1, &each.1);
        prop_assert!(lazy.2 == each.2);
        prop_assert!(lazy.0.is_sorted_by_key(|edge| edge.cycle));
    }
}
