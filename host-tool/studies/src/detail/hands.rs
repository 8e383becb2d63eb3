//! Random sessions of simulated hands, and the session with which the cost of a hand is counted.

use super::DetailError;
use crate::hamana2022::{Method, Participants, Population};
use crate::ladder::DrawError;
use hal_sim::random::Random;
use host_core::choice::{UNITS, with_units};
use host_core::run::SessionFile;
use host_core::session::Session;
use toml::Table;

/// Largest number of random forearms that are tried for one session. Not every forearm has points
/// and voltages that move the index finger alone.
const ATTEMPTS: u64 = 50;

/// Returns random session `index` of `seed`, with its wearer and method: one or two points of a
/// random forearm follow a sine for some seconds under the program's default controller.
///
/// # Errors
/// Fails if a declaration of the program cannot be read or no forearm can be controlled.
pub(super) fn session(
    seed: u64,
    index: usize,
    (population, participants): (&Population, &Participants),
) -> Result<(String, Method, Session), DetailError> {
    let mut random = Random::new(seed.wrapping_mul(1_000_003) + index as u64);
    let participant = &participants.all[index % participants.all.len()];
    let method = Method::ALL[(random.unit() * 3.0) as usize];
    let duration_s = random.log_between(4.0, 10.0);
    let amplitude_deg = random.between(10.0, 40.0);
    let hz = random.log_between(0.1, 0.5);
    let change = |table: &mut Table| {
        table.insert("duration_s".into(), round(duration_s).into());
        table.remove("measure");
        let setpoints = table.get_mut("setpoints")?.as_table_mut()?;
        setpoints.insert("amplitude_deg".into(), round(amplitude_deg).into());
        setpoints.insert("frequency_hz".into(), round(hz).into());
        Some(())
    };
    for attempt in 0..ATTEMPTS {
        let draw = (seed, index as u64 + 100_000 * attempt);
        let Ok(wearer) = participants.draw(participant, population, draw)? else {
            continue;
        };
        let file = wearer.session_file(population, (method, "recommended"), draw.1, change)?;
        if let Ok(file) = file {
            return Ok((participant.name.clone(), method, file.session));
        }
    }
    Err(DetailError::Draw(DrawError {
        index,
        why: format!("none of {ATTEMPTS} random forearms can be controlled"),
    }))
}

/// Rounds to three decimals, as a session file has them.
fn round(value: f64) -> f64 {
    (value * 1e3).round() / 1e3
}

/// Session with which the cost of a hand is counted.
const COUNTED: &str = include_str!("../../../sessions/hamana_exp4_two_point.toml");

/// Returns the numbers of motor units whose cost is counted: every unit of the session's wearer and
/// the smaller ones that are tried.
///
/// # Errors
/// Fails if the session is invalid.
pub(super) fn counted_units(counted_s: f64) -> Result<Vec<u32>, DetailError> {
    let session = counted_session(counted_s)?.session;
    let every = session.hand().map_or(0, |hand| hand.spec.units);
    let fewer = UNITS.into_iter().filter(|units| *units < every);
    let numbers = std::iter::once(every).chain(fewer);
    Ok(numbers.map(|units| units as u32).collect()) // at most 256
}

/// Returns the first `counted_s` seconds of the counted session with this number of motor units per
/// pool.
///
/// # Errors
/// Fails if the session is invalid.
pub(super) fn counted(units: u32, counted_s: f64) -> Result<SessionFile, DetailError> {
    let mut file = counted_session(counted_s)?;
    file.session = with_units(&file.session, units as usize);
    Ok(file)
}

fn counted_session(counted_s: f64) -> Result<SessionFile, DetailError> {
    let mut table: Table = COUNTED
        .parse()
        .map_err(DetailError::invalid::<toml::de::Error>)?;
    table.insert("duration_s".into(), counted_s.into());
    table.remove("measure"); // its window lies later
    let text = toml::to_string(&table).map_err(DetailError::invalid)?;
    SessionFile::parse("hand.toml", &text).map_err(DetailError::invalid)
}
