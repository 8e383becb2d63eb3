//! Judges the selection of muscle models on random sessions, in a short run of `flexor chart
//! ladder`.

use studies::ladder::draw::{DEVELOPMENT, JUDGED, Kind, SESSIONS, session};
use studies::ladder::judge::{Summary, TOLERANCES, campaign};

/// Every random session is valid, and all kinds occur.
#[test]
fn every_drawn_session_is_one() {
    for seed in [DEVELOPMENT, JUDGED] {
        for index in 0..SESSIONS {
            let (kind, session) = session(seed, index).unwrap();
            assert_eq!(kind, Kind::ALL[index % Kind::ALL.len()]);
            assert!(
                session
                    .channels
                    .iter()
                    .all(|channel| channel.muscle.is_some())
            );
        }
    }
}

/// Checks both promises on two sessions of each kind, none of which is judged.
#[test]
fn what_is_chosen_will_do_and_the_next_cheaper_would_not() {
    let rows = campaign(DEVELOPMENT, 2 * Kind::ALL.len(), |_| ()).unwrap();
    for (n, tolerance) in TOLERANCES.iter().enumerate() {
        let sum = Summary::from_rows(&rows, n);
        println!("{tolerance}: {sum:?}");
        let limit_pct = tolerance.fraction() * 100.0;
        for row in rows
            .iter()
            .filter(|row| row.verdicts[n].error_pct > limit_pct)
        {
            println!("{tolerance}: {row:?}");
        }
        assert!(sum.muscles > 20, "{sum:?}");
        assert!(sum.within * 100 >= sum.muscles * 99, "{tolerance}: {sum:?}");
        assert!(
            sum.cheaper_fails * 100 >= sum.with_cheaper * 95,
            "{tolerance}: {sum:?}"
        );
    }
}
