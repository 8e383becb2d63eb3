//! Computes the settings of a device for a wearer: activation as a function of angle, and
//! intensities.

use super::declaration::{Condition, Form, HEIGHTS, Scale, Study};
use super::error::LiftError;
use super::way::{LiftTrajectory, Timing, waypoints};
use firmware::haptics::{Form as DeviceForm, ModulatedSpec, ModulationSpec, QuarticSpec};
use firmware::limb::LINES;
use firmware::units::Amplitude;
use hal_sim::body::sagittal::{ELBOW, ELECTRODES, Geometry, JOINTS, Links, SHOULDER};
use host_core::limb::{Bounded, Muscles, Quartic, TERMS};
use nalgebra::{SMatrix, SVector};
use serde::{Deserialize, Serialize};

pub const ARMS: usize = 2;
/// Number of channels: four on each arm.
pub const CHANNELS: usize = ARMS * ELECTRODES;
/// Joint whose angle determines each stimulated muscle: biceps, triceps, anterior and posterior
/// deltoid.
const JOINT_OF: [usize; ELECTRODES] = [ELBOW, ELBOW, SHOULDER, SHOULDER];
/// Peak activation above which a muscle counts as active.
const LEAST_PEAK: f64 = 1e-3;
/// The value 1 in millionths, the device's unit.
const MILLION: f64 = 1e6;
/// Binomial coefficients of degree four.
const CHOICES: [f64; TERMS] = [1.0, 4.0, 6.0, 4.0, 1.0];
/// Number of trajectory steps per evaluated point.
const EVERY: usize = 4;

/// Activation of a muscle as a function of its joint's angle.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Curve {
    /// Result of static optimisation along the trajectories of the three heights: angle in degrees,
    /// and activation k.
    pub points: Vec<[f64; 2]>,
    /// Largest activation k.
    pub peak: f64,
    /// Coefficients a₀ to a₄ of the least-squares quartic of the activation function C in the angle
    /// in degrees (equation 3). C is k with the configured scaling.
    pub per_degree: [f64; TERMS],
    /// Residual of the quartic: root mean square, and largest.
    pub left: [f64; 2],
    /// Bernstein coefficients on the device over the joint's range, millionths; `None` for a muscle
    /// that is not active.
    pub bernstein: Option<[i32; TERMS]>,
    /// Residual of the device's quartic: root mean square, and largest.
    pub left_on_device: [f64; 2],
}

/// Result of static optimisation for the configured trajectory.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Curves {
    /// Range of elbow and shoulder that the device is configured with, degrees.
    pub range_deg: [[f64; 2]; JOINTS],
    /// Curves of biceps, triceps, anterior and posterior deltoid: flexors from the lift, extensors
    /// from the drop.
    pub muscles: [Curve; ELECTRODES],
}

/// Activations of the stimulated muscles along the trajectories, divided where the elbow changes
/// from flexing to extending.
struct SolvedActivations {
    /// Angle and activation k, by muscle.
    points: [Vec<(f64, f64)>; ELECTRODES],
    range_deg: [[f64; 2]; JOINTS],
}

fn solve_activations(
    study: &Study,
    stature_m: f64,
    mass_kg: f64,
) -> Result<SolvedActivations, LiftError> {
    let model = &study.model;
    let links = Links::new(stature_m, mass_kg, study.scene.added_inertia_kg_m2);
    let geometry = Geometry::for_stature(stature_m, 1.0);
    let timing = Timing {
        lift_s: model.lift_s,
        drop_s: model.drop_s,
        overlap: model.overlap,
    };
    let mut points: [Vec<(f64, f64)>; ELECTRODES] = Default::default();
    let mut range_deg = [[f64::INFINITY, f64::NEG_INFINITY]; JOINTS];
    for height in 0..HEIGHTS {
        let way = LiftTrajectory::new(&links, waypoints(study, links.reach_m(), height), timing);
        for n in (0..way.len()).step_by(EVERY) {
            let flexions_deg = way.flexions[n].map(f64::to_degrees);
            let wanted = way.torques_nm(&links, n, model.object_kg);
            let muscles = Muscles {
                full_nm: geometry.at(flexions_deg).full_nm(1.0).to_vec(),
                least: vec![0.0; hal_sim::body::sagittal::MUSCLES],
            };
            let muscles = muscles.with_co_contraction(model.co_contraction, wanted);
            let k = muscles.activations(wanted)?;
            let lifts = way.rates[n][ELBOW] > 0.0;
            for muscle in 0..ELECTRODES {
                // Even indices are flexors, used in the lift; odd ones are extensors, used in the
                // drop.
                if lifts == muscle.is_multiple_of(2) {
                    points[muscle].push((flexions_deg[JOINT_OF[muscle]], k[muscle]));
                }
            }
            for (range, deg) in range_deg.iter_mut().zip(flexions_deg) {
                *range = [range[0].min(deg), range[1].max(deg)];
            }
        }
    }
    let margin = model.margin_deg;
    let range_deg = range_deg.map(|[low, high]| [(low - margin).floor(), (high + margin).ceil()]);
    Ok(SolvedActivations { points, range_deg })
}

/// Computes the activation functions of the four muscles for a wearer of this stature and mass.
///
/// # Errors
/// Fails with E761 if the trajectory needs more torque than the muscles have, or with E762 if no
/// quartic fits.
pub fn curves(study: &Study, stature_m: f64, mass_kg: f64) -> Result<Curves, LiftError> {
    let solved = solve_activations(study, stature_m, mass_kg)?;
    let curve = |muscle: usize| -> Result<Curve, LiftError> {
        let points = &solved.points[muscle];
        let peak = points.iter().map(|point| point.1).fold(0.0, f64::max);
        let scale = match study.model.scale {
            Scale::Peak if peak > LEAST_PEAK => 1.0 / peak,
            Scale::Peak => 0.0,
            Scale::Raw => 1.0,
        };
        let scaled: Vec<(f64, f64)> = points
            .iter()
            .map(|point| (point.0, scale * point.1))
            .collect();
        let fitted = Quartic::fit(&scaled)?;
        let range = solved.range_deg[JOINT_OF[muscle]];
        let device = fit_device_quartic(&fitted, &scaled, range)?;
        Ok(Curve {
            points: points.iter().map(|point| [point.0, point.1]).collect(),
            peak,
            per_degree: fitted.degree_coefficients(),
            left: [fitted.rms, fitted.most],
            left_on_device: residuals(&device, range, &scaled),
            bernstein: (peak > LEAST_PEAK).then_some(device),
        })
    };
    Ok(Curves {
        range_deg: solved.range_deg,
        muscles: [curve(0)?, curve(1)?, curve(2)?, curve(3)?],
    })
}

/// Returns the Bernstein coefficients, in millionths, of the quartic that lies closest to `points`.
/// All coefficients are between 0 and 1, so the values of the quartic are as well. In the margins
/// of `range`, it lies close to the values that `fitted` has at its ends.
fn fit_device_quartic(
    fitted: &Quartic,
    points: &[(f64, f64)],
    range: [f64; 2],
) -> Result<[i32; TERMS], LiftError> {
    let [low, high] = fitted.range_deg;
    let margin =
        |from: f64, to: f64| (0..=10).map(move |n| from + 0.1 * f64::from(n) * (to - from));
    let beyond = margin(range[0], low).chain(margin(high, range[1]));
    let beyond = beyond.map(|deg| (deg, fitted.at(deg).clamp(0.0, 1.0), 0.1));
    let samples = points
        .iter()
        .map(|(deg, value)| (*deg, *value, 1.0))
        .chain(beyond);
    // The solver has ten unknowns; five stay at 0.
    let mut curvature = SMatrix::<f64, LINES, LINES>::zeros();
    let mut slope = SVector::<f64, LINES>::zeros();
    let mut upper = SVector::<f64, LINES>::zeros();
    for (deg, value, weight) in samples {
        let basis = basis(range, deg);
        for i in 0..TERMS {
            slope[i] += weight * basis[i] * value;
            for j in 0..TERMS {
                curvature[(i, j)] += weight * basis[i] * basis[j];
            }
        }
    }
    for i in 0..curvature.nrows() {
        curvature[(i, i)] += 1e-9;
        upper[i] = if i < TERMS { 1.0 } else { 0.0 };
    }
    let problem = Bounded {
        curvature,
        slope,
        upper,
    };
    let solved = problem
        .solve()
        .map_err(|e| LiftError::Declaration(e.to_string()))?;
    Ok(std::array::from_fn(|i| {
        (MILLION * solved[i]).round() as i32
    }))
}

/// Returns the five Bernstein polynomials of degree four at an angle in the range from `low` to
/// `high`.
fn basis([low, high]: [f64; 2], deg: f64) -> [f64; TERMS] {
    let u = ((deg - low) / (high - low)).clamp(0.0, 1.0);
    let last = TERMS as i32 - 1;
    std::array::from_fn(|k| CHOICES[k] * u.powi(k as i32) * (1.0 - u).powi(last - k as i32))
}

/// Returns root mean square and largest residual at `points` of the quartic with these Bernstein
/// coefficients over `range`.
fn residuals(bernstein: &[i32; TERMS], range: [f64; 2], points: &[(f64, f64)]) -> [f64; 2] {
    let at = |deg: f64| -> f64 {
        let terms = basis(range, deg).into_iter().zip(bernstein);
        terms
            .map(|(weight, own)| weight * f64::from(*own) / MILLION)
            .sum()
    };
    let off = points.iter().map(|(deg, value)| (at(*deg) - value).abs());
    let off: Vec<f64> = off.collect();
    let squares: f64 = off.iter().map(|value| value * value).sum();
    [
        (squares / off.len() as f64).sqrt(),
        off.iter().copied().fold(0.0, f64::max),
    ]
}

/// Calibration result of one channel, mA.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ChannelThresholds {
    /// Smallest current that the wearer feels.
    pub felt_ma: f64,
    /// Largest current that the wearer tolerates.
    pub most_ma: f64,
}

/// Returns the device's settings of the four joints: left elbow and shoulder, right elbow and
/// shoulder. In [`Condition::None`] nothing is stimulated.
#[must_use]
pub fn specs(
    study: &Study,
    curves: &Curves,
    condition: Condition,
    channels: &[ChannelThresholds; CHANNELS],
) -> [ModulationSpec; ARMS * JOINTS] {
    let model = &study.model;
    let quartic = |muscle: usize| curves.muscles[muscle].bernstein.map(QuarticSpec);
    let muscle = |channel: usize, lift: Option<usize>, drop: Option<usize>| {
        let micro = |ma: f64| Amplitude::new((1e3 * ma).round() as u32);
        let thresholds = channels[channel];
        ModulatedSpec {
            channel: channel as u8,
            base: micro(thresholds.most_ma),
            form: match model.form {
                Form::Scaled => DeviceForm::Scaled,
                Form::AboveThreshold => DeviceForm::AboveThreshold {
                    threshold: micro(thresholds.felt_ma),
                },
            },
            lift: lift.and_then(quartic),
            drop: drop.and_then(quartic),
        }
    };
    std::array::from_fn(|place| {
        let (arm, joint) = (place / JOINTS, place % JOINTS);
        let [low, high] = curves.range_deg[joint].map(|deg| (1e3 * deg).round() as i32);
        let flexor = arm * ELECTRODES + joint * 2;
        // Functions of this joint: its flexor's in the lift, its extensor's in the drop.
        let (up, down) = (Some(joint * 2), Some(joint * 2 + 1));
        let (of_flexor, of_extensor) = match condition {
            Condition::None => ((None, None), (None, None)),
            Condition::Assist => ((up, None), (None, down)),
            Condition::Resist => ((None, down), (up, None)),
        };
        ModulationSpec {
            joint: place as u8,
            phase_joint: (arm * JOINTS + ELBOW) as u8,
            dead_band_centideg_per_s: (100.0 * model.dead_band_deg_s).round() as u16,
            cutoff_mhz: (1e3 * model.cutoff_hz).round() as u32,
            angle_min_mdeg: low,
            angle_max_mdeg: high,
            stale_after_ms: 50,
            max_hold_ms: (1e3 * model.longest_hold_s).round() as u32,
            flexor: muscle(flexor, of_flexor.0, of_flexor.1),
            extensor: muscle(flexor + 1, of_extensor.0, of_extensor.1),
        }
    })
}
