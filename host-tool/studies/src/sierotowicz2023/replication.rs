//! Simulates one study of three participants through the conditions C1 to C4.

use super::calibrate::{fit_model, geometry_error_deg, motionless_channels, twitches};
use super::course::{Condition, Course, Player, condition};
use super::declaration::Study;
use super::device::{Method, Switches, switches};
use super::error::EndpointError;
use super::imus;
use super::metrics::{Target, median};
use super::model::Model;
use super::participant::{Command, Participant};
use super::walk::{RATES_HZ, WalkResult, walk};
use hal_sim::random;
use serde::{Deserialize, Serialize};

/// Number of participants in a study.
pub const PARTICIPANTS: usize = 3;
/// Names of the stored conditions: C1 to C4 of the paper, then ours.
pub const CONDITIONS: [&str; 8] = [
    "C1", "C2", "C3", "C4", "squares", "exact", "fresh", "rested",
];
/// Index of the first draw that can replace S1. All other participants have smaller indices.
const SUBSTITUTES: u64 = 1 << 32;

/// Errors and forces of one simulated participant in every condition.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct ParticipantResult {
    /// Results of the conditions in the order of [`CONDITIONS`].
    pub conditions: Vec<Condition>,
    /// Angle between the modelled and the true torque of each channel's muscle, °: with S1's frame,
    /// then calibrated.
    pub geometry_deg: [[f64; 9]; 2],
    /// Angle between the modelled and the true torque of each channel's muscle, °, after a
    /// calibration in which the arm comes to rest between twitches.
    pub rested_deg: [f64; 9],
    /// Gains with S1's frame and calibrated, N/mA.
    pub gains: [[f64; 9]; 2],
    /// Switching of the nearest neighbour and of least squares with the calibrated model.
    pub switches: [Switches; 2],
    /// Errors of a force that goes around a circle, recruited at each of [`RATES_HZ`].
    pub walks: [WalkResult; 2],
    /// Smallest fraction of force that fatigue left in a muscle after C2, C3 and C4, 0 to 1.
    pub freshness: [f64; 3],
    /// Channels whose twitches did not turn the limb, so that they kept S1's routing and gain.
    pub untwitched: Vec<usize>,
    /// Channels that kept S1's routing and gain in the calibration in which the arm comes to rest
    /// between twitches.
    pub rested_untwitched: Vec<usize>,
    /// Positions of breastbone (the origin), shoulder, elbow and cuff, m.
    pub places_m: [[f64; 3]; 4],
}

/// Result of one study.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Replication {
    /// Index of the study.
    pub index: u64,
    /// Results of S1 to S3.
    pub people: Vec<ParticipantResult>,
    /// Number of draws that were rejected as S1 because one of their channels did not twitch.
    pub in_vain: u64,
}

impl ParticipantResult {
    /// Returns the share of C3's error at the hand that micromath and single precision add: the
    /// root mean square difference of its forces from those of double precision on the same arm,
    /// divided by C3's root mean square error.
    #[must_use]
    pub fn share_of_numbers(&self) -> f64 {
        let [Some(ours), Some(exact)] = ["C3", "exact"].map(|name| self.condition(name)) else {
            return f64::NAN;
        };
        let off = |(a, b): (&Target, &Target)| -> f64 {
            let parts = a.measured.iter().zip(b.measured).take(3);
            parts.map(|(a, b)| (a - b).powi(2)).sum()
        };
        let pairs = ours.targets.iter().zip(&exact.targets);
        let mean = pairs.map(off).sum::<f64>() / ours.targets.len() as f64;
        mean.sqrt() / ours.measures.rmse_n[3]
    }

    /// Returns the condition with this name.
    #[must_use]
    pub fn condition(&self, name: &str) -> Option<&Condition> {
        self.conditions
            .iter()
            .find(|condition| condition.name == name)
    }

    /// Returns the median of [`Self::geometry_deg`] over channels, °: with S1's frame, then
    /// calibrated.
    #[must_use]
    pub fn geometry(&self) -> [f64; 2] {
        self.geometry_deg.each_ref().map(|values| median(values))
    }
}

/// Returns S1's frame: the model that the calibration makes of approximate anatomy on a copy of S1
/// without fatigue.
///
/// # Errors
/// Returns E717 to E719 if IMUs, twitches or gains are wrong.
pub fn frame_of(study: &Study, participant: &Participant) -> Result<Model, EndpointError> {
    let mut participant = participant.clone();
    imus::check(participant.arm.spec())?;
    let model = participant.cursory_model();
    let turning = twitches(&mut participant.arm, &model, study, &mut participant.now_us);
    let mass_kg = participant.arm.spec().mass_kg;
    fit_model(&model, (&turning, &[]), mass_kg, study)
}

/// A calibrated participant at the start of C3.
struct CalibratedParticipant<'a> {
    /// Results of C1 and C2.
    course: Course<'a>,
    person: Participant,
    calibrated: Player,
    untwitched: Vec<usize>,
    /// Copy of the participant at the start of C2.
    early: Participant,
    /// Copy of the participant at the start of the calibration.
    before: Participant,
    /// Smallest fraction of force that fatigue left in a muscle after C2.
    left: f64,
}

/// Simulates one participant up to the start of C3; `s1` is S1's frame.
fn simulate_until_c3<'a>(
    study: &'a Study,
    mut person: Participant,
    s1: &Model,
    seed: u64,
) -> Result<CalibratedParticipant<'a>, EndpointError> {
    let own = Player::new(person.model_wearing(s1))?;
    let by_will = person.push_voluntarily(study, &own.device);
    let mut course = Course {
        study,
        conditions: vec![condition(study, "C1", by_will, None)?],
        own: own.clone(),
        seed,
    };
    person.pause(study.protocol.pause_s);
    let early = person.clone();
    let left = course.run(("C2", 2), &mut person, (&own, Method::Nearest))?;
    let before = person.clone();
    let (calibrated, untwitched) = own_model(study, &mut person, s1)?;
    Ok(CalibratedParticipant {
        course,
        person,
        calibrated: Player::new(calibrated)?,
        untwitched,
        early,
        before,
        left,
    })
}

/// Simulates one participant through all conditions; `s1` is S1's frame.
///
/// # Errors
/// Fails if any condition fails.
pub fn person(
    study: &Study,
    participant: Participant,
    s1: &Model,
    seed: u64,
) -> Result<ParticipantResult, EndpointError> {
    let near = Method::Nearest;
    let CalibratedParticipant {
        mut course,
        mut person,
        calibrated,
        untwitched,
        mut early,
        before: mut rested,
        left: c2,
    } = simulate_until_c3(study, participant, s1, seed)?;
    let other = person.clone();
    let c3 = course.run(("C3", 3), &mut person, (&calibrated, near))?;
    let reset = Player::new(Model {
        gains: s1.gains,
        ..calibrated.model.clone()
    })?;
    let c4 = course.run(("C4", 4), &mut person, (&reset, near))?;
    for (name, method) in [("squares", Method::Squares), ("exact", Method::Exact)] {
        course.run((name, 3), &mut other.clone(), (&calibrated, method))?;
    }
    let (fresh, _) = own_model(study, &mut early, s1)?;
    course.run(("fresh", 3), &mut early, (&Player::new(fresh)?, near))?;
    let (at_rest, rested_untwitched) = own_model(&study.rested(), &mut rested, s1)?;
    let at_rest = Player::new(at_rest)?;
    course.run(("rested", 3), &mut rested, (&at_rest, near))?;
    let device = &calibrated.device;
    let size = device.reachable_n([1.0, 0.0, 0.0]).max(1.0);
    let switching = |method| switches(device, method, size, study.switching.jump);
    let walked = |rate_hz| walk(study, &mut other.clone(), device, rate_hz);
    let [full, slow] = RATES_HZ.map(walked);
    let geometry = |player: &Player| geometry_error_deg(&player.device, &player.model, &person.arm);
    let Course {
        own, conditions, ..
    } = course;
    Ok(ParticipantResult {
        conditions,
        geometry_deg: [&own, &calibrated].map(geometry),
        rested_deg: geometry(&at_rest),
        gains: [own.model.gains, calibrated.model.gains],
        switches: [switching(near)?, switching(Method::Squares)?],
        walks: [full?, slow?],
        freshness: [c2, c3, c4],
        untwitched,
        rested_untwitched,
        places_m: places(&person),
    })
}

/// A wearer at the start of C3, the device's model of the arm, and the commands of C3.
pub(super) struct PreparedC3 {
    pub person: Participant,
    /// Calibrated model of the arm.
    pub model: Model,
    /// Commands in the order in which C3 plays them.
    pub commands: Vec<Command>,
}

/// Simulates S2 of study 0 of `seed` up to the start of C3.
///
/// # Errors
/// Fails like [`replication`].
pub(super) fn before_c3(study: &Study, seed: u64) -> Result<PreparedC3, EndpointError> {
    let (_, s1, _) = first_participant(study, seed, 0)?;
    let s2 = Participant::random(study, seed, 1)?;
    let begun = simulate_until_c3(study, s2, &s1, random::word(seed, 1_001))?;
    let own = &begun.course.own.device;
    Ok(PreparedC3 {
        commands: begun.person.commands(study, own, 3),
        model: begun.calibrated.model,
        person: begun.person,
    })
}

/// Returns the positions of sternoclavicular joint, shoulder, elbow and cuff, m.
fn places(person: &Participant) -> [[f64; 3]; 4] {
    let bones = person.arm.skeleton();
    let at = [bones.shoulder, bones.elbow, bones.cuff].map(Into::into);
    [[0.0; 3], at[0], at[1], at[2]]
}

/// Calibrates one participant and pauses. Returns the model, and the channels whose twitches do not
/// turn the limb; these keep S1's routing and gain.
fn own_model(
    study: &Study,
    person: &mut Participant,
    s1: &Model,
) -> Result<(Model, Vec<usize>), EndpointError> {
    imus::check(person.arm.spec())?;
    let model = Model {
        frame: person.cursory_model().frame,
        ..person.model_wearing(s1)
    };
    let turning = twitches(&mut person.arm, &model, study, &mut person.now_us);
    let kept = motionless_channels(&turning);
    let mass_kg = person.arm.spec().mass_kg;
    let model = fit_model(&model, (&turning, &kept), mass_kg, study)?;
    person.pause(study.protocol.pause_s);
    Ok((model, kept))
}

/// Returns S1 of study `index`, S1's frame, and the number of rejected draws. If a channel does not
/// twitch, tries at most `substitutes` further draws.
fn first_participant(
    study: &Study,
    seed: u64,
    index: u64,
) -> Result<(Participant, Model, u64), EndpointError> {
    let most = study.calibration.substitutes;
    let mut in_vain = 0;
    loop {
        let number = match in_vain {
            0 => PARTICIPANTS as u64 * index,
            again => SUBSTITUTES + most * index + again - 1,
        };
        let s1 = Participant::random(study, seed, number)?;
        match frame_of(study, &s1) {
            Err(EndpointError::NoTwitch(_)) if in_vain < most => in_vain += 1,
            frame => return Ok((s1, frame?, in_vain)),
        }
    }
}

/// Simulates study `index` of `seed`.
///
/// # Errors
/// Fails if any participant fails. Returns E718 if S1 and all substitutes have a channel that does
/// not twitch.
pub fn replication(study: &Study, seed: u64, index: u64) -> Result<Replication, EndpointError> {
    let numbers = (0..PARTICIPANTS as u64).map(|at| PARTICIPANTS as u64 * index + at);
    let (s1, frame, in_vain) = first_participant(study, seed, index)?;
    let mut s1 = Some(s1);
    let mut course = |number: u64| {
        let who = match s1.take() {
            Some(s1) => s1,
            None => Participant::random(study, seed, number)?,
        };
        person(study, who, &frame, random::word(seed, 1_000 + number))
    };
    Ok(Replication {
        index,
        people: numbers.map(&mut course).collect::<Result<_, _>>()?,
        in_vain,
    })
}

/// Iterates over S2 and S3 of every study, who wear a frame that is not their own.
pub(super) fn wearers(all: &[Replication]) -> impl Iterator<Item = &ParticipantResult> {
    all.iter()
        .flat_map(|replication| replication.people.iter().skip(1))
}

/// Iterates over all participants.
pub(super) fn people(all: &[Replication]) -> impl Iterator<Item = &ParticipantResult> {
    all.iter().flat_map(|replication| &replication.people)
}
