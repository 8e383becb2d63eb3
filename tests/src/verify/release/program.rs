//! The program's archive for Linux, the program for Windows, and the device images.
//!
//! In: the working tree, the book. Out: in `dist` of Cargo's target folder
//! `flexor-VERSION-x86_64-linux.tar.gz`, `flexor-VERSION-images.tar.gz`,
//! `flexor-VERSION-x86_64-windows.zip` and `SHA256SUMS`. Two builds of one commit in two folders give
//! equal files: paths are removed from the programs, and archives have the commit's time.

use super::third_party;
use crate::verify::command::{execute, execute_with, without_folders};
use crate::verify::console::Console;
use crate::verify::image::{Image, TARGET as CHIP};
use crate::verify::python::environment::Interpreter;
use crate::verify::python::site::copy_folder;
use crate::verify::report::Report;
use crate::verify::{Workspace, book, playground, windows};
use anyhow::{Context, ensure};
use std::fs;
use std::path::{Path, PathBuf};

/// Images that the program needs, and whether they have a record that names the commit.
const IMAGES: [(&str, bool); 5] = [
    ("stimulator", true),
    ("breadboard-weact", true),
    ("breadboard-feather", true),
    ("qemu", false),
    ("bench", false),
];

/// Boards whose images are also written as raw binary and Intel HEX.
const BOARDS: [(&str, &str); 3] = [
    ("reference", "stimulator"),
    ("weact", "breadboard-weact"),
    ("feather", "breadboard-feather"),
];

/// Largest size of the program without its images, bytes.
const MAX_PROGRAM_BYTES: u64 = 20_000_000;

/// Text of README.txt in an archive.
const README: &str = "Flexor: an open ten-channel wearable muscle stimulator.\n\
    A research instrument, not a medical device. Simulation is no evidence about people.\n\n\
    \x20   ./flexor run reciprocal     runs a session on the simulator, and writes a report\n\
    \x20   ./flexor list               lists what else there is\n\
    \x20   ./flexor playground         opens the simulator in a browser\n\n\
    book/index.html is the book: a tutorial first, then guides, reference, how it works and\n\
    evidence. flexor-images has the device images for --device chip, qemu and flash; keep it\n\
    beside the program. `man -l man/flexor-run.1` shows a manual page; for completion in bash,\n\
    source completions/flexor.bash. A path docs/NAME.md in a message is book/NAME.html.\n\
    The Python package is not in this archive: it is the file flexor_stim-....whl of the same\n\
    release, for pip install.\n";

/// Packs files into a ZIP archive with a fixed time: archive, time (s), folder.
const ZIP: &str = "import os, sys, time, zipfile\n\
    out, epoch, folder = sys.argv[1], int(sys.argv[2]), sys.argv[3]\n\
    base = os.path.dirname(folder)\n\
    paths = sorted(os.path.join(d, f) for d, _, files in os.walk(folder) for f in files)\n\
    with zipfile.ZipFile(out, 'w', zipfile.ZIP_DEFLATED) as z:\n\
    \x20   for p in paths:\n\
    \x20       info = zipfile.ZipInfo(os.path.relpath(p, base), time.gmtime(epoch)[:6])\n\
    \x20       info.compress_type, info.external_attr = zipfile.ZIP_DEFLATED, 0o644 << 16\n\
    \x20       z.writestr(info, open(p, 'rb').read())\n";

/// Folders, version and commit of a release.
struct Builder<'a> {
    at: &'a Workspace,
    /// Folder of the archives.
    dist: PathBuf,
    /// Cargo's target folder for builds with other flags than the ordinary ones.
    build: PathBuf,
    version: String,
    commit: String,
    /// Time of the commit, s since 1970.
    epoch: String,
    /// Licences of the crates of other authors.
    licences: String,
}

/// Builds, packs and tries out everything.
pub(super) fn run(at: &Workspace, console: &mut Console) -> anyhow::Result<Report> {
    let builder = Builder::new(at, console)?;
    let mut report = Report::default();
    let changes = builder.git(console, &["status", "--porcelain"])?;
    if !changes.is_empty() {
        let note = "note: the tree has changes that are not committed; the release is of no commit";
        report.lines.push(note.to_owned());
    }
    let images = builder.images(console)?;
    let program = builder.program(console, None)?;
    let bytes = fs::metadata(&program)?.len();
    report.add(match bytes <= MAX_PROGRAM_BYTES {
        true => Report::pass(),
        false => Report::fail(vec![format!("the program has {bytes} bytes")]),
    });
    report
        .lines
        .push(format!("note: the program has {bytes} bytes"));
    let linux = builder.pack_linux(console, &program, &images)?;
    report.add(builder.try_out(console, &linux)?);
    builder.pack_images(console, &linux)?;
    report.add(builder.windows(console)?);
    report.add(builder.write_sums(console)?);
    Ok(report)
}

impl<'a> Builder<'a> {
    fn new(at: &'a Workspace, console: &mut Console) -> anyhow::Result<Self> {
        let dist = at.target.join("dist");
        let _ = fs::remove_dir_all(&dist);
        fs::create_dir_all(&dist)?;
        let mut builder = Self {
            at,
            dist,
            build: at.target.join("release-build"),
            version: version(&fs::read_to_string(at.root.join("Cargo.toml"))?)?,
            commit: String::new(),
            epoch: String::new(),
            licences: third_party::licences(at, console)?,
        };
        builder.commit = builder.git(console, &["rev-parse", "HEAD"])?;
        builder.epoch = builder.git(console, &["log", "-1", "--format=%ct"])?;
        Ok(builder)
    }

    fn git(&self, console: &mut Console, arguments: &[&str]) -> anyhow::Result<String> {
        let done = execute(self.at, console, "git", arguments)?;
        ensure!(done.success, "git {} failed", arguments.join(" "));
        Ok(done.lines.join("\n").trim().to_owned())
    }

    /// Runs a program that must succeed.
    fn must(
        &self,
        console: &mut Console,
        program: &str,
        arguments: &[&str],
        variables: &[(&str, &str)],
    ) -> anyhow::Result<Vec<String>> {
        let done = execute_with(self.at, console, program, arguments, variables)?;
        let failed = format!("{program} {}", arguments.join(" "));
        let end = done.lines.len().saturating_sub(15);
        let shown = done.lines.get(end..).unwrap_or_default().join("\n");
        ensure!(done.success, "`{failed}` failed:\n{shown}");
        Ok(done.lines)
    }

    /// Builds the images, and returns their paths.
    fn images(&self, console: &mut Console) -> anyhow::Result<Vec<PathBuf>> {
        let flags = without_folders(&self.at.root);
        let flags: Vec<String> = flags
            .split('\u{1f}')
            .map(|flag| format!("{flag:?}"))
            .collect();
        // Adds to the flags of .cargo/config.toml.
        let flags = format!("target.{CHIP}.rustflags=[{}]", flags.join(","));
        let target = self.build.to_string_lossy().into_owned();
        let mut paths = Vec::new();
        for image in Image::all(self.at)? {
            let Some((name, has_record)) = IMAGES.iter().find(|(name, _)| *name == image.name)
            else {
                continue;
            };
            let own = image.arguments("build");
            let more = ["--config", &flags, "--target-dir", &target];
            let words: Vec<&str> = own.iter().map(String::as_str).chain(more).collect();
            self.must(console, "cargo", &words, &[])?;
            let path = self.build.join(CHIP).join("release").join(name);
            let file = path.to_string_lossy();
            let sum = [
                "run",
                "--quiet",
                "-p",
                "hal-sim",
                "--bin",
                "image-sum",
                "--",
                &file,
            ];
            let commit = has_record.then_some(self.commit.as_str());
            let words: Vec<&str> = sum.into_iter().chain(commit).collect();
            self.must(console, "cargo", &words, &[])?;
            paths.push(path);
        }
        ensure!(paths.len() == IMAGES.len(), "{} images", paths.len());
        Ok(paths)
    }

    /// Builds the program for this computer or another target, and returns its path.
    fn program(&self, console: &mut Console, target: Option<&str>) -> anyhow::Result<PathBuf> {
        let folder = self.build.to_string_lossy().into_owned();
        let mut words = vec![
            "build",
            "--profile",
            "dist",
            "-p",
            "host-tool",
            "--bin",
            "flexor",
        ];
        words.extend(["--target-dir", &folder]);
        words.extend(target.iter().flat_map(|target| ["--target", target]));
        let flags = without_folders(&self.at.root);
        let variables = [
            ("FLEXOR_RELEASE", "1"),
            ("CARGO_ENCODED_RUSTFLAGS", &*flags),
        ];
        self.must(console, "cargo", &words, &variables)?;
        let folder = target.map_or_else(|| self.build.clone(), |target| self.build.join(target));
        let end = if target.is_some() { ".exe" } else { "" };
        Ok(folder.join("dist").join(format!("flexor{end}")))
    }

    /// Packs the program with its images, completions, manual pages, book and licences. Returns the
    /// folder that was packed.
    fn pack_linux(
        &self,
        console: &mut Console,
        program: &Path,
        images: &[PathBuf],
    ) -> anyhow::Result<PathBuf> {
        let folder = self
            .dist
            .join(format!("flexor-{}-x86_64-linux", self.version));
        for below in ["flexor-images", "completions", "man"] {
            fs::create_dir_all(folder.join(below))?;
        }
        fs::copy(program, folder.join("flexor"))?;
        for image in images {
            let name = image.file_name().context("an image has a name")?;
            fs::copy(image, folder.join("flexor-images").join(name))?;
        }
        let own = folder.join("flexor");
        let own = own.to_string_lossy();
        for (shell, file) in [
            ("bash", "flexor.bash"),
            ("zsh", "_flexor"),
            ("fish", "flexor.fish"),
        ] {
            let lines = self.must(console, &own, &["completion", shell], &[])?;
            fs::write(
                folder.join("completions").join(file),
                lines.join("\n") + "\n",
            )?;
        }
        let pages = folder.join("man");
        self.must(console, &own, &["man", &pages.to_string_lossy()], &[])?;
        let interpreter = Interpreter::obtain(self.at, console).map_err(anyhow::Error::msg)?;
        let tools = book::tools(self.at, console, &interpreter)?;
        // The book contains the page.
        let (page, _) = playground::build(self.at, console)?.map_err(anyhow::Error::msg)?;
        ensure!(
            page.failed == 0,
            "the page cannot be built: {:?}",
            page.lines
        );
        let (built, pages) = book::build(self.at, console, &tools)?;
        ensure!(built.failed == 0, "the book cannot be built");
        copy_folder(&pages, &folder.join("book"))?;
        self.copy_texts(&folder)?;
        self.tar(console, &folder)?;
        Ok(folder)
    }

    fn copy_texts(&self, folder: &Path) -> anyhow::Result<()> {
        for text in [
            "CHANGELOG.md",
            "LICENSE-APACHE",
            "LICENSE-MIT",
            "SECURITY.md",
        ] {
            fs::copy(self.at.root.join(text), folder.join(text)).context(text)?;
        }
        fs::write(folder.join("README.txt"), README)?;
        fs::write(folder.join("THIRD-PARTY.txt"), &self.licences)?;
        Ok(())
    }

    fn tar(&self, console: &mut Console, folder: &Path) -> anyhow::Result<()> {
        let name = folder.file_name().context("a folder has a name")?;
        let name = name.to_string_lossy();
        let command = format!(
            "cd '{}' && tar --sort=name --mtime=@{} --owner=0 --group=0 --numeric-owner \
             --mode=u=rwX,go=rX -cf - '{name}' | gzip -n -9 > '{name}.tar.gz'",
            self.dist.display(),
            self.epoch
        );
        self.must(console, "sh", &["-c", &command], &[])?;
        Ok(())
    }

    /// Unpacks the archive into an empty folder, and runs the program there without a checkout.
    fn try_out(&self, console: &mut Console, packed: &Path) -> anyhow::Result<Report> {
        let place = std::env::temp_dir().join(format!("flexor-release-{}", std::process::id()));
        let _ = fs::remove_dir_all(&place);
        fs::create_dir_all(place.join("empty"))?;
        let archive = format!("{}.tar.gz", packed.display());
        let into = place.to_string_lossy();
        self.must(console, "tar", &["-xzf", &archive, "-C", &into], &[])?;
        let name = packed.file_name().context("a folder has a name")?;
        let program = place.join(name).join("flexor");
        let mut report = Report::default();
        for line in [
            "run reciprocal",
            "run reciprocal --device chip --out chip",
            "rerun chip --out again",
            "image --board weact --hex weact.hex",
            "playground --path",
            "experiment hamana-1 --draws 1 --participant P --out study",
        ] {
            let words: Vec<&str> = line.split(' ').collect();
            let at = Workspace {
                root: place.join("empty"),
                target: self.at.target.clone(),
            };
            // No cargo, no checkout: only what a user without Rust has.
            let variables = [
                ("PATH", "/usr/bin:/bin"),
                ("FLEXOR_CHECKOUT", "/nonexistent"),
            ];
            let program = program.to_string_lossy();
            let done = execute_with(&at, console, &program, &words, &variables)?;
            report.add(done.report(&format!("flexor {line}, from the archive")));
        }
        fs::remove_dir_all(&place)?;
        Ok(report)
    }

    /// Packs the images as ELF, raw binary and Intel HEX.
    fn pack_images(&self, console: &mut Console, linux: &Path) -> anyhow::Result<()> {
        let folder = self.dist.join(format!("flexor-{}-images", self.version));
        fs::create_dir_all(&folder)?;
        let program = linux.join("flexor");
        for (board, image) in BOARDS {
            let file = |end: &str| folder.join(format!("{image}.{end}"));
            fs::copy(linux.join("flexor-images").join(image), file("elf"))?;
            let [bin, hex] = [file("bin"), file("hex")].map(|path| path.display().to_string());
            let words = ["image", "--board", board, "--bin", &bin, "--hex", &hex];
            self.must(console, &program.to_string_lossy(), &words, &[])?;
        }
        for text in ["LICENSE-APACHE", "LICENSE-MIT"] {
            fs::copy(self.at.root.join(text), folder.join(text))?;
        }
        self.tar(console, &folder)
    }

    /// Builds and packs the program for Windows; nothing here can run it.
    fn windows(&self, console: &mut Console) -> anyhow::Result<Report> {
        if let Some(lacking) = super::Release::lacks_windows(self.at, console)? {
            return Ok(lacking);
        }
        let program = self.program(console, Some(windows::TARGET))?;
        let name = format!("flexor-{}-x86_64-windows", self.version);
        let folder = self.dist.join(&name);
        fs::create_dir_all(&folder)?;
        fs::copy(program, folder.join("flexor.exe"))?;
        let note = "This program was built and never run on Windows.\r\n";
        fs::write(folder.join("NOT-TESTED.txt"), note)?;
        self.copy_texts(&folder)?;
        let archive = self.dist.join(format!("{name}.zip"));
        let (archive, folder) = (archive.to_string_lossy(), folder.to_string_lossy());
        let words = ["-c", ZIP, &archive, &self.epoch, &folder];
        self.must(console, "python3", &words, &[])?;
        let mut report = Report::pass();
        let note = format!("note: {name}.zip: built, never run on Windows");
        report.lines.push(note);
        Ok(report)
    }

    /// Writes the sums of all archives and wheels.
    fn write_sums(&self, console: &mut Console) -> anyhow::Result<Report> {
        let wheels = self.at.target.join("python/dist");
        if wheels.is_dir() {
            for entry in fs::read_dir(&wheels)? {
                let path = entry?.path();
                fs::copy(&path, self.dist.join(path.file_name().unwrap_or_default()))?;
            }
        }
        let command = format!(
            "cd '{}' && sha256sum $(ls -p | grep -v / | grep -v SHA256SUMS) > SHA256SUMS && \
             cat SHA256SUMS && ls -l",
            self.dist.display()
        );
        let lines = self.must(console, "sh", &["-c", &command], &[])?;
        let mut report = Report::pass();
        report
            .lines
            .extend(lines.into_iter().map(|line| format!("note: {line}")));
        Ok(report)
    }
}

/// Returns the version of the workspace.
fn version(manifest: &str) -> anyhow::Result<String> {
    let manifest: toml::Table = manifest.parse()?;
    let version = manifest["workspace"]["package"]["version"].as_str();
    Ok(version.context("the workspace has a version")?.to_owned())
}
