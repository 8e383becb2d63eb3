//! Counts in how many cases each claim holds, the paper's and ours.

use super::SUBJECTS;
use super::analysis::TrainAnalysis;
use super::quality::{Cell, FitKind, Thresholds, printed_analyses, replications};
use super::spread::mean_sd;
use super::study::{Part, Study};
use crate::laboratory::Share;
use host_core::identify::NAMES;

fn counted_share(id: &str, claim: &str, paper: Option<bool>, count: (u64, u64)) -> Share {
    Share::from_counts(id.to_owned(), claim.to_owned(), paper, count)
}

impl Study {
    /// Returns the share of cases in which each claim holds: first the paper's claims, then ours.
    pub(super) fn shares(&self, parts: &[Part]) -> Vec<Share> {
        let mut shares = self.subject_claims(parts);
        shares.extend(self.replication_claims(parts));
        shares.push(self.printed_thresholds(parts));
        shares.extend(self.found_thresholds(parts));
        shares.extend(self.covered(parts));
        shares
    }

    /// Judges the claims that apply to each replication of a subject.
    fn subject_claims(&self, parts: &[Part]) -> Vec<Share> {
        let analyses: Vec<&TrainAnalysis> = (0..SUBJECTS)
            .flat_map(|index| printed_analyses(parts, index))
            .collect();
        let count = |is: &dyn Fn(&TrainAnalysis) -> Option<bool>| {
            count_holds(analyses.iter().map(|analysis| is(analysis)))
        };
        let by_amplitude = |analysis: &TrainAnalysis, f: usize| {
            let own: Vec<f64> = analysis.peaks_n.iter().map(|peak_n| peak_n[f]).collect();
            rise(&own)
        };
        let times = |analysis: &TrainAnalysis| {
            let own = analysis.responses.last()?.iter();
            own.map(|response| Some(response.as_ref()?.t_rt_s()))
                .collect::<Option<Vec<f64>>>()
        };
        vec![
            counted_share(
                "rises-f",
                "peak force rises with frequency",
                Some(true),
                count(&|session| Some(session.peaks_n.iter().all(|peak_n| rise(peak_n)))),
            ),
            counted_share(
                "rises-i",
                "peak force rises with amplitude",
                Some(true),
                count(&|session| Some((0..3).all(|f| by_amplitude(session, f)))),
            ),
            counted_share(
                "t-rises",
                "T_RT rises with frequency",
                Some(true),
                count(&|session| Some(rise(&times(session)?))),
            ),
            counted_share(
                "t-flat",
                "measured T_RT does not depend on amplitude",
                Some(true),
                count(&|session| flat(session, self.declared.claims.flat)),
            ),
        ]
    }

    /// Judges the claims about means over subjects, once per replication of all subjects.
    fn replication_claims(&self, parts: &[Part]) -> Vec<Share> {
        let claims = &self.declared.claims;
        let count = |is: &dyn Fn(&[&TrainAnalysis]) -> Option<bool>| {
            count_holds((0..self.draws).map(|draw| is(&self.draw_analyses(parts, draw))))
        };
        let last = self.declared.trains.amplitudes - 1;
        vec![
            counted_share(
                "r2",
                &format!("mean R² of the exponential is above {}", claims.r2),
                Some(true),
                count(&|all| above_r2(all, claims.r2)),
            ),
            counted_share(
                "nrmse-i5",
                "mean NRMSE of the model at I5: below 10 %",
                Some(true),
                count(&|all| Some(mean_nrmse(all, last)? < claims.nrmse_i5_percent)),
            ),
            counted_share(
                "nrmse",
                "mean NRMSE of the model at I1 to I4: ≤ 13.1 %",
                Some(true),
                count(&|all| {
                    let means: Option<Vec<f64>> = (0..last).map(|i| mean_nrmse(all, i)).collect();
                    Some(means?.iter().all(|mean| *mean <= claims.nrmse_percent))
                }),
            ),
        ]
    }

    fn printed_thresholds(&self, parts: &[Part]) -> Share {
        let step = self.declared.search.step_ma + 1e-9;
        let near = replications(parts).map(|draw| {
            let printed_ma = self.truths.get(draw.subject)?.printed_ma;
            Some((draw.searched.i_mt_ma()? - printed_ma).abs() <= step)
        });
        let claim = "I_MT found by force: printed value ± 0.5 mA";
        counted_share("i-mt", claim, Some(true), count_holds(near))
    }

    fn found_thresholds(&self, parts: &[Part]) -> Vec<Share> {
        let found: Thresholds = self.thresholds(replications(parts));
        let rows = [
            (
                "detector-false",
                "detector: threshold found where no fibre responds",
                found.without_force,
            ),
            (
                "detector-early",
                "detector: threshold below the true step",
                found.early,
            ),
            (
                "detector-near",
                "detector: within one step of the true threshold",
                found.within,
            ),
            (
                "bare-false",
                "0.015 N rule alone: found where no fibre responds",
                found.bare_without_force,
            ),
            (
                "bare-near",
                "0.015 N rule alone: within one step",
                found.bare_within,
            ),
        ];
        rows.map(|(id, claim, holds)| counted_share(id, claim, None, (holds, found.of)))
            .into()
    }

    fn covered(&self, parts: &[Part]) -> Vec<Share> {
        let mut shares = Vec::new();
        let fits = [
            (FitKind::Whitened, "95 % interval contains the true"),
            (
                FitKind::Averaged,
                "averaged fit: interval contains the true",
            ),
        ];
        for (which, claim) in fits {
            let cells = self.cells(parts, which);
            for (i, name) in NAMES.iter().enumerate() {
                let sum = |quantity: fn(&Cell) -> u32| -> u64 {
                    cells.iter().map(|cell| u64::from(quantity(&cell[i]))).sum()
                };
                let count = (sum(|cell| cell.covers), sum(|cell| cell.of));
                let id = format!("covers-{}-{name}", which as usize);
                shares.push(counted_share(&id, &format!("{claim} {name}"), None, count));
            }
        }
        shares
    }
}

fn rise(values: &[f64]) -> bool {
    values.windows(2).all(|window| window[1] > window[0])
}

fn mean_nrmse(analyses: &[&TrainAnalysis], i: usize) -> Option<f64> {
    let own: Option<Vec<f64>> = analyses
        .iter()
        .map(|analysis| Some(analysis.agreements.get(i)?.nrmse_percent))
        .collect();
    Some(mean_sd(&own?)?.0)
}

fn above_r2(analyses: &[&TrainAnalysis], least: f64) -> Option<bool> {
    let mean_r2 = |f: usize| -> Option<f64> {
        let own: Option<Vec<f64>> = analyses
            .iter()
            .map(|analysis| Some(analysis.exponentials[f]?.1.r2))
            .collect();
        Some(mean_sd(&own?)?.0)
    };
    let means: Option<Vec<f64>> = (0..3).map(mean_r2).collect();
    Some(means?.iter().all(|mean| *mean > least))
}

/// Returns whether T_RT changes by less than `part` from I1 to I5, averaged over frequencies.
fn flat(analysis: &TrainAnalysis, part: f64) -> Option<bool> {
    let (first, last) = (
        analysis.measured_t_rt_s.first()?,
        analysis.measured_t_rt_s.last()?,
    );
    let changes: Option<Vec<f64>> = first
        .iter()
        .zip(last)
        .map(|(from, to)| Some((*to)? / (*from)? - 1.0))
        .collect();
    Some(mean_sd(&changes?)?.0.abs() < part)
}

fn count_holds(verdicts: impl Iterator<Item = Option<bool>>) -> (u64, u64) {
    let judged: Vec<bool> = verdicts.flatten().collect();
    (
        judged.iter().filter(|flag| **flag).count() as u64,
        judged.len() as u64,
    )
}
