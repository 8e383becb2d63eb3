//! Runs experiment 4 (Hamana 2022, III-D) on a random hand: the device follows a sine with one
//! point or with two.

use super::error::TwoPointsError;
use super::population::Population;
use super::voltages::STEP_V;
use super::wearers::Wearer;
use firmware::safety::limits::VOLTAGE_STAGE_LIMITER;
use hal_sim::body::hand::spec::{A, B};
use host_core::analysis::metrics_without_lag;
use host_core::record::Sample;
use host_core::run::{DeviceName, SessionFile, run};
use host_core::session::BodySpec;
use serde::{Deserialize, Serialize};
use toml::{Table, Value};

/// Points that are pulsed, in the paper's order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Method {
    /// Point A alone.
    A,
    /// Point B alone.
    B,
    /// Both points, conducted, B 2 ms after A.
    Two,
}

impl Method {
    /// All methods, in the paper's order.
    pub const ALL: [Self; 3] = [Self::A, Self::B, Self::Two];

    /// Returns the name as tables show it.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::A => "A",
            Self::B => "B",
            Self::Two => "two",
        }
    }

    const fn session(self) -> &'static str {
        match self {
            Self::A => include_str!("../../../sessions/hamana_exp4_one_point_a_finger.toml"),
            Self::B => include_str!("../../../sessions/hamana_exp4_one_point_b_finger.toml"),
            Self::Two => include_str!("../../../sessions/hamana_exp4_two_point_finger.toml"),
        }
    }
}

/// Result of one trial.
#[derive(Clone, Debug, PartialEq)]
pub struct TrialTracking {
    /// RMSE from 10 to 30 s, °.
    pub rmse_deg: f64,
    /// Time, s, reference and measured angle, °, with no more rows than a picture can show.
    pub course: Vec<[f64; 3]>,
}

/// Largest number of rows of [`TrialTracking::course`].
const ROWS: usize = 600;

/// Names of the compared controllers in session files: the paper's, then the program's default.
pub const LAWS: [&str; 2] = ["paper", "recommended"];

/// Threshold and largest voltage of A, B and the extensor's point, V.
type Ranges = [[f64; 2]; 3];

impl Wearer {
    /// Returns threshold and largest voltage of A, B and the extensor's point with this method, V.
    /// With two points, the thresholds are the ratio r times the largest voltages; `None` if both
    /// points together bend the finger at no ratio.
    #[must_use]
    pub fn ranges_v(&self, method: Method) -> Option<[[f64; 2]; 3]> {
        let Self { voltages, .. } = self;
        let low_v = match method {
            Method::A | Method::B => voltages.threshold_v,
            Method::Two => {
                let r = voltages.ratio?;
                voltages.most_v.map(|most| r * most)
            }
        };
        let range = |point: usize| [low_v[point], voltages.most_v[point]];
        Some([range(0), range(1), self.extensor_v?])
    }

    /// Returns [`Self::ranges_v`], limited to the voltages that the device can apply to the
    /// measured load. Returns the reason if nothing remains of the range of a used point.
    fn device_ranges_v(&self, method: Method) -> Result<Result<Ranges, String>, TwoPointsError> {
        let Some(mut ranges) = self.ranges_v(method) else {
            return Ok(Err("both points together move nothing".to_owned()));
        };
        for (point, name) in ["A", "B", "the extensor's point"].into_iter().enumerate() {
            let is_used = match method {
                Method::A => point != B,
                Method::B => point != A,
                Method::Two => true,
            };
            let end_v =
                1e-6 * f64::from(VOLTAGE_STAGE_LIMITER.get()) * self.hand.load_ohm(point)?;
            let [low_v, most_v] = &mut ranges[point];
            *most_v = most_v.min((end_v / STEP_V).floor() * STEP_V);
            if is_used && *most_v <= *low_v {
                let why = "the threshold lies above what the device gives through the load";
                return Ok(Err(format!("{why} of {name}")));
            }
        }
        Ok(Ok(ranges))
    }

    /// Runs trial `number` of experiment 4 on `device`, with this method and controller. Returns
    /// the reason if the trial has no result.
    ///
    /// # Errors
    /// Fails if the program's own session is invalid.
    pub fn track(
        &self,
        population: &Population,
        (method, law): (Method, &str),
        (device, number): (&DeviceName, u64),
    ) -> Result<Result<TrialTracking, String>, TwoPointsError> {
        let file = self.session_file(population, (method, law), number, |_| Some(()))?;
        Ok(file.and_then(|file| play_session(&file, device, number)))
    }

    /// Returns the session of trial `number` of experiment 4 with this method and controller, after
    /// `change` has changed the table of its file. Returns the reason if there is no such session.
    ///
    /// # Errors
    /// Fails if the program's own session is invalid or `change` returns `None`.
    pub fn session_file(
        &self,
        population: &Population,
        (method, law): (Method, &str),
        number: u64,
        change: impl FnOnce(&mut Table) -> Option<()>,
    ) -> Result<Result<SessionFile, String>, TwoPointsError> {
        let ranges = match self.device_ranges_v(method)? {
            Ok(ranges) => ranges,
            Err(why) => return Ok(Err(why)),
        };
        let text = adapt_session(method.session(), ranges, law, change).ok_or_else(|| {
            TwoPointsError::Declaration(
                "the session of experiment 4 cannot be adapted to the wearer".to_owned(),
            )
        })?;
        let mut file = match SessionFile::parse("hamana-4.toml", &text) {
            Ok(file) => file,
            // The session is invalid if threshold and largest voltage are equal, because nothing
            // can be controlled.
            Err(error) => return Ok(Err(error.to_string())),
        };
        let fitted = self.fit_for_trial(population, number);
        file.session.body = Some(BodySpec::Hand(Box::new(fitted)));
        Ok(Ok(file))
    }
}

fn play_session(
    file: &SessionFile,
    device: &DeviceName,
    seed: u64,
) -> Result<TrialTracking, String> {
    let port = device.open(&file.session, seed);
    let (outcome, _) = run(file, port.map_err(|e| e.to_string())?, None, |_: f64| ());
    if let Some(error) = outcome.error {
        return Err(error.to_string());
    }
    let metrics = metrics_without_lag(&outcome.trial);
    let metrics = metrics.ok_or_else(|| "nothing was measured".to_owned())?;
    let samples = &outcome.trial.samples;
    let rows = samples.iter().step_by(samples.len().div_ceil(ROWS).max(1));
    let row = |sample: Sample| Some([sample.t_s, sample.target_deg?, sample.measured_deg?]);
    Ok(TrialTracking {
        rmse_deg: metrics.rmse_deg,
        course: rows.filter_map(row).collect(),
    })
}

/// Enters a wearer's voltages and the controller `law` into the session `text`, after `change`;
/// `None` if the session lacks a field that is replaced.
fn adapt_session(
    text: &str,
    ranges_v: [[f64; 2]; 3],
    law: &str,
    change: impl FnOnce(&mut Table) -> Option<()>,
) -> Option<String> {
    let mut table: Table = text.parse().ok()?;
    change(&mut table)?;
    let range = |number: &Value| ranges_v.get(usize::try_from(number.as_integer()? - 1).ok()?);
    for channel in table.get_mut("channel")?.as_array_mut()? {
        let channel = channel.as_table_mut()?;
        let most_v = range(channel.get("number")?)?[1];
        // The paper's controller switches its voltages without a ramp.
        for field in ["limit", "start"] {
            channel.insert(field.into(), most_v.into());
        }
        channel.remove("muscle");
    }
    let joint = table.get_mut("joint")?.as_table_mut()?;
    joint.insert("law".into(), law.into());
    let bound = |point: &mut Value| {
        let point = point.as_table_mut()?;
        let [low_v, most_v] = *range(point.get("channel")?)?;
        // A session resolves voltages to 1 mV.
        point.insert("threshold".into(), ((1e3 * low_v).round() / 1e3).into());
        point.insert("max".into(), most_v.into());
        Some(())
    };
    bound(joint.get_mut("extensor")?)?;
    for point in joint.get_mut("flexors")?.as_array_mut()? {
        bound(point)?;
    }
    toml::to_string(&table).ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use host_core::session::Session;

    #[test]
    fn a_session_takes_the_wearers_voltages() {
        // The extensor's voltages are below the `start` of the shipped session.
        let ranges = [[19.6, 28.0], [25.2, 36.0], [14.0, 20.0]];
        for (method, channels) in Method::ALL.into_iter().zip([2, 2, 3]) {
            let text = adapt_session(method.session(), ranges, "paper", |_| Some(())).unwrap();
            let session = Session::parse("it", &text).unwrap();
            assert_eq!(session.channels.len(), channels);
            let joint = session.joint.unwrap();
            let point = &joint.flexors[usize::from(method == Method::Two)];
            let most_v = if method == Method::A { 28_000 } else { 36_000 };
            assert_eq!(point.max.get(), most_v, "{method:?}");
            let starts = session
                .channels
                .iter()
                .map(|channel| channel.spec.start == channel.spec.limit);
            assert!(
                starts.into_iter().all(|is_settled| is_settled),
                "{method:?}"
            );
            assert_eq!(joint.extensor.threshold.get(), 14_000);
        }
    }
}
