//! Frames.

use super::{Algorithm, Checksum, Random};
use crate::link::{Decoder, MAX_FRAME, Request, Response, Telemetry, ToDevice, encode};
use crate::pulse::CHANNELS;
use crate::units::{Amplitude, Micros};
use heapless::Vec;

/// Amplitudes for the channels of `mask`.
pub(super) fn setpoint(mask: u16, random: &mut Random) -> Request {
    let mut values = Vec::new();
    for _ in 0..mask.count_ones() {
        // As many slots as channels.
        let _ = values.push(Amplitude(random.between(0, 20_000)));
    }
    Request::Amplitudes { mask, values }
}

/// Bytes of a setpoint → message: COBS, CRC, postcard.
pub(super) struct Decode {
    decoder: Decoder,
    frame: Vec<u8, MAX_FRAME>,
    message: Option<ToDevice>,
}

impl Decode {
    pub(super) fn new() -> Self {
        Self {
            decoder: Decoder::default(),
            frame: Vec::new(),
            message: None,
        }
    }
}

impl Algorithm for Decode {
    fn prepare(&mut self, random: &mut Random) {
        let message = ToDevice {
            session: 1,
            seq: random.between(0, 1 << 16) as u16,
            request: setpoint((1 << CHANNELS) - 1, random),
        };
        self.frame = encode(&message).unwrap_or_default();
        self.message = None;
    }
    fn run(&mut self) {
        for &byte in &self.frame {
            if let Some(Ok(message)) = self.decoder.push(byte) {
                self.message = postcard::from_bytes(message).ok();
                self.decoder.clear();
            }
        }
    }
    fn digest(&self, sum: &mut Checksum) {
        let Some(message) = &self.message else { return };
        sum.word(u32::from(message.seq));
        if let Request::Amplitudes { values, .. } = &message.request {
            for value in values {
                sum.word(value.0);
            }
        }
    }
}

/// A telemetry sample of ten channels and muscles → bytes.
pub(super) struct EncodeTelemetry {
    sample: Telemetry,
    frame: Vec<u8, MAX_FRAME>,
}

impl EncodeTelemetry {
    pub(super) fn new() -> Self {
        Self {
            sample: Telemetry::default(),
            frame: Vec::new(),
        }
    }
}

impl Algorithm for EncodeTelemetry {
    fn prepare(&mut self, random: &mut Random) {
        let mut sample = Telemetry {
            at: Micros(random.word()),
            target_centideg: Some(random.between(0, 10_000) as i16),
            measured_centideg: Some(random.between(0, 10_000) as i16),
            effort_milli: Some(random.between(0, 2_000).cast_signed() - 1_000),
            ..Telemetry::default()
        };
        for _ in 0..CHANNELS {
            // As many slots as channels.
            let _ = sample
                .amplitudes
                .push(Some(Amplitude(random.between(0, 20_000))));
            let _ = sample.forces_mn.push(random.between(0, 30_000));
        }
        self.sample = sample;
    }
    fn run(&mut self) {
        let response = Response::Telemetry(self.sample.clone());
        self.frame = encode(&response).unwrap_or_default();
    }
    fn digest(&self, sum: &mut Checksum) {
        sum.bytes(&self.frame);
    }
}
