//! Steady response of a hand to a repeated period of stimulation: torques and angles of its digits.

use super::detail::Pools;
use super::digits::{INDEX, REST_DEG, Torques, individuation, normalised};
use super::field::{Field, InvalidTissue, Pad};
use super::force::Forces;
use super::forearm::{Forearm, Memory, Spike};
use super::network::{InvalidNetwork, InvalidSegment, Terminal};
use super::pools::{DIGITS, Pool};
use super::spec::{ELECTRODES, HandSpec, RETURN};
use std::sync::Arc;

/// Number of periods in which spikes and skin settle before any period is evaluated.
const SETTLES: usize = 2;
/// Number of periods that are evaluated after settling. There are two because refractory nerves may
/// respond to every other period.
const COUNTS: u32 = 2;
/// Voltage of the pulse with which the load of an electrode is measured, V, and time of the
/// measurement within the pulse, s: mid-phase of the papers' pulses (Hamana 2022, II-D).
const TOLD_AT: (f64, f64) = (24.0, 100e-6);
/// Duration of a period, µs.
const PERIOD_US: u32 = 20_000;
/// Duration of all evaluated periods together, µs.
const SPAN_US: u32 = COUNTS * PERIOD_US;

/// An interval during which the terminals do not change.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Segment {
    /// Terminals of the points A, B and E.
    pub terminals: [Terminal; RETURN],
    /// Duration of the interval, µs.
    pub lasts_us: u32,
}

/// The reason why a hand is invalid.
#[derive(Debug, Clone, thiserror::Error)]
pub enum InvalidHand {
    /// A property of the tissue lies outside its range.
    #[error(transparent)]
    Tissue(#[from] InvalidTissue),
    /// The circuit of skin, tissue and electrodes is invalid.
    #[error(transparent)]
    Network(#[from] InvalidNetwork),
    /// The circuit cannot be solved.
    #[error(transparent)]
    Segment(#[from] InvalidSegment),
}

/// A hand with electrodes on its forearm.
#[derive(Debug, Clone)]
pub struct Hand {
    spec: HandSpec,
    field: Arc<Field>,
    pads: [Pad; ELECTRODES],
    forearm: Forearm,
    forces: Forces,
    /// Factor on every threshold, which determines the voltage at which this wearer responds.
    pub factor: f64,
}

/// Isometric response of a hand to a repeated period.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Response {
    /// Isometric torques of the muscles, averaged over the repeated periods.
    pub torques: Torques,
    /// Force of the wrist's extensors, relative to that with every unit at 50 Hz.
    pub wrist: f64,
    stiffness_nm_per_rad: f64,
}

impl Response {
    /// Returns the angles at which free digits come to rest, °.
    #[must_use]
    pub fn angles_deg(&self) -> [f64; DIGITS] {
        self.torques.angles_deg(self.stiffness_nm_per_rad)
    }

    /// Returns the net torque of an index finger that is held, N·m, flexion positive.
    #[must_use]
    pub const fn index_nm(&self) -> f64 {
        self.torques.flexors_nm[INDEX] - self.torques.extensor_nm
    }

    /// Returns the individuation index of the index finger; see [`individuation`].
    #[must_use]
    pub fn individuation(&self) -> Option<f64> {
        individuation(&normalised(&self.angles_deg()))
    }

    /// Returns the same contraction, `by` times as strong.
    #[must_use]
    pub fn scaled(self, by: f64) -> Self {
        let torques = Torques {
            flexors_nm: self.torques.flexors_nm.map(|torque| by * torque),
            extensor_nm: by * self.torques.extensor_nm,
        };
        Self {
            torques,
            wrist: by * self.wrist,
            ..self
        }
    }
}

impl Hand {
    /// Creates a hand with electrodes A, B and E at `points` and the return where `spec` places it.
    ///
    /// # Errors
    /// Returns the reason why the hand is invalid.
    pub fn new(spec: HandSpec, points: [Pad; RETURN]) -> Result<Self, InvalidHand> {
        Self::with_pools(spec, points, Pools::All, [0.0; 2])
    }

    /// Creates a hand with the motor units of these pools only, and with the skin displaced by
    /// `shift_m` from rest, along and around.
    ///
    /// # Errors
    /// Returns the reason why the hand is invalid.
    pub(super) fn with_pools(
        spec: HandSpec,
        points: [Pad; RETURN],
        pools: Pools,
        shift_m: [f64; 2],
    ) -> Result<Self, InvalidHand> {
        let field = Arc::new(Field::coarse(spec.tissue)?);
        let [a, b, e] = points;
        let pads = [a, b, e, spec.return_pad()];
        let mut units = spec.motor_units();
        units.retain(|unit| pools.contains(unit.pool));
        let forearm = Forearm::new(&spec, &pads, units, &field, shift_m)?;
        Ok(Self::from_forearm(
            spec,
            pads,
            forearm,
            (field, Forces::new(SPAN_US)),
        ))
    }

    /// Creates a hand from a forearm whose field is already solved, with the cache `forces`.
    pub(super) fn from_forearm(
        spec: HandSpec,
        pads: [Pad; ELECTRODES],
        forearm: Forearm,
        (field, forces): (Arc<Field>, Forces),
    ) -> Self {
        Self {
            field,
            pads,
            forearm,
            forces,
            factor: 1.0,
            spec,
        }
    }

    /// Returns a cache that knows the force of one spike in each period.
    pub(super) fn warm_forces() -> Forces {
        let mut forces = Forces::new(SPAN_US);
        forces.mean_force(&[0, PERIOD_US]);
        forces
    }

    /// Returns the specification from which the hand was created.
    #[must_use]
    pub const fn spec(&self) -> &HandSpec {
        &self.spec
    }

    /// Returns the model of electrodes, circuit and nerves.
    pub(super) const fn forearm(&self) -> &Forearm {
        &self.forearm
    }

    /// Returns the positions and outlines of the electrodes.
    #[must_use]
    pub const fn pads(&self) -> &[Pad; ELECTRODES] {
        &self.pads
    }

    /// Sets the coupling of point `electrode` of A, B and E from now on ([`HandSpec::coupling`]),
    /// above 0. Other indices are ignored.
    pub fn set_coupling(&mut self, electrode: usize, coupling: f64) {
        if let Some(slot) = self.spec.coupling.get_mut(electrode) {
            self.forearm.scale_coupling(electrode, coupling / *slot);
            *slot = coupling;
        }
    }

    /// Estimates the factor on all thresholds at which one pulse of `pulse` in each period just bends
    /// the index finger by `bent_deg`: the factor at which enough of its flexors are recruited, if
    /// nothing extends it. `None` if all of them do not suffice.
    ///
    /// # Errors
    /// Fails if the circuit cannot be solved.
    pub fn estimated_factor(
        &self,
        pulse: &Segment,
        bent_deg: f64,
    ) -> Result<Option<f64>, InvalidSegment> {
        let lasts_s = f64::from(pulse.lasts_us) * 1e-6;
        let peaks = self.forearm.peaks(&pulse.terminals, lasts_s)?;
        let units = self.forearm.units().iter().zip(peaks);
        let own = units.filter(|(unit, _)| unit.pool.flexed_digit() == Some(INDEX));
        let mut peaks: Vec<f64> = own.map(|(_, peak)| peak).collect();
        peaks.sort_unstable_by(|a, b| b.total_cmp(a));
        let of_one = self.spec.flexor_nm / peaks.len() as f64;
        let bends = |count: usize| {
            let mut torques = Torques::default();
            torques.flexors_nm[INDEX] = of_one * count as f64;
            torques.angles_deg(self.spec.stiffness_nm_per_rad)[INDEX] - REST_DEG[INDEX] >= bent_deg
        };
        let needed = (1..=peaks.len()).find(|count| bends(*count));
        Ok(needed
            .map(|count| peaks[count - 1])
            .filter(|peak| *peak > 0.0))
    }

    /// Returns the load that a point presents to its output stage, Ω, as a device measures it.
    ///
    /// # Errors
    /// Fails if the circuit cannot be solved.
    pub fn load_ohm(&self, point: usize) -> Result<f64, InvalidSegment> {
        self.forearm.measured_load_ohm(point, TOLD_AT)
    }

    /// Returns the load of a point at `at_s` seconds into a pulse of `volts`, Ω, as [`Self::load_ohm`]
    /// does at the device's own voltage and time.
    ///
    /// # Errors
    /// Fails if the circuit cannot be solved.
    pub fn load_at_ohm(
        &self,
        point: usize,
        (volts, at_s): (f64, f64),
    ) -> Result<f64, InvalidSegment> {
        self.forearm.measured_load_ohm(point, (volts, at_s))
    }

    /// Moves the skin over the muscles, relative to its position at rest: around the forearm by the
    /// shift that a pronation of `pronated_deg` causes, and additionally by `along_m` and
    /// `around_m`.
    pub fn shift(&mut self, pronated_deg: f64, [along_m, around_m]: [f64; 2]) {
        let around_m = around_m + pronated_deg * self.spec.shift_m_per_deg;
        let shift_m = [along_m, around_m];
        self.forearm
            .shift(&self.spec, &self.pads, &self.field, shift_m);
    }

    /// Returns the steady response to `period`, which is repeated until it has settled.
    ///
    /// # Errors
    /// Fails as [`Forearm::segment`].
    pub fn respond(&mut self, period: &[Segment]) -> Result<Response, InvalidSegment> {
        let spikes = self.settled_spikes(period)?;
        Ok(self.muscle_response(&spikes))
    }

    /// Returns the response of [`Self::respond`] from all periods, even if nothing is left of one
    /// for the next.
    #[cfg(test)]
    pub(super) fn respond_in_full(
        &mut self,
        period: &[Segment],
    ) -> Result<Response, InvalidSegment> {
        let spikes = self.all_spikes(period)?;
        Ok(self.muscle_response(&spikes))
    }

    /// Returns the response that two periods would have without interaction: every unit has the
    /// spikes of both periods, those of `second` moved by `after_us`. The difference from the
    /// response to both stimuli together is the effect of the state that circuit and nerves keep
    /// from one pulse to the next.
    ///
    /// # Errors
    /// Fails as [`Self::respond`].
    pub fn superposed(
        &mut self,
        first: &[Segment],
        (second, after_us): (&[Segment], u32),
    ) -> Result<Response, InvalidSegment> {
        let mut spikes = self.settled_spikes(first)?;
        for (earlier, later) in spikes.iter_mut().zip(self.settled_spikes(second)?) {
            earlier.extend(later.iter().map(|at| (at + after_us) % SPAN_US));
            earlier.sort_unstable();
        }
        Ok(self.muscle_response(&spikes))
    }

    /// Returns the spike times of each unit in the evaluated periods, µs.
    fn settled_spikes(&self, period: &[Segment]) -> Result<Vec<Vec<u32>>, InvalidSegment> {
        let mut memory = self.forearm.resting_memory();
        let first = self.simulate_period(&mut memory, period)?;
        if self.forearm.is_resting(&memory, self.factor) {
            // Nothing is left for the next period, so that all periods are alike.
            return Ok(self.spike_times(&vec![first; COUNTS as usize]));
        }
        self.all_spikes(period)
    }

    /// Returns the spike times as [`Self::settled_spikes`] does, from all periods.
    fn all_spikes(&self, period: &[Segment]) -> Result<Vec<Vec<u32>>, InvalidSegment> {
        let mut memory = self.forearm.resting_memory();
        for _ in 0..SETTLES {
            self.simulate_period(&mut memory, period)?;
        }
        let periods = (0..COUNTS).map(|_| self.simulate_period(&mut memory, period));
        Ok(self.spike_times(&periods.collect::<Result<Vec<_>, _>>()?))
    }

    /// Returns the spike times of each unit in consecutive periods, µs.
    fn spike_times(&self, periods: &[Vec<Spike>]) -> Vec<Vec<u32>> {
        let mut spikes = vec![Vec::new(); self.forearm.units().len()];
        for (count, period) in (0..).zip(periods) {
            for spike in period {
                let at_us = (spike.at_s * 1e6) as u32;
                spikes[spike.unit].push(count * PERIOD_US + at_us);
            }
        }
        spikes
    }

    /// Simulates one period and returns its spikes, with times from the start of the period.
    fn simulate_period(
        &self,
        memory: &mut Memory,
        period: &[Segment],
    ) -> Result<Vec<Spike>, InvalidSegment> {
        let (mut spikes, mut begun_us) = (Vec::new(), 0);
        for segment in period {
            let before = spikes.len();
            let lasts_s = f64::from(segment.lasts_us) * 1e-6;
            self.forearm.segment(
                memory,
                &segment.terminals,
                lasts_s,
                self.factor,
                &mut spikes,
            )?;
            let begun_s = f64::from(begun_us) * 1e-6;
            spikes[before..]
                .iter_mut()
                .for_each(|spike| spike.at_s += begun_s);
            begun_us += segment.lasts_us;
        }
        Ok(spikes)
    }

    /// Returns the response of the muscles to units that spike at these times, µs.
    fn muscle_response(&mut self, spikes: &[Vec<u32>]) -> Response {
        let (mut torques, mut wrist) = (Torques::default(), 0.0);
        for (unit, at_us) in self.forearm.units().iter().zip(spikes) {
            if let Some((torque, of_one)) = torques.unit_torque_mut(unit.pool, &self.spec) {
                *torque += of_one * self.forces.mean_force(at_us);
            } else {
                wrist += self.forces.mean_force(at_us) / self.spec.units as f64;
            }
        }
        Response {
            torques,
            wrist,
            stiffness_nm_per_rad: self.spec.stiffness_nm_per_rad,
        }
    }
}

impl Torques {
    /// Returns the torque to which a unit of `pool` contributes, and the contribution of one unit,
    /// N·m; `None` for the wrist.
    pub(super) fn unit_torque_mut(
        &mut self,
        pool: Pool,
        spec: &HandSpec,
    ) -> Option<(&mut f64, f64)> {
        let units = spec.units as f64;
        match pool {
            // The two bellies of the index finger share one tendon.
            Pool::Index | Pool::IndexDistal => {
                let torque = &mut self.flexors_nm[INDEX];
                Some((torque, spec.flexor_nm / (2.0 * units)))
            }
            Pool::ExtensorIndicis => Some((&mut self.extensor_nm, spec.extensor_nm / units)),
            Pool::Wrist => None,
            _ => pool
                .flexed_digit()
                .map(|digit| (&mut self.flexors_nm[digit], spec.flexor_nm / units)),
        }
    }
}
