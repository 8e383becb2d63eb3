//! Where frames go: a device in real time or a simulated world.

use crate::clock::Clock;
use firmware::limb::AXES;
use hal_sim::world::World;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// A second way in for frames, for a thread of its own.
pub struct Outlet {
    /// Where frames go.
    pub line: Box<dyn Write + Send>,
    /// What the thread measures its time with.
    pub clock: Box<dyn Clock>,
}

/// A byte path to a device, with the time that goes with it.
pub trait Port: Send {
    /// Host time in µs, monotonic. Virtual for simulators.
    fn now_us(&mut self) -> u64;
    /// Sends one frame.
    ///
    /// # Errors
    /// The device is gone.
    fn send(&mut self, frame: &[u8]) -> io::Result<()>;
    /// Bytes as soon as some arrive, none when `until_us` is reached or a signal
    /// came.
    ///
    /// # Errors
    /// The device is gone.
    fn receive(&mut self, until_us: u64) -> io::Result<Vec<u8>>;
    /// A second way in for frames, for another thread, where time is real; none where it
    /// is virtual. Who uses both sends one frame at a time.
    ///
    /// # Errors
    /// The device is gone.
    fn outlet(&mut self) -> io::Result<Option<Outlet>> {
        Ok(None)
    }
    /// The simulated world behind this port, if there is one.
    fn world(&mut self) -> Option<&mut World> {
        None
    }
    /// The image that a simulated chip or QEMU runs.
    fn image(&self) -> Option<&Path> {
        None
    }
    /// A copy of the simulated world behind this port, as it is now, which goes on alone;
    /// none of a device that cannot be copied: only the chip simulator can.
    fn snapshot(&self) -> Option<SimulatedPort> {
        None
    }
    /// True joint angle of a simulated wearer, degrees.
    fn true_deg(&mut self) -> Option<f64> {
        self.world().map(|world| world.body.angle_deg())
    }
    /// What a simulated wearer's data glove reads, degrees.
    fn glove_deg(&mut self) -> Option<f64> {
        self.world().map(|world| world.body.sensed_deg())
    }
    /// The nine angles of a simulated wearer's arm as they are measured, degrees.
    fn posture_deg(&mut self) -> Option<[f64; AXES]> {
        self.world().and_then(|world| world.body.posture_deg())
    }
    /// True force of a simulated wearer's hand on what holds it, N: backward, to the right,
    /// upward.
    fn hand_n(&mut self) -> Option<[f64; 3]> {
        self.world().and_then(|world| world.body.hand_n())
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

/// A simulated world, driven by whoever waits for it.
pub struct SimulatedPort {
    /// The world behind the wire.
    pub world: World,
    /// What its device runs, where that is an image.
    pub image: Option<PathBuf>,
}

impl SimulatedPort {
    /// A device in this process.
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
