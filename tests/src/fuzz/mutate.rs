//! Mutated inputs of a corpus. Each is a function of a seed and a number, so that a run can be
//! repeated and continued, and is the same on any number of cores.

use hal_sim::random::{Random, word};

/// Length of the longest input, bytes.
const LONGEST: usize = 4096;

/// Bytes at the edges of ranges and encodings.
const TELLING: [u8; 8] = [0, 1, 2, 0x7F, 0x80, 0xFE, 0xFF, b','];

/// Numbers and punctuation at the edges of text formats.
const WORDS: [&str; 22] = [
    "-1",
    "0",
    "-0.0",
    "0.0000001",
    "65536",
    "4294967296",
    "18446744073709551616",
    "1e308",
    "1e999",
    "-1e999",
    "nan",
    "inf",
    "null",
    "true",
    "\"\"",
    "[]",
    "{}",
    "\\u0000",
    "\u{202e}",
    "\u{feff}",
    "\r\n",
    "\"",
];

/// Returns input `index` of stream `seed`: one, two, four or eight changes to an input of `corpus`;
/// one in 16 is noise. `corpus` must not be empty.
#[must_use]
pub fn mutation(corpus: &[Vec<u8>], seed: u64, index: u64) -> Vec<u8> {
    let random = Random::new(word(seed, index));
    Mutator { random, corpus }.input()
}

struct Mutator<'a> {
    random: Random,
    corpus: &'a [Vec<u8>],
}

impl<'a> Mutator<'a> {
    fn below(&mut self, bound: usize) -> usize {
        self.random.below(bound.max(1) as u64) as usize
    }

    fn pick(&mut self) -> &'a [u8] {
        let index = self.below(self.corpus.len());
        &self.corpus[index]
    }

    fn input(&mut self) -> Vec<u8> {
        if self.below(16) == 0 {
            let length = self.below(64);
            return (0..length).map(|_| self.random.word() as u8).collect();
        }
        let mut data = self.pick().to_vec();
        for _ in 0..1 << self.below(4) {
            self.change(&mut data);
        }
        data.truncate(LONGEST);
        data
    }

    fn change(&mut self, data: &mut Vec<u8>) {
        let at = self.below(data.len());
        let end = (at + 1 + self.below(16)).min(data.len());
        match self.below(10) {
            0 if !data.is_empty() => data[at] ^= 1 << self.below(8),
            1 if !data.is_empty() => data[at] = self.random.word() as u8,
            2 if !data.is_empty() => data[at] = TELLING[self.below(TELLING.len())],
            3 if !data.is_empty() => drop(data.drain(at..end)),
            4 => data.insert(at, self.random.word() as u8),
            5 => {
                let again = data[at..end].to_vec();
                data.splice(at..at, again);
            }
            6 => data.truncate(at),
            // Replaces a number or word by another.
            7 => {
                let is_word = |byte: &u8| byte.is_ascii_alphanumeric() || b"._-+".contains(byte);
                let end = at + data[at..].iter().take_while(|byte| is_word(byte)).count();
                let new = WORDS[self.below(WORDS.len())];
                data.splice(at..end, new.bytes());
            }
            // Inserts a piece of one input into another.
            8 => {
                let other = self.pick();
                let from = self.below(other.len());
                let to = (from + 1 + self.below(64)).min(other.len());
                data.splice(at..at, other[from..to].iter().copied());
            }
            // Appends the end of one input to the beginning of another.
            _ => {
                let other = self.pick();
                let from = self.below(other.len());
                data.truncate(at);
                data.extend_from_slice(&other[from..]);
            }
        }
    }
}
