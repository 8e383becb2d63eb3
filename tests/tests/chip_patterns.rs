//! The paper's stimulation patterns and ten channels from the flashed image on the chip simulator:
//! every edge on its microsecond, and its phase within that.

use firmware::lockstep::{Sensors, Sink};
use firmware::pulse::Levels;
use firmware::units::{DacCode, Micros};
use hal_sim::chip::board::{Board, Phases};
use hal_sim::chip::image::Image;
use hal_sim::chip::profile::Phase;
use hal_sim::chip::soc::Pace;
use hal_sim::lockstep::Device;
use hal_sim::trace::Trace;
use host_core::run::{SessionFile, power_on, run, simulated_port};
use std::io;
use std::path::Path;
use std::sync::{Arc, Mutex};
use tests::desk::{self, flashed_image, load_session, session_path, session_paths};
use tests::expectation::{session_expectation, trace_since};

/// Observed length of each pattern, µs.
const PATTERN_US: u64 = 300_000;
/// Requirement: bus contention may move an edge by this many cycles.
const SPAN_CYCLES: u64 = 20;

/// Packets from the device with their times.
type Packets = Vec<(Micros, Vec<u8>)>;

/// Board that also records each packet to the host with its time.
struct RecordedBoard {
    board: Arc<Mutex<Board>>,
    packets: Arc<Mutex<Packets>>,
}

struct RecordingSink<'a>(&'a mut dyn Sink, &'a mut Packets);

impl Sink for RecordingSink<'_> {
    fn write_levels(&mut self, at: Micros, levels: Levels) {
        self.0.write_levels(at, levels);
    }

    fn write_dac(&mut self, at: Micros, channel: u8, code: DacCode) {
        self.0.write_dac(at, channel, code);
    }

    fn write_bytes(&mut self, at: Micros, bytes: &[u8]) {
        self.1.push((at, bytes.to_vec()));
        self.0.write_bytes(at, bytes);
    }
}

impl Device for RecordedBoard {
    fn receive(
        &mut self,
        at: Micros,
        bytes: &[u8],
        sensors: &Sensors,
        sink: &mut dyn Sink,
    ) -> io::Result<()> {
        let mut packets = self.packets.lock().unwrap();
        let sink = &mut RecordingSink(sink, &mut packets);
        self.board.receive(at, bytes, sensors, sink)
    }

    fn advance(&mut self, to: Micros, sensors: &Sensors, sink: &mut dyn Sink) -> io::Result<()> {
        let mut packets = self.packets.lock().unwrap();
        let sink = &mut RecordingSink(sink, &mut packets);
        self.board.advance(to, sensors, sink)
    }
}

struct SessionOutput {
    trace: Trace,
    packets: Packets,
    phases: Phases,
    epoch_us: u64,
}

/// Runs `file` on a fresh `board`.
fn stimulate(file: &SessionFile, mut board: Board) -> SessionOutput {
    let booted = board.boot(&Sensors::default());
    booted.unwrap_or_else(|e| panic!("{e}"));
    let boot = Micros::new(board.now_us() as u32);
    let board = Arc::new(Mutex::new(board));
    let packets = Arc::new(Mutex::new(Vec::new()));
    let device = Box::new(RecordedBoard {
        board: board.clone(),
        packets: packets.clone(),
    });
    let port = simulated_port(&file.session, 1, device, boot).unwrap();
    let (outcome, port) = run(file, port, None, |_| ());
    if let Some(error) = outcome.error {
        panic!("{}: {error}", file.session.title);
    }
    let phases = board.lock().unwrap().around.phases().clone();
    let packets = std::mem::take(&mut *packets.lock().unwrap());
    SessionOutput {
        trace: port.unwrap().world.recorder.trace,
        packets,
        phases,
        epoch_us: outcome.epoch_us.unwrap(),
    }
}

/// Compares every edge of `length_us` with its analytic microsecond. Returns their number, and the
/// phases of all edges of the run.
fn exact(path: &Path, image: &Image, length_us: u64) -> (usize, Phases) {
    let mut file = SessionFile::load(path).unwrap();
    file.session.duration_us = length_us + 20_000;
    let board = power_on(&file.session, image, ()).unwrap_or_else(|e| panic!("{e}"));
    let found = stimulate(&file, board);
    let end_us = found.epoch_us + length_us;
    let trace = trace_since(&found.trace, found.epoch_us).up_to(end_us);
    let expected = session_expectation(&file.session, found.epoch_us, end_us);
    let violations = hal_sim::trace::check(&trace, &expected);
    let name = path.file_stem().unwrap().display();
    assert!(violations.is_empty(), "{name}: {:?}", violations.first());
    let edges = trace.edges().count();
    println!("{name}: {edges} edges");
    assert!(edges > 20, "{name}");
    (edges, found.phases)
}

#[test]
fn every_edge_of_every_pattern_is_exact() {
    let image = flashed_image();
    let mut files = session_paths("hamana_exp2");
    assert_eq!(files.len(), 29);
    files.push(session_path("ten_channels.toml"));
    let (mut edges, mut total_phases) = (0, Phases::default());
    for path in files {
        let (count, phases) = exact(&path, &image, PATTERN_US);
        edges += count;
        let ports = [
            (&mut total_phases.b, phases.b),
            (&mut total_phases.c, phases.c),
        ];
        for (sum, more) in ports {
            for (sum, more) in sum.iter_mut().zip(more) {
                *sum += more;
            }
        }
    }
    let histogram = Phase::from_phases(&total_phases);
    let span = Phase::span(&histogram);
    println!("{edges} edges exact; all pin edges span {span} cycles:");
    println!("{:>8} {:>12} {:>12}", "late", "port B", "port C");
    for Phase { late, b, c } in &histogram {
        println!("{late:>8} {b:>12} {c:>12}");
    }
    assert!(
        total_phases.b.iter().sum::<u64>() > 100_000,
        "the pump, channels 6 to 10"
    );
    assert!(
        total_phases.c.iter().sum::<u64>() > 1_000,
        "channels 1 to 5"
    );
    assert!(span <= SPAN_CYCLES, "{span}");
}

/// Compares DMA that is simulated lazily with DMA simulated one request at a time.
#[test]
fn lazy_dma_changes_nothing() {
    let image = flashed_image();
    let mut file = load_session("ten_channels.toml");
    file.session.duration_us = 2_000_000;
    let [lazy, each] = [Pace::Lazy, Pace::PerRequest].map(|pace| {
        let board = Board::power_on(image.clone(), desk::stages(100.0), pace, ()).unwrap();
        stimulate(&file, board)
    });
    assert!(lazy.trace.levels.len() > 2_000 && lazy.trace.dac.len() > 10);
    assert!(lazy.packets.len() > 20);
    assert!(lazy.trace.levels == each.trace.levels, "levels");
    assert!(lazy.trace.dac == each.trace.dac, "DAC codes");
    assert!(lazy.packets == each.packets, "bytes");
    assert_eq!(lazy.phases.digest, each.phases.digest, "cycles of edges");
    println!(
        "{} levels, {} DAC writes, {} packets and {} pin edges to the cycle are the same",
        lazy.trace.levels.len(),
        lazy.trace.dac.len(),
        lazy.packets.len(),
        lazy.phases.b.iter().chain(&lazy.phases.c).sum::<u64>(),
    );
}
