//! The electrodes' circuit against a general circuit of nodes and branches with a dense solver and
//! a matrix exponential for the capacitors. The two share no code.
#![expect(
    clippy::needless_range_loop,
    reason = "matrices read best by row and column"
)]

use hal_sim::body::hand::network::{Charge, Network, Piece, Skin, Terminal};
use hal_sim::random::unit;

/// Solves `rows · x = right` by Gaussian elimination with pivoting.
fn solve(mut rows: Vec<Vec<f64>>, mut right: Vec<f64>) -> Vec<f64> {
    let n = right.len();
    for column in 0..n {
        let size = |row: usize, rows: &[Vec<f64>]| rows[row][column].abs();
        let pivot = (column..n)
            .max_by(|a, b| size(*a, &rows).total_cmp(&size(*b, &rows)))
            .unwrap();
        rows.swap(column, pivot);
        right.swap(column, pivot);
        for row in column + 1..n {
            let factor = rows[row][column] / rows[column][column];
            for k in column..n {
                rows[row][k] -= factor * rows[column][k];
            }
            right[row] -= factor * right[column];
        }
    }
    for column in (0..n).rev() {
        let known: f64 = (column + 1..n).map(|k| rows[column][k] * right[k]).sum();
        right[column] = (right[column] - known) / rows[column][column];
    }
    right
}

/// Source at a terminal during a piece.
#[derive(Clone, Copy)]
enum TerminalSource {
    Volts(f64),
    Amperes(f64),
}

/// Circuit with all unknowns at an instant: each electrode's current, each active terminal's
/// voltage, and the potential of the return terminal.
struct Dense<'a> {
    tissue: &'a [Vec<f64>],
    skins: &'a [Skin],
    parallel_ohm: Vec<f64>,
    imposed: Vec<TerminalSource>,
}

impl Dense<'_> {
    /// Returns the currents into the tissue when the capacitors have `volts`.
    fn currents(&self, volts: &[f64]) -> Vec<f64> {
        let n = self.skins.len();
        let unknowns = 2 * n;
        let (mut rows, mut right) = (Vec::new(), Vec::new());
        // terminal i = skin i + series i · I_i + Σ tissue · I, all relative to a far point.
        for i in 0..n {
            let mut row = vec![0.0; unknowns];
            for j in 0..n {
                row[j] = -self.tissue[i][j];
            }
            row[i] -= self.skins[i].series_ohm;
            row[n + i] = 1.0;
            rows.push(row);
            right.push(volts[i]);
        }
        for (i, imposed) in self.imposed.iter().enumerate() {
            let mut row = vec![0.0; unknowns];
            match imposed {
                TerminalSource::Volts(v) => {
                    (row[n + i], row[2 * n - 1]) = (1.0, -1.0);
                    right.push(*v);
                }
                TerminalSource::Amperes(a) => {
                    row[i] = 1.0;
                    right.push(*a);
                }
            }
            rows.push(row);
        }
        let mut row = vec![0.0; unknowns];
        row[..n].fill(1.0);
        rows.push(row);
        right.push(0.0);
        solve(rows, right)[..n].to_vec()
    }

    /// Returns C · dv/dt as a matrix with the constant in its last column, determined by probing.
    fn matrix(&self) -> Vec<Vec<f64>> {
        let n = self.skins.len();
        let slopes = |volts: &[f64]| -> Vec<f64> {
            let currents = self.currents(volts);
            let rate =
                |i: usize| (currents[i] - volts[i] / self.parallel_ohm[i]) / self.skins[i].farad;
            (0..n).map(rate).collect()
        };
        let still = slopes(&vec![0.0; n]);
        let mut matrix = vec![vec![0.0; n + 1]; n + 1];
        for j in 0..n {
            let mut volts = vec![0.0; n];
            volts[j] = 1.0;
            for (i, slope) in slopes(&volts).into_iter().enumerate() {
                matrix[i][j] = slope - still[i];
            }
        }
        for i in 0..n {
            matrix[i][n] = still[i];
        }
        matrix
    }

    /// Returns the voltages over the capacitors `t_s` later.
    fn after(&self, volts: &[f64], t_s: f64) -> Vec<f64> {
        let matrix = self.matrix();
        let scaled: Vec<Vec<f64>> = matrix
            .iter()
            .map(|row| row.iter().map(|row| row * t_s).collect())
            .collect();
        let exponential = exponential(scaled);
        let n = volts.len();
        let component = |i: usize| {
            let driven: f64 = (0..n).map(|j| exponential[i][j] * volts[j]).sum();
            driven + exponential[i][n]
        };
        (0..n).map(component).collect()
    }
}

fn product(a: &[Vec<f64>], b: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let n = a.len();
    let element = |i: usize, j: usize| (0..n).map(|k| a[i][k] * b[k][j]).sum();
    (0..n)
        .map(|i| (0..n).map(|j| element(i, j)).collect())
        .collect()
}

/// Computes the matrix exponential by Taylor's series, with scaling and squaring.
fn exponential(matrix: Vec<Vec<f64>>) -> Vec<Vec<f64>> {
    let n = matrix.len();
    let norm = matrix
        .iter()
        .map(|row| row.iter().map(|row| row.abs()).sum::<f64>())
        .fold(0.0, f64::max);
    let squarings = (norm.max(1e-300).log2().ceil() as i32 + 4).max(0);
    let part = 0.5f64.powi(squarings);
    let small: Vec<Vec<f64>> = matrix
        .iter()
        .map(|row| row.iter().map(|row| row * part).collect())
        .collect();
    let identity = |i: usize| (0..n).map(|j| f64::from(u8::from(i == j))).collect();
    let mut sum: Vec<Vec<f64>> = (0..n).map(identity).collect();
    let mut term = sum.clone();
    for k in 1..20 {
        term = product(&term, &small);
        for (row, term_row) in sum.iter_mut().zip(&mut term) {
            for (value, part) in row.iter_mut().zip(term_row) {
                *part /= f64::from(k);
                *value += *part;
            }
        }
    }
    for _ in 0..squarings {
        sum = product(&sum, &sum);
    }
    sum
}

/// Uniform random numbers from a seed.
struct Draws(u64, u64);

impl Draws {
    fn between(&mut self, low: f64, high: f64) -> f64 {
        self.1 += 1;
        low + (high - low) * unit(self.0, self.1)
    }
}

fn network(draws: &mut Draws, limit_a: f64) -> (Network, Vec<Vec<f64>>, Vec<Skin>) {
    let actives = draws.between(2.0, 5.0) as usize;
    let n = actives + 1;
    let mut tissue = vec![vec![0.0; n]; n];
    for i in 0..n {
        tissue[i][i] = draws.between(80.0, 500.0);
        for j in 0..i {
            let mutual = draws.between(0.0, 40.0);
            (tissue[i][j], tissue[j][i]) = (mutual, mutual);
        }
    }
    let skin = |draws: &mut Draws| Skin {
        series_ohm: draws.between(50.0, 500.0),
        parallel_ohm: draws.between(300.0, 5_000.0),
        farad: draws.between(20e-9, 400e-9),
        half_a: draws.between(5e-3, 50e-3),
    };
    let skins: Vec<Skin> = (0..n).map(|_| skin(draws)).collect();
    let network = Network::new(&tissue, skins.clone(), limit_a).unwrap();
    (network, tissue, skins)
}

fn terminals(draws: &mut Draws, actives: usize) -> Vec<Terminal> {
    let terminal = |draws: &mut Draws| match draws.between(0.0, 3.0) as u32 {
        0 => Terminal::Driven(draws.between(-45.0, 45.0)),
        1 => Terminal::Grounded,
        _ => Terminal::Floating,
    };
    (0..actives).map(|_| terminal(draws)).collect()
}

/// Returns the source at each terminal of `piece`.
fn imposed(terminals: &[Terminal], piece: &Piece, limit_a: f64) -> Vec<TerminalSource> {
    let source = |(k, terminal): (usize, &Terminal)| match terminal {
        Terminal::Driven(v) if piece.is_limited[k] => {
            // The limited current keeps its sign.
            TerminalSource::Amperes(limit_a * piece.current_a(k, 0.0).signum() * v.abs().signum())
        }
        Terminal::Driven(v) => TerminalSource::Volts(*v),
        Terminal::Grounded if piece.is_limited[k] => {
            TerminalSource::Amperes(limit_a * piece.current_a(k, 0.0).signum())
        }
        Terminal::Grounded => TerminalSource::Volts(0.0),
        Terminal::Floating => TerminalSource::Amperes(0.0),
    };
    terminals.iter().enumerate().map(source).collect()
}

/// Tests 300 networks with 8 segments each: every piece, with its resistances, times and limits.
#[test]
fn every_piece_is_what_a_general_circuit_gives() {
    let (mut worst, mut limited, mut pieces_seen) = (0.0f64, 0, 0);
    for seed in 0..300 {
        let limit_a = 0.020;
        let mut draws = Draws(seed, 0);
        let (network, tissue, skins) = network(&mut draws, limit_a);
        let (mut charge, mut volts) = (Charge::default(), vec![0.0; skins.len()]);
        for _ in 0..8 {
            let terminals = terminals(&mut draws, network.actives());
            let lasts_s = 10f64.powf(draws.between(-5.0, -2.0));
            let pieces = network.segment(&mut charge, &terminals, lasts_s).unwrap();
            let total_s: f64 = pieces.iter().map(|piece| piece.duration_s).sum();
            assert!((total_s - lasts_s).abs() < 1e-12);
            for piece in &pieces {
                let n = skins.len();
                let dense = Dense {
                    tissue: &tissue,
                    skins: &skins,
                    parallel_ohm: piece.parallel_ohm[..n].to_vec(),
                    imposed: imposed(&terminals, piece, limit_a),
                };
                pieces_seen += 1;
                limited += usize::from(piece.is_limited.iter().any(|flag| *flag));
                for part in [0.0, 0.1, 0.5, 1.0] {
                    let t_s = part * piece.duration_s;
                    let wanted = dense.currents(&dense.after(&volts, t_s));
                    let largest = wanted.iter().fold(1e-3, |a: f64, b| a.max(b.abs()));
                    for (electrode, wanted) in wanted.iter().enumerate() {
                        let off = (piece.current_a(electrode, t_s) - wanted).abs() / largest;
                        worst = worst.max(off);
                        assert!(off < 1e-9, "seed {seed}, electrode {electrode}: {off}");
                    }
                    keeps_limits(&network, &terminals, piece, t_s, limit_a);
                }
                volts = dense.after(&volts, piece.duration_s);
            }
        }
    }
    println!("{pieces_seen} pieces, {limited} with a limiter, worst {worst:.1e} of the largest");
    assert!(limited > 200, "{limited}");
}

/// Checks that no stage exceeds its limit, and that no stage limits the current although it could
/// reach its voltage.
fn keeps_limits(network: &Network, terminals: &[Terminal], piece: &Piece, t_s: f64, limit_a: f64) {
    for (k, terminal) in terminals.iter().enumerate() {
        let Terminal::Driven(set) = terminal else {
            continue;
        };
        let current = piece.current_a(k, t_s);
        assert!(current.abs() <= limit_a * (1.0 + 1e-9), "{current} A");
        let stands = network.terminal_v(piece, k, t_s);
        if piece.is_limited[k] {
            // The limited stage acts towards the set voltage and has not passed it.
            assert!(
                current * (set - stands) >= -1e-9,
                "{stands} V of {set}, {current} A"
            );
        } else {
            assert!((stands - set).abs() < 1e-8, "{stands} V of {set}");
        }
    }
}

/// R_p of a segment matches the segment's own currents within the tolerance; the change when a
/// segment is halved is the error of holding R_p constant.
#[test]
fn halving_a_pulse_tells_what_freezing_costs() {
    let mut worst = 0.0f64;
    for seed in 0..100 {
        let mut draws = Draws(seed, 1_000);
        let (network, _, _) = network(&mut draws, 0.020);
        let mut terminals = vec![Terminal::Grounded; network.actives()];
        terminals[0] = Terminal::Driven(-draws.between(10.0, 40.0));
        let passed = |parts: u32| {
            let mut charge = Charge::default();
            let mut sum = 0.0;
            for _ in 0..parts {
                let lasts_s = 200e-6 / f64::from(parts);
                let pieces = network.segment(&mut charge, &terminals, lasts_s).unwrap();
                sum += pieces.iter().map(|piece| piece.charge_c(0)).sum::<f64>();
            }
            sum
        };
        worst = worst.max((passed(2) / passed(1) - 1.0).abs());
    }
    println!(
        "halving a pulse of 200 us changes its charge by {:.2} % at most",
        100.0 * worst
    );
    assert!(worst < 0.05, "{worst}");
}

#[test]
fn what_no_network_can_have_is_refused_by_name() {
    let skin = Skin {
        series_ohm: 250.0,
        parallel_ohm: 2_000.0,
        farad: 100e-9,
        half_a: f64::INFINITY,
    };
    let refused = |tissue: &[Vec<f64>], skins: Vec<Skin>, limit_a: f64| {
        Network::new(tissue, skins, limit_a)
            .unwrap_err()
            .to_string()
    };
    let two = vec![vec![300.0, 10.0], vec![10.0, 90.0]];
    let equal_skins = vec![skin; 2];
    assert!(
        refused(
            &[vec![300.0, 10.0], vec![11.0, 90.0]],
            equal_skins.clone(),
            0.02
        )
        .contains("symmetric")
    );
    assert!(
        refused(&[vec![1.0, 9.0], vec![9.0, 1.0]], equal_skins.clone(), 0.02).contains("positive")
    );
    assert!(refused(&two[..1], equal_skins.clone(), 0.02).contains("rows"));
    assert!(refused(&two, vec![skin], 0.02).contains("1 electrodes"));
    assert!(refused(&two, equal_skins.clone(), 0.0).contains("limit_a"));
    let wrong = Skin {
        series_ohm: 0.0,
        ..skin
    };
    assert!(refused(&two, vec![skin, wrong], 0.02).contains("electrode 1: `series_ohm`"));
    let network = Network::new(&two, equal_skins, 0.02).unwrap();
    let mut charge = Charge::default();
    let mut refusal = |terminals: &[Terminal], lasts_s| {
        let refused = network
            .segment(&mut charge, terminals, lasts_s)
            .unwrap_err();
        refused.to_string()
    };
    assert!(refusal(&[], 1e-3).contains("0 terminals for 1"));
    assert!(refusal(&[Terminal::Driven(f64::NAN)], 1e-3).contains("terminal 0"));
    assert!(refusal(&[Terminal::Grounded], -1.0).contains("duration_s"));
}
