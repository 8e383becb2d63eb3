//! `flexor playground`: opens the page with the simulator in a browser.

use super::Output;
use clap::Args;
use serde_json::json;
use std::path::PathBuf;

/// Open the playground: device, limb and charts in a browser
///
/// The page is one file beside the program, and contains the simulator. It needs no server and no network.
#[derive(Args, Debug)]
pub struct PlaygroundArgs {
    /// Print the path of the page instead of opening it
    #[arg(long)]
    path: bool,
}

/// Places of the page, from the program's folder: of a checkout's build, and of a release.
const PAGES: [&str; 2] = [
    "flexor-web/playground.html",
    "book/playground/playground.html",
];

/// # Errors
/// Fails if the page is not there, or no browser can be started.
pub fn main(args: &PlaygroundArgs, output: Output) -> anyhow::Result<()> {
    let page = find()?;
    if !args.path && !output.json {
        open::that_detached(&page).map_err(|why| {
            anyhow::anyhow!(
                "E574 no browser could be started: {why}; open this file in a browser: {}",
                page.display()
            )
        })?;
    }
    output.print(
        || page.display().to_string(),
        || json!({ "page": page, "error": null }),
    )
}

fn find() -> anyhow::Result<PathBuf> {
    let program = std::env::current_exe()?;
    let pages = PAGES.map(|page| program.with_file_name(page));
    let found = pages.iter().find(|page| page.is_file()).cloned();
    found.ok_or_else(|| {
        anyhow::anyhow!(
            "E579 the page is not built: there is no {}; `cargo verify playground` builds it in a \
             checkout, and an archive of a release contains it",
            pages[0].display()
        )
    })
}
