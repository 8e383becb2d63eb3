//! One study of three participants, C1 to C4.

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

/// Participants of a study.
pub const PARTICIPANTS: usize = 3;
/// Conditions that are kept, in order: C1 to C4 as the paper's, then ours.
pub const CONDITIONS: [&str; 8] = [
    "C1", "C2", "C3", "C4", "squares", "exact", "fresh", "rested",
];
/// Number of the first participant that is drawn in another's place.
const SUBSTITUTES: u64 = 1 << 32;

/// What one participant came to.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct ParticipantResult {
    /// Conditions in order.
    pub conditions: Vec<Condition>,
    /// Geometry's error in S1's frame and calibrated, degrees, of each channel.
    pub geometry_deg: [[f64; 9]; 2],
    /// The same, calibrated on an arm that rests.
    pub rested_deg: [f64; 9],
    /// Gains in S1's frame and calibrated, N/mA.
    pub gains: [[f64; 9]; 2],
    /// Nearest neighbour and least squares on the calibrated limb.
    pub switches: [Switches; 2],
    /// A wanted force that goes around, recruited at each of [`RATES_HZ`].
    pub walks: [WalkResult; 2],
    /// Least that tiredness left of a muscle after C2, C3 and C4, 0 to 1.
    pub freshness: [f64; 3],
    /// Channels whose twitches turned nothing, so that they kept S1's frame.
    pub untwitched: Vec<usize>,
    /// The same of an arm that rests.
    pub rested_untwitched: Vec<usize>,
    /// Breastbone, shoulder, elbow and cuff, m.
    pub places_m: [[f64; 3]; 4],
}

/// What one study came to.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Replication {
    /// Its number.
    pub index: u64,
    /// S1 to S3.
    pub people: Vec<ParticipantResult>,
    /// How many were drawn as S1 in vain before: a channel of theirs did not twitch.
    pub in_vain: u64,
}

impl ParticipantResult {
    /// What micromath and single precision add to C3's error at the hand: root mean square
    /// of how far its forces are from those of double precision on the same body, over
    /// C3's root mean square error.
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

    /// The condition of this name.
    #[must_use]
    pub fn condition(&self, name: &str) -> Option<&Condition> {
        self.conditions
            .iter()
            .find(|condition| condition.name == name)
    }

    /// Median of geometry's errors before and after calibration, degrees.
    #[must_use]
    pub fn geometry(&self) -> [f64; 2] {
        self.geometry_deg.each_ref().map(|values| median(values))
    }
}

/// S1's frame: what the calibration makes of cursory anatomy on S1, fresh.
///
/// # Errors
/// E717 to E719: IMUs, twitches or gains.
pub fn frame_of(study: &Study, participant: &Participant) -> Result<Model, EndpointError> {
    let mut participant = participant.clone();
    imus::check(participant.arm.spec())?;
    let model = participant.cursory_model();
    let turning = twitches(&mut participant.arm, &model, study, &mut participant.now_us);
    let mass_kg = participant.arm.spec().mass_kg;
    fit_model(&model, (&turning, &[]), mass_kg, study)
}

/// A participant who is calibrated: where C3 begins.
struct CalibratedParticipant<'a> {
    /// C1 and C2.
    course: Course<'a>,
    person: Participant,
    calibrated: Player,
    untwitched: Vec<usize>,
    /// Where C2 began, and where the calibration did.
    early: Participant,
    before: Participant,
    /// What C2 left.
    left: f64,
}

/// One participant up to C3, with `s1`, S1's frame.
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

/// One participant through all conditions with `s1`, S1's frame.
///
/// # Errors
/// What goes wrong in any of them.
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

/// A wearer where C3 begins, what the device knows of them and C3's commands.
pub(super) struct PreparedC3 {
    /// Who.
    pub person: Participant,
    /// Their arm, calibrated.
    pub model: Model,
    /// In order.
    pub commands: Vec<Command>,
}

/// S2 of study 0 of `seed` where C3 begins.
///
/// # Errors
/// As [`replication`].
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

/// Sternoclavicular joint, shoulder, elbow and cuff as they are, m.
fn places(person: &Participant) -> [[f64; 3]; 4] {
    let bones = person.arm.skeleton();
    let at = [bones.shoulder, bones.elbow, bones.cuff].map(Into::into);
    [[0.0; 3], at[0], at[1], at[2]]
}

/// The calibration of one participant: channels whose twitches turn nothing keep S1's
/// routing and gain, and are named. A pause follows.
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

/// S1 of study `index` and the frame; where a channel of theirs does not twitch, the next
/// who is drawn in their place, at most `substitutes` times. Who it is, and after how many.
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

/// Study `index` of `seed`.
///
/// # Errors
/// What goes wrong in any participant; E718: a channel of S1 does not twitch, nor one of any
/// who was drawn instead.
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

/// S2 and S3 of every study: who wears a frame that is not their own.
pub(super) fn wearers(all: &[Replication]) -> impl Iterator<Item = &ParticipantResult> {
    all.iter()
        .flat_map(|replication| replication.people.iter().skip(1))
}

/// Every participant.
pub(super) fn people(all: &[Replication]) -> impl Iterator<Item = &ParticipantResult> {
    all.iter().flat_map(|replication| &replication.people)
}
