//! Detection of lists that are too long in messages that could not be decoded. A list that exceeds
//! its buffer ends the decoding of its message; this module reads the message again, up to the
//! list's length.

use super::reading::Sender;
use super::refusal::{Code, Refusal};
use crate::control::LawSpec;
use crate::limb::{JointName, LineSpec};
use crate::pulse::{CHANNELS, MAX_GROUPS};
use crate::safety::MAX_LISTED;
use serde::Deserialize;

/// Variant number of `Request::Groups` on the wire.
const GROUPS: u32 = 6;
/// Variant number of `Request::Joint` on the wire.
const JOINT: u32 = 9;
/// Variant number of `Request::Amplitudes` on the wire.
const AMPLITUDES: u32 = 14;
/// Variant number of `Request::Pulses` on the wire.
const PULSES: u32 = 24;
/// Variant number of `Request::Line` on the wire.
const LINE: u32 = 26;

/// Returns the sender of the undecodable request in `message` and the refusal, if a list in the
/// request is too long.
#[must_use]
pub fn refusal_for_long_list(message: &[u8]) -> Option<(Sender, Refusal<'static>)> {
    let ((sender, number), rest) = take::<(Sender, u32)>(message)?;
    let (field, least, most, rest) = match number {
        GROUPS => ("groups", 0, MAX_GROUPS, rest),
        AMPLITUDES => find_long_list(skip::<(Option<u32>, u16)>(rest)?)?,
        PULSES => ("pulses", 1, MAX_LISTED, skip::<u8>(rest)?),
        JOINT => ("flexors", 1, 2, skip::<(LawSpec, u8, u32)>(rest)?),
        LINE => {
            let count = LineSpec::VIA_COUNT;
            let rest = skip::<(u8, JointName)>(rest)?;
            (count.field, count.min, count.max as usize, rest) // 6
        }
        _ => return None,
    };
    let (count, _) = take::<u32>(rest)?;
    let most = most as i32; // at most 16
    let refusal = Refusal::new(Code::OutOfRange, field).with_range(least, most);
    (i64::from(count) > i64::from(most)).then_some((sender, refusal))
}

/// Returns the first list of an `Amplitudes` request if it is too long, otherwise the second: its
/// field, smallest and largest length, and the bytes from the length on.
fn find_long_list(values: &[u8]) -> Option<(&'static str, i32, usize, &[u8])> {
    let (count, mut rest) = take::<u32>(values)?;
    if count as usize > CHANNELS {
        return Some(("values", 0, CHANNELS, values));
    }
    for _ in 0..count {
        rest = skip::<u32>(rest)?;
    }
    Some(("widths", 0, CHANNELS, rest))
}

fn skip<'a, T: Deserialize<'a>>(bytes: &'a [u8]) -> Option<&'a [u8]> {
    take::<T>(bytes).map(|(_, rest)| rest)
}

fn take<'a, T: Deserialize<'a>>(bytes: &'a [u8]) -> Option<(T, &'a [u8])> {
    postcard::take_from_bytes(bytes).ok()
}
