//! Single changes of the forearm model that could reconcile the paper with itself.

use hal_sim::body::hand::{HandSpec, Rule};
use serde::{Deserialize, Serialize};

/// Change of the model. Each changes one assumption of the prior and nothing else.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Mechanism {
    /// The model as it stands.
    #[default]
    Default,
    /// The potential charges a nerve, not its curvature along the fibres.
    Potential,
    /// The field along the nerve's own direction charges it.
    Field,
    /// The return has the impedance of its area.
    GoodReturn,
    /// The return has 27 times the impedance of its area.
    PoorReturn,
    /// The skin stores ten times the charge, so that much of it is left at the next pulse.
    StoringSkin,
    /// The stages do not limit their current below 1 A.
    NoLimiter,
    /// The resistance of the skin does not fall with the current.
    LinearSkin,
    /// A nerve remembers for 10 ms.
    LongMemory,
    /// A nerve responds to every pulse, without a refractory time.
    NoRefractoriness,
    /// The torque of one point is the mean of A and B instead of the larger one. The forearms are
    /// those of the model as it stands.
    MeanOfPoints,
    /// The prior as it stood before: scatter, skin, return and limiter are not drawn, and sessions
    /// take the most selective places of the whole forearm. It is no change of the model.
    Earlier,
}

impl Mechanism {
    /// All mechanisms, that of the model first.
    pub const ALL: [Self; 12] = [
        Self::Default,
        Self::Potential,
        Self::Field,
        Self::GoodReturn,
        Self::PoorReturn,
        Self::StoringSkin,
        Self::NoLimiter,
        Self::LinearSkin,
        Self::LongMemory,
        Self::NoRefractoriness,
        Self::MeanOfPoints,
        Self::Earlier,
    ];

    /// Returns the parameters of a forearm with this change.
    #[must_use]
    pub const fn changed(self, mut spec: HandSpec) -> HandSpec {
        match self {
            Self::Potential => spec.rule = Rule::Potential,
            Self::Field => spec.rule = Rule::Field,
            Self::NoLimiter => spec.limiter_a = 1.0,
            Self::LongMemory => spec.membrane.leak_s = 10e-3,
            Self::NoRefractoriness => {
                spec.membrane.absolute_s = 0.0;
                spec.membrane.relative_s = 0.0;
            }
            Self::Earlier => {
                spec.scatter = 1.0;
                spec.limiter_a = 0.020;
            }
            _ => {}
        }
        spec
    }

    /// Returns the name in declarations, results and columns.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Default => "default",
            Self::Potential => "potential",
            Self::Field => "field",
            Self::GoodReturn => "good-return",
            Self::PoorReturn => "poor-return",
            Self::StoringSkin => "storing-skin",
            Self::NoLimiter => "no-limiter",
            Self::LinearSkin => "linear-skin",
            Self::LongMemory => "long-memory",
            Self::NoRefractoriness => "no-refractoriness",
            Self::MeanOfPoints => "mean-of-points",
            Self::Earlier => "earlier",
        }
    }

    /// Returns the parameters of a session with this change of skin or return.
    #[must_use]
    pub const fn changed_session(self, mut spec: HandSpec) -> HandSpec {
        match self {
            Self::GoodReturn | Self::Earlier => spec.return_factor = 1.0,
            Self::PoorReturn => spec.return_factor = 27.0,
            Self::StoringSkin => spec.skin.farad_per_cm2 *= 10.0,
            Self::LinearSkin => spec.skin.half_a_per_cm2 = f64::INFINITY,
            _ => {}
        }
        spec
    }
}
