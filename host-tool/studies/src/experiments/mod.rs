//! The declarations of papers' protocols that are built into the program.
//!
//! Finds an experiment by its name, or loads one from a user's file. `laboratory` runs it; `cli`
//! has the command.

use crate::catalog;
use crate::laboratory::{Experiment, LaboratoryError};
use host_core::wearer::builtin_wearer;
use std::path::Path;

/// File name and text of every declaration.
#[rustfmt::skip]
pub const DECLARATIONS: [(&str, &str); 8] = [
    ("hamana-4.toml", include_str!("../../../experiments/hamana-4.toml")),
    ("harris-wall.toml", include_str!("../../../experiments/harris-wall.toml")),
    ("harris-wall-decides.toml", include_str!("../../../experiments/harris-wall-decides.toml")),
    ("harris-wall-gentle.toml", include_str!("../../../experiments/harris-wall-gentle.toml")),
    ("harris-wall-why.toml", include_str!("../../../experiments/harris-wall-why.toml")),
    ("harris-wall-yields.toml", include_str!("../../../experiments/harris-wall-yields.toml")),
    ("open-trains.toml", include_str!("../../../experiments/open-trains.toml")),
    ("setpoint-rate.toml", include_str!("../../../experiments/setpoint-rate.toml")),
];

macro_rules! sessions {
    ($($file:literal)*) => {
        &[$((concat!("../sessions/", $file), include_str!(concat!("../../../sessions/", $file)))),*]
    };
}

/// File name and text of each session that the declarations modify.
const SESSIONS: &[(&str, &str)] = sessions![
    "hamana_exp4_one_point_a.toml"
    "hamana_exp4_one_point_b.toml"
    "hamana_exp4_two_point.toml"
    "hamana_exp4_two_point_finger.toml"
    "harris_wall/3_pre_wall_co_contraction.toml"
    "open_finger.toml"
];

/// Returns the names of the built-in experiments that [`load_experiment`] accepts.
pub fn names() -> impl Iterator<Item = &'static str> {
    DECLARATIONS
        .iter()
        .filter_map(|(file, _)| file.strip_suffix(".toml"))
}

/// Returns the sorted names of all studies that a command accepts, whether a declaration or a
/// program defines them.
#[must_use]
pub fn all_study_names() -> Vec<&'static str> {
    let mut names: Vec<_> = names().chain(catalog::names()).collect();
    names.sort_unstable();
    names.dedup();
    names
}

/// Loads an experiment: a built-in one by its name, or a declaration file by its path, with the
/// sessions beside the file.
///
/// # Errors
/// Fails if there is no such experiment or its files are invalid.
pub fn load_experiment(name: &str) -> Result<Experiment, LaboratoryError> {
    let own = format!("{name}.toml");
    if let Some((file, text)) = DECLARATIONS.iter().find(|(file, _)| *file == own) {
        return Ok(Experiment::new(file, text, &embedded_text)?.with_name(name));
    }
    if Path::new(name)
        .extension()
        .is_none_or(|name| name != "toml")
    {
        let (name, known) = (name.to_owned(), all_study_names().join(", "));
        return Err(LaboratoryError::Unknown { name, known });
    }
    from_file(Path::new(name))
}

/// Returns the text of a built-in session or wearer file by its path relative to the declaration.
fn embedded_text(path: &str) -> Result<String, LaboratoryError> {
    let session = SESSIONS.iter().find(|(file, _)| *file == path);
    let wearer = || path.strip_prefix("../wearers/").and_then(builtin_wearer);
    let text = session.map(|(_, text)| *text).or_else(wearer);
    let absent = || std::io::Error::other("no built-in file has this name");
    let text = text.ok_or_else(|| LaboratoryError::File(path.to_owned(), absent()))?;
    Ok(text.to_owned())
}

fn from_file(path: &Path) -> Result<Experiment, LaboratoryError> {
    let file = path.file_name().unwrap_or_default().to_string_lossy();
    let text = read(path).map_err(|error| LaboratoryError::unreadable(path, &error))?;
    let beside = path.parent().unwrap_or(Path::new("."));
    Experiment::new(&file, &text, &|session| read(&beside.join(session)))
}

fn read(path: &Path) -> Result<String, LaboratoryError> {
    let text = host_core::session::Session::text(path)?;
    Ok(text)
}
