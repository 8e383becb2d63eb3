//! `flexor serve`: simulates a board in real time for any client.

mod pace;
mod trace;

use super::chip::ChipArgs;
use super::{Output, interrupt, usage_error};
use anyhow::{Context, bail};
use clap::{ArgGroup, Args};
use firmware::link::{Code, Refusal, Response, encode};
use hal_sim::chip::gdb::AfterDebugger;
#[cfg(unix)]
use hal_sim::wire::pty::PtyWire;
use hal_sim::wire::{ByteStream, tcp::TcpWire};
use host_core::link::Port;
use host_core::record::{DeviceKind, RecordError, check_writable};
use host_core::run::{DeviceName, SessionFile};
use pace::Pace;
use std::net::{SocketAddr, ToSocketAddrs};
use std::path::PathBuf;
use std::time::{Duration, Instant};
use trace::TraceFile;

/// Serve a simulated board on a pseudo-terminal or a socket
#[derive(Args, Debug)]
#[command(group(ArgGroup::new("wire").required(true).args(["pty", "tcp"])))]
pub struct Serve {
    /// Simulator: native or chip
    #[arg(long, default_value = "native")]
    device: DeviceName,
    /// Path of a link to a pseudo-terminal to create; replaces only the link of a `serve` that
    /// crashed
    #[arg(long)]
    pty: Option<PathBuf>,
    /// Address to listen at, HOST:PORT
    #[arg(long)]
    tcp: Option<String>,
    /// Let --tcp listen beyond this computer; anyone who can connect then controls the device
    #[arg(long, requires = "tcp")]
    open_to_network: bool,
    /// Session file whose simulated limb and (chip) output stages are used; default: the finger of
    /// participant P with two-point stimulation
    #[arg(long)]
    body: Option<PathBuf>,
    /// Seed of the simulated wearer
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Stop after this many seconds; default: never
    #[arg(long)]
    seconds: Option<f64>,
    /// Pause device time while a host that stimulates is late: a stall of this computer then does
    /// not end stimulation, and host silence cannot be tested
    #[arg(long)]
    wait_for_host: bool,
    /// Write received requests, output levels and DAC writes to this new file, in device time: one
    /// JSON object per line
    #[arg(long)]
    trace: Option<PathBuf>,
    #[command(flatten)]
    chip: ChipArgs,
}

/// Time between two transfers of bytes and steps of the simulation.
const POLL: Duration = Duration::from_micros(500);

impl Serve {
    /// Opens the wire to clients and describes its address. A client may connect at once.
    fn open_wire(&self) -> anyhow::Result<(Box<dyn ByteStream>, String)> {
        match (&self.pty, &self.tcp) {
            #[cfg(unix)]
            (Some(path), _) => {
                let wire = PtyWire::open(path).with_context(|| {
                    format!("E771 cannot open a pseudo-terminal at {}", path.display())
                })?;
                Ok((Box::new(wire), path.display().to_string()))
            }
            #[cfg(not(unix))]
            (Some(path), _) => bail!(
                "cannot open a pseudo-terminal at {}: this system has none; serve with --tcp",
                path.display()
            ),
            (None, Some(address)) => {
                let cannot = || format!("cannot listen at {address}");
                let places: Vec<SocketAddr> =
                    address.to_socket_addrs().with_context(cannot)?.collect();
                self.check_network_access(&places)?;
                let wire = TcpWire::bind(&places[..], busy_frame()).with_context(cannot)?;
                let place = format!("tcp:{}", wire.local_addr()?);
                Ok((Box::new(wire), place))
            }
            (None, None) => bail!("give --pty PATH or --tcp HOST:PORT"),
        }
    }

    /// Refuses addresses beyond this computer unless the user allows them, and then warns.
    fn check_network_access(&self, places: &[SocketAddr]) -> anyhow::Result<()> {
        let Some(beyond) = places.iter().find(|place| !place.ip().is_loopback()) else {
            return Ok(());
        };
        if !self.open_to_network {
            bail!(
                "E770 {beyond} can be reached from other computers; give a local address such \
                 as 127.0.0.1:{}, or --open-to-network",
                beyond.port()
            );
        }
        eprintln!(
            "warning: anyone who can connect to {beyond} controls this board: there is no \
             password and no encryption"
        );
        Ok(())
    }
}

/// Serves until a signal or `--seconds` ends the command.
pub fn main(args: &Serve, output: Output) -> anyhow::Result<()> {
    if !matches!(args.device, DeviceName::Native | DeviceName::Chip) {
        let device = match &args.device {
            DeviceName::Auto => "auto".to_owned(),
            other => other.to_string(),
        };
        bail!(
            "E515 {device} cannot be served, only a simulator of this program can; give --device \
             native or chip"
        );
    }
    if let Some(seconds) = args.seconds.filter(|s| !(*s > 0.0 && s.is_finite())) {
        return usage_error(format!(
            "--seconds is {seconds}; allowed: above 0, or leave it out"
        ));
    }
    let text = include_str!("../../../sessions/hamana_exp4_two_point_finger.toml");
    let session = match &args.body {
        Some(path) => SessionFile::load(path)?,
        None => SessionFile::parse("hamana_exp4_two_point_finger.toml", text)?,
    };
    let mut port = args.chip.open(
        &args.device,
        &session.session,
        args.seed,
        false,
        AfterDebugger::Debugger,
    )?;
    let mut trace = match &args.trace {
        Some(path) => {
            check_writable(path, false, &[], None)?;
            Some(TraceFile::create(path).map_err(RecordError::write(path))?)
        }
        None => None,
    };
    let image = port.image().map(std::path::Path::to_owned);
    // Before a client can begin a session that a signal must end.
    let interruption = interrupt::catch_signals()?;
    // The device has booted, so a client that connects is answered.
    let (mut wire, place) = args.open_wire()?;
    let world = port.world().context("the device is not a simulator")?;
    let name = match args.device {
        DeviceName::Chip => "chip",
        _ => "native",
    };
    output.print(
        || {
            let served = format!("a simulated board is at {place}; end with Ctrl-C");
            match args.chip.is_breadboard() {
                true => format!("{served}\n{}", DeviceKind::Breadboard.words()),
                false => served,
            }
        },
        || serde_json::json!({ "device": name, "at": place, "image": image }),
    )?;
    let begin = Instant::now();
    let mut pace = Pace::new(world.now_us(), args.wait_for_host);
    let mut buffer = [0; 4096];
    while args
        .seconds
        .is_none_or(|s| begin.elapsed().as_secs_f64() < s)
    {
        if let Some(signal) = interruption.received_signal() {
            return Err(interrupt::EndedBySignal(
                signal,
                format!("and ended the simulated board at {place}"),
            )
            .into());
        }
        let is_slow = pace.advance_world(world)?;
        if is_slow && !args.chip.is_debugged() {
            eprintln!("note: the simulator is slower than real time; device time lags behind");
        }
        for bytes in world.received().collect::<Vec<_>>() {
            pace.note_sent(&bytes);
            wire.write_all(&bytes)?;
        }
        let count = wire.read(&mut buffer)?;
        pace.note_received(world.now_us(), &buffer[..count], wire.connected());
        match count {
            0 if pace.is_ahead(world) => std::thread::sleep(POLL),
            0 => {}
            count => world.send(&buffer[..count]),
        }
        match &mut trace {
            Some(trace) => {
                trace.note_received(&buffer[..count]);
                trace.write_line(world)?;
            }
            None => world.recorder.discard_trace(),
        }
    }
    Ok(())
}

/// Returns the frame that refuses a second client.
fn busy_frame() -> Vec<u8> {
    let refusal = Refusal::new(Code::SessionTaken, "connection");
    encode(&Response::Refused { seq: None, refusal })
        .map(|frame| frame.to_vec())
        .unwrap_or_default()
}
