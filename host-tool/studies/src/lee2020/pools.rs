//! Determines which recruitment curve would explain the printed values, by varying the threshold
//! distribution of the fibre pool.
//!
//! Peak force is proportional to recruitment, so neither noise nor trains are needed: the
//! exponential that fits the peaks, its quality, and the step at which a search by force ends.

use super::quality::printed_peak_n;
use super::spread::{cell, mean_sd};
use super::study::Study;
use super::{SUBJECTS, paper};
use crate::laboratory::{Grid, Sheet};
use hal_sim::body::bench::{Pool, wrist};
use host_core::identify::{Exponential, agreement};

/// Lowest fibre thresholds to try, as fractions of the printed I_MT; the test rig has 0.8.
const LOWEST: [f64; 5] = [0.3, 0.5, 0.65, 0.8, 0.95];
/// Spreads of fibre thresholds to try, as fractions of the printed I_MT; the test rig has 0.25.
const SPREADS: [f64; 2] = [0.25, 0.5];
/// Force that a 40 ms mean must exceed for a search to end, N.
const MOVES_N: f64 = 0.015;

impl Study {
    /// Tabulates pools of fibres with the printed ratio of the forces at I_MT and at 1.5·I_MT, but
    /// with other thresholds (table E, which the paper does not have).
    pub(super) fn pools(&self) -> Sheet {
        let mut rows = Vec::new();
        for spread in SPREADS {
            for lowest in LOWEST {
                let results: Vec<[f64; 3]> = (0..SUBJECTS)
                    .filter_map(|index| self.pool(index, (lowest, spread)))
                    .collect();
                let mean = |i: usize| {
                    let own: Vec<f64> = results.iter().map(|values| values[i]).collect();
                    mean_sd(&own).map(|pair| pair.0)
                };
                rows.push(vec![
                    format!("{lowest} and {spread}"),
                    results.len().to_string(),
                    cell(mean(0), 3),
                    cell(mean(1), 3),
                    cell(mean(2), 2),
                ]);
            }
        }
        let [_, b, r2, ..] = paper::TABLE_3[1];
        rows.push(vec![
            "paper, 30 Hz".to_owned(),
            "10".to_owned(),
            b.to_string(),
            r2.to_string(),
            "1".to_owned(),
        ]);
        let heads = [
            "lowest and spread / I_MT",
            "subjects",
            "b (1/mA)",
            "R²",
            "found/printed",
        ];
        let grid = Grid {
            heads: heads.map(str::to_owned).into(),
            rows,
        };
        let caption = "Pools of muscle fibres that all reproduce the force ratios of table 2 but \
                       differ in the lowest threshold of a fibre and in the spread of thresholds, \
                       both as fractions of I_MT; means over subjects. b and R²: the exponential \
                       fitted from the printed I_MT to 1.5 times it. found/printed: the I_MT that \
                       a search for 0.015 N in steps of 0.5 mA finds, divided by the printed one. \
                       If the lowest threshold is far below I_MT, the exponential fits well but \
                       the search finds too low an I_MT; if it is close to I_MT, the opposite \
                       holds.";
        Sheet::table(
            "Table E",
            "lowest threshold of the fibres",
            caption.to_owned(),
            grid,
        )
    }

    /// Returns b and R² of the exponential, and the ratio of the I_MT that a search finds to the
    /// printed I_MT, for a pool of this subject. `lowest` and `spread` are fractions of the printed
    /// I_MT.
    fn pool(&self, subject: usize, (lowest, spread): (f64, f64)) -> Option<[f64; 3]> {
        let (i_mt, forces) = wrist::PRINTED.get(subject)?;
        let ratio: f64 = forces.iter().map(|[weak, strong]| weak / strong).product();
        let most_ma = self.declared.trains.reach * i_mt;
        let shape = (lowest * i_mt, spread * i_mt);
        let pool = Pool::from_ratio(shape, (*i_mt, most_ma), libm::cbrt(ratio)).ok()?;
        let most_n = printed_peak_n(self, subject)?;
        let peak_n = |ma: f64| most_n * pool.share(ma) / pool.share(most_ma);
        let count = self.declared.trains.amplitudes;
        let at = |i: usize| i_mt + (most_ma - i_mt) * i as f64 / (count - 1) as f64;
        let points: Vec<(f64, f64)> = (0..count).map(at).map(|ma| (ma, peak_n(ma))).collect();
        let own = Exponential::fit(&points)?;
        let estimated: Vec<f64> = points.iter().map(|(ma, _)| own.at(*ma)).collect();
        let measured: Vec<f64> = points.iter().map(|(_, n)| *n).collect();
        let search = &self.declared.search;
        let steps = (search.most_ma / search.step_ma) as u32;
        let found = (1..=steps).map(|step| f64::from(step) * search.step_ma);
        let found_ma = found.into_iter().find(|ma| peak_n(*ma) > MOVES_N)?;
        Some([
            own.b_per_ma,
            agreement(&estimated, &measured).r2,
            found_ma / i_mt,
        ])
    }
}
