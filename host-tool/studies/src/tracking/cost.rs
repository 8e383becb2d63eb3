//! What each contender's law costs on the chip.

use super::contender::Contender;
use crate::bench::{BenchError, Row, rows_on_chip};
use hal_sim::images::Image;
use methods::bench::LawName;

/// Cycles of every law with every combination of add-ons.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Cost(Vec<Row>);

impl Cost {
    /// Runs the image `laws` on the chip simulator.
    pub fn on_chip() -> Result<Self, BenchError> {
        let mut rows = rows_on_chip(Image::Laws)?;
        let markers = LawName::Markers.to_string();
        let overhead = rows.iter().find(|row| row.name == markers);
        let overhead = overhead.map_or(0, |row| row.min);
        for row in &mut rows {
            row.take_off(overhead);
        }
        Ok(Self(rows))
    }

    /// Mean core clock cycles of a contender's law in a tick in which it runs:
    /// in f32, the device's own in fixed point; setpoint track, feed-forward
    /// and mapping to amplitudes, which are the same for all, not in it.
    pub fn of(&self, contender: &Contender) -> Option<u64> {
        let name = match contender {
            Contender::Searched(_, c) => LawName::Float(c.form, c.add_ons),
            Contender::Shipped => LawName::Device,
        };
        let name = name.to_string();
        self.0.iter().find(|row| row.name == name).map(|r| r.mean)
    }
}
