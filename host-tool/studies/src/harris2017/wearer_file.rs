//! Writes the measurements of a participant as a wearer file.

use super::declared::RampsDeclaration;
use super::found::{DrawResult, StrengthDurationFound};
use super::study::{NAME, Study};
use super::test::Stimulation;
use firmware::safety::WearerSpec;
use firmware::units::Amplitude;
use host_core::session::Unit;
use host_core::wearer::{Elbow, Electrode, Evidence, History, Interval, StrengthDuration, Wearer};

/// Pulse width to which the triceps' threshold refers, µs, as in the wall experiment.
const TRICEPS_US: u32 = 35;

/// Current at which a pre-wall begins on the triceps, mA. Assumed, as in the sessions of the wall
/// experiment.
const PRE_WALL_MA: f64 = 20.0;

impl Study {
    /// Returns participant `place` (from 0) as the wearer file `harris-N.toml`: the thresholds and
    /// laws of both pairs, the paper's limits, and the torques at these limits. Returns `None` if
    /// thresholds or torques were not measured or not found.
    #[must_use]
    pub fn wearer(&self, place: usize, found: &DrawResult) -> Option<Wearer> {
        let declared = &self.declared;
        let middle_deg = self.middle_deg();
        let protocol = &declared.protocol;
        let [triceps, biceps] = found.strength_duration.as_slice() else {
            return None;
        };
        let source = format!(
            "simulated: person {} of {NAME}, seed {}; neither of Harris' own",
            place + 1,
            self.seed
        );
        let mut wearer = Wearer::new(
            &format!("harris-{}", place + 1),
            Evidence::Simulated,
            &source,
        );
        wearer.limits = limits();
        let of_triceps = (1, "triceps brachii", "elbow extension");
        let of_biceps = (2, "biceps brachii", "elbow flexion");
        let limits = [protocol.current_ramp_ma, protocol.biceps.current_ma];
        wearer.electrodes = vec![
            electrode(declared, of_triceps, (TRICEPS_US, limits[0]), triceps)?,
            electrode(
                declared,
                of_biceps,
                (protocol.biceps.width_us, limits[1]),
                biceps,
            )?,
        ];
        // The largest torques of the muscles cannot be measured with limited currents.
        wearer.elbow = Some(Elbow {
            triceps: 1,
            biceps: 2,
            triceps_nm: None,
            biceps_nm: None,
        });
        let torque = |stimulation| {
            found
                .find_test(stimulation, middle_deg)
                .map(|measurement| measurement.peak_nm)
        };
        let [extends, flexes] = [Stimulation::Current(TRICEPS_US), Stimulation::Biceps].map(torque);
        wearer.note = Some(note(declared, extends?, flexes?));
        wearer.history = vec![self.history()];
        Some(wearer)
    }

    fn history(&self) -> History {
        History {
            at: "simulated time".to_owned(),
            by: format!("flexor experiment {NAME}"),
            what: "thresholds against pulse width, current and width ramps".to_owned(),
            device: Some(format!("{} simulator", self.device.to_argument())),
            firmware: None,
            seed: i64::try_from(self.seed).ok().map(i64::unsigned_abs),
        }
    }
}

/// Returns the wearer's limits, the same as in the sessions of the wall experiment.
fn limits() -> WearerSpec {
    WearerSpec {
        max_current_ua: 80_000,
        max_charge_nc: 5_000,
        max_rms_ua: 10_000,
        rise_ms: 1,
        fall_ms: 50,
        host_timeout_ms: 100,
        ..WearerSpec::default()
    }
}

fn note(declared: &RampsDeclaration, extends_nm: f64, flexes_nm: f64) -> String {
    let upper = declared.strength_duration.upper_most_ma;
    format!(
        "Printed are {upper} mA at most at 35 us on the triceps, and 40 mA at 25 us on the biceps: \
         they are the limits here. Thresholds and their law were found on a simulated elbow of \
         assumed parameters, which at these limits extends with {extends_nm:.2} and flexes with \
         {flexes_nm:.2} N m. The 20 mA at which a pre-wall begins (noticeable, with no force or \
         little) and the pulse rate of 50 Hz are assumed. The curve's upper points are the \
         largest pulses of section 3.3. The rise from zero is as short as the device allows: the \
         paper's stimulator has none."
    )
}

fn electrode(
    declared: &RampsDeclaration,
    (channel, place, moves): (u8, &str, &str),
    (width_us, limit_ma): (u32, f64),
    found: &StrengthDurationFound,
) -> Option<Electrode> {
    let at = found
        .thresholds
        .iter()
        .find(|threshold| threshold.width_us == width_us)?;
    let fitted = found.fitted?;
    let milli = |ma: f64| Amplitude::new((1e3 * ma).round() as u32); // saturates
    let threshold = milli(at.current_ma);
    let is_triceps = channel == 1;
    let upper = declared.strength_duration.upper.iter();
    let upper = upper.map(|&(width_us, ma)| (width_us as u16, milli(ma)));
    let interval = |of, [low, high]: [f64; 2]| Interval { of, low, high };
    let tenth = |ends: [f64; 2]| ends.map(|value| (10.0 * value).round() / 10.0);
    Some(Electrode {
        channel,
        place: place.to_owned(),
        area_mm2: 800,
        unit: Unit::Milliampere,
        load_ohm: 2_000,
        width_us: width_us as u16,
        frequency_hz: declared.protocol.frequency_hz,
        holds_hz: [declared.protocol.frequency_hz; 2],
        motor_threshold: threshold,
        limit: milli(limit_ma),
        start: Amplitude::ZERO,
        minimum: is_triceps.then(|| milli(PRE_WALL_MA)),
        maximum: is_triceps.then(|| milli(limit_ma)),
        joint_threshold: None,
        moves: vec![moves.to_owned()],
        strength_duration: Some(StrengthDuration {
            rheobase: milli(fitted.rheobase_ma),
            chronaxie_ns: (1e2 * fitted.chronaxie_us).round() as u32 * 10,
            upper: if is_triceps {
                upper.collect()
            } else {
                Vec::new()
            },
        }),
        muscle: None,
        intervals: vec![
            interval(
                "rheobase",
                fitted
                    .rheobase_within
                    .map(|rheobase_within| (1e3 * rheobase_within).round() / 1e3),
            ),
            interval("chronaxie_us", tenth(fitted.chronaxie_within)),
        ],
    })
}
