//! Defines the true values of the simulated subjects, by which methods are judged.

use super::alone::ExactWrist;
use super::declaration::Declaration;
use super::error::LeeError;
use super::protocol::Train;
use hal_sim::body::bench::wrist::PRINTED;
use hal_sim::body::bench::{SensorSpec, WristSpec};
use host_core::identify::{Constants, moving_average};

/// Force that defines the true threshold, N: the threshold is the lowest step of the search at
/// which a noise-free 40 ms mean exceeds this force.
const MOVES_N: f64 = 0.015;

/// True values of a simulated subject.
#[derive(Clone, PartialEq, Debug)]
pub struct Truth {
    /// The wrist on the test rig.
    pub spec: WristSpec,
    /// I_MT as the paper prints it, mA.
    pub printed_ma: f64,
    /// True I_MT: the lowest step of the search at which the noise-free force exceeds 0.015 N, mA.
    pub i_mt_ma: f64,
    /// Lowest threshold of a fibre, mA; smaller amplitudes activate no fibre.
    pub lowest_ma: f64,
}

impl Truth {
    /// Returns the true values of subject `index`; K01 has index 0.
    ///
    /// # Errors
    /// Fails if there is no such subject, or with E646 if no amplitude moves its wrist.
    pub fn for_subject(index: usize, declared: &Declaration) -> Result<Self, LeeError> {
        let spec = WristSpec::subject(index)?;
        let nothing = LeeError::Declaration(
            "no amplitude up to search.most_ma moves a subject's wrist".to_owned(),
        );
        let printed_ma = PRINTED.get(index).map_or(0.0, |pair| pair.0);
        Ok(Self {
            i_mt_ma: lowest_step(spec, declared)?.ok_or(nothing)?,
            lowest_ma: spec.pool.lowest(),
            spec,
            printed_ma,
        })
    }

    /// Returns the true constants A, K, τc, τ1 and τ2 at the amplitude `ma`, mA. A is scaled by the
    /// share of fibres that this amplitude recruits.
    #[must_use]
    pub fn constants(&self, ma: f64, width_us: u32) -> Constants {
        let [a, k, tau_c, tau1, tau2] = self.spec.generator.parameters.all();
        let recruited = self.spec.recruited(ma, width_us.into());
        [a * recruited, k, tau_c, tau1, tau2]
    }
}

/// Finds the lowest step of the search at which the noise-free force exceeds 0.015 N, mA; `None` if
/// there is none.
fn lowest_step(spec: WristSpec, declared: &Declaration) -> Result<Option<f64>, LeeError> {
    let (search, layout) = (&declared.search, declared.search.detector().layout);
    let sensor = SensorSpec {
        noise_n: 0.0,
        ..spec.sensor
    };
    let steps = (search.most_ma / search.step_ma + 1e-9).floor() as u32;
    for step in 1..=steps {
        let ma = f64::from(step) * search.step_ma;
        let mut alone = ExactWrist::new(WristSpec { sensor, ..spec }, 0)?;
        let (_, truth) = alone.train_with_truth(&Train {
            ma,
            pulses: search.frequency_hz,
            width_us: declared.trains.width_us,
            before: layout.before,
            samples: layout.samples,
        });
        if moving_average(&truth).iter().any(|value| *value > MOVES_N) {
            return Ok(Some(ma));
        }
    }
    Ok(None)
}
