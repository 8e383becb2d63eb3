//! A joint whose muscles are stimulated by its angle while a person handles an object
//! (Buatier de Mongeot et al., section III.C).

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

/// Joints of two arms: each an elbow and a shoulder.
pub const JOINTS: usize = 4;
/// Modulation runs at every control tick, ms.
const STEP_MS: u8 = 1;

/// A validated joint. Immutable.
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
///     longest_hold_ms: 10_000,
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

/// A muscle of it.
#[derive(Clone, Copy, Debug)]
struct Modulated {
    channel: u8,
    /// Both at most 200 000 by validation.
    base: Amplitude,
    form: Form,
    lift: Option<Curve>,
    drop: Option<Curve>,
}

impl Modulation {
    /// Validates a specification.
    ///
    /// # Errors
    /// [`ModulationError`] names the first mistake and what would do.
    pub fn new(spec: &ModulationSpec) -> Result<Self, ModulationError> {
        spec.check()?;
        Ok(Self::from_checked(spec)?)
    }

    /// Of a specification that [`ModulationSpec::check`] has passed: quartics, which take
    /// long to enclose, are not asked again.
    ///
    /// # Errors
    /// Of one that has not, a range.
    pub(crate) fn from_checked(spec: &ModulationSpec) -> Result<Self, OutOfRange> {
        let range = (spec.angle_min_mdeg, spec.angle_max_mdeg);
        Ok(Self {
            joint: spec.joint,
            phase_joint: spec.phase_joint,
            longest_hold_us: spec.longest_hold_ms.saturating_mul(1000), // at most 6·10^8
            sensor: Sensor::of_joint(SensorSource::Host, spec.stale_after_ms, range)?,
            span: Span::new(spec.angle_min_mdeg, spec.angle_max_mdeg),
            detector: PhaseDetector::new(spec.dead_band_centideg_per_s, spec.cutoff_mhz)?,
            muscles: [&spec.flexor, &spec.extensor].map(Modulated::new),
        })
    }

    /// What its two muscles get at an angle of the joint, flexor first: 0 in a phase
    /// without a quartic, and before any phase. Outside the range of the joint it is what
    /// it is at the nearer end: no quartic was checked there.
    ///
    /// From the formula in real numbers it differs by at most half a µA (mV), which is the
    /// amplitude's own rounding, 7.5·10^-8 of I₀, and what the quartic makes of 3·10^-5°:
    /// 0.52 µA at the worst of every 0.01° of four joints
    /// (`firmware/tests/haptics_modulation.rs`), one code of a 40 mA stage's DAC.
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

    /// What tells its phase, from the angle of its phase joint.
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

    /// What a share of `base` comes to.
    #[inline]
    const fn scaled_amplitude(base: Amplitude, form: Form, share: Share) -> Amplitude {
        let threshold = match form {
            Form::Scaled => 0,
            Form::AboveThreshold { threshold } => threshold.get(),
        };
        // Threshold below base below 2^18; the share below 8.
        let above = share.scale(base.get().wrapping_sub(threshold));
        Amplitude::new(threshold.wrapping_add(above))
    }
}
