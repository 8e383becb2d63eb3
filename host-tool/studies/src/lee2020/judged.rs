//! Tabulates our results A to D: the accuracy of the method, judged by the known true values.

use super::quality::{FitKind, subject_replications};
use super::spread::{cell, mean_sd, median};
use super::study::{Part, Study};
use super::tables::grid;
use super::{SUBJECTS, name, paper};
use crate::laboratory::Sheet;
use host_core::identify::{NAMES, PARAMETERS, WINDOW};

/// Returns the standard deviation of white noise in a sample, N. After averaging over 40 ms, this
/// noise is as large and as correlated as the residuals of table 4.
fn residual_n(subject: usize) -> f64 {
    paper::TABLE_4[subject][6] * (WINDOW as f64).sqrt()
}

impl Study {
    /// Tabulates how often the 95 % intervals contain the true value, and the variance divided by
    /// its Cramér-Rao bound (tables A and B, which the paper does not have).
    pub(super) fn quality(&self, parts: &[Part], which: FitKind) -> Sheet {
        let cells = self.cells(parts, which);
        let mut rows = Vec::new();
        for (subject, own) in cells.iter().enumerate() {
            let mut row = vec![name(subject)];
            for item in own {
                let covers = 100.0 * f64::from(item.covers) / f64::from(item.of.max(1));
                let over = cell(
                    Some(item.over_bound).filter(|over_bound| over_bound.is_finite()),
                    2,
                );
                row.push(format!("{covers:.1} {over} {:.2}", 100.0 * item.least));
            }
            rows.push(row);
        }
        let mut row = vec!["all".to_owned()];
        for i in 0..PARAMETERS {
            let total: u32 = cells.iter().map(|cell| cell[i].of).sum();
            let covers: u32 = cells.iter().map(|cell| cell[i].covers).sum();
            let logarithms: Vec<f64> = cells
                .iter()
                .map(|cell| libm::log(cell[i].over_bound))
                .filter(|value| value.is_finite())
                .collect();
            let geometric = mean_sd(&logarithms).map(|pair| libm::exp(pair.0));
            row.push(format!(
                "{:.1} {}",
                100.0 * f64::from(covers) / f64::from(total.max(1)),
                cell(geometric, 2)
            ));
        }
        rows.push(row);
        let mut heads = vec![""];
        heads.extend(NAMES);
        let (number, title) = match which {
            FitKind::Whitened => ("Table A", "intervals of the fit to samples"),
            FitKind::Averaged => ("Table B", "intervals of the fit to averaged force"),
        };
        let caption = "Three numbers for each constant: coverage of the 95 % interval in %; \
                       variance divided by the Cramér-Rao bound; and the standard deviation at \
                       the bound in % of the constant. The last row pools all subjects, with the \
                       geometric mean of the ratios. This table is ours; the paper has no \
                       intervals.";
        Sheet::table(number, title, caption.to_owned(), grid(&heads, rows))
    }

    /// Tabulates the best accuracy that data of this kind allow (table C, which the paper does not
    /// have).
    pub(super) fn bounds_table(&self) -> Sheet {
        let frequencies = self.declared.trains.frequencies_hz;
        let cases: [(&str, &[u32], usize, bool); 5] = [
            ("three trains with decay", &frequencies, 1_000, false),
            ("40 Hz with decay", &frequencies[2..], 1_000, false),
            ("40 Hz without decay", &frequencies[2..], 0, false),
            ("three, noise as in table 4", &frequencies, 1_000, true),
            ("40 Hz, noise as in table 4", &frequencies[2..], 1_000, true),
        ];
        let mut rows = Vec::new();
        for (label, trains, decay, is_large) in cases {
            let noise_n = |subject: usize| match is_large {
                true => residual_n(subject),
                false => self.truths[subject].spec.sensor.noise_n,
            };
            let bounds: Vec<_> = (0..SUBJECTS)
                .map(|index| self.bound_of(index, trains, decay, noise_n(index)))
                .collect();
            let mut row = vec![label.to_owned()];
            for (i, constant) in NAMES.iter().enumerate() {
                let errors = bounds
                    .iter()
                    .flatten()
                    .map(|bound| 100.0 * bound.errors()[i]);
                let untold = bounds
                    .iter()
                    .flatten()
                    .filter(|bound| bound.untold.contains(constant))
                    .count();
                row.push(format!("{} ({untold})", cell(median(errors), 1)));
            }
            rows.push(row);
        }
        let mut heads = vec!["% (undetermined)"];
        heads.extend(NAMES);
        let caption = "Smallest standard deviation that such data allow (Cramér-Rao bound), in % \
                       of the constant, as the median over subjects. In brackets: for how many of \
                       the ten subjects the 95 % interval extends beyond ±50 %, so that the data \
                       do not determine the constant.";
        Sheet::table(
            "Table C",
            "accuracy that data allow",
            caption.to_owned(),
            grid(&heads, rows),
        )
    }

    /// Tabulates thresholds and the resulting haptic range (table D, which the paper does not
    /// have).
    pub(super) fn thresholds_table(&self, parts: &[Part]) -> Sheet {
        let mut rows = Vec::new();
        for (subject, truth) in self.truths.iter().enumerate() {
            let i_mt = median(
                subject_replications(parts, subject).filter_map(|draw| draw.searched.i_mt_ma()),
            );
            let bare = median(
                subject_replications(parts, subject).filter_map(|draw| draw.searched.bare_ma),
            );
            let found = self.thresholds(subject_replications(parts, subject));
            let percent = |n: u64| format!("{:.1}", 100.0 * n as f64 / found.of.max(1) as f64);
            let peak = |i: usize| {
                let peaks = subject_replications(parts, subject)
                    .filter_map(|draw| Some(draw.found.as_ref().ok()?.peaks_n.get(i)?[2]));
                median(peaks)
            };
            let last = self.declared.trains.amplitudes - 1;
            let range = i_mt.map_or_else(
                || "-".to_owned(),
                |value| format!("{value:.1}-{:.2}", self.declared.trains.reach * value),
            );
            let placement =
                median(subject_replications(parts, subject).map(|draw| draw.searched.placement_n));
            rows.push(vec![
                name(subject),
                format!("{:.1}", truth.printed_ma),
                format!("{:.1}", truth.i_mt_ma),
                cell(i_mt, 1),
                percent(found.within),
                cell(bare, 1),
                percent(found.bare_within),
                range,
                format!("{}-{}", cell(peak(0), 2), cell(peak(last), 1)),
                cell(placement, 2),
            ]);
        }
        let heads = "mA,print,true,ours,±1 %,bare,±1 %,range,N at 40 Hz,8 mA/N";
        let heads: Vec<&str> = heads.split(',').collect();
        let caption = "Motor threshold I_MT. print: as the paper prints it. true: the lowest step \
                       at which the noise-free 40 ms mean exceeds 0.015 N. ours: found by the \
                       detector (median). bare: found by the 0.015 N rule alone (median). ±1 %: \
                       percentage of replications in which the value to its left is within one \
                       step of the true one. range: the haptic range, I_MT to 1.5·I_MT, mA. N at \
                       40 Hz: peak force at both ends of this range. 8 mA/N: force of the \
                       placement pulse of 8 mA, N.";
        Sheet::table(
            "Table D",
            "motor thresholds",
            caption.to_owned(),
            grid(&heads, rows),
        )
    }
}
