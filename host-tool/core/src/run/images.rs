//! Finds or builds the images that this program runs on simulators, and reports a build on standard
//! error.

use hal_sim::images::{self, BuildError, Image, Places};
use std::io::IsTerminal;
use std::path::{Path, PathBuf};

/// Root folder of the checkout from which this program was compiled; `None` for the program of a
/// release, which has its images beside it and does not depend on the folder of its build.
const WORKSPACE: Option<&str> = match option_env!("FLEXOR_RELEASE") {
    Some(_) => None,
    None => Some(concat!(env!("CARGO_MANIFEST_DIR"), "/../..")),
};

/// Returns the path of `image`: the file beside this program, or a file in its checkout, which is
/// built first if it is missing or older than its sources.
///
/// # Errors
/// Returns a [`BuildError`] if the image does not exist and cannot be built.
pub fn find(image: Image) -> Result<PathBuf, BuildError> {
    image.find(&places(), &mut build_listener(image.name()))
}

/// Returns the path of the CoreMark image, which is found or built as [`find`] does it.
///
/// # Errors
/// Returns a [`BuildError`] if the image does not exist and cannot be built.
pub fn find_coremark() -> Result<PathBuf, BuildError> {
    images::find_coremark(&places(), &mut build_listener("coremark"))
}

fn places() -> Places {
    let checkout = WORKSPACE.map(Path::new);
    let checkout = checkout.map(|path| path.canonicalize().unwrap_or(path.to_owned()));
    Places::for_this_program(checkout)
}

/// Returns a function that receives the output lines of a build. When a build of `image` starts it
/// prints a note, and then the lines of the build if standard error is a terminal. It prints
/// nothing if the image is up to date.
fn build_listener(image: &'static str) -> impl FnMut(&str) {
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
            eprintln!(
                "note: building the image `{image}`, which is needed once after each change of its \
                 sources"
            );
        }
        if is_told && is_shown {
            eprintln!("{line}");
        }
    }
}
