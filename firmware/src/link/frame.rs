//! Frames of the link: COBS(postcard(message) ++ CRC-32) ++ 0x00. The CRC is CRC-32/ISO-HDLC over
//! the message, least significant byte first.

use crate::crc::CRC;
use heapless::Vec;
use serde::Serialize;

/// Maximum length of an encoded message, bytes.
pub const MAX_MESSAGE: usize = 464;

const MAX_BODY: usize = MAX_MESSAGE + 4;

/// Maximum length of a frame on the wire, bytes: COBS adds one byte per 254 bytes and one more, and
/// the delimiter adds one.
pub const MAX_FRAME: usize = MAX_BODY + MAX_BODY / 254 + 2;

/// Reason why the bytes between two delimiters are not a message.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum FrameError {
    /// The frame is longer than [`MAX_FRAME`], and was skipped up to the next delimiter; or its
    /// message is longer than [`MAX_MESSAGE`].
    TooLong,
    /// The bytes are not COBS, or too short to hold a CRC.
    Malformed,
    /// The CRC does not match the message.
    Crc,
}

/// Encodes `message` as one frame with its delimiter. Returns `None` if the frame is too long,
/// which a test excludes for the messages of this protocol.
///
/// ```
/// use firmware::link::{BROADCAST, Decoder, Request, SCHEMA, ToDevice, encode};
///
/// let request = Request::Hello { schema: SCHEMA };
/// let sent = ToDevice { session: BROADCAST, seq: 0, request };
/// let frame = encode(&sent).unwrap();
///
/// let (delimiter, bytes) = frame.split_last().unwrap();
/// let mut decoder = Decoder::default();
/// assert!(bytes.iter().all(|&byte| decoder.push(byte).is_none()));
/// let message = decoder.push(*delimiter).unwrap().unwrap();
/// assert_eq!(postcard::from_bytes::<ToDevice>(message), Ok(sent));
/// ```
#[must_use]
pub fn encode<T: Serialize>(message: &T) -> Option<Vec<u8, MAX_FRAME>> {
    let mut frame = Vec::new();
    encode_into(message, &mut frame)?;
    Some(frame)
}

/// Appends the frame of [`encode`] to `frame`, so that a device need not copy the frame. After
/// `None` the contents of `frame` are invalid.
pub fn encode_into<T: Serialize>(message: &T, frame: &mut Vec<u8, MAX_FRAME>) -> Option<()> {
    let mut body = [0u8; MAX_BODY];
    let length = postcard::to_slice(message, body.get_mut(..MAX_MESSAGE)?)
        .ok()?
        .len();
    let crc = CRC.checksum(body.get(..length)?).to_le_bytes();
    body.get_mut(length..length + 4)?.copy_from_slice(&crc);
    stuff(body.get(..length + 4)?, frame)?;
    frame.push(0).ok()
}

/// Encodes the non-empty `body` with COBS, run by run; the crate's encoder works byte by byte, at
/// several times the cost. A run ends before a zero, which the next run's length replaces, or after
/// 254 bytes. Returns `None` if the result is too long.
fn stuff(body: &[u8], frame: &mut Vec<u8, MAX_FRAME>) -> Option<()> {
    let mut rest = body;
    loop {
        let longest = rest.get(..254).unwrap_or(rest);
        let run = longest.split(|&byte| byte == 0).next()?;
        frame.push(run.len() as u8 + 1).ok()?; // at most 255
        frame.extend_from_slice(run).ok()?;
        let zero = usize::from(run.len() < 254);
        rest = match rest.get(run.len() + zero..) {
            Some(rest) if zero == 1 || !rest.is_empty() => rest,
            _ => return Some(()),
        };
    }
}

/// Decodes COBS in place, run by run, and returns the number of bytes left. Returns `None` if a run
/// ends after `bytes`, which contain no zero.
fn unstuff(bytes: &mut [u8]) -> Option<usize> {
    let (mut from, mut to) = (0, 0);
    while let Some(&length) = bytes.get(from) {
        // Each end passes the end of `bytes` by at most one run.
        let run = from + 1..from + usize::from(length);
        if run.start > run.end || run.end > bytes.len() {
            return None;
        }
        let count = run.len();
        from = run.end;
        bytes.copy_within(run, to); // to is before the run
        to += count;
        if length < 255 && from < bytes.len() {
            *bytes.get_mut(to)? = 0;
            to += 1;
        }
    }
    Some(to)
}

/// Decoder that collects bytes into frames. It cannot panic on any input.
#[derive(Clone, Debug, Default)]
pub struct Decoder {
    bytes: Vec<u8, MAX_FRAME>,
    too_long: bool,
}

impl Decoder {
    /// Adds one byte. At a delimiter, returns the bytes of the message (without CRC) or the reason
    /// why there is none. Ignores empty frames.
    pub fn push(&mut self, byte: u8) -> Option<Result<&[u8], FrameError>> {
        self.push_until_delimiter(&mut &[byte][..])
    }

    /// Adds all bytes up to the first delimiter, and the delimiter, as [`Self::push`] does; `bytes`
    /// keeps the rest.
    pub fn push_until_delimiter(&mut self, bytes: &mut &[u8]) -> Option<Result<&[u8], FrameError>> {
        let mut parts = bytes.splitn(2, |&byte| byte == 0);
        let (run, rest) = (parts.next().unwrap_or_default(), parts.next());
        self.too_long |= self.bytes.extend_from_slice(run).is_err();
        *bytes = rest.unwrap_or_default();
        rest?;
        if core::mem::take(&mut self.too_long) {
            self.bytes.clear();
            return Some(Err(FrameError::TooLong));
        }
        if self.bytes.is_empty() {
            return None;
        }
        let message = decode_in_place(&mut self.bytes);
        // The caller copies the message before the next byte arrives. The buffer is only marked as
        // empty, so `bytes` keeps its contents.
        match message {
            Ok(length) => {
                self.bytes.truncate(length);
                Some(Ok(&self.bytes))
            }
            Err(e) => {
                self.bytes.clear();
                Some(Err(e))
            }
        }
    }

    /// Discards the frame that [`Decoder::push`] or [`Decoder::push_until_delimiter`] returned.
    pub fn clear(&mut self) {
        self.bytes.clear();
    }
}

/// Decodes a frame in place, and returns the length of the message at its front.
fn decode_in_place(bytes: &mut [u8]) -> Result<usize, FrameError> {
    let length = unstuff(bytes).ok_or(FrameError::Malformed)?;
    let body = bytes.get(..length).ok_or(FrameError::Malformed)?;
    let (message, crc) = body.split_last_chunk::<4>().ok_or(FrameError::Malformed)?;
    if CRC.checksum(message) != u32::from_le_bytes(*crc) {
        return Err(FrameError::Crc);
    }
    if message.len() > MAX_MESSAGE {
        return Err(FrameError::TooLong);
    }
    Ok(message.len())
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::collection::vec;
    use proptest::prelude::*;
    use std::vec::Vec;

    fn decode(bytes: &[u8]) -> Vec<Result<Vec<u8>, FrameError>> {
        let mut decoder = Decoder::default();
        let mut out = Vec::new();
        for &byte in bytes {
            if let Some(result) = decoder.push(byte) {
                out.push(result.map(<[u8]>::to_vec));
                decoder.clear();
            }
        }
        out
    }

    #[test]
    fn check_value_of_the_crc() {
        assert_eq!(CRC.checksum(b"123456789"), 0xCBF4_3926);
    }

    #[test]
    fn runs_are_stuffed_as_the_crate_does() {
        let mut body = [0; MAX_BODY];
        for length in 1..=MAX_BODY {
            for apart in [1, 2, 3, 253, 254, 255, 256, 400] {
                for (byte, place) in body.iter_mut().zip(0..) {
                    *byte = u8::from(place % apart != length % apart);
                }
                let (mut own, mut theirs) = (super::Vec::new(), [0; MAX_FRAME]);
                stuff(&body[..length], &mut own).unwrap();
                let used = cobs::try_encode(&body[..length], &mut theirs).unwrap();
                assert_eq!(own, theirs[..used], "{length} {apart}");
                assert_eq!(unstuff(&mut own), Some(length), "{length} {apart}");
                assert_eq!(own[..length], body[..length], "{length} {apart}");
            }
        }
    }

    proptest! {
        #[test]
        fn bytes_are_unstuffed_as_the_crate_does(
            bytes in vec(prop_oneof![1..8u8, 1..=255u8], 1..MAX_FRAME),
        ) {
            let (mut own, mut theirs) = (bytes.clone(), bytes);
            let length = cobs::decode_in_place(&mut theirs).ok();
            prop_assert_eq!(unstuff(&mut own), length);
            let length = length.unwrap_or(0);
            prop_assert_eq!(&own[..length], &theirs[..length]);
        }
    }

    #[test]
    fn frames_round_trip_between_noise() {
        let frame = encode(&(7u16, [1u8, 0, 0, 255])).unwrap();
        let mut wire = std::vec![0, 0];
        wire.extend_from_slice(&frame);
        wire.extend_from_slice(&[9, 9, 0]);
        wire.extend_from_slice(&frame);
        let got = decode(&wire);
        assert_eq!(got.len(), 3);
        assert_eq!(got[0], Ok(std::vec![7, 1, 0, 0, 255]));
        assert!(got[1].is_err());
        assert_eq!(got[2], got[0]);
    }

    #[test]
    fn every_single_bit_error_is_caught() {
        let frame = encode(&(7u16, 0xDEAD_BEEFu32)).unwrap();
        for bit in 0..8 * (frame.len() - 1) {
            let mut bad = frame.to_vec();
            bad[bit / 8] ^= 1 << (bit % 8);
            assert!(decode(&bad).iter().all(Result::is_err), "bit {bit}");
        }
    }

    #[test]
    fn an_endless_frame_is_skipped_whole() {
        let mut wire = std::vec![1u8; 5 * MAX_FRAME];
        wire.push(0);
        wire.extend_from_slice(&encode(&1u8).unwrap());
        assert_eq!(decode(&wire), [Err(FrameError::TooLong), Ok(std::vec![1])]);
    }
}
