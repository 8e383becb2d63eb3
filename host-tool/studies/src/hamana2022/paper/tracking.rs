//! Runs every trial of experiment 4 on one random forearm.

use super::Study;
use crate::hamana2022::error::TwoPointsError;
use crate::hamana2022::tracked::{LAWS, Method, TrialTracking};
use crate::hamana2022::wearers::Wearer;
use host_core::session::LawName;
use serde::{Deserialize, Serialize};

/// Result of one trial of experiment 4.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct Trial {
    /// Control law, one of [`LAWS`].
    pub law: String,
    /// Points that were stimulated.
    pub method: Method,
    /// Index of the trial with this law and method, from 0.
    pub number: u64,
    /// RMSE from 10 to 30 s, °, or the reason why there is none.
    pub rmse_deg: Result<f64, String>,
}

/// Angle over time in one trial.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct Course {
    /// Whether both points were stimulated.
    pub is_two: bool,
    /// Whether this is the best trial of its method; otherwise it is the worst.
    pub is_best: bool,
    /// Points that were stimulated.
    pub method: Method,
    /// Index of the trial, from 0.
    pub number: u64,
    /// RMSE from 10 to 30 s, °.
    pub rmse_deg: f64,
    /// Time, s, reference and measured angle, °.
    pub rows: Vec<[f64; 3]>,
}

/// All trials of experiment 4 in one draw.
#[derive(Clone, PartialEq, Debug, Default, Serialize, Deserialize)]
pub struct Tracking {
    /// Trials in the order of law, method and index.
    pub trials: Vec<Trial>,
    /// Best and worst trial with one point and with two, under the paper's controller.
    pub courses: Vec<Course>,
}

impl Study {
    /// Runs all trials of `wearer`. Returns `None` after `goes_on` has returned `false`.
    pub(super) fn tracking(
        &self,
        wearer: &Wearer,
        goes_on: &(dyn Fn() -> bool + Sync),
    ) -> Result<Option<Tracking>, TwoPointsError> {
        let (mut trials, mut tracked) = (Vec::new(), Vec::new());
        for &law in self.laws {
            for method in Method::ALL {
                for number in 0..self.participants.trials {
                    if !goes_on() {
                        return Ok(None);
                    }
                    let trial = (&self.device, number);
                    let track = wearer.track(&self.population, (method, law), trial)?;
                    trials.push(Trial {
                        law: law.to_owned(),
                        method,
                        number,
                        rmse_deg: track
                            .as_ref()
                            .map(|tracking| tracking.rmse_deg)
                            .map_err(Clone::clone),
                    });
                    if let (Ok(track), true) = (track, law == LAWS[0]) {
                        tracked.push((method, number, track));
                    }
                }
            }
        }
        let mut result = Tracking {
            trials,
            courses: Vec::new(),
        };
        result.courses = result.shown_courses(&tracked);
        Ok(Some(result))
    }
}

impl Tracking {
    /// Returns the RMSE of every trial with this law and method, °; `None` if there are no trials
    /// or one of them has no RMSE.
    fn trial_rmse(&self, law: &str, method: Method) -> Option<Vec<f64>> {
        let own = self.trials.iter();
        let own = own.filter(|trial| trial.law == law && trial.method == method);
        let errors_deg: Option<Vec<f64>> = own.map(|trial| trial.rmse_deg.clone().ok()).collect();
        errors_deg.filter(|values| !values.is_empty())
    }

    /// Returns A or B, whichever has the smaller mean RMSE (as in the paper, III-D5), and the RMSE
    /// of its trials, °. A point is not considered if one of its trials has no RMSE.
    #[must_use]
    pub fn one_point_rmse(&self, law: &str) -> Option<(Method, Vec<f64>)> {
        let points = [Method::A, Method::B];
        let known = points.map(|method| Some((method, self.trial_rmse(law, method)?)));
        let known = known.into_iter().flatten();
        known.min_by(|a, b| mean(&a.1).total_cmp(&mean(&b.1)))
    }

    /// Returns the RMSE of every trial with two points, °; `None` if a trial has none.
    #[must_use]
    pub fn two_point_rmse(&self, law: &str) -> Option<Vec<f64>> {
        self.trial_rmse(law, Method::Two)
    }

    /// Returns the mean RMSE over the trials, °: with one point (the better of A and B), then with
    /// two points; `None` where trials have no RMSE.
    #[must_use]
    pub fn means(&self, law: &str) -> [Option<f64>; 2] {
        let one_point = self
            .one_point_rmse(law)
            .map(|(_, errors_deg)| mean(&errors_deg));
        [
            one_point,
            self.two_point_rmse(law).map(|errors_deg| mean(&errors_deg)),
        ]
    }

    /// Lists the reasons why trials have no RMSE, each once and preceded by the methods to which it
    /// applies. The controller is named unless both controllers have the same reason.
    pub(super) fn refused(&self) -> Vec<String> {
        let why = |law: &str, method: Method| {
            let mut own = self.trials.iter();
            own.find_map(|trial| {
                let is = trial.law == law && trial.method == method;
                trial.rmse_deg.as_ref().err().filter(|_| is)
            })
        };
        let mut reasons: Vec<(&str, Vec<String>)> = Vec::new();
        for method in Method::ALL {
            let law_reasons = LAWS.map(|law| why(law, method).map(|why| brief_reason(why)));
            let is_same = law_reasons[0] == law_reasons[1];
            for (law, why) in LAWS
                .into_iter()
                .zip(law_reasons)
                .take(if is_same { 1 } else { 2 })
            {
                let Some(why) = why else { continue };
                let name = match is_same {
                    true => method.name().to_owned(),
                    false => format!("{} ({})", method.name(), in_words(law)),
                };
                match reasons.iter_mut().find(|(known, _)| *known == why) {
                    Some((_, methods)) => methods.push(name),
                    None => reasons.push((why, vec![name])),
                }
            }
        }
        let entries = reasons.into_iter();
        entries
            .map(|(why, methods)| format!("{}: {why}", methods.join(", ")))
            .collect()
    }

    /// Returns the best and the worst of these trials under the paper's controller, with one point
    /// and with two.
    fn shown_courses(&self, tracked: &[(Method, u64, TrialTracking)]) -> Vec<Course> {
        let one_point = self.one_point_rmse(LAWS[0]).map(|(method, _)| method);
        let two = self.two_point_rmse(LAWS[0]).map(|_| Method::Two);
        let mut courses = Vec::new();
        for method in [one_point, two].into_iter().flatten() {
            let own = || tracked.iter().filter(move |pair| pair.0 == method);
            let by = |a: &&(_, _, TrialTracking), b: &&(_, _, TrialTracking)| {
                a.2.rmse_deg.total_cmp(&b.2.rmse_deg)
            };
            for (is_best, shown) in [(true, own().min_by(by)), (false, own().max_by(by))] {
                courses.extend(shown.map(|(method, number, tracking)| Course {
                    is_two: *method == Method::Two,
                    is_best,
                    method: *method,
                    number: *number,
                    rmse_deg: tracking.rmse_deg,
                    rows: tracking.course.clone(),
                }));
            }
        }
        courses
    }
}

/// Returns the displayed name of a controller.
pub(super) fn in_words(law: &str) -> &'static str {
    LawName::from_name(law).map_or("", LawName::title)
}

/// Returns the mean of `values`, which must not be empty.
pub(super) fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// Cuts a reason at the first semicolon or parenthesis. Numbers of the draw and advice follow
/// there, and equal events are counted together.
fn brief_reason(why: &str) -> &str {
    why.split([';', '(']).next().unwrap_or(why).trim_end()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn trial(method: Method, number: u64, rmse_deg: Result<f64, &str>) -> Trial {
        Trial {
            law: LAWS[0].to_owned(),
            method,
            number,
            rmse_deg: rmse_deg.map_err(str::to_owned),
        }
    }

    #[test]
    fn one_point_is_the_better_one_and_needs_every_trial() {
        let trials = vec![
            trial(Method::A, 0, Ok(20.0)),
            trial(Method::A, 1, Ok(10.0)),
            trial(Method::B, 0, Ok(2.0)),
            trial(Method::B, 1, Err("E229 refused (1 of 2); reduce it")),
            trial(Method::Two, 0, Ok(8.0)),
            trial(Method::Two, 1, Ok(6.0)),
        ];
        let tracking = Tracking {
            trials,
            courses: Vec::new(),
        };
        assert_eq!(
            tracking.one_point_rmse("paper"),
            Some((Method::A, vec![20.0, 10.0]))
        );
        assert_eq!(tracking.means("paper"), [Some(15.0), Some(7.0)]);
        assert_eq!(tracking.means("recommended"), [None, None]);
        assert_eq!(tracking.refused(), ["B (paper's controller): E229 refused"]);
    }
}
