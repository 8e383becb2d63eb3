//! Cost of each contender on the chip: its law, its differentiator, its add-ons.

use super::contender::Contender;
use crate::bench::{BenchError, Row, rows_on_chip};
use hal_sim::images::Image;
use methods::bench::LawName;
use methods::control::AddOns;

/// Benchmark rows of every control law with every combination of add-ons.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Cost(Vec<Row>);

/// Mean core clock cycles of a controller in a tick in which its law runs.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Cycles {
    /// Cycles of law, differentiator and add-ons together.
    pub whole: u64,
    /// Cycles of the law without add-ons and without its differentiator.
    pub law: u64,
    /// Cycles of the differentiator alone.
    pub differentiator: u64,
    /// Cycles of the add-ons: predictor, preview and learning.
    pub add_ons: u64,
}

impl Cost {
    /// Runs the image `laws` on the chip simulator and measures the cycles of all laws.
    pub fn on_chip() -> Result<Self, BenchError> {
        let mut rows = rows_on_chip(Image::Laws)?;
        let markers = LawName::Markers.to_string();
        let overhead = rows.iter().find(|row| row.name == markers);
        let overhead = overhead.map_or(0, |row| row.min);
        for row in &mut rows {
            row.subtract_overhead(overhead);
        }
        Ok(Self(rows))
    }

    /// Returns the cycles of a contender: those of its law in f32, or of the device's own code in
    /// fixed point. They exclude what all contenders have in common: setpoint track, feed-forward
    /// and mapping to amplitudes. Returns `None` for an ablation, which is not measured.
    pub fn contender_cycles(&self, contender: &Contender) -> Option<Cycles> {
        let (full_law, alone, differentiator) = match contender {
            Contender::Searched(_, c) => {
                let derivative = c.add_ons.derivative;
                let alone = AddOns {
                    derivative,
                    ..AddOns::NONE
                };
                (
                    LawName::Float(c.form, c.add_ons),
                    LawName::Float(c.form, alone),
                    LawName::Differentiator(derivative),
                )
            }
            Contender::Shipped => (
                LawName::Device,
                LawName::DeviceLaw,
                LawName::DeviceDifferentiator,
            ),
            Contender::Ablated(_) => return None,
        };
        let mean = |name: LawName| {
            let name = name.to_string();
            self.0.iter().find(|row| row.name == name).map(|r| r.mean)
        };
        let (total, alone, differentiator) = (mean(full_law)?, mean(alone)?, mean(differentiator)?);
        Some(Cycles {
            whole: total,
            law: alone.saturating_sub(differentiator),
            differentiator,
            add_ons: total.saturating_sub(alone),
        })
    }
}
