//! Summarises the result of an experiment in a sentence.

use super::grid::is_large;
use crate::laboratory::claims::Verdict;
use crate::laboratory::comparison::comparison;
use crate::laboratory::paper_claims::{ClaimStanding, PaperClaim, paper_claims};
use crate::laboratory::result::Outcome;

/// Returns the summary: the experiment's main comparison, if it has one; then how many of the
/// paper's claims hold in most cases, and which do not. With a grid, a claim must hold at every
/// point.
#[must_use]
pub fn headline(outcome: &Outcome) -> String {
    let compared = comparison(outcome).map(|comparison| comparison.sentence() + " ");
    compared.unwrap_or_default() + &counted(outcome)
}

/// Returns a sentence about how many of the paper's claims hold.
fn counted(outcome: &Outcome) -> String {
    let (claims, _) = paper_claims(outcome);
    let total = claims.len();
    if claims.is_empty() {
        return "This result is not compared with a paper.".to_owned();
    }
    if outcome.declared.draws == 0 {
        return trials_summary(&claims);
    }
    let summaries = |wanted: ClaimStanding| -> Vec<String> {
        let own = claims
            .iter()
            .filter(|paper_claim| paper_claim.standing() == wanted);
        own.map(|paper_claim| claim_summary(paper_claim, outcome.is_grid()))
            .collect()
    };
    let lists = [
        ClaimStanding::Judged(Verdict::Undecided),
        ClaimStanding::Judged(Verdict::Unlike),
        ClaimStanding::Single,
        ClaimStanding::Unjudged,
    ];
    let lists = lists.map(|standing| match summaries(standing).as_slice() {
        [] => String::new(),
        // On a large grid, the last line of the table shows this.
        _ if is_large(outcome) => String::new(),
        all => format!("; {}: {}", standing.in_words(), all.join("; ")),
    });
    let like = summaries(ClaimStanding::Judged(Verdict::Like)).len();
    let grid = match outcome.is_grid() {
        true => " at every point of the grid",
        false => "",
    };
    format!(
        "{} in most cases{grid}{}.",
        agreement(like, total),
        lists.concat()
    )
}

/// Returns a phrase, for example "The result agrees with 1 of the paper's 3 claims".
fn agreement(like: usize, total: usize) -> String {
    let claims = if total == 1 { "claim" } else { "claims" };
    format!("The result agrees with {like} of the paper's {total} {claims}")
}

/// Returns a claim with its share, or with the number of its parts that agree with the paper.
fn claim_summary(claim: &PaperClaim<'_>, is_grid: bool) -> String {
    match claim.parts.as_slice() {
        [one] => format!("{} ({})", claim.says, one.percent()),
        [first, rest @ ..] if is_grid && rest.iter().all(|share| share.id == first.id) => {
            let points = claim.parts.len();
            format!(
                "{} (agrees at {} of {points} points)",
                claim.says,
                claim.counts().0
            )
        }
        _ => format!("{} ({})", claim.says, claim.counts_in_words()),
    }
}

/// Summarises a result that consists of a few trials only, which do not justify the word *most*.
fn trials_summary(claims: &[PaperClaim<'_>]) -> String {
    // Cases that agree with the paper, and all cases, of the parts that are judged.
    let as_printed = |claim: &PaperClaim<'_>| {
        let parts = claim.parts.iter();
        parts.fold((0, 0), |(like, total), share| match share.paper {
            Some(false) => (like + share.of - share.holds, total + share.of),
            _ => (like + share.holds, total + share.of),
        })
    };
    let tallies: Vec<(u64, u64)> = claims.iter().map(as_printed).collect();
    let count = |is: fn(&(u64, u64)) -> bool| tallies.iter().filter(|pair| is(pair)).count();
    let (every, none) = (
        count(|(like, total)| *total > 1 && like == total),
        count(|(like, total)| *total > 1 && *like == 0),
    );
    let (single, unknown) = (count(|(_, of)| *of == 1), count(|(_, of)| *of == 0));
    let some = tallies.len() - every - none - single - unknown;
    let rest = [
        (single, "with a single case, not counted"),
        (unknown, "not judged"),
    ];
    let rest = rest.map(|(n, phrase)| match n {
        0 => String::new(),
        n => format!("; {n} {phrase}"),
    });
    format!(
        "{} in every case of these trials, with {some} in some cases and with {none} in no \
         case{}. No wearers were randomly generated, so the result does not extend to others.",
        agreement(every, tallies.len()),
        rest.concat()
    )
}
