//! Who touches a byte of memory first, reader or writer: what a fault there would come to.
//!
//! In: the core's accesses to SRAM, bytes to look at and from when on. Out: of each, what
//! the first access was. It changes nothing, and costs nothing where nobody asked for it.

use crate::chip::cpu::Size;
use std::collections::HashMap;

/// The first access to a byte.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub enum FirstAccess {
    /// None came.
    #[default]
    Untouched,
    /// It was written, and its old content is gone.
    Written,
    /// It was read.
    Read,
}

/// Bytes that are looked at.
#[derive(Clone, Debug, Default)]
pub struct Watch {
    /// Those that wait for their first access, by address.
    waiting: HashMap<u32, Vec<usize>>,
    /// Words of SRAM in which one may wait, from its first address on: nearly all accesses
    /// are to others.
    words: Vec<bool>,
    firsts: Vec<FirstAccess>,
}

impl Watch {
    /// Looks at the byte at `address` from now on; gives the number of its answer.
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

    /// What came first at each, by number, so far.
    #[must_use]
    pub fn first_accesses(&self) -> &[FirstAccess] {
        &self.firsts
    }

    const fn word(address: u32) -> usize {
        (address & 0x00FF_FFFF) as usize / 4
    }

    /// The core reads or writes, within one word.
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
        let told = [read, written, neither, again].map(|index| firsts[index]);
        let wanted = [
            FirstAccess::Read,
            FirstAccess::Written,
            FirstAccess::Untouched,
            FirstAccess::Read,
        ];
        assert_eq!(told, wanted);
    }
}
