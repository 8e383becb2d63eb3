//! A simulated board that inspects its wire: it decodes every arriving frame and records when a
//! stop arrives.

use firmware::link::{Decoder, Request, ToDevice};
use hal_sim::native::native;
use hal_sim::wire::{ByteStream, pty::PtyWire, tcp::TcpWire};
use hal_sim::world::World;
use host_core::run::{SessionFile, simulated_port};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU8, Ordering};
use std::sync::{Arc, Mutex, mpsc};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// Kind of connection between host and board.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Wire {
    Tcp,
    Pty,
}

/// Order to the board's thread.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Order {
    Run = 0,
    /// Closes the connection.
    Cut = 1,
    /// Stops all traffic without closing the connection.
    Freeze = 2,
    /// Ends the board.
    End = 3,
}

/// Times when the first request of each kind arrived.
#[derive(Clone, Copy, Default, Debug)]
pub struct RequestTimes {
    pub hello: Option<Instant>,
    pub start: Option<Instant>,
    pub stop: Option<Instant>,
}

/// A native simulator behind a wire, paced by the wall clock.
pub struct Board {
    /// Address for `--device`.
    pub at: String,
    heard: Arc<Mutex<RequestTimes>>,
    order: Arc<AtomicU8>,
    thread: Option<JoinHandle<bool>>,
}

impl Board {
    pub fn serve(wire: Wire, folder: &Path, session: &Path) -> Self {
        let heard = Arc::new(Mutex::new(RequestTimes::default()));
        let order = Arc::new(AtomicU8::new(Order::Run as u8));
        let (sender, at) = mpsc::channel();
        let file = SessionFile::load(session).unwrap();
        let pty = folder.join("board");
        let thread = std::thread::spawn({
            let (heard, order) = (Arc::clone(&heard), Arc::clone(&order));
            move || {
                let (wire, at) = open(wire, pty);
                sender.send(at).unwrap();
                let boot = firmware::units::Micros::new(0);
                let port = simulated_port(&file.session, 1, Box::new(native(boot)), boot).unwrap();
                serve(wire, port.world, &heard, &order)
            }
        });
        let at = at.recv().unwrap();
        let thread = Some(thread);
        Self {
            at,
            heard,
            order,
            thread,
        }
    }

    pub fn heard(&self) -> RequestTimes {
        *self.heard.lock().unwrap()
    }

    pub fn order(&self, order: Order) {
        self.order.store(order as u8, Ordering::Release);
    }

    /// Lets the board run for 3 s without a host, and returns whether all outputs are then
    /// disconnected.
    pub fn ends_isolated(mut self) -> bool {
        self.order(Order::End);
        self.thread.take().unwrap().join().unwrap()
    }
}

impl Drop for Board {
    fn drop(&mut self) {
        self.order(Order::End);
    }
}

fn open(wire: Wire, pty: PathBuf) -> (Box<dyn ByteStream>, String) {
    match wire {
        Wire::Tcp => {
            let wire = TcpWire::bind("127.0.0.1:0", Vec::new()).unwrap();
            let at = format!("tcp:{}", wire.local_addr().unwrap());
            (Box::new(wire), at)
        }
        Wire::Pty => {
            let wire = PtyWire::open(&pty).unwrap();
            (Box::new(wire), pty.display().to_string())
        }
    }
}

fn serve(
    wire: Box<dyn ByteStream>,
    mut world: World,
    heard: &Mutex<RequestTimes>,
    order: &AtomicU8,
) -> bool {
    let mut wire = Some(wire);
    let mut decoder = Decoder::default();
    let (mut begin, mut origin) = (Instant::now(), world.now_us());
    let mut buffer = [0; 4096];
    loop {
        let now = order.load(Ordering::Acquire);
        if now == Order::End as u8 {
            break;
        }
        if now == Order::Cut as u8 {
            wire = None;
        }
        let due = origin + begin.elapsed().as_micros() as u64;
        let step = due.min(world.now_us() + 2_000);
        world.run_until(step).unwrap();
        if due > world.now_us() + 100_000 {
            (begin, origin) = (Instant::now(), world.now_us());
        }
        let sent: Vec<Vec<u8>> = world.received().collect();
        world.recorder.discard_trace();
        let open = wire.as_mut().filter(|_| now != Order::Freeze as u8);
        let Some(wire) = open else {
            std::thread::sleep(Duration::from_micros(500));
            continue;
        };
        for bytes in sent {
            wire.write_all(&bytes).unwrap();
        }
        let count = wire.read(&mut buffer).unwrap();
        if count > 0 {
            tap(&buffer[..count], &mut decoder, &mut heard.lock().unwrap());
            world.send(&buffer[..count]);
        } else if step == due {
            std::thread::sleep(Duration::from_micros(300));
        }
    }
    drop(wire);
    world.run_until(world.now_us() + 3_000_000).unwrap();
    world.recorder.trace.last_levels().0 == 0
}

fn tap(bytes: &[u8], decoder: &mut Decoder, heard: &mut RequestTimes) {
    let now = Instant::now();
    for &byte in bytes {
        let Some(message) = decoder.push(byte) else {
            continue;
        };
        let request = message.ok().and_then(|message| {
            let message = postcard::from_bytes::<ToDevice>(message).ok()?;
            Some(message.request)
        });
        let place = match request {
            Some(Request::Hello { .. }) => &mut heard.hello,
            Some(Request::Start) => &mut heard.start,
            Some(Request::Stop) => &mut heard.stop,
            _ => &mut None,
        };
        place.get_or_insert(now);
        decoder.clear();
    }
}
