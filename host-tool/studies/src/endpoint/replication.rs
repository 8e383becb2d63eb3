//! One study of three participants, C1 to C4.

use super::calibrate::{calibrated, geometry_error_deg, twitches};
use super::declaration::Study;
use super::error::EndpointError;
use super::imus;
use super::limb::{JOINTS, Limb};
use super::metrics::{Measures, Target, align, measures, median};
use super::participant::Participant;
use super::recruit::{LeastSquares, NearestNeighbour, Recruits, Switches, reachable_n, switches};
use super::regression::{Score, folds, predicted, score};
use hal_sim::random;
use serde::Serialize;

/// Participants of a study.
pub const PARTICIPANTS: usize = 3;
/// Conditions that are kept, in order: C1 to C4 as the paper's, then ours.
pub const CONDITIONS: [&str; 6] = ["C1", "C2", "C3", "C4", "squares", "fresh"];

/// What one condition of one participant came to.
#[derive(Clone, Debug, Serialize)]
pub struct Condition {
    /// Its name.
    pub name: &'static str,
    /// What was wanted and measured, aligned.
    pub targets: Vec<Target>,
    /// By how much it was turned about the vertical, degrees.
    pub turned_deg: f64,
    /// Numbers.
    pub measures: Measures,
    /// Table 1 of it (C2 to C4): force, torque, then each joint; by ten folds and by
    /// leaving one command out.
    pub table_1: Vec<[Score; 2]>,
}

/// What one participant came to.
#[derive(Clone, Debug, Serialize)]
pub struct Person {
    /// Conditions in order.
    pub conditions: Vec<Condition>,
    /// Geometry's error in S1's frame and calibrated, degrees, of each channel.
    pub geometry_deg: [[f64; 9]; 2],
    /// Gains in S1's frame and calibrated, N/mA.
    pub gains: [[f64; 9]; 2],
    /// Nearest neighbour and least squares on the calibrated limb.
    pub switches: [Switches; 2],
    /// Least that tiredness left of a muscle after C2, C3 and C4, 0 to 1.
    pub freshness: [f64; 3],
}

/// What one study came to.
#[derive(Clone, Debug, Serialize)]
pub struct Replication {
    /// Its number.
    pub index: u64,
    /// S1 to S3.
    pub people: Vec<Person>,
}

impl Person {
    /// The condition of this name.
    #[must_use]
    pub fn condition(&self, name: &str) -> Option<&Condition> {
        self.conditions.iter().find(|it| it.name == name)
    }

    /// Median of geometry's errors before and after calibration, degrees.
    #[must_use]
    pub fn geometry(&self) -> [f64; 2] {
        self.geometry_deg.each_ref().map(|it| median(it))
    }
}

/// S1's frame: what the calibration makes of cursory anatomy on S1, fresh.
///
/// # Errors
/// E717 to E719: IMUs, twitches or gains.
pub fn frame_of(study: &Study, participant: &Participant) -> Result<Limb, EndpointError> {
    let mut participant = participant.clone();
    imus::check(participant.arm.spec())?;
    let limb = participant.cursory();
    let turning = twitches(&mut participant.arm, &limb, study, &mut participant.now_us);
    calibrated(&limb, &turning, participant.arm.spec().mass_kg, study)
}

/// A condition of these targets.
fn condition(
    study: &Study,
    name: &'static str,
    mut targets: Vec<Target>,
    limb: Option<(&Limb, u64)>,
) -> Result<Condition, EndpointError> {
    let turned_deg = align(&mut targets).to_degrees();
    let table_1 = match limb {
        Some((limb, seed)) => table_1(study, &targets, limb, seed)?,
        None => Vec::new(),
    };
    Ok(Condition {
        name,
        measures: measures(&targets)?,
        targets,
        turned_deg,
        table_1,
    })
}

/// Table 1's row of these targets: currents, as parts of their ranges, to the wrench and to
/// joint torques (equation 8).
fn table_1(
    study: &Study,
    targets: &[Target],
    limb: &Limb,
    seed: u64,
) -> Result<Vec<[Score; 2]>, EndpointError> {
    let part =
        |ma: &f64, [least, greatest]: &[f64; 2]| ((ma - least) / (greatest - least)).max(0.0);
    let parts = |it: &Target| {
        it.currents_ma
            .iter()
            .zip(&limb.ranges_ma)
            .map(|(a, b)| part(a, b))
            .collect()
    };
    let inputs: Vec<Vec<f64>> = targets.iter().map(parts).collect();
    let outputs = |it: &Target| {
        let joints = limb.frame.torques(&it.measured);
        let joints = joints
            .iter()
            .flat_map(|it| it.iter().copied().collect::<Vec<_>>());
        it.measured.into_iter().chain(joints).collect()
    };
    let outputs: Vec<Vec<f64>> = targets.iter().map(outputs).collect();
    let how = &study.regression;
    let commands: Vec<usize> = targets.iter().map(|it| it.command).collect();
    let ways = [folds(targets.len(), how.folds, seed), commands];
    let mut rows = vec![
        [Score {
            r_squared: 0.0,
            nrmse: 0.0
        }; 2];
        2 + JOINTS
    ];
    for (way, groups) in ways.iter().enumerate() {
        let answers = predicted(how, seed, (&inputs, &outputs), groups)?;
        for (place, row) in rows.iter_mut().enumerate() {
            row[way] = score(&outputs, &answers, 3 * place..3 * place + 3);
        }
    }
    Ok(rows)
}

/// One participant through all conditions with `s1`, S1's frame.
///
/// # Errors
/// What goes wrong in any of them.
pub fn person(
    study: &Study,
    participant: Participant,
    s1: &Limb,
    seed: u64,
) -> Result<Person, EndpointError> {
    let mut person = participant;
    let near = NearestNeighbour;
    let squares = LeastSquares {
        ridge_m: study.squares.ridge_m,
    };
    let own = person.wearing(s1);
    let stream = |what: u64| random::word(seed, what);
    let mut conditions = Vec::new();
    let by_will = person.by_will(study, &own);
    conditions.push(condition(study, "C1", by_will, None)?);
    person.pause(study.protocol.pause_s);
    let before = person.clone();

    let commands = person.commands(study, &own, 2);
    let c2 = person.stimulated(study, (&own, &near), &commands);
    conditions.push(condition(study, "C2", c2, Some((&own, stream(2))))?);
    let mut freshness = [least_fresh(&person); 3];
    person.pause(study.protocol.pause_s);

    let calibrate = |person: &mut Participant| {
        imus::check(person.arm.spec())?;
        let limb = person.cursory();
        let turning = twitches(&mut person.arm, &limb, study, &mut person.now_us);
        calibrated(&limb, &turning, person.arm.spec().mass_kg, study)
    };
    let limb = calibrate(&mut person)?;
    person.pause(study.protocol.pause_s);
    let mut other = person.clone();

    let commands = person.commands(study, &own, 3);
    let c3 = person.stimulated(study, (&limb, &near), &commands);
    conditions.push(condition(study, "C3", c3, Some((&limb, stream(3))))?);
    freshness[1] = least_fresh(&person);
    person.pause(study.protocol.pause_s);

    let reset = Limb {
        gains: s1.gains,
        ..limb.clone()
    };
    let commands_4 = person.commands(study, &own, 4);
    let c4 = person.stimulated(study, (&reset, &near), &commands_4);
    conditions.push(condition(study, "C4", c4, Some((&reset, stream(4))))?);
    freshness[2] = least_fresh(&person);

    let by_squares = other.stimulated(study, (&limb, &squares), &commands);
    conditions.push(condition(study, "squares", by_squares, None)?);
    let mut early = before;
    let fresh_limb = calibrate(&mut early)?;
    early.pause(study.protocol.pause_s);
    let fresh = early.stimulated(study, (&fresh_limb, &near), &commands);
    conditions.push(condition(study, "fresh", fresh, None)?);

    let size = reachable_n(&limb, &[1.0, 0.0, 0.0]).max(1.0);
    let switching = |recruits: &dyn Recruits| switches(recruits, &limb, size, study.switching.jump);
    Ok(Person {
        conditions,
        geometry_deg: [&own, &limb].map(|it| geometry_error_deg(it, &person.arm)),
        gains: [own.gains, limb.gains],
        switches: [switching(&near), switching(&squares)],
        freshness,
    })
}

fn least_fresh(person: &Participant) -> f64 {
    person.arm.freshness().into_iter().fold(1.0, f64::min)
}

/// Study `index` of `seed`.
///
/// # Errors
/// What goes wrong in any participant.
pub fn replication(study: &Study, seed: u64, index: u64) -> Result<Replication, EndpointError> {
    let first = PARTICIPANTS as u64 * index;
    let drawn = |at: u64| Participant::drawn(study, seed, first + at);
    let s1 = frame_of(study, &drawn(0)?)?;
    let people = (0..PARTICIPANTS as u64)
        .map(|at| {
            person(
                study,
                drawn(at)?,
                &s1,
                random::word(seed, 1_000 + first + at),
            )
        })
        .collect::<Result<_, _>>()?;
    Ok(Replication { index, people })
}
