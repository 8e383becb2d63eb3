//! Cells of the study: random wearers under one recruitment rule, return impedance and operating
//! point.

use super::claims::{Individuations, Torques, individuations, judge_claims};
use super::couplings;
use super::error::TwoPointsError;
use super::points;
use super::population::{DrawnHand, Population, ablate, rule};
use super::trials::{Postures, Trials};
use super::voltages::{MOST_V, STEP_V, Voltages, calibrate};
use hal_sim::body::hand::field::{Field, Pad, Shape};
use hal_sim::body::hand::spec::{ROUND_M, SMALL_M};
use hal_sim::body::hand::{Hand, HandSpec, InvalidHand};

/// Parameters that all random wearers of a cell share.
#[derive(Clone, Debug, PartialEq)]
pub struct Cell {
    /// Name of the recruitment rule: the property of the field that charges a nerve.
    pub rule: String,
    /// Factor of the return electrode's impedance.
    pub return_factor: f64,
    /// Fraction above threshold at which both points are driven; 0 stands for the searched
    /// voltages.
    pub volts: f64,
    /// Name of the removed mechanism, if any.
    pub without: Option<String>,
    /// Factor of the skin's impedance in a cell in which B's threshold has the same random range as
    /// A's. `None` in all other cells, in which only A's threshold is prescribed.
    pub balanced_skin: Option<f64>,
}

/// Numbers of a random wearer, or the reason why there are none.
#[derive(Clone, PartialEq, Debug)]
pub enum DrawOutcome {
    /// The forearm has no two places at which the index finger is the first digit to bend.
    NoPoints,
    /// No coupling factor in the searched range gives B or the extensor's point its known
    /// threshold.
    NoCoupling,
    /// A searched threshold is below the known one by at least one step, because the output stage's
    /// current limiter already acts at lower voltages.
    Held,
    /// A point moves nothing up to the largest voltage, or it moves other digits together with the
    /// index finger.
    NoVoltages,
    /// The draw has all numbers.
    Whole(Box<Numbers>),
}

/// Numbers of a wearer that decide the claims.
#[derive(Clone, PartialEq, Debug)]
pub struct Numbers {
    /// Searched thresholds and largest voltages.
    pub voltages: Voltages,
    /// Whether the small electrodes are used, because the searches failed with the round ones.
    pub is_small: bool,
    /// Mean torques of the patterns that the claims compare.
    pub torques: Torques,
    /// Mean individuation of the conducted patterns.
    pub individuations: Individuations,
    /// Flexion of the index finger from rest at three pronations, with one point and with two, °.
    pub postures: [Postures; 2],
    /// Number of trials that the paper's rule leaves out.
    pub left_out: u64,
}

impl Numbers {
    /// Judges the claims of the declaration in their order; `None` stands for a claim that cannot
    /// be judged.
    #[must_use]
    pub fn claims(&self) -> [Option<bool>; 8] {
        judge_claims(
            &self.torques,
            &self.individuations,
            &self.voltages,
            &self.postures,
        )
    }
}

/// Shape of the default electrode: a circle.
pub(super) const ROUND: Shape = Shape::Round {
    diameter_m: ROUND_M,
};
/// Shapes in the order in which they are tried. The small rectangle is used if the searches for
/// points and voltages fail with the circle (Hamana 2022, II-B).
pub(super) const SHAPES: [Shape; 2] = [
    ROUND,
    Shape::Rectangle {
        along_m: SMALL_M[0],
        around_m: SMALL_M[1],
    },
];

/// A hand with electrodes, after the searches for points and voltages.
#[derive(Clone, Debug)]
pub struct PreparedHand {
    /// Hand with electrodes and fitted couplings.
    pub hand: Hand,
    /// Voltages that the searches found.
    pub voltages: Voltages,
    /// Whether the small electrodes are used, because the searches failed with the round ones.
    pub is_small: bool,
}

/// Facts about a wearer that are known before electrodes are placed.
#[derive(Clone, Copy, Debug)]
pub struct KnownThresholds {
    /// Threshold of point A, V.
    pub threshold_v: f64,
    /// Threshold of point B, V, if it is known.
    pub b_v: Option<f64>,
    /// Threshold of the extensor's point, V, if it is known.
    pub extensor_v: Option<f64>,
    /// Places of the electrodes of A, B and the extensor, m, if they are known.
    pub pads_m: Option<[[f64; 2]; 3]>,
    /// Largest voltage of the searches, V.
    pub most_v: f64,
    /// Whether A and B are the first selective places that a person finds, instead of the most
    /// selective ones; an ablation sets this.
    pub first_found: bool,
}

/// Places electrodes on the hand of `spec`, fits the known thresholds and searches the voltages:
/// first with the round electrodes, then with the small ones. If both fail, returns the reason for
/// the last shape that could be placed.
///
/// # Errors
/// Fails if the hand is invalid or its circuit cannot be solved.
pub fn prepare(
    spec: &HandSpec,
    known: KnownThresholds,
) -> Result<Result<PreparedHand, DrawOutcome>, TwoPointsError> {
    let field = Field::coarse(spec.tissue).map_err(InvalidHand::from)?;
    let units = spec.motor_units();
    let mut missing = DrawOutcome::NoPoints;
    for (shape, is_small) in SHAPES.into_iter().zip([false, true]) {
        let placed = known
            .pads_m
            .map(|positions| positions.map(|[x_m, y_m]| Pad { x_m, y_m, shape }));
        let search = match known.first_found {
            true => points::first_found,
            false => points::search,
        };
        let Some(pads) = placed.or_else(|| search(spec, &field, &units, shape)) else {
            continue;
        };
        let mut hand = Hand::new(spec.clone(), pads)?;
        calibrate(&mut hand, known.threshold_v)?;
        if !couplings::fit(&mut hand, known.b_v, known.extensor_v)? {
            missing = DrawOutcome::NoCoupling;
            continue;
        }
        let found = Voltages::search(&mut hand, known.most_v)?;
        missing = match found {
            None => DrawOutcome::NoVoltages,
            Some(voltages) if known.contradicts(&voltages) => DrawOutcome::Held,
            Some(voltages) => {
                return Ok(Ok(PreparedHand {
                    hand,
                    voltages,
                    is_small,
                }));
            }
        };
    }
    Ok(Err(missing))
}

impl KnownThresholds {
    /// Returns the known facts of a random wearer: only A's threshold.
    #[must_use]
    pub const fn from_person(person: &DrawnHand) -> Self {
        Self {
            threshold_v: person.threshold_v,
            b_v: None,
            extensor_v: None,
            pads_m: None,
            most_v: MOST_V,
            first_found: false,
        }
    }

    /// Returns whether a searched threshold is below the known one by at least one step of the
    /// search.
    fn contradicts(&self, found: &Voltages) -> bool {
        self.b_v.is_some_and(|b_v| {
            let known = [self.threshold_v, b_v];
            let mut pairs = found.threshold_v.into_iter().zip(known);
            pairs.any(|(found, known)| found <= known - STEP_V)
        })
    }
}

impl Population {
    /// Lists the cells of all combinations of factors, then the ablations of the default cell, then
    /// the cells of [`Self::balanced`].
    #[must_use]
    pub fn cells(&self) -> Vec<Cell> {
        let mut cells = Vec::new();
        for rule in &self.cells.rules {
            for &return_factor in &self.cells.return_factors {
                for &volts in &self.cells.volts {
                    cells.push(Cell {
                        rule: rule.clone(),
                        return_factor,
                        volts,
                        without: None,
                        balanced_skin: None,
                    });
                }
            }
        }
        let default = Cell {
            rule: "curvature".into(),
            return_factor: 1.0,
            volts: 0.0,
            without: None,
            balanced_skin: None,
        };
        cells.extend(self.ablations.names.iter().map(|name| Cell {
            without: Some(name.clone()),
            ..default.clone()
        }));
        for &skin in &self.balanced.skins {
            cells.extend(self.cells.return_factors.iter().map(|&return_factor| Cell {
                return_factor,
                balanced_skin: Some(skin),
                ..default.clone()
            }));
        }
        cells
    }

    /// Generates wearer `index` of `cell`, searches points and voltages, and measures all patterns.
    ///
    /// # Errors
    /// Fails if the declaration or a hand is invalid.
    pub fn draw(&self, cell: &Cell, seed: u64, index: u64) -> Result<DrawOutcome, TwoPointsError> {
        Ok(match self.prepare_wearer(cell, seed, index)? {
            Ok(prepared) => DrawOutcome::Whole(Box::new(self.measure_patterns(cell, prepared)?)),
            Err(missing) => missing,
        })
    }

    /// Prepares wearer `index` of `cell` by its searches, or returns the outcome that ended them.
    ///
    /// # Errors
    /// Fails if the declaration or a hand is invalid.
    pub fn prepare_wearer(
        &self,
        cell: &Cell,
        seed: u64,
        index: u64,
    ) -> Result<Result<PreparedHand, DrawOutcome>, TwoPointsError> {
        let person = self.draw_person(seed, index)?;
        let mut known = KnownThresholds::from_person(&person);
        let mut spec = HandSpec {
            rule: rule(&cell.rule)?,
            return_factor: cell.return_factor,
            ..person.spec
        };
        if let Some(name) = &cell.without {
            spec = ablate(spec, name)?;
        }
        if let Some(skin) = cell.balanced_skin {
            let [_, b_v, _] = self.thresholds_v(seed, index)?;
            known.b_v = Some(b_v);
            spec.skin = spec.skin.times(skin);
        }
        prepare(&spec, known)
    }

    /// Measures a prepared wearer of `cell`: all trials of all 29 patterns, and the postures.
    ///
    /// # Errors
    /// Fails if the hand's circuit cannot be solved.
    pub fn measure_patterns(
        &self,
        cell: &Cell,
        prepared: PreparedHand,
    ) -> Result<Numbers, TwoPointsError> {
        let PreparedHand {
            mut hand,
            voltages,
            is_small,
        } = prepared;
        let volts = match cell.volts {
            0.0 => voltages.most_v,
            part => voltages.threshold_v.map(|v| (1.0 + part) * v),
        };
        let trials = Trials {
            count: self.trials,
            jitter_m: 1e-3 * self.jitter_mm,
            force_noise: self.force_noise,
            seed: hand.spec().seed,
        };
        let outcomes = trials.patterns(&mut hand, volts)?;
        Ok(Numbers {
            voltages,
            is_small,
            torques: Torques::from_outcomes(&outcomes),
            individuations: individuations(&outcomes),
            postures: trials.postures(&mut hand, volts)?,
            left_out: outcomes.iter().map(|outcome| outcome.left_out).sum(),
        })
    }
}
