//! Inputs like those of a corpus, but wrong: seeded, so that a run repeats.

use hal_sim::random::Random;

/// Longest input, bytes.
const LONGEST: usize = 4096;

/// Bytes at the edges of ranges and encodings.
const TELLING: [u8; 8] = [0, 1, 2, 0x7F, 0x80, 0xFE, 0xFF, b','];

/// An endless source of mutated inputs.
pub struct Mutator {
    random: Random,
    corpus: Vec<Vec<u8>>,
}

impl Mutator {
    /// `corpus` must not be empty.
    pub fn new(seed: u64, corpus: Vec<Vec<u8>>) -> Self {
        assert!(!corpus.is_empty());
        Self {
            random: Random::new(seed),
            corpus,
        }
    }

    fn below(&mut self, bound: usize) -> usize {
        self.random.below(bound.max(1) as u64) as usize
    }

    fn pick(&mut self) -> Vec<u8> {
        let index = self.below(self.corpus.len());
        self.corpus[index].clone()
    }

    /// One, two, four or eight changes to an input of the corpus; one in 16 is noise.
    pub fn next(&mut self) -> Vec<u8> {
        if self.below(16) == 0 {
            let length = self.below(64);
            return (0..length).map(|_| self.random.word() as u8).collect();
        }
        let mut data = self.pick();
        for _ in 0..1 << self.below(4) {
            self.change(&mut data);
        }
        data.truncate(LONGEST);
        data
    }

    fn change(&mut self, data: &mut Vec<u8>) {
        let at = self.below(data.len());
        let end = (at + 1 + self.below(16)).min(data.len());
        match self.below(8) {
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
            // The end of one input after the beginning of another.
            _ => {
                let other = self.pick();
                let from = self.below(other.len());
                data.truncate(at);
                data.extend_from_slice(&other[from..]);
            }
        }
    }
}
