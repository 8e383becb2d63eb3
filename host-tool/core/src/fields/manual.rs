//! The tables of a format's manual, generated from its declared fields.

use super::decimal::format_scaled;
use super::field::{Condition, Field, Kind, Need, Number, Section};

/// Returns the fields of one table of a file as a Markdown table, or `None` if there is no such
/// table. In `path`, dots separate the names of the fields that lead to the table. If a field is
/// declared several times, `=` and the word that selects the declaration follow the name.
pub(crate) fn fields_as_markdown(file: &'static Section, path: &str) -> Option<String> {
    let section = section(file, path)?;
    let mut text = String::from("| field | unit, range | default | meaning |\n|---|---|---|---|\n");
    for field in section {
        let (quantity, need) = (unit_and_range(field), format_default(field));
        text += &format!(
            "| `{}` | {quantity} | {need} | {} |\n",
            field.name, field.meaning
        );
    }
    Some(text)
}

fn section(file: &'static Section, path: &str) -> Option<&'static Section> {
    let mut names = path.split('.').filter(|name| !name.is_empty());
    names.try_fold(file, |section, part| {
        let (name, word) = part
            .split_once('=')
            .map_or((part, None), |(n, w)| (n, Some(w)));
        let is = |field: &&Field| match field.when {
            Some(Condition::Is(_, words)) if word.is_some() => {
                words.contains(&word.unwrap_or_default())
            }
            _ => true,
        };
        let mut same = section.iter().filter(|field| field.name == name);
        match &same.find(is)?.kind {
            Kind::Table(section) | Kind::Tables(section, _) => Some(section),
            _ => None,
        }
    })
}

/// Returns the type, unit and range of a field for the manual, for example "mA, 0.1–100".
fn unit_and_range(field: &Field) -> String {
    match &field.kind {
        Kind::Text(None) => "text".into(),
        Kind::Text(Some(most)) => format!("1–{most} characters"),
        Kind::Texts(most) => format!("list of 1–{most} characters"),
        Kind::Flag => "true, false".into(),
        Kind::Choice(words) => {
            let quoted: Vec<String> = words.iter().map(|word| format!("`\"{word}\"`")).collect();
            quoted.join(", ")
        }
        Kind::Whole(number) | Kind::Real(number) => range(number),
        Kind::Wholes(number, _) => format!("list of {}", range(number)),
        Kind::Pairs(number, count, _) => format!("{count} pairs of {}", range(number)),
        Kind::Table(_) => "table".into(),
        Kind::Tables(_, count) => count.format_count(),
    }
}

fn range(number: &Number) -> String {
    let limits = number.range.map(|(min, max)| {
        let limit_text = |value| grouped(&format_scaled(value, number.places));
        match limit_text(min).starts_with('−') {
            true => format!("{} to {}", limit_text(min), limit_text(max)),
            false => format!("{}–{}", limit_text(min), limit_text(max)),
        }
    });
    let parts = [
        Some(number.unit.to_owned()),
        limits,
        Some(number.bound.to_owned()),
    ];
    let parts: Vec<String> = parts
        .into_iter()
        .flatten()
        .filter(|p| !p.is_empty())
        .collect();
    parts.join(", ")
}

/// Formats a number with a space between groups of three digits and with a true minus sign, for
/// example "86 400" or "−180".
fn grouped(number: &str) -> String {
    let (whole, fraction) = number
        .split_once('.')
        .map_or((number, None), |(w, f)| (w, Some(f)));
    let digits = whole.trim_start_matches('-');
    let mut text = String::from(if digits == whole { "" } else { "−" });
    for (place, digit) in digits.chars().enumerate() {
        let left = digits.len() - place;
        if place > 0 && left % 3 == 0 && digits.len() > 4 {
            text.push(' ');
        }
        text.push(digit);
    }
    fraction.map_or(text.clone(), |fraction| format!("{text}.{fraction}"))
}

fn format_default(field: &Field) -> String {
    let need = match &field.need {
        Need::Required => "required".into(),
        Need::RequiredWithout(other) => format!("required without `{other}`"),
        Need::OrFile => "the wearer file's".into(),
        Need::Optional => "none".into(),
        Need::Or(value) => grouped(&format_scaled(*value, field.places())),
        Need::OrWord(word @ ("true" | "false")) => (*word).into(),
        Need::OrWord(word) => format!("`\"{word}\"`"),
        Need::OrTold(told) => told.clone(),
    };
    match field.when {
        None => need,
        Some(Condition::Is(_, words)) => format!("{need}, {}", words.join(", ")),
        Some(Condition::Without(other)) => format!("{need} without `{other}`"),
    }
}
