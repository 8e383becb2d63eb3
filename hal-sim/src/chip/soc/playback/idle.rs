//! Executes all laps in which no pin changes at once: searches the words to be fetched, and fills
//! the words to be erased.

use super::Playback;
use super::fast_forward::Transfer;
use crate::chip::cpu::Size;
use crate::chip::soc::Ram;
use crate::chip::soc::dma::{Stream, Target};
use crate::chip::soc::gpio::after_bsrr;

impl Playback {
    /// Executes up to `laps` laps (periods of TIM1) of `transfers` at once, and returns their
    /// number. Stops before a lap in which a pin changes, a flag is set or a stream restarts.
    pub(super) fn pass_idle(
        &mut self,
        transfers: &mut [Transfer],
        lap: u64,
        laps: u64,
        ram: &mut Ram,
    ) -> u64 {
        let Some(items) = self.idle_laps(transfers, laps, ram) else {
            return 0;
        };
        // First all fetches, then all erasures: see `keeps_clear`.
        for plays in [true, false] {
            for transfer in transfers.iter_mut() {
                if self.dma[1]
                    .stream(transfer.stream)
                    .is_memory_to_peripheral()
                    == plays
                {
                    transfer.item += u64::from(items) * lap;
                    transfer.word += u64::from(items) * lap;
                    self.skip_items(transfer, items, ram);
                }
            }
        }
        u64::from(items)
    }

    /// Moves `items` items of a stream over both ports. `last` has the stream and the cycles at
    /// which the last of these items is moved.
    fn skip_items(&mut self, last: &Transfer, items: u16, ram: &mut Ram) {
        let stream = self.dma[1].stream_mut(last.stream);
        let (address, count) = (stream.address(), usize::from(items));
        if let Target::Word(source) = stream.target {
            let word = ram.read(source, Size::Word).unwrap_or(0);
            if let Some(words) = ram.words_mut(address, count) {
                words.fill(word.to_le_bytes());
            }
        } else {
            let words = ram.words(address, count);
            let fetched = words.and_then(|words| words.last());
            stream.word = fetched.map(|word| u32::from_le_bytes(*word));
        }
        stream.skip(items);
        stream.turned = last.word;
        self.transfers += u64::from(items);
    }

    /// Returns the number of laps from now on, at most `laps`, in which no pin changes, no flag is
    /// set and no stream restarts. Returns `None` if there are none, or if the laps must be
    /// executed one by one, for example because they access anything outside `ram`.
    fn idle_laps(&self, transfers: &[Transfer], laps: u64, ram: &Ram) -> Option<u16> {
        let streams = || transfers.iter().map(|t| self.dma[1].stream(t.stream));
        let most = streams().map(Stream::uneventful_items).min()?;
        let mut idle = most.min(u16::try_from(laps).unwrap_or(u16::MAX));
        for stream in streams() {
            if idle == 0 || !stream.is_plain() {
                return None;
            }
            match stream.target {
                Target::Bsrr(port) => {
                    let odr = self.gpio.output(port);
                    let same = |word| after_bsrr(odr, word) == odr;
                    // The word fetched last is not played in these laps.
                    let words = ram.words(stream.address(), usize::from(idle))?;
                    let ahead = words.iter().map(|word| u32::from_le_bytes(*word));
                    let played = stream.word.into_iter().chain(ahead);
                    let n = played.take(usize::from(idle)).take_while(|w| same(*w));
                    idle = n.count() as u16; // at most as it was
                }
                Target::Word(_) if stream.is_memory_to_peripheral() => return None,
                Target::Word(source) => {
                    ram.words(stream.address(), usize::from(idle))?;
                    ram.read(source, Size::Word)?;
                }
                Target::None | Target::Nowhere | Target::Port(..) => return None,
            }
        }
        let erasing = || streams().filter(|stream| !stream.is_memory_to_peripheral());
        let clear = erasing().all(|e| streams().all(|s| keeps_clear(e, s, idle)));
        (idle > 0 && clear).then_some(idle)
    }
}

/// Returns whether the words that stream `erasing` writes in `items` laps leave stream `other`
/// unaffected in these laps. Neither source nor destination of another erasing stream may be
/// written, and of a played stream only words that it fetched in an earlier lap.
fn keeps_clear(erasing: &Stream, other: &Stream, items: u16) -> bool {
    let length = 4 * u32::from(items);
    let begin = erasing.address();
    let apart = |from: u32| begin.abs_diff(from) >= length;
    match other.target {
        Target::Word(source) => {
            let writes = begin..begin.wrapping_add(length);
            !writes.contains(&source) && (std::ptr::eq(erasing, other) || apart(other.address()))
        }
        _ => begin < other.address() || apart(other.address()),
    }
}
