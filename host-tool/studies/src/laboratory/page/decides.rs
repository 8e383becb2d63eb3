//! The page's section about the parameters that decide each claim.

use super::tables::table;
use crate::laboratory::decides::{DecidingClaim, Field, LEAST_WEARERS};
use crate::laboratory::numbers::digits;
use crate::laboratory::result::Outcome;
use host_core::html;
use host_core::report::Html;

/// Returns the section: an explanation and a table. Empty if no wearers were generated at random.
pub(super) fn section(outcome: &Outcome) -> Html {
    let rows: Html = outcome.decides.iter().map(rows_of).collect();
    let heads = [
        "Claim",
        "Random field",
        "Median where it holds",
        "Median where it does not",
        "Superiority",
        "p (Holm)",
        "Holds in lower, middle, upper third",
    ];
    match table(&heads, rows) {
        empty if empty.is_empty() => empty,
        table => html!("<p>{}</p>\n{}", meaning(), table),
    }
}

fn meaning() -> String {
    format!(
        "Randomly drawn fields that differ between the wearers in whom a claim holds and those in \
         whom it does not (Mann-Whitney test; p below 0.05 after Holm's correction for all fields \
         of a claim); the strongest first. Each wearer counts once: a claim holds in a wearer if \
         it holds in at least half of the wearer's cases. Superiority: the probability that a \
         wearer in whom the claim holds has a larger value than one in whom it does not; ½ means \
         no difference. Last column: the share of wearers in whom the claim holds, for each third \
         of the field. Nothing is concluded from fewer than {LEAST_WEARERS} wearers on either \
         side. Each field is tested alone."
    )
}

fn rows_of(claim: &DecidingClaim) -> Html {
    let total = claim.holds + claim.fails;
    let name = html!(
        "<th scope=\"row\">{}: {} of {} wearers</th>",
        claim.claim,
        claim.holds,
        total
    );
    let mut fields: Vec<&Field> = claim.fields.iter().filter(|field| field.decides).collect();
    let strength = |field: &Field| (field.superiority - 0.5).abs();
    fields.sort_by(|a, b| strength(b).total_cmp(&strength(a)));
    let conclusion = match () {
        () if !claim.enough => "too few wearers on one side: no conclusion",
        () if fields.is_empty() => "no field was found that decides it",
        () => {
            let rows = fields.iter().enumerate();
            let other = html!("<th></th>");
            let rows = rows.map(|(nth, field)| row(if nth == 0 { &name } else { &other }, field));
            return rows.collect();
        }
    };
    html!("<tr>{}<td colspan=\"6\">{}</td></tr>\n", name, conclusion)
}

fn row(name: &Html, field: &Field) -> Html {
    let p = match field.p_holm {
        small if small < 1e-4 => "< 0.0001".to_owned(),
        p => format!("{p:.4}"),
    };
    let thirds = field
        .thirds
        .map(|share| format!("{:.1}", 100.0 * share))
        .join(", ");
    let cells = [
        field.field.clone(),
        digits(field.holds),
        digits(field.fails),
        format!("{:.2}", field.superiority),
        p,
        format!("{thirds} %"),
    ];
    let cells: Html = cells
        .iter()
        .map(|cell| html!("<td>{}</td>", cell))
        .collect();
    html!("<tr>{}{}</tr>\n", name, cells)
}
