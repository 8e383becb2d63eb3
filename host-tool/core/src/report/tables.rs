//! Text and tables of the page.

use super::Html;
use crate::analysis::{
    Metrics, channels_without_prediction, force_limiting_share, force_metrics, metrics,
    metrics_without_lag, wall_contacts,
};
use crate::html;
use crate::record::{PaperRow, Trial};

/// Formats an angle with three significant digits, as the papers do, for example "9.53°".
pub(super) fn degrees(value: f64) -> String {
    format!("{}°", three_digits(value))
}

/// Formats a force with three significant digits, for example "0.0532 N".
pub(super) fn newtons(value: f64) -> String {
    format!("{} N", three_digits(value))
}

/// Formats a time, s, rounded to a millisecond and without trailing zeros, for example "10" or
/// "0.25".
pub(super) fn seconds(value: f64) -> String {
    format!("{}", (value * 1000.0).round() / 1000.0)
}

/// Formats a range of numbers rounded to a tenth, for example "20–50"; if both ends are equal, one
/// number, for example "20".
pub(super) fn number_range(low: f64, high: f64) -> String {
    let short = |value: f64| format!("{}", (value * 10.0).round() / 10.0);
    let (low, high) = (short(low), short(high));
    match low == high {
        true => low,
        false => format!("{low}–{high}"),
    }
}

/// Formats a number with at least three significant digits, for example "9.53" or "104".
pub(super) fn three_digits(value: f64) -> String {
    let decimals = match value.abs() {
        v if v < 9.995 => 2,
        v if v < 99.95 => 1,
        _ => 0,
    };
    format!("{value:.decimals$}")
}

/// Headings of columns that contain text; these columns are aligned to the left.
const WORDS: [&str; 3] = ["Source", "Event", "Channel name"];

/// Returns a table with these rows and a note below it; an empty text without rows.
fn table<'a>(heads: impl Iterator<Item = &'a str>, rows: &Html, note: &str) -> Html {
    match (rows.is_empty(), note) {
        (true, _) => Html::default(),
        (_, "") => headed(heads, rows),
        _ => headed(heads, rows) + html!("<p class=\"note\">{}</p>\n", note),
    }
}

/// Returns a table with a heading line and these rows, even if there are no rows.
pub(super) fn headed<'a>(heads: impl Iterator<Item = &'a str>, rows: &Html) -> Html {
    let head = |name: &str| match WORDS.contains(&name) {
        true => html!("<th class=\"words\">{}</th>", name),
        false => html!("<th>{}</th>", name),
    };
    let heads: Html = heads.map(head).collect();
    html!(
        "<table><thead><tr>{}</tr></thead><tbody>\n{}</tbody></table>\n",
        heads,
        rows
    )
}

/// Returns a table row. `name` is the heading of the row in its first cell.
fn row(name: &str, cells: impl IntoIterator<Item = impl Into<Html>>) -> Html {
    let cells = cells.into_iter().map(Into::<Html>::into);
    let cells: Html = cells.map(|cell| html!("<td>{}</td>", cell)).collect();
    html!("<tr><th scope=\"row\">{}</th>{}</tr>\n", name, cells)
}

/// Returns text as bold markup.
fn bold(text: &str) -> Html {
    html!("<b>{}</b>", text)
}

/// Formats a range of time, s, with its unit.
fn span(from_s: f64, to_s: f64) -> String {
    format!("{}–{} s", seconds(from_s), seconds(to_s))
}

/// Returns a table of all hits of a virtual wall; an empty text without hits.
pub(super) fn hits_table(trials: &[Trial]) -> Html {
    let contacts = trials.iter().flat_map(|trial| {
        wall_contacts(trial)
            .into_iter()
            .map(move |hit| (trial, hit))
    });
    let rows = contacts.map(|(trial, hit)| {
        let cells = [
            span(hit.at_s, hit.at_s + hit.for_s).into(),
            format!("{:.0} °/s", hit.speed_deg_per_s).into(),
            bold(&degrees(hit.deepest_deg)),
            hit.turns.to_string().into(),
            degrees(hit.late_swing_deg).into(),
            degrees(hit.late_depth_deg).into(),
        ];
        row(&trial.name, cells)
    });
    table(
        "Trial|Contact|Approach|Deepest|Reversals|Late swing|Late depth".split('|'),
        &rows.collect(),
        "Depths are measured from the surface of the wall: positive inside it, negative in front \
         of it. Late swing and late depth are taken in the third quarter of a contact.",
    )
}

/// Returns a table of the tracking errors of each trial that controlled a joint; an empty text if
/// there is none.
pub(super) fn metrics_table(trials: &[Trial]) -> Html {
    let rows = trials
        .iter()
        .filter(|trial| trial.joint)
        .map(|trial| match metrics(trial) {
            Some(m) => row(&trial.name, metric_cells(&m)),
            None => html!(
                "<tr><th scope=\"row\">{}</th><td colspan=\"8\">no samples</td></tr>\n",
                trial.name
            ),
        });
    table(
        "Trial|Window|RMSE|RMSE, true angle|Mean error|Largest error|Lag|Limiting|Samples"
            .split('|'),
        &rows.collect(),
        "Errors are measured angle minus reference within the window; mean and largest error are \
         absolute values. Limiting: share of samples in which a computed amplitude was held at the \
         wearer's limit.",
    )
}

/// Returns a table of how well predicted forces followed wanted forces; an empty text without force
/// control.
pub(super) fn force_table(trials: &[Trial]) -> Html {
    let metrics = trials
        .iter()
        .flat_map(|trial| force_metrics(trial).into_iter().map(move |m| (trial, m)));
    let rows = metrics.map(|(trial, m)| {
        let cells = [
            m.channel.to_string().into(),
            span(m.from_s, m.to_s).into(),
            bold(&newtons(m.rmse_n)),
            newtons(m.max_abs_n).into(),
            newtons(m.peak_n).into(),
            m.gap.map_or("–".into(), |gap| {
                let (below, above) = (gap.below_n, newtons(gap.above_n));
                format!("{:.0} %: {below} or {above}", gap.share * 100.0).into()
            }),
            m.samples.to_string().into(),
        ];
        row(&trial.name, cells)
    });
    table(
        "Trial|Channel|Window|RMSE|Largest error|Largest reference|Gap|Samples".split('|'),
        &rows.collect(),
        "Errors of the force that the muscle model predicts; no force is measured. Gap: share of \
         the samples in which the limits allowed no force between these two. The reference lay \
         between them, and the nearer of the two was produced.",
    )
}

/// Returns the model level with which each muscle of a trial began, for example "calcium-force
/// (channels 1, 3), none (channel 2)"; `None` without muscles, or in a record without model levels.
pub(super) fn models_in_words(trial: &Trial) -> Option<String> {
    let mut groups: Vec<(&str, Vec<String>)> = Vec::new();
    for channel in &trial.channels {
        let (Some(model), number) = (&channel.model, channel.number.to_string()) else {
            continue;
        };
        match groups.iter_mut().find(|(name, _)| name == model) {
            Some((_, numbers)) => numbers.push(number),
            None => groups.push((model, vec![number])),
        }
    }
    let words = groups.iter().map(|(model, numbers)| {
        let plural = if numbers.len() == 1 { "" } else { "s" };
        format!("{model} (channel{plural} {})", numbers.join(", "))
    });
    let words: Vec<String> = words.collect();
    (!words.is_empty()).then(|| words.join(", "))
}

/// Describes the wanted forces that a trial under force control could not produce, one sentence for
/// each reason.
#[must_use]
pub fn force_remarks(trial: &Trial) -> Vec<String> {
    let mut remarks = Vec::new();
    let numbers: Vec<String> = channels_without_prediction(trial)
        .iter()
        .map(u8::to_string)
        .collect();
    if !numbers.is_empty() {
        remarks.push(format!(
            "No muscle model ran on channel {}, so its force was neither predicted nor evaluated.",
            numbers.join(", ")
        ));
    }
    if let Some(share) = force_limiting_share(trial).filter(|&share| share > 0.0) {
        let percent = match 100.0 * share {
            little if little < 0.5 => "less than 1".to_owned(),
            percent => format!("{percent:.0}"),
        };
        remarks.push(format!(
            "Limiting in {percent} % of the samples with a reference force: at least one channel \
             could not produce its reference."
        ));
    }
    remarks
}

/// Returns the remarks that [`force_remarks`] makes on all trials, to be shown below the table of
/// forces.
pub(super) fn force_notes(trials: &[Trial]) -> Html {
    let remarks = trials.iter().flat_map(|trial| {
        force_remarks(trial)
            .into_iter()
            .map(move |force_remark| (trial, force_remark))
    });
    remarks
        .map(|(trial, remark)| html!("<p class=\"note\">{}: {}</p>\n", trial.name, remark))
        .collect()
}

fn metric_cells(m: &Metrics) -> [Html; 8] {
    let lag = |lag: f64| format!("{:.0} ms", lag * 1e3);
    [
        span(m.from_s, m.to_s).into(),
        bold(&degrees(m.rmse_deg)),
        m.rmse_true_deg.map_or("–".to_owned(), degrees).into(),
        degrees(m.mean_abs_deg).into(),
        degrees(m.max_abs_deg).into(),
        m.lag_s.map_or("–".to_owned(), lag).into(),
        format!("{:.0} %", m.limiting_share * 100.0).into(),
        m.samples.to_string().into(),
    ]
}

/// Returns a table that compares this run with a paper, one row for each of the paper's rows; an
/// empty text without any.
pub(super) fn paper_table(trials: &[Trial], paper: &[PaperRow]) -> Html {
    let mut rows = Html::default();
    for trial in trials {
        let own: Vec<_> = paper.iter().filter(|row| row.trial == trial.name).collect();
        if own.is_empty() {
            continue;
        }
        let here = metrics_without_lag(trial).map_or("–".to_owned(), |m| degrees(m.rmse_deg));
        for (position, row) in own.iter().enumerate() {
            let mut group = Html::default();
            if position == 0 {
                let (span, name) = (own.len(), &trial.name);
                group = html!("<th scope=\"rowgroup\" rowspan=\"{}\">{}</th>", span, name)
                    + html!("<td rowspan=\"{}\"><b>{}</b></td>", span, here);
            }
            let values: Vec<_> = row.values.iter().map(|value| degrees(*value)).collect();
            let mean = row.mean().map_or("–".to_owned(), degrees);
            rows += html!(
                "<tr>{}<td>{}</td><td>{}</td><td class=\"words\">{}</td></tr>\n",
                group,
                values.join(" · "),
                mean,
                row.source
            );
        }
    }
    table(
        "Trial|RMSE here|Paper's trials|Paper's mean|Source".split('|'),
        &rows,
        "",
    )
}

/// Returns a table with the device's counters, one column for each trial; an empty text without
/// counters.
pub(super) fn counter_table(trials: &[Trial]) -> Html {
    let mut names: Vec<&str> = Vec::new();
    for (name, _) in trials.iter().flat_map(|trial| &trial.counters) {
        if !names.contains(&name.as_str()) {
            names.push(name);
        }
    }
    let played = |trial: &Trial| trial.pulses.map_or("–".to_owned(), |n| n.to_string());
    let played = trials
        .iter()
        .any(|trial| trial.pulses.is_some())
        .then(|| row("pulses", trials.iter().map(played)));
    let rows = played.into_iter().chain(names.into_iter().map(|name| {
        let value = |trial: &Trial| {
            let found = trial.counters.iter().find(|(own, _)| own == name);
            found.map_or("–".to_owned(), |(_, value)| value.to_string())
        };
        row(name, trials.iter().map(value))
    }));
    let heads = trials.iter().map(|trial| trial.name.as_str());
    let heads = std::iter::once("Counter").chain(heads);
    table(
        heads,
        &rows.collect(),
        "“pulses” counts the pulses of the session with an amplitude above 0, as in every other \
         table. “pulses started” is the device's own count, which includes pulses of amplitude 0 \
         and those of the electrode check.",
    )
}

/// Returns a table of the readings of the electrode check; an empty text without readings.
pub(super) fn electrode_table(trials: &[Trial]) -> Html {
    let mut rows = Html::default();
    for trial in trials {
        for reading in &trial.electrode_check {
            let channel = trial.channels.iter().find(|c| c.number == reading.channel);
            let unit = channel.map_or("", |channel| &channel.unit);
            let load = |ohm: f64| format!("{} kΩ", three_digits(ohm * 1e-3));
            let cells = [
                reading.channel.to_string(),
                format!("{:.1} {unit}", reading.applied),
                format!("{:.2} mA", reading.current_ma),
                reading.load_ohm.map_or("–".to_owned(), load),
            ];
            rows += row(&trial.name, cells);
        }
    }
    table(
        "Electrodes at arming|Channel|Applied|Current|Load".split('|'),
        &rows,
        "",
    )
}

/// Returns a table of the events of all trials with their times; an empty text without events.
pub(super) fn event_table(trials: &[Trial]) -> Html {
    let mut rows = Html::default();
    for trial in trials {
        for (t_s, event) in &trial.events {
            rows += html!(
                "<tr><th scope=\"row\">{}</th><td>{}</td><td class=\"words\">{}</td></tr>\n",
                trial.name,
                format!("{t_s:.3} s"),
                event
            );
        }
    }
    table("Trial|Time|Event".split('|'), &rows, "")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::ChannelInfo;

    #[test]
    fn models_are_told_by_channel() {
        let channel = |(number, model): (u8, Option<&str>)| ChannelInfo {
            number,
            name: String::new(),
            unit: "mA".to_owned(),
            limit: 10.0,
            live_width: false,
            muscle: true,
            model: model.map(str::to_owned),
            force: false,
            line: false,
            joint: None,
        };
        let wording = |models: &[(u8, Option<&str>)]| {
            models_in_words(&Trial {
                channels: models.iter().copied().map(channel).collect(),
                ..Trial::default()
            })
        };
        let three = [
            (1, Some("calcium-force")),
            (2, Some("none")),
            (3, Some("calcium-force")),
        ];
        let words = "calcium-force (channels 1, 3), none (channel 2)";
        assert_eq!(wording(&three).as_deref(), Some(words));
        assert_eq!(wording(&[(1, None)]), None);
    }

    #[test]
    fn numbers_carry_three_digits() {
        assert_eq!(degrees(8.4), "8.40°");
        assert_eq!(degrees(9.996), "10.0°");
        assert_eq!(degrees(19.04), "19.0°");
        assert_eq!(degrees(104.6), "105°");
        assert_eq!(seconds(10.0), "10");
        assert_eq!(seconds(0.25), "0.25");
    }
}
