//! `[fidelity]`: the error that a session tolerates in its simulation and models.

use super::Session;
use crate::fields::error::Problem;
use crate::fields::table::Table;
use firmware::control::LawSpec;
use std::fmt;

/// Name of the field that sets the tolerance of a session.
const FIELD: &str = "tolerance_percent";

/// An error of force, as a share of the largest force of a session, in hundredths of a percent.
/// Shares above 655.35 % saturate.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub struct Share(pub u16);

impl Share {
    /// Just-noticeable difference of force, 10 %. It is the tolerance of a session without
    /// `[fidelity]`.
    pub const JUST_NOTICEABLE: Self = Self(1_000);
}

impl fmt::Display for Share {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}.{:02} %", self.0 / 100, self.0 % 100)
    }
}

/// Reads `[fidelity]`: the tolerance, and the duration of the trial that chooses the models.
/// Reports a `[fidelity]` in a session without muscles, simulated hand and simulated arm.
pub(super) fn read(root: &Table<'_>, session: &mut Session) {
    let Some(table) = root.table("fidelity") else {
        return;
    };
    session.tolerance = Share(table.integer(FIELD));
    session.try_us = table.integer("try_s");
    session.has_fidelity = true;
    let is_given = root
        .table("joint")
        .is_none_or(|table| table.has("law_period_ms"));
    let is_own = session
        .joint
        .as_ref()
        .is_some_and(|joint_spec| joint_spec.law == LawSpec::ALONE);
    session.law_is_free = is_own && !is_given;
    // A simulated hand or arm has a level of detail to choose.
    let has_limb = session.hand().is_some() || session.arm_step_ms().is_some();
    if session.channels.iter().all(|c| c.muscle.is_none()) && !has_limb {
        table.report(FIELD, Problem::NothingToFit {});
    }
}
