//! `flexor compare`: several records side by side.

use super::out::OutArgs;
use super::{Output, wrong};
use anyhow::Context;
use clap::Args;
use host_core::record::{Run, load};
use host_core::report::{self, Compared};
use std::path::{Path, PathBuf};

/// Set several records side by side: a table here, pictures on a page.
#[derive(Args, Debug)]
pub struct Compare {
    /// Folders of the records, two or more
    #[arg(required = true)]
    records: Vec<PathBuf>,
    #[command(flatten)]
    out: OutArgs,
}

/// # Errors
/// Fewer than two records, a folder that is none, one that the page would
/// replace, no room for the page.
pub fn main(args: &Compare, output: Output) -> anyhow::Result<()> {
    if args.records.len() < 2 {
        return wrong("compare needs two records or more");
    }
    args.out.apart_from(&args.records)?;
    let runs: Result<Vec<Run>, _> = args.records.iter().map(|dir| load(dir)).collect();
    let names = args.records.iter().map(|dir| dir.display().to_string());
    let all: Vec<Compared> = names
        .zip(runs?)
        .map(|(name, run)| Compared { name, run })
        .collect();
    let place = args.out.place("compare")?;
    let page = place.dir().join("compare.html");
    std::fs::write(&page, report::compare_page(&all))
        .with_context(|| format!("cannot write {}", page.display()))?;
    output.say(
        || format!("{}\npage: {}", report::compare_text(&all), page.display()),
        || {
            let rows = report::compare_rows(&all);
            let of = |compared: &Compared| compared.run.damaged(Path::new(&compared.name));
            let damaged: Vec<String> = all.iter().filter_map(of).map(|e| e.to_string()).collect();
            serde_json::json!({ "rows": rows, "page": page, "damaged": damaged, "error": null })
        },
    )
}
