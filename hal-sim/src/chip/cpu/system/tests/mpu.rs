//! Tests memory protection (Arm ARM B3.5).

use super::super::System;
use super::{read, write};
use crate::chip::cpu::Registers;

const CTRL: u32 = 0xE000_ED94;
const RNR: u32 = 0xE000_ED98;
const RBAR: u32 = 0xE000_ED9C;
const RASR: u32 = 0xE000_EDA0;

/// Sets up region `number` of 2^`log2` bytes at `base` with access permission `ap`.
fn region(system: &mut System, number: u32, base: u32, log2: u32, ap: u32) {
    write(system, RNR, number);
    write(system, RBAR, base);
    write(system, RASR, ap << 24 | (log2 - 1) << 1 | 1);
}

#[test]
fn the_image_s_stack_guard() {
    let mut system = System::default();
    let guard = 0x2000_1240;
    write(&mut system, RNR, 0);
    write(&mut system, RBAR, guard);
    write(&mut system, RASR, 1 << 28 | 4 << 1 | 1);
    assert!(system.may_access(guard, true, true), "not on yet");
    write(&mut system, CTRL, 0b101);
    for (address, allowed) in [
        (guard - 4, true),
        (guard - 1, true),
        (guard, false),
        (guard + 28, false),
        (guard + 31, false),
        (guard + 32, true),
        (0, true),
        (0xFFFF_FFFF, true),
    ] {
        for write in [false, true] {
            assert_eq!(
                system.may_access(address, write, true),
                allowed,
                "{address:#x}"
            );
            assert!(!system.may_access(address, write, false), "no default map");
        }
    }
    // HFNMIENA is 0: the handler of a hard fault may access the region.
    system.nvic.activate(3);
    system.update(&Registers::default());
    assert!(system.may_access(guard, true, true));
    system.nvic.deactivate(3);
    system.update(&Registers::default());
    assert!(!system.may_access(guard, true, true));
    write(&mut system, CTRL, 0b111);
    system.nvic.activate(3);
    system.update(&Registers::default());
    assert!(!system.may_access(guard, true, true));
}

#[test]
fn access_permissions() {
    // (AP; privileged read, write; unprivileged read, write): table B3-15.
    for (ap, expected) in [
        (0, [false, false, false, false]),
        (1, [true, true, false, false]),
        (2, [true, true, true, false]),
        (3, [true, true, true, true]),
        (5, [true, false, false, false]),
        (6, [true, false, true, false]),
        (7, [true, false, true, false]),
    ] {
        let mut system = System::default();
        region(&mut system, 0, 0x2000_0000, 10, ap);
        write(&mut system, CTRL, 1);
        let may = |write, privileged| system.may_access(0x2000_0200, write, privileged);
        let found = [
            may(false, true),
            may(true, true),
            may(false, false),
            may(true, false),
        ];
        assert_eq!(found, expected, "AP {ap}");
        assert_eq!(system.may_execute(0x2000_0200, true), expected[0]);
        assert_eq!(system.may_execute(0x2000_0200, false), expected[2]);
        assert!(!system.may_access(0x2000_0400, false, true), "no region");
        assert!(system.may_access(0xE000_ED94, true, true), "private bus");
    }
}

#[test]
fn the_higher_region_goes_first_and_sub_regions_let_through() {
    let mut system = System::default();
    region(&mut system, 1, 0x2000_0000, 12, 3);
    region(&mut system, 5, 0x2000_0000, 11, 0);
    // The sub-regions of region 5 have 256 bytes; 0 and 7 are disabled.
    write(&mut system, RASR, 0x8100 | 10 << 1 | 1);
    write(&mut system, CTRL, 1);
    for (address, allowed) in [
        (0x2000_0000, true),
        (0x2000_00FF, true),
        (0x2000_0100, false),
        (0x2000_06FF, false),
        (0x2000_0700, true),
        (0x2000_0FFF, true),
        (0x2000_1000, false),
    ] {
        assert_eq!(
            system.may_access(address, true, false),
            allowed,
            "{address:#x}"
        );
    }
}

#[test]
fn execution() {
    let mut system = System::default();
    for (address, allowed) in [
        (0x0800_0000, true),
        (0x2000_0000, true),
        (0x4000_0000, false),
        (0x6000_0000, true),
        (0x8000_0000, true),
        (0xA000_0000, false),
        (0xE000_0000, false),
    ] {
        assert_eq!(system.may_execute(address, true), allowed, "{address:#x}");
    }
    region(&mut system, 0, 0x2000_0000, 17, 3);
    write(&mut system, RASR, 1 << 28 | 3 << 24 | 16 << 1 | 1);
    write(&mut system, CTRL, 0b101);
    assert!(!system.may_execute(0x2000_0000, true));
    assert!(system.may_execute(0x0800_0000, true));
    assert!(!system.may_execute(0x0800_0000, false));
}

#[test]
fn registers_by_number_and_by_alias() {
    let mut system = System::default();
    write(&mut system, RBAR, 0x2000_0000 | 1 << 4 | 3);
    assert_eq!(read(&mut system, RNR), 3);
    assert_eq!(read(&mut system, RBAR), 0x2000_0003);
    write(&mut system, 0xE000_EDA4, 0x1000_0000 | 1 << 4 | 6);
    write(&mut system, 0xE000_EDA8, 0x0300_0009);
    assert_eq!(read(&mut system, RNR), 6);
    assert_eq!(read(&mut system, RASR), 0x0300_0009);
    write(&mut system, RNR, 3);
    assert_eq!(read(&mut system, RASR), 0);
}

/// Checks that the cached answer equals that of the look-up, for every kind of layout.
#[test]
fn the_quick_answer_never_differs_from_looking_up() {
    for control in [0b001, 0b101] {
        let mut system = System::default();
        region(&mut system, 0, 0x2000_0100, 8, 0);
        region(&mut system, 2, 0x2000_0300, 5, 6);
        write(&mut system, CTRL, control);
        for address in (0x2000_0000..0x2000_0600).step_by(4) {
            let denied = (0x2000_0100..0x2000_0200).contains(&address);
            let read_only = (0x2000_0300..0x2000_0320).contains(&address);
            let by_map = control & 4 != 0 && !denied && !read_only;
            assert_eq!(system.may_access(address, true, true), by_map);
            assert_eq!(system.may_access(address, false, true), by_map || read_only);
        }
    }
}
