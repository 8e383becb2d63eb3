//! Composes a first session for a wearer file, with one channel for each of its electrodes.

use super::toml_text;
use host_core::session::Unit;
use host_core::wearer::{Electrode, Wearer};
use std::path::{Path, PathBuf};

/// Returns the text of a session for the wearer in `file`. Every channel plays `program` at
/// `amplitude`, or at its motor threshold.
///
/// # Errors
/// Fails if the program is unknown.
pub(super) fn compose(
    wearer: &Wearer,
    file: &str,
    (title, seconds, amplitude, program): (&str, &str, Option<&str>, &str),
) -> Result<String, String> {
    let mut text = format!(
        "title = {}\nduration_s = {seconds}\n\n[wearer]\nfile = {}\nname = {}\n",
        toml_text(title),
        toml_text(file),
        toml_text(&wearer.name)
    );
    let count = wearer.electrodes.len().max(1);
    for (electrode, place) in wearer.electrodes.iter().zip(0_u32..) {
        // The channels take turns within a period.
        let part = f64::from(place) / count as f64;
        let offset_us = (1e6 / electrode.frequency_hz * part).floor();
        text += &channel(electrode, offset_us);
    }
    let pairs = wearer.electrodes.iter().map(|electrode| {
        let threshold = f64::from(electrode.motor_threshold.get()) / 1e3;
        let value = amplitude.map_or_else(|| threshold.to_string(), str::to_owned);
        (electrode.channel.into(), value)
    });
    let channels: Vec<(u32, String)> = pairs.collect();
    // Setpoints twice within the host timeout.
    let rate_hz = (2_000 / u32::from(wearer.limits.host_timeout_ms).max(1)).max(50);
    Ok(text + &super::played::compose(program, &channels, seconds, rate_hz)?)
}

fn channel(electrode: &Electrode, offset_us: f64) -> String {
    let stage = match electrode.unit {
        Unit::Milliampere => "{ kind = \"current\", full_scale_ma = 100.0 }".to_owned(),
        Unit::Volt => format!(
            "{{ kind = \"voltage\", full_scale_v = 150.0, load_ohm = {} }}",
            electrode.load_ohm
        ),
    };
    let muscle = match electrode.muscle {
        Some(_) => "muscle = {}\n",
        None => "",
    };
    format!(
        "\n[[channel]]\nnumber = {}\nname = {}\nstage = {stage}\ntrain = {{ shape = \
         \"biphasic-cathodic-first\", width_us = {}, frequency_hz = {:?}, offset_us = {offset_us} \
         }}\n{muscle}",
        electrode.channel,
        toml_text(&electrode.place),
        electrode.width_us,
        electrode.frequency_hz,
    )
}

/// Returns the path by which a session refers to a wearer file: unchanged if both are relative to
/// the same folder, otherwise absolute.
pub(super) fn wearer_path_in_session(session: &Path, wearer: &Path) -> PathBuf {
    let is_here = session
        .parent()
        .is_none_or(|path| path.as_os_str().is_empty());
    match is_here || wearer.is_absolute() {
        true => wearer.to_owned(),
        false => wearer.canonicalize().unwrap_or_else(|_| wearer.to_owned()),
    }
}
