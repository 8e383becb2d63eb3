//! The device that a self-test measures, and a client of it.

use super::{BOOT, open_with};
use firmware::lockstep::Sensors;
use firmware::units::Micros;
use hal_sim::body::{Body, Drive};
use hal_sim::chip::Cycle;
use hal_sim::chip::board::{Board, CYCLES_PER_US};
use hal_sim::chip::image::Image;
use hal_sim::chip::soc::Pace;
use hal_sim::chip::soc::flash::Prefetched;
use hal_sim::lockstep::Output;
use hal_sim::wire::faults::Faults;
use hal_sim::world::World;
use host_core::link::{Connection, SimulatedPort};
use host_core::run::{ChipError, OpenError};
use std::sync::{Arc, Mutex, PoisonError};

/// Device that is measured.
#[derive(Clone, Copy, Debug)]
pub enum Subject<'a> {
    /// The device code in this process; bytes arrive at once.
    Native,
    /// An image on the chip simulator, with this assumption about its instruction cache; bytes
    /// travel over USB.
    Chip(&'a Image, Prefetched),
}

impl Subject<'_> {
    /// Cycle at which the cable is plugged in, after the image has begun to check for it.
    const PLUGGED: Cycle = 20_000 * CYCLES_PER_US;

    /// Returns how often the device is booted to measure `arrivals` setpoints: once on the native
    /// device. On the chip, one clock drives the control ticks and the host's USB frames, so a boot
    /// fixes their relative phase. Up to 50 boots therefore cover a tick in equal shifts of 20 µs
    /// or more. Each boot has 16 or more of the setpoints (if there are 16), so that every window
    /// has had a pulse.
    pub(super) fn boot_count(self, arrivals: u32) -> u32 {
        match self {
            Self::Native => 1,
            Self::Chip(..) => (arrivals / 16).clamp(1, 50),
        }
    }

    /// Opens a client of the device, in a world with `body`. On the chip, USB frames begin
    /// `shift_us` later than with a shift of 0.
    ///
    /// # Errors
    /// Fails if the device does not run.
    pub(super) fn open(self, body: Box<dyn Body>, shift_us: u64) -> Result<OpenSubject, OpenError> {
        let Self::Chip(image, prefetched) = self else {
            let client = open_with(body, Faults::default(), 1)?;
            return Ok(OpenSubject {
                client,
                board: None,
            });
        };
        let stages = [Some(Output {
            full_scale: Drive::Milliamps(100.0),
            conducted: false,
        }); _];
        let mut board =
            Board::power_on(image.clone(), stages, Pace::Lazy, ()).map_err(ChipError::Board)?;
        board.around.soc.flash.set_prefetched(prefetched);
        boot(&mut board, Self::PLUGGED + shift_us * CYCLES_PER_US).map_err(ChipError::Board)?;
        let boot = Micros::new(board.now_us() as u32); // far from wrapping
        let board = Arc::new(Mutex::new(board));
        let world = World::new(Box::new(board.clone()), body, boot, Faults::default(), 1);
        Ok(OpenSubject {
            client: Connection::open(SimulatedPort::new(world))?.0,
            board: Some(board),
        })
    }
}

/// Runs the board until cycle `plugged`, plugs in the USB cable, and continues until the port is
/// open.
fn boot(board: &mut Board, plugged: Cycle) -> Result<(), hal_sim::chip::board::BoardError> {
    let around = &mut board.around;
    around.host.unplug(0, &mut around.soc.otg);
    board.run_to(plugged)?;
    let (around, at) = (&mut board.around, board.cpu.cycle);
    around.host.plug(at, &mut around.soc.otg);
    around.soc.reschedule();
    board.boot(&Sensors::default())
}

/// A device under test.
pub(super) struct OpenSubject {
    /// Client of the device; the world's time is the device's.
    pub client: Connection<SimulatedPort>,
    board: Option<Arc<Mutex<Board>>>,
}

impl OpenSubject {
    /// Returns a device time at which a control tick starts, µs. All ticks start at whole
    /// milliseconds from it.
    pub const fn epoch_us(&self) -> u64 {
        match self.board {
            Some(_) => 0,
            None => BOOT.get() as u64,
        }
    }

    /// Returns when the device received the last byte sent at `sent_us`, rounded down to µs; on
    /// USB, the end of its ACK of the last packet.
    pub fn arrived_us(&self, sent_us: u64) -> u64 {
        let Some(board) = &self.board else {
            return sent_us;
        };
        // A step that panicked has ended the measurement.
        let board = board.lock().unwrap_or_else(PoisonError::into_inner);
        let around = &board.around;
        let cycle = around.host.last_delivery().unwrap_or(0);
        cycle.saturating_sub(around.origin()) / CYCLES_PER_US
    }
}
