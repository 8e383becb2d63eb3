//! The output of channels in numbers, as a table of a page and as cells for other tables.

use super::Html;
use super::tables::{headed, number_range, three_digits};
use crate::analysis::{ChannelDose, doses};
use crate::html;
use crate::record::Trial;

/// Headings of the cells that [`cells`] returns, with units.
pub(super) const HEADS: [&str; 8] = [
    "peak",
    "µC/phase",
    "charge µC",
    "rms mA",
    "on-time s",
    "pulses",
    "width µs",
    "rate Hz",
];

/// Explanation of the columns, shown below a table of doses.
pub(super) const NOTE: &str = "Computed from the record; current is not measured during \
     stimulation. Charge is the sum over all pulses: − in cathodic phases, + in anodic phases, \
     ± the same in both. Rms is taken over the whole trial. A channel counts as on while each \
     burst follows the previous one within a period. Charge and rms of a voltage stage are \
     computed with the load that the session file gives.";

const UNKNOWN: &str = "–";

/// Formats the dose of a channel as the cells of a table row, in the order of [`HEADS`].
pub(super) fn cells(dose: &ChannelDose) -> [String; 8] {
    let known = |value: Option<f64>| value.map_or_else(|| UNKNOWN.to_owned(), three_digits);
    let range = |range: Option<(f64, f64)>| {
        let ends = |(low, high)| number_range(low, high);
        range.map_or_else(|| UNKNOWN.to_owned(), ends)
    };
    [
        format!("{} {}", three_digits(dose.peak), dose.unit),
        known(dose.charge_per_phase_uc),
        charge(dose),
        known(dose.rms_ma),
        dose.on_time_s
            .map_or_else(|| UNKNOWN.to_owned(), |on_s| format!("{on_s:.2}")),
        dose.pulses
            .map_or_else(|| UNKNOWN.to_owned(), |count| count.to_string()),
        range(dose.width_us),
        range(dose.frequency_hz),
    ]
}

/// Formats the larger of cathodic and anodic charge. The sign is − if all charge was cathodic, + if
/// all was anodic, and ± if both were delivered.
fn charge(dose: &ChannelDose) -> String {
    let (Some(cathodic), Some(anodic)) = (dose.cathodic_uc, dose.anodic_uc) else {
        return UNKNOWN.to_owned();
    };
    let most = three_digits(cathodic.max(anodic));
    match (cathodic > 0.0, anodic > 0.0) {
        (false, false) => "0".to_owned(),
        (true, false) => format!("−{most}"),
        (false, true) => format!("+{most}"),
        (true, true) => format!("±{most}"),
    }
}

/// Formats the number and the name of a channel as one text.
pub(super) fn channel(dose: &ChannelDose) -> String {
    format!("{} {}", dose.channel, dose.name)
}

/// Returns a table with the dose of each channel of each trial in a row; an empty text without
/// channels.
pub(super) fn dose_table(trials: &[Trial]) -> Html {
    let is_single = trials.len() == 1;
    let mut rows = Html::default();
    for trial in trials {
        for dose in doses(trial) {
            let cells = cells(&dose).map(|cell| html!("<td>{}</td>", cell));
            let name = channel(&dose);
            rows += match is_single {
                true => html!("<tr><th scope=\"row\">{}</th>", name),
                false => html!(
                    "<tr><th scope=\"row\">{}</th><td class=\"words\">{}</td>",
                    trial.name,
                    name
                ),
            };
            rows += html!("{}</tr>\n", cells.into_iter().collect::<Html>());
        }
    }
    if rows.is_empty() {
        return rows;
    }
    let first: &[&str] = match is_single {
        true => &["Channel"],
        false => &["Trial", "Channel name"],
    };
    let heads = first.iter().copied().chain(HEADS);
    headed(heads, &rows) + html!("<p class=\"note\">{}</p>\n", NOTE)
}
