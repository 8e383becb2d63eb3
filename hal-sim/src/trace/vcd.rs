//! Value change dump (IEEE 1364-2001 §18) of a trace, for waveform viewers.

use std::io::{self, Write};

use vcd::{IdCode, TimescaleUnit, Value, Writer};

use super::levels::{CHANNELS, Levels, State};
use super::record::{DacWrite, Event, Trace};

/// Identifiers of one channel's variables in the dump.
struct Channel {
    anodic: IdCode,
    cathodic: IdCode,
    dac: IdCode,
}

/// A dump with 1 µs time steps, written piece by piece: the lines `ch1_anodic` and `ch1_cathodic`
/// to `ch10_cathodic` (both high: grounded; both low: isolated), the 16-bit codes `ch1_dac` to
/// `ch10_dac`, and the line `sync`. Names are unique without a scope, because some viewers do not
/// show scopes.
pub struct Vcd<W: Write> {
    out: Writer<io::BufWriter<W>>,
    channels: Vec<Channel>,
    sync: IdCode,
    /// Lines after the last change.
    now: Levels,
    /// Time stamp of the last change, µs.
    t_us: u64,
}

impl<W: Write> Vcd<W> {
    /// Writes the header, and the state at time 0: all channels isolated and all codes 0.
    ///
    /// # Errors
    /// Fails if `out` cannot be written.
    pub fn begin(out: W) -> io::Result<Self> {
        let mut out = Writer::new(io::BufWriter::new(out));
        out.timescale(1, TimescaleUnit::US)?;
        out.add_module("flexor")?;
        let mut channels = Vec::with_capacity(CHANNELS);
        for number in 1..=CHANNELS {
            channels.push(Channel {
                anodic: out.add_wire(1, &format!("ch{number}_anodic"))?,
                cathodic: out.add_wire(1, &format!("ch{number}_cathodic"))?,
                dac: out.add_wire(16, &format!("ch{number}_dac"))?,
            });
        }
        let sync = out.add_wire(1, "sync")?;
        out.upscope()?;
        out.enddefinitions()?;

        out.timestamp(0)?;
        for channel in &channels {
            write_state(&mut out, channel, State::Isolated)?;
            out.change_vector(channel.dac, code_bits(0))?;
        }
        out.change_scalar(sync, false)?;
        Ok(Self {
            out,
            channels,
            sync,
            now: Levels::ISOLATED,
            t_us: 0,
        })
    }

    /// Appends the next part of a recording.
    ///
    /// # Errors
    /// Fails if the dump cannot be written.
    pub fn append(&mut self, trace: &Trace) -> io::Result<()> {
        for event in trace.events() {
            let (Event::Levels(t_us, _) | Event::Dac(DacWrite { t_us, .. })) = event;
            self.advance_to(t_us)?;
            match event {
                Event::Levels(_, levels) => {
                    for channel in levels.changed_channels(self.now) {
                        let lines = &self.channels[usize::from(channel)];
                        write_state(&mut self.out, lines, levels.state(channel))?;
                    }
                    if levels.sync() != self.now.sync() {
                        self.out.change_scalar(self.sync, levels.sync())?;
                    }
                    self.now = levels;
                }
                Event::Dac(write) => {
                    let lines = &self.channels[usize::from(write.channel)];
                    self.out.change_vector(lines.dac, code_bits(write.code))?;
                }
            }
        }
        Ok(())
    }

    /// Ends the dump with the time stamp `end_us`, up to which nothing changes any more, so that a
    /// viewer shows the time up to there.
    ///
    /// # Errors
    /// Fails if the dump cannot be written.
    pub fn end(mut self, end_us: u64) -> io::Result<()> {
        self.advance_to(end_us.max(self.t_us))?;
        self.out.flush()
    }

    fn advance_to(&mut self, t_us: u64) -> io::Result<()> {
        if t_us != self.t_us {
            self.out.timestamp(t_us)?;
            self.t_us = t_us;
        }
        Ok(())
    }
}

/// Writes a trace that was recorded until `end_us` as one [`Vcd`].
///
/// # Errors
/// Fails if `out` cannot be written.
pub fn write_vcd(out: impl Write, trace: &Trace, end_us: u64) -> io::Result<()> {
    let mut dump = Vcd::begin(out)?;
    dump.append(trace)?;
    dump.end(end_us)
}

fn write_state<W: Write>(out: &mut Writer<W>, channel: &Channel, state: State) -> io::Result<()> {
    out.change_scalar(channel.anodic, state as u8 & 0b10 != 0)?;
    out.change_scalar(channel.cathodic, state as u8 & 0b01 != 0)
}

/// Returns the bits of `code`, most significant first, as the format requires.
fn code_bits(code: u16) -> impl Iterator<Item = Value> {
    (0..16)
        .rev()
        .map(move |bit| Value::from(code >> bit & 1 == 1))
}
