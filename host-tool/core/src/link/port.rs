//! Ports carry frames to a device in real time or to a simulated world.

use crate::clock::Clock;
use firmware::limb::AXES;
use hal_sim::world::World;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// Second way to send frames to a device, for a separate thread.
pub struct Outlet {
    /// Destination of the frames.
    pub line: Box<dyn Write + Send>,
    /// Clock with which the thread measures its time.
    pub clock: Box<dyn Clock>,
}

/// Byte path to a device, together with its time.
pub trait Port: Send {
    /// Returns the host time in µs, which is monotonic; virtual for simulators.
    fn now_us(&mut self) -> u64;
    /// Sends one frame.
    ///
    /// # Errors
    /// The device is gone.
    fn send(&mut self, frame: &[u8]) -> io::Result<()>;
    /// Waits for bytes and returns them as soon as some arrive; returns none when `until_us` is
    /// reached or a signal arrives.
    ///
    /// # Errors
    /// The device is gone.
    fn receive(&mut self, until_us: u64) -> io::Result<Vec<u8>>;
    /// Returns a second way to send frames, for another thread, where time is real; `None` where it
    /// is virtual. A caller that uses both must send one frame at a time.
    ///
    /// # Errors
    /// The device is gone.
    fn outlet(&mut self) -> io::Result<Option<Outlet>> {
        Ok(None)
    }
    /// Returns the simulated world behind this port, if there is one.
    fn world(&mut self) -> Option<&mut World> {
        None
    }
    /// Returns the path of the image that a simulated chip or QEMU runs; `None` for other devices.
    fn image(&self) -> Option<&Path> {
        None
    }
    /// Returns a copy of the simulated world behind this port in its present state, which continues
    /// on its own; `None` for a device that cannot be copied. Only the chip simulator can.
    fn snapshot(&self) -> Option<SimulatedPort> {
        None
    }
    /// Returns the true joint angle of a simulated wearer, degrees; `None` if there is none.
    fn true_deg(&mut self) -> Option<f64> {
        self.world().map(|world| world.body.angle_deg())
    }
    /// Returns the reading of a simulated wearer's data glove, degrees; `None` if there is none.
    fn glove_deg(&mut self) -> Option<f64> {
        self.world().map(|world| world.body.sensed_deg())
    }
    /// Returns the nine measured angles of a simulated wearer's arm, degrees; `None` if there is
    /// none.
    fn posture_deg(&mut self) -> Option<[f64; AXES]> {
        self.world().and_then(|world| world.body.posture_deg())
    }
    /// Returns the true force of a simulated wearer's hand on the object that holds it, N:
    /// backward, to the right, upward. `None` if there is no simulated arm.
    fn hand_force_n(&mut self) -> Option<[f64; 3]> {
        self.world().and_then(|world| world.body.hand_force_n())
    }
}

impl<P: Port + ?Sized> Port for Box<P> {
    fn now_us(&mut self) -> u64 {
        (**self).now_us()
    }

    fn send(&mut self, frame: &[u8]) -> io::Result<()> {
        (**self).send(frame)
    }

    fn receive(&mut self, until_us: u64) -> io::Result<Vec<u8>> {
        (**self).receive(until_us)
    }

    fn outlet(&mut self) -> io::Result<Option<Outlet>> {
        (**self).outlet()
    }

    fn world(&mut self) -> Option<&mut World> {
        (**self).world()
    }

    fn image(&self) -> Option<&Path> {
        (**self).image()
    }

    fn snapshot(&self) -> Option<SimulatedPort> {
        (**self).snapshot()
    }
}

/// Port of a simulated world, which advances only while a caller waits for it.
pub struct SimulatedPort {
    /// Simulated world that the port's frames reach.
    pub world: World,
    /// Path of the image that the device runs; `None` if it runs none.
    pub image: Option<PathBuf>,
}

impl SimulatedPort {
    /// Creates the port of a world whose device is in this process.
    #[must_use]
    pub const fn new(world: World) -> Self {
        let image = None;
        Self { world, image }
    }
}

impl Port for SimulatedPort {
    fn snapshot(&self) -> Option<SimulatedPort> {
        Some(SimulatedPort {
            world: self.world.snapshot()?,
            image: self.image.clone(),
        })
    }

    fn image(&self) -> Option<&Path> {
        self.image.as_deref()
    }

    fn world(&mut self) -> Option<&mut World> {
        Some(&mut self.world)
    }

    fn now_us(&mut self) -> u64 {
        self.world.now_us()
    }

    fn send(&mut self, frame: &[u8]) -> io::Result<()> {
        self.world.send(frame);
        Ok(())
    }

    fn receive(&mut self, until_us: u64) -> io::Result<Vec<u8>> {
        while !self.world.has_received() && self.world.now_us() < until_us {
            self.world
                .run_until(until_us.min(self.world.now_us() + 1000))?;
        }
        let mut all = Vec::new();
        for bytes in self.world.received() {
            all.extend_from_slice(&bytes);
        }
        Ok(all)
    }
}
