//! Value change dump (IEEE 1364-2001 §18) for waveform viewers.

use std::io::{self, Write};

use vcd::{IdCode, TimescaleUnit, Value, Writer};

use super::levels::{CHANNELS, Levels, State};
use super::record::{DacWrite, Event, Trace};

/// Variables of one channel.
struct Channel {
    anodic: IdCode,
    cathodic: IdCode,
    dac: IdCode,
}

/// Writes a trace with 1 µs time steps: per channel a scope `ch1`…`ch10` with
/// the lines `anodic` and `cathodic` (both high: grounded; both low: isolated)
/// and the 16-bit `dac` code; and the line `sync`.
pub fn write_vcd(out: impl Write, trace: &Trace) -> io::Result<()> {
    let mut out = Writer::new(io::BufWriter::new(out));
    out.timescale(1, TimescaleUnit::US)?;
    out.add_module("flexor")?;
    let mut channels = Vec::with_capacity(CHANNELS);
    for number in 1..=CHANNELS {
        out.add_module(&format!("ch{number}"))?;
        channels.push(Channel {
            anodic: out.add_wire(1, "anodic")?,
            cathodic: out.add_wire(1, "cathodic")?,
            dac: out.add_wire(16, "dac")?,
        });
        out.upscope()?;
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
    write_changes(&mut out, trace, &channels, sync)?;
    out.flush()
}

fn write_changes<W: Write>(
    out: &mut Writer<W>,
    trace: &Trace,
    channels: &[Channel],
    sync: IdCode,
) -> io::Result<()> {
    let mut now = Levels::ISOLATED;
    let mut t_written = 0;
    for event in trace.events() {
        let (Event::Levels(t_us, _) | Event::Dac(DacWrite { t_us, .. })) = event;
        if t_us != t_written {
            out.timestamp(t_us)?;
            t_written = t_us;
        }
        match event {
            Event::Levels(_, levels) => {
                for channel in levels.changed(now) {
                    let lines = &channels[usize::from(channel)];
                    write_state(out, lines, levels.state(channel))?;
                }
                if levels.sync() != now.sync() {
                    out.change_scalar(sync, levels.sync())?;
                }
                now = levels;
            }
            Event::Dac(write) => {
                let lines = &channels[usize::from(write.channel)];
                out.change_vector(lines.dac, code_bits(write.code))?;
            }
        }
    }
    Ok(())
}

fn write_state<W: Write>(out: &mut Writer<W>, channel: &Channel, state: State) -> io::Result<()> {
    out.change_scalar(channel.anodic, state as u8 & 0b10 != 0)?;
    out.change_scalar(channel.cathodic, state as u8 & 0b01 != 0)
}

/// Most significant bit first, as the format wants.
fn code_bits(code: u16) -> impl Iterator<Item = Value> {
    (0..16)
        .rev()
        .map(move |bit| Value::from(code >> bit & 1 == 1))
}
