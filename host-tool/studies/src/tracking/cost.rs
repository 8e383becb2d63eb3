//! Cost of each contender on the chip: its law, its differentiator, its add-ons.

use super::contender::Contender;
use crate::bench::{BenchError, Row, rows_on_chip};
use hal_sim::images::Image;
use methods::bench::LawName;
use methods::control::AddOns;

/// Measured cycles of every law with every combination of add-ons.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Cost(Vec<Row>);

/// Mean core clock cycles in a tick in which a law runs.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Cycles {
    /// Total.
    pub whole: u64,
    /// The law without add-ons and without its differentiator.
    pub law: u64,
    /// The differentiator alone.
    pub differentiator: u64,
    /// The add-ons: predictor, preview, learning.
    pub add_ons: u64,
}

impl Cost {
    /// Runs the image `laws` on the chip simulator.
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

    /// Returns a contender's cycles: laws in f32, the device's own in fixed point. Excludes the
    /// parts that are the same for all: setpoint track, feed-forward and mapping to amplitudes. The
    /// ablated default is not measured.
    pub fn contender_cycles(&self, contender: &Contender) -> Option<Cycles> {
        let (whole, alone, differentiator) = match contender {
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
        let (whole, alone, differentiator) = (mean(whole)?, mean(alone)?, mean(differentiator)?);
        Some(Cycles {
            whole,
            law: alone.saturating_sub(differentiator),
            differentiator,
            add_ons: whole.saturating_sub(alone),
        })
    }
}
