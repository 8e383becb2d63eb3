//! Specification of a joint by the host, and its checks.

use super::feed_forward::{FeedForward, WearerModel};
use super::law::{Law, LawSpec};
use super::mapping::{Mapping, PointSpec};
use super::refusal::{SpecError, check_angles};
use super::response::ResponseSpec;
use super::sensor::SensorSource;
use super::setpoint::HoldPolicy;
use crate::range::OutOfRange;
use heapless::Vec;
use postcard_schema::Schema;
use serde::{Deserialize, Serialize};

/// A joint as it travels on the wire, unvalidated. Integers only.
#[derive(Clone, PartialEq, Eq, Debug, Serialize, Deserialize, Schema)]
pub struct JointSpec {
    /// Control law and its gains.
    pub law: LawSpec,
    /// Period of the controller, ms; 1…20. The paper's glove gives 90 Hz, so 11.
    pub law_period_ms: u8,
    /// Cutoff of the pseudo-differentiation, mHz; 500…20 000. The paper uses 3000.
    pub cutoff_mhz: u32,
    /// Stimulation points of the flexor, one or two.
    pub flexors: Vec<PointSpec, 2>,
    /// Stimulation point of the extensor.
    pub extensor: PointSpec,
    /// Behaviour of the reference between and after setpoints.
    pub hold: HoldPolicy,
    /// Lowest angle that a setpoint may ask for, m°; −180 000…180 000.
    pub angle_min_mdeg: i32,
    /// Highest angle that a setpoint may ask for, m°; above the lowest, up to 180 000.
    pub angle_max_mdeg: i32,
    /// Source of the angle measurements.
    pub sensor: SensorSource,
    /// Age at which the latest measurement is stale, ms; 2…500.
    pub stale_after_ms: u16,
    /// Nominal wearer for the feed-forward; `None` for no feed-forward.
    pub wearer: Option<WearerModel>,
    /// Nominal response of the wearer and its adaptation, for a predictor and a learning
    /// feed-forward; `None` for neither. The paper's controller uses neither this nor `wearer`.
    pub response: Option<ResponseSpec>,
}

impl JointSpec {
    /// Returns the stimulation points, flexors first.
    pub fn points(&self) -> impl Iterator<Item = &PointSpec> {
        self.flexors.iter().chain([&self.extensor])
    }

    /// Checks everything but the control law, which [`JointSpec::law`] checks.
    pub(super) fn check(&self) -> Result<(), OutOfRange> {
        if let HoldPolicy::Extrapolate { max_ms } = self.hold {
            HoldPolicy::MAX_MS.check(max_ms)?;
        }
        check_angles(self.angle_min_mdeg, self.angle_max_mdeg)
    }

    /// Returns the validated controller.
    pub(crate) fn law(&self) -> Result<Law, OutOfRange> {
        let (period_ms, cutoff_mhz) = (self.law_period_ms, self.cutoff_mhz);
        let has_wearer = self.wearer.is_some();
        let response = self.response.map(|r| r.validate(period_ms, has_wearer));
        Law::new(&self.law, period_ms, cutoff_mhz, response.transpose()?)
    }

    /// Returns the feed-forward of the nominal wearer. Every control law but the paper's uses the
    /// wearer's model, and is refused for a strength at which it was never tested.
    pub(super) fn feed_forward(&self) -> Result<Option<FeedForward>, OutOfRange> {
        let Some(wearer) = &self.wearer else {
            return Ok(None);
        };
        let inverse = FeedForward::new(wearer, self.angle_min_mdeg, self.angle_max_mdeg)?;
        if !matches!(self.law, LawSpec::Paper { .. }) {
            let allowed = wearer.stiffness_range();
            allowed.check(wearer.stiffness_unm_per_rad)?;
        }
        Ok(Some(inverse))
    }

    /// Returns the mapping of effort to amplitudes, with validated points.
    ///
    /// # Errors
    /// Returns [`SpecError`] with the first offending field and its range.
    pub fn mapping(&self) -> Result<Mapping, SpecError> {
        Mapping::new(&self.flexors, self.extensor)
    }
}
