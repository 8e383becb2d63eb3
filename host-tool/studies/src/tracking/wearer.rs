//! The nominal wearer file: everything that control laws, feed-forward and the mapping to
//! amplitudes know of the wearer.

use super::TrackingError;
use firmware::control::{
    FeedForward, HoldPolicy, JointSpec, LawSpec, Mapping, PointSpec, ResponseSpec, SensorSource,
    SpecError, WearerModel,
};
use firmware::units::Amplitude;
use hal_sim::body::wearer::Site;
use hal_sim::body::{FingerSpec, RandomFingerSpec};

/// Amplitude on the channels of the points A and B and of the extensor, V; 0 means no pulse.
pub type Volts = [f64; 3];

/// Points at which the flexor is stimulated.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Hash)]
pub enum Points {
    /// One point, A.
    One,
    /// The points A and B as a conducted pair. Its strength is assumed to lie in a range
    /// ([`hal_sim::body::random_finger::TWO_POINTS_NM`]). Its thresholds are those of table 7
    /// ([`hal_sim::body::wearer::Participant::pair_thresholds_v`]).
    Two,
}

impl Points {
    pub const ALL: [Self; 2] = [Self::One, Self::Two];

    /// Returns the name of the points in tables.
    pub const fn name(self) -> &'static str {
        match self {
            Self::One => "one-point",
            Self::Two => "two-point",
        }
    }
}

/// Range of angles that a setpoint may request, m°: the finger's range of motion.
const RANGE_MDEG: (i32, i32) = (0, 100_000);

/// What the default controller does when setpoints are lost: it extrapolates them for up to 200 ms.
pub const SHIPPED_HOLD: HoldPolicy = HoldPolicy::Extrapolate { max_ms: 200 };

fn millivolts(volts: f64) -> Amplitude {
    Amplitude::new((volts * 1000.0).round() as u32)
}

/// Returns the finger of participant P of Hamana 2022 (table 7), which is the nominal one. The
/// torque of its two points together is assumed.
pub fn nominal() -> FingerSpec {
    RandomFingerSpec::nominal().finger
}

/// Returns the nominal wearer's model for the device's feed-forward, with the lead `lead_ms`.
pub fn model(points: Points, lead_ms: u16) -> WearerModel {
    let finger = nominal();
    let micro = |x: f64| (x * 1e6).round() as u32;
    let single_nm = finger.flexor_torque_nm;
    let flexion_nm = match points {
        Points::One => single_nm,
        Points::Two => finger.pair.map_or(single_nm, |pair| pair.torque_nm[0]),
    };
    WearerModel {
        rest_mdeg: (finger.rest_deg * 1000.0) as i32,
        stiffness_unm_per_rad: micro(finger.stiffness_nm_per_rad),
        damping_unm_s_per_rad: micro(finger.damping_nm_s_per_rad),
        flexion_unm: micro(flexion_nm),
        extension_unm: micro(finger.extensor_torque_nm),
        torque_loss_milli: (finger.torque_loss * 1000.0) as u16,
        curvature_milli: (finger.recruitment_curvature * 1000.0) as u16,
        lead_ms,
    }
}

/// Returns the nominal wearer's joint as the device is configured for it, with `law` and without a
/// wearer model.
pub fn joint(law: LawSpec, points: Points, hold: HoldPolicy) -> JointSpec {
    let finger = nominal();
    let from = |site: Site, threshold_v: f64| PointSpec {
        channel: site.channel as u8,
        threshold: millivolts(threshold_v),
        max: millivolts(site.max_v),
    };
    let point = |site: Site| from(site, site.threshold_v);
    let [a, b] = [finger.flexor_a, finger.flexor_b];
    let own = [a.threshold_v, b.threshold_v];
    let [half_a, half_b] = finger.pair.map_or(own, |pair| pair.threshold_v);
    JointSpec {
        law,
        law_period_ms: law.default_period_ms(),
        cutoff_mhz: law.default_cutoff_mhz(),
        flexors: match points {
            Points::One => [point(a)].into_iter().collect(),
            Points::Two => [from(a, half_a), from(b, half_b)].into_iter().collect(),
        },
        extensor: point(finger.extensor),
        hold,
        angle_min_mdeg: RANGE_MDEG.0,
        angle_max_mdeg: RANGE_MDEG.1,
        sensor: SensorSource::Host,
        stale_after_ms: 100,
        wearer: None,
        response: None,
    }
}

/// Returns the joint of the nominal wearer with the default controller: [`LawSpec::RECOMMENDED`]
/// and everything that the wearer file configures, scaled by the wearer's strength.
pub fn shipped(points: Points) -> JointSpec {
    let model = model(points, LawSpec::RECOMMENDED.default_lead_ms());
    JointSpec {
        wearer: Some(model),
        response: Some(ResponseSpec::RECOMMENDED.for_wearer(&model)),
        ..joint(
            LawSpec::RECOMMENDED.for_wearer(&model),
            points,
            SHIPPED_HOLD,
        )
    }
}

/// What a law in floating point knows about its wearer.
#[derive(Clone, PartialEq, Debug)]
pub struct KnownWearer {
    /// Stimulation points and range of angles. The control law in it is not used.
    pub joint: JointSpec,
    /// Strength, spring and rest angle for the feed-forward. The lead in it is not used.
    pub model: WearerModel,
}

impl KnownWearer {
    /// Returns what the file of the nominal wearer contains.
    pub fn nominal(points: Points) -> Self {
        Self {
            joint: joint(LawSpec::RECOMMENDED, points, HoldPolicy::Hold),
            model: model(points, 0),
        }
    }

    /// Returns the mapping from an effort to this wearer's amplitudes.
    ///
    /// # Errors
    /// Fails if the device refuses the points.
    pub fn mapping(&self) -> Result<Mapping, TrackingError> {
        self.joint.mapping().map_err(Into::into)
    }

    /// Returns the feed-forward, which inverts the wearer's model, with the lead `lead_ms`.
    ///
    /// # Errors
    /// Fails if the model is out of range, or if the lead is above half a second.
    pub fn feed_forward(&self, lead_ms: u16) -> Result<FeedForward, TrackingError> {
        let (low, high) = (self.joint.angle_min_mdeg, self.joint.angle_max_mdeg);
        let model = WearerModel {
            lead_ms,
            ..self.model
        };
        let refused = |e| TrackingError::Joint(SpecError::Range(e));
        FeedForward::new(&model, low, high).map_err(refused)
    }
}

/// Returns the mapping from an effort to the nominal wearer's amplitudes.
///
/// # Errors
/// Never fails: the nominal wearer is valid (tested).
pub fn mapping(points: Points) -> Result<Mapping, TrackingError> {
    KnownWearer::nominal(points).mapping()
}

/// Returns the effort, −1 to 1, that the nominal wearer's mapping turns into these amplitudes.
pub fn effort_of(points: Points, [a, _, extensor]: Volts) -> f64 {
    let spec = joint(LawSpec::RECOMMENDED, points, HoldPolicy::Hold);
    let share = |point: &PointSpec, volts: f64| {
        let [low, high] = [point.threshold, point.max].map(|v| f64::from(v.get()) / 1000.0);
        ((volts - low) / (high - low)).clamp(0.0, 1.0)
    };
    // Both points of a pair are at the same part of their ranges.
    let flexion = spec.flexors.first().map_or(0.0, |point| share(point, a));
    flexion - share(&spec.extensor, extensor)
}
