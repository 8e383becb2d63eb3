//! Defines the participant who lifts, with all randomly generated properties.

use super::calibration::{CHANNELS, ChannelThresholds};
use super::declaration::{HEIGHTS, Study};
use super::error::LiftError;
use super::scene::ObjectSpec;
use super::way::Timing;
use crate::laboratory::Range;
use hal_sim::body::muscle::SUBJECTS;
use hal_sim::body::sagittal::{ELECTRODES, Electrode, JOINTS, SagittalSpec};
use hal_sim::random;

/// Voluntary movement of a participant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VoluntaryMotion {
    /// Durations of lift and drop.
    pub timing: Timing,
    /// Time from the end of the movement to the release, s.
    pub settle_s: f64,
    /// Initial misjudgement of the object's weight, as a fraction of the weight; above 0 if the
    /// object is judged too heavy.
    pub judged_load: f64,
    /// Delay of proprioception and vision, s.
    pub delay_s: f64,
    /// Bandwidth of the feedback in rad/s, multiplied by the delay in s.
    pub bandwidth: f64,
    /// Fraction of a lift's feedback that is feed-forward in the next lift.
    pub learning: f64,
    /// Ratio of antagonist to agonist activation.
    pub co_contraction: f64,
    /// Standard deviation of a drive as a fraction of the drive, and its time constant, s.
    pub noise: [f64; 2],
    /// Standard deviation of the perceived target position, per day and per lift, m.
    pub aim_m: [f64; 2],
}

/// A participant with all random properties.
#[derive(Clone, Debug)]
pub struct LiftWearer {
    /// Random parameters, in the order of the declaration's ranges.
    pub values: Vec<f64>,
    /// The left and the right arm.
    pub arms: [SagittalSpec; 2],
    /// Parameters of voluntary movement.
    pub will: VoluntaryMotion,
    /// Mass and springs of the lifted object.
    pub object: ObjectSpec,
    /// Calibration result of each channel.
    pub told: [ChannelThresholds; CHANNELS],
    /// Standard deviation of the encoders' noise, degrees.
    pub encoder_deg: f64,
    /// Seed of all random behaviour.
    pub seed: u64,
    /// Whether the perceived target positions are the same in all conditions.
    pub one_day: bool,
}

/// Stiffness of elbow and shoulder without torque, N m/rad. With a torque of τ N m, the stiffness
/// is 8.67 + 6.18·|τ| and 10.8 + 3.18·|τ| (Gomi and Osu 1998, from memory).
const STIFFNESS_NM_PER_RAD: [f64; JOINTS] = [8.67, 10.8];
/// Increase of the stiffness of elbow and shoulder per torque, 1/rad.
const STIFFNESS_PER_RAD: [f64; JOINTS] = [6.18, 3.18];
/// Random stream of a participant's thresholds and tolerated currents.
const CHANNELS_STREAM: u64 = 1;
/// Random stream of a participant's errors in the perceived target positions.
const AIM_STREAM: u64 = 2;

/// Returns the random parameters of participant `index`, one for each range.
#[must_use]
pub fn draw_values(study: &Study, seed: u64, index: u64) -> Vec<f64> {
    Range::draw_values(&study.ranges, seed, index)
}

/// Returns the parameters at the centre of every range.
#[must_use]
pub fn nominal_values(study: &Study) -> Vec<f64> {
    study.ranges.iter().map(|range| range.at(0.5)).collect()
}

/// Access to parameters by the names of their ranges.
struct Values<'a> {
    study: &'a Study,
    values: &'a [f64],
}

impl Values<'_> {
    fn get(&self, field: &str) -> Result<f64, LiftError> {
        let place = self
            .study
            .ranges
            .iter()
            .position(|range| range.field == field);
        let value = place.and_then(|place| self.values.get(place).copied());
        value.ok_or_else(|| LiftError::Declaration(format!("no range for `{field}`")))
    }
}

impl LiftWearer {
    /// Creates a participant with these parameters.
    ///
    /// # Errors
    /// Fails with E760 if a range is missing.
    pub fn new(study: &Study, values: Vec<f64>, seed: u64) -> Result<Self, LiftError> {
        let parameters = Values {
            study,
            values: &values,
        };
        let pulsed = channels(&parameters, seed)?;
        let arm = |at: usize| -> Result<SagittalSpec, LiftError> {
            let electrodes: [Electrode; ELECTRODES] =
                std::array::from_fn(|n| pulsed[at * ELECTRODES + n].0);
            spec(&parameters, electrodes)
        };
        Ok(Self {
            arms: [arm(0)?, arm(1)?],
            will: will(&parameters)?,
            object: ObjectSpec {
                mass_kg: parameters.get("object_kg")?,
                stiffness_n_per_m: parameters.get("impedance_n_per_m")?,
                damping: parameters.get("impedance_damping")?,
            },
            told: pulsed.map(|pair| pair.1),
            encoder_deg: parameters.get("encoder_noise_deg")?,
            seed,
            one_day: false,
            values,
        })
    }

    /// Returns the error of the perceived target positions on a day: m for each height, forward and
    /// up.
    #[must_use]
    pub fn aim_of_day_m(&self, day: u64) -> [[f64; 2]; HEIGHTS] {
        let day = if self.one_day { 0 } else { day };
        let stream = random::word(random::word(self.seed, AIM_STREAM), day);
        let off = |n: u64| self.will.aim_m[0] * random::standard_normal(stream, n);
        std::array::from_fn(|height| [0, 1].map(|axis| off(2 * height as u64 + axis)))
    }
}

/// Returns the electrodes and their calibration results.
fn channels(
    parameters: &Values,
    seed: u64,
) -> Result<[(Electrode, ChannelThresholds); CHANNELS], LiftError> {
    let stream = random::word(seed, CHANNELS_STREAM);
    let (threshold, apart) = (
        parameters.get("threshold_ma")?,
        parameters.get("channels_apart")?,
    );
    let (felt, full) = (parameters.get("felt")?, parameters.get("full")?);
    let (tolerated, reached) = (parameters.get("tolerated")?, parameters.get("reached")?);
    Ok(std::array::from_fn(|channel| {
        let own = libm::exp(apart * random::standard_normal(stream, channel as u64));
        let threshold_ma = own * threshold;
        let full_ma = threshold_ma * full;
        let electrode = Electrode {
            threshold_ma,
            full_ma,
            reached,
        };
        let thresholds = ChannelThresholds {
            felt_ma: felt * threshold_ma,
            most_ma: threshold_ma + tolerated * (full_ma - threshold_ma),
        };
        (electrode, thresholds)
    }))
}

fn spec(
    parameters: &Values,
    electrodes: [Electrode; ELECTRODES],
) -> Result<SagittalSpec, LiftError> {
    let subject = (parameters.get("subject")? as usize).min(SUBJECTS.len() - 1);
    let hz = f64::from(parameters.study.protocol.frequency_hz);
    let friction = parameters.get("friction_nm_s")?;
    let stiffness = parameters.get("stiffness")?;
    Ok(SagittalSpec {
        stature_m: parameters.get("stature_m")?,
        mass_kg: parameters.get("mass_kg")?,
        strength: parameters.get("strength")?,
        fibre_length: parameters.get("fibre_length")?,
        added_inertia_kg_m2: parameters.study.scene.added_inertia_kg_m2,
        damping_nm_s_per_rad: [friction; JOINTS],
        stiffness_nm_per_rad: STIFFNESS_NM_PER_RAD
            .map(|stiffness_nm_per_rad| stiffness * stiffness_nm_per_rad),
        stiffness_per_rad: STIFFNESS_PER_RAD.map(|stiffness_per_rad| stiffness * stiffness_per_rad),
        viscosity_s: parameters.get("viscosity_s")?,
        active_damping_s_per_rad: parameters.get("active_damping_s_per_rad")?,
        activation_s: parameters.get("activation_s")?,
        width_us: parameters.study.protocol.width_us,
        curvature: parameters.get("curvature")?,
        delay_us: (1e3 * parameters.get("delay_ms")?).round() as u32,
        dynamics: SUBJECTS[subject].normalised_at(hz),
        electrodes,
        fast_part: parameters.get("fast_part")?,
    })
}

fn will(parameters: &Values) -> Result<VoluntaryMotion, LiftError> {
    Ok(VoluntaryMotion {
        timing: Timing {
            lift_s: parameters.get("lift_s")?,
            drop_s: parameters.get("drop_s")?,
            overlap: parameters.get("overlap")?,
        },
        settle_s: parameters.get("settle_s")?,
        judged_load: parameters.get("judged_load")?,
        delay_s: parameters.get("feedback_delay_s")?,
        bandwidth: parameters.get("feedback_bandwidth")?,
        learning: parameters.get("learning")?,
        co_contraction: parameters.get("co_contraction")?,
        noise: [
            parameters.get("drive_noise")?,
            parameters.get("drive_noise_s")?,
        ],
        aim_m: [
            parameters.get("aim_bias_m")?,
            parameters.get("aim_scatter_m")?,
        ],
    })
}
