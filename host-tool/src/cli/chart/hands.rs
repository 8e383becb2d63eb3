//! `flexor chart control --wearers hands` and `--wearer`: compares controllers on multibody forearm
//! models, random from the population or as a wearer file describes them.

use super::write;
use crate::cli::{Output, usage_error};
use std::path::Path;
use studies::figures::hands_picture;
use studies::hamana2022::{Participants, TwoPointsError};
pub(super) use studies::hands::Plan;
use studies::hands::{Hands, HandsError, contenders, table};

/// Default number of draws, without and with `--quick`.
pub(super) const DRAWS: (u64, u64) = (60, 8);

/// Compares the controllers on the hand of one wearer (a file or a name) or on a random population,
/// and writes the chart to `out` unless `out` is `None`.
///
/// # Errors
/// E563, E621 to E623; for a wearer E620, E624, E625, E650 to E653 and the numbers of refused
/// fields. E575: a file cannot be written.
pub(super) fn main(
    plan: Plan,
    wearer: Option<&str>,
    out: Option<&Path>,
    output: Output,
) -> anyhow::Result<()> {
    if wearer == Some("all") {
        return usage_error(
            "--participant is all; give P, Q, R or S: each wearer has its own chart",
        );
    }
    let whom = wearer.map(|wearer| Participants::load(Some(wearer)));
    let whom = whom.transpose().map_err(TwoPointsError::with_lines)?;
    let bar = output.bar("hands");
    let ran = Hands::run(plan, whom.as_ref(), contenders()?, |part| bar.set(part));
    let hands = ran.map_err(|error| match error {
        HandsError::Hand(error) => error.with_lines(),
        error @ HandsError::Law(_) => error.into(),
    })?;
    bar.finish();
    if let Some(out) = out {
        let name = |end: &str| out.join(format!("{}.{end}", hands.file_stem()));
        write(&name("csv"), &table::csv(&hands))?;
        write(&name("svg"), &hands_picture(&hands))?;
    }
    output.print(
        || table::text(&hands).trim_end().to_owned(),
        || table::json(&hands),
    )
}
