//! Map of lost setpoints: how well the device's setpoint track follows the reference, holding or
//! extrapolating, and how that affects the finger.

use super::chance::uniform;
use super::finger::{Loop, angle, default_one_point, one_point, quiet_finger};
use super::{Axis, Cell, Class, Layout, Map, Panels};
use crate::tracking::wearer::SHIPPED_HOLD;
use firmware::control::setpoint::SetpointTrack;
use firmware::control::{HoldPolicy, JointSpec, LawSpec};
use firmware::units::Micros;
use std::f64::consts::TAU;

/// Rate at which setpoints are sent, Hz: that of the glove in Hamana 2022.
const RATE_HZ: f64 = 90.0;
/// Middle of the sinusoidal reference, ° (assumed).
const MIDDLE_DEG: f64 = 45.0;
/// Amplitude of the reference, ° (Hamana 2022, experiment 4).
const SWING_DEG: f64 = 40.0;
/// Frequency of the reference, Hz (Hamana 2022, experiment 4).
const TARGET_HZ: f64 = 0.2;
/// Part of a trial over which the error is computed, ms from its start.
const SCORED_MS: std::ops::Range<u32> = 10_000..30_000;
/// Number of seeds over which the mean square of a cell is averaged: for the track alone, then for
/// the finger. Long gaps are rare and contribute most, so that results of few seeds scatter.
const SEEDS: [u64; 2] = [16, 3];
/// Shares of lost setpoints in the columns, %.
const LOSS: [u32; 20] = [
    0, 5, 10, 15, 20, 25, 30, 35, 40, 45, 50, 55, 60, 65, 70, 75, 80, 85, 90, 95,
];
/// Longest extrapolations of the rows, ms; 0 means that the last setpoint is held.
const REACH: [u16; 9] = [0, 10, 20, 50, 100, 200, 300, 500, 1000];
/// Longest extrapolation of the device by default, ms ([`crate::tracking::wearer::SHIPPED_HOLD`]).
const SHIPPED_MS: u16 = match SHIPPED_HOLD {
    HoldPolicy::Extrapolate { max_ms } => max_ms,
    HoldPolicy::Hold => 0,
};

fn reference_deg(t: f64) -> f64 {
    MIDDLE_DEG + SWING_DEG * libm::sin(TAU * TARGET_HZ * t)
}

fn policy(reach_ms: u16) -> HoldPolicy {
    match reach_ms {
        0 => HoldPolicy::Hold,
        max_ms => HoldPolicy::Extrapolate { max_ms },
    }
}

const CLASSES: [Class; 7] = [
    Class::new('.', 0.5, "up to 0.5°", 0),
    Class::new('1', 1.0, "up to 1°", 0),
    Class::new('2', 1.5, "up to 1.5°", 0),
    Class::new('3', 2.0, "up to 2°", 0),
    Class::new('4', 4.0, "up to 4°", 1),
    Class::new('6', 10.0, "up to 10°", 1),
    Class::new('X', f64::INFINITY, "more than 10°", 1),
];

/// Function that builds a joint with one of the device's controllers and with this policy for lost
/// setpoints.
type JointOf = fn(HoldPolicy) -> JointSpec;

/// Returns the panels with their titles: the setpoint track alone (`None`), or the finger under a
/// controller.
fn runs() -> [(&'static str, Option<JointOf>); 3] {
    [
        ("the setpoint track alone", None),
        ("default controller on the finger", Some(default_one_point)),
        ("super-twisting alone on the finger", Some(alone)),
    ]
}

fn alone(hold: HoldPolicy) -> JointSpec {
    one_point(LawSpec::ALONE, hold)
}

/// Computes the map by simulating every cell; `seed` determines which setpoints are lost.
pub fn draw(seed: u64, progress: &mut dyn FnMut(f64)) -> Map {
    let runs = runs();
    let mut lossless = Vec::new();
    let mut panels = Panels::new(runs.len(), progress);
    for (title, joint) in runs {
        let seeds = SEEDS[usize::from(joint.is_some())];
        let rmse = |reach, loss, seed| match joint {
            None => track_rmse_deg(reach, loss, seed),
            Some(joint) => finger_rmse_deg(joint, reach, loss, seed),
        };
        // The error without loss does not come from the loss.
        let floor = joint.map_or(0.0, |_| rmse(SHIPPED_MS, 0, seed));
        if joint.is_some() {
            lossless.push(format!("{floor:.2}° ({title})"));
        }
        panels.add(title.to_owned(), &REACH, &LOSS, |reach, loss| {
            let squares = (0..seeds)
                .map(|n| rmse(*reach, *loss, seed.wrapping_mul(1000).wrapping_add(n)).powi(2));
            let number = (squares.sum::<f64>() / seeds as f64).sqrt();
            let told = libm::hypot(floor, predicted(*reach, *loss));
            Cell::with_prediction(&CLASSES, number, Some(told))
        });
    }
    Map {
        name: "loss",
        title: "Lost setpoints: hold or extrapolate",
        across: Axis::new("setpoints lost", "%", &LOSS, u32::to_string),
        down: Axis::new("longest extrapolation", "ms", &REACH, |r| match r {
            0 => "hold".to_owned(),
            r => r.to_string(),
        }),
        quantity: "RMSE over 10…30 s",
        classes: &CLASSES,
        panels: panels.made,
        layout: Layout::Beside(3),
        theory: "mean square of rate (a - m) + acceleration (a² + g m)/2 is (2°)², a the age \
                 of the newest setpoint, m the part of it that is extrapolated, g the gap before \
                 it; gaps are geometrically distributed. On the finger, the square of the error \
                 without loss is added.",
        notes: vec![format!(
            "Reference 45 ± 40° at 0.2 Hz; setpoints at 90 Hz are lost independently; root mean \
             square over {} seeds (track) and {} seeds (finger). One point, participant P, sensor \
             without noise. RMSE without loss: {}. By default the device extrapolates for \
             {SHIPPED_MS} ms.",
            SEEDS[0],
            SEEDS[1],
            lossless.join(", ")
        )],
    }
}

/// Decides at random which setpoints arrive; the first always does.
struct Frames {
    next: u32,
    loss: f64,
    seed: u64,
}

impl Frames {
    fn new(loss_percent: u32, seed: u64) -> Self {
        Self {
            next: 0,
            loss: f64::from(loss_percent) / 100.0,
            seed,
        }
    }

    /// Returns whether a setpoint arrives in millisecond `ms`; must be called once for each
    /// millisecond.
    fn arrives(&mut self, ms: u32) -> bool {
        if f64::from(ms) / 1000.0 * RATE_HZ < f64::from(self.next) {
            return false;
        }
        self.next += 1;
        self.next == 1 || uniform(self.seed, self.next.into()) >= self.loss
    }
}

/// Returns the RMSE between the setpoint track and the reference, °.
pub fn track_rmse_deg(reach_ms: u16, loss_percent: u32, seed: u64) -> f64 {
    let mut track = SetpointTrack::default();
    let mut frames = Frames::new(loss_percent, seed);
    let mut square = 0.0;
    for ms in 0..SCORED_MS.end {
        let (t, now) = (f64::from(ms) / 1000.0, Micros::new(ms * 1000));
        if frames.arrives(ms) {
            let taken = track.accept(now, now, angle(reference_deg(t)), None);
            taken.expect("setpoints come in order");
        }
        let said = track.value_at(now, policy(reach_ms));
        let said = said.map_or(MIDDLE_DEG, |a| a.get().to_num::<f64>());
        if SCORED_MS.contains(&ms) {
            square += (said - reference_deg(t)).powi(2);
        }
    }
    (square / SCORED_MS.len() as f64).sqrt()
}

/// Returns the RMSE between the finger's true angle and the reference, °.
fn finger_rmse_deg(joint: JointOf, reach_ms: u16, loss_percent: u32, seed: u64) -> f64 {
    let joint = joint(policy(reach_ms));
    let mut finger = Loop::new(quiet_finger(), &joint, seed);
    let mut frames = Frames::new(loss_percent, seed);
    let mut square = 0.0;
    for ms in 0..SCORED_MS.end {
        let t = f64::from(ms) / 1000.0;
        if frames.arrives(ms) {
            finger.setpoint(reference_deg(t));
        }
        let reached = finger.step();
        if SCORED_MS.contains(&ms) {
            square += (reached - reference_deg(t + 1e-3)).powi(2);
        }
    }
    (square / SCORED_MS.len() as f64).sqrt()
}

/// Returns the RMSE between setpoint track and reference that theory predicts, °.
fn predicted(reach_ms: u16, loss_percent: u32) -> f64 {
    /// Number of ages of a setpoint within one period of the stream, as 1 kHz ticks sample it.
    const PLACES: u32 = 11;
    let (period, loss) = (1.0 / RATE_HZ, f64::from(loss_percent) / 100.0);
    let reach = f64::from(reach_ms) / 1000.0;
    let omega = TAU * TARGET_HZ;
    // Mean squares over the sine; its rate and acceleration are uncorrelated.
    let rate_square = (SWING_DEG * omega).powi(2) / 2.0;
    let acceleration_square = rate_square * omega.powi(2);
    // First two moments of a gap of 1, 2, … periods, geometrically distributed.
    let kept = 1.0 - loss;
    let gap = period / kept;
    let gap_square = period.powi(2) * (1.0 + loss) / kept.powi(2);
    let mut square = 0.0;
    let mut share = kept;
    let mut missed = 0.0;
    while share > 1e-9 {
        for place in 0..PLACES {
            let a = period * (missed + f64::from(place) / f64::from(PLACES));
            let m = a.min(reach);
            let bend = (a.powi(4) + 2.0 * a.powi(2) * m * gap + m.powi(2) * gap_square) / 4.0;
            square += share / f64::from(PLACES)
                * (rate_square * (a - m).powi(2) + acceleration_square * bend);
        }
        share *= loss;
        missed += 1.0;
    }
    square.sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn at_half_the_setpoints_lost_extrapolation_keeps_the_finger_and_holding_does_not() {
        for joint in [default_one_point as JointOf, alone] {
            let [hold, extrapolate] =
                [0, SHIPPED_MS].map(|reach| finger_rmse_deg(joint, reach, 55, 1));
            println!("55 % lost: {hold:.2}° held, {extrapolate:.2}° extrapolated");
            assert!(hold > 2.0 && extrapolate < 2.0, "{hold} {extrapolate}");
        }
    }

    #[test]
    fn the_track_alone_errs_as_predicted() {
        for (reach, loss) in [(0, 0), (0, 50), (0, 70), (20, 70), (50, 60), (100, 60)] {
            let squares = (1..=40).map(|seed| track_rmse_deg(reach, loss, seed).powi(2));
            let found = (squares.sum::<f64>() / 40.0).sqrt();
            let ratio = found / predicted(reach, loss);
            assert!(
                (0.85..1.15).contains(&ratio),
                "{reach} ms, {loss} %: {ratio}"
            );
        }
    }
}
