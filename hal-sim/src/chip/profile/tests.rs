//! Checks the sums of events as a core would report them.

use super::*;
use crate::chip::image::tests::{CODE, program};

fn profile() -> Profile {
    let nops = [0xBF00; 16];
    let functions = [("first", CODE, 8), ("second", CODE + 8, 8)];
    Profile::new(&program(&nops, &functions))
}

fn context(number: u16, depth: u32, entered: bool) -> Context {
    Context {
        number,
        depth,
        entered,
    }
}

fn cost(cycles: Cycle, instructions: u64) -> Cost {
    Cost {
        cycles,
        instructions,
    }
}

#[test]
fn every_cycle_is_counted_once() {
    let mut seen = profile();
    seen.instruction(CODE, 2, 2, 0x2000_4000);
    seen.instruction(CODE + 8, 1, 3, 0x2000_3FF0);
    // TIM7 is entered, and TIM2 pre-empts it.
    seen.context(context(exception::TIM7, 1, true), 15);
    seen.instruction(CODE, 10, 25, 0x2000_3FC0);
    seen.context(context(exception::TIM2, 2, true), 37);
    seen.instruction(CODE + 8, 3, 40, 0x2000_3FE0);
    seen.context(context(exception::TIM7, 1, false), 52);
    seen.instruction(CODE, 1, 53, 0x2000_3FE0);
    seen.context(context(0, 0, false), 60);
    seen.asleep(60, 90);
    seen.instruction(0x2000_0000, 4, 100, 0x2000_4000);

    let expected = (100, 30, 0x2000_3FC0);
    assert_eq!((seen.total(), seen.idle, seen.lowest_sp), expected);
    // Entry and return count for the context that they lead to; six cycles passed before the last
    // instruction.
    assert_eq!(seen.owner(Owner::Pulser), cost(12 + 3, 1));
    assert_eq!(seen.owner(Owner::Controller), cost(12 + 10 + 12 + 1, 2));
    assert_eq!(seen.owner(Owner::Session), cost(3 + 7 + 10, 3));
    assert_eq!(seen.owner(Owner::Other), cost(0, 0));
    let functions = seen.functions();
    let sum: Cycle = functions.iter().map(|(_, cost)| cost.cycles).sum();
    assert_eq!(sum + seen.idle, seen.total());
    assert!(functions.contains(&("first", cost(13, 3))));
    assert!(functions.contains(&("second", cost(4, 2))));
    assert!(functions.contains(&("(no symbol)", cost(4, 1))));

    seen.restart();
    assert_eq!((seen.total(), seen.idle), (0, 0));
    assert!(seen.functions().is_empty());
}

#[test]
fn runs_are_told_apart_however_they_follow_one_another() {
    let mut seen = profile();
    let mut at = 0;
    let mut go = |number, depth, entered, cycles| {
        at += 10;
        seen.context(context(number, depth, entered), at);
        at += cycles;
        seen.instruction(CODE, cycles, at, 0);
    };
    // USB and TIM5, of one priority, tail-chain: three separate runs, none nested.
    go(exception::OTG_FS, 1, true, 5);
    go(exception::TIM5, 1, true, 6);
    go(exception::OTG_FS, 1, true, 7);
    // The same without a gap, and with pre-emption in the middle.
    go(exception::OTG_FS, 1, true, 8);
    go(exception::TIM2, 2, true, 100);
    go(exception::OTG_FS, 1, false, 9);
    go(0, 0, false, 1);
    let runs: Vec<_> = seen
        .runs()
        .map(|(n, runs)| (n, runs.count, runs.longest))
        .collect();
    let expected = [
        (exception::TIM2, 1, 110),
        (exception::TIM5, 1, 16),
        (exception::OTG_FS, 3, 10 + 8 + 10 + 9),
    ];
    assert_eq!(runs, expected);
}
