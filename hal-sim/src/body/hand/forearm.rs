//! A forearm under electrodes, which computes the spikes of motor nerves from currents.

use super::field::{Field, Pad, Transfer};
use super::membrane::{Membrane, Nerve};
use super::nerve_samples::{NerveSamples, weights};
use super::network::{Charge, InvalidNetwork, InvalidSegment, Network, Piece, Skin, Terminal};
use super::pools::{POOLS, Pool};
use super::spec::{ELECTRODES, HandSpec, RETURN, ROUND_M, Rule};
use crate::random::{standard_normal, unit};
use std::f64::consts::{PI, TAU};

/// Random stream of a wearer's seed for the mean position of each pool.
const PLACES: u64 = 1;
/// Random stream of a wearer's seed for the position of each unit.
const UNITS: u64 = 2;
/// Random stream of a wearer's seed for the threshold of each unit.
const THRESHOLDS: u64 = 3;
/// Random stream of a wearer's seed for the direction of each unit's nerve.
const DIRECTIONS: u64 = 4;

/// Largest voltage across the skin that counts as no charge, V.
const RESTING_V: f64 = 1e-6;
/// Largest charge of a nerve that counts as none, as a fraction of its threshold.
const RESTING_PART: f64 = 1e-9;

/// Motor unit: its pool, and the position, direction and threshold of its nerve.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Unit {
    /// Muscle or part of a muscle to which the unit belongs.
    pub pool: Pool,
    /// Position: along from the elbow, around from the palmar midline, below the skin, m.
    pub at_m: [f64; 3],
    /// Charge that excites the resting nerve, before multiplication by the wearer's own factor. It
    /// has the unit of the quantity that [`Rule`] selects.
    pub threshold: f64,
    /// Direction of the nerve as a unit vector.
    pub direction: [f64; 3],
}

impl HandSpec {
    /// Generates all motor units of this wearer from its seed.
    #[must_use]
    pub fn motor_units(&self) -> Vec<Unit> {
        let stream = |which: u64| self.seed.wrapping_mul(8).wrapping_add(which);
        let mut units = Vec::with_capacity(POOLS.len() * self.units);
        for (index, pool) in (0u64..).zip(POOLS) {
            let mut place = pool.place().randomized(stream(PLACES), index);
            place.spread = place.spread.map(|value| self.scatter * value);
            for number in 0..self.units as u64 {
                let number = index * 4_096 + number;
                let [x, y, below_fat] =
                    place.unit(stream(UNITS), number, self.forearm_m, self.around_m);
                let spread = self.scatter * self.threshold_spread;
                let spread = spread * standard_normal(stream(THRESHOLDS), number);
                // Uniform over the sphere.
                let along = 2.0 * unit(stream(DIRECTIONS), 2 * number) - 1.0;
                let turn = TAU * unit(stream(DIRECTIONS), 2 * number + 1);
                let across = (1.0 - along * along).sqrt();
                units.push(Unit {
                    pool,
                    at_m: [x, y, self.tissue.fat_m + below_fat],
                    threshold: libm::exp(spread),
                    direction: [along, across * libm::cos(turn), across * libm::sin(turn)],
                });
            }
        }
        units
    }

    fn skin(&self, pad: &Pad, electrode: usize) -> Skin {
        let cm2 = 1e4 * pad.area_m2();
        let round_cm2 = 1e4 * PI * (0.5 * ROUND_M).powi(2);
        let factor = match electrode {
            RETURN => self.return_factor,
            _ => 1.0,
        };
        Skin {
            series_ohm: factor * self.skin.series_ohm * round_cm2 / cm2,
            parallel_ohm: factor * self.skin.ohm_cm2 / cm2,
            farad: self.skin.farad_per_cm2 * cm2 / factor,
            half_a: self.skin.half_a_per_cm2 * cm2,
        }
    }
}

impl Rule {
    /// Returns how strongly a field excites the nerve of `unit`, per ampere: the quantity that the
    /// rule selects, positive where it depolarises the nerve.
    #[must_use]
    pub fn nerve_drive(self, transfer: &Transfer, unit: &Unit) -> f64 {
        match self {
            // A negative potential outside the nerve depolarises it.
            Self::Potential => -transfer.potential,
            Self::Curvature => transfer.curvature,
            Self::Field => {
                let [dy, dz] = transfer.across;
                let [x, y, z] = unit.direction;
                -(transfer.gradient * x + dy * y + dz * z)
            }
        }
    }
}

/// Simulated forearm with electrodes. It computes the spikes of motor units from the states of the
/// terminals.
#[derive(Debug, Clone)]
pub struct Forearm {
    network: Network,
    membrane: Membrane,
    sums: bool,
    units: Vec<Unit>,
    /// Drive of each unit per ampere through each electrode.
    drives: Vec<[f64; ELECTRODES]>,
}

/// State that a forearm keeps from one segment to the next: the charge of the skin and the state of
/// every nerve.
#[derive(Debug, Clone)]
pub struct Memory {
    charge: Charge,
    nerves: Vec<Nerve>,
}

/// A spike of a motor unit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spike {
    /// Index of the unit in [`Forearm::units`].
    pub unit: usize,
    /// Time of the spike after the start of the segment, s.
    pub at_s: f64,
}

impl Forearm {
    /// Creates a forearm with `pads` in the order of [`super::spec`] and the skin displaced by
    /// `shift_m` from rest, along and around. `field` solves for the potential below the pads.
    ///
    /// # Errors
    /// Fails as [`Network::new`].
    pub fn new(
        spec: &HandSpec,
        pads: &[Pad; ELECTRODES],
        units: Vec<Unit>,
        field: &Field,
        shift_m: [f64; 2],
    ) -> Result<Self, InvalidNetwork> {
        let resistance_ohm = pads.each_ref().map(|a| {
            let row = pads.iter().map(|b| field.resistance(a, b));
            row.collect::<Vec<_>>()
        });
        let of_return = |unit: &Unit| {
            let mut drives = [0.0; ELECTRODES];
            drives[RETURN] = spec
                .rule
                .nerve_drive(&field.transfer(&pads[RETURN], unit.at_m), unit);
            drives
        };
        let drives = units.iter().map(of_return).collect();
        let mut forearm = Self::with_drives(spec, pads, &resistance_ohm, (units, drives))?;
        forearm.shift(spec, pads, field, shift_m);
        Ok(forearm)
    }

    /// Creates a forearm from known resistances of the tissue between `pads`, Ω, and from known
    /// drives of each unit per ampere through each electrode.
    ///
    /// # Errors
    /// Fails as [`Network::new`].
    pub(super) fn with_drives(
        spec: &HandSpec,
        pads: &[Pad; ELECTRODES],
        resistance_ohm: &[Vec<f64>],
        (units, drives): (Vec<Unit>, Vec<[f64; ELECTRODES]>),
    ) -> Result<Self, InvalidNetwork> {
        let skins = pads.iter().enumerate();
        let skins = skins.map(|(index, pad)| spec.skin(pad, index));
        Ok(Self {
            network: Network::new(resistance_ohm, skins.collect(), spec.limiter_a)?,
            membrane: spec.membrane,
            sums: spec.sums,
            units,
            drives,
        })
    }

    /// Moves the skin over the muscles to `shift_m`, along and around from its position at rest.
    /// The field of the return stays that of the position at rest, because the return is large and
    /// far away.
    pub fn shift(
        &mut self,
        spec: &HandSpec,
        pads: &[Pad; ELECTRODES],
        field: &Field,
        shift_m: [f64; 2],
    ) {
        for (unit, drives) in self.units.iter().zip(&mut self.drives) {
            let [x, y, z] = unit.at_m;
            let at = [x - shift_m[0], y - shift_m[1], z];
            for ((pad, drive), coupling) in pads.iter().zip(drives).zip(spec.coupling) {
                *drive = coupling * spec.rule.nerve_drive(&field.transfer(pad, at), unit);
            }
        }
    }

    /// Multiplies by `by` the drive that each ampere through `electrode` exerts on all nerves.
    pub(super) fn scale_coupling(&mut self, electrode: usize, by: f64) {
        let drives = self.drives.iter_mut();
        drives
            .filter_map(|row| row.get_mut(electrode))
            .for_each(|value| *value *= by);
    }

    /// Returns the motor units under the electrodes.
    #[must_use]
    pub fn units(&self) -> &[Unit] {
        &self.units
    }

    /// Returns how strongly 1 A out of the forearm through each of A, B and E, which enters through
    /// the return, drives a unit, relative to the unit's threshold.
    pub(super) fn excitability(&self, unit: usize) -> [f64; RETURN] {
        let (drives, threshold) = (&self.drives[unit], self.units[unit].threshold);
        std::array::from_fn(|electrode| (drives[RETURN] - drives[electrode]) / threshold)
    }

    /// Keeps only these motor units, given by ascending index.
    pub(super) fn keep_units(&mut self, kept: &[usize]) {
        self.units = kept.iter().map(|unit| self.units[*unit]).collect();
        self.drives = kept.iter().map(|unit| self.drives[*unit]).collect();
    }

    /// Returns the load that `point` presents to its output stage while the other points float, Ω:
    /// voltage over current at `at_s` seconds into a pulse of `volts`.
    ///
    /// # Errors
    /// Fails as [`Network::segment`].
    pub fn measured_load_ohm(
        &self,
        point: usize,
        (volts, at_s): (f64, f64),
    ) -> Result<f64, InvalidSegment> {
        let mut terminals = [Terminal::Floating; RETURN];
        terminals[point] = Terminal::Driven(-volts);
        let mut charge = Charge::default();
        let pieces = self.network.segment(&mut charge, &terminals, at_s)?;
        let current_a: f64 = pieces
            .last()
            .map_or(0.0, |piece| piece.at(piece.duration_s).0[point]);
        Ok(volts / current_a.abs())
    }

    /// Returns the state at rest, without charge.
    #[must_use]
    pub fn resting_memory(&self) -> Memory {
        Memory {
            charge: Charge::default(),
            nerves: vec![Nerve::REST; self.units.len()],
        }
    }

    /// Returns whether this state leads to the same spikes as [`Self::resting_memory`]: no skin
    /// keeps more than [`RESTING_V`], no nerve more than [`RESTING_PART`] of its threshold, and none
    /// is refractory. `factor` scales the threshold of every unit.
    pub(super) fn is_resting(&self, memory: &Memory, factor: f64) -> bool {
        let mut skins = 0..ELECTRODES;
        let mut nerves = memory.nerves.iter().zip(&self.units);
        skins.all(|electrode| memory.charge.volts(electrode).abs() <= RESTING_V)
            && nerves.all(|(nerve, unit)| {
                nerve.since_s >= self.membrane.relative_s
                    && nerve.charged.abs() <= RESTING_PART * factor * unit.threshold
            })
    }

    /// Advances by `duration_s` during which the terminals do not change, and appends the spikes to
    /// `spikes`. `factor` scales the threshold of every unit.
    ///
    /// # Errors
    /// Fails as [`Network::segment`].
    pub fn segment(
        &self,
        memory: &mut Memory,
        terminals: &[Terminal; RETURN],
        duration_s: f64,
        factor: f64,
        spikes: &mut Vec<Spike>,
    ) -> Result<(), InvalidSegment> {
        let drives = terminals.iter().any(|t| matches!(t, Terminal::Driven(_)));
        if !self.sums && drives {
            memory
                .nerves
                .iter_mut()
                .for_each(|nerve| nerve.charged = 0.0);
        }
        let mut begun_s = 0.0;
        for piece in self
            .network
            .segment(&mut memory.charge, terminals, duration_s)?
        {
            self.charge_nerves(&mut memory.nerves, &piece, begun_s, factor, spikes);
            begun_s += piece.duration_s;
        }
        Ok(())
    }

    /// Returns for each unit its largest charge during a segment that begins at rest, relative to its
    /// threshold. A unit is recruited if the factor on all thresholds is at most that.
    ///
    /// # Errors
    /// Fails as [`Network::segment`].
    pub(super) fn peaks(
        &self,
        terminals: &[Terminal; RETURN],
        duration_s: f64,
    ) -> Result<Vec<f64>, InvalidSegment> {
        let mut memory = self.resting_memory();
        let mut peaks = vec![0.0_f64; self.units.len()];
        for piece in self
            .network
            .segment(&mut memory.charge, terminals, duration_s)?
        {
            let looks = NerveSamples::new(&self.membrane, &piece);
            let nerves = memory.nerves.iter_mut().zip(&self.drives);
            for ((nerve, drives), peak) in nerves.zip(&mut peaks) {
                let weights = weights(&piece, drives);
                let charges = looks.all().iter();
                let charges = charges.map(|sample| sample.charged(nerve.charged, &weights));
                *peak = charges.fold(*peak, f64::max);
                nerve.charged = looks.last(nerve.charged, &weights);
            }
        }
        let relative = peaks.iter().zip(&self.units);
        Ok(relative.map(|(peak, unit)| peak / unit.threshold).collect())
    }

    /// Applies the currents of `piece` to every nerve and appends the spikes that follow.
    fn charge_nerves(
        &self,
        nerves: &mut [Nerve],
        piece: &Piece,
        begun_s: f64,
        factor: f64,
        spikes: &mut Vec<Spike>,
    ) {
        let looks = NerveSamples::new(&self.membrane, piece);
        for (index, nerve) in nerves.iter_mut().enumerate() {
            let threshold = factor * self.units[index].threshold;
            let weights = weights(piece, &self.drives[index]);
            // A leaky integrator exceeds neither its start nor its largest drive, and no term of the
            // drive grows.
            let drive: f64 = weights.iter().map(|weight| weight.max(0.0)).sum();
            let most = nerve.charged.max(drive);
            let spiked = (most >= threshold)
                .then(|| looks.first_crossing(*nerve, &weights, threshold))
                .flatten();
            if let Some(at_s) = spiked {
                spikes.push(Spike {
                    unit: index,
                    at_s: begun_s + at_s,
                });
                // A spike clears the charge, and the rest of a piece is shorter than the refractory
                // time.
                (nerve.charged, nerve.since_s) = (0.0, piece.duration_s - at_s);
            } else {
                nerve.charged = looks.last(nerve.charged, &weights);
                nerve.since_s += piece.duration_s;
            }
        }
    }
}
