//! Records the first access to chosen bytes of memory, a read or a write, which shows whether a
//! fault there would matter.
//!
//! In: the core's accesses to SRAM, the bytes to watch and the start of watching. Out: the kind of
//! the first access to each. Watching does not affect the simulation, and costs nothing if it is
//! not used.

use crate::chip::cpu::Size;
use std::collections::HashMap;

/// Kind of the first access to a byte since it has been watched.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum FirstAccess {
    /// No access so far.
    #[default]
    Untouched,
    /// The byte was written, so its old content is lost.
    Written,
    /// The byte was read.
    Read,
}

/// Bytes of SRAM that are watched, and the kind of the first access to each.
#[derive(Clone, Debug, Default)]
pub struct Watch {
    /// Bytes that wait for their first access, by address.
    waiting: HashMap<u32, Vec<usize>>,
    /// For each word of SRAM, from its first address on, whether it may contain a waiting byte.
    /// Nearly all accesses are to other words, which this check sorts out quickly.
    words: Vec<bool>,
    firsts: Vec<FirstAccess>,
}

impl Watch {
    /// Watches the byte at `address` from now on; returns its index in [`Self::first_accesses`].
    pub fn watch_address(&mut self, address: u32) -> usize {
        let number = self.firsts.len();
        self.firsts.push(FirstAccess::Untouched);
        self.waiting.entry(address).or_default().push(number);
        let word = Self::word(address);
        if word >= self.words.len() {
            self.words.resize(word + 1, false);
        }
        self.words[word] = true;
        number
    }

    /// Returns the first access to each watched byte so far, by index.
    #[must_use]
    pub fn first_accesses(&self) -> &[FirstAccess] {
        &self.firsts
    }

    const fn word(address: u32) -> usize {
        (address & 0x00FF_FFFF) as usize / 4
    }

    /// Records an access of the core to `size` bytes from `address` on, which lie within one word.
    #[inline]
    pub(super) fn touch(&mut self, address: u32, size: Size, first: FirstAccess) {
        if self.words.get(Self::word(address)) == Some(&true) {
            self.note(address, size, first);
        }
    }

    fn note(&mut self, address: u32, size: Size, first: FirstAccess) {
        for byte in address..address.saturating_add(size.bytes()) {
            if let Some(numbers) = self.waiting.remove(&byte) {
                numbers
                    .into_iter()
                    .for_each(|number| self.firsts[number] = first);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Pace, Soc};
    use super::*;
    use crate::chip::cpu::Bus;

    #[test]
    fn the_first_access_to_each_byte_is_told() {
        let mut soc = Soc::new(Pace::Lazy);
        let watch = soc.watch.insert(Box::default());
        let [read, written, neither] =
            [0x2000_0101, 0x2000_0200, 0x2000_0300].map(|at| watch.watch_address(at));
        assert_eq!(
            soc.read_without_wait(0x2000_0100, Size::Word),
            None,
            "it is seen"
        );
        assert!(!soc.write_without_wait(0x2000_0200, Size::Byte, 1));
        soc.read(0x2000_0100, Size::Word, 1).unwrap();
        soc.write(0x2000_0100, Size::Word, 1, 2).unwrap();
        soc.write(0x2000_0200, Size::Byte, 1, 3).unwrap();
        let again = soc.watch.as_mut().unwrap().watch_address(0x2000_0200);
        soc.read(0x2000_0200, Size::Half, 4).unwrap();
        let firsts = soc.watch.as_ref().unwrap().first_accesses();
        let accesses = [read, written, neither, again].map(|index| firsts[index]);
        let wanted = [
            FirstAccess::Read,
            FirstAccess::Written,
            FirstAccess::Untouched,
            FirstAccess::Read,
        ];
        assert_eq!(accesses, wanted);
    }
}
