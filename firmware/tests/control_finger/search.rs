//! The search that chose the default gains: 120 random candidates, then 120 in shrinking steps
//! around the best, judged on 12 random wearers with one and two points. The result is then tested
//! on 40 other wearers.

use crate::control_finger::plant::{Finger, Random};
use crate::control_finger::trial::{Points, Wire, run, spec};
use firmware::control::{Joint, LawSpec};

/// Family of controllers: bounds of each gain, and a function that builds a controller from gains.
/// The last gain is always the cutoff in mHz.
pub struct Family {
    pub name: &'static str,
    pub bounds: &'static [(f64, f64)],
    pub law: fn(&[f64]) -> LawSpec,
}

pub const RECOMMENDED: Family = Family {
    name: "recommended",
    bounds: &[
        (1e3, 3e4),
        (20.0, 2e3),
        (100.0, 1e4),
        (1e4, 1e6),
        (2e3, 2e4),
    ],
    law: |g| LawSpec::Recommended {
        lambda_milli: g[0] as u32,
        k1_milli: g[1] as u32,
        k2_milli: g[2] as u32,
        b_milli: g[3] as u32,
        k3_milli: 0,
        ki_milli: 0,
    },
};

pub const PID: Family = Family {
    name: "pid",
    bounds: &[(200.0, 1e4), (100.0, 3e4), (10.0, 2e3), (2e3, 2e4)],
    law: |g| LawSpec::Pid {
        kp_milli: g[0] as u32,
        ki_milli: g[1] as u32,
        kd_milli: g[2] as u32,
    },
};

/// Returns `n` random wearers of one seed.
pub fn wearers(seed: u64, n: usize) -> Vec<Finger> {
    let mut random = Random(seed);
    (0..n).map(|_| Finger::generate(&mut random)).collect()
}

/// Returns the mean RMSE against the reachable reference for point A and for two points.
pub fn score(law: LawSpec, period: u8, cutoff: u32, wearers: &[Finger]) -> [f64; 2] {
    [Points::A, Points::Both].map(|points| {
        let s = spec(law, period, cutoff, points);
        let outcomes = wearers
            .iter()
            .zip(100..)
            .map(|(f, seed)| run(&s, *f, seed, Wire::Sound));
        outcomes.map(|o| o.rmse_reachable).sum::<f64>() / wearers.len() as f64
    })
}

/// Returns the best gains for a period after `budget` trials of each kind.
pub fn search(family: &Family, period: u8, budget: usize) -> Vec<f64> {
    let training = wearers(1, 12);
    let mut random = Random(7);
    let judge = |g: &[f64]| {
        let cutoff = g[g.len() - 1] as u32;
        let s = spec((family.law)(g), period, cutoff, Points::A);
        if Joint::new(&s).is_err() {
            return f64::INFINITY;
        }
        score((family.law)(g), period, cutoff, &training)
            .iter()
            .sum::<f64>()
            / 2.0
    };
    let mut best: (f64, Vec<f64>) = (f64::INFINITY, Vec::new());
    for i in 0..2 * budget {
        let spread = 0.5 * (1.0 - (i as f64 - budget as f64) / budget as f64).max(0.05);
        let g: Vec<f64> = family
            .bounds
            .iter()
            .enumerate()
            .map(|(j, (low, high))| {
                let x = random.uniform();
                let log = if i < budget {
                    low.ln() + x * (high / low).ln()
                } else {
                    best.1[j].ln() + (x - 0.5) * 2.0 * spread
                };
                log.exp().clamp(*low, *high).round()
            })
            .collect();
        let rmse = judge(&g);
        if rmse < best.0 {
            best = (rmse, g);
        }
    }
    println!(
        "{:12} {period:2} ms  training {:5.2}  {:?}",
        family.name, best.0, best.1
    );
    best.1
}
