//! Control of the force at the hand: computes the amplitudes of an arm's muscles from timed forces
//! and nine angles, with the nearest-neighbour method of `limb`, at a period of its own.

use super::sensor::{MeasurementError, Sensor, SensorFault, SensorSource, SensorState};
use super::setpoint::{HoldPolicy, SetpointError, SetpointTrack};
use crate::limb::{
    AXES, AXIS_NAMES, JOINTS, Jacobians, LINES, Limb, LimbError, LimbSpec, Lines, Number, Posture,
    ReachError, Wrench,
};
use crate::range::{OutOfRange, Range};
use crate::units::{Amplitude, Angle, Force, ForceRate, Micros, us};
use fixed::types::I16F16;
use heapless::Vec;
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

/// A wearer's arm as the host sends it, not yet validated. The lines of action of its muscles
/// follow in messages of their own.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize, Schema)]
pub struct EndpointSpec {
    /// Segment vectors of the arm, µm, as in [`LimbSpec::offsets_um`].
    pub offsets_um: [[i32; 3]; JOINTS + 1],
    /// Lowest and highest angle of each axis, m°, as in [`LimbSpec::ranges_mdeg`].
    pub ranges_mdeg: [(i32, i32); AXES],
    /// Time between two computations of the amplitudes, ms; 5…50. The paper's loop uses 5.
    pub recruit_ms: u8,
    /// Source of the arm's nine angles: fixed in the setup, or measured by the host.
    pub posture: PostureSpec,
}

/// Source of the nine angles of an arm's posture.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize, Schema)]
pub enum PostureSpec {
    /// Constant angles, 0.01°, each within its range.
    Fixed([i16; AXES]),
    /// Angles that the host measures.
    Measured {
        /// Age at which the latest measurement of any angle is stale, ms; 2…500.
        stale_after_ms: u16,
    },
}

/// A validated arm with the lines of action of its muscles. Everything that changes is in an
/// [`EndpointState`].
#[derive(Clone, Debug)]
pub struct Endpoint {
    limb: Limb,
    lines: Vec<u8, LINES>,
    period_us: u32,
    posture: Source,
}

#[derive(Clone, Debug)]
enum Source {
    Fixed(Posture),
    Measured([Sensor; AXES]),
}

/// State of an arm's control. Every stimulation must begin with a fresh state.
#[derive(Clone, Debug, Default)]
pub struct EndpointState {
    /// Setpoints of the three components of the force.
    tracks: [SetpointTrack<Force>; 3],
    sensors: [SensorState; AXES],
    jacobians: Jacobians<f32>,
    /// Time of the posture for which the Jacobians were computed.
    posed: Option<Micros>,
    /// Start of the period in which the amplitudes were computed last.
    latest: Option<Micros>,
}

/// Output of the control of an arm's force, valid from this tick on.
#[derive(Clone, PartialEq, Debug)]
pub struct EndpointOrders {
    /// Reference force at the hand now, mN.
    pub reference_mn: [i32; 3],
    /// Channel and amplitude of every line. All amplitudes are zero unless the whole reference
    /// force can be produced.
    pub amplitudes: Vec<(u8, Amplitude), LINES>,
    /// Share of the reference force that the muscles can produce, thousandths. Below 1000 the
    /// muscles do not produce it at all.
    pub achievable_permille: u16,
}

/// Reason why a setpoint of the force at the hand was refused.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum WrenchError {
    /// The track of setpoints refuses the setpoint, mostly because of its time.
    Setpoint(SetpointError),
    /// The muscles cannot produce the force.
    Unmade(ForceImpossible),
}

/// Reason why a force cannot be produced.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum ForceImpossible {
    /// An angle has no measurement, or the measurement is stale or implausible.
    NoPosture {
        /// Number of the axis, 0–8.
        axis: u8,
    },
    /// An angle is outside the wearer's range.
    Posture(OutOfRange),
    /// No line can contribute to the force at any joint.
    NoMuscleHelps,
    /// The requested force needs a higher amplitude of some muscle than the wearer's limit.
    TooStrong {
        /// Channel of the line that would exceed its limit by most.
        channel: u8,
        /// Share of the force that can be produced, thousandths, rounded down.
        permille: u16,
    },
}

impl EndpointSpec {
    /// Range of [`Self::recruit_ms`].
    pub const RECRUIT_MS: Range = Range::new("recruit_ms", 5, 50);

    /// Returns the unvalidated limb with these lines, for [`Limb::new`] to validate.
    #[must_use]
    pub fn limb(&self, lines: &Lines) -> LimbSpec {
        LimbSpec {
            offsets_um: self.offsets_um,
            ranges_mdeg: self.ranges_mdeg,
            lines: lines.clone(),
        }
    }

    /// Calls `note` for every mistake in the specification, except those of the lines.
    pub fn report_mistakes(&self, note: &mut dyn FnMut(OutOfRange)) {
        LimbSpec::report_bone_mistakes(&self.offsets_um, &self.ranges_mdeg, &mut |mistake| {
            if let LimbError::Way { range, .. } | LimbError::Axis { range, .. } = mistake {
                note(range);
            }
        });
        let mut hold = |checked: Result<(), OutOfRange>| {
            if let Err(range) = checked {
                note(range);
            }
        };
        hold(Self::RECRUIT_MS.check(self.recruit_ms));
        match self.posture {
            PostureSpec::Measured { stale_after_ms } => {
                hold(SensorSource::STALE_AFTER_MS.check(stale_after_ms));
            }
            PostureSpec::Fixed(angles) => {
                let axes = angles.iter().zip(&self.ranges_mdeg).zip(AXIS_NAMES);
                for ((&centideg, &(low, high)), name) in axes {
                    // The product is at most 327 680.
                    hold(Range::new(name, low, high).check(i32::from(centideg) * 10));
                }
            }
        }
    }

    /// Checks the specification without the lines.
    ///
    /// # Errors
    /// Returns the first mistake of [`Self::report_mistakes`].
    pub fn check(&self) -> Result<(), OutOfRange> {
        let mut first = None;
        self.report_mistakes(&mut |range| {
            first.get_or_insert(range);
        });
        first.map_or(Ok(()), Err)
    }
}

impl Endpoint {
    /// Range of each component of a force, mN. No hand exerts more.
    pub const FORCE_MN: Range = Range::new("force_mn", -1_000_000, 1_000_000);

    /// Validates an arm and its lines.
    ///
    /// # Errors
    /// Returns the first field that is out of range, and its range.
    #[inline(never)]
    pub fn new(spec: &EndpointSpec, lines: &Lines) -> Result<Self, OutOfRange> {
        spec.check()?;
        let limb = Limb::new(&spec.limb(lines)).map_err(LimbError::out_of_range)?;
        let posture = match spec.posture {
            PostureSpec::Fixed(angles) => Source::Fixed(angles.map(Angle::from_centideg)),
            PostureSpec::Measured { stale_after_ms } => {
                let sensor = |range| Sensor::of_joint(SensorSource::Host, stale_after_ms, range);
                let [a, b, c, d, e, f, g, h, i] = spec.ranges_mdeg.map(sensor);
                Source::Measured([a?, b?, c?, d?, e?, f?, g?, h?, i?])
            }
        };
        Ok(Self {
            limb,
            lines: lines.iter().map(|line| line.channel).collect(),
            period_us: u32::from(spec.recruit_ms) * 1000,
            posture,
        })
    }

    /// Accepts a force at the hand, mN, valid from `at`; see [`SetpointTrack::accept`]. The arm
    /// must be able to produce the force in its present posture.
    ///
    /// # Errors
    /// Returns [`WrenchError`] if the force is refused. The reference is then unchanged.
    #[inline(never)]
    pub fn accept_force(
        &self,
        state: &mut EndpointState,
        now: Micros,
        at: Micros,
        force_mn: [i32; 3],
    ) -> Result<(), WrenchError> {
        let wanted = force_mn.map(force_from_millinewton);
        let made = self.recruit(state, now, wanted);
        made.map_err(WrenchError::Unmade)?;
        // All three tracks hold the same times, so either all accept this one or none does.
        for (track, force) in state.tracks.iter_mut().zip(wanted) {
            let taken = track.accept(now, at, force, Some(ForceRate::new(I16F16::ZERO)));
            taken.map_err(WrenchError::Setpoint)?;
        }
        Ok(())
    }

    /// Accepts an angle of the arm from the host, measured at `at`. Ignores axes above 8.
    ///
    /// # Errors
    /// Returns [`MeasurementError`] if the measurement is refused. The state is then unchanged.
    pub fn accept_measurement(
        &self,
        state: &mut EndpointState,
        now: Micros,
        at: Micros,
        axis: u8,
        angle: Angle,
    ) -> Result<(), MeasurementError> {
        let Source::Measured(sensors) = &self.posture else {
            return Err(MeasurementError::NotFromHost);
        };
        let axis = usize::from(axis);
        match (sensors.get(axis), state.sensors.get_mut(axis)) {
            (Some(sensor), Some(state)) => sensor.take_from_host(state, now, at, angle),
            _ => Ok(()),
        }
    }

    /// Runs one control tick. Returns `None` between two computations of the amplitudes, and until
    /// the first setpoint is due.
    ///
    /// # Errors
    /// Returns [`SensorFault`] if a measured angle is stale or implausible.
    #[inline(never)]
    pub fn tick(
        &self,
        state: &mut EndpointState,
        now: Micros,
    ) -> Result<Option<EndpointOrders>, SensorFault> {
        if let Source::Measured(sensors) = &self.posture {
            for (sensor, state) in sensors.iter().zip(&mut state.sensors) {
                match sensor.angle(state, now, None) {
                    Ok(_) | Err(SensorFault::Absent) => {}
                    Err(fault) => return Err(fault),
                }
            }
        }
        let mut wanted = [Force::default(); 3];
        for (part, track) in wanted.iter_mut().zip(&mut state.tracks) {
            let Some(force) = track.value_at(now, HoldPolicy::Hold) else {
                return Ok(None);
            };
            *part = force;
        }
        if !self.is_due(state, now) {
            return Ok(None);
        }
        let recruited = self.recruit(state, now, wanted);
        let achievable_permille = match recruited {
            Ok(_) => 1000,
            Err(ForceImpossible::TooStrong { permille, .. }) => permille,
            Err(_) => 0,
        };
        let orders = recruited.unwrap_or_default();
        let amplitude = |&channel: &u8| {
            let mut named = orders.iter().filter(|(value, _)| *value == channel);
            (
                channel,
                named
                    .next()
                    .map_or(Amplitude::ZERO, |(_, amplitude)| *amplitude),
            )
        };
        Ok(Some(EndpointOrders {
            reference_mn: wanted.map(force_to_millinewton),
            amplitudes: self.lines.iter().map(amplitude).collect(),
            achievable_permille,
        }))
    }

    /// Returns whether the amplitudes must be computed now. Periods count from the time at which
    /// the present setpoint became valid, so a setpoint that arrives every period takes effect in
    /// its first tick.
    fn is_due(&self, state: &mut EndpointState, now: Micros) -> bool {
        let [track, ..] = &state.tracks;
        let since = track.valid_since().or(state.latest).unwrap_or(now);
        // The time since then is several periods of at most 1 s, or one since the latest.
        let periods = now.elapsed_since(since) / self.period_us.max(1);
        let latest = since + us(periods * self.period_us); // at most `now`
        let is_done = |before: Micros| {
            let way = (latest - before).us();
            // Both are less than a period old, unless the clock has wrapped in between.
            way.unsigned_abs() < self.period_us
        };
        let is_due = state.latest.is_none_or(|before| !is_done(before));
        if is_due {
            state.latest = Some(latest);
        }
        is_due
    }

    /// Computes the amplitudes of the lines that a force needs in the present posture.
    #[inline(never)]
    fn recruit(
        &self,
        state: &mut EndpointState,
        now: Micros,
        wanted: [Force; 3],
    ) -> Result<crate::limb::Orders, ForceImpossible> {
        self.update_jacobians(state, now)?;
        // The bits are below 2^26; single precision rounds them by less than 10 µN.
        let [x, y, z] = wanted.map(|part| f32::ratio(part.get().to_bits(), 1 << 16));
        let made = self
            .limb
            .recruit(&state.jacobians, &Wrench::from_force(x, y, z));
        made.map(|recruited| recruited.orders).map_err(|e| match e {
            ReachError::NoMuscleHelps => ForceImpossible::NoMuscleHelps,
            ReachError::TooStrong { line, share } => ForceImpossible::TooStrong {
                channel: self.lines.get(usize::from(line)).copied().unwrap_or(0),
                permille: (share * 1000.0) as u16, // saturates, but is 0 to 1 anyway
            },
        })
    }

    /// Updates the Jacobians to the present posture, unless they are up to date.
    #[inline(never)]
    fn update_jacobians(
        &self,
        state: &mut EndpointState,
        now: Micros,
    ) -> Result<(), ForceImpossible> {
        let mut measured = [Angle::default(); AXES];
        let posture = match &self.posture {
            Source::Fixed(_) if state.posed.is_some() => return Ok(()),
            Source::Measured(_) if state.posed == Some(now) => return Ok(()),
            Source::Fixed(posture) => posture,
            Source::Measured(sensors) => {
                let axes = measured.iter_mut().zip(sensors).zip(&mut state.sensors);
                for (axis, ((angle, sensor), state)) in (0u8..).zip(axes) {
                    let found = sensor.angle(state, now, None);
                    *angle = found.map_err(|_| ForceImpossible::NoPosture { axis })?;
                }
                &measured
            }
        };
        state.posed = None;
        let jacobians = self.limb.jacobians_at_posture(posture);
        state.jacobians = jacobians.map_err(|e| ForceImpossible::Posture(e.out_of_range()))?;
        state.posed = Some(now);
        Ok(())
    }
}

/// Converts a force component on the link, mN, into a [`Force`].
fn force_from_millinewton(millinewton: i32) -> Force {
    let mn = Endpoint::FORCE_MN;
    let mn = i64::from(millinewton.max(mn.min).min(mn.max));
    // Below 2^20 · 2^16 / 1000. Rounding to nearest makes the inverse conversion exact.
    Force::new(I16F16::from_bits(
        ((mn * 65_536 + 500).div_euclid(1000)) as i32,
    ))
}

/// Converts a [`Force`] into mN for the link.
fn force_to_millinewton(force: Force) -> i32 {
    let bits = i64::from(force.get().to_bits());
    ((bits * 1000 + 32_768) >> 16) as i32 // at most 2^31 · 1000 / 2^16
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn forces_come_back_as_they_were_asked_for() {
        for mn in (-1_000_000..=1_000_000).step_by(7) {
            assert_eq!(force_to_millinewton(force_from_millinewton(mn)), mn);
        }
    }
}
