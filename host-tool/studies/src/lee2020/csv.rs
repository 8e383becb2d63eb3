//! Writes `draws.csv` with a row per replication, from which every result can be recomputed.

use super::analysis::TrainAnalysis;
use super::study::{Part, Study, SubjectReplication};
use super::{SUBJECTS, name};
use host_core::identify::NAMES;
use std::fmt::Write;

impl Study {
    /// Returns `draws.csv` with the replications in their order.
    #[must_use]
    pub fn csv(&self, parts: &[Part]) -> String {
        let mut text =
            "subject,draw,session,became,i_mt_ma,bare_ma,placement_n,true_i_mt_ma".to_owned();
        for fit in ["", "averaged_"] {
            for name in NAMES {
                let _ = write!(text, ",{fit}{name},{fit}{name}_low,{fit}{name}_high");
            }
        }
        text += ",noise_n";
        for amplitude in 1..=self.declared.trains.amplitudes {
            for hz in self.declared.trains.frequencies_hz {
                let _ = write!(text, ",peak_i{amplitude}_{hz}_n,t_rt_i{amplitude}_{hz}_ms");
            }
            let _ = write!(text, ",i{amplitude}_ma,nrmse_i{amplitude}_percent");
        }
        for hz in self.declared.trains.frequencies_hz {
            let _ = write!(text, ",a_{hz}_n,b_{hz}_per_ma,r2_{hz}");
        }
        text.push('\n');
        for part in parts {
            if let Part::Own(drawn) = part {
                self.lines(&mut text, drawn);
            }
        }
        text
    }

    /// Returns `mismatch.csv`, with a row for each model mismatch of each subject.
    #[must_use]
    pub fn mismatch_csv(&self, parts: &[Part]) -> String {
        let mut text =
            "subject,departure,size,nrmse_i1,nrmse_i2,nrmse_i3,nrmse_i4,nrmse_i5".to_owned();
        for name in NAMES {
            let _ = write!(text, ",{name}_over_truth,{name}_covered");
        }
        text.push('\n');
        for part in parts {
            let Part::Foreign(Ok(mismatch)) = part else {
                continue;
            };
            let _ = write!(
                text,
                "{},{},{}",
                name(mismatch.subject),
                mismatch.foreign.kind.name(),
                mismatch.foreign.size
            );
            for nrmse in &mismatch.nrmse_percent {
                let _ = write!(text, ",{nrmse:.4}");
            }
            for (ratio, covers) in mismatch.ratios.iter().zip(mismatch.covers) {
                let _ = write!(text, ",{ratio:.6},{covers}");
            }
            text.push('\n');
        }
        text
    }

    fn lines(&self, text: &mut String, drawn: &SubjectReplication) {
        let number =
            |number: Option<f64>| number.map_or_else(String::new, |value| format!("{value:.4}"));
        debug_assert!(drawn.subject < SUBJECTS);
        let truth = self.truths.get(drawn.subject).map(|truth| truth.i_mt_ma);
        for (session, came) in [("printed", &drawn.printed), ("found", &drawn.found)] {
            let became = came.as_ref().err().map_or("whole", |why| why.as_str());
            let became = became.replace('"', "'").replace('\n', " ");
            let _ = write!(
                text,
                "{},{},{session},\"{became}\",{},{},{:.4},{}",
                name(drawn.subject),
                drawn.draw,
                number(drawn.searched.i_mt_ma()),
                number(drawn.searched.bare_ma),
                drawn.searched.placement_n,
                number(truth)
            );
            if let Ok(found) = came {
                numbers(text, found);
            }
            text.push('\n');
        }
    }
}

fn numbers(text: &mut String, found: &TrainAnalysis) {
    for fit in &found.fits {
        let scale = [1.0, 1.0, 1e3, 1e3, 1e3];
        for (estimate, scale) in fit.estimates().iter().zip(scale) {
            let (value, low, high) = (
                scale * estimate.value,
                scale * estimate.low,
                scale * estimate.high,
            );
            let _ = write!(text, ",{value:.6},{low:.6},{high:.6}");
        }
    }
    let _ = write!(text, ",{:.6}", found.fits[0].noise_n);
    let pairs = found.peaks_n.iter().zip(&found.measured_t_rt_s);
    let rows = pairs.zip(found.amplitudes.iter().zip(&found.agreements));
    for ((peaks, times), (ma, agreement)) in rows {
        for (peak, time) in peaks.iter().zip(times) {
            let _ = write!(
                text,
                ",{peak:.5},{:.3}",
                time.map_or(f64::NAN, |seconds| 1e3 * seconds)
            );
        }
        let _ = write!(text, ",{ma:.3},{:.4}", agreement.nrmse_percent);
    }
    for exponential in &found.exponentials {
        match exponential {
            Some((exponential, agreement)) => {
                let _ = write!(
                    text,
                    ",{:.6},{:.6},{:.6}",
                    exponential.a_n, exponential.b_per_ma, agreement.r2
                );
            }
            None => text.push_str(",,,"),
        }
    }
}
