//! Axes without a name.
//!
//! An axis is found by its ticks: a row of centred numbers, or a column of right-aligned ones. A
//! row's name stands under it, a column's beside it (turned, or with its unit in brackets) or above
//! it. A bold title names no axis, and a name that also describes the other axis names neither.
//! Rows and columns of words need no name.

use super::drawing::{Box2, Drawing, Words};

/// Largest distance of a name below a row, beside or above a column, CSS pixels.
const BELOW: f64 = 30.0;
const BESIDE: f64 = 150.0;
const ABOVE: f64 = 34.0;

pub fn find(drawing: &Drawing) -> Vec<String> {
    let words: Vec<&Words> = drawing.words().collect();
    let upright = || words.iter().copied().filter(|w| !w.turned && !w.bold);
    let mut found = Vec::new();
    let centred: Vec<&Words> = upright().filter(|w| w.anchor == "middle").collect();
    for row in axes(centred, |w| w.at.1, |w| w.at.0, 3) {
        if !upright().any(|name| names_row(name, &row)) {
            found.push(format!("axis across without a name: {}", ticks(&row)));
        }
    }
    let right: Vec<&Words> = upright().filter(|w| w.anchor == "end").collect();
    for column in axes(right, |w| w.at.0, |w| w.at.1, 2) {
        let named = words.iter().any(|name| names_column(name, &column));
        if !named {
            found.push(format!("axis up without a name: {}", ticks(&column)));
        }
    }
    found
}

/// Groups texts in one row or column by position, and splits them where a new axis begins.
fn axes(
    mut words: Vec<&Words>,
    line: impl Fn(&Words) -> f64,
    place: impl Fn(&Words) -> f64,
    least: usize,
) -> Vec<Vec<&Words>> {
    let key = |w: &Words| {
        (
            (line(w) * 2.0).round() as i64,
            (w.size * 4.0).round() as i64,
        )
    };
    words.sort_by(|a, b| key(a).cmp(&key(b)).then(place(a).total_cmp(&place(b))));
    let mut found_axes = Vec::new();
    for group in words.chunk_by(|a, b| key(a) == key(b)) {
        let mut axis: Vec<&Words> = Vec::new();
        for &next in group {
            if starts_new(&axis, next, &place) {
                found_axes.push(std::mem::take(&mut axis));
            }
            axis.push(next);
        }
        found_axes.push(axis);
    }
    found_axes.retain(|axis| {
        let numbers = axis.iter().filter(|w| value(&w.text).is_some()).count();
        axis.len() >= least && 2 * numbers > axis.len()
    });
    found_axes
}

/// Returns whether a text begins a new axis: it is much further away, or its number reverses
/// direction.
fn starts_new(axis: &[&Words], next: &Words, place: &impl Fn(&Words) -> f64) -> bool {
    let [.., before, last] = axis else {
        return false;
    };
    let (gap, usual) = (place(next) - place(last), place(last) - place(before));
    let turns = match (value(&before.text), value(&last.text), value(&next.text)) {
        (Some(a), Some(b), Some(c)) => (b - a) * (c - b) < 0.0,
        _ => false,
    };
    turns || gap > 2.6 * usual
}

/// Returns the number at the start of a tick, in its unit.
fn value(text: &str) -> Option<f64> {
    let plain: String = text
        .replace('−', "-")
        .chars()
        .filter(|c| !c.is_whitespace())
        .collect();
    let end = plain
        .find(|c: char| !(c.is_ascii_digit() || ".-+".contains(c)))
        .unwrap_or(plain.len());
    let number: f64 = plain[..end].parse().ok()?;
    let unit = match &plain[end..] {
        "ms" => 1e-3,
        power if power.starts_with(['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹', '⁻']) => {
            exponent(power)
        }
        _ => 1.0,
    };
    Some(number * unit)
}

/// Returns the factor by which raised digits multiply the preceding ten: for 10³ it is 10³/10.
fn exponent(text: &str) -> f64 {
    const RAISED: &str = "⁰¹²³⁴⁵⁶⁷⁸⁹";
    let digits = text.trim_start_matches('⁻').chars();
    let power = digits
        .map_while(|c| RAISED.chars().position(|r| r == c))
        .fold(0, |power, digit| 10 * power + digit as i32);
    10f64.powi(
        if text.starts_with('⁻') {
            -power
        } else {
            power
        } - 1,
    )
}

fn span(axis: &[&Words]) -> Box2 {
    let corners = axis.iter().flat_map(|w| {
        [
            (w.bounds.left, w.bounds.top),
            (w.bounds.right, w.bounds.bottom),
        ]
    });
    Box2::around(&corners.collect::<Vec<_>>())
}

/// Returns whether the text names a quantity of this axis only.
fn is_name(name: &Words) -> bool {
    let letters = name.text.chars().filter(|c| c.is_alphabetic()).count();
    let has_other_axis = ["; down:", "; up:"]
        .iter()
        .any(|other| name.text.contains(other));
    letters > 0 && value(&name.text).is_none() && !has_other_axis
}

fn names_row(name: &Words, row: &[&Words]) -> bool {
    let span = span(row);
    let under = name.bounds.top - span.bottom;
    let (middle, _) = name.bounds.middle();
    let about = (span.left - 20.0..=span.right + 20.0).contains(&middle);
    is_name(name) && (-2.0..BELOW).contains(&under) && about
}

fn names_column(name: &Words, column: &[&Words]) -> bool {
    let span = span(column);
    let (_, middle) = name.bounds.middle();
    let beside = (0.0..BESIDE).contains(&(span.left - name.bounds.right + 2.0))
        && (span.top - 12.0..=span.bottom + 12.0).contains(&middle);
    let has_unit = name.text.contains('(') && name.text.contains(')');
    let above = (-2.0..ABOVE).contains(&(span.top - name.bounds.bottom))
        && name.bounds.left < span.right + 12.0
        && name.bounds.right > span.left - 12.0;
    is_name(name) && !name.bold && (beside && (name.turned || has_unit) || above && !name.turned)
}

fn ticks(axis: &[&Words]) -> String {
    let texts: Vec<&str> = axis.iter().map(|w| w.text.as_str()).collect();
    match texts.as_slice() {
        [first, second, .., last] => format!("{first}, {second} … {last}"),
        all => all.join(", "),
    }
}
