//! Fault campaign: a measured angle is wrong, late or missing, in a control loop that a simulated
//! wearer closes.

use super::Draws;
use super::broken_angle::BrokenAngle;
use super::case::{Case, CaseEnd, CaseResult};
use super::declaration::Declaration;
use super::error::FaultsError;
use super::kinds::Kinds;
use super::measured::angles;
use super::orders::Orders;
use super::script::ForkableBoards;
use super::simulated::judge_case;
use super::stem::first_difference;
use super::worn::{PlayedCase, SensorScenario};
use rayon::prelude::*;

/// Random stream of this fault class; every class has its own, so that their random numbers are
/// independent.
const STREAM: u64 = 0x5E15;
/// Time after `Start` in which no fault occurs, µs.
const BEGIN_US: u64 = 150_000;

/// Campaign in which a measured angle is wrong, late or missing: the source of boards, the recorded
/// sessions with a simulated wearer, and the kinds of fault.
pub(super) struct Sensor<B: ForkableBoards> {
    boards: B,
    scenes: Vec<SensorScenario<B>>,
    kinds: Kinds,
    runs_us: u64,
}

impl<B: ForkableBoards> Sensor<B> {
    pub fn new(seed: u64, declaration: &Declaration, boards: B) -> Result<Self, FaultsError> {
        let files = std::iter::once(&declaration.scene).chain(&declaration.scenes);
        let files: Vec<_> = files.collect();
        let files = files.into_par_iter();
        let scenes =
            files.map(|file| SensorScenario::record(&boards, file, declaration.to_the_end));
        Ok(Self {
            scenes: scenes.collect::<Result<_, FaultsError>>()?,
            kinds: Kinds::new(declaration, &boards, seed, STREAM),
            runs_us: declaration.timing().runs_us,
            boards,
        })
    }

    fn draw(&self, index: u64) -> Result<(&SensorScenario<B>, BrokenAngle<'_>), FaultsError> {
        let (kind, mut random) = self.kinds.draw(index)?;
        let scene = random.below(self.scenes.len().max(1) as u64) as usize;
        let none = || FaultsError::Declaration("there is no scene with a measured angle".into());
        let scene = self.scenes.get(scene).ok_or_else(none)?;
        let script = &scene.script;
        let angles = angles(&script.file.session);
        let drawn = random.below(angles.len().max(1) as u64) as usize;
        let angle = *angles.get(drawn).ok_or_else(none)?;
        let (begin_us, end_us) = (script.start.1 + BEGIN_US, script.stop.1);
        let span_us = end_us.saturating_sub(self.runs_us + begin_us).max(1);
        let moment_us = begin_us + random.below(span_us);
        let drawn = BrokenAngle::draw((kind, moment_us), angle, &angles, &mut random);
        Ok((scene, drawn))
    }
}

impl<B: ForkableBoards> Draws for Sensor<B> {
    fn case(&self, index: u64) -> Result<Case, FaultsError> {
        let (scene, drawn) = self.draw(index)?;
        let script = &scene.script;
        let (moment_us, end_us) = (drawn.moment_us, script.end_us());
        let PlayedCase {
            mut bench,
            said,
            done,
        } = scene.play(&self.boards, &drawn)?;
        let session = &script.file.session;
        let orders = Orders::from_session(session, script.said.writes(), B::LINE_US);
        let mut truth = script.truth();
        truth.quiet = orders
            .expected_effects(script.said.writes(), moment_us, end_us)
            .quiet;
        let (mut fate, verdict) = judge_case(&mut bench, moment_us, truth);
        fate.bare = script.unprotected_findings(&verdict);
        let changed = first_difference(&script.whole, &bench.recorder.trace, moment_us, end_us);
        fate.changed_us = changed.map(|at| at - moment_us);
        let (ended, stopped) = match done {
            Ok(ended) => (ended, None),
            Err(lost) => (CaseEnd::Played, Some(lost.to_string())),
        };
        // If the requested force is impossible at such an angle, the device refuses it, and its
        // host falls silent.
        let stopping = bench.reports().stopping.map(|(at, _)| u64::from(at.get()));
        fate.found |= stopping.is_some_and(|at| (moment_us..script.stop.1).contains(&at));
        // Detecting more than required is no false alarm, because the angle is wrong.
        fate.must_find = stopped.is_none() && (drawn.must_be_detected(said) || fate.found);
        Ok(Case {
            index,
            moment_us,
            what: drawn.in_words(&script.file.name),
            fate: CaseResult {
                ended,
                stopped,
                ..fate
            },
        })
    }

    fn notes(&self) -> Vec<String> {
        let kinds = self.kinds.in_words();
        vec![
            format!("Injected at random: {kinds}; the loop is closed through the scene's wearer."),
            "Must be found: an angle more than 20 degrees beyond its joint's range, and one older \
             than its joint allows. The device finds it if it reports a fault, or ends the \
             session because it cannot produce the force at the hand. Need not be found, but is \
             counted if it is: a plausible angle, however wrong; the limits bound its effect."
                .to_owned(),
        ]
    }
}
