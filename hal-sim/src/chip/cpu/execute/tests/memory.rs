//! Tests loads and stores: alignment, faults, exclusives, unprivileged access. `qemu_instructions`
//! tests values and addresses of the others.

use super::{Machine, RAM};
use crate::chip::cpu::Size;

const WORDS: &[u32] = &[0x8182_8384, 0x0102_0304, 0xF1F2_F3F4, 0x1112_1314];

#[test]
fn accesses_without_privilege_move_no_base() {
    let outcome = |code| {
        let mut machine = Machine::new(code).with(&[(0, 0xA1A2_A3A4), (1, RAM + 4)]);
        machine.poke(RAM, WORDS);
        machine.steps(1);
        [machine.r(0), machine.word(RAM + 4), machine.r(1)]
    };
    let (ldrt, ldrsht, strt) = ([0xF851, 0x0E08], [0xF931, 0x0E04], [0xF841, 0x0E00]);
    assert_eq!(outcome(&ldrt), [0x1112_1314, WORDS[1], RAM + 4], "[r1,#8]");
    assert_eq!(
        outcome(&ldrsht),
        [0xFFFF_F3F4, WORDS[1], RAM + 4],
        "[r1,#4]"
    );
    assert_eq!(outcome(&strt), [0xA1A2_A3A4, 0xA1A2_A3A4, RAM + 4], "[r1]");
}

#[test]
fn sp_keeps_its_lowest_bits_clear() {
    let mut machine = Machine::new(&[0xF8D1, 0xD000] /* ldr.w sp,[r1] */).with(&[(1, RAM)]);
    machine.poke(RAM, &[RAM + 0x107]);
    machine.steps(1);
    assert_eq!(machine.r(13), RAM + 0x104);
}

fn cfsr(machine: &mut Machine) -> u32 {
    let system = &mut machine.cpu.system;
    system.read(0xE000_ED28, Size::Word, 0).unwrap()
}

#[test]
fn what_must_be_aligned_faults_and_changes_nothing() {
    for code in [
        &[0xC90C][..],     /* ldm r1!,{r2,r3} */
        &[0xC10C],         /* stm r1!,{r2,r3} */
        &[0xE8F1, 0x2302], /* ldrd r2,r3,[r1],#8 */
        &[0xE9E1, 0x2302], /* strd r2,r3,[r1,#8]! */
        &[0xE851, 0x2F00], /* ldrex r2,[r1] */
        &[0xE841, 0x2300], /* strex r3,r2,[r1] */
        &[0xE8D1, 0x2F5F], /* ldrexh r2,[r1] */
    ] {
        let mut machine = Machine::new(code).with(&[(1, RAM + 1), (2, 22), (3, 33)]);
        machine.steps(1);
        assert_eq!(machine.cpu.registers.exception, 3, "{code:04X?}");
        assert_eq!([1, 2, 3].map(|n| machine.r(n)), [RAM + 1, 22, 33]);
        assert_eq!(cfsr(&mut machine), 1 << 24);
        let stacked = machine.word(machine.r(13) + 0x18);
        assert_eq!(stacked, super::CODE);
    }
}

#[test]
fn ccr_can_forbid_all_unaligned_accesses() {
    let mut machine = Machine::new(&[0x6808] /* ldr r0,[r1] */).with(&[(1, RAM + 2)]);
    let written = machine.cpu.system.write(0xE000_ED14, Size::Word, 0x208, 0);
    assert_eq!(written, Ok(()));
    machine.steps(1);
    assert_eq!(machine.cpu.registers.exception, 3);
    assert_eq!(cfsr(&mut machine), 1 << 24);
}

#[test]
fn a_bus_error_leaves_the_base_alone() {
    let mut machine =
        Machine::new(&[0xF851, 0x0B04] /* ldr r0,[r1],#4 */).with(&[(0, 7), (1, 0x6000_0000)]);
    machine.steps(1);
    assert_eq!((machine.r(0), machine.r(1)), (7, 0x6000_0000));
    assert_eq!(machine.cpu.registers.exception, 3);
    assert_eq!(cfsr(&mut machine), 0x8200); // BFARVALID, PRECISERR
}

#[test]
fn exclusive_stores_need_the_monitor() {
    let code = &[0xE851, 0x0F01, 0xE841, 0x3201, 0xE841, 0x3400, 0xE8D1, 0x0F4F, 0xF3BF, 0x8F2F, 0xE8C1, 0x3F45] /* ldrex r0,[r1,#4]; strex r2,r3,[r1,#4]; strex r4,r3,[r1]; ldrexb r0,[r1]; clrex; strexb r5,r3,[r1] */;
    let mut machine = Machine::new(code).with(&[(1, RAM), (3, 33)]);
    machine.poke(RAM, WORDS);
    machine.steps(6);
    assert_eq!([0, 2, 4, 5].map(|n| machine.r(n)), [0x84, 0, 1, 1]);
    assert_eq!([machine.word(RAM), machine.word(RAM + 4)], [WORDS[0], 33]);
}
