//! The command line: arguments in, one room per command, exit codes out.

mod muscle;

use clap::{Parser, Subcommand};
use std::process::ExitCode;

/// An open ten-channel wearable muscle stimulator: run sessions on a simulated
/// or a real board.
#[derive(Parser, Debug)]
#[command(name = "flexor", version)]
struct Cli {
    /// Print results as JSON, for machines
    #[arg(long, global = true)]
    json: bool,
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand, Debug)]
enum Command {
    Muscle(muscle::Muscle),
}

/// How results are told.
#[derive(Clone, Copy, Debug)]
pub struct Output {
    json: bool,
}

impl Output {
    /// Prints a result for people or for machines.
    pub fn say(
        self,
        people: impl FnOnce() -> String,
        machines: impl FnOnce() -> serde_json::Value,
    ) {
        if self.json {
            println!("{}", machines());
        } else {
            println!("{}", people());
        }
    }
}

/// Parses the command line and runs it. Exit code 0: done, 1: failed, 2: wrong
/// use.
#[must_use]
pub fn main() -> ExitCode {
    let cli = Cli::parse();
    let output = Output { json: cli.json };
    let result = match &cli.command {
        Command::Muscle(args) => muscle::run(args, output),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            if output.json {
                println!("{}", serde_json::json!({ "error": format!("{error:#}") }));
            }
            eprintln!("error: {error:#}");
            ExitCode::FAILURE
        }
    }
}
