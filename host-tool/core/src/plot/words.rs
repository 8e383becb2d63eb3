//! Space that text takes.
//!
//! The figures name no font of their own, so that a viewer uses the font of its system. Space is
//! left for DejaVu Sans, the widest of the usual sans-serif fonts: it is 14–16 % wider than Arial
//! in regular and 19–25 % in bold. Text is anchored at the same position in every font, so that a
//! narrower one fits in that space.

use std::collections::HashMap;
use std::sync::LazyLock;

/// Units per em in which the table of letter widths is given.
const PER_EM: f64 = 2048.0;

/// Width of each letter, in ems: regular, then bold.
static ADVANCES: LazyLock<HashMap<char, [f64; 2]>> = LazyLock::new(|| {
    let lines = include_str!("advances.txt").lines();
    let row = |line: &str| {
        let mut parts = line.split(' ');
        let letter = char::from_u32(u32::from_str_radix(parts.next()?, 16).ok()?)?;
        let mut width = || Some(parts.next()?.parse::<f64>().ok()? / PER_EM);
        Some((letter, [width()?, width()?]))
    };
    lines.filter_map(row).collect()
});

/// Returns the width of one letter in ems; `None` if the table has no entry for it.
#[must_use]
pub fn advance(letter: char, bold: bool) -> Option<f64> {
    Some(ADVANCES.get(&letter)?[usize::from(bold)])
}

/// Returns the width of a text, pixels, in letters of height `size`. A letter that the table does
/// not have counts as one em.
#[must_use]
pub fn width(size: f64, text: &str, bold: bool) -> f64 {
    let advances = text.chars().map(|c| advance(c, bold).unwrap_or(1.0));
    size * advances.sum::<f64>()
}

/// Returns `text` unchanged if it fits in `room` pixels; otherwise shortens it and ends it with an
/// ellipsis.
#[must_use]
pub fn truncate(size: f64, text: &str, room: f64, bold: bool) -> String {
    if width(size, text, bold) <= room {
        return text.to_owned();
    }
    let mut short = text.to_owned();
    while short.pop().is_some() && width(size, &short, bold) + size > room {}
    short.trim_end().to_owned() + "…"
}

/// Splits a paragraph into lines that are at most `room` pixels wide, in letters of height `size`.
#[must_use]
pub fn wrap_text(size: f64, paragraph: &str, room: f64) -> Vec<String> {
    wrap_by(|line| width(size, line, false), paragraph, room)
}

/// Inserts line breaks into a paragraph so that no line is longer than `columns` characters.
#[must_use]
pub fn wrap_columns(paragraph: &str, columns: u16) -> String {
    let wide = |line: &str| line.chars().count() as f64;
    wrap_by(wide, paragraph, columns.into()).join("\n")
}

/// Splits a paragraph into lines whose width, as `wide` measures it, is at most `room`. Only a
/// single long word may be wider.
fn wrap_by(wide: impl Fn(&str) -> f64, paragraph: &str, room: f64) -> Vec<String> {
    let mut lines = vec![String::new()];
    for word in paragraph.split_whitespace() {
        let last = lines.last().map_or("", |line| line);
        let longer = format!("{last} {word}").trim_start().to_owned();
        if wide(&longer) > room && !last.is_empty() {
            lines.push(word.to_owned());
        } else {
            lines.pop();
            lines.push(longer);
        }
    }
    lines
}

/// Formats a number with thin spaces between groups of three digits.
#[must_use]
pub fn group_digits(number: u64) -> String {
    let digits = number.to_string();
    let mut out = String::new();
    for (n, digit) in digits.chars().enumerate() {
        if n > 0 && (digits.len() - n).is_multiple_of(3) {
            out.push('\u{2009}');
        }
        out.push(digit);
    }
    out
}

/// Formats a power of ten, for example "0.01", "1000" or "10⁶".
#[must_use]
pub fn power_of_ten(decade: i32) -> String {
    const RAISED: [char; 10] = ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'];
    match decade {
        -3..=0 => format!("{}", 10f64.powi(decade)),
        1..=3 => 10u64.pow(decade.unsigned_abs()).to_string(),
        _ => {
            let sign = if decade < 0 { "⁻" } else { "" };
            let digit = RAISED[decade.unsigned_abs() as usize % 10];
            format!("10{sign}{digit}")
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_is_cut_and_folded_to_its_room() {
        let words = "a line that is longer than its room";
        assert!(width(12.0, &truncate(12.0, words, 90.0, false), false) <= 90.0);
        let lines = wrap_text(12.0, words, 90.0);
        assert!(lines.len() > 2 && lines.iter().all(|l| width(12.0, l, false) <= 90.0));
        assert_eq!(lines.join(" "), words);
        let ends = "a line that\nends at 11";
        assert_eq!(wrap_columns("a line that ends at 11", 11), ends);
    }

    #[test]
    fn digits_are_grouped_and_decades_written_out_near_one() {
        assert_eq!(group_digits(7), "7");
        assert_eq!(group_digits(168_000), "168\u{2009}000");
        let powers = [-7, -2, 0, 3, 6].map(power_of_ten);
        assert_eq!(powers, ["10⁻⁷", "0.01", "1", "1000", "10⁶"]);
    }
}
