//! Shows the pulses of one period as they were emitted.

use super::{Rows, shown};
use host_core::html;
use host_core::record::{State, Trial};
use host_core::report::{Html, edges_figure, figure};

/// Returns the pulse pattern of a trial: time, µs, channel and new state of each edge in the
/// recorded period. Amplitudes are left out.
fn pattern(trial: &Trial) -> impl Iterator<Item = (u64, u8, State)> {
    let edges = trial.edges.iter();
    edges.map(|edge| (edge.t_us, edge.channel, edge.state))
}

/// Returns one drawing for each distinct pulse pattern, with the conditions that have it; if no
/// edges were recorded, the reason.
pub(super) fn section(rows: &Rows<'_>) -> Html {
    let mut patterns: Vec<Vec<&Trial>> = Vec::new();
    let (mut silent, mut unseen) = (Vec::new(), Vec::new());
    for (_, trial) in shown(rows) {
        let is_simulated = trial
            .identity
            .as_ref()
            .is_some_and(|identity| identity.simulated);
        let known = patterns.iter_mut().find(|alike| {
            let first = alike.first().into_iter().flat_map(|trial| pattern(trial));
            first.eq(pattern(trial))
        });
        match (trial.edges.is_empty(), known) {
            (false, Some(alike)) => alike.push(trial),
            (false, None) => patterns.push(vec![trial]),
            (true, _) if is_simulated => silent.push(trial),
            (true, _) => unseen.push(trial),
        }
    }
    let note = |title: &str, trials: &[&Trial]| match trials {
        [] => Html::default(),
        all => html!("<p class=\"note\">{}: {}.</p>\n", title, names(all)),
    };
    let drawn: Html = patterns.iter().map(|alike| drawing(alike)).collect();
    let drawn = match drawn.is_empty() {
        true => drawn,
        false => html!("<div class=\"edges\">\n{}</div>\n", drawn),
    };
    if rows.is_empty() {
        return html!(
            "<p class=\"note\">No trial was recorded here, so the pulses are unknown; \
                <code>flexor experiment</code> records trials.</p>\n"
        );
    }
    drawn
        + note("No pulse after the middle of the trial", &silent)
        + note(
            "The outputs were not recorded, because boards do not report them",
            &unseen,
        )
}

fn drawing(alike: &[&Trial]) -> Html {
    let Some((first, others)) = alike.split_first() else {
        return Html::default();
    };
    let more = match others {
        [] => String::new(),
        others => format!(
            " The same edges, with other amplitudes, in: {}.",
            names(others)
        ),
    };
    let caption = format!(
        "One period: the first after the middle of the trial in which most channels \
         stimulate.{more}"
    );
    let heading = match others.len() {
        0 => first.name.clone(),
        n => format!("{}, and {n} with the same edges", first.name),
    };
    html!("<h3>{}</h3>\n", heading) + figure(&edges_figure(first, others), &caption)
}

fn names(trials: &[&Trial]) -> String {
    let names: Vec<String> = trials.iter().map(|trial| trial.name.clone()).collect();
    names.join("; ")
}
