//! Which function an instruction belongs to, in one look.

use crate::chip::image::{FLASH, Image};

/// Index by half-word of flash.
#[derive(Clone, Debug)]
pub(super) struct Functions {
    names: Vec<String>,
    /// By half-word of the image.
    at: Vec<u16>,
}

impl Functions {
    /// The core's entry to and return from exceptions.
    pub const ENTRY: usize = 0;
    /// Code without a name: none in the file, or in RAM.
    const NAMELESS: u16 = 1;

    pub fn from_image(image: &Image) -> Self {
        let mut names = vec!["(exception entry)".into(), "(no symbol)".into()];
        let mut at = vec![Self::NAMELESS; image.flash.len().div_ceil(2)];
        // By rising address: of two that overlap, the later.
        for function in image.symbols.functions() {
            let first = function.address.wrapping_sub(FLASH.start) as usize / 2;
            let index = u16::try_from(names.len()).unwrap_or(Self::NAMELESS);
            // Assembly without a size reaches to the next function.
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

    /// Which one the instruction at `pc` belongs to.
    #[inline]
    pub fn index_at(&self, pc: u32) -> usize {
        let half_word = (pc.wrapping_sub(FLASH.start) / 2) as usize;
        usize::from(self.at.get(half_word).copied().unwrap_or(Self::NAMELESS))
    }
}
