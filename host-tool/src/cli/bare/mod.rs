//! `flexor chip`: runs any image on the simulated chip, without a board or a session.

mod report;
mod usb;

use super::{Bar, Incomplete, Output, interrupt, usage_error};
use anyhow::Context;
use clap::Args;
use hal_sim::chip::bare::{Bare, EarlyEnd};
use hal_sim::chip::cpu::Stop;
use hal_sim::chip::image::Image;
use hal_sim::chip::soc::gpio::PORTS;
use hal_sim::trace::Dump;
use host_core::link::Interruption;
use host_core::record::{RecordError, check_writable};
use report::Report;
use std::fs::File;
use std::io::{IsTerminal, Write};
use std::path::{Path, PathBuf};
use std::time::Duration;
use usb::Line;

/// Run any image for an STM32F405 on the chip simulator
///
/// Needs neither a board nor a session. The semihosting console of the image goes to the standard
/// output. Exit code 0: the image ran for the given time, or ended with status 0; 1: it stopped,
/// had a fault, or ended with another status.
#[derive(Args, Debug)]
pub struct BareArgs {
    /// Image (ELF)
    image: PathBuf,
    /// Device time to run, such as 500ms, 2s or 10us, up to 1 h; default: 1s, with --usb until
    /// Ctrl-C
    #[arg(long = "for", value_name = "TIME", value_parser = duration)]
    time: Option<Duration>,
    /// Write the levels of all pins, PA0 to PI15, to this file as VCD; --overwrite replaces an
    /// existing file
    #[arg(long, group = "replaced")]
    vcd: Option<PathBuf>,
    /// Replace an existing --vcd file
    #[arg(long, requires = "replaced")]
    overwrite: bool,
    /// Print the bytes that the image sends on USART2
    #[arg(long)]
    uart: bool,
    /// Provide the image's USB serial port in real time: at a socket of this computer
    /// (--usb=tcp:127.0.0.1:PORT; without a value at any free port), or as a pseudo-terminal
    /// (--usb=PATH)
    #[arg(long, value_name = "WHERE", num_args = 0..=1, require_equals = true,
          default_missing_value = "tcp:127.0.0.1:0")]
    usb: Option<String>,
}

/// Longest time that `--for` accepts.
const MOST: Duration = Duration::from_secs(3600);
/// Device time of a run with neither `--for` nor `--usb`.
const USUAL: Duration = Duration::from_secs(1);
/// Device time between two checks for signals, output and USB data, ns.
const STEP_NS: u64 = 1_000_000;

/// Parses a time with its unit: us, ms or s.
fn duration(text: &str) -> Result<Duration, String> {
    let digits = text.trim_end_matches(|c: char| c.is_ascii_alphabetic());
    let scale = match &text[digits.len()..] {
        "us" => 1e-6,
        "ms" => 1e-3,
        "s" => 1.0,
        _ => return Err("give a number with its unit us, ms or s, such as 500ms".to_owned()),
    };
    let seconds = digits.parse::<f64>().map_err(|why| why.to_string())? * scale;
    let allowed = 1e-6..=MOST.as_secs_f64();
    match allowed.contains(&seconds) {
        true => Ok(Duration::from_secs_f64(seconds)),
        false => Err("allowed: 1us to 3600s".to_owned()),
    }
}

/// The reason why a run failed.
#[derive(Debug, thiserror::Error)]
enum Failed {
    /// The core stopped.
    #[error("E558 {image} stopped on the simulated chip after {seconds:.6} s: {why}")]
    Stopped {
        image: String,
        seconds: f64,
        why: String,
    },
    /// The image hangs in the handler of a fault.
    #[error(
        "E559 {image} had a fault on the simulated chip after {seconds:.6} s and does not \
         leave the fault handler: {why}"
    )]
    Fault {
        image: String,
        seconds: f64,
        why: String,
    },
    /// The image ended with a status other than 0.
    #[error("E569 {image} exited with status {status}; 0 is success")]
    Status { image: String, status: u32 },
}

/// # Errors
/// Fails if the image cannot be loaded, a file cannot be written, the USB connection breaks, or the
/// image fails.
pub fn main(args: &BareArgs, output: Output) -> anyhow::Result<()> {
    let image = Image::open(&args.image)?;
    if let Some(vcd) = &args.vcd {
        check_writable(vcd, args.overwrite, &[&args.image], None)?;
    }
    let interruption = interrupt::catch_signals()?;
    let mut line = args.usb.as_deref().map(Line::open).transpose()?;
    if let Some(line) = &line {
        // Printed before the simulation starts, so that a program can read the address as the first
        // object.
        output.print(
            || format!("USB port of the image: {}; end with Ctrl-C", line.place()),
            || serde_json::json!({ "usb_at": line.place() }),
        )?;
    }
    let bare = Bare::power_on(image, line.is_some());
    let mut bare = bare.map_err(|stop| stopped_error(&args.image, 0, &stop.to_string()))?;
    let mut run = Run::begin(args, &bare, output)?;
    let until = match (args.time, &line) {
        (Some(time), _) => time.as_nanos() as u64, // at most 1 h, so the value fits
        (None, None) => USUAL.as_nanos() as u64,
        (None, Some(_)) => u64::MAX,
    };
    let ended = run.run_until(&mut bare, line.as_mut(), until, &interruption);
    let ended = ended.and_then(|ended| run.finish(&mut bare).map(|()| ended))?;
    let report = Report::new(&bare, &ended, &run.heard);
    let error = match ended {
        RunEnd::Time => None,
        RunEnd::Signal(signal) => {
            let words = format!("after {:.3} s of device time", bare.now_ns() as f64 * 1e-9);
            Some(interrupt::EndedBySignal(signal, words).into())
        }
        RunEnd::Itself(ending) => failure(&args.image, &bare, ending),
    };
    match error {
        None => output.print(|| report.to_text(), || report.to_json()),
        Some(error) if output.json => Err(Incomplete {
            error,
            result: report.to_json(),
        }
        .into()),
        Some(error) => {
            output.print(|| report.to_text(), || report.to_json())?;
            Err(error)
        }
    }
}

/// What ended a run, as a success or as a failure.
#[derive(Clone, Copy, Debug)]
enum RunEnd {
    /// The requested device time has passed.
    Time,
    /// A signal ended the program.
    Signal(host_core::link::Signal),
    /// The image ended by itself.
    Itself(EarlyEnd),
}

fn stopped_error(image: &Path, ns: u64, why: &str) -> anyhow::Error {
    Failed::Stopped {
        image: image.display().to_string(),
        seconds: ns as f64 * 1e-9,
        why: why.to_owned(),
    }
    .into()
}

/// Returns the error of an image that ended with `ending`; `None` for a success.
fn failure(image: &Path, bare: &Bare, ending: EarlyEnd) -> Option<anyhow::Error> {
    let symbols = &bare.image().symbols;
    let fault = bare.faults().last();
    match ending {
        EarlyEnd::Exit(0) => None,
        EarlyEnd::Exit(status) => {
            let image = image.display().to_string();
            Some(Failed::Status { image, status }.into())
        }
        EarlyEnd::InHandler => Some(
            Failed::Fault {
                image: image.display().to_string(),
                seconds: fault.map_or(0, |fault| fault.ns) as f64 * 1e-9,
                why: fault.map_or_else(String::new, |fault| fault.describe(symbols)),
            }
            .into(),
        ),
        EarlyEnd::Stopped(stop) => {
            let (_, function) = bare.location();
            let is_lock_up = matches!(stop, Stop::LockUp { .. });
            let why = match fault.filter(|_| is_lock_up || bare.is_in_handler()) {
                Some(fault) => format!("{stop}, after {}", fault.describe(symbols)),
                None => format!("{stop} (in {function})"),
            };
            Some(stopped_error(image, bare.now_ns(), &why))
        }
    }
}

/// Run in progress, with everything to which its output goes.
struct Run<'a> {
    args: &'a BareArgs,
    output: Output,
    dump: Option<Dump<File>>,
    /// Printed output of the image: all of it for `--json`; otherwise only whether its last line
    /// lacks a line break.
    heard: ProgramOutput,
    bar: Option<Bar>,
}

/// Bytes that the image has printed so far.
#[derive(Debug, Default)]
struct ProgramOutput {
    console: Vec<u8>,
    uart: Vec<u8>,
    /// Whether the printed text does not end with a line break.
    is_open: bool,
}

impl<'a> Run<'a> {
    fn begin(args: &'a BareArgs, bare: &Bare, output: Output) -> anyhow::Result<Self> {
        let dump = args.vcd.as_deref().map(|path| {
            let names: Vec<(String, bool)> = (0..PORTS)
                .flat_map(|port| (0..16).map(move |pin| (port, pin)))
                .map(|(port, pin)| (pin_name(port, pin), bare.wires.level(port, pin)))
                .collect();
            let lines = names.iter().map(|(name, high)| (name.as_str(), *high));
            File::create(path)
                .and_then(|file| Dump::begin(file, lines))
                .map_err(RecordError::write(path))
        });
        // A progress bar only if nothing else is printed on the terminal.
        let is_quiet = !args.uart && args.usb.is_none();
        Ok(Self {
            args,
            output,
            dump: dump.transpose()?,
            heard: ProgramOutput::default(),
            bar: is_quiet.then(|| output.bar(&args.image.display().to_string())),
        })
    }

    /// Runs until `until` (device time, ns) or until the run ends earlier.
    fn run_until(
        &mut self,
        bare: &mut Bare,
        mut line: Option<&mut Line>,
        until: u64,
        interruption: &Interruption,
    ) -> anyhow::Result<RunEnd> {
        let mut end = 0;
        while end < until {
            if let Some(signal) = interruption.received_signal() {
                return Ok(RunEnd::Signal(signal));
            }
            end = end.saturating_add(STEP_NS).min(until);
            let ended = bare.run_to(end);
            if let Some(line) = line.as_deref_mut() {
                line.serve(bare)?;
            }
            self.drain_output(bare)?;
            if let Err(ending) = ended {
                return Ok(RunEnd::Itself(ending));
            }
            if let Some(bar) = &self.bar {
                bar.set(end as f64 / until as f64);
            }
        }
        Ok(RunEnd::Time)
    }

    /// Prints the output since the last call and writes its edges to the VCD file.
    fn drain_output(&mut self, bare: &mut Bare) -> anyhow::Result<()> {
        let (console, uart) = (bare.console(), bare.wires.serial());
        let uart = if self.args.uart { uart } else { Vec::new() };
        if self.output.json {
            self.heard.console.extend(&console);
            self.heard.uart.extend(&uart);
        } else {
            self.print(&[console, uart].concat())?;
        }
        let edges: Vec<_> = bare.wires.edges().collect();
        if let (Some(dump), Some(path)) = (&mut self.dump, &self.args.vcd) {
            for edge in edges {
                for pin in (0..16).filter(|pin| edge.changed >> pin & 1 != 0) {
                    let high = edge.levels >> pin & 1 != 0;
                    let done = dump.change(edge.ns, 16 * edge.port + pin, high);
                    done.map_err(RecordError::write(path))?;
                }
            }
        }
        Ok(())
    }

    /// Prints bytes unchanged; on a terminal, replaces control characters.
    fn print(&mut self, bytes: &[u8]) -> anyhow::Result<()> {
        let Some(last) = bytes.last() else {
            return Ok(());
        };
        self.heard.is_open = *last != b'\n';
        let mut out = std::io::stdout().lock();
        let text = match std::io::stdout().is_terminal() {
            true => super::printable(&String::from_utf8_lossy(bytes)).into_bytes(),
            false => bytes.to_vec(),
        };
        match out.write_all(&text).and_then(|()| out.flush()) {
            Err(error) if error.kind() != std::io::ErrorKind::BrokenPipe => {
                Err(error).context("E523 cannot write to the standard output; check where it goes")
            }
            _ => Ok(()),
        }
    }

    /// Prints the remaining output and ends the VCD file.
    fn finish(&mut self, bare: &mut Bare) -> anyhow::Result<()> {
        self.drain_output(bare)?;
        if let Some(bar) = &self.bar {
            bar.finish();
        }
        if self.heard.is_open {
            self.print(b"\n")?;
        }
        if let (Some(dump), Some(path)) = (self.dump.take(), &self.args.vcd) {
            dump.end(bare.now_ns()).map_err(RecordError::write(path))?;
        }
        Ok(())
    }
}

/// Returns the name of a pin; `port` is 0 to 8 for A to I, as in PA0.
fn pin_name(port: usize, pin: usize) -> String {
    let letter = ["A", "B", "C", "D", "E", "F", "G", "H", "I"].get(port);
    format!("P{}{pin}", letter.unwrap_or(&"?"))
}
