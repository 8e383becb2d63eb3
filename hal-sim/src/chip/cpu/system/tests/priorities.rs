//! Tests pre-emption (Arm ARM B1.5.4).

use super::super::nvic::{NO_PRIORITY, bit, number};
use super::super::{System, nvic::Nvic};
use super::write;
use crate::chip::cpu::Registers;
use crate::chip::cpu::Size;

/// Exceptions to test: fixed priorities, system exceptions, lines.
const NUMBERS: [u16; 8] = [
    number::NMI,
    number::HARD_FAULT,
    number::USAGE_FAULT,
    number::SV_CALL,
    number::PEND_SV,
    number::SYS_TICK,
    16,
    16 + 81,
];

/// Priority fields to test, in the upper four bits.
const PRIORITIES: [u8; 5] = [0x00, 0x10, 0x70, 0x80, 0xF0];

/// Returns the level that decides about pre-emption, by the manual's text: the bits of the priority
/// above the binary point of PRIGROUP.
fn level(exception: u16, priority: u8, prigroup: u32) -> i32 {
    match exception {
        2 => -2,
        3 => -1,
        _ => i32::from(priority) >> (prigroup + 1) << (prigroup + 1),
    }
}

#[test]
fn every_pair_of_active_and_pending_preempts_as_the_levels_say() {
    let mut cases = 0;
    for prigroup in 0..8 {
        for active in NUMBERS {
            for pending in NUMBERS.into_iter().filter(|&other| other != active) {
                for (a, p) in pairs() {
                    for masks in masks() {
                        check(prigroup, (active, a), (pending, p), masks);
                        cases += 1;
                    }
                }
            }
        }
    }
    assert_eq!(cases, 8 * 8 * 7 * 25 * 12);
}

fn pairs() -> impl Iterator<Item = (u8, u8)> {
    PRIORITIES
        .into_iter()
        .flat_map(|a| PRIORITIES.map(|p| (a, p)))
}

/// Returns combinations of PRIMASK, FAULTMASK and BASEPRI.
fn masks() -> impl Iterator<Item = (bool, bool, u8)> {
    [(false, false), (true, false), (false, true), (true, true)]
        .into_iter()
        .flat_map(|(primask, faultmask)| [0, 0x10, 0x80].map(|base| (primask, faultmask, base)))
}

fn check(
    prigroup: u32,
    (active, a): (u16, u8),
    (pending, p): (u16, u8),
    (primask, faultmask, basepri): (bool, bool, u8),
) {
    let mut nvic = Nvic::default();
    nvic.set_prigroup(prigroup);
    nvic.enable(bit(active) | bit(pending), true, 0);
    nvic.set_priority(active, a);
    nvic.set_priority(pending, p);
    nvic.activate(active);
    nvic.pend(bit(pending), 0);
    let registers = Registers {
        primask,
        faultmask,
        basepri,
        ..Registers::default()
    };
    let mut running = level(active, a, prigroup);
    if basepri != 0 {
        running = running.min(level(16, basepri, prigroup));
    }
    if primask {
        running = running.min(0);
    }
    if faultmask {
        running = running.min(-1);
    }
    let expected = level(pending, p, prigroup) < running;
    let priority = nvic.execution_priority(&registers);
    assert_eq!(i32::from(priority), running);
    assert_eq!(
        nvic.preempting(priority),
        expected.then_some(pending),
        "PRIGROUP {prigroup}, {pending} at {p:#x} over {active} at {a:#x}, \
         PRIMASK {primask}, FAULTMASK {faultmask}, BASEPRI {basepri:#x}"
    );
}

#[test]
fn of_two_pending_the_group_goes_before_the_sub_priority_before_the_number() {
    // PRIGROUP 5: two bits of group, two implemented bits of sub-priority.
    for (first, second, expected) in [
        (0x40, 0x80, 20), // decided by the group
        (0x80, 0x40, 21),
        (0x50, 0x60, 20), // decided by the sub-priority in the same group
        (0x60, 0x50, 21),
        (0x50, 0x50, 20), // decided by the number
    ] {
        let mut nvic = Nvic::default();
        nvic.set_prigroup(5);
        nvic.enable(bit(20) | bit(21), true, 0);
        nvic.set_priority(20, first);
        nvic.set_priority(21, second);
        nvic.pend(bit(20) | bit(21), 0);
        assert_eq!(nvic.preempting(NO_PRIORITY), Some(expected));
        // Sub-priorities do not pre-empt within their group.
        nvic.activate(expected);
        let priority = nvic.execution_priority(&Registers::default());
        assert_eq!(nvic.preempting(priority), None);
    }
}

#[test]
fn nothing_disabled_preempts_and_the_lower_four_bits_read_zero() {
    let mut system = System::default();
    write(&mut system, 0xE000_E200, 1 << 5);
    assert_eq!(system.nvic.preempting(NO_PRIORITY), None);
    write(&mut system, 0xE000_E100, 1 << 5);
    assert_eq!(system.nvic.preempting(NO_PRIORITY), Some(21));
    assert_eq!(system.write(0xE000_E405, Size::Byte, 0xAB, 0), Ok(()));
    assert_eq!(system.read(0xE000_E404, Size::Word, 0), Ok(0xA000));
}

#[test]
fn a_line_pends_when_it_rises_and_while_it_is_high_and_not_active() {
    let mut nvic = Nvic::default();
    let line = bit(16 + 40);
    let [low, high] = [[0; 3], [0, 1 << 8, 0]];
    assert_eq!(nvic.sample(high, false, 7), line);
    assert_eq!(nvic.raised_at(56), 7);
    assert_eq!(nvic.sample(high, false, 8), 0, "pending already");
    nvic.activate(56);
    assert_eq!(nvic.sample(high, false, 9), 0, "active, no edge");
    nvic.sample(low, false, 10);
    assert_eq!(
        nvic.sample(high, false, 11),
        line,
        "a new edge while active"
    );
    nvic.activate(56);
    nvic.deactivate(56);
    assert_eq!(
        nvic.sample(high, false, 12),
        line,
        "still high after return"
    );
    nvic.unpend(line);
    assert_eq!(nvic.sample(high, false, 13), line, "cleared while high");
    nvic.unpend(line);
    assert_eq!(nvic.sample(low, false, 14), 0);
    assert_eq!(nvic.pending, 0);
}

#[test]
fn lines_that_the_chip_does_not_have_never_pend() {
    let mut nvic = Nvic::default();
    nvic.sample([u32::MAX; 3], false, 0);
    assert_eq!(nvic.pending.count_ones(), 82);
    assert_eq!(Nvic::word(nvic.pending, 2), (1 << 18) - 1);
}

#[test]
fn nmi_pends_on_its_edge_only() {
    let mut nvic = Nvic::default();
    assert_eq!(nvic.sample([0; 3], true, 0), bit(number::NMI));
    nvic.activate(number::NMI);
    nvic.deactivate(number::NMI);
    assert_eq!(nvic.sample([0; 3], true, 1), 0);
}
