//! Checksum over a setup, with which host and device verify that they have the same one.

use super::Request;
use crate::crc::CRC;
use crate::haptics::JOINTS;
use crate::pulse::CHANNELS;
use crate::safety::WearerSpec;
use crc::{Digest, Table};

/// Number of parts of a setup.
///
/// There is one part each for wearer, groups, sync, joint, wall and limb; one for train,
/// muscle, force control and line of every channel; and one for every modulated joint.
const PARTS: usize = 6 + 4 * CHANNELS + JOINTS;

/// Checksums of the parts of a setup.
///
/// For each part, the CRC-32 of the request that configured it last is stored, so the order
/// in which parts are configured has no effect. A request that only repeats the state after
/// [`Request::Clear`] (the default wearer, no groups, no sync) counts as no part.
///
/// ```
/// use firmware::link::{Request, SetupSum};
///
/// let mut sent = SetupSum::default();
/// sent.note(&Request::Sync { channel: Some(3) });
/// assert_ne!(sent.total(), 0);
/// sent.note(&Request::Clear);
/// assert_eq!(sent.total(), 0);
/// ```
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct SetupSum([Option<u32>; PARTS]);

impl Default for SetupSum {
    /// Returns the checksum of an empty setup, whose total is 0.
    fn default() -> Self {
        Self([None; PARTS])
    }
}

impl SetupSum {
    /// Records a request that the device accepted.
    ///
    /// [`Request::Clear`] removes all parts. Requests that configure nothing have no effect.
    pub fn note(&mut self, request: &Request) {
        if let Request::Clear = request {
            *self = Self::default();
        }
        self.record_part(part_index(request).map(|(index, is_set)| Part {
            index,
            sum: is_set.then(|| checksum(request)),
        }));
    }

    /// Returns whether `request` is part of a setup or clears it, so that [`Self::note`]
    /// records it.
    #[must_use]
    pub fn is_setup_request(request: &Request) -> bool {
        matches!(request, Request::Clear) || part_index(request).is_some()
    }

    /// Records an accepted part. `None` has no effect.
    pub fn record_part(&mut self, part: Option<Part>) {
        if let Some(part) = part
            && let Some(slot) = self.0.get_mut(part.index)
        {
            *slot = part.sum;
        }
    }

    /// Returns the checksum of the setup, which [`Request::Arm`] carries.
    ///
    /// It is the CRC-32 over the CRC-32s of the parts, four bytes each, least significant
    /// byte first, ordered by the number of the request's variant and then by channel.
    ///
    /// A difference within 32 neighbouring bits of one part's encoding is always detected,
    /// because a CRC-32 detects every such burst, both in the part and in its CRC. Any other
    /// difference is detected with probability 1 − 2⁻³².
    #[must_use]
    pub fn total(&self) -> u32 {
        let mut digest = CRC.digest();
        for part in self.0.iter().flatten() {
            digest.update(&part.to_le_bytes());
        }
        digest.finalize()
    }
}

/// Checksum of one part of a setup, computed from the message that carried it.
#[derive(Clone, Copy, Debug)]
pub struct Part {
    /// Position in [`SetupSum`], below [`PARTS`].
    index: usize,
    /// CRC-32 of the request, or `None` if the request repeats the default.
    sum: Option<u32>,
}

impl Part {
    /// Returns the part that `request` configures, or `None` if it configures nothing.
    ///
    /// `message` is the encoded message from which `request` was decoded. Computing the
    /// checksum from these bytes saves the device 10 KB, which encoding the request again
    /// would need.
    #[must_use]
    pub fn from_request(request: &Request, message: &[u8]) -> Option<Self> {
        let (index, is_set) = part_index(request)?;
        // Session and request number precede the request.
        let (_, encoded) = postcard::take_from_bytes::<(u16, u16)>(message).ok()?;
        let sum = is_set.then(|| CRC.checksum(encoded));
        Some(Self { index, sum })
    }
}

/// Returns the index of the part that a request configures, and whether the request differs
/// from the default.
///
/// Returns `None` if the request configures nothing, or a channel or joint that does not
/// exist.
fn part_index(request: &Request) -> Option<(usize, bool)> {
    let channel_part = |first: usize, channel: u8| {
        let channel = usize::from(channel);
        (channel < CHANNELS).then_some((first + channel, true))
    };
    match request {
        Request::Wearer(spec) => Some((0, *spec != WearerSpec::default())),
        Request::Channel { channel, .. } => channel_part(1, *channel),
        Request::Groups(groups) => Some((1 + CHANNELS, !groups.is_empty())),
        Request::Sync { channel } => Some((2 + CHANNELS, channel.is_some())),
        Request::Muscle { channel, .. } => channel_part(3 + CHANNELS, *channel),
        Request::Joint(_) => Some((3 + 2 * CHANNELS, true)),
        Request::Wall(_) => Some((4 + 2 * CHANNELS, true)),
        Request::ForceControl { channel, .. } => channel_part(5 + 2 * CHANNELS, *channel),
        Request::Limb(_) => Some((5 + 3 * CHANNELS, true)),
        Request::Line(spec) => channel_part(6 + 3 * CHANNELS, spec.channel),
        Request::Modulation(spec) => {
            let joint = usize::from(spec.joint);
            (joint < JOINTS).then_some((6 + 4 * CHANNELS + joint, true))
        }
        _ => None,
    }
}

/// Returns the CRC-32 of a request as it is encoded in messages.
fn checksum(request: &Request) -> u32 {
    // This cannot fail: `Checksum` accepts any byte, and the length of every sequence is
    // known.
    postcard::serialize_with_flavor(request, Checksum(CRC.digest())).unwrap_or_default()
}

/// Encoder output that computes the CRC-32 of the bytes and does not store them.
struct Checksum(Digest<'static, u32, Table<1>>);

impl postcard::ser_flavors::Flavor for Checksum {
    type Output = u32;

    fn try_extend(&mut self, bytes: &[u8]) -> postcard::Result<()> {
        self.0.update(bytes);
        Ok(())
    }

    fn try_push(&mut self, byte: u8) -> postcard::Result<()> {
        self.try_extend(&[byte])
    }

    fn finalize(self) -> postcard::Result<u32> {
        Ok(self.0.finalize())
    }
}
