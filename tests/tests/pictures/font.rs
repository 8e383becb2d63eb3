//! How much room text takes.
//!
//! Our pictures name no font of their own: a viewer takes its system's. They are
//! judged in DejaVu Sans, the widest of the usual sans-serif fonts: 14–16 % wider
//! than Arial in regular and 19–25 % in bold. The error is on the safe side: text
//! is anchored at the same place in every font, so that a narrower one lies within
//! the box found here; a collision found here may be no more than a near miss in
//! Arial.

use std::collections::HashMap;
use std::sync::LazyLock;

/// Units of the table's widths.
const PER_EM: f64 = 2048.0;

/// Regular and bold.
static ADVANCES: LazyLock<HashMap<char, [f64; 2]>> = LazyLock::new(|| {
    let lines = include_str!("advances.txt").lines();
    let rows = lines.filter(|line| !line.starts_with('#'));
    rows.map(|line| {
        let mut parts = line.split(' ');
        let mut next = || parts.next().expect("code point, regular, bold");
        let code = u32::from_str_radix(next(), 16).expect("a hexadecimal code point");
        let width = |text: &str| text.parse::<f64>().expect("a width") / PER_EM;
        let letter = char::from_u32(code).expect("a code point");
        (letter, [width(next()), width(next())])
    })
    .collect()
});

/// Width of a text in ems; an error names a letter without an entry.
pub fn width(text: &str, bold: bool) -> Result<f64, String> {
    let advance = |letter: char| {
        let known = ADVANCES
            .get(&letter)
            .map(|widths| widths[usize::from(bold)]);
        known.ok_or_else(|| format!("no width for U+{:04X} {letter:?}", u32::from(letter)))
    };
    text.chars().map(advance).sum()
}

/// How far a text reaches above and below its baseline, ems: DejaVu's ascenders,
/// x-height and descenders.
pub fn reach(text: &str) -> (f64, f64) {
    let is_low = |letter: char| "acegmnopqrsuvwxyz.,;:·-–−…αγεηικμνοπρςστυχψω ".contains(letter);
    let up = if text.chars().all(is_low) { 0.56 } else { 0.76 };
    let hangs = |letter: char| "gjpqyQ,;()[]{}|/βγζημξρφχψ".contains(letter);
    let down = if text.chars().any(hangs) { 0.24 } else { 0.02 };
    (up, down)
}
