//! Random sessions of simulated arms, and the session with which the cost of an arm is counted.

use super::DetailError;
use hal_sim::random::Random;
use host_core::choice::with_arm_step;
use host_core::run::SessionFile;
use host_core::session::Session;
use std::f64::consts::TAU;
use toml::{Table, Value};

/// Session with which the cost of an arm is counted, and from which the random ones are made.
const SHIPPED: &str = include_str!("../../../sessions/endpoint_arm.toml");
/// Supports of a random arm, as a session file names them.
const HELD: [&str; 2] = ["cuff", "freely"];
/// Returns random session `index` of `seed` with the support of its arm: a random arm in a random
/// posture follows forces at the hand, along straight lines between random ones. The device may end
/// it early, because it refuses a posture outside the arm's ranges and forces that the muscles
/// cannot exert; each `attempt` is another session.
///
/// # Errors
/// Fails if the session is invalid.
pub(super) fn session(
    seed: u64,
    index: usize,
    attempt: usize,
) -> Result<(&'static str, Session), DetailError> {
    let place = (index + 100_000 * attempt) as u64;
    let mut random = Random::new(seed.wrapping_mul(1_000_003) + place);
    let held = HELD[index % HELD.len()];
    let text = text(held, &mut random)?;
    let file = SessionFile::parse("drawn.toml", &text).map_err(DetailError::invalid)?;
    Ok((held, file.session))
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
        let direction = [across * libm::cos(turn), across * libm::sin(turn), height];
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
