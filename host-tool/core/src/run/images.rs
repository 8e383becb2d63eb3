//! The images that this program runs on simulators, found or built with a word
//! about it on standard error.

use hal_sim::images::{self, BuildError, Image, Places};
use std::io::IsTerminal;
use std::path::{Path, PathBuf};

/// The sources that this program was compiled from.
const WORKSPACE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");

/// Where `image` is: beside this program, or in its checkout, built if it is not
/// newer than its sources.
///
/// # Errors
/// [`BuildError`].
pub fn find(image: Image) -> Result<PathBuf, BuildError> {
    image.find(&places(), &mut teller(image.name()))
}

/// Where CoreMark's image is; see [`find`].
///
/// # Errors
/// [`BuildError`].
pub fn find_coremark() -> Result<PathBuf, BuildError> {
    images::find_coremark(&places(), &mut teller("coremark"))
}

fn places() -> Places {
    let checkout = Path::new(WORKSPACE);
    Places::of_this_program(&checkout.canonicalize().unwrap_or(checkout.to_owned()))
}

/// Says once that `image` is being built, and shows the build on a terminal. An
/// image that is current is built without a word.
fn teller(image: &'static str) -> impl FnMut(&str) {
    let is_shown = std::io::stderr().is_terminal();
    let mut is_told = false;
    move |line| {
        let begins = ["Compiling ", "Blocking ", "Download", "Updating "];
        if !is_told
            && begins
                .iter()
                .any(|verb| line.trim_start().starts_with(verb))
        {
            is_told = true;
            eprintln!("note: building the image `{image}`, once after each change of its sources");
        }
        if is_told && is_shown {
            eprintln!("{line}");
        }
    }
}
