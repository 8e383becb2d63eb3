//! Runs a participant through the conditions: plays the commands on a device and collects the
//! result of each condition.

use super::declaration::Study;
use super::device::{Device, Method};
use super::error::EndpointError;
use super::metrics::{Measures, Target, align, measures};
use super::model::Model;
use super::participant::Participant;
use super::regression::{Score, cross_validate, folds, score};
use firmware::limb::JOINTS;
use hal_sim::random;
use serde::{Deserialize, Serialize};

/// Result of one condition for one participant.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Condition {
    /// Name of the condition, one of [`CONDITIONS`](super::CONDITIONS).
    pub name: String,
    /// Reference and measured forces after alignment.
    pub targets: Vec<Target>,
    /// Angle by which the measured forces were rotated about the vertical to align them, °.
    pub turned_deg: f64,
    /// Correlations and errors of the targets.
    pub measures: Measures,
    /// Rows of table 1 (C2 to C4): force, torque, then each joint. Each row has the score with ten
    /// folds and with one command left out.
    pub table_1: Vec<[Score; 2]>,
}

/// Aligns the targets and computes the result of a condition. `table` is the player and the seed of
/// table 1, if the condition has one.
pub(super) fn condition(
    study: &Study,
    name: &'static str,
    mut targets: Vec<Target>,
    table: Option<(&Player, u64)>,
) -> Result<Condition, EndpointError> {
    let turned_deg = align(&mut targets).to_degrees();
    let table_1 = match table {
        Some((player, seed)) => table_1(study, &targets, player, seed)?,
        None => Vec::new(),
    };
    Ok(Condition {
        name: name.to_owned(),
        measures: measures(&targets)?,
        targets,
        turned_deg,
        table_1,
    })
}

/// Computes the condition's part of table 1: predicts the wrench and the joint torques (equation 8)
/// from the currents, as fractions of their ranges.
fn table_1(
    study: &Study,
    targets: &[Target],
    player: &Player,
    seed: u64,
) -> Result<Vec<[Score; 2]>, EndpointError> {
    let part =
        |ma: &f64, [least, greatest]: &[f64; 2]| ((ma - least) / (greatest - least)).max(0.0);
    let parts = |target: &Target| {
        target
            .currents_ma
            .iter()
            .zip(&player.model.ranges_ma)
            .map(|(a, b)| part(a, b))
            .collect()
    };
    let inputs: Vec<Vec<f64>> = targets.iter().map(parts).collect();
    let outputs = |target: &Target| {
        let joints = player.device.torques(&target.measured);
        target.measured.into_iter().chain(joints).collect()
    };
    let outputs: Vec<Vec<f64>> = targets.iter().map(outputs).collect();
    let how = &study.regression;
    let commands: Vec<usize> = targets.iter().map(|target| target.command).collect();
    let ways = [folds(targets.len(), how.folds, seed), commands];
    let mut rows = vec![
        [Score {
            r_squared: 0.0,
            nrmse: 0.0
        }; 2];
        2 + JOINTS
    ];
    for (way, groups) in ways.iter().enumerate() {
        let answers = cross_validate(how, seed, (&inputs, &outputs), groups)?;
        for (place, row) in rows.iter_mut().enumerate() {
            row[way] = score(&outputs, &answers, 3 * place..3 * place + 3);
        }
    }
    Ok(rows)
}

/// A model of an arm, and the device that is configured with it.
#[derive(Clone)]
pub(super) struct Player {
    pub model: Model,
    pub device: Device,
}

impl Player {
    pub fn new(model: Model) -> Result<Self, EndpointError> {
        let device = Device::new(&model)?;
        Ok(Self { model, device })
    }
}

/// Progress of a participant through the conditions.
pub(super) struct Course<'a> {
    pub study: &'a Study,
    /// Device with S1's frame on this participant; it determines the commands of all conditions.
    pub own: Player,
    pub seed: u64,
    pub conditions: Vec<Condition>,
}

impl Course<'_> {
    /// Runs condition `name` on `person`: stimulates the commands with `player` and stores the
    /// result, with table 1 for the paper's conditions. `order` selects the random order of the
    /// commands. Returns the smallest fraction of its force that fatigue has left in any muscle.
    pub fn run(
        &mut self,
        (name, order): (&'static str, u64),
        person: &mut Participant,
        (player, method): (&Player, Method),
    ) -> Result<f64, EndpointError> {
        let commands = person.commands(self.study, &self.own.device, order);
        let targets = person.stimulate_commands(self.study, (&player.device, method), &commands)?;
        let is_papers = name.starts_with('C');
        let table = is_papers.then(|| (player, random::word(self.seed, order)));
        let found = condition(self.study, name, targets, table)?;
        self.conditions.push(found);
        let left = person.arm.freshness().into_iter().fold(1.0, f64::min);
        person.pause(self.study.protocol.pause_s);
        Ok(left)
    }
}
