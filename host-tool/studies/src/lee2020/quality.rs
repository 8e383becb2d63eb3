//! Evaluates the accuracy of the method against the known true values: coverage, variance bound,
//! thresholds, and the limits of such data.

use super::analysis::{TrainAnalysis, period_s};
use super::study::{Part, Study, SubjectReplication};
use super::{SUBJECTS, paper};
use host_core::identify::{Bound, ForceRecord, PARAMETERS, cramer_rao_bound, response};

/// Accuracy of the estimates of one constant in one subject.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Cell {
    /// Number of replications with a fit.
    pub of: u32,
    /// Number of fits whose interval contains the true value.
    pub covers: u32,
    /// Variance of the logarithm of the estimate, divided by its Cramér-Rao bound.
    pub over_bound: f64,
    /// Mean logarithm of the ratio of estimate to true value; 0 without bias.
    pub bias: f64,
    /// Smallest standard deviation that the data allow (Cramér-Rao bound), as a fraction of the
    /// constant.
    pub least: f64,
}

/// Index of a fit in [`TrainAnalysis::fits`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum FitKind {
    Whitened = 0,
    Averaged = 1,
}

/// Returns every replication of this subject.
pub(super) fn subject_replications(
    parts: &[Part],
    subject: usize,
) -> impl Iterator<Item = &SubjectReplication> {
    replications(parts).filter(move |draw| draw.subject == subject)
}

/// Returns every replication of every subject.
pub(super) fn replications(parts: &[Part]) -> impl Iterator<Item = &SubjectReplication> {
    parts.iter().filter_map(|part| match part {
        Part::Own(drawn) => Some(&**drawn),
        Part::Foreign(_) => None,
    })
}

/// Returns the analyses of this subject's trains at the printed amplitudes, without failed ones.
pub(super) fn printed_analyses(
    parts: &[Part],
    subject: usize,
) -> impl Iterator<Item = &TrainAnalysis> {
    subject_replications(parts, subject).filter_map(|draw| draw.printed.as_ref().ok())
}

impl Study {
    /// Returns a train of one second at each frequency, with a record of zeros from 0.5 s before
    /// the train to `decay_ms` after it.
    fn trains(&self, frequencies_hz: &[u32], decay_ms: usize) -> Vec<ForceRecord> {
        let record = |hz: &u32| ForceRecord {
            pulses_us: (0..*hz)
                .map(|i| 500_000 + i * ((1_000_000 + hz / 2) / hz))
                .collect(),
            samples_n: vec![0.0; 1_500 + decay_ms],
            gain: 1.0,
        };
        frequencies_hz.iter().map(record).collect()
    }

    /// Returns the Cramér-Rao bound for a subject's trains at I5, one at each frequency, that are
    /// recorded until `decay_ms` after the train with `noise_n` of noise per sample, N.
    pub(super) fn bound_of(
        &self,
        subject: usize,
        frequencies_hz: &[u32],
        decay_ms: usize,
        noise_n: f64,
    ) -> Option<Bound> {
        let truth = self.truths.get(subject)?;
        let most_ma = self.declared.trains.reach * truth.printed_ma;
        let constants = truth.constants(most_ma, self.declared.trains.width_us);
        cramer_rao_bound(constants, &self.trains(frequencies_hz, decay_ms), noise_n)
    }

    /// Returns the accuracy by subject and constant.
    pub(super) fn cells(&self, parts: &[Part], which: FitKind) -> Vec<[Cell; PARAMETERS]> {
        let frequencies = self.declared.trains.frequencies_hz;
        let subject = |subject: usize| {
            let truth = &self.truths[subject];
            let noise_n = truth.spec.sensor.noise_n;
            let bound = self.bound_of(subject, &frequencies, 1_000, noise_n);
            let errors = bound.map_or([f64::NAN; PARAMETERS], |bound| bound.errors());
            let most_ma = self.declared.trains.reach * truth.printed_ma;
            let constants = truth.constants(most_ma, self.declared.trains.width_us);
            let fits: Vec<_> = printed_analyses(parts, subject)
                .map(|analysis| &analysis.fits[which as usize])
                .collect();
            std::array::from_fn(|i| {
                let n = fits.len() as f64;
                let off = |fit: &&_| logarithm(fit, i, constants[i]);
                let mean = fits.iter().map(off).sum::<f64>() / n;
                let square = fits
                    .iter()
                    .map(|fit| (off(fit) - mean).powi(2))
                    .sum::<f64>();
                let covers = fits
                    .iter()
                    .filter(|fit| fit.estimates()[i].covers(constants[i]));
                Cell {
                    of: fits.len() as u32,
                    covers: covers.count() as u32,
                    over_bound: square / (n - 1.0) / errors[i].powi(2),
                    bias: mean,
                    least: errors[i],
                }
            })
        };
        (0..SUBJECTS).map(subject).collect()
    }

    /// Returns the rms difference between T_RT and table 7, ms, for the fitted models (medians over
    /// draws) and for the true constants. Subjects whose printed values contain a mistake are
    /// separate; K06's τ2 is corrected in both.
    pub(super) fn t_rt_off_ms(&self, parts: &[Part]) -> [TimesOff; 2] {
        let fitted = |subject: usize, f: usize| {
            let responses = printed_analyses(parts, subject)
                .filter_map(|analysis| analysis.responses.last()?[f]);
            super::spread::median(responses.map(|response| 1e3 * response.t_rt_s()))
        };
        let truth = |subject: usize, f: usize| self.true_t_rt_ms(subject)[f];
        [times_off(&fitted), times_off(&truth)]
    }

    /// Returns T_RT of the true constants by frequency, ms.
    pub(super) fn true_t_rt_ms(&self, subject: usize) -> [Option<f64>; 3] {
        let truth = &self.truths[subject];
        let most_ma = self.declared.trains.reach * truth.printed_ma;
        let constants = truth.constants(most_ma, self.declared.trains.width_us);
        self.declared.trains.frequencies_hz.map(|hz| {
            let own = response(constants, period_s(hz), 1.0)?;
            Some(1e3 * own.t_rt_s())
        })
    }
}

/// Root mean square difference between T_RT and table 7, ms.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct TimesOff {
    /// Difference over the eight subjects whose printed values are consistent.
    pub usual: Option<f64>,
    /// Differences of K06 and of K08, whose printed values contain a mistake.
    pub apart: [Option<f64>; 2],
}

fn times_off(ours: &dyn Fn(usize, usize) -> Option<f64>) -> TimesOff {
    let rms = |subjects: &[usize]| {
        let pairs = subjects
            .iter()
            .flat_map(|subject| (0..3).map(move |f| (*subject, f)));
        let squares: Option<Vec<f64>> = pairs
            .map(|(subject, f)| Some((ours(subject, f)? - paper::TABLE_7[subject][f]).powi(2)))
            .collect();
        let squares = squares?;
        Some((squares.iter().sum::<f64>() / squares.len() as f64).sqrt())
    };
    let usual: Vec<usize> = (0..SUBJECTS)
        .filter(|index| !paper::APART.contains(index))
        .collect();
    TimesOff {
        usual: rms(&usual),
        apart: paper::APART.map(|index| rms(&[index])),
    }
}

fn logarithm(fit: &host_core::identify::ForceFit, i: usize, truth: f64) -> f64 {
    libm::log(fit.constants[i] / truth)
}

/// Counts over threshold searches.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Thresholds {
    /// Number of all searches.
    pub of: u64,
    /// Number of searches that ended at an amplitude that activates no fibre.
    pub without_force: u64,
    /// Number of searches that found a threshold below the true one.
    pub early: u64,
    /// Number of searches that ended within one step of the true threshold.
    pub within: u64,
    /// Number of searches by the bare rule that ended at an amplitude that activates no fibre.
    pub bare_without_force: u64,
    /// Number of searches by the bare rule that ended within one step of the true threshold.
    pub bare_within: u64,
}

impl Study {
    /// Counts the searches of these replications.
    pub(super) fn thresholds<'p>(
        &self,
        draws: impl Iterator<Item = &'p SubjectReplication>,
    ) -> Thresholds {
        let mut sum = Thresholds::default();
        let step = self.declared.search.step_ma + 1e-9;
        for draw in draws {
            let truth = &self.truths[draw.subject];
            let (found, bare) = (draw.searched.i_mt_ma(), draw.searched.bare_ma);
            let is = |ma: Option<f64>, condition: &dyn Fn(f64) -> bool| {
                u64::from(ma.is_some_and(condition))
            };
            let nothing = |ma: f64| ma <= truth.lowest_ma;
            let near = |ma: f64| (ma - truth.i_mt_ma).abs() <= step;
            sum.of += 1;
            sum.without_force += is(found, &nothing);
            sum.early += is(found, &|ma| ma < truth.i_mt_ma - 1e-9);
            sum.within += is(found, &near);
            sum.bare_without_force += is(bare, &nothing);
            sum.bare_within += is(bare, &near);
        }
        sum
    }
}

/// Returns the peak force of the true model at the printed 1.5·I_MT and 30 Hz, N.
pub(super) fn printed_peak_n(study: &Study, subject: usize) -> Option<f64> {
    let truth = study.truths.get(subject)?;
    let most_ma = study.declared.trains.reach * truth.printed_ma;
    let constants = truth.constants(most_ma, study.declared.trains.width_us);
    Some(response(constants, 1.0 / 30.0, 1.0)?.peak_n)
}
