//! IT blocks.

use super::{Row, Rule, between};

/// See the head of `chip_cycles.rs`.
pub const ROWS: &[Row] = &[
    Row {
        name: "it, done",
        assembly: "cmp r5, r5; it eq; addeq r5, #1",
        code: &[0x42AD, 0xBF08, 0x3501],
        steps: 3,
        cycles: between(2, 3),
        rule: Rule::It,
    },
    Row {
        name: "it, not done",
        assembly: "cmp r5, r5; it ne; addne r5, #1",
        code: &[0x42AD, 0xBF18, 0x3501],
        steps: 3,
        cycles: between(2, 3),
        rule: Rule::It,
    },
    Row {
        name: "ite",
        assembly: "cmp r5, r5; ite eq; moveq r6, #1; movne r6, #0",
        code: &[0x42AD, 0xBF0C, 0x2601, 0x2600],
        steps: 4,
        cycles: between(3, 4),
        rule: Rule::It,
    },
    Row {
        name: "it, ldr not done",
        assembly: "cmp r5, r5; it ne; ldrne r6, [r0]",
        code: &[0x42AD, 0xBF18, 0x6806],
        steps: 3,
        cycles: between(2, 3),
        rule: Rule::It,
    },
];
