//! Judges the number of motor units that `[fidelity]` chooses for a simulated hand, on random
//! sessions, and plays the session with which its cost is counted.
//!
//! Fixed before the first judged run, and not changed because of its results.

use crate::hamana2022::{Method, Participants, Population, TwoPointsError};
use crate::ladder::DrawError;
use hal_sim::random::Random;
use host_core::choice::{Effect, PlayError, SEED, UNITS, coarsest, try_units, with_units};
use host_core::run::{DeviceName, SessionFile, run};
use host_core::session::{Session, Share};
use rayon::prelude::*;
use std::sync::atomic::{AtomicUsize, Ordering};
use toml::Table;

/// Seed of the sessions on which the choice is judged.
pub const JUDGED: u64 = 2_027;
/// Seed of the sessions that were used while the choice was developed; they are not judged.
pub const DEVELOPMENT: u64 = 8;
/// Number of sessions on which the choice is judged.
pub const SESSIONS: usize = 200;
/// Noise seeds with which `[fidelity]` chooses.
const CHOSEN: [u64; 2] = [SEED, SEED + 1];
/// Noise seed of the simulated wearer on which a choice is judged. The choice itself was made with
/// other seeds.
pub const NOISE: u64 = 101;
/// Tolerances at which the choice is judged: 1, 3, 10 and 30 %.
pub const TOLERANCES: [Share; 4] = [Share(100), Share(300), Share(1_000), Share(3_000)];
/// Largest number of random forearms that are tried for one session. Not every forearm has points
/// and voltages that move the index finger alone.
const ATTEMPTS: u64 = 50;

/// Reason why a session was not judged.
#[derive(Debug, thiserror::Error)]
pub enum DetailError {
    /// A hand is invalid, or its searches failed.
    #[error(transparent)]
    Hand(#[from] TwoPointsError),
    /// The session cannot be simulated.
    #[error(transparent)]
    Play(#[from] PlayError),
    /// No random forearm has a session.
    #[error(transparent)]
    Draw(#[from] DrawError),
}

/// A random session with the errors of each number of motor units.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// Index of the session, from 0.
    pub session: usize,
    /// Participant of Hamana 2022 after whom the forearm is generated.
    pub wearer: String,
    pub method: Method,
    /// Length of the session, s.
    pub duration_s: f64,
    /// Errors with the noise with which the choice is made, largest number of units first.
    pub tried: Vec<Effect>,
    /// Errors with the noise with which the choice is judged.
    pub judged: Vec<Effect>,
}

/// Returns random session `index` of `seed`, with its wearer and method: one or two points of a
/// random forearm follow a sine for some seconds under the program's default controller.
///
/// # Errors
/// Fails if a declaration of the program cannot be read or no forearm can be controlled.
pub fn session(
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

/// Judges the first `count` sessions of `seed`; `step` receives the finished part, 0 to 1.
///
/// # Errors
/// Fails if a session cannot be generated or simulated.
pub fn campaign(
    seed: u64,
    count: usize,
    step: impl Fn(f64) + Sync,
) -> Result<Vec<Row>, DetailError> {
    let population = Population::load_embedded()?;
    let participants = Participants::load(None)?;
    let done = AtomicUsize::new(0);
    let rows = (0..count).into_par_iter().map(|index| {
        let (wearer, method, session) = session(seed, index, (&population, &participants))?;
        let row = Row {
            session: index,
            wearer,
            method,
            duration_s: session.duration_us as f64 * 1e-6,
            tried: try_units(&session, &CHOSEN)?,
            judged: try_units(&session, &[NOISE])?,
        };
        let done = done.fetch_add(1, Ordering::Relaxed) + 1;
        step(done as f64 / count as f64);
        Ok(row)
    });
    rows.collect()
}

/// Verdict on the number of motor units that is chosen at one tolerance. Errors are shares of the
/// reference angle's range.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Verdict {
    /// Chosen number of motor units per pool.
    pub units: u32,
    /// Error of this number with the noise with which the choice is judged.
    pub error: f64,
    /// Error of the next smaller number; `None` if there is none.
    pub fewer: Option<f64>,
}

impl Row {
    /// Returns the verdict on the choice at a tolerance.
    #[must_use]
    pub fn verdict(&self, tolerance: Share) -> Option<Verdict> {
        let chosen = coarsest(&self.tried, tolerance.fraction())?;
        let place = self
            .judged
            .iter()
            .position(|effect| effect.setting == chosen.setting)?;
        Some(Verdict {
            units: chosen.setting,
            error: self.judged[place].error,
            fewer: self.judged.get(place + 1).map(|effect| effect.error),
        })
    }
}

/// Counts over all judged sessions at one tolerance.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct Summary {
    /// Number of sessions.
    pub sessions: usize,
    /// Number of sessions in which the error of the chosen number is within the tolerance.
    pub within: usize,
    /// Number of sessions for which a smaller number than the chosen one exists.
    pub with_fewer: usize,
    /// Number of `with_fewer` sessions in which the next smaller number exceeds the tolerance, so
    /// that the choice was necessary.
    pub fewer_fails: usize,
}

impl Summary {
    /// Counts the rows at one tolerance.
    #[must_use]
    pub fn from_rows(rows: &[Row], tolerance: Share) -> Self {
        let limit = tolerance.fraction();
        let mut sum = Self::default();
        for verdict in rows.iter().filter_map(|row| row.verdict(tolerance)) {
            sum.sessions += 1;
            sum.within += usize::from(verdict.error <= limit);
            sum.with_fewer += usize::from(verdict.fewer.is_some());
            sum.fewer_fails += usize::from(verdict.fewer.is_some_and(|error| error > limit));
        }
        sum
    }
}

/// Formats all rows as the table docs/charts/hand_detail.csv.
#[must_use]
pub fn csv(rows: &[Row]) -> String {
    let mut out = "session,wearer,method,duration_s".to_owned();
    let numbers: Vec<u32> = rows.first().map_or_else(Vec::new, |row| {
        row.tried.iter().map(|effect| effect.setting).collect()
    });
    for kind in ["tried", "judged"] {
        for units in &numbers {
            out.push_str(&format!(",{kind}_{units}_pct"));
        }
    }
    out.push('\n');
    for row in rows {
        out.push_str(&format!(
            "{},{},{},{:.3}",
            row.session,
            row.wearer,
            row.method.name(),
            row.duration_s
        ));
        for effect in row.tried.iter().chain(&row.judged) {
            out.push_str(&format!(",{:.4}", effect.error * 100.0));
        }
        out.push('\n');
    }
    out
}

/// Session with which the cost of a hand is counted.
const COUNTED: &str = include_str!("../../../sessions/hamana_exp4_two_point.toml");
/// Length of that session, s.
pub const COUNTED_S: f64 = 4.0;

/// Returns the numbers of motor units whose cost is counted: every unit of the session's wearer and
/// the smaller ones that are tried.
///
/// # Errors
/// Fails if the session is invalid.
pub fn counted_units() -> Result<Vec<usize>, DetailError> {
    let session = counted_session()?.session;
    let every = session.hand().map_or(0, |hand| hand.spec.units);
    let fewer = UNITS.into_iter().filter(|units| *units < every);
    Ok(std::iter::once(every).chain(fewer).collect())
}

/// Plays the session with this number of motor units per pool once, for a program that counts
/// instructions.
///
/// # Errors
/// Fails if the session is invalid or ends early.
pub fn play_counted(units: usize) -> Result<(), DetailError> {
    let mut file = counted_session()?;
    file.session = with_units(&file.session, units);
    let port = DeviceName::Native.open(&file.session, SEED);
    let (outcome, _) = run(&file, port.map_err(invalid)?, None, |_: f64| ());
    outcome
        .error
        .map_or(Ok(()), |error| Err(invalid(error).into()))
}

fn counted_session() -> Result<SessionFile, TwoPointsError> {
    let mut table: Table = COUNTED.parse().map_err(invalid::<toml::de::Error>)?;
    table.insert("duration_s".into(), COUNTED_S.into());
    table.remove("measure"); // its window lies later
    let text = toml::to_string(&table).map_err(invalid)?;
    SessionFile::parse("hand.toml", &text).map_err(invalid)
}

fn invalid<E: std::fmt::Display>(error: E) -> TwoPointsError {
    TwoPointsError::Declaration(format!(
        "the session with which the cost of a hand is counted: {error}"
    ))
}
