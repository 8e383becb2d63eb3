//! Formats the results of studies with random wearers in 80 columns.

use host_core::plot::words::wrap_columns;
use studies::hamana2022::Experiment;
use studies::hamana2022::paper::Kind;
use studies::laboratory::{
    LARGE_T, Outcome, Row, Share, Sheet, SheetContent, headline, large_t, paper_claims,
};

/// Largest width of a printed line, columns.
const COLUMNS: u16 = 80;

/// Formats the outcome of a study: its tables, the shares of draws in which each claim holds, and
/// its notes.
pub(super) fn outcome_text(result: &Outcome) -> String {
    let mut text = match Kind::from_name(&result.name) {
        Some(Kind::Patterns(Experiment::Intensities)) => finger_table(&result.rows) + "\n",
        // The sheets show the same rows.
        Some(Kind::Control) => String::new(),
        _ => number_table(&result.rows) + "\n",
    };
    text.extend(result.sheets.iter().map(table));
    text += &share_lines(result);
    if let Some(cut_short) = &result.cut_short {
        text += &format!("\n{cut_short}");
    }
    text += &format!("\n{}\n", wrap_columns(&headline(result), COLUMNS));
    for note in &result.notes {
        text += &format!("{}\n", wrap_columns(note, COLUMNS));
    }
    text.trim_end().to_owned()
}

/// Formats a table of the paper if it fits the terminal.
fn table(sheet: &Sheet) -> String {
    let SheetContent::Table(grid) = &sheet.shows else {
        return String::new();
    };
    let text = grid.in_columns();
    let is_narrow = |line: &str| line.chars().count() <= usize::from(COLUMNS);
    match text.lines().all(is_narrow) {
        true => format!("{}: {}\n{text}\n\n", sheet.number, sheet.title),
        false => format!("{}: {}: see the page\n\n", sheet.number, sheet.title),
    }
}

/// Formats the median, the 5 % and 95 % quantiles and the paper's value of each row.
fn number_table(rows: &[Row]) -> String {
    let digits = |value: f64| match value.abs() {
        large if large >= 100.0 => format!("{value:.0}"),
        _ => format!("{value:.3}"),
    };
    let printed = |row: &Row, value: Option<f64>| {
        let Some(value) = value else {
            return "-".to_owned();
        };
        large_t(&row.quantity, value).map_or_else(|| digits(value), str::to_owned)
    };
    let line = |row: &Row| {
        let name = match &*row.unit {
            "" => row.quantity.clone(),
            unit => format!("{}, {unit}", row.quantity),
        };
        let numbers = [row.ours, row.low, row.high, row.paper];
        let [ours, low, high, paper] = numbers.map(|number| printed(row, number));
        format!(
            "{name:<42.42}{:>4}{ours:>9}{low:>8}{high:>8}{paper:>9}\n",
            row.n
        )
    };
    let head = format!(
        "{:<42}{:>4}{:>9}{:>8}{:>8}{:>9}\n",
        "", "n", "median", "5 %", "95 %", "paper"
    );
    let is_large = |row: &Row| {
        let numbers = [row.ours, row.low, row.high].into_iter().flatten();
        numbers
            .into_iter()
            .any(|number| large_t(&row.quantity, number).is_some())
    };
    let note = match rows.iter().any(is_large) {
        true => format!("{}\n", wrap_columns(LARGE_T, COLUMNS)),
        false => String::new(),
    };
    head + &rows.iter().map(line).collect::<String>() + &note
}

/// Formats the median response of each finger at each intensity, % of the finger's range, and the
/// number of draws with values.
fn finger_table(rows: &[Row]) -> String {
    let mut text = format!("{:<36}{:>4}", "median, % of the finger's range", "n");
    let names = rows.iter().take(5);
    let names = names.filter_map(|row| row.quantity.rsplit(", ").next());
    text.extend(names.map(|name| format!("{name:>8}")));
    for fingers in rows.chunks(5) {
        let Some(first) = fingers.first() else {
            continue;
        };
        let name = first.quantity.rsplit_once(", ");
        let name = name.map_or("", |(name, _)| name);
        text += &format!("\n{name:<36.36}{:>4}", first.n);
        for row in fingers {
            let ours = row
                .ours
                .map_or_else(|| "-".to_owned(), |value| format!("{value:.1}"));
            text += &format!("{ours:>8}");
        }
    }
    text + "\n"
}

/// Formats one line for each claim of the paper, or a heading and one line for each of its parts;
/// then the shares that do not belong to a claim.
fn share_lines(result: &Outcome) -> String {
    let (claims, beside) = paper_claims(result);
    let mut text = String::new();
    for claim in &claims {
        match claim.parts.as_slice() {
            [one] => text += &share_line(one, claim.says),
            parts => {
                let line = format!("{}: {}", claim.says, claim.counts_in_words());
                text += &(wrap_columns(&line, COLUMNS) + "\n");
                let lines = parts
                    .iter()
                    .map(|part| share_line(part, &format!("  {}", part.claim)));
                text.extend(lines);
            }
        }
    }
    text.extend(beside.iter().map(|item| share_line(item, &item.claim)));
    text
}

fn share_line(item: &Share, says: &str) -> String {
    let paper = match item.paper {
        None => "paper: -",
        Some(true) => "paper: yes",
        Some(false) => "paper: no",
    };
    format!("{says:<50.50}{:>4} of {:<5}{paper}\n", item.holds, item.of)
}

/// Formats the headline, and the share of draws in which each claim of a declaration holds.
pub(super) fn claims_text(outcome: &Outcome, page: &str) -> String {
    let mut text = format!("{}\n\n", wrap_columns(&headline(outcome), 80));
    let mut point = "";
    for share in &outcome.shares {
        if share.at != point {
            point = &share.at;
            text += &format!("{point}\n");
        }
        let paper = match share.paper {
            Some(true) => "paper: yes",
            Some(false) => "paper: no",
            None => "",
        };
        let claim = match share.claim.chars().count() {
            ..=54 => share.claim.clone(),
            _ => share.claim.chars().take(53).chain(['…']).collect(),
        };
        let line = format!("{:>8}  {claim:<54}  {paper}", share.percent());
        text += &format!("{}\n", line.trim_end());
    }
    let evidence = match outcome.simulated {
        Some(true) => "Simulated with assumed wearer models: no evidence about people.",
        Some(false) => "One wearer: the results hold for this measurement only.",
        None => "No device answered: it is unknown whether the results are simulated.",
    };
    text + &format!("\n{evidence}\nPage: {page}")
}
