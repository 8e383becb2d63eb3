//! The device images that simulators run: where they are found, and how each is
//! built.
//!
//! In: the program's and the checkout's places. Out: an image's path. Nothing is
//! printed: who asks hears cargo's lines.

mod sum;

pub use sum::{SumError, sum, write_sum};

use std::ffi::OsStr;
use std::io::{self, BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use thiserror::Error;

/// Folder beside a program for images that go with it.
pub const BESIDE: &str = "flexor-images";

/// Why there is no image.
#[derive(Debug, Error)]
pub enum BuildError {
    /// The compiler said no.
    #[error("the image `{image}` was not built:\n{words}")]
    NotBuilt {
        /// Name of the image.
        image: &'static str,
        /// The compiler's words.
        words: String,
    },
    /// Cargo could not be run.
    #[error(
        "the image `{image}` is built by {program}, which could not be run: {why}; get cargo from \
         https://rustup.rs"
    )]
    NoBuilder {
        /// Name of the image.
        image: &'static str,
        /// `cargo` or `sh`.
        program: String,
        /// What the system said.
        why: io::Error,
    },
    /// A program away from its checkout.
    #[error(
        "there is no image `{image}`: it is neither beside this program nor can it be built, for \
         there is no checkout; copy target/thumbv7em-none-eabihf/release/{image} of one to \
         {wanted}, or set FLEXOR_CHECKOUT to its folder"
    )]
    Nowhere {
        /// Name of the image.
        image: &'static str,
        /// Where it would be found.
        wanted: String,
    },
}

/// Where images are looked for: beside the program, then in the checkout, where
/// they are built if they are not newer than their sources.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Places {
    /// The program's own folder.
    pub program: Option<PathBuf>,
    /// The sources.
    pub checkout: Option<PathBuf>,
}

impl Places {
    /// Of the program that runs, compiled in `checkout`. The environment's
    /// FLEXOR_CHECKOUT names another one.
    #[must_use]
    pub fn for_this_program(checkout: &Path) -> Self {
        let program = std::env::current_exe().ok();
        let named = std::env::var_os("FLEXOR_CHECKOUT").map(PathBuf::from);
        Self {
            program: program.and_then(|program| program.parent().map(Path::to_owned)),
            checkout: Some(named.unwrap_or_else(|| checkout.to_owned())),
        }
    }

    /// The image `name` beside the program, taken as it is.
    fn find_beside_program(&self, name: &str) -> Option<PathBuf> {
        let path = self.program.as_ref()?.join(BESIDE).join(name);
        path.is_file().then_some(path)
    }

    /// The checkout, if its sources are there.
    fn sources(&self, image: &'static str) -> Result<&Path, BuildError> {
        let checkout = self.checkout.as_deref();
        let found = checkout.filter(|folder| folder.join("firmware/Cargo.toml").is_file());
        found.ok_or_else(|| {
            let folder = self.program.as_deref().unwrap_or(Path::new("."));
            let wanted = folder.join(BESIDE).join(image).display().to_string();
            BuildError::Nowhere { image, wanted }
        })
    }
}

/// An image of the `firmware` package, or of the `methods` it is compared with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Image {
    /// What is flashed on the board.
    Stimulator,
    /// The device code behind QEMU's serial port.
    Qemu,
    /// Each algorithm's results and cycles, over semihosting.
    Bench,
    /// The same for every method that the device could have used.
    Methods,
    /// The same for every control law that the device could have used.
    Laws,
}

impl Image {
    /// Name of the program.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Stimulator => "stimulator",
            Self::Qemu => "qemu",
            Self::Bench => "bench",
            Self::Methods => "methods",
            Self::Laws => "laws",
        }
    }

    const fn package(self) -> &'static str {
        match self {
            Self::Stimulator | Self::Qemu | Self::Bench => "firmware",
            Self::Methods | Self::Laws => "methods",
        }
    }

    const fn feature(self) -> &'static str {
        match self {
            Self::Stimulator => "stm32f405",
            Self::Qemu => "qemu",
            Self::Bench | Self::Methods | Self::Laws => "bench",
        }
    }

    /// What builds it, in the workspace.
    #[must_use]
    pub fn command(self) -> String {
        format!(
            "cargo build --release --package {} --target thumbv7em-none-eabihf \
             --features {} --bin {}",
            self.package(),
            self.feature(),
            self.name()
        )
    }

    /// The image, built if it is not newer than its sources.
    ///
    /// # Errors
    /// [`BuildError`], with the compiler's words.
    pub fn build(self, workspace: &Path) -> Result<PathBuf, BuildError> {
        self.build_with_output(workspace, &mut |_| ())
    }

    /// The image from the first of `places` that has it; `tell` hears cargo's
    /// lines.
    ///
    /// # Errors
    /// [`BuildError`].
    pub fn find(self, places: &Places, tell: &mut dyn FnMut(&str)) -> Result<PathBuf, BuildError> {
        match places.find_beside_program(self.name()) {
            Some(path) => Ok(path),
            None => self.build_with_output(places.sources(self.name())?, tell),
        }
    }

    fn build_with_output(
        self,
        workspace: &Path,
        tell: &mut dyn FnMut(&str),
    ) -> Result<PathBuf, BuildError> {
        let line = self.command();
        let mut words = line.split_whitespace();
        let mut command = Command::new(words.next().unwrap_or_default());
        command
            .args(words)
            .arg("--target-dir")
            .arg(workspace.join("target"))
            .current_dir(workspace);
        run(command, self.name(), tell)?;
        let folder = workspace.join("target/thumbv7em-none-eabihf/release");
        let path = folder.join(self.name());
        write_sum(&path).map_err(|why| BuildError::NotBuilt {
            image: self.name(),
            words: why.to_string(),
        })?;
        Ok(path)
    }
}

/// CoreMark for the chip, a yardstick in a workspace of its own
/// (tests/coremark), built if it is not newer than its sources.
///
/// # Errors
/// [`BuildError`], with the compiler's words.
pub fn coremark(workspace: &Path) -> Result<PathBuf, BuildError> {
    build_coremark(workspace, &mut |_| ())
}

/// [`coremark`] from the first of `places` that has it.
///
/// # Errors
/// [`BuildError`].
pub fn find_coremark(places: &Places, tell: &mut dyn FnMut(&str)) -> Result<PathBuf, BuildError> {
    match places.find_beside_program(COREMARK) {
        Some(path) => Ok(path),
        None => build_coremark(places.sources(COREMARK)?, tell),
    }
}

const COREMARK: &str = "coremark";

fn build_coremark(workspace: &Path, tell: &mut dyn FnMut(&str)) -> Result<PathBuf, BuildError> {
    let folder = workspace.join("tests/coremark");
    let mut command = Command::new("sh");
    command.arg(folder.join("build"));
    run(command, COREMARK, tell)?;
    Ok(folder.join("target/thumbv7em-none-eabihf/release/coremark"))
}

/// Runs what builds `image`; `tell` hears each line as it comes.
fn run(
    mut command: Command,
    image: &'static str,
    tell: &mut dyn FnMut(&str),
) -> Result<(), BuildError> {
    let program = OsStr::to_string_lossy(command.get_program()).into_owned();
    let failed = |why| BuildError::NoBuilder {
        image,
        program: program.clone(),
        why,
    };
    command.stdin(Stdio::null()).stdout(Stdio::null());
    let mut child = command.stderr(Stdio::piped()).spawn().map_err(failed)?;
    let mut words = String::new();
    if let Some(stderr) = child.stderr.take() {
        for line in BufReader::new(stderr).split(b'\n') {
            let line = line.map_err(failed)?;
            let line = String::from_utf8_lossy(&line);
            tell(&line);
            if !is_progress(&line) {
                words.push_str(&line);
                words.push('\n');
            }
        }
    }
    if child.wait().map_err(failed)?.success() {
        Ok(())
    } else {
        Err(BuildError::NotBuilt { image, words })
    }
}

/// Whether cargo says in `line` what it does, not what is wrong.
fn is_progress(line: &str) -> bool {
    let line = line.trim_start();
    let verbs = [
        "Compiling ",
        "Finished ",
        "Blocking ",
        "Download",
        "Updating ",
    ];
    verbs.iter().any(|verb| line.starts_with(verb))
}
