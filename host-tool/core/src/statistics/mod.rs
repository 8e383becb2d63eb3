//! Statistical tests, effect sizes and intervals that the analyses of experiments share.
//!
//! The inputs are values of subjects, conditions and trials, as slices. The outputs are structs
//! with statistic, degrees of freedom and p-value, or a [`StatisticsError`] that names the mistake
//! in the sample, never a NaN. No function here reads records, knows units or keeps a random state
//! (a bootstrap takes its seed). `docs/reference/statistics.md` lists each method with its place, its source,
//! and its check against SciPy and statsmodels.

mod alignment;
mod comparison;
mod descriptive;
mod detector;
mod distribution;
mod interval;
mod normality;
mod ranks;
mod sample;
mod variance;

pub use alignment::{Alignment, kabsch};
pub use comparison::{PairedT, bonferroni, cohens_d_paired, cohens_d_pooled, holm, paired_t};
pub use descriptive::{Sorted, Spread, mean, median, quantile, range, standard_deviation};
pub use detector::{Detector, Verdict};
pub use distribution::{chi_squared_p, fisher_f_p, student_t_p};
pub use interval::{Interval, Share, bootstrap_bca, share_upper_bound, wilson_share};
pub use normality::{ShapiroWilk, shapiro_wilk};
pub use ranks::{Friedman, MannWhitney, Method, Wilcoxon, friedman, mann_whitney, wilcoxon};
pub use sample::StatisticsError;
pub use variance::{
    CorrectedP, Effect, Mauchly, RepeatedMeasures, TwoWay, TwoWayRepeated, mauchly,
    repeated_measures, two_way, two_way_repeated,
};
