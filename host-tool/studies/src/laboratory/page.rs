//! The page of an experiment, made of its outcome and its recorded trials.

mod figures;

use super::claims::{Share, Verdict};
use super::conduct::Conducted;
use super::error::LaboratoryError;
use super::experiment::Experiment;
use super::result::{Outcome, Row};
use host_core::plot::canvas::escape;
use host_core::record::replace_file;
use host_core::report::document;
use std::collections::BTreeMap;
use std::path::Path;

/// Writes `result.json` and its page in `dir`.
///
/// # Errors
/// They cannot be written.
pub fn publish(
    dir: &Path,
    experiment: &Experiment,
    outcome: &Outcome,
    trials: &[Conducted],
) -> Result<(), LaboratoryError> {
    replace_file(&dir.join("result.json"), outcome.json().as_bytes())?;
    let page = page(experiment, outcome, trials);
    replace_file(&dir.join("result.html"), page.as_bytes())?;
    Ok(())
}

/// A self-contained HTML document. `trials` have been recorded with it: none where
/// wearers were drawn only.
#[must_use]
fn page(experiment: &Experiment, outcome: &Outcome, trials: &[Conducted]) -> String {
    let declaration = &experiment.declaration;
    let mut body = format!(
        "<p class=\"result\">{}</p>\n<p class=\"facts\">{} · seed {} · {} wearers drawn · \
         <b>Simulated wearers: no evidence about people.</b></p>\n",
        escape(&headline(outcome)),
        escape(&declaration.source),
        outcome.seed,
        outcome.declared.draws,
    );
    let shares = figure(&figures::shares(outcome)) + &shares_table(outcome);
    let multiples = figure(&figures::multiples(experiment, trials));
    let measures = figure(&figures::measures(experiment, outcome));
    let notes = outcome.notes.iter();
    let notes: String = notes
        .map(|note| format!("<li>{}</li>\n", escape(note)))
        .collect();
    for (title, text) in [
        ("What was claimed", shares),
        ("One arm in each condition", multiples),
        ("All wearers drawn", measures),
        ("Numbers", rows_table(&outcome.rows)),
        ("What to know", format!("<ul>\n{notes}</ul>\n")),
        ("Declared before looking", declared(experiment, outcome)),
    ] {
        if !text.is_empty() {
            body += &format!("<section><h2>{title}</h2>\n{text}</section>\n");
        }
    }
    document(&escape(&declaration.title), &body)
}

fn figure(svg: &str) -> String {
    match svg {
        "" => String::new(),
        svg => format!("<figure>{svg}</figure>\n"),
    }
}

/// How many of the paper's claims hold in most cases, and which do not; with a grid,
/// at how many of its points.
#[must_use]
pub fn headline(outcome: &Outcome) -> String {
    let mut claims: BTreeMap<&str, Vec<&Share>> = BTreeMap::new();
    let mut order = Vec::new();
    for share in outcome.shares.iter().filter(|it| it.verdict().is_some()) {
        let all = claims.entry(&share.id).or_default();
        if all.is_empty() {
            order.push(&*share.id);
        }
        all.push(share);
    }
    let grid = if outcome.is_grid() {
        " at every point of the grid"
    } else {
        ""
    };
    let of = |wanted: Verdict| -> Vec<String> {
        let all = order.iter().filter_map(|id| claims.get(id));
        let own = all.filter(|points| verdict(points) == wanted);
        own.map(|points| told(points)).collect()
    };
    let (like, unlike, open) = (
        of(Verdict::Like),
        of(Verdict::Unlike),
        of(Verdict::Undecided),
    );
    if order.is_empty() {
        return "Nothing here is held against a paper.".to_owned();
    }
    let list = |what: &str, claims: &[String]| match claims {
        [] => String::new(),
        all => format!("; {what}: {}", all.join("; ")),
    };
    format!(
        "{} of the paper's {} claims come out in most cases{grid}{}{}.",
        like.len(),
        order.len(),
        list("undecided", &open),
        list("not so", &unlike)
    )
}

/// Like the paper at every point, or undecided at some, or unlike it somewhere.
fn verdict(points: &[&Share]) -> Verdict {
    let any = |wanted| points.iter().any(|it| it.verdict() == Some(wanted));
    let worst = [Verdict::Unlike, Verdict::Undecided]
        .into_iter()
        .find(|it| any(*it));
    worst.unwrap_or(Verdict::Like)
}

/// A claim and its share, or at how many points it is as the paper says.
fn told(points: &[&Share]) -> String {
    let like = points
        .iter()
        .filter(|it| it.verdict() == Some(Verdict::Like))
        .count();
    match points {
        [] => String::new(),
        [one] => format!("{} ({})", one.claim, one.percent()),
        [first, ..] => format!("{} (so at {like} of {} points)", first.claim, points.len()),
    }
}

fn shares_table(outcome: &Outcome) -> String {
    let is_grid = outcome.is_grid();
    let rows = outcome.shares.iter().map(|share| {
        let paper = match share.paper {
            Some(true) => "yes",
            Some(false) => "no",
            None => "—",
        };
        let interval = share
            .low
            .zip(share.high)
            .map_or_else(String::new, |(low, high)| {
                format!("{:.1} to {:.1} %", 100.0 * low, 100.0 * high)
            });
        let place = if is_grid {
            format!("<td>{}</td>", escape(&share.at))
        } else {
            String::new()
        };
        format!(
            "<tr><th scope=\"row\">{}</th>{place}<td>{paper}</td><td>{}</td>\
             <td>{interval}</td><td>{} of {}</td></tr>\n",
            escape(&share.claim),
            share.percent(),
            share.holds,
            share.of
        )
    });
    let place = if is_grid { &["At"][..] } else { &[] };
    let heads = [
        &["Claim"],
        place,
        &["Paper", "Holds in", "Interval", "Cases"],
    ]
    .concat();
    table(&heads, rows.collect())
}

/// Rows *paper | ours | interval*.
fn rows_table(rows: &[Row]) -> String {
    let printed = |value: Option<f64>| value.map_or_else(|| "—".to_owned(), digits);
    let rows = rows.iter().map(|row| {
        let range = row.low.zip(row.high);
        let range = range.map_or_else(
            || "—".to_owned(),
            |(low, high)| format!("{} to {}", digits(low), digits(high)),
        );
        format!(
            "<tr><th scope=\"row\">{}</th><td>{}</td><td>{}</td><td>{}</td><td>{range}</td>\
             <td>{}</td></tr>\n",
            escape(&row.quantity),
            escape(&row.unit),
            printed(row.paper),
            printed(row.ours),
            row.n
        )
    });
    let heads = [
        "Quantity",
        "Unit",
        "Paper",
        "Ours",
        "5 to 95 % of wearers",
        "Wearers",
    ];
    table(&heads, rows.collect())
}

fn table(heads: &[&str], rows: String) -> String {
    let heads = heads
        .iter()
        .map(|head| format!("<th scope=\"col\">{head}</th>"))
        .collect::<String>();
    match rows.is_empty() {
        true => rows,
        false => {
            format!("<table><thead><tr>{heads}</tr></thead><tbody>\n{rows}</tbody></table>\n")
        }
    }
}

/// Three digits that count.
pub(super) fn digits(value: f64) -> String {
    let places = match value.abs() {
        small if small < 1.0 => 3,
        some if some < 10.0 => 2,
        many if many < 100.0 => 1,
        _ => 0,
    };
    format!("{value:.places$}")
}

fn declared(experiment: &Experiment, outcome: &Outcome) -> String {
    let name = &outcome.name;
    let (seed, draws) = (outcome.seed, outcome.declared.draws);
    let own = match outcome.declared.as_declared {
        true => "Seed and number of wearers are the declaration's own.",
        false => "Seed or number of wearers differ from the declaration's: explored, not declared.",
    };
    let files = experiment.hashes.iter();
    let files = files.map(|(file, hash)| format!("{hash}  {file}\n"));
    format!(
        "<p>{own}</p>\n<pre>flexor sweep {name} --seed {seed} --draws {draws}</pre>\n\
         <p>SHA-256 of what was declared:</p>\n<pre>{}</pre>\n",
        escape(&files.collect::<String>())
    )
}
