//! `flexor chart control --wearers hands`: control laws on forearms that are a mechanism.

use super::write;
use crate::cli::Output;
use std::path::Path;
use studies::figures::hands_picture;
pub(super) use studies::hands::Plan;
use studies::hands::{Hands, contenders, table};

/// Draws of a chart, and of a quick look.
pub(super) const DRAWS: (u64, u64) = (60, 8);

/// Into `out`, unless it is only a look.
///
/// # Errors
/// E563, E621 to E623. E575: a file cannot be written.
pub(super) fn main(plan: Plan, out: Option<&Path>, output: Output) -> anyhow::Result<()> {
    let bar = output.bar("hands");
    let hands = Hands::run(plan, contenders()?, |part| bar.set(part))?;
    bar.finish();
    if let Some(out) = out {
        write(&out.join("control_hands.csv"), &table::csv(&hands))?;
        write(&out.join("control_hands.svg"), &hands_picture(&hands))?;
    }
    output.say(
        || table::text(&hands).trim_end().to_owned(),
        || table::json(&hands),
    )
}
