//! `flexor serve`: a simulated board for any client, in real time.

use super::Output;
use crate::run::{DeviceName, SessionFile, simulated_for_serving};
use anyhow::{Context, bail};
use clap::{ArgGroup, Args};
use firmware::link::{Code, Refusal, Response, encode};
use hal_sim::wire::{ByteStream, pty::PtyWire, tcp::TcpWire};
use std::path::PathBuf;
use std::time::{Duration, Instant};

/// Serve a simulated board on a pseudo-terminal or a socket.
#[derive(Args, Debug)]
#[command(group(ArgGroup::new("wire").required(true).args(["pty", "tcp"])))]
pub struct Serve {
    /// The simulator: native
    #[arg(long, default_value = "native")]
    device: DeviceName,
    /// Path of a pseudo-terminal to create
    #[arg(long)]
    pty: Option<PathBuf>,
    /// Address to listen at, HOST:PORT
    #[arg(long)]
    tcp: Option<String>,
    /// Session file whose body is simulated; default: participant P's finger
    #[arg(long)]
    body: Option<PathBuf>,
    /// Seed of the simulated wearer
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Stop after this many seconds; default: never
    #[arg(long)]
    seconds: Option<f64>,
}

/// How often bytes are carried and time goes on.
const POLL: Duration = Duration::from_micros(500);

/// Runs the command until interrupted.
///
/// # Errors
/// The wire cannot be opened.
pub fn main(args: &Serve, output: Output) -> anyhow::Result<()> {
    if args.device != DeviceName::Native {
        bail!(
            "E515 only the native simulator can be served; {} is not served yet",
            args.device
        );
    }
    let text = include_str!("../../sessions/hamana_exp4_two_point.toml");
    let session = match &args.body {
        Some(path) => SessionFile::load(path)?,
        None => SessionFile::parse("hamana_exp4_two_point.toml", text)?,
    };
    let mut world = simulated_for_serving(&session.session, args.seed)?;
    let (mut wire, place): (Box<dyn ByteStream>, String) = match (&args.pty, &args.tcp) {
        (Some(path), _) => {
            let wire = PtyWire::open(path)
                .with_context(|| format!("cannot open a pseudo-terminal at {}", path.display()))?;
            (Box::new(wire), path.display().to_string())
        }
        (None, Some(address)) => {
            let wire = TcpWire::bind(address.as_str(), busy())
                .with_context(|| format!("cannot listen at {address}"))?;
            let place = format!("tcp:{}", wire.local_addr()?);
            (Box::new(wire), place)
        }
        (None, None) => bail!("give --pty PATH or --tcp HOST:PORT"),
    };
    output.say(
        || format!("a simulated board is at {place}; end with Ctrl-C"),
        || serde_json::json!({ "device": "native", "at": place }),
    );
    let (start, origin) = (Instant::now(), world.now_us());
    let mut buffer = [0; 4096];
    while args
        .seconds
        .is_none_or(|s| start.elapsed().as_secs_f64() < s)
    {
        let elapsed = u64::try_from(start.elapsed().as_micros()).unwrap_or(u64::MAX);
        world.run_until(origin.saturating_add(elapsed))?;
        for bytes in world.received().collect::<Vec<_>>() {
            wire.write_all(&bytes)?;
        }
        match wire.read(&mut buffer)? {
            0 => std::thread::sleep(POLL),
            count => world.send(&buffer[..count]),
        }
        world.recorder.forget();
    }
    Ok(())
}

/// What a second client is told.
fn busy() -> Vec<u8> {
    let refusal = Refusal::new(Code::SessionTaken, "connection");
    encode(&Response::Refused { seq: None, refusal })
        .map(|frame| frame.to_vec())
        .unwrap_or_default()
}
