//! Finds and builds the device images that simulators run.
//!
//! In: the folders of the program and of the checkout. Out: the path of an image. Nothing is
//! printed: the caller receives the lines of cargo.

mod sum;

pub use sum::{SumError, sum, write_commit, write_sum};

use std::ffi::OsStr;
use std::io::{self, BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use thiserror::Error;

/// Name of the folder beside a program that holds its images.
pub const BESIDE: &str = "flexor-images";

/// Reason why an image is not available.
#[derive(Debug, Error)]
pub enum BuildError {
    /// The compiler reported an error.
    #[error("building the image `{image}` failed:\n{words}")]
    NotBuilt {
        /// Name of the image that failed.
        image: &'static str,
        /// Output of the compiler.
        words: String,
    },
    /// The build program could not be run.
    #[error(
        "the image `{image}` cannot be built, because {program} could not be run: {why}; install \
         cargo from https://rustup.rs"
    )]
    NoBuilder {
        /// Name of the image to build.
        image: &'static str,
        /// `cargo` or `sh`.
        program: String,
        /// Error that the system reported.
        why: io::Error,
    },
    /// The program is installed without its checkout, and the image is not beside it.
    #[error(
        "there is no image `{image}` beside this program, and it cannot be built without a \
         checkout of Flexor; copy flexor-images/{image} of a release to {wanted}, or set \
         FLEXOR_CHECKOUT to the folder of a checkout"
    )]
    Nowhere {
        /// Name of the missing image.
        image: &'static str,
        /// Path at which the image would be found.
        wanted: String,
    },
}

/// Folders that are searched for images: first the program's folder, then the checkout, where an
/// image is rebuilt if it is not newer than its sources.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Places {
    /// Folder of the running program.
    pub program: Option<PathBuf>,
    /// Root folder of the checkout with the sources.
    pub checkout: Option<PathBuf>,
}

impl Places {
    /// Returns the folders for the running program, which was compiled in `checkout`, if that is
    /// known. The environment variable FLEXOR_CHECKOUT overrides the checkout.
    #[must_use]
    pub fn for_this_program(checkout: Option<PathBuf>) -> Self {
        let program = std::env::current_exe().ok();
        let named = std::env::var_os("FLEXOR_CHECKOUT").map(PathBuf::from);
        Self {
            program: program.and_then(|program| program.parent().map(Path::to_owned)),
            checkout: named.or(checkout),
        }
    }

    /// Returns the path of image `name` beside the program, without a check of its age.
    fn find_beside_program(&self, name: &str) -> Option<PathBuf> {
        let path = self.program.as_ref()?.join(BESIDE).join(name);
        path.is_file().then_some(path)
    }

    /// Returns the folder of the checkout, or an error if it lacks the sources.
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

/// A device image: of the package `firmware`, or of the package `methods`, which contains
/// alternatives to the methods of the device.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Image {
    /// The image that is flashed on the board.
    Stimulator,
    /// The image for WeAct's core board as a breadboard.
    BreadboardWeact,
    /// The image for Adafruit's Feather as a breadboard.
    BreadboardFeather,
    /// The device code behind QEMU's serial port.
    Qemu,
    /// Benchmark: reports each algorithm's results and cycles over semihosting.
    Bench,
    /// Benchmark like [`Self::Bench`], for every alternative method of the device.
    Methods,
    /// The same program as [`Self::Methods`], compiled with optimisation level 3 and nothing else
    /// instead of the device's flags, with which some methods are much slower.
    MethodsLevel3,
    /// Benchmark like [`Self::Bench`], for every alternative control law of the device.
    Laws,
}

impl Image {
    /// Returns the name of the image, and of its file beside a program.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Stimulator => "stimulator",
            Self::BreadboardWeact => "breadboard-weact",
            Self::BreadboardFeather => "breadboard-feather",
            Self::Qemu => "qemu",
            Self::Bench => "bench",
            Self::Methods => "methods",
            Self::MethodsLevel3 => "methods-level-3",
            Self::Laws => "laws",
        }
    }

    const fn package(self) -> &'static str {
        match self {
            Self::Stimulator
            | Self::BreadboardWeact
            | Self::BreadboardFeather
            | Self::Qemu
            | Self::Bench => "firmware",
            Self::Methods | Self::MethodsLevel3 | Self::Laws => "methods",
        }
    }

    const fn feature(self) -> &'static str {
        match self {
            Self::Stimulator => "stm32f405",
            Self::BreadboardWeact => "weact",
            Self::BreadboardFeather => "feather",
            Self::Qemu => "qemu",
            Self::Bench | Self::Methods | Self::MethodsLevel3 | Self::Laws => "bench",
        }
    }

    /// Returns the name of the binary of its package.
    const fn binary(self) -> &'static str {
        match self {
            Self::MethodsLevel3 => Self::Methods.name(),
            image => image.name(),
        }
    }

    /// Returns the cargo command that builds the image in the workspace.
    #[must_use]
    pub fn command(self) -> String {
        format!(
            "cargo build --release --package {} --target thumbv7em-none-eabihf \
             --features {} --bin {}",
            self.package(),
            self.feature(),
            self.binary()
        )
    }

    /// Builds the image if it is not newer than its sources, and returns its path.
    ///
    /// # Errors
    /// Returns a [`BuildError`] with the compiler's output if the build fails.
    pub fn build(self, workspace: &Path) -> Result<PathBuf, BuildError> {
        self.build_with_output(workspace, &mut |_| ())
    }

    /// Returns the path of the image from the first of `places` that has it, and builds it if
    /// needed; passes cargo's lines to `tell`.
    ///
    /// # Errors
    /// Returns a [`BuildError`] if the image is neither found nor built.
    pub fn find(self, places: &Places, tell: &mut dyn FnMut(&str)) -> Result<PathBuf, BuildError> {
        match places.find_beside_program(self.name()) {
            Some(path) => Ok(path),
            None => self.build_with_output(places.sources(self.name())?, tell),
        }
    }

    /// Builds the image with `flags` for the compiler in place of the workspace's own, in the folder
    /// `target`, and returns its path.
    ///
    /// # Errors
    /// Returns a [`BuildError`] with the compiler's output if the build fails.
    pub fn build_with_flags(
        self,
        workspace: &Path,
        target: &Path,
        flags: &[String],
    ) -> Result<PathBuf, BuildError> {
        self.build_in(workspace, target, Some(flags), &mut |_| ())
    }

    fn build_with_output(
        self,
        workspace: &Path,
        tell: &mut dyn FnMut(&str),
    ) -> Result<PathBuf, BuildError> {
        let target = workspace.join("target");
        match self {
            Self::MethodsLevel3 => {
                let flags = ["-C".to_owned(), "opt-level=3".to_owned()];
                self.build_in(workspace, &target.join("level-3"), Some(&flags), tell)
            }
            _ => self.build_in(workspace, &target, None, tell),
        }
    }

    fn build_in(
        self,
        workspace: &Path,
        target: &Path,
        flags: Option<&[String]>,
        tell: &mut dyn FnMut(&str),
    ) -> Result<PathBuf, BuildError> {
        let line = self.command();
        let mut words = line.split_whitespace();
        let mut command = Command::new(words.next().unwrap_or_default());
        command
            .args(words)
            .arg("--target-dir")
            .arg(target)
            .current_dir(workspace);
        if let Some(flags) = flags {
            // Replaces the flags of .cargo/config.toml, to which the option --config would add.
            command.env("CARGO_ENCODED_RUSTFLAGS", flags.join("\u{1f}"));
        }
        run(command, self.name(), tell)?;
        let path = target
            .join("thumbv7em-none-eabihf/release")
            .join(self.binary());
        write_sum(&path).map_err(|why| BuildError::NotBuilt {
            image: self.name(),
            words: why.to_string(),
        })?;
        Ok(path)
    }
}

/// Builds CoreMark for the chip if it is not newer than its sources, and returns its path. This
/// reference benchmark has its own workspace (tests/coremark).
///
/// # Errors
/// Returns a [`BuildError`] with the compiler's output if the build fails.
pub fn coremark(workspace: &Path) -> Result<PathBuf, BuildError> {
    build_coremark(workspace, &mut |_| ())
}

/// Returns the path of the CoreMark image from the first of `places` that has it, and builds it if
/// needed; passes the build's lines to `tell`.
///
/// # Errors
/// Returns a [`BuildError`] if the image is neither found nor built.
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

/// Runs the command that builds `image`, and passes each line of its output to `tell` as it
/// arrives.
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

/// Returns whether `line` is a progress message of cargo, not an error.
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
