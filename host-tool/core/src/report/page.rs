//! The HTML page: the result first, then the figures, then background information.

use super::doses::dose_table;
use super::overview::arm_figure;
use super::tables::{
    counter_table, degrees, electrode_table, event_table, force_notes, force_remarks, force_table,
    hits_table, metrics_table, models_in_words, newtons, paper_table, seconds,
};
use super::{Html, Report, bars, edges, hand, lanes, trajectory};
use crate::analysis::{
    Metrics, channels_without_prediction, force_metrics, metrics_without_lag, wall_contacts,
};
use crate::html;
use crate::plot::Svg;
use crate::record::{Assumption, Role, Run, Sample, Trial};

/// Returns the report as one HTML document of about 50 kB per trial. It needs no other file,
/// contains no script and sends no request.
pub fn page(report: &Report) -> String {
    let run = report.run;
    let explained = run.explained.iter();
    let explained = explained.map(|text| html!("<p class=\"lead\">{}</p>\n", text));
    let mut out: Html = explained.collect();
    out += html!("<p class=\"result\">{}</p>\n", headline(run));
    if !run.explained.is_empty() {
        out += html!(
            "<div class=\"arm\">{}</div>\n",
            figure(&arm_figure(&run.trials), "")
        );
    }
    out += figure(&trajectory::figure(&run.trials), "");
    out += figure(&hand::figure(&run.trials), "");
    if is_open_loop(run) {
        out += amplitudes(run) + dose_table(&run.trials);
    }
    out += html!("<p class=\"facts\">{}</p>\n", facts(run));

    let tables = metrics_table(&run.trials)
        + hits_table(&run.trials)
        + force_table(&run.trials)
        + force_notes(&run.trials);
    let log = counter_table(&run.trials) + electrode_table(&run.trials) + event_table(&run.trials);
    for (title, body) in [
        ("Result", tables),
        ("Stimulation", stimulation(run)),
        ("Edges of one period", periods(run)),
        ("Comparison with the paper", comparison(report)),
        ("Assumptions and outcomes", assumptions(report.assumptions)),
        ("Counters and events", log),
        ("How to reproduce", reproduce(report)),
    ] {
        if !body.is_empty() {
            out += html!("<section><h2>{}</h2>\n{}</section>\n", title, body);
        }
    }
    document(&run.title, &out)
}

/// Content security policy of a page. A browser applies the page's own style, but runs no script
/// and sends no request, even if a record contains malicious text.
const POLICY: &str =
    "default-src 'none'; style-src 'unsafe-inline'; base-uri 'none'; form-action 'none'";

/// Returns an HTML document with the style of all pages. `title` is plain text.
#[must_use]
pub fn document(title: &str, body: &Html) -> String {
    let (style, figures) = (include_str!("page.css"), crate::plot::ink::style());
    let (title, body) = (Html::text(title), body.as_str());
    let title = title.as_str();
    format!(
        "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\
         <meta http-equiv=\"Content-Security-Policy\" content=\"{POLICY}\">\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\
         <meta name=\"color-scheme\" content=\"light dark\">\
         <title>{title}</title><style>{style}{figures}</style></head><body><main>\n\
         <h1>{title}</h1>\n{body}</main></body></html>\n"
    )
}

/// Returns the first line of the page: warnings about a damaged or incomplete record, trials in
/// which no pulses were output, and then the result.
fn headline(run: &Run) -> String {
    let silent = |trial: &Trial| Some((capitalised(&trial.name), trial.silent.clone()?));
    let silent: Vec<_> = run.trials.iter().filter_map(silent).collect();
    let warnings = silent
        .iter()
        .map(|(name, why)| format!("{name}: no pulses were output: {why}."));
    let mut sentences: Vec<String> = run.caveat().into_iter().chain(warnings).collect();
    // Without stimulation there is nothing to assess.
    if silent.is_empty() || silent.len() < run.trials.len() {
        sentences.push(run.finding.clone().unwrap_or_else(|| result(run)));
    }
    sentences.join(" ")
}

/// Describes the main result of the run in one sentence.
fn result(run: &Run) -> String {
    let judged = run.trials.iter();
    let judged =
        judged.filter_map(|trial| Some((trial.name.as_str(), metrics_without_lag(trial)?)));
    let mut judged: Vec<(&str, Metrics)> = judged.collect();
    judged.sort_by(|a, b| a.1.rmse_deg.total_cmp(&b.1.rmse_deg));
    let Some(((name, best), others)) = judged.split_first() else {
        if run.trials.iter().all(|trial| trial.samples.is_empty()) {
            return "No samples were recorded.".to_owned();
        }
        let other = wall_result(run).or_else(|| force_result(run));
        let other = other.or_else(|| unpredicted_result(run));
        let other = other.or_else(|| hand::hand_result(run));
        return other.unwrap_or_else(|| no_result_reason(run).to_owned());
    };
    let window = format!("{}–{} s", seconds(best.from_s), seconds(best.to_s));
    let rmse = degrees(best.rmse_deg);
    let name = capitalised(name);
    let (count, others) = (judged.len(), others.iter());
    let others: Vec<String> = others
        .map(|(name, m)| format!("{} ({name})", degrees(m.rmse_deg)))
        .collect();
    match others.as_slice() {
        [] => {
            format!("{name}: the joint followed its reference with RMSE {rmse} over {window}.")
        }
        [.., last] if count > 4 => format!(
            "{name} had the lowest RMSE of {count} trials, {rmse} over {window}; the highest was \
             {last}."
        ),
        all => format!(
            "{name} had the lowest RMSE, {rmse} over {window}, compared with {}.",
            all.join(" and ")
        ),
    }
}

/// Returns a sentence that explains why there is no result.
fn no_result_reason(run: &Run) -> &'static str {
    if run.trials.iter().any(Trial::has_reference) {
        "Nothing was recorded in the time window that is evaluated."
    } else {
        "Open loop: the session has no reference to follow."
    }
}

/// Describes how well the wanted forces were followed, by the channel with the largest RMSE; `None`
/// without force control.
fn force_result(run: &Run) -> Option<String> {
    let pairs = run.trials.iter().flat_map(|trial| {
        let own = force_metrics(trial).into_iter();
        own.map(move |m| (trial, m))
    });
    let trial_metrics: Vec<_> = pairs.collect();
    let (trial, m) = trial_metrics
        .iter()
        .max_by(|a, b| a.1.rmse_n.total_cmp(&b.1.rmse_n))?;
    let remarks = force_remarks(trial).into_iter();
    let remarks: String = remarks.map(|remark| format!(" {remark}")).collect();
    let which = match trial_metrics.len() {
        1 => String::new(),
        count => format!(" of channel {}, the least accurate of {count},", m.channel),
    };
    Some(format!(
        "{}: the predicted force{which} followed the reference with an RMSE of {} over {}–{} s. \
         No force was measured.{remarks}",
        capitalised(&trial.name),
        newtons(m.rmse_n),
        seconds(m.from_s),
        seconds(m.to_s),
    ))
}

/// Names the channels of the first trial for which forces were wanted but no muscle model ran;
/// `None` if there is no such trial.
fn unpredicted_result(run: &Run) -> Option<String> {
    let mut trials = run.trials.iter();
    let trial = trials.find(|trial| !channels_without_prediction(trial).is_empty())?;
    let remarks = force_remarks(trial).join(" ");
    Some(format!("{}: {remarks}", capitalised(&trial.name)))
}

/// Describes the hits of a virtual wall; `None` if no trial has a wall.
fn wall_result(run: &Run) -> Option<String> {
    let depths = run.trials.iter().filter_map(|trial| {
        let deepest = wall_contacts(trial).into_iter().map(|hit| hit.deepest_deg);
        Some((trial.name.as_str(), deepest.reduce(f64::max)?))
    });
    let mut depths: Vec<(&str, f64)> = depths.collect();
    depths.sort_by(|a, b| a.1.total_cmp(&b.1));
    let [(name, least), others @ ..] = depths.as_slice() else {
        let wall = run.trials.iter().any(|trial| trial.wall.is_some());
        return wall.then(|| "The virtual wall was not touched.".to_owned());
    };
    let (name, least) = (capitalised(name), depth(*least));
    Some(match others.last() {
        None => format!("{name}: greatest depth {least}."),
        Some((other, most)) => format!(
            "{name}: greatest depth {least}, the smallest of {} trials; the largest was {} \
             ({other}).",
            depths.len(),
            depth(*most)
        ),
    })
}

fn depth(deg: f64) -> String {
    if deg > 0.0 {
        format!("{} inside the wall", degrees(deg))
    } else {
        format!("{} in front of the wall", degrees(-deg))
    }
}

fn capitalised(name: &str) -> String {
    let mut letters = name.chars();
    let first = letters
        .next()
        .map(|letter| letter.to_uppercase().to_string());
    first.unwrap_or_default() + letters.as_str()
}

/// Returns one line for below the main figure that says where the numbers come from: device, seed,
/// speed and muscle models.
fn facts(run: &Run) -> Html {
    let mut facts = html!(
        "Device: {} · seed {}",
        run.device_in_words(),
        run.seed_in_words()
    );
    if let Some(factor) = run.host.speed_factor {
        facts += format!(" · {factor:.0} × real time").into();
    }
    let models = run.trials.iter().filter_map(models_in_words);
    let mut models: Vec<String> = models.collect();
    models.dedup();
    if !models.is_empty() {
        facts += html!(" · muscle model at the start: {}", models.join("; "));
    }
    if run.is_simulated() {
        facts += html!(" · <b>Simulated wearer: no evidence about people.</b>");
    }
    facts
}

/// Returns a figure with a caption, which is plain text; an empty text for an empty figure.
#[must_use]
pub fn figure(svg: &Svg, caption: &str) -> Html {
    match (svg.is_empty(), caption) {
        (true, _) => Html::default(),
        (_, "") => html!("<figure>{}</figure>\n", svg),
        _ => html!(
            "<figure>{}<figcaption>{}</figcaption></figure>\n",
            svg,
            caption
        ),
    }
}

/// Returns the caption of the figure of forces, which depends on whether a muscle model ran.
fn forces_caption(run: &Run) -> &'static str {
    let has_force = |sample: &Sample| sample.forces_n.iter().any(Option::is_some);
    let mut trials = run.trials.iter();
    if trials.any(|trial| trial.samples.map_each(has_force).any(|has| has)) {
        "Force that the device's muscle model predicts from the output pulses. Dark line: \
         reference of each channel under force control."
    } else {
        "No muscle model ran, so no force was predicted. Dark line: reference of each channel \
         under force control."
    }
}

/// Returns whether no trial had a reference to follow. The page then shows the stimulation first.
fn is_open_loop(run: &Run) -> bool {
    !run.trials.iter().any(Trial::has_reference)
}

fn amplitudes(run: &Run) -> Html {
    figure(
        &lanes::amplitudes(&run.trials),
        "Amplitude of the latest burst of every channel. The upper line is the limit of the channel.",
    )
}

fn stimulation(run: &Run) -> Html {
    let put_out = match is_open_loop(run) {
        true => Html::default(), // shown first
        false => amplitudes(run) + dose_table(&run.trials),
    };
    put_out
        + figure(&lanes::forces(&run.trials), forces_caption(run))
        + figure(
            &lanes::rates(&run.trials),
            "Pulse rate that force control sets for each channel.",
        )
}

fn periods(run: &Run) -> Html {
    let drawn = run.trials.iter().map(|trial| {
        let svg = edges::edges_figure(trial, &[]);
        let body = figure(&svg, "");
        if body.is_empty() {
            body
        } else {
            html!("<h3>{}</h3>{}", trial.name, body)
        }
    });
    let drawn: Html = drawn.collect();
    if drawn.is_empty() {
        return drawn;
    }
    // There are many of these figures, so they are printed smaller.
    html!("<div class=\"edges\">\n{}</div>\n", drawn)
}

fn comparison(report: &Report) -> Html {
    let trials = &report.run.trials;
    let table = paper_table(trials, report.paper);
    if table.is_empty() {
        return table;
    }
    let mut text = figure(&bars::figure(trials, report.paper), "") + table;
    if report.run.is_simulated() {
        text += html!(
            "<p class=\"note\">The paper's values come from people, those of this run from a \
             simulated wearer. Agreement shows that the simulation is plausible; it is no \
             evidence about people and does not confirm the paper.</p>\n",
        );
    }
    text
}

fn assumptions(entries: &[Assumption]) -> Html {
    let list = |role: Role, title: &str| {
        let own = entries.iter().filter(|assumption| assumption.role == role);
        let items: Html = own
            .map(|assumption| html!("<li>{}</li>\n", assumption.text))
            .collect();
        if items.is_empty() {
            return items;
        }
        html!("<div><h3>{}</h3><ul>\n{}</ul></div>\n", title, items)
    };
    let lists = list(Role::PutIn, "Assumptions") + list(Role::CameOut, "Outcomes");
    if lists.is_empty() {
        return lists;
    }
    html!("<div class=\"columns\">\n{}</div>\n", lists)
}

fn reproduce(report: &Report) -> Html {
    let run = report.run;
    if run.trials.iter().all(|trial| trial.identity.is_none()) {
        return html!("<p>No device answered, so there is nothing to reproduce.</p>\n");
    }
    let mut text = html!(
        "<pre>{}</pre>\n<p>Seed {}, Flexor {}. The data are beside this page: one folder for \
         each trial with <code>samples.csv</code> and <code>edges.csv</code>, and \
         <code>summary.json</code>.</p>\n",
        report.command,
        run.seed_in_words(),
        env!("CARGO_PKG_VERSION"),
    );
    let files = run
        .trials
        .iter()
        .filter(|trial| !trial.session_file.is_empty());
    let items: Html = files
        .map(|trial| {
            let worn = trial.wearer.as_ref().map(|worn| {
                let (name, evidence) = (&worn.name, &worn.evidence);
                format!(", thresholds and limits of {name} ({evidence})")
            });
            let worn = worn.unwrap_or_default();
            let (name, file) = (&trial.name, &trial.session_file);
            html!("<li>{}: <code>{}</code>{}</li>\n", name, file, worn)
        })
        .collect();
    if !items.is_empty() {
        text += html!("<ul>\n{}</ul>\n", items);
    }
    text
}
