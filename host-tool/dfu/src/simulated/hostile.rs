//! Device that answers at random, for tests of the host side.

use super::Simulated;
use crate::protocol::{Request, Transport, TransportError};
use hal_sim::random::Sequence;

/// Passes requests to a simulated device and replaces some answers by random ones.
#[derive(Debug, Clone)]
pub struct HostileDevice {
    inner: Simulated,
    random: Sequence,
    /// One answer in this number is random; 1 makes all of them random.
    rarity: u64,
}

impl HostileDevice {
    /// Creates a device that depends only on `seed` and `rarity`.
    #[must_use]
    pub const fn new(inner: Simulated, seed: u64, rarity: u64) -> Self {
        Self {
            inner,
            random: Sequence::new(seed),
            rarity,
        }
    }

    /// Device behind the random answers.
    #[must_use]
    pub const fn inner(&self) -> &Simulated {
        &self.inner
    }

    fn strikes(&mut self) -> bool {
        self.random.below(self.rarity) == 0
    }

    fn error(&mut self) -> TransportError {
        match self.random.below(5) {
            0 => TransportError::Stall,
            1 => TransportError::Timeout,
            2 => TransportError::Disconnected,
            3 => TransportError::Fault,
            _ => TransportError::System(self.random.byte().into()),
        }
    }
}

impl Transport for HostileDevice {
    fn control_in(
        &mut self,
        request: Request,
        value: u16,
        length: u16,
        timeout_ms: u32,
    ) -> Result<Vec<u8>, TransportError> {
        let answer = self.inner.control_in(request, value, length, timeout_ms);
        if !self.strikes() {
            return answer;
        }
        match self.random.below(8) {
            0 => Err(self.error()),
            1 => {
                let length = self.random.below(u64::from(length) * 2 + 2);
                Ok((0..length).map(|_| self.random.byte()).collect())
            }
            2..=4 if request == Request::GetStatus => {
                // Plausible values reach more of the host side than arbitrary bytes.
                let status = if self.random.below(3) == 0 {
                    self.random.byte() % 17
                } else {
                    0
                };
                let state = self.random.byte() % 12;
                let poll = self.random.byte();
                let high = if self.random.below(4) == 0 { 0xFF } else { 0 };
                Ok(vec![status, poll, high, high, state, 0])
            }
            _ => Ok((0..length).map(|_| self.random.byte()).collect()),
        }
    }

    fn control_out(
        &mut self,
        request: Request,
        value: u16,
        data: &[u8],
        timeout_ms: u32,
    ) -> Result<(), TransportError> {
        let answer = self.inner.control_out(request, value, data, timeout_ms);
        if !self.strikes() {
            return answer;
        }
        if self.random.below(2) == 0 {
            Err(self.error())
        } else {
            Ok(())
        }
    }
}
