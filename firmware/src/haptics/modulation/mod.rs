//! Modulation: stimulation of a joint's muscles that follows the joint's angle while the wearer
//! handles an object (Buatier de Mongeot et al., section III.C).

mod curve;
mod phase;
mod spec;
mod together;

pub use curve::{Extreme, QuarticSpec};
pub use phase::{MotionPhase, PhaseDetector, PhaseState};
pub use spec::{Form, ModulatedSpec, ModulationError, ModulationSpec};
pub use together::{Hold, HoldError, ModulationOrders, Modulations, ModulationsState};

use crate::control::SensorSource;
use crate::control::sensor::Sensor;
use crate::range::OutOfRange;
use crate::units::{Amplitude, Angle};
use curve::{Curve, Share, Span};

/// Maximum number of modulated joints: elbow and shoulder of two arms.
pub const JOINTS: usize = 4;
/// Period of modulation, which runs at every control tick, ms.
const STEP_MS: u8 = 1;

/// A validated modulated joint. Immutable.
///
/// ```
/// use firmware::haptics::{
///     Form, ModulatedSpec, Modulation, ModulationSpec, MotionPhase, QuarticSpec,
/// };
/// use firmware::units::{Amplitude, Angle};
///
/// let biceps = ModulatedSpec {
///     channel: 0,
///     base: Amplitude::new(20_000),
///     form: Form::Scaled,
///     // From 0.2 in a straight line to 0.8.
///     lift: Some(QuarticSpec([200_000, 350_000, 500_000, 650_000, 800_000])),
///     drop: None,
/// };
/// let elbow = Modulation::new(&ModulationSpec {
///     joint: 0,
///     phase_joint: 0,
///     dead_band_centideg_per_s: 800,
///     cutoff_mhz: 3_000,
///     angle_min_mdeg: 0,
///     angle_max_mdeg: 100_000,
///     stale_after_ms: 50,
///     max_hold_ms: 10_000,
///     flexor: biceps,
///     extensor: ModulatedSpec { channel: 1, lift: None, ..biceps },
/// })
/// .unwrap();
/// let half = Angle::from_centideg(5_000);
/// let mine = |mine: u32| [(0, Amplitude::new(mine)), (1, Amplitude::ZERO)];
/// assert_eq!(elbow.amplitudes(half, Some(MotionPhase::Lift)), mine(10_000));
/// assert_eq!(elbow.amplitudes(half, Some(MotionPhase::Drop)), mine(0));
/// assert_eq!(elbow.amplitudes(half, None), mine(0));
/// ```
#[derive(Clone, Debug)]
pub struct Modulation {
    joint: u8,
    phase_joint: u8,
    longest_hold_us: u32,
    sensor: Sensor,
    span: Span,
    detector: PhaseDetector,
    muscles: [Modulated; 2],
}

/// Validated modulation of one muscle of the joint.
#[derive(Clone, Copy, Debug)]
struct Modulated {
    channel: u8,
    /// Amplitude I₀. It and the threshold of `form` are at most 200 000 by validation.
    base: Amplitude,
    form: Form,
    lift: Option<Curve>,
    drop: Option<Curve>,
}

impl Modulation {
    /// Validates a specification.
    ///
    /// # Errors
    /// Returns [`ModulationError`] with the first mistake and the allowed values.
    pub fn new(spec: &ModulationSpec) -> Result<Self, ModulationError> {
        spec.check()?;
        Ok(Self::from_checked(spec)?)
    }

    /// Creates a joint from a specification that has passed [`ModulationSpec::check`]. The
    /// quartics, whose extremes take long to find, are not checked again.
    ///
    /// # Errors
    /// Returns [`OutOfRange`] if the specification was not checked and has a wrong sensor or
    /// detector setting.
    pub(crate) fn from_checked(spec: &ModulationSpec) -> Result<Self, OutOfRange> {
        let range = (spec.angle_min_mdeg, spec.angle_max_mdeg);
        Ok(Self {
            joint: spec.joint,
            phase_joint: spec.phase_joint,
            longest_hold_us: spec.max_hold_ms.saturating_mul(1000), // at most 6·10^8
            sensor: Sensor::of_joint(SensorSource::Host, spec.stale_after_ms, range)?,
            span: Span::new(spec.angle_min_mdeg, spec.angle_max_mdeg),
            detector: PhaseDetector::new(spec.dead_band_centideg_per_s, spec.cutoff_mhz)?,
            muscles: [&spec.flexor, &spec.extensor].map(Modulated::new),
        })
    }

    /// Returns the amplitudes of both muscles at an angle of the joint, flexor first: 0 in a phase
    /// without a quartic, and before any phase. Outside the joint's range the amplitudes are those
    /// at the nearer end, because the quartic was checked only inside.
    ///
    /// The difference from the formula in real numbers is at most half a µA (mV) for the rounding
    /// of the amplitude, 7.5·10^-8 of I₀, and the change of the quartic over 3·10^-5°: at most 0.52
    /// µA over every 0.01° of four joints (`firmware/tests/haptics_modulation.rs`), one code of the
    /// DAC of a 40 mA stage.
    #[must_use]
    #[inline]
    pub fn amplitudes(&self, angle: Angle, phase: Option<MotionPhase>) -> [(u8, Amplitude); 2] {
        let along = self.span.position_of(angle);
        self.muscles.map(|muscle| {
            let curve = match phase {
                Some(MotionPhase::Lift) => muscle.lift,
                Some(MotionPhase::Drop) => muscle.drop,
                None => None,
            };
            let amplitude = curve.map_or(Amplitude::ZERO, |curve| {
                Modulated::scaled_amplitude(muscle.base, muscle.form, curve.at(along))
            });
            (muscle.channel, amplitude)
        })
    }

    /// Returns the detector of the motion phase, which uses the angle of the phase joint.
    #[must_use]
    pub const fn detector(&self) -> &PhaseDetector {
        &self.detector
    }
}

impl Modulated {
    fn new(spec: &ModulatedSpec) -> Self {
        Self {
            channel: spec.channel,
            base: spec.base,
            form: spec.form,
            lift: spec.lift.as_ref().map(Curve::new),
            drop: spec.drop.as_ref().map(Curve::new),
        }
    }

    /// Returns the amplitude for a share of `base`.
    #[inline]
    const fn scaled_amplitude(base: Amplitude, form: Form, share: Share) -> Amplitude {
        let threshold = match form {
            Form::Scaled => 0,
            Form::AboveThreshold { threshold } => threshold.get(),
        };
        // The threshold is below base, which is below 2^18; the share is below 8.
        let above = share.scale(base.get().wrapping_sub(threshold));
        Amplitude::new(threshold.wrapping_add(above))
    }
}
