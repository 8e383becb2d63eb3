//! A wearer of one's own, from a file: sizes, thresholds and, if they are known, places of
//! electrodes.

use super::error::TwoPointsError;
use super::participant::{DEVICE_V, Participant};
use super::study::ROUND;
use hal_sim::body::hand::HandSpec;
use hal_sim::body::hand::field::Pad;
use serde::de::Error;
use serde::{Deserialize, Deserializer};
use std::path::Path;

/// The longest file read.
const LARGEST_BYTES: u64 = 1 << 20;
/// Elbow to tip of the hand, and around the forearm, m: adults, with room on both sides
/// (assumed).
const REACH_M: [f64; 2] = [0.30, 0.60];
const AROUND_M: [f64; 2] = [0.15, 0.45];
/// Lowest threshold, V: a step of the searches.
const LEAST_V: f64 = 2.0;

/// What a file says.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Own {
    name: String,
    reach_m: f64,
    around_m: f64,
    #[serde(default, deserialize_with = "three")]
    thresholds_v: Option<[f64; 3]>,
    #[serde(default, deserialize_with = "three")]
    pads_mm: Option<[Place; 3]>,
}

/// A place, mm: along and around, and nothing more.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(try_from = "Vec<f64>")]
struct Place([f64; 2]);

impl TryFrom<Vec<f64>> for Place {
    type Error = String;

    fn try_from(all: Vec<f64>) -> Result<Self, String> {
        let place = <[f64; 2]>::try_from(all);
        place
            .map(Self)
            .map_err(|all| format!("a place has {} numbers, wanted are 2", all.len()))
    }
}

/// Exactly three, of A, B and the extensor's point: an array alone would take more.
fn three<'de, D: Deserializer<'de>, T: Deserialize<'de>>(
    reader: D,
) -> Result<Option<[T; 3]>, D::Error> {
    let three = <[T; 3]>::try_from(Vec::<T>::deserialize(reader)?);
    three.map(Some).map_err(|all| {
        let count = all.len();
        D::Error::custom(format!(
            "{count} values, wanted are 3: of A, B and the extensor's point"
        ))
    })
}

/// The wearer of this file, and its text.
///
/// # Errors
/// E626: it cannot be read. E625: everything that is wrong with it.
pub fn own(path: &Path) -> Result<(Participant, String), TwoPointsError> {
    let file = path.display().to_string();
    let unreadable = |why: String| TwoPointsError::Unreadable(file.clone(), why);
    let is = path.metadata().map_err(|e| unreadable(e.to_string()))?;
    if !is.is_file() || is.len() > LARGEST_BYTES {
        return Err(unreadable("no regular file of at most 1 MiB".into()));
    }
    let text = std::fs::read_to_string(path).map_err(|e| unreadable(e.to_string()))?;
    let own: Own = toml::from_str(&text).map_err(|e| {
        let line = e
            .span()
            .map(|at| text[..at.start].matches('\n').count() + 1);
        let line = line.map_or_else(String::new, |line| format!("line {line}: "));
        TwoPointsError::Wearer(file.clone(), format!("{line}{}", e.message()))
    })?;
    let wrong = own.mistakes();
    if !wrong.is_empty() {
        return Err(TwoPointsError::Wearer(file, wrong.join("; ")));
    }
    let participant = Participant {
        name: own.name,
        reach_m: own.reach_m,
        around_m: own.around_m,
        thresholds_v: own.thresholds_v,
        pads_m: own
            .pads_mm
            .map(|all| all.map(|Place(at)| at.map(|mm| 1e-3 * mm))),
        paper: None,
    };
    Ok((participant, text))
}

impl Own {
    /// Everything that is wrong.
    fn mistakes(&self) -> Vec<String> {
        let mut wrong = Vec::new();
        if self.name.is_empty() || !self.name.chars().all(|c| c.is_alphanumeric() || c == '-') {
            wrong.push("`name` must be letters, digits and hyphens".to_owned());
        }
        for (field, value, [low, high]) in [
            ("reach_m", self.reach_m, REACH_M),
            ("around_m", self.around_m, AROUND_M),
        ] {
            if !(low..=high).contains(&value) {
                wrong.push(format!("`{field}` is {value}, allowed is {low} to {high}"));
            }
        }
        match self.thresholds_v {
            None => wrong.push(
                "`thresholds_v` is missing: measure those of A, B and the extensor's point, V"
                    .to_owned(),
            ),
            Some(all) => {
                for (name, v) in ["A", "B", "the extensor's point"].into_iter().zip(all) {
                    if !(LEAST_V..=DEVICE_V).contains(&v) {
                        wrong.push(format!(
                            "the threshold of {name} is {v} V, searches go from {LEAST_V} to \
                             {DEVICE_V} V, the device's 20 mA into 2 kΩ"
                        ));
                    }
                }
            }
        }
        if let Some(pads) = self.pads_mm.filter(|_| wrong.is_empty()) {
            wrong.extend(self.misplaced(pads));
        }
        wrong
    }

    /// Which electrodes lie off the forearm, or on another.
    fn misplaced(&self, pads_mm: [Place; 3]) -> Vec<String> {
        let spec = HandSpec::nominal(self.reach_m, self.around_m, 0);
        let points = pads_mm.map(|Place([x_mm, y_mm])| Pad {
            x_m: 1e-3 * x_mm,
            y_m: 1e-3 * y_mm,
            shape: ROUND,
        });
        let wrong = spec.misplaced(&points).into_iter();
        wrong.map(|it| it.to_string()).collect()
    }
}
