//! What the true force changes by if the top rung takes another's place.

use super::between::{self, Place};
use super::grid::{
    LOOP_BURSTS_MS, LOOP_RAMPS_MS, LOOP_RATES_MHZ, WORK_BURSTS_MS, WORK_RAMPS_MS, WORK_RATES_MHZ,
    WORK_SESSIONS_S,
};
use super::measured::{Quantity, table};
use super::{Scene, Share, is_measured, rates};
use firmware::muscle::Rung;

/// Added to ramps, whose axis begins at 0, before their logarithm is taken, ms:
/// a ramp that much shorter than the muscle's time constants is a step.
const RAMP_OFFSET_MS: u32 = 20;

/// Between measured scenes a change is taken for larger by this part of it: what
/// drawn scenes (seed 77, not the one of the committed verdicts) were above their
/// neighbours.
const MARGIN: u64 = 32;

/// The most by which the true force is expected to change, at any moment, if the
/// top rung takes this one's place in a loop closed over its prediction; the
/// worst over all ten subjects and true muscles off by 10 %, as a part of the
/// wanted force's peak.
///
/// Between the measured scenes by [`between`]; beyond the ends of an axis its
/// last point counts, but a longer time at work counts in proportion, which is
/// more than fatigue grows. Pulse rates outside the measured ones make the two
/// lowest rungs [`Share::UNKNOWN`]. What they lack of the rested muscle and what
/// they lack for want of fatigue add up by their squares.
#[must_use]
pub fn expected_change(scene: &Scene, rung: Rung) -> Share {
    let rested = match rung {
        Rung::Static | Rung::Lag if !is_measured(scene) => None,
        Rung::Static => rested(scene, 0),
        Rung::Lag => rested(scene, 1),
        Rung::CalciumForce => Some(0),
        Rung::CalciumForceFatigue => return Share(0),
    };
    match (rested, tiring(scene)) {
        (Some(rested), Some(tiring)) if rested.max(tiring) < u16::MAX => {
            let root = (u64::from(rested).pow(2) + u64::from(tiring).pow(2)).isqrt();
            Share(u16::try_from(root + root / MARGIN).unwrap_or(u16::MAX))
        }
        _ => Share::UNKNOWN,
    }
}

/// Where a burst lies among measured ones. A burst of at most a period of the
/// highest rate is a single pulse, however long it is; one of several pulses lies
/// between bursts that are of several at the measured rate below, too.
fn burst(axis: &[u32], rates_mhz: &[u32], scene: &Scene) -> Place {
    let [_, fastest] = rates(scene);
    let period_ms = |mhz: u32| 1_000_000 / mhz.max(1);
    if scene.burst_ms <= period_ms(fastest) {
        return Place::on(axis, 0, 0);
    }
    let below = rates_mhz.partition_point(|&rate| rate <= fastest);
    let measured = rates_mhz.get(below.saturating_sub(1)).copied();
    Place::on(axis, 0, scene.burst_ms).above(axis, period_ms(measured.unwrap_or(fastest)))
}

/// Where its ramps lie. An unbroken muscle's are no longer than half its time at
/// work.
fn ramp(axis: &[u32], scene: &Scene) -> Place {
    let longest = match scene.session_s {
        1.. if scene.burst_ms >= Scene::UNBROKEN => scene.session_s.saturating_mul(500),
        _ => u32::MAX,
    };
    Place::on(axis, RAMP_OFFSET_MS, scene.ramp_ms.min(longest))
}

/// The change that static (0) or lag (1) makes of a rested muscle in this scene.
fn rested(scene: &Scene, candidate: usize) -> Option<u16> {
    let times = [
        burst(&LOOP_BURSTS_MS, &LOOP_RATES_MHZ, scene),
        ramp(&LOOP_RAMPS_MS, scene),
    ];
    let around = rates(scene).map(|rate| Place::on(&LOOP_RATES_MHZ, 0, rate));
    between::value(table(Quantity::Change), times, around, candidate)
}

/// The change that fatigue makes in this scene.
fn tiring(scene: &Scene) -> Option<u16> {
    if scene.session_s == 0 {
        return Some(0);
    }
    let longest = WORK_SESSIONS_S[WORK_SESSIONS_S.len() - 1];
    let times = [
        Place::on(&WORK_SESSIONS_S, 0, scene.session_s),
        burst(&WORK_BURSTS_MS, &WORK_RATES_MHZ, scene),
        ramp(&WORK_RAMPS_MS, scene),
    ];
    let around = rates(scene).map(|rate| Place::on(&WORK_RATES_MHZ, 0, rate));
    let within = between::value(table(Quantity::Tiring), times, around, 0)?;
    let longer = u32::from(within).saturating_mul(scene.session_s.max(longest)) / longest;
    Some(u16::try_from(longer).unwrap_or(u16::MAX))
}
