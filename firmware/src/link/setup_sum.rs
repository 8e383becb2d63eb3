//! The sum by which host and device know that they mean the same setup.

use super::Request;
use crate::crc::CRC;
use crate::haptics::JOINTS;
use crate::pulse::CHANNELS;
use crate::safety::WearerSpec;
use crc::{Digest, Table};

/// Wearer, groups, sync, joint, wall and arm; train, muscle, force control and line of
/// every channel; every joint that is modulated.
const PARTS: usize = 6 + 4 * CHANNELS + JOINTS;

/// The parts of a setup, each by the CRC-32 of the request that put it there.
///
/// A request replaces the one before for the same part, so the order of parts does
/// not count. Who says what stands after [`Request::Clear`] anyway (the default
/// wearer, no groups, no sync) has said nothing.
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
    /// Of no parts.
    fn default() -> Self {
        Self([None; PARTS])
    }
}

impl SetupSum {
    /// Takes note of a request that the device accepted; those that configure
    /// nothing change nothing.
    pub fn note(&mut self, request: &Request) {
        if let Request::Clear = request {
            *self = Self::default();
        }
        self.keep(place(request).map(|(place, says)| Part {
            place,
            sum: says.then(|| checksum(request)),
        }));
    }

    /// Whether [`Self::note`] would take note of `request`: it configures.
    #[must_use]
    pub fn concerns(request: &Request) -> bool {
        matches!(request, Request::Clear) || place(request).is_some()
    }

    /// Takes note of an accepted part, if it is one.
    pub fn keep(&mut self, part: Option<Part>) {
        if let Some(part) = part
            && let Some(slot) = self.0.get_mut(part.place)
        {
            *slot = part.sum;
        }
    }

    /// CRC-32 over the CRC-32s of the parts, four bytes each, least significant
    /// first, by the number of the request's variant and then by channel: what
    /// [`Request::Arm`] carries. A difference within 32 neighbouring bits of one
    /// part's encoding is always seen, because a CRC-32 sees every such burst, and
    /// the CRC of a part is one; any other with 1 − 2⁻³².
    #[must_use]
    pub fn total(&self) -> u32 {
        let mut digest = CRC.digest();
        for part in self.0.iter().flatten() {
            digest.update(&part.to_le_bytes());
        }
        digest.finalize()
    }
}

/// A part of a setup as it came in a message.
#[derive(Clone, Copy, Debug)]
pub struct Part {
    place: usize,
    sum: Option<u32>,
}

impl Part {
    /// Of `request`, which `message` was decoded to; `None` if it configures nothing. A
    /// device that would encode it again for its sum takes 10 KB more.
    #[must_use]
    pub fn of(request: &Request, message: &[u8]) -> Option<Self> {
        let (place, says) = place(request)?;
        // Session and number come first.
        let (_, encoded) = postcard::take_from_bytes::<(u16, u16)>(message).ok()?;
        let sum = says.then(|| CRC.checksum(encoded));
        Some(Self { place, sum })
    }
}

/// Where the part of a request stands, and whether it says more than none would;
/// `None` where it configures nothing, or a channel that is not there.
fn place(request: &Request) -> Option<(usize, bool)> {
    let of = |first: usize, channel: u8| {
        let channel = usize::from(channel);
        (channel < CHANNELS).then_some((first + channel, true))
    };
    match request {
        Request::Wearer(spec) => Some((0, *spec != WearerSpec::default())),
        Request::Channel { channel, .. } => of(1, *channel),
        Request::Groups(groups) => Some((1 + CHANNELS, !groups.is_empty())),
        Request::Sync { channel } => Some((2 + CHANNELS, channel.is_some())),
        Request::Muscle { channel, .. } => of(3 + CHANNELS, *channel),
        Request::Joint(_) => Some((3 + 2 * CHANNELS, true)),
        Request::Wall(_) => Some((4 + 2 * CHANNELS, true)),
        Request::ForceControl { channel, .. } => of(5 + 2 * CHANNELS, *channel),
        Request::Limb(_) => Some((5 + 3 * CHANNELS, true)),
        Request::Line(spec) => of(6 + 3 * CHANNELS, spec.channel),
        Request::Modulation(spec) => {
            let joint = usize::from(spec.joint);
            (joint < JOINTS).then_some((6 + 4 * CHANNELS + joint, true))
        }
        _ => None,
    }
}

/// CRC-32 of a request as it stands in a message.
fn checksum(request: &Request) -> u32 {
    // Nothing of it fails: the sum takes any byte, and every length is known.
    postcard::serialize_with_flavor(request, Sum(CRC.digest())).unwrap_or_default()
}

/// Takes encoded bytes without keeping them.
struct Sum(Digest<'static, u32, Table<1>>);

impl postcard::ser_flavors::Flavor for Sum {
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
