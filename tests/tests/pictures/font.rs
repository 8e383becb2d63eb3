//! Size of text: [`host_core::plot::words`] has the widths of DejaVu Sans, the widest of the usual
//! sans-serif fonts. The error is on the safe side: a collision found here may be only a near miss
//! in Arial.

use host_core::plot::words::advance;

/// Returns the width of a text in ems; the error names a letter without an entry.
pub fn width(text: &str, bold: bool) -> Result<f64, String> {
    let known = |letter: char| {
        let letter_width = advance(letter, bold);
        letter_width.ok_or_else(|| format!("no width for U+{:04X} {letter:?}", u32::from(letter)))
    };
    text.chars().map(known).sum()
}

/// Returns the extent of a text above and below its baseline, ems: DejaVu's ascenders, x-height and
/// descenders.
pub fn reach(text: &str) -> (f64, f64) {
    let is_low = |letter: char| "acegmnopqrsuvwxyz.,;:·-–−…αγεηικμνοπρςστυχψω ".contains(letter);
    let up = if text.chars().all(is_low) { 0.56 } else { 0.76 };
    let hangs = |letter: char| "gjpqyQ,;()[]{}|/βγζημξρφχψ".contains(letter);
    let down = if text.chars().any(hangs) { 0.24 } else { 0.02 };
    (up, down)
}
