//! Tests each register: Arm ARM B3.2, B3.4; TRM chapter 4.

use super::super::System;
use super::{read, read_at, write, write_at};
use crate::chip::cpu::Size;
use crate::chip::cpu::bus::Unmodelled;
use crate::chip::cpu::system::{actlr, ccr};
use crate::chip::cpu::{Fault, Registers};

#[test]
fn reset_values() {
    let mut system = System::default();
    for (address, value) in [
        (0xE000_E004, 2),           // ICTR: 96 lines
        (0xE000_E008, 0),           // ACTLR
        (0xE000_ED00, 0x410F_C241), // CPUID r0p1
        (0xE000_ED04, 1 << 11),     // ICSR: RETTOBASE, no exception pending
        (0xE000_ED08, 0),           // VTOR
        (0xE000_ED0C, 0xFA05_0000), // AIRCR
        (0xE000_ED14, 0x200),       // CCR: STKALIGN
        (0xE000_ED88, 0),           // CPACR
        (0xE000_ED90, 0x800),       // MPU_TYPE: 8 regions
        (0xE000_EDF0, 0),           // DHCSR: no debugger
        (0xE000_EF34, 0xC000_0000), // FPCCR: ASPEN, LSPEN
        (0xE000_EF40, 0x1011_0021), // MVFR0
        (0xE000_EF44, 0x1100_0011), // MVFR1
        (0xE000_1000, 0x4000_0000), // DWT_CTRL: 4 comparators
    ] {
        assert_eq!(read(&mut system, address), value, "{address:#010x}");
    }
}

#[test]
fn interrupts_are_enabled_pended_and_cleared_by_ones() {
    let mut system = System::default();
    for (set, clear) in [(0xE000_E100, 0xE000_E180), (0xE000_E200, 0xE000_E280)] {
        write(&mut system, set + 4, 0b1010);
        write(&mut system, set + 4, 0b0001);
        assert_eq!(read(&mut system, set + 4), 0b1011);
        assert_eq!(read(&mut system, clear + 4), 0b1011);
        write(&mut system, clear + 4, 0b0011);
        assert_eq!(read(&mut system, set + 4), 0b1000);
        // Lines 82–95 do not exist, nor do the words after them.
        write(&mut system, set + 8, u32::MAX);
        assert_eq!(read(&mut system, set + 8), (1 << 18) - 1);
        write(&mut system, set + 12, u32::MAX);
        assert_eq!(read(&mut system, set + 12), 0);
    }
    system.nvic.activate(16 + 33);
    assert_eq!(read(&mut system, 0xE000_E304), 0b10);
}

#[test]
fn stir_pends_and_is_open_to_users_only_by_ccr() {
    let mut system = System::default();
    write(&mut system, 0xE000_EF00, 81);
    assert_eq!(read(&mut system, 0xE000_E208), 1 << 17);
    assert!(!system.may_write_unprivileged(0xE000_EF00));
    write(&mut system, 0xE000_ED14, 1 << 1);
    assert!(system.may_write_unprivileged(0xE000_EF00));
    assert!(!system.may_write_unprivileged(0xE000_ED14));
}

#[test]
fn system_priorities_by_word_and_byte() {
    let mut system = System::default();
    write(&mut system, 0xE000_ED18, 0xFFFF_FFFF);
    write(&mut system, 0xE000_ED1C, 0xFFFF_FFFF);
    write(&mut system, 0xE000_ED20, 0xFFFF_FFFF);
    assert_eq!(read(&mut system, 0xE000_ED18), 0x00F0_F0F0);
    assert_eq!(read(&mut system, 0xE000_ED1C), 0xF000_0000);
    // The priority of the debug monitor is not modelled and reads 0.
    assert_eq!(read(&mut system, 0xE000_ED20), 0xF0F0_0000);
    assert_eq!(system.write(0xE000_ED22, Size::Byte, 0x31, 0), Ok(()));
    assert_eq!(system.read(0xE000_ED22, Size::Half, 0), Ok(0xF030));
}

#[test]
fn icsr_pends_and_shows() {
    let mut system = System::default();
    write(&mut system, 0xE000_ED04, 1 << 28 | 1 << 26 | 1 << 31);
    let expected = 1 << 31 | 1 << 28 | 1 << 26 | 1 << 11 | 2 << 12;
    assert_eq!(read(&mut system, 0xE000_ED04), expected);
    write(&mut system, 0xE000_ED04, 1 << 27 | 1 << 25);
    system.nvic.activate(2);
    assert_eq!(
        read(&mut system, 0xE000_ED04),
        0,
        "NMI is active, not running"
    );
    system.update(&Registers {
        exception: 2,
        ..Registers::default()
    });
    assert_eq!(read(&mut system, 0xE000_ED04), 1 << 11 | 2);
    write(&mut system, 0xE000_E200, 1 << 3);
    assert_eq!(read(&mut system, 0xE000_ED04) >> 22 & 1, 1, "ISRPENDING");
}

#[test]
fn aircr_needs_its_key() {
    let mut system = System::default();
    write(&mut system, 0xE000_ED0C, 0x0000_0704);
    assert_eq!(read(&mut system, 0xE000_ED0C), 0xFA05_0000);
    assert_eq!(system.scb.reset_request, None);
    write_at(&mut system, 0xE000_ED0C, 0x05FA_0304, 77);
    assert_eq!(read(&mut system, 0xE000_ED0C), 0xFA05_0300);
    assert_eq!(system.scb.reset_request, Some(77));
    let expected = Err(Unmodelled("SCB_AIRCR.VECTRESET or VECTCLRACTIVE"));
    assert_eq!(
        system.write(0xE000_ED0C, Size::Word, 0x05FA_0001, 0),
        expected
    );
}

#[test]
fn shcsr_enables_and_shows_faults() {
    let mut system = System::default();
    write(&mut system, 0xE000_ED24, 7 << 16);
    assert_eq!(read(&mut system, 0xE000_ED24), 7 << 16);
    for (fault, pending) in [
        (Fault::Undefined, 1 << 12),
        (Fault::DataAccess(0), 1 << 13),
        (Fault::DataBus(0), 1 << 14),
    ] {
        let mut system = system.clone();
        assert_eq!(system.pend_fault(fault, 256, 0), Some(()));
        assert_eq!(read(&mut system, 0xE000_ED24), 7 << 16 | pending);
    }
    system.nvic.activate(11);
    assert_eq!(read(&mut system, 0xE000_ED24), 7 << 16 | 1 << 7);
    assert!(system.write(0xE000_ED24, Size::Word, 0, 0).is_err());
}

#[test]
fn each_fault_has_its_bit_and_address() {
    for (fault, cfsr) in [
        (Fault::InstructionAccess, 1),
        (Fault::DataAccess(0x1234), 1 << 1 | 1 << 7),
        (Fault::UnstackingAccess, 1 << 3),
        (Fault::StackingAccess, 1 << 4),
        (Fault::LazyStackingAccess, 1 << 5),
        (Fault::InstructionBus, 1 << 8),
        (Fault::DataBus(0x1234), 1 << 9 | 1 << 15),
        (Fault::UnstackingBus, 1 << 11),
        (Fault::StackingBus, 1 << 12),
        (Fault::LazyStackingBus, 1 << 13),
        (Fault::Undefined, 1 << 16),
        (Fault::InvalidState, 1 << 17),
        (Fault::InvalidPc, 1 << 18),
        (Fault::NoCoprocessor, 1 << 19),
        (Fault::Unaligned, 1 << 24),
        (Fault::DivideByZero, 1 << 25),
    ] {
        let mut system = System::default();
        assert_eq!(system.pend_fault(fault, 256, 0), Some(()));
        assert_eq!(read(&mut system, 0xE000_ED28), cfsr, "{fault:?}");
        assert_eq!(read(&mut system, 0xE000_ED2C), 1 << 30, "FORCED");
        assert_eq!(system.nvic.pending, 1 << 3);
        let mmfar = read(&mut system, 0xE000_ED34);
        let bfar = read(&mut system, 0xE000_ED38);
        assert_eq!(mmfar, if cfsr & 1 << 7 != 0 { 0x1234 } else { 0 });
        assert_eq!(bfar, if cfsr & 1 << 15 != 0 { 0x1234 } else { 0 });
        write(&mut system, 0xE000_ED28, cfsr);
        assert_eq!(read(&mut system, 0xE000_ED28), 0, "cleared by ones");
        assert_eq!(system.pend_fault(fault, -1, 0), None, "locks up");
    }
}

#[test]
fn cfsr_is_three_registers() {
    let mut system = System::default();
    system.pend_fault(Fault::DataBus(8), 256, 0);
    system.pend_fault(Fault::DataAccess(4), 256, 0);
    system.pend_fault(Fault::DivideByZero, 256, 0);
    assert_eq!(system.read(0xE000_ED28, Size::Byte, 0), Ok(0x82));
    assert_eq!(system.read(0xE000_ED29, Size::Byte, 0), Ok(0x82));
    assert_eq!(system.read(0xE000_ED2A, Size::Half, 0), Ok(0x200));
    assert_eq!(system.write(0xE000_ED2A, Size::Half, 0x200, 0), Ok(()));
    assert_eq!(system.read(0xE000_ED28, Size::Word, 0), Ok(0x8282));
}

#[test]
fn auxiliary_control_has_its_five_bits() {
    let mut system = System::default();
    write(&mut system, 0xE000_E008, u32::MAX);
    assert_eq!(read(&mut system, 0xE000_E008), 0b11_0000_0111);
    let bits = [
        (0, actlr::MULTI_CYCLE_INTERRUPTION),
        (1, actlr::WRITE_BUFFER),
        (2, actlr::FOLDING),
        (8, actlr::FPCA),
        (9, actlr::OUT_OF_ORDER_FP),
    ];
    for (bit, own) in bits {
        write(&mut system, 0xE000_E008, 1 << bit);
        for (_, other) in bits {
            assert_eq!(system.disables(other), other == own, "bit {bit}");
        }
    }
}

#[test]
fn traps_are_as_ccr_says() {
    let mut system = System::default();
    let traps = |system: &System| {
        [ccr::UNALIGNED_TRAP, ccr::DIVIDE_BY_ZERO_TRAP].map(|trap| system.is_configured(trap))
    };
    assert_eq!(traps(&system), [false, false]);
    write(&mut system, 0xE000_ED14, 1 << 3);
    assert_eq!(traps(&system), [true, false]);
    write(&mut system, 0xE000_ED14, 1 << 4);
    assert_eq!(traps(&system), [false, true]);
}

#[test]
fn the_cycle_counter_counts_while_traced_and_enabled() {
    let mut system = System::default();
    write_at(&mut system, 0xE000_1000, 1, 100);
    assert_eq!(read_at(&mut system, 0xE000_1004, 200), 0, "TRCENA is off");
    write_at(&mut system, 0xE000_EDFC, 1 << 24, 200);
    assert_eq!(read_at(&mut system, 0xE000_1004, 250), 50);
    write_at(&mut system, 0xE000_1004, 0xFFFF_FFFF, 300);
    assert_eq!(read_at(&mut system, 0xE000_1004, 302), 1, "it wraps");
    write_at(&mut system, 0xE000_1000, 0, 310);
    assert_eq!(read_at(&mut system, 0xE000_1004, 400), 9, "it stands");
    write_at(&mut system, 0xE000_1000, 1, 400);
    assert_eq!(read_at(&mut system, 0xE000_1004, 401), 10);
    assert_eq!(read_at(&mut system, 0xE000_1000, 401), 0x4000_0001);
}

#[test]
fn what_is_not_modelled_has_a_name() {
    let mut system = System::default();
    for (address, name) in [
        (0xE000_0000, "ITM"),
        (0xE000_1060, "DWT, except CTRL, CYCCNT and the comparators,"),
        (0xE000_2000, "FPB"),
        (0xE000_EDF4, "DCRSR"),
        (0xE00F_F000, "ROM table"),
    ] {
        assert_eq!(system.read(address, Size::Word, 0), Err(Unmodelled(name)));
        let written = system.write(address, Size::Word, 0, 0);
        assert_eq!(written, Err(Unmodelled(name)));
    }
    let half = system.read(0xE000_ED04, Size::Half, 0);
    let name = "an access to a private peripheral register that is narrower than a word";
    assert_eq!(half, Err(Unmodelled(name)));
}

/// Checks that an upset inverts bits in both directions, also those that a write can only set or
/// clear, or that a key protects.
#[test]
fn an_upset_turns_what_no_write_turns() {
    let mut system = System::default();
    for (address, bits) in [
        (0xE000_E100, 1 << 28),
        (0xE000_E108, 1),
        (0xE000_E200, 1 << 6),
        (0xE000_E41C, 0x40),
        (0xE000_ED08, 1 << 15),
        (0xE000_ED0C, 1 << 9),
        (0xE000_ED14, 1 << 3),
        (0xE000_ED20, 1 << 31),
        (0xE000_ED24, 1 << 17),
        (0xE000_ED94, 1 << 1),
        (0xE000_E014, 1 << 7),
    ] {
        let before = system.read(address, Size::Word, 0).unwrap();
        for turned in [before ^ bits, before] {
            system.upset(address, bits, 0).unwrap();
            let now = system.read(address, Size::Word, 0).unwrap();
            assert_eq!(now, turned, "{address:#x}");
        }
    }
    assert!(system.upset(0xE004_1000, 1, 0).is_err());
}
