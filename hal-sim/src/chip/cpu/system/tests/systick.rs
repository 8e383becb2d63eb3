//! Tests SysTick against a counter that is stepped clock by clock (Arm ARM B3.3.1).

use super::super::System;
use super::super::nvic::{bit, number};
use super::{read_at, write_at};
use crate::chip::Cycle;

const CSR: u32 = 0xE000_E010;
const RVR: u32 = 0xE000_E014;
const CVR: u32 = 0xE000_E018;

/// The counter as the manual describes it, one clock at a time.
struct Stepped {
    reload: u32,
    counter: u32,
    /// Cycles at which the counter went from 1 to 0.
    zeros: Vec<Cycle>,
}

impl Stepped {
    fn clock(&mut self, at: Cycle) {
        if self.counter == 0 {
            self.counter = self.reload;
        } else {
            self.counter -= 1;
            if self.counter == 0 {
                self.zeros.push(at);
            }
        }
    }
}

#[test]
fn it_agrees_with_a_stepped_counter_at_every_cycle() {
    for (divider, source) in [(1, 4), (8, 0)] {
        for reload in [0, 1, 2, 5, 9] {
            for stride in [1, 2, 3, 7, 50] {
                compare(divider, source, reload, stride);
            }
        }
    }
}

fn compare(divider: Cycle, source: u32, reload: u32, stride: usize) {
    let mut system = System::default();
    let mut stepped = Stepped {
        reload,
        counter: 0,
        zeros: vec![],
    };
    let start = 13;
    write_at(&mut system, RVR, reload, start);
    write_at(&mut system, CVR, 55, start);
    write_at(&mut system, CSR, source | 0b11, start);
    let mut next = system.next_event();
    let mut found: Vec<Cycle> = vec![];
    for at in start + 1..start + 400 {
        if at % divider == 0 {
            stepped.clock(at);
        }
        if !(at as usize).is_multiple_of(stride) && at != next {
            continue;
        }
        assert_eq!(read_at(&mut system, CVR, at), stepped.counter, "at {at}");
        if system.nvic.pending & bit(number::SYS_TICK) != 0 {
            found.push(system.nvic.raised_at(number::SYS_TICK));
            system.nvic.unpend(bit(number::SYS_TICK));
        }
        next = system.next_event();
        assert!(next > at);
    }
    assert_eq!(
        found,
        stepped
            .zeros
            .into_iter()
            .filter(|&zero| zero <= found.last().copied().unwrap_or(Cycle::MAX))
            .collect::<Vec<_>>()
    );
    assert_eq!(found.is_empty(), reload == 0);
}

#[test]
fn a_long_jump_keeps_the_phase() {
    let mut system = System::default();
    write_at(&mut system, RVR, 999, 0);
    write_at(&mut system, CSR, 0b101, 0);
    assert_eq!(system.next_event(), Cycle::MAX, "no exception is enabled");
    // Zero at 1000, 2000, …: 1 000 000 000 000 + 250 is 250 clocks later.
    assert_eq!(read_at(&mut system, CVR, 1_000_000_000_250), 750);
    assert_eq!(read_at(&mut system, CSR, 1_000_000_000_250), 0x1_0005);
    assert_eq!(read_at(&mut system, CSR, 1_000_000_000_250), 5, "read once");
}

#[test]
fn writing_the_counter_clears_it_and_its_flag_without_an_exception() {
    let mut system = System::default();
    write_at(&mut system, RVR, 9, 0);
    write_at(&mut system, CSR, 0b111, 0);
    assert_eq!(read_at(&mut system, CVR, 10), 0);
    system.nvic.unpend(bit(number::SYS_TICK));
    write_at(&mut system, CVR, 1234, 15);
    assert_eq!(read_at(&mut system, CVR, 15), 0);
    assert_eq!(read_at(&mut system, CSR, 15), 0b111);
    assert_eq!(system.nvic.pending, 0);
    assert_eq!(system.next_event(), 25);
}
