//! Measures how long a recruitment takes on this computer.

use super::LimbError;
use super::arms::random_posture;
use super::declared::LimbDeclaration;
use firmware::bench::limb::{before_the_trunk, nominal_limb};
use firmware::limb::Limb;
use host_core::limb::{
    Exact, LeastSquares, PostureMatrices, RecruitmentError, Weights, amplitudes, force,
};
use host_core::statistics;
use serde::Serialize;
use std::hint::black_box;
use std::time::Instant;

/// Median computing times of one recruitment by least squares on this computer.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Pace {
    /// Time to compute ten amplitudes from a force at the hand in an unchanged posture, µs.
    pub least_squares_us: f64,
    /// Time to compute ten amplitudes from a force at the hand in a new posture, µs, including its
    /// Jacobians and matrices.
    pub with_posture_us: f64,
    /// Number of recruitments in an unchanged posture that were timed.
    pub n: usize,
}

const TIMED: u64 = 4000;

/// Times 4000 recruitments in random postures.
///
/// # Errors
/// Returns [`LimbError`] if the declaration cannot be parsed, or the arm or a posture is refused.
pub fn pace() -> Result<Pace, LimbError> {
    let declared = LimbDeclaration::load_embedded()?;
    let spec = nominal_limb();
    let refused = |e: firmware::limb::LimbError| RecruitmentError::Spec(vec![e.to_string()]);
    let device = Limb::<f32>::new(&spec).map_err(refused)?;
    let exact = Limb::<Exact>::new(&spec).map_err(refused)?;
    let mut squares = LeastSquares::new(&exact, Weights::SMOOTH)?;
    let before = exact
        .jacobians_at_posture(&before_the_trunk())
        .map_err(RecruitmentError::from)?;
    let fixed = PostureMatrices::new(&before)?;
    let (mut alone, mut with_posture) = (Vec::new(), Vec::new());
    for n in 0..TIMED {
        let (posture, direction) = random_posture(&declared, n);
        let wanted = force(direction.map(|part| 30.0 * part));
        let begin = Instant::now();
        let found = squares.recruit(black_box(&fixed), black_box(&wanted))?;
        black_box(amplitudes(&device, &found.forces));
        alone.push(begin.elapsed().as_secs_f64() * 1e6);
        let begin = Instant::now();
        let jacobians = exact
            .jacobians_at_posture(black_box(&posture))
            .map_err(RecruitmentError::from)?;
        let Ok(posed) = PostureMatrices::new(&jacobians) else {
            continue;
        };
        let found = squares.recruit(&posed, black_box(&wanted))?;
        black_box(amplitudes(&device, &found.forces));
        with_posture.push(begin.elapsed().as_secs_f64() * 1e6);
    }
    let n = alone.len();
    let median = |times_us: Vec<f64>| statistics::median(times_us).unwrap_or(f64::NAN);
    Ok(Pace {
        least_squares_us: median(alone),
        with_posture_us: median(with_posture),
        n,
    })
}
