//! Least squares of the model against records, in the form that the solver's crate needs.
//!
//! Each record has an offset and a drift of its own, which do not come from the muscle. The
//! straight line is therefore removed from each record and from the model alike.

use super::average::{moving_average, moving_average_transpose};
use super::model::{Constants, PARAMETERS, simulate_record};
use super::record::ForceRecord;
use levenberg_marquardt::LeastSquaresProblem;
use nalgebra::storage::Owned;
use nalgebra::{DVector, Dyn, OMatrix, SMatrix, SVector, U5};

/// Form in which the fit compares measured force with the model.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Weighting {
    /// Compares the samples themselves. If their noise is white, no unbiased estimator is more
    /// precise. For a record that was averaged, this is generalised least squares: undoing the
    /// moving average makes its correlated noise white again.
    Whitened,
    /// Compares moving averages of the samples with moving averages of the model, all with the same
    /// weight: the paper's method (equation 7), but with the filter applied to both. The intervals
    /// take the correlation of the averages into account, by a sandwich estimator.
    Averaged,
}

/// Basis of all straight lines (offset and drift) over the samples of a record: two orthogonal
/// vectors of length 1.
#[derive(Debug, Clone)]
struct Straight([Vec<f64>; 2]);

impl Straight {
    fn new(samples: usize) -> Self {
        let n = samples.max(1) as f64;
        let middle = 0.5 * (n - 1.0);
        let constant = vec![1.0 / n.sqrt(); samples];
        let slope: Vec<f64> = (0..samples).map(|i| i as f64 - middle).collect();
        let length = slope
            .iter()
            .map(|slope| slope * slope)
            .sum::<f64>()
            .sqrt()
            .max(1e-300);
        Self([constant, slope.iter().map(|slope| slope / length).collect()])
    }

    /// Removes from `values` the straight line that fits it best.
    fn remove_from(&self, values: &mut [f64]) {
        for direction in &self.0 {
            let along: f64 = direction
                .iter()
                .zip(values.iter())
                .map(|(d, value)| d * value)
                .sum();
            values
                .iter_mut()
                .zip(direction)
                .for_each(|(value, d)| *value -= along * d);
        }
    }
}

/// Least-squares problem: the records, the form of comparison, and the constants that the solver is
/// trying.
pub(super) struct Problem<'a> {
    records: &'a [ForceRecord],
    weighting: Weighting,
    straight: Vec<Straight>,
    /// Measured values in the form in which they are compared, one record after the other.
    measured: Vec<f64>,
    logarithms: [f64; PARAMETERS],
    residuals: Vec<f64>,
    slopes: Vec<[f64; PARAMETERS]>,
}

/// Lowest and highest value of each constant in the search: A in N/s, K, τc, τ1 and τ2 in s.
const RANGE: [[f64; 2]; PARAMETERS] = [
    [1e-2, 1e5],
    [1e-5, 1e2],
    [5e-4, 0.5],
    [1e-4, 2.0],
    [1e-4, 5.0],
];

impl<'a> Problem<'a> {
    pub fn new(records: &'a [ForceRecord], weighting: Weighting, start: Constants) -> Self {
        let count = |record: &ForceRecord| match weighting {
            Weighting::Whitened => record.samples_n.len(),
            Weighting::Averaged => moving_average(&record.samples_n).len(),
        };
        let straight: Vec<Straight> = records
            .iter()
            .map(|force_record| Straight::new(count(force_record)))
            .collect();
        let mut measured = Vec::new();
        for (record, straight) in records.iter().zip(&straight) {
            let mut own = match weighting {
                Weighting::Whitened => record.samples_n.clone(),
                Weighting::Averaged => moving_average(&record.samples_n),
            };
            straight.remove_from(&mut own);
            measured.extend(own);
        }
        let mut problem = Self {
            records,
            weighting,
            straight,
            measured,
            logarithms: [0.0; PARAMETERS],
            residuals: Vec::new(),
            slopes: Vec::new(),
        };
        problem.move_to(start.map(libm::log));
        problem
    }

    /// Returns the constants that the solver is trying at present.
    pub fn constants(&self) -> Constants {
        self.logarithms.map(libm::exp)
    }

    /// Returns the sum of the squared residuals at the present constants, N².
    pub fn sum_of_squares(&self) -> f64 {
        self.residuals
            .iter()
            .map(|residual| residual * residual)
            .sum()
    }

    /// Returns the number of records, each of which has an offset and a drift of its own.
    pub fn records(&self) -> usize {
        self.records.len()
    }

    /// Returns the number of values that are compared, in all records together.
    pub fn count(&self) -> usize {
        self.measured.len()
    }

    fn move_to(&mut self, logarithms: [f64; PARAMETERS]) {
        let mut within = logarithms;
        for (own, [low, high]) in within.iter_mut().zip(RANGE) {
            *own = own.clamp(libm::log(low), libm::log(high));
        }
        self.logarithms = within;
        (self.residuals, self.slopes) = (Vec::new(), Vec::new());
        let constants = self.constants();
        for (record, straight) in self.records.iter().zip(&self.straight) {
            let (force, slopes) = simulate_record(constants, record);
            self.residuals
                .extend(prepare_values(&force, self.weighting, straight));
            let begin = self.slopes.len();
            for parameter in 0..PARAMETERS {
                let own: Vec<f64> = slopes.iter().map(|slope| slope[parameter]).collect();
                let own = prepare_values(&own, self.weighting, straight);
                self.slopes.resize(begin + own.len(), [0.0; PARAMETERS]);
                let rows = self.slopes.iter_mut().skip(begin);
                rows.zip(own).for_each(|(row, own)| row[parameter] = own);
            }
        }
        let pairs = self.residuals.iter_mut().zip(&self.measured);
        pairs.for_each(|(own, measured)| *own -= measured);
    }

    /// Changes the present A to the value that fits best while the other constants stay.
    pub fn scale(&mut self) {
        // The derivative dF/d ln A is F.
        let force = self.slopes.iter().map(|slope| slope[0]);
        let pairs = force.zip(&self.measured);
        let (across, square) = pairs.fold((0.0, 0.0), |(across, square), (f, m)| {
            (across + f * m, square + f * f)
        });
        let mut logarithms = self.logarithms;
        if across > 0.0 && square > 0.0 {
            logarithms[0] += libm::log(across / square);
        }
        self.move_to(logarithms);
    }

    /// Returns Fisher's information matrix about the logarithms of the constants, for white noise
    /// of 1 N.
    pub fn information(&self) -> SMatrix<f64, PARAMETERS, PARAMETERS> {
        let mut sum = SMatrix::zeros();
        for slopes in &self.slopes {
            let own = SVector::<f64, PARAMETERS>::from(*slopes);
            sum += own * own.transpose();
        }
        sum
    }

    /// Returns two quantities for white noise of 1 N in the samples, which averaging correlates.
    /// The first is the matrix JᵀWWᵀJ, where J are the derivatives and W the average. The second is
    /// the expected sum of squares of the averaged noise, without its straight line. The fit
    /// reduces this sum by the part that the constants can follow.
    pub fn averaged_noise(&self) -> (SMatrix<f64, PARAMETERS, PARAMETERS>, f64) {
        let (mut meat, mut trace) = (SMatrix::zeros(), 0.0);
        let mut begin = 0;
        for (record, straight) in self.records.iter().zip(&self.straight) {
            let samples = record.samples_n.len();
            let count = straight.0[0].len();
            let own = self.slopes.get(begin..begin + count).unwrap_or_default();
            begin += count;
            let columns: Vec<Vec<f64>> = (0..PARAMETERS)
                .map(|parameter| {
                    own.iter()
                        .map(|values| values[parameter])
                        .collect::<Vec<f64>>()
                })
                .map(|column| moving_average_transpose(&column, samples))
                .collect();
            let rows =
                (0..samples).map(|row| SVector::<f64, PARAMETERS>::from_fn(|i, _| columns[i][row]));
            rows.for_each(|own| meat += own * own.transpose());
            trace += count as f64 / super::WINDOW as f64;
            for direction in &straight.0 {
                trace -= moving_average_transpose(direction, samples)
                    .iter()
                    .map(|value| value * value)
                    .sum::<f64>();
            }
        }
        (meat, trace)
    }
}

/// Returns values in the form in which they are compared: averaged if `weighting` asks for it, and
/// without the straight line that fits them best.
fn prepare_values(values: &[f64], weighting: Weighting, straight: &Straight) -> Vec<f64> {
    let mut own = match weighting {
        Weighting::Whitened => values.to_vec(),
        Weighting::Averaged => moving_average(values),
    };
    straight.remove_from(&mut own);
    own
}

impl LeastSquaresProblem<f64, Dyn, U5> for Problem<'_> {
    type ResidualStorage = Owned<f64, Dyn>;
    type JacobianStorage = Owned<f64, Dyn, U5>;
    type ParameterStorage = Owned<f64, U5>;

    fn set_params(&mut self, x: &SVector<f64, PARAMETERS>) {
        self.move_to((*x).into());
    }

    fn params(&self) -> SVector<f64, PARAMETERS> {
        self.logarithms.into()
    }

    fn residuals(&self) -> Option<DVector<f64>> {
        let vector = DVector::from_column_slice(&self.residuals);
        vector
            .iter()
            .all(|value| value.is_finite())
            .then_some(vector)
    }

    fn jacobian(&self) -> Option<OMatrix<f64, Dyn, U5>> {
        let rows = self.slopes.len();
        Some(OMatrix::<f64, Dyn, U5>::from_fn(rows, |row, column| {
            self.slopes[row][column]
        }))
    }
}
