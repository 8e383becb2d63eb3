//! What a host says about a joint, and the checks it must pass once.

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
    /// The control law and its gains.
    pub law: LawSpec,
    /// Period of the law, ms; 1…20. The paper's glove gives 90 Hz, so 11.
    pub law_period_ms: u8,
    /// Cutoff of the pseudo-differentiation, mHz; 500…20 000. The paper's: 3000.
    pub cutoff_mhz: u32,
    /// One or two flexor points.
    pub flexors: Vec<PointSpec, 2>,
    /// The extensor's point.
    pub extensor: PointSpec,
    /// What to do between and after setpoints.
    pub hold: HoldPolicy,
    /// Lowest angle a setpoint may ask for, m°; −180 000…180 000.
    pub angle_min_mdeg: i32,
    /// Highest angle a setpoint may ask for, m°; above the lowest, to 180 000.
    pub angle_max_mdeg: i32,
    /// Where measurements come from.
    pub sensor: SensorSource,
    /// Age at which the last measurement is stale, ms; 2…500.
    pub stale_after_ms: u16,
    /// The nominal wearer, for feed-forward; without one there is none.
    pub wearer: Option<WearerModel>,
    /// How the nominal wearer answers in time and how that is corrected, for a
    /// predictor and a learning feed-forward; `None` for neither. The paper's law
    /// uses neither this nor the wearer.
    pub response: Option<ResponseSpec>,
}

impl JointSpec {
    /// Its points, flexors first.
    pub fn points(&self) -> impl Iterator<Item = &PointSpec> {
        self.flexors.iter().chain([&self.extensor])
    }

    /// Checks everything but the law, which [`JointSpec::law`] checks.
    pub(super) fn check(&self) -> Result<(), OutOfRange> {
        if let HoldPolicy::Extrapolate { max_ms } = self.hold {
            HoldPolicy::MAX_MS.check(max_ms)?;
        }
        check_angles(self.angle_min_mdeg, self.angle_max_mdeg)
    }

    /// The validated law.
    pub(crate) fn law(&self) -> Result<Law, OutOfRange> {
        let (period_ms, cutoff_mhz) = (self.law_period_ms, self.cutoff_mhz);
        let has_wearer = self.wearer.is_some();
        let response = self.response.map(|r| r.validate(period_ms, has_wearer));
        Law::new(&self.law, period_ms, cutoff_mhz, response.transpose()?)
    }

    /// The wearer's inverse. A law that steers by the wearer, which is any but the
    /// paper's, is refused on one of a strength that it was never tried on.
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

    /// The validated points: effort to amplitudes.
    ///
    /// # Errors
    /// [`SpecError`] names the first offending field and what it allows.
    pub fn mapping(&self) -> Result<Mapping, SpecError> {
        Mapping::new(&self.flexors, self.extensor)
    }
}
