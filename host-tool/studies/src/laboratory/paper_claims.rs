//! Groups shares under the paper's claims of which they are parts.
//!
//! A declaration often asks more than the paper claims: the same claim for several participants, at
//! several walls, or for wearers and for whole studies. Grouping these shares lets a page count the
//! claims of the paper.

use super::claims::{Share, Verdict};
use super::result::Outcome;

/// One claim of a paper and the shares that belong to it.
#[derive(Clone, Debug)]
pub struct PaperClaim<'a> {
    /// The claim as a sentence, as the page prints it.
    pub says: &'a str,
    /// Shares of which the claim consists, at all points of a grid.
    pub parts: Vec<&'a Share>,
}

/// Verdict on a paper's claim, combined from all of its parts.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum ClaimStanding {
    /// At least one part counts; contains the worst verdict of all parts that count.
    Judged(Verdict),
    /// Parts could be judged, but none has more than one independent case.
    Single,
    /// No part could be judged.
    Unjudged,
}

/// Rules by which the shares of certain studies are assigned to the paper's claims.
struct Grouping {
    /// Names of the studies to which the rules apply.
    studies: &'static [&'static str],
    /// Wording of each claim, with patterns for the identifiers of its parts; `*` in a pattern
    /// matches any text.
    claims: &'static [(&'static str, &'static [&'static str])],
    /// Patterns for identifiers of shares that belong to no claim of the paper, although the paper
    /// makes their statement.
    beside: &'static [&'static str],
}

/// Grouping rules of the studies that need them. In any other study each share is a claim of its
/// own; shares whose identifiers agree up to a `/` are parts of one claim.
const GROUPINGS: &[Grouping] = &[
    Grouping {
        studies: &["hamana-3"],
        claims: &[("other fingers bend more 4 V above the maximum", &["over-*"])],
        beside: &[],
    },
    Grouping {
        studies: &["hamana-4"],
        claims: &[
            (
                "two points follow better than one",
                &["two-better-than-*", "two-better-*-paper", "table-8-paper"],
            ),
            (
                "one and two points differ (table 9)",
                &["table-9-points-paper"],
            ),
            (
                "participants do not differ (table 9)",
                &["table-9-participants-paper"],
            ),
            (
                "points and participants do not interact (table 9)",
                &["table-9-interaction-paper"],
            ),
        ],
        // The paper has only its own controller, and means without a range.
        beside: &["*-recommended", "table-8-within-*"],
    },
    Grouping {
        studies: &["hamana-posture"],
        claims: &[
            ("one point bends most at 0°", &["one-falls-*"]),
            ("two points bend more than one at 90°", &["two-more-*"]),
            (
                "two points still bend the finger far at 45°",
                &["two-enough-*"],
            ),
        ],
        beside: &[],
    },
    Grouping {
        studies: &["hamana-hold"],
        claims: &[(
            "the finger sinks less with two points than one",
            &["two-better-*"],
        )],
        beside: &[],
    },
    Grouping {
        studies: &["two-points"],
        claims: &[],
        // This share only combines the others for one wearer.
        beside: &["all"],
    },
    Grouping {
        studies: &["lee"],
        claims: &[(
            "the model agrees: mean NRMSE below 10 % at I5 and at most 13.1 % below I5",
            &["nrmse-i5", "nrmse"],
        )],
        beside: &[],
    },
    Grouping {
        studies: &["harris-ramps"],
        claims: &[(
            "±15° do not alter the torque significantly",
            &["angle-alike", "angle-significant"],
        )],
        beside: &[],
    },
    Grouping {
        studies: &["harris-wall"],
        claims: &[
            (
                "pre-wall: the arm swings less",
                &["pre-wall-swings-less", "pre-wall-swings-no-more"],
            ),
            (
                "co-contraction: helps only with a pre-wall",
                &[
                    "co-contraction-helps-with-pre-wall",
                    "co-contraction-helps-without",
                    "helps-only-with-pre-wall",
                ],
            ),
            (
                "visual feedback: the arm goes less deep",
                &["seeing-less-deep-*"],
            ),
            (
                "visual feedback: the arm swings less",
                &["seeing-swings-less-*"],
            ),
        ],
        beside: &[],
    },
    Grouping {
        studies: &[
            "harris-wall-decides",
            "harris-wall-gentle",
            "harris-wall-why",
            "harris-wall-yields",
        ],
        claims: &[(
            "co-contraction: helps only with a pre-wall",
            &["with", "without", "only-with"],
        )],
        // This share combines two claims about one arm.
        beside: &["as-concluded"],
    },
    Grouping {
        studies: &["sierotowicz"],
        claims: &[
            ("C3: lower error than C2", &["c3-c2", "mann-whitney"]),
            (
                "C3: higher correlation than C2",
                &["correlation", "wilcoxon"],
            ),
        ],
        beside: &[],
    },
    Grouping {
        studies: &["distributed"],
        // The abstract does not say whether the four electrodes shared the rate or each had it.
        claims: &[(
            "four electrodes hold the force longer than one, for both readings of the rate",
            &["quarter-longer", "fast-longer"],
        )],
        beside: &[],
    },
];

/// Returns whether `id` matches `pattern`, in which one `*` matches any text.
fn is_meant(pattern: &str, id: &str) -> bool {
    match pattern.split_once('*') {
        None => pattern == id,
        Some((begin, end)) => {
            id.len() >= begin.len() + end.len() && id.starts_with(begin) && id.ends_with(end)
        }
    }
}

/// Returns the claims of the paper in their order, and the shares that belong to none of them.
#[must_use]
pub fn paper_claims(outcome: &Outcome) -> (Vec<PaperClaim<'_>>, Vec<&Share>) {
    let grouping = GROUPINGS
        .iter()
        .find(|grouping| grouping.studies.contains(&&*outcome.name));
    let is_any = |patterns: &[&str], id: &str| patterns.iter().any(|pattern| is_meant(pattern, id));
    let (mut claims, mut beside) = (Vec::<(&str, PaperClaim<'_>)>::new(), Vec::new());
    for share in &outcome.shares {
        let is_beside = grouping.is_some_and(|grouping| is_any(grouping.beside, &share.id));
        if share.paper.is_none() || is_beside {
            beside.push(share);
            continue;
        }
        let own = grouping.and_then(|grouping| {
            grouping
                .claims
                .iter()
                .find(|claim| is_any(claim.1, &share.id))
        });
        let id = share.id.split('/').next().unwrap_or_default();
        let (key, says) = own.map_or((id, &*share.claim), |(says, _)| (*says, *says));
        match claims.iter_mut().find(|claim| claim.0 == key) {
            Some((_, claim)) => claim.parts.push(share),
            None => {
                let parts = vec![share];
                claims.push((key, PaperClaim { says, parts }));
            }
        }
    }
    let named = claims
        .into_iter()
        .map(|(_, claim)| claim.with_common_name());
    (named.collect(), beside)
}

impl PaperClaim<'_> {
    /// Names the claim by the text after the colon, if all parts share it: "persons: it falls" and
    /// "studies: it falls" become "it falls".
    fn with_common_name(mut self) -> Self {
        let tail = |share: &'_ Share| share.claim.find(": ").map(|at| at + 2);
        if let [first, second, ..] = *self.parts
            && self.says == first.claim
            && let (Some(a), Some(b)) = (tail(first), tail(second))
            && first.claim[a..] == second.claim[b..]
        {
            self.says = &self.says[a..];
        }
        self
    }

    /// Returns the verdict on the claim, which is the worst one of its parts: a claim holds only if
    /// all parts do. Parts with at most one independent case do not count.
    #[must_use]
    pub fn standing(&self) -> ClaimStanding {
        let has_verdict = |wanted| {
            let mut counted = self.parts.iter().filter_map(|share| share.verdict());
            counted.any(|verdict| verdict == wanted)
        };
        let worst = [Verdict::Unlike, Verdict::Undecided, Verdict::Like];
        match worst.into_iter().find(|verdict| has_verdict(*verdict)) {
            Some(worst) => ClaimStanding::Judged(worst),
            None if self.parts.iter().any(|share| share.is_single()) => ClaimStanding::Single,
            None => ClaimStanding::Unjudged,
        }
    }

    /// Returns the number of parts that agree with the paper, and the number of parts that count.
    #[must_use]
    pub fn counts(&self) -> (usize, usize) {
        let counted = self.parts.iter().filter_map(|share| share.verdict());
        let like = counted.clone().filter(|verdict| *verdict == Verdict::Like);
        (like.count(), counted.count())
    }

    /// Returns a phrase, for example "agrees in 2 of 3 counted parts".
    #[must_use]
    pub fn counts_in_words(&self) -> String {
        match self.counts() {
            (_, 0) => "no part is counted".to_owned(),
            (like, 1) => format!("agrees in {like} of 1 counted part"),
            (like, counted) => format!("agrees in {like} of {counted} counted parts"),
        }
    }
}

impl ClaimStanding {
    /// Returns the verdict in a few words, for a table.
    #[must_use]
    pub const fn in_words(self) -> &'static str {
        match self {
            Self::Judged(Verdict::Like) => "agrees",
            Self::Judged(Verdict::Unlike) => "disagrees",
            Self::Judged(Verdict::Undecided) => "undecided",
            Self::Single => "n = 1, not counted",
            Self::Unjudged => "not judged",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::is_meant;

    #[test]
    fn a_star_stands_for_anything() {
        assert!(is_meant("over-*", "over-P"));
        assert!(is_meant("two-better-*-paper", "two-better-P-paper"));
        assert!(!is_meant("two-better-*-paper", "two-better-P-recommended"));
        assert!(!is_meant("two-better-*-paper", "two-better-paper"));
        assert!(is_meant("all", "all") && !is_meant("all", "allowed"));
    }
}
