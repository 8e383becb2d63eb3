//! Loads and stores: values, addresses, alignment, exclusives.

use super::{Machine, RAM, run};

const WORDS: &[u32] = &[0x8182_8384, 0x0102_0304, 0xF1F2_F3F4, 0x1112_1314];

/// Runs one instruction with R1 = RAM + 4, R2 = 2 and [`WORDS`] in RAM.
fn one(code: &[u16]) -> Machine {
    let mut machine = Machine::new(code).with(&[(0, 0xA1A2_A3A4), (1, RAM + 4), (2, 2)]);
    machine.poke(RAM, WORDS);
    machine.steps(1);
    machine
}

#[test]
fn single_loads_extend_and_move_the_base() {
    for (code, r0, base) in [
        (&[0x6848][..] /* ldr r0,[r1,#4] */, 0xF1F2_F3F4, 4),
        (&[0x5C88] /* ldrb r0,[r1,r2] */, 0x02, 4),
        (&[0x5A88] /* ldrh r0,[r1,r2] */, 0x0102, 4),
        (
            &[0xF931, 0x0C02], /* ldrsh r0,[r1,#-2] */
            0xFFFF_8182,
            4,
        ),
        (&[0x5E88] /* ldrsh r0,[r1,r2] */, 0x0102, 4),
        (
            &[0xF911, 0x0C01], /* ldrsb r0,[r1,#-1] */
            0xFFFF_FF81,
            4,
        ),
        (
            &[0xF991, 0x0005], /* ldrsb.w r0,[r1,#5] */
            0xFFFF_FFF3,
            4,
        ),
        (&[0xF811, 0x0C04] /* ldrb r0,[r1,#-4] */, 0x84, 4),
        (
            &[0xF851, 0x0022], /* ldr.w r0,[r1,r2,lsl #2] */
            0x1112_1314,
            4,
        ),
        (&[0xF851, 0x0904] /* ldr r0,[r1],#-4 */, 0x0102_0304, 0),
        (
            &[0xF851, 0x0F08], /* ldr r0,[r1,#8]! */
            0x1112_1314,
            12,
        ),
        (&[0xF831, 0x0F02] /* ldrh r0,[r1,#2]! */, 0x0102, 6),
        (
            &[0xF911, 0x0D01], /* ldrsb r0,[r1,#-1]! */
            0xFFFF_FF81,
            3,
        ),
        (
            &[0xF931, 0x0E04], /* ldrsht r0,[r1,#4] */
            0xFFFF_F3F4,
            4,
        ),
        (&[0xF851, 0x0E08] /* ldrt r0,[r1,#8] */, 0x1112_1314, 4),
    ] {
        let machine = one(code);
        let expected = (r0, RAM + base);
        assert_eq!((machine.r(0), machine.r(1)), expected, "{code:04X?}");
    }
}

#[test]
fn single_stores_write_their_bytes_only() {
    for (code, word, base) in [
        (&[0x6008][..] /* str r0,[r1] */, 0xA1A2_A3A4, 4),
        (&[0xF801, 0x0B01] /* strb r0,[r1],#1 */, 0x0102_03A4, 5),
        (&[0x5288] /* strh r0,[r1,r2] */, 0xA3A4_0304, 4),
        (
            &[0xF821, 0x0902], /* strh r0,[r1],#-2 */
            0x0102_A3A4,
            2,
        ),
        (
            &[0xF881, 0x0003], /* strb.w r0,[r1,#3] */
            0xA402_0304,
            4,
        ),
        (&[0xF841, 0x0E00] /* strt r0,[r1,#0] */, 0xA1A2_A3A4, 4),
        (
            &[0xF801, 0x0012], /* strb.w r0,[r1,r2,lsl #1] */
            0x0102_0304,
            4,
        ),
    ] {
        let machine = one(code);
        let expected = (word, RAM + base);
        assert_eq!(
            (machine.word(RAM + 4), machine.r(1)),
            expected,
            "{code:04X?}"
        );
    }
    let machine = one(&[0xF841, 0x0D04] /* str r0,[r1,#-4]! */);
    assert_eq!((machine.word(RAM), machine.r(1)), (0xA1A2_A3A4, RAM));
}

#[test]
fn literals_lie_behind_the_aligned_pc() {
    // The second LDR begins at a half-word, its PC is that of the first plus 4.
    let code = &[0x4801, 0x4901, 0xBF00, 0xBF00, 0x5678, 0x1234, 0xDEF0, 0x9ABC] /* ldr r0,[pc,#4]; ldr r1,[pc,#4]; nop; nop; .word 0x12345678; .word 0x9ABCDEF0 */;
    let machine = run(code, 2, &[]);
    assert_eq!(machine.r(0), 0x1234_5678);
    assert_eq!(machine.r(1), 0x1234_5678);
    // PC of the second is 4 ahead and aligned: minus 4 is the first again.
    let code = &[0xBF00, 0xF85F, 0x0004] /* nop; ldr.w r0,[pc,#-4] */;
    assert_eq!(run(code, 2, &[]).r(0), 0xF85F_BF00);
}

#[test]
fn doubles_take_two_words() {
    let machine = one(&[0xE951, 0x2301] /* ldrd r2,r3,[r1,#-4] */);
    assert_eq!((machine.r(2), machine.r(3)), (WORDS[0], WORDS[1]));
    let machine = one(&[0xE9F1, 0x2301] /* ldrd r2,r3,[r1,#4]! */);
    assert_eq!((machine.r(2), machine.r(3)), (WORDS[2], WORDS[3]));
    assert_eq!(machine.r(1), RAM + 8);
    let machine = one(&[0xE861, 0x2002] /* strd r2,r0,[r1],#-8 */);
    let expected = (2, 0xA1A2_A3A4);
    assert_eq!((machine.word(RAM + 4), machine.word(RAM + 8)), expected);
    assert_eq!(machine.r(1), RAM - 4);
}

#[test]
fn multiples_go_up_from_the_lowest_address() {
    let machine = one(&[0xC92C] /* ldm r1!,{r2,r3,r5} */);
    let expected = [WORDS[1], WORDS[2], WORDS[3]];
    assert_eq!([2, 3, 5].map(|n| machine.r(n)), expected);
    assert_eq!(machine.r(1), RAM + 16);
    let machine = one(&[0xC906] /* ldm r1,{r1,r2} */);
    assert_eq!([1, 2].map(|n| machine.r(n)), [WORDS[1], WORDS[2]]);
    let machine = one(&[0xC106] /* stm r1!,{r1,r2} */);
    assert_eq!([1, 2].map(|n| machine.word(RAM + 4 * n)), [RAM + 4, 2]);
    assert_eq!(machine.r(1), RAM + 12);
    let mut machine =
        Machine::new(&[0xE931, 0x0104] /* ldmdb r1!,{r2,r8} */).with(&[(1, RAM + 12)]);
    machine.poke(RAM, WORDS);
    machine.steps(1);
    let expected = [WORDS[1], WORDS[2], RAM + 4];
    assert_eq!([2, 8, 1].map(|n| machine.r(n)), expected);
    let mut machine = Machine::new(&[0xE901, 0x4104] /* stmdb r1,{r2,r8,lr} */);
    machine = machine.with(&[(1, RAM + 12), (2, 22), (8, 88), (14, 14)]);
    machine.steps(1);
    assert_eq!([0, 1, 2].map(|n| machine.word(RAM + 4 * n)), [22, 88, 14]);
    assert_eq!(machine.r(1), RAM + 12);
}

#[test]
fn push_and_pop_mirror_each_other() {
    let code = &[0xB511, 0xBC0E] /* push {r0,r4,lr}; pop {r1,r2,r3} */;
    let mut machine = Machine::new(code).with(&[(0, 10), (4, 14), (14, 99)]);
    let sp = machine.r(13);
    machine.steps(1);
    assert_eq!(machine.r(13), sp - 12);
    assert_eq!([12, 8, 4].map(|down| machine.word(sp - down)), [10, 14, 99]);
    machine.steps(1);
    assert_eq!([1, 2, 3, 13].map(|n| machine.r(n)), [10, 14, 99, sp]);
}

#[test]
fn sp_keeps_its_lowest_bits_clear() {
    let mut machine = Machine::new(&[0xF8D1, 0xD000] /* ldr.w sp,[r1] */).with(&[(1, RAM)]);
    machine.poke(RAM, &[RAM + 0x107]);
    machine.steps(1);
    assert_eq!(machine.r(13), RAM + 0x104);
}

#[test]
fn words_and_half_words_may_be_unaligned() {
    let load = &[0x6808] /* ldr r0,[r1] */;
    for (offset, value) in [(1, 0x0481_8283), (2, 0x0304_8182), (3, 0x0203_0481)] {
        let mut machine = Machine::new(load).with(&[(1, RAM + offset)]);
        machine.poke(RAM, WORDS);
        machine.steps(1);
        assert_eq!(machine.r(0), value);
    }
    let mut machine = Machine::new(&[0xF9B1, 0x0003] /* ldrsh.w r0,[r1,#3] */).with(&[(1, RAM)]);
    machine.poke(RAM, WORDS);
    machine.steps(1);
    assert_eq!(machine.r(0), 0x0481);
    for (offset, words) in [
        (1, [0xA2A3_A484, 0x0102_03A1]),
        (2, [0xA3A4_8384, 0x0102_A1A2]),
        (3, [0xA482_8384, 0x01A1_A2A3]),
    ] {
        let code = &[0x6008] /* str r0,[r1] */;
        let mut machine = Machine::new(code).with(&[(0, 0xA1A2_A3A4), (1, RAM + offset)]);
        machine.poke(RAM, WORDS);
        machine.steps(1);
        assert_eq!([machine.word(RAM), machine.word(RAM + 4)], words);
    }
}

/// CFSR.
fn cfsr(machine: &mut Machine) -> u32 {
    let read = machine
        .cpu
        .system
        .read(0xE000_ED28, crate::chip::cpu::Size::Word, 0);
    read.expect("CFSR is modelled")
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
    let size = crate::chip::cpu::Size::Word;
    assert!(
        machine
            .cpu
            .system
            .write(0xE000_ED14, size, 0x208, 0)
            .is_ok()
    );
    machine.steps(1);
    let expected = (3, 1 << 24);
    assert_eq!(
        (machine.cpu.registers.exception, cfsr(&mut machine)),
        expected
    );
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
