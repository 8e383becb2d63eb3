//! Looks up in one access the function that an instruction belongs to.

use crate::chip::image::{FLASH, Image};

/// Map from addresses in flash to the functions of an image. A function is identified by an index.
#[derive(Clone, Debug)]
pub(super) struct Functions {
    names: Vec<String>,
    /// Index of the function that contains each half-word of the image.
    at: Vec<u16>,
}

impl Functions {
    /// Index for the core's entry to and return from exceptions.
    pub const ENTRY: usize = 0;
    /// Index for code in RAM and code that has no symbol.
    const NAMELESS: u16 = 1;

    pub fn from_image(image: &Image) -> Self {
        let mut names = vec!["(exception entry)".into(), "(no symbol)".into()];
        let mut at = vec![Self::NAMELESS; image.flash.len().div_ceil(2)];
        // The order is by rising address, so of two overlapping functions the later wins.
        for function in image.symbols.functions() {
            let first = function.address.wrapping_sub(FLASH.start) as usize / 2;
            let index = u16::try_from(names.len()).unwrap_or(Self::NAMELESS);
            // Assembly without a size extends to the next function.
            let end = match function.size {
                0 => at.len(),
                size => first.saturating_add((size as usize).div_ceil(2)),
            };
            let end = end.min(at.len());
            if let Some(half_words) = at.get_mut(first..end) {
                half_words.fill(index);
                names.push(function.name.clone());
            }
        }
        Self { names, at }
    }

    pub const fn len(&self) -> usize {
        self.names.len()
    }

    pub fn name(&self, index: usize) -> &str {
        &self.names[index]
    }

    /// Returns the index of the function that the instruction at `pc` belongs to.
    #[inline]
    pub fn index_at(&self, pc: u32) -> usize {
        let half_word = (pc.wrapping_sub(FLASH.start) / 2) as usize;
        usize::from(self.at.get(half_word).copied().unwrap_or(Self::NAMELESS))
    }
}
