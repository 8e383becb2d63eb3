//! What came out, in a sentence.

use super::grid::is_large;
use crate::laboratory::claims::{Share, Verdict};
use crate::laboratory::result::Outcome;
use std::collections::BTreeMap;

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
    let is_held = |share: &Share| share.paper.is_some();
    if outcome.declared.draws == 0 && outcome.shares.iter().any(is_held) {
        return of_trials(outcome);
    }
    if order.is_empty() && outcome.shares.iter().any(is_held) {
        return "None of the paper's claims could be judged: nobody has the numbers.".to_owned();
    }
    if order.is_empty() {
        return "Nothing here is held against a paper.".to_owned();
    }
    let list = |what: &str, claims: &[String]| match claims {
        [] => String::new(),
        // Its table says so in its last line.
        _ if is_large(outcome) => String::new(),
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

/// Of trials alone, which are too few for *most*.
fn of_trials(outcome: &Outcome) -> String {
    let as_printed = |share: &Share| match share.paper {
        Some(true) => Some((share.holds, share.of)),
        Some(false) => Some((share.of - share.holds, share.of)),
        None => None,
    };
    let all: Vec<(u64, u64)> = outcome.shares.iter().filter_map(as_printed).collect();
    let count = |is: fn(&(u64, u64)) -> bool| all.iter().filter(|it| is(it)).count();
    let (every, none, unknown) = (
        count(|(like, of)| *of > 0 && like == of),
        count(|(like, of)| *of > 0 && *like == 0),
        count(|(_, of)| *of == 0),
    );
    let some = all.len() - every - none - unknown;
    let unknown = match unknown {
        0 => String::new(),
        n => format!("; {n} could not be judged"),
    };
    format!(
        "Of the paper's {} claims {every} come out in every case of these trials, {some} in some, \
         {none} in none{unknown}. No wearer was drawn: nothing is said of others.",
        all.len()
    )
}
