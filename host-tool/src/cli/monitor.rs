//! `flexor monitor`: shows a device or a running session live on the terminal.

use super::perform::SEED;
use super::{Output, interrupt, usage_error};
use crate::live::{
    Model, Order, Plan, Shared, run_plan, run_screen, status_json, status_text, write_lines,
};
use clap::error::ErrorKind;
use clap::{Args, CommandFactory};
use host_core::run::{DeviceName, SessionFile};
use std::io::IsTerminal;
use std::path::PathBuf;
use std::time::{Duration, Instant};

/// Watch a device, or run a session and watch it
///
/// Without a terminal, prints one line per second.
#[derive(Args, Debug)]
pub struct Monitor {
    /// Device: native, chip, a serial port, or tcp:HOST:PORT
    #[arg(long, default_value = "native")]
    device: DeviceName,
    /// Session file (TOML) to run; without it nothing is stimulated
    #[arg(long)]
    session: Option<PathBuf>,
    /// Stop and quit after this many seconds; default: at the session's end, or on q
    #[arg(long)]
    seconds: Option<f64>,
    /// Seed of a wearer that this program simulates; default: 1
    #[arg(long)]
    seed: Option<u64>,
}

/// When dropped, orders the thread at the device to quit, however the terminal's thread ends.
struct QuitAtEnd<'a>(&'a Shared);

impl Drop for QuitAtEnd<'_> {
    fn drop(&mut self) {
        self.0.order(Order::Quit);
    }
}

/// # Errors
/// Fails if the session file, the device or the terminal cannot be used, or the session ends early.
pub fn main(args: &Monitor, output: Output) -> anyhow::Result<()> {
    if args.device.is_port() && args.seed.is_some() {
        return usage_error(
            "--seed needs --device native or chip: a device behind a port has its own seed",
        );
    }
    let session = match &args.session {
        Some(path) => {
            let mut file = SessionFile::load(path)?;
            output.settle_models(&mut file.session)?;
            Some(file)
        }
        None => None,
    };
    if session.is_none()
        && matches!(
            args.device,
            DeviceName::Native | DeviceName::Chip | DeviceName::Qemu
        )
    {
        let why = format!(
            "{} does nothing without a session; give --session SESSION.toml, or --device with a \
             board's port",
            args.device
        );
        let mut command = super::Cli::command();
        command
            .error(ErrorKind::MissingRequiredArgument, why)
            .exit();
    }
    let is_screen = std::io::stdout().is_terminal() && !output.json;
    let interruption = interrupt::catch_signals()?;
    let model = Model::new(&args.device.to_string(), session.as_ref());
    let shared = Shared::new(model, interruption.clone());
    let plan = Plan {
        device: args.device.clone(),
        session,
        stays: is_screen,
        seed: args.seed.unwrap_or(SEED),
    };
    let must_quit = quit_condition(args.seconds)?;
    let (shown, worked) = std::thread::scope(|scope| {
        let _quit = QuitAtEnd(&shared);
        let worker = scope.spawn(|| run_plan(&plan, &shared));
        let is_over = || worker.is_finished();
        let shown = if is_screen {
            run_screen(&shared, is_over, must_quit)
        } else {
            let describe = if output.json {
                |model: &Model, reported_notes| status_json(model, reported_notes).to_string()
            } else {
                status_text
            };
            write_lines(
                &shared,
                &mut std::io::stdout(),
                describe,
                is_over,
                must_quit,
            )
        };
        shared.order(Order::Quit);
        (shown, worker.join())
    });
    worked.unwrap_or_else(|panic| std::panic::resume_unwind(panic))?;
    match interruption.received_signal() {
        Some(signal) => {
            let ended = match args.session {
                Some(_) => "after the session had ended; it no longer stimulates",
                None => "while the device was watched; the monitor stimulated nothing",
            };
            Err(interrupt::EndedBySignal(signal, ended.to_owned()).into())
        }
        None => Ok(shown?),
    }
}

/// Returns a function that tells whether `seconds` have passed; without `seconds`, never. A signal
/// ends the thread at the device instead.
fn quit_condition(seconds: Option<f64>) -> anyhow::Result<impl Fn() -> bool> {
    let start = Instant::now();
    let length = seconds.map(Duration::try_from_secs_f64).transpose()?;
    Ok(move || length.is_some_and(|length| start.elapsed() >= length))
}
