//! The comparison as a page.

use super::files::FileDifference;
use super::pairs::{Group, groups};
use super::sessions::group_differences;
use super::{CompareRow, ComparedRecord, compare_rows, overlay};
use crate::html;
use crate::report::doses::{HEADS as DOSE_HEADS, NOTE, cells as dose_cells, channel};
use crate::report::page::figure;
use crate::report::tables::{degrees, headed, newtons, seconds};
use crate::report::{Html, trajectory};

/// Maximum number of groups of trials whose amplitudes are drawn; the tables contain all trials.
const MOST_DRAWN: usize = 8;
/// Maximum number of trials whose angles are drawn; the tables contain all trials.
const MOST_ANGLES: usize = 24;

const HEADS: [&str; 10] = [
    "Record",
    "Trial",
    "length",
    "RMSE",
    "force",
    "deepest",
    "pulses",
    "limit cycles",
    "muscle model",
    "",
];

/// Returns the body of the page: a table of the trials, the doses of the channels, the angles, and
/// the differences between session files.
#[must_use]
pub fn compare_body(compared_records: &[ComparedRecord]) -> Html {
    let mut out = Html::default();
    if compared_records
        .iter()
        .any(|compared| compared.is_simulated)
    {
        out += html!("<p class=\"facts\"><b>Simulated wearer: no evidence about people.</b></p>\n");
    }
    let records = compared_records.iter().map(|compared| {
        let caveat = compared
            .caveat
            .as_ref()
            .map(|text| html!(" <b>{}</b>", text));
        html!(
            "<li>{}: {}, <code>{}</code>{}</li>\n",
            compared.title,
            compared.device,
            compared.name,
            caveat.unwrap_or_default()
        )
    });
    out += html!("<ol>\n{}</ol>\n", records.collect::<Html>());
    let rows = compare_rows(compared_records).into_iter().map(|row| {
        let cells = cells(&row).map(|cell| html!("<td>{}</td>", cell));
        html!(
            "<tr><td>{}</td><th scope=\"row\">{}</th>{}</tr>\n",
            row.number,
            row.of.trial,
            cells.into_iter().collect::<Html>()
        )
    });
    out += headed(HEADS.into_iter(), &rows.collect());
    let groups = groups(compared_records);
    for (title, body) in [
        ("Output of the channels", stimulation(&groups)),
        ("Angle over time", angles(compared_records)),
        ("Session files", sessions(&groups)),
    ] {
        if !body.is_empty() {
            out += html!("<section><h2>{}</h2>\n{}</section>\n", title, body);
        }
    }
    out
}

fn cells(row: &CompareRow) -> [String; 8] {
    let or_none = |text: Option<String>| text.unwrap_or_else(|| "–".to_owned());
    let marks = [
        (row.damaged, "damaged"),
        (!row.complete, "incomplete"),
        (row.simulated, "simulated"),
    ];
    let marks = marks.into_iter().filter(|(is_so, _)| *is_so);
    let marks: Vec<&str> = marks.map(|(_, word)| word).collect();
    [
        format!("{} s", seconds(row.of.duration_s)),
        or_none(row.of.rmse_deg.map(degrees)),
        or_none(row.of.rmse_n.map(newtons)),
        or_none(row.of.deepest_deg.map(degrees)),
        or_none(row.of.pulses.map(|count| count.to_string())),
        row.of.limit_cycles.to_string(),
        or_none(row.of.models.clone()),
        marks.join(", "),
    ]
}

/// Returns figures of the amplitudes, with those of all records over each other, and a table of the
/// doses with a row for each channel of each record.
fn stimulation(groups: &[Group<'_>]) -> Html {
    let mut out = Html::default();
    // Trials that differ come first, because only the first ones are drawn if there are many.
    let (differing, alike): (Vec<_>, Vec<_>) = groups.iter().partition(|group| group.differs());
    let has_channels = |group: &&&Group<'_>| {
        group
            .trials
            .iter()
            .any(|trial| !trial.1.row.channels.is_empty())
    };
    let ordered = differing.iter().chain(&alike).filter(has_channels);
    for (place, group) in ordered.enumerate() {
        out += html!("<h3>{}</h3>\n", group.name);
        if place < MOST_DRAWN {
            let lines = overlay::MOST_LINES;
            let caption = match group.trials.len() > lines {
                true => {
                    "Amplitude of the latest burst, for the first six records. Where lines \
                         coincide, the edges of the wider ones remain visible."
                }
                false => {
                    "Amplitude of the latest burst. Where lines coincide, the edges of the \
                          wider ones remain visible."
                }
            };
            out += figure(&overlay::figure(group), caption);
        }
        out += dose_table(group);
    }
    match (out.is_empty(), groups.len() > MOST_DRAWN) {
        (true, _) => out,
        (false, is_many) => {
            let more = match is_many {
                true => " Figures show only eight trials, first those whose output differs.",
                false => "",
            };
            let note = format!("{NOTE} Bold: differs from the first row of the channel.{more}");
            out + html!("<p class=\"note\">{}</p>\n", note)
        }
    }
}

fn dose_table(group: &Group<'_>) -> Html {
    let doses = group.trials.iter().flat_map(|(record, kept)| {
        let channels = kept.row.channels.iter();
        channels.map(move |dose| (dose.channel, *record, dose))
    });
    let mut sorted_doses: Vec<_> = doses.collect();
    sorted_doses.sort_by_key(|(channel, record, _)| (*channel, *record));
    let mut rows = Html::default();
    for own in sorted_doses.chunk_by(|a, b| a.0 == b.0) {
        let first = own.first().map(|(.., dose)| dose_cells(dose));
        for (_, record, dose) in own {
            let cells = dose_cells(dose);
            let cells = cells.iter().enumerate().map(|(place, cell)| {
                let is_other = first.as_ref().is_some_and(|first| first[place] != *cell);
                match is_other {
                    true => html!("<td><b>{}</b></td>", cell),
                    false => html!("<td>{}</td>", cell),
                }
            });
            rows += html!(
                "<tr><th scope=\"row\">{}</th><td>{}</td>{}</tr>\n",
                channel(dose),
                *record,
                cells.collect::<Html>()
            );
        }
    }
    headed(["Channel", "Record"].into_iter().chain(DOSE_HEADS), &rows)
}

/// Returns a figure of references and measured angles; an empty text if no trial has any.
fn angles(records: &[ComparedRecord]) -> Html {
    let numbered = records.iter().enumerate();
    let traced = numbered.flat_map(|(position, compared)| {
        let own = compared.trials.iter().map(|kept| &kept.traced);
        let own = own.filter(|traced| traced.has_angle());
        own.map(move |traced| traced.with_name(format!("{}: {}", position + 1, traced.name)))
    });
    let traced: Vec<_> = traced.collect();
    let caption = match traced.len() > MOST_ANGLES {
        true => "Only the first 24 trials are shown.",
        false => "",
    };
    match traced.is_empty() {
        true => Html::default(),
        false => {
            let drawn = &traced[..traced.len().min(MOST_ANGLES)];
            figure(&trajectory::figure_from_traces(drawn), caption)
        }
    }
}

/// Returns, for each session or wearer file that differs, a table of the differing keys and a
/// line-by-line comparison.
fn sessions(groups: &[Group<'_>]) -> Html {
    let differences: Vec<FileDifference> = groups.iter().flat_map(group_differences).collect();
    let are_held = groups.iter().any(|group| group.trials.len() > 1);
    match differences.is_empty() && are_held {
        true => html!("<p>The session files are the same.</p>\n"),
        false => differences.iter().map(FileDifference::html).collect(),
    }
}
