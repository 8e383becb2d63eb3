//! Random sessions of simulated arms, and the session with which the cost of an arm is counted.

use super::DetailError;
use crate::ladder::DrawError;
use hal_sim::random::Random;
use host_core::choice::{PlayError, SEED, with_arm_step};
use host_core::run::{DeviceName, SessionFile, run};
use host_core::session::Session;
use std::f64::consts::TAU;
use toml::{Table, Value};

/// Session with which the cost of an arm is counted, and from which the random ones are made.
const SHIPPED: &str = include_str!("../../../sessions/endpoint_arm.toml");
/// Supports of a random arm, as a session file names them.
const HELD: [&str; 2] = ["cuff", "freely"];
/// Largest number of sessions that are generated for one that the device plays to its end. It
/// refuses a posture outside the arm's ranges and forces that the muscles cannot exert.
const ATTEMPTS: usize = 50;

/// Returns random session `index` of `seed` with the support of its arm: a random arm in a random
/// posture follows forces at the hand, along straight lines between random ones. Sessions that the
/// device ends early, and those in which no muscle acts, are generated again.
///
/// # Errors
/// Fails if no session can be played.
pub(super) fn session(seed: u64, index: usize) -> Result<(&'static str, Session), DetailError> {
    let mut random = Random::new(seed.wrapping_mul(1_000_003) + index as u64);
    for _ in 0..ATTEMPTS {
        let held = HELD[index % HELD.len()];
        let text = text(held, &mut random)?;
        let file = SessionFile::parse("drawn.toml", &text).map_err(DetailError::invalid)?;
        if acts(&file)? {
            return Ok((held, file.session));
        }
    }
    Err(DetailError::Draw(DrawError {
        index,
        why: format!("none of {ATTEMPTS} random arms could be played"),
    }))
}

fn text(held: &str, random: &mut Random) -> Result<String, DetailError> {
    let mut table = shipped()?;
    let duration_s = random.log_between(3.0, 8.0);
    let rate_hz: i64 = if random.unit() < 0.5 { 200 } else { 20 };
    let mut points = vec![point(0.0, [0.0; 3])];
    let count = 2 + (random.unit() * 5.0) as usize;
    for place in 0..count {
        // One in each part of the session, so that the points are in order of time.
        let at_s = duration_s * (place as f64 + random.between(0.3, 0.9)) / count as f64;
        let height = random.between(-1.0, 1.0);
        let (turn, newton) = (random.between(0.0, TAU), random.log_between(1.0, 8.0));
        let across = (1.0 - height * height).sqrt();
        let direction = [across * turn.cos(), across * turn.sin(), height];
        points.push(point(at_s, direction.map(|part| newton * part)));
    }
    table.insert("duration_s".into(), rounded(duration_s));
    let setpoints = table.get_mut("setpoints").and_then(Value::as_table_mut);
    if let Some(setpoints) = setpoints {
        setpoints.insert("rate_hz".into(), rate_hz.into());
        setpoints.insert("points".into(), points.into());
    }
    let mut body = Table::new();
    body.insert("kind".into(), "arm".into());
    body.insert("held".into(), held.into());
    let drawn = (random.unit() * 1e9) as i64;
    body.insert("drawn".into(), drawn.into());
    for (name, low, high) in [
        ("plane_deg", 20.0, 70.0),
        ("elevation_deg", 30.0, 80.0),
        ("rotation_deg", -20.0, 20.0),
        ("elbow_deg", 50.0, 100.0),
    ] {
        body.insert(name.into(), random.between(low, high).round().into());
    }
    table.insert("body".into(), body.into());
    toml::to_string(&table).map_err(DetailError::invalid)
}

fn point(at_s: f64, force_n: [f64; 3]) -> Value {
    let mut point = Table::new();
    point.insert("at_s".into(), rounded(at_s));
    let force_n: Vec<Value> = force_n.into_iter().map(rounded).collect();
    point.insert("force_n".into(), force_n.into());
    point.into()
}

/// Rounds to three decimals, as a session file has them.
fn rounded(value: f64) -> Value {
    ((value * 1e3).round() / 1e3).into()
}

/// Plays the session. Returns whether it runs to its end and some muscle acts: the true force at the
/// hand differs from zero, or the elbow of an arm that nothing holds turns.
fn acts(file: &SessionFile) -> Result<bool, DetailError> {
    let port = DeviceName::Native.open(&file.session, SEED);
    let (outcome, _) = run(file, port.map_err(PlayError::from)?, None, |_: f64| ());
    let samples = outcome.trial.samples.to_vec();
    let first = samples.first().and_then(|sample| sample.true_deg);
    let has_force = samples.iter().any(|sample| {
        sample
            .hand_true_n
            .iter()
            .flatten()
            .any(|newton| *newton != 0.0)
    });
    let turns = samples.iter().any(|sample| sample.true_deg != first);
    Ok(outcome.error.is_none() && (has_force || turns))
}

/// Returns the first `counted_s` seconds of the counted session with this time step, ms.
///
/// # Errors
/// Fails if the session is invalid.
pub(super) fn counted(step_ms: u32, counted_s: f64) -> Result<SessionFile, DetailError> {
    let mut table = shipped()?;
    table.insert("duration_s".into(), counted_s.into());
    let text = toml::to_string(&table).map_err(DetailError::invalid)?;
    let mut file = SessionFile::parse("arm.toml", &text).map_err(DetailError::invalid)?;
    file.session = with_arm_step(&file.session, step_ms);
    Ok(file)
}

fn shipped() -> Result<Table, DetailError> {
    SHIPPED
        .parse()
        .map_err(DetailError::invalid::<toml::de::Error>)
}
