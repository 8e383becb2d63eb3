//! A participant's way through conditions: commands played by what the device was told, and
//! what a condition came to.

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

/// What one condition of one participant came to.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Condition {
    /// Its name.
    pub name: String,
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

/// A condition of these targets.
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

/// Table 1's row of these targets: currents, as parts of their ranges, to the wrench and to
/// joint torques (equation 8).
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

/// What the device is told, and the device.
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

/// A participant's way through the conditions.
pub(super) struct Course<'a> {
    pub study: &'a Study,
    /// By S1's frame on this participant: what decides the commands.
    pub own: Player,
    pub seed: u64,
    pub conditions: Vec<Condition>,
}

impl Course<'_> {
    /// Stimulates the commands in order `order` by `player`; with table 1 of the paper's
    /// conditions. What tiredness left at least of a muscle.
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
