//! The page's section about the parameters that decide each claim.

use super::tables::table;
use crate::laboratory::decides::{DecidingClaim, Field, LEAST_WEARERS};
use crate::laboratory::numbers::digits;
use crate::laboratory::result::Outcome;
use host_core::html;
use host_core::report::Html;

/// Returns an explanation and a table; empty if no wearers were generated at random.
pub(super) fn section(outcome: &Outcome) -> Html {
    let rows: Html = outcome.decides.iter().map(rows_of).collect();
    let heads = [
        "Claim",
        "Drawn field",
        "Median where it holds",
        "where not",
        "Superiority",
        "p (Holm)",
        "Holds among the least, middling, most",
    ];
    match table(&heads, rows) {
        empty if empty.is_empty() => empty,
        table => html!("<p>{}</p>\n{}", meaning(), table),
    }
}

fn meaning() -> String {
    format!(
        "Drawn numbers that differ between the wearers in whom a claim holds and those in whom it \
         does not (Mann and Whitney, p corrected by Holm for all fields of a claim, below 0.05); \
         the strongest first. A wearer counts once: it holds in one where it holds in at least \
         half of the cases. Superiority: how probably one of the former has more of it than one \
         of the latter, ½ is no difference. Last: shares of wearers in whom the claim holds, by \
         thirds of the field. Nothing is concluded of fewer than {LEAST_WEARERS} wearers on \
         either side. Each field is looked at alone."
    )
}

fn rows_of(claim: &DecidingClaim) -> Html {
    let all = claim.holds + claim.fails;
    let name = html!(
        "<th scope=\"row\">{}: {} of {} wearers</th>",
        claim.claim,
        claim.holds,
        all
    );
    let mut fields: Vec<&Field> = claim.fields.iter().filter(|field| field.decides).collect();
    let strength = |field: &Field| (field.superiority - 0.5).abs();
    fields.sort_by(|a, b| strength(b).total_cmp(&strength(a)));
    let said = match () {
        () if !claim.enough => "too few wearers on one side: nothing concluded",
        () if fields.is_empty() => "no field found to decide it",
        () => {
            let rows = fields.iter().enumerate();
            let other = html!("<th></th>");
            let rows = rows.map(|(nth, field)| row(if nth == 0 { &name } else { &other }, field));
            return rows.collect();
        }
    };
    html!("<tr>{}<td colspan=\"6\">{}</td></tr>\n", name, said)
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
