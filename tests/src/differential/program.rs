//! Image of cases, with the harness that runs them.

use super::encodings::Encodings;
use super::generate::{self, Case, SCRATCH, SCRATCH_BYTES};
use super::random::Random;

/// Words of a record: APSR, FPSCR, SP, S0–S31, R0–R12, LR, the scratch memory.
pub const RECORD_WORDS: usize = 49 + SCRATCH_BYTES as usize / 4;

const FLASH: u32 = 0x0800_0000;
const RAM: u32 = 0x2000_0000;
const RECORDS: u32 = RAM + 0x2000;
const RECORDS_AT_ONCE: u32 = 240;
/// Stack pointer of a case: 48 words of scratch memory below it, 16 above.
const STACK: u32 = SCRATCH + 192;
const INPUT_BYTES: u32 = 192;
const CASES: usize = 3_000;

/// Address of the harness, after the vector table.
const HARNESS_AT: u32 = FLASH + 0x40;
/// Start address of tables and cases; the harness and its literals fit below.
const TABLES_AT: u32 = FLASH + 0x2000;

/// Offset in the harness of the BKPT at which the host opens the output file.
const OPEN: u32 = 0x20;
/// Offset in the harness of the BKPT at which the host writes full buffers to the file.
const WRITE: u32 = 0xCA;
/// Offset in the harness of the BKPT at which the host ends the program.
const EXIT: u32 = 0xB6;
const AFTER: u32 = 0x64;
const SUPERVISOR_CALL: u32 = 0xCE;
const FAULT: u32 = 0xD0;

/// Harness. It enables the FPU; takes the next input, its case and the stack pointer; stores the
/// results of the case in a record; and lets the host write full buffers. A fault ends the program,
/// so that records are missing.
#[rustfmt::skip]
const HARNESS: &[u16] = &[
    // reset:
    0x4834,          // ldr r0, cpacr
    0xF44F, 0x0170,  // mov.w r1, #15728640
    0x6001,          // str r1, [r0]
    0xF3BF, 0x8F4F,  // dsb sy
    0xF3BF, 0x8F6F,  // isb sy
    0x4831,          // ldr r0, initial
    0x4932,          // ldr r1, control
    0xE8B0, 0x01FC,  // ldm.w r0!, {r2-r8}
    0xE8A1, 0x01FC,  // stm.w r1!, {r2-r8}
    0x2001,          // movs r0, #1
    0x4930,          // ldr r1, open
    // open:
    0xBEAB,          // bkpt #0xAB
    0x492E,          // ldr r1, control
    0x6108,          // str r0, [r1, #16]
    // next:
    0x482D,          // ldr r0, control
    0xE890, 0x001E,  // ldm.w r0, {r1-r4}
    0xB3FC,          // cbz r4, finish
    0x3C01,          // subs r4, #1
    0xF852, 0x5B04,  // ldr r5, [r2], #4
    0xF101, 0x06C0,  // add.w r6, r1, #192
    0x6006,          // str r6, [r0]
    0x6042,          // str r2, [r0, #4]
    0x60C4,          // str r4, [r0, #12]
    0x4F29,          // ldr r7, entry
    0x603D,          // str r5, [r7]
    0xF851, 0x5B04,  // ldr r5, [r1], #4
    0xEEE1, 0x5A10,  // vmsr fpscr, r5
    0xF851, 0x5B04,  // ldr r5, [r1], #4
    0xF385, 0x8C00,  // msr apsr_nzcvqg, r5
    0xECB1, 0x0A20,  // vldmia r1!, {s0-s31}
    0x468D,          // mov sp, r1
    0xE8BD, 0x5FFF,  // pop.w {r0-r12, lr}
    0xF8DF, 0xD084,  // ldr.w sp, entry
    0xF85D, 0xFB04,  // ldr pc, [sp], #4
    // after:
    0xF5AD, 0x7D80,  // sub.w sp, sp, #256
    0xE92D, 0x5FFF,  // push.w {r0-r12, lr}
    0xF3EF, 0x8000,  // mrs r0, apsr
    0xEEF1, 0x1A10,  // vmrs r1, fpscr
    0x466A,          // mov r2, sp
    0x4B19,          // ldr r3, control
    0x689C,          // ldr r4, [r3, #8]
    0xC407,          // stm r4!, {r0-r2}
    0xECA4, 0x0A20,  // vstmia r4!, {s0-s31}
    0xE8BD, 0x0FE0,  // pop.w {r5-r11}
    0xE8A4, 0x0FE0,  // stm.w r4!, {r5-r11}
    0xE8BD, 0x0FE0,  // pop.w {r5-r11}
    0xE8A4, 0x0FE0,  // stm.w r4!, {r5-r11}
    0x4815,          // ldr r0, scratch
    0x2108,          // movs r1, #8
    // copy:
    0xE8B0, 0x1FE0,  // ldm.w r0!, {r5-r12}
    0xE8A4, 0x1FE0,  // stm.w r4!, {r5-r12}
    0x3901,          // subs r1, #1
    0xD1F9,          // bne copy
    0x609C,          // str r4, [r3, #8]
    0x4812,          // ldr r0, end
    0x4284,          // cmp r4, r0
    0xD3BE,          // blo next
    0xF000, 0xF807,  // bl flush
    0xE7BB,          // b next
    // finish:
    0xF000, 0xF804,  // bl flush
    0x2018,          // movs r0, #24
    0x490E,          // ldr r1, exit
    // exit:
    0xBEAB,          // bkpt #0xAB
    0xE7FD,          // b exit
    // flush:
    0x4908,          // ldr r1, control
    0x688A,          // ldr r2, [r1, #8]
    0x694B,          // ldr r3, [r1, #20]
    0x608B,          // str r3, [r1, #8]
    0x1AD2,          // subs r2, r2, r3
    0x618A,          // str r2, [r1, #24]
    0x3110,          // adds r1, #16
    0x2005,          // movs r0, #5
    // write:
    0xBEAB,          // bkpt #0xAB
    0x4770,          // bx lr
    // svc:
    0x4770,          // bx lr
    // fault:
    0xE7ED,          // b finish
    0xBF00,          // nop
];

/// Image and its contents.
#[derive(Clone, Debug)]
pub struct Program {
    /// Seed of the cases.
    pub seed: u64,
    /// Flash contents from 0x0800_0000 on.
    pub flash: Vec<u8>,
    /// Cases, with the addresses of their code.
    pub cases: Vec<(u32, Case)>,
    /// Addresses of the harness's BKPTs: open, write, exit.
    pub calls: [u32; 3],
    /// First address after the cases.
    pub end: u32,
}

impl Program {
    /// Creates the program of `seed`, which prefers encodings with low counts in `planned`. Its
    /// records go to the file `output` in the host's directory.
    #[must_use]
    pub fn new(seed: u64, encodings: &Encodings, planned: &mut [u32], output: &str) -> Self {
        let mut random = Random::new(seed);
        let inputs = TABLES_AT;
        let list = inputs + CASES as u32 * INPUT_BYTES;
        let start = list + CASES as u32 * 4;
        let mut cases = Vec::with_capacity(CASES);
        let mut code: Vec<u16> = Vec::new();
        for _ in 0..CASES {
            let at = start + code.len() as u32 * 2;
            let case = generate::case(&mut random, encodings, planned, at);
            code.extend(&case.code);
            let back = branch(start + code.len() as u32 * 2, HARNESS_AT + AFTER);
            code.extend(back);
            cases.push((at, case));
        }
        let mut image = Image::default();
        image.vectors();
        image.harness(inputs, list, output);
        image.pad(TABLES_AT);
        for (_, case) in &cases {
            let input = &case.input;
            image.words(&[input.fpscr, input.apsr]);
            image.words(&input.s);
            image.words(&input.r);
            image.words(&[input.lr]);
        }
        for (at, _) in &cases {
            image.words(&[at | 1]);
        }
        image.halves(&code);
        Self {
            seed,
            end: FLASH + image.0.len() as u32,
            flash: image.0,
            cases,
            calls: [OPEN, WRITE, EXIT].map(|at| HARNESS_AT + at),
        }
    }
}

/// Encodes B.W from `from` to `to` (Arm ARM A7.7.12, encoding T4).
fn branch(from: u32, to: u32) -> [u16; 2] {
    let offset = to.wrapping_sub(from + 4);
    let sign = offset >> 24 & 1;
    let [j1, j2] = [23, 22].map(|bit| 1 ^ offset >> bit & 1 ^ sign);
    let first = 0xF000 | sign << 10 | offset >> 12 & 0x3FF;
    let second = 0x9000 | j1 << 13 | j2 << 11 | offset >> 1 & 0x7FF;
    [first as u16, second as u16]
}

/// Bytes from the start of flash.
#[derive(Default)]
struct Image(Vec<u8>);

impl Image {
    fn words(&mut self, words: &[u32]) {
        self.0.extend(words.iter().flat_map(|w| w.to_le_bytes()));
    }

    fn halves(&mut self, halves: &[u16]) {
        self.0.extend(halves.iter().flat_map(|h| h.to_le_bytes()));
    }

    fn pad(&mut self, to: u32) {
        self.0.resize((to - FLASH) as usize, 0);
    }

    fn vectors(&mut self) {
        let mut vectors = [(HARNESS_AT + FAULT) | 1; 16];
        vectors[0] = SCRATCH;
        vectors[1] = HARNESS_AT | 1;
        vectors[11] = (HARNESS_AT + SUPERVISOR_CALL) | 1;
        self.words(&vectors);
    }

    fn harness(&mut self, inputs: u32, list: u32, output: &str) {
        self.halves(HARNESS);
        let literals = FLASH + self.0.len() as u32;
        let (control, open, name) = (literals + 8 * 4, literals + 15 * 4, literals + 18 * 4);
        let end = RECORDS + RECORDS_AT_ONCE * RECORD_WORDS as u32 * 4;
        const COPROCESSOR_ACCESS: u32 = 0xE000_ED88;
        const ENDED: u32 = 0x2_0026;
        self.words(&[COPROCESSOR_ACCESS, control, RAM, open, STACK - 4]);
        self.words(&[SCRATCH, end, ENDED]);
        // Contents at the start of RAM: input, list, record, remaining cases; then the host's file,
        // buffer, length.
        let cases = CASES as u32;
        self.words(&[inputs, list, RECORDS, cases, 0, RECORDS, 0]);
        // The file is opened as "wb".
        self.words(&[name, 5, output.len() as u32]);
        self.0.extend(output.as_bytes());
        self.0.push(0);
    }
}
