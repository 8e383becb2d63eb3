//! Converts the results of a subject's first replication to a wearer file.

use super::error::LeeError;
use super::quality::subject_replications;
use super::study::{Part, Study, SubjectReplication};
use super::{SUBJECTS, name};
use firmware::muscle::CalciumForceSpec;
use firmware::units::Amplitude;
use host_core::identify::{NAMES, PARAMETERS};
use host_core::session::Unit;
use host_core::wearer::{Electrode, Evidence, History, Interval, Muscle, Wearer};

/// Factors from SI units to those of wearer files, for A, K, τc, τ1 and τ2.
const SCALE: [f64; PARAMETERS] = [1.0, 1.0, 1e3, 1e3, 1e3];
/// Index of the frequency whose exponential goes into the file: 30 Hz, at which the threshold is
/// found.
const MIDDLE: usize = 1;

fn milli(value: f64) -> Amplitude {
    Amplitude::new((1e3 * value).round() as u32) // saturates
}

/// Rounds to six significant digits, which exceed the accuracy of the values.
fn six_digits(value: f64) -> f64 {
    format!("{value:.5e}").parse().unwrap_or(value)
}

impl Study {
    /// Returns file names and texts for all subjects whose first replication succeeded.
    ///
    /// # Errors
    /// Fails with E648 if a number is outside the range of wearer files.
    pub fn wearers(&self, parts: &[Part]) -> Result<Vec<(String, String)>, LeeError> {
        let mut files = Vec::new();
        for subject in 0..SUBJECTS {
            let first = subject_replications(parts, subject).find(|draw| draw.draw == 0);
            let Some(wearer) = first.and_then(|draw| self.wearer(draw)) else {
                continue;
            };
            let (file, text) = (format!("{}.toml", wearer.name), wearer.to_toml());
            let wrong = |why: String| LeeError::Wearer(file.clone(), why);
            let back = Wearer::parse(&file, &text).map_err(|e| wrong(e.lines()))?;
            // Comparing texts instead of values ignores the load, which has no meaning for a
            // current stage.
            if back.to_toml() != text {
                return Err(wrong(
                    "reading the written file gives another wearer".to_owned(),
                ));
            }
            files.push((file, text));
        }
        Ok(files)
    }

    fn wearer(&self, drawn: &SubjectReplication) -> Option<Wearer> {
        let electrode = self.electrode(drawn)?;
        let source = format!(
            "flexor experiment lee, seed {}, draw {}",
            self.seed, drawn.draw
        );
        let mut wearer = Wearer::new(&name(drawn.subject), Evidence::Simulated, &source);
        wearer.note = Some(
            "Simulated test rig with the parameters of Lee 2020's tables, not a person. The \
             threshold was found by force, the limit is 1.5 times the threshold, and the \
             constants hold at the limit, with 95 % intervals."
                .to_owned(),
        );
        wearer.limits.return_area_mm2 = 2_500;
        wearer.limits.host_timeout_ms = 40;
        wearer.limits.fall_ms = 50;
        wearer.electrodes.push(electrode);
        wearer.history.push(History {
            at: "simulated".to_owned(),
            by: "flexor experiment lee".to_owned(),
            what: "found the threshold, played fifteen trains, fitted the constants".to_owned(),
            device: None,
            firmware: None,
            seed: Some(self.seed),
        });
        Some(wearer)
    }

    fn electrode(&self, drawn: &SubjectReplication) -> Option<Electrode> {
        let found = drawn.found.as_ref().ok()?;
        let i_mt_ma = drawn.searched.i_mt_ma()?;
        let i_pt_ma = found.amplitudes.last().copied()?;
        let (exponential, _) = found.exponentials[MIDDLE]?;
        let fit = &found.fits[0];
        let [a, k, tau_c, tau1, tau2] = fit.constants;
        let micro = |value: f64| (1e6 * value).round() as u32; // saturates
        let trains = &self.declared.trains;
        let interval = |(i, estimate): (usize, &host_core::identify::Estimate)| Interval {
            of: NAMES[i],
            low: six_digits(SCALE[i] * estimate.low),
            high: six_digits(SCALE[i] * estimate.high),
        };
        let hz = trains.frequencies_hz.map(f64::from);
        Some(Electrode {
            channel: 1,
            place: "wrist extensors of a simulated forearm on a test rig".to_owned(),
            area_mm2: 2_500,
            unit: Unit::Milliampere,
            load_ohm: 2_000,
            width_us: trains.width_us as u16, // at most 500
            frequency_hz: f64::from(self.declared.search.frequency_hz),
            holds_hz: [hz[0], hz[2]],
            motor_threshold: milli(i_mt_ma),
            limit: milli(i_pt_ma),
            start: Amplitude::ZERO,
            minimum: None,
            maximum: None,
            joint_threshold: None,
            moves: vec!["wrist extension".to_owned()],
            strength_duration: None,
            muscle: Some(Muscle {
                force: CalciumForceSpec {
                    a_mn_per_s: (1e3 * a).round() as u32, // saturates
                    k_micro: micro(k),
                    tau_c_us: micro(tau_c),
                    tau1_us: micro(tau1),
                    tau2_us: micro(tau2),
                },
                reference: milli(i_pt_ma),
                slope_micro: micro(exponential.b_per_ma),
                fatigue: None,
            }),
            intervals: fit.estimates().iter().enumerate().map(interval).collect(),
        })
    }
}
