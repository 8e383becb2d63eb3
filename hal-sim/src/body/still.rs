//! A body that does not move.

use super::{Body, CHANNELS, Load, Pulse};

/// A dummy load at a fixed joint angle, for tests of the electronics alone.
#[derive(Debug, Clone, PartialEq)]
pub struct FixedLoad {
    angle_deg: f64,
    loads: [Load; CHANNELS],
}

impl FixedLoad {
    /// Creates a joint that is held at `angle_deg` degrees, with nominal loads.
    pub fn new(angle_deg: f64) -> Self {
        Self {
            angle_deg,
            loads: [Load::NOMINAL; CHANNELS],
        }
    }
}

impl Body for FixedLoad {
    fn pulse(&mut self, _pulse: &Pulse) {}

    fn fork(&self) -> Option<Box<dyn Body>> {
        Some(Box::new(self.clone()))
    }

    fn advance(&mut self, _to_us: u64) -> bool {
        false
    }

    fn angle_deg(&self) -> f64 {
        self.angle_deg
    }

    fn sensed_deg(&self) -> f64 {
        self.angle_deg
    }

    fn loads(&self) -> &[Load; CHANNELS] {
        &self.loads
    }

    fn loads_mut(&mut self) -> &mut [Load; CHANNELS] {
        &mut self.loads
    }
}
