//! `flexor completion` and `flexor man`: shell completion scripts and manual pages.

use super::{Output, commands, print_line};
use clap::Args;
use clap_complete::Shell;
use host_core::record::RecordError;
use std::path::PathBuf;

/// Print the completion script of a shell
///
/// For bash: flexor completion bash > ~/.local/share/bash-completion/completions/flexor
#[derive(Args, Debug)]
pub struct Completion {
    shell: Shell,
}

/// Write a manual page for each command into a folder
#[derive(Args, Debug)]
pub struct Man {
    /// Folder for flexor.1, flexor-run.1 and so on; created if it is absent
    folder: PathBuf,
}

/// # Errors
/// Fails if the standard output cannot be written.
pub fn main(args: &Completion, output: Output) -> anyhow::Result<()> {
    let mut script = Vec::new();
    clap_complete::generate(
        args.shell,
        &mut commands::command_line(),
        "flexor",
        &mut script,
    );
    let script = String::from_utf8_lossy(&script).into_owned();
    match output.json {
        true => output.print(String::new, || serde_json::json!({ "script": script })),
        // Printed unchanged: a script may hold characters that [`super::printable`] would replace.
        false => print_line(script.trim_end()),
    }
}

/// # Errors
/// Fails if the folder cannot be written.
pub fn manual(args: &Man, output: Output) -> anyhow::Result<()> {
    let folder = &args.folder;
    let written = std::fs::create_dir_all(folder)
        .and_then(|()| clap_mangen::generate_to(commands::command_line(), folder));
    written.map_err(RecordError::io(folder))?;
    output.print(
        || {
            format!(
                "manual pages are in {0}; read one: man {0}/flexor.1",
                folder.display()
            )
        },
        || serde_json::json!({ "folder": folder, "error": null }),
    )
}
