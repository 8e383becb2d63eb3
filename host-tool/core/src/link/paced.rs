//! Slows virtual time down to the pace of a wall clock.

use super::{Outlet, Port};
use hal_sim::world::World;
use std::io;
use std::path::Path;
use std::time::{Duration, Instant};

/// Longest advance of virtual time between two comparisons with the wall clock, µs.
const STEP_US: u64 = 2_000;

/// Simulated port that runs in real time, so that a person can watch. Its virtual time starts with
/// the first wait and never runs ahead of the wall clock. If the computer is too slow, virtual time
/// lags behind and catches up as fast as it can.
pub struct PacedPort<P> {
    port: P,
    origin: Option<(Instant, u64)>,
}

impl<P> PacedPort<P> {
    /// Creates a port that slows down `port` to real time.
    pub fn new(port: P) -> Self {
        Self { port, origin: None }
    }
}

/// Returns how long virtual time must wait for the wall clock. `virtual_us` and `wall` are their
/// times since the first wait.
fn wait_time(virtual_us: u64, wall: Duration) -> Duration {
    Duration::from_micros(virtual_us).saturating_sub(wall)
}

impl<P: Port> Port for PacedPort<P> {
    fn now_us(&mut self) -> u64 {
        self.port.now_us()
    }

    fn send(&mut self, frame: &[u8]) -> io::Result<()> {
        self.port.send(frame)
    }

    fn receive(&mut self, until_us: u64) -> io::Result<Vec<u8>> {
        loop {
            let now = self.port.now_us();
            let (start, start_us) = *self.origin.get_or_insert_with(|| (Instant::now(), now));
            let bytes = self.port.receive(until_us.min(now + STEP_US))?;
            let now = self.port.now_us();
            std::thread::sleep(wait_time(now.saturating_sub(start_us), start.elapsed()));
            if !bytes.is_empty() || now >= until_us {
                return Ok(bytes);
            }
        }
    }

    fn outlet(&mut self) -> io::Result<Option<Outlet>> {
        self.port.outlet()
    }

    fn world(&mut self) -> Option<&mut World> {
        self.port.world()
    }

    fn image(&self) -> Option<&Path> {
        self.port.image()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    struct NoObserver(u64);

    impl Port for NoObserver {
        fn now_us(&mut self) -> u64 {
            self.0
        }

        fn send(&mut self, _: &[u8]) -> io::Result<()> {
            Ok(())
        }

        fn receive(&mut self, until_us: u64) -> io::Result<Vec<u8>> {
            self.0 = self.0.max(until_us);
            Ok(Vec::new())
        }
    }

    #[test]
    fn virtual_time_waits_for_the_wall_clock() {
        let mut port = PacedPort::new(NoObserver(7_000_000));
        let begin = Instant::now();
        port.receive(7_060_000).unwrap();
        assert!(begin.elapsed() >= Duration::from_millis(60));
        assert_eq!(port.now_us(), 7_060_000);
    }

    #[test]
    fn a_late_simulation_does_not_wait() {
        let ahead_us = |wall_ms| wait_time(1_500, Duration::from_millis(wall_ms)).as_micros();
        assert_eq!((ahead_us(1), ahead_us(2)), (500, 0));
    }
}
