//! Control of one joint: setpoint track, sensor, controller and stimulation points.

use super::effort::Effort;
use super::feed_forward::FeedForward;
use super::gain::Gain;
use super::law::{Law, LawSpec, LawState};
use super::limit_cycle::{Detector, DetectorState, LimitCycle};
use super::mapping::{Amplitudes, Mapping};
use super::refusal::SpecError;
use super::response::{Course, DelayedSides};
use super::rest::{Gap, GapState};
use super::sensor::{MeasurementError, Sensor, SensorFault, SensorState};
use super::setpoint::{HoldPolicy, SetpointError, SetpointTrack};
use super::spec::JointSpec;
use crate::units::{Angle, AngularRate, Micros, us};

/// A validated joint. It is immutable; everything that changes is in a [`JointState`].
///
/// ```
/// use firmware::control::{
///     HoldPolicy, Joint, JointSpec, JointState, LawSpec, PointSpec, SensorSource,
/// };
/// use firmware::units::{Amplitude, Angle, Micros};
///
/// let law = LawSpec::ALONE;
/// let joint = Joint::new(&JointSpec {
///     law,
///     law_period_ms: law.default_period_ms(),
///     cutoff_mhz: law.default_cutoff_mhz(),
///     flexors: [PointSpec::of_pair(0, Amplitude::new(20_000), 700)].into_iter().collect(),
///     extensor: PointSpec::of_pair(1, Amplitude::new(20_000), 700),
///     hold: HoldPolicy::Hold,
///     angle_min_mdeg: 0,
///     angle_max_mdeg: 100_000,
///     sensor: SensorSource::Host,
///     stale_after_ms: 50,
///     wearer: None,
///     response: None,
/// })
/// .unwrap();
/// let (mut state, now) = (JointState::default(), Micros::new(1_000));
/// let (bent, wanted) = (Angle::from_centideg(1_000), Angle::from_centideg(5_000));
/// joint.accept_measurement(&mut state, now, now, bent).unwrap();
/// joint.accept_setpoint(&mut state, now, now, wanted, None).unwrap();
/// let orders = joint.tick(&mut state, now, None).unwrap();
/// let (flexor, extensor) = (orders.amplitudes[0].1, orders.amplitudes[1].1);
/// assert!(flexor > extensor); // 40° too little: it flexes
/// ```
#[derive(Clone, Debug)]
pub struct Joint {
    law: Law,
    law_period_us: u32,
    /// Detectors that reduce the controller's gain; `None` for the paper's controller.
    governed: Option<(Detector, Gap)>,
    mapping: Mapping,
    hold: HoldPolicy,
    angle_mdeg: (i32, i32),
    /// Lowest and highest angle that a setpoint may ask for.
    range: (Angle, Angle),
    sensor: Sensor,
    feed_forward: Option<FeedForward>,
}

/// State of a joint's control. Every stimulation must begin with a fresh state.
#[derive(Clone, Debug, Default)]
pub struct JointState {
    track: SetpointTrack,
    sensor: SensorState,
    law: LawState,
    detector: DetectorState,
    gap: GapState,
    /// Limit cycle of the latest tick. It is not in [`Orders`], which every tick copies.
    limit_cycle: Option<LimitCycle>,
    effort: Option<Effort>,
    law_due: Micros,
    delayed: DelayedSides,
}

impl JointState {
    /// Returns whether a setpoint has been due, so that the controller has run.
    #[must_use]
    pub const fn has_target(&self) -> bool {
        self.effort.is_some()
    }

    /// Takes the limit cycle that the latest tick found, if any. The feedback's gain is already
    /// lowered.
    pub const fn take_limit_cycle(&mut self) -> Option<LimitCycle> {
        self.limit_cycle.take()
    }
}

/// Output of a joint's control in one tick.
#[derive(Clone, PartialEq, Debug)]
pub struct Orders {
    /// Amplitude of every channel of the joint, flexors first.
    pub amplitudes: Amplitudes,
    /// Whether an amplitude was clamped to the wearer's maximum.
    pub limiting: bool,
    /// Reference angle now.
    pub target: Angle,
    /// Latest measured angle.
    pub measured: Angle,
    /// Output of the controller before any clamp.
    pub effort: Effort,
}

impl Joint {
    /// Validates a specification.
    ///
    /// # Errors
    /// Returns [`SpecError`] with the first offending field and its range.
    pub fn new(spec: &JointSpec) -> Result<Self, SpecError> {
        spec.check()?;
        let (min, max) = (spec.angle_min_mdeg, spec.angle_max_mdeg);
        Ok(Self {
            law: spec.law()?,
            law_period_us: u32::from(spec.law_period_ms) * 1000,
            governed: match spec.law {
                LawSpec::Paper { .. } => None,
                _ => Some((
                    Detector::new(spec.law_period_ms),
                    Gap::new(spec.law_period_ms),
                )),
            },
            mapping: spec.mapping()?,
            hold: spec.hold,
            angle_mdeg: (min, max),
            range: (Angle::from_millideg(min), Angle::from_millideg(max)),
            sensor: Sensor::of_joint(spec.sensor, spec.stale_after_ms, (min, max))?,
            feed_forward: spec.feed_forward()?,
        })
    }

    /// Creates the joint with a feedback gain that is never reduced, for studies of a controller by
    /// itself.
    ///
    /// # Errors
    /// The same as for [`Self::new`].
    pub fn with_full_gain(spec: &JointSpec) -> Result<Self, SpecError> {
        Ok(Self {
            governed: None,
            ..Self::new(spec)?
        })
    }

    /// Returns the feed-forward of the nominal wearer, if the specification has one.
    #[must_use]
    pub const fn feed_forward(&self) -> Option<&FeedForward> {
        self.feed_forward.as_ref()
    }

    /// Accepts a setpoint valid from `at`; see [`SetpointTrack::accept`].
    ///
    /// # Errors
    /// Returns [`SetpointError`] if the setpoint is refused. The state is then unchanged.
    pub fn accept_setpoint(
        &self,
        state: &mut JointState,
        now: Micros,
        at: Micros,
        angle: Angle,
        rate: Option<AngularRate>,
    ) -> Result<(), SetpointError> {
        if angle < self.range.0 || angle > self.range.1 {
            let (min_mdeg, max_mdeg) = self.angle_mdeg;
            return Err(SetpointError::OutOfRange { min_mdeg, max_mdeg });
        }
        state.track.accept(now, at, angle, rate)
    }

    /// Accepts a measurement from the host, made at `at`.
    ///
    /// # Errors
    /// Returns [`MeasurementError`] if the measurement is refused. The state is then unchanged. A
    /// measurement that is too old or out of range is accepted and causes the next tick's fault.
    pub fn accept_measurement(
        &self,
        state: &mut JointState,
        now: Micros,
        at: Micros,
        angle: Angle,
    ) -> Result<(), MeasurementError> {
        self.sensor
            .take_from_host(&mut state.sensor, now, at, angle)
    }

    /// Converts a converter code into an angle for [`Joint::tick`]. Returns `None` if the host
    /// measures this joint. The conversion is linear, also beyond the two calibrated codes and
    /// 0…4095, and saturates.
    #[must_use]
    pub fn angle_from_code(&self, code: u16) -> Option<Angle> {
        self.sensor.angle_from_code(code)
    }

    /// Records whether the latest pulse of `channel` was below the amplitude that the controller
    /// wants there. While it is, the controller's integral does not grow on that side.
    pub fn note_pulse(&self, state: &mut JointState, channel: u8, is_delayed: bool) {
        match self.mapping.is_flexor(channel) {
            Some(true) => state.delayed.flexion = is_delayed,
            Some(false) => state.delayed.extension = is_delayed,
            None => {}
        }
    }

    /// Runs one control tick; call this function every millisecond. `reading` is the board's own
    /// measurement of this instant; it is ignored if the host measures the angle.
    ///
    /// The controller runs in the first tick and then every period. Its effort is kept in between,
    /// so the first measurement after a setpoint takes effect within a period. Until the first
    /// setpoint is due, every amplitude is zero, the reference is the measured angle, and the
    /// controller does not run.
    ///
    /// # Errors
    /// Returns [`SensorFault`] instead of orders while there is no recent, plausible measurement.
    /// No fault is latched here; `safety` does that.
    pub fn tick(
        &self,
        state: &mut JointState,
        now: Micros,
        reading: Option<Angle>,
    ) -> Result<Orders, SensorFault> {
        let measured = self.sensor.angle(&mut state.sensor, now, reading)?;
        let Some((target, rate)) = state.track.motion_at(now, self.hold) else {
            return Ok(Orders {
                amplitudes: self.mapping.silence(),
                limiting: false,
                target: measured,
                measured,
                effort: self.law.zero_effort(),
            });
        };
        let target = at_most(at_least(target, self.range.0), self.range.1);
        let effort = match state.effort {
            Some(effort) if self.is_waiting(state.law_due, now) => effort,
            held => {
                let error = target - measured;
                let course = self
                    .feed_forward
                    .map_or_else(Course::default, |wearer| Course {
                        rate,
                        forward: wearer.effort(target, rate),
                        ..Course::default()
                    });
                let course = Course {
                    delayed: state.delayed,
                    ..course
                };
                let gain = self.feedback_gain(state, target, error);
                let effort = self.law.step(&mut state.law, error, &course, gain);
                state.law_due = self.next_due(state.law_due, now, held.is_some());
                state.effort = Some(effort);
                effort
            }
        };
        let (amplitudes, limiting) = self.mapping.amplitudes(effort);
        Ok(Orders {
            amplitudes,
            limiting,
            target,
            measured,
            effort,
        })
    }

    /// Returns the share of the controller's feedback, and stores a limit cycle if one was found.
    #[inline]
    fn feedback_gain(&self, state: &mut JointState, target: Angle, error: Angle) -> Gain {
        let Some((detector, gap)) = &self.governed else {
            return Gain::ONE;
        };
        if let Some(found) = detector.step(&mut state.detector, target, error) {
            state.limit_cycle = Some(found);
        }
        let rest = gap.step(&mut state.gap, target, error);
        state.detector.gain().combine(rest)
    }

    /// Returns whether the controller's next step is still to come. A due time more than a period
    /// ahead comes from a wrapped clock and does not count.
    fn is_waiting(&self, due: Micros, now: Micros) -> bool {
        let ahead = (due - now).us();
        ahead > 0 && ahead.cast_unsigned() <= self.law_period_us
    }

    /// Returns the time of the next step: one period after the last due time, so that the rate does
    /// not drift; one period from now at the start and after a gap.
    fn next_due(&self, due: Micros, now: Micros, running: bool) -> Micros {
        let next = due + us(self.law_period_us);
        if running && now.is_before(next) {
            next
        } else {
            now + us(self.law_period_us)
        }
    }
}

fn at_least(a: Angle, low: Angle) -> Angle {
    if a < low { low } else { a }
}

fn at_most(a: Angle, high: Angle) -> Angle {
    if a > high { high } else { a }
}
