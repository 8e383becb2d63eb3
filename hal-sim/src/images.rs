//! The device images that simulators run, and how each is built.

use std::io;
use std::path::{Path, PathBuf};
use std::process::Command;
use thiserror::Error;

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
    #[error("cargo could not be run: {0}")]
    Io(#[from] io::Error),
}

/// An image of the `firmware` package.
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
            "cargo build --release --package firmware --target thumbv7em-none-eabihf \
             --features {} --bin {}",
            self.feature(),
            self.name()
        )
    }

    /// The image, built if it is not newer than its sources.
    ///
    /// # Errors
    /// [`BuildError::NotBuilt`] with the compiler's words.
    pub fn build(self, workspace: &Path) -> Result<PathBuf, BuildError> {
        let command = self.command();
        let mut words = command.split_whitespace();
        let output = Command::new(words.next().unwrap_or_default())
            .args(words)
            .args(["--quiet", "--target-dir"])
            .arg(workspace.join("target"))
            .current_dir(workspace)
            .output()?;
        if !output.status.success() {
            return Err(BuildError::NotBuilt {
                image: self.name(),
                words: String::from_utf8_lossy(&output.stderr).into_owned(),
            });
        }
        let folder = workspace.join("target/thumbv7em-none-eabihf/release");
        Ok(folder.join(self.name()))
    }
}

/// CoreMark for the chip, a yardstick in a workspace of its own
/// (tests/coremark), built if it is not newer than its sources.
///
/// # Errors
/// [`BuildError::NotBuilt`] with the compiler's words.
pub fn coremark(workspace: &Path) -> Result<PathBuf, BuildError> {
    let folder = workspace.join("tests/coremark");
    let output = Command::new("sh").arg(folder.join("build")).output()?;
    if !output.status.success() {
        return Err(BuildError::NotBuilt {
            image: "coremark",
            words: String::from_utf8_lossy(&output.stderr).into_owned(),
        });
    }
    Ok(folder.join("target/thumbv7em-none-eabihf/release/coremark"))
}
