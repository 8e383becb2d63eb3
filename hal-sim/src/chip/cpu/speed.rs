//! How fast the core runs on this machine; prints, judges nothing.

use super::Cpu;
use super::flat::Flat;
use std::time::Instant;

/// Loads, stores, arithmetic, an IT block, branches, a call, floating point.
#[rustfmt::skip]
const MIXED: &[u16] = &[
    0xF240, 0x0000, // movw r0, #0
    0xF2C2, 0x0000, // movt r0, #0x2000
    0x2500, // movs r5, #0
    0xF04F, 0x0801, // mov.w r8, #1
    // loop:
    0xF005, 0x063F, // and r6, r5, #63
    0xF850, 0x1026, // ldr.w r1, [r0, r6, lsl #2]
    0x6842, // ldr r2, [r0, #4]
    0x1949, // adds r1, r1, r5
    0xEA81, 0x11F2, // eor.w r1, r1, r2, ror #7
    0x6041, // str r1, [r0, #4]
    0x08CB, // lsrs r3, r1, #3
    0xF3C1, 0x1447, // ubfx r4, r1, #5, #8
    0x2C64, // cmp r4, #100
    0xBF88, // it hi
    0x18E4, // addhi r4, r4, r3
    0xFB04, 0xF301, // mul r3, r4, r1
    0x7243, // strb r3, [r0, #9]
    0x7A42, // ldrb r2, [r0, #9]
    0x88C7, // ldrh r7, [r0, #6]
    0x1ABF, // subs r7, r7, r2
    0xD400, // bmi skip
    0x44B8, // add r8, r8, r7
    // skip:
    0xF000, 0xF80B, // bl func
    0x3501, // adds r5, #1
    0xB13D, // cbz r5, end
    0xFB13, 0x8804, // smlabb r8, r3, r4, r8
    0xF015, 0x0F03, // tst r5, #3
    0xD1DF, // bne loop
    0xB2DB, // uxtb r3, r3
    0xF840, 0x3026, // str.w r3, [r0, r6, lsl #2]
    0xE7DB, // end: b loop
    // func:
    0xB530, // push {r4, r5, lr}
    0xF104, 0x040C, // add r4, r4, #12
    0x432C, // orrs r4, r5
    0xE9C0, 0x4504, // strd r4, r5, [r0, #16]
    0xEE00, 0x4A10, // vmov s0, r4
    0xEE70, 0x0A20, // vadd.f32 s1, s0, s1
    0xBD30, // pop {r4, r5, pc}
];

/// `cargo test --release -p hal-sim --lib chip::cpu::speed -- --ignored --nocapture`
#[test]
#[ignore = "a measurement"]
fn instructions_per_second() {
    let mut bus = Flat::new();
    let bytes: Vec<u8> = MIXED.iter().flat_map(|half| half.to_le_bytes()).collect();
    assert!(bus.load(Flat::FLASH, &bytes));
    let mut cpu = Cpu::new();
    cpu.registers.r[15] = Flat::FLASH;
    cpu.registers.r[13] = Flat::SRAM + 0x1000;
    // CPACR: floating point for everyone.
    assert!(
        cpu.system
            .write(0xE000_ED88, super::Size::Word, 0xF << 20, 0)
            .is_ok()
    );
    let begin = Instant::now();
    assert_eq!(cpu.run(&mut bus, 400_000_000), Ok(()));
    let seconds = begin.elapsed().as_secs_f64();
    println!(
        "{:.1} million instructions and {:.1} million cycles a second",
        cpu.instructions as f64 / seconds / 1e6,
        cpu.cycle as f64 / seconds / 1e6
    );
}
