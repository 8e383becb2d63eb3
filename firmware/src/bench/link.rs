//! Benchmarks of the link's frames.

use super::{Bench, Clock, Random};
use crate::link::{Decoder, MAX_FRAME, Reading, Request, Response, Telemetry, ToDevice, encode};
use crate::pulse::CHANNELS;
use crate::units::{Amplitude, Micros};
use heapless::Vec;

/// Returns a setpoint with random amplitudes for the channels of `mask`.
pub(super) fn setpoint(mask: u16, random: &mut Random) -> Request {
    let mut values = Vec::new();
    for _ in 0..mask.count_ones() {
        // As many slots as channels.
        let _ = values.push(Amplitude::new(random.between(0, 20_000)));
    }
    Request::Amplitudes {
        at: None,
        mask,
        values,
        widths: Vec::new(),
    }
}

pub(super) fn run_benchmarks<C: Clock>(bench: &mut Bench<'_, C>) -> Option<()> {
    // Bytes of a setpoint → message: COBS, CRC, postcard.
    bench.measure(
        "decode_setpoint_frame",
        500,
        Decoder::default(),
        |_, random| {
            let message = ToDevice {
                session: 1,
                seq: random.between(0, 1 << 16) as u16,
                request: setpoint((1 << CHANNELS) - 1, random),
            };
            encode(&message).unwrap_or_default()
        },
        |decoder, frame| {
            let decoded = match decoder.push_until_delimiter(&mut &frame[..]) {
                Some(Ok(message)) => read(message),
                _ => None,
            };
            decoder.clear();
            decoded
        },
        |_, read, sum| {
            let Some((seq, values)) = read else { return };
            sum.add_word(u32::from(*seq));
            values.iter().for_each(|value| sum.add_word(value.get()));
        },
    );
    bench.measure(
        "encode_telemetry_frame",
        500,
        (),
        |(), random| telemetry(random),
        |(), sample| encode(&Response::Telemetry(sample.clone())).unwrap_or_default(),
        |(), frame: &Vec<u8, MAX_FRAME>, sum| sum.add_bytes(frame),
    );
    Some(())
}

/// Reads the number and the values of a setpoint, as a session does.
fn read(message: &[u8]) -> Option<(u16, Vec<Amplitude, CHANNELS>)> {
    let mut reading = Reading::new(message);
    let sender = reading.sender().ok()?;
    match reading.request() {
        Ok(Request::Amplitudes { ref values, .. }) if reading.is_at_end() => {
            Some((sender.seq, values.clone()))
        }
        _ => None,
    }
}

/// Returns a random telemetry sample of ten channels and muscles.
fn telemetry(random: &mut Random) -> Telemetry {
    let mut sample = Telemetry {
        at: Micros::new(random.word()),
        reference_centideg: Some(random.between(0, 10_000) as i16),
        measured_centideg: Some(random.between(0, 10_000) as i16),
        effort_milli: Some(random.between(0, 2_000).cast_signed() - 1_000),
        ..Telemetry::default()
    };
    for _ in 0..CHANNELS {
        // As many slots as channels.
        let amplitude = Amplitude::new(random.between(0, 20_000));
        let _ = sample.amplitudes.push(Some(amplitude));
        let _ = sample.forces_mn.push(Some(random.between(0, 30_000)));
    }
    sample
}
