//! Evaluates experiment 3 and the posture experiment (Hamana 2022, III-C and III-D6): how far the
//! fingers bend.

use super::experiments::{Condition, Protocol, StimulationResult};
use super::pattern::{Pattern, Points};
use super::sessions::{Session, claim, mean, people, row};
use crate::laboratory::{Row, Share};
use hal_sim::body::hand::spec::{A, B};
use host_core::statistics::paired_t;

const DIGITS: [&str; 5] = ["thumb", "index", "middle", "ring", "little"];

/// Returns whether the other fingers bend more at the intensities above the largest voltages (g, h
/// and i) than at the largest ones (d, e and f); `None` if one of them was not applied.
pub(super) fn bends_others_above(session: &Session) -> Option<bool> {
    let others = |letters: [char; 3]| {
        let letter_mean = |letter: char| {
            let sum = |s: &StimulationResult| s.flexed.iter().sum::<f64>() - s.flexed[1];
            mean(session, |c| c.name.starts_with(letter), sum)
        };
        let means: Option<Vec<f64>> = letters.map(letter_mean).into_iter().collect();
        Some(means?.into_iter().sum::<f64>())
    };
    Some(others(['g', 'h', 'i'])? > others(['d', 'e', 'f'])?)
}

/// Evaluates experiment 3: returns a row for every participant, intensity and finger (flexion as a
/// percentage of the finger's range), and the share of draws in which each claim holds.
pub(super) fn intensities(sessions: &[Session]) -> (Vec<Row>, Vec<Share>) {
    let (mut rows, mut shares) = (Vec::new(), Vec::new());
    for (participant, _) in people(sessions) {
        let own: Vec<&Session> = sessions
            .iter()
            .filter(|session| session.participant == participant)
            .collect();
        let mut names: Vec<&str> = Vec::new();
        for condition in own.iter().flat_map(|session| &session.conditions) {
            if !names.contains(&&*condition.name) {
                names.push(&condition.name);
            }
        }
        names.sort_unstable();
        for name in names {
            for (digit, called) in DIGITS.into_iter().enumerate() {
                let values = own.iter().filter_map(|session| {
                    mean(session, |c| c.name == name, |s| 100.0 * s.flexed[digit])
                });
                let quantity = format!("{participant}, {name}, {called}");
                let id = format!("{quantity}/Angle, % of the finger's range");
                rows.push(row(&id, quantity, "% of range", None, values.collect()));
            }
        }
        let bend = own.iter().map(|session| bends_others_above(session));
        let id = format!("over-{participant}");
        let words = "other fingers bend more 4 V above maximum".to_owned();
        shares.push(claim(
            &id,
            format!("{participant}: {words}"),
            Some(true),
            bend,
        ));
    }
    (rows, shares)
}

/// Pronations at which the posture experiment measures, °. At 0° the skin lies over the muscles as
/// it did in the searches for points and voltages.
pub(super) const LIES_DEG: [f64; 3] = [0.0, 45.0, 90.0];

/// Angles of the index finger, °. The first index is 0 for one point and 1 for two points, the
/// second is the index of the pronation in [`LIES_DEG`].
pub(super) type IndexAngles = [[f64; 3]; 2];

/// Returns the mean angles over the trials of a posture session; `None` if a condition has no
/// trials. The angles with one point are those of A or B, whichever bends the finger further at 0°.
pub(super) fn index_angles(session: &Session) -> Option<IndexAngles> {
    let angles = |points: Points| {
        let at = LIES_DEG.map(|lies| {
            let is = |c: &Condition| c.pattern.points == points && c.pronated_deg == lies;
            mean(session, is, |s| s.index_deg)
        });
        let [none, half, whole] = at;
        Some([none?, half?, whole?])
    };
    let [a, b] = [angles(Points::One(A))?, angles(Points::One(B))?];
    let better = if a[0] >= b[0] { a } else { b };
    Some([better, angles(Pattern::default_two_point().points)?])
}

/// Evaluates the posture experiment: returns rows with the index finger's angle at each pronation,
/// with one point and with two, and the share of draws in which each claim holds.
pub(super) fn postures(protocol: &Protocol, sessions: &[Session]) -> (Vec<Row>, Vec<Share>) {
    let (mut rows, mut shares) = (Vec::new(), Vec::new());
    let mut angles = Vec::new();
    for (participant, is_printed) in people(sessions) {
        let own = sessions
            .iter()
            .filter(|session| session.participant == participant);
        let bent: Vec<IndexAngles> = own.filter_map(index_angles).collect();
        for (method, name) in ["one point", "two points"].into_iter().enumerate() {
            for (place, lies) in LIES_DEG.into_iter().enumerate() {
                let values = bent.iter().map(|values| values[method][place]).collect();
                let quantity = format!("{participant}, {name}, {lies}° pronated");
                let id = format!("{quantity}/Index finger (°)");
                rows.push(row(&id, quantity, "°", None, values));
            }
        }
        shares.extend(posture_claims(participant, is_printed, protocol, &bent));
        angles.extend(bent);
    }
    rows.extend(rotation(&angles));
    (rows, shares)
}

/// Compares the index finger's angles at 0° and at 90° of pronation by paired t-tests over all
/// draws of all participants, with one point and with two. Bao 2018's abstract finds no significant
/// effect of rotation; Hamana 2022 finds that the angle with one point becomes smaller.
fn rotation(bent: &[[[f64; 3]; 2]]) -> Vec<Row> {
    let mut rows = Vec::new();
    for (method, name) in ["one point", "two points"].into_iter().enumerate() {
        let at = |place: usize| {
            bent.iter()
                .map(|values| values[method][place])
                .collect::<Vec<_>>()
        };
        let test = paired_t(&at(0), &at(2)).ok();
        for (statistic, value) in [
            ("t", test.map(|paired_t| paired_t.t)),
            ("p", test.map(|paired_t| paired_t.p)),
        ] {
            rows.push(Row {
                id: format!("rotation, {name}, {statistic}"),
                quantity: format!("0° against 90° pronation, {name}, {statistic}"),
                unit: String::new(),
                paper: None,
                ours: value,
                low: None,
                high: None,
                n: bent.len(),
            });
        }
    }
    rows
}

/// Judges the paper's three claims about the index finger's angle: one point bends it most at 0°,
/// two points bend it more than one at 90°, and two points reach the preregistered angle at 45°.
fn posture_claims(
    participant: &str,
    is_printed: bool,
    protocol: &Protocol,
    bent: &[[[f64; 3]; 2]],
) -> [Share; 3] {
    let least_deg = protocol.posture_deg;
    let share = |id: &str, words: String, holds: fn([[f64; 3]; 2], f64) -> bool| {
        let id = format!("{id}-{participant}");
        let verdicts = bent.iter().map(|values| Some(holds(*values, least_deg)));
        claim(
            &id,
            format!("{participant}: {words}"),
            is_printed.then_some(true),
            verdicts,
        )
    };
    [
        share(
            "one-falls",
            "one point bends most at 0° of pronation".into(),
            |[one_point, _], _| one_point[0] > one_point[1] && one_point[0] > one_point[2],
        ),
        share(
            "two-more",
            "two points bend more than one at 90°".into(),
            |[one_point, two], _| two[2] > one_point[2],
        ),
        share(
            "two-enough",
            format!("two points reach {least_deg}° at 45° of pronation"),
            |[_, two], least_deg| two[1] >= least_deg,
        ),
    ]
}
