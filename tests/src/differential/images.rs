//! Encodings that an image contains.

use super::encodings::{Encodings, is_wide};
use anyhow::{Context, Result};
use object::{Object, ObjectSection, ObjectSymbol, SectionKind, SymbolSection};
use std::collections::BTreeMap;
use std::path::Path;

/// Instructions of an image, with and without a known encoding.
#[derive(Debug, Default)]
pub struct ImageInstructions {
    /// Number of instructions by encoding.
    pub known: BTreeMap<usize, u32>,
    /// Address, width in bits and code of instructions without an encoding.
    pub unknown: Vec<(u64, u32, u32)>,
}

/// Finds all instructions of the ELF at `path` that its mapping symbols mark as Thumb code.
///
/// # Errors
/// Fails if the file is no ELF with mapping symbols.
pub fn find_instructions(path: &Path, encodings: &Encodings) -> Result<ImageInstructions> {
    let bytes = std::fs::read(path).with_context(|| path.display().to_string())?;
    let elf = object::File::parse(&*bytes)?;
    let mut found = ImageInstructions::default();
    for section in elf.sections().filter(|s| s.kind() == SectionKind::Text) {
        let data = section.data()?;
        let mut marks: Vec<(u64, bool)> = elf
            .symbols()
            .filter(|s| s.section() == SymbolSection::Section(section.index()))
            .filter_map(|s| match s.name().ok()?.get(..2)? {
                "$t" => Some((s.address(), true)),
                "$d" => Some((s.address(), false)),
                _ => None,
            })
            .collect();
        marks.sort_unstable();
        marks.dedup();
        let end = section.address() + section.size();
        let ends = marks.iter().skip(1).map(|m| m.0).chain([end]);
        for ((start, is_code), end) in marks.iter().zip(ends) {
            if *is_code {
                let [from, to] = [*start, end].map(|at| (at - section.address()) as usize);
                let code = data.get(from..to).context("a mapping symbol is outside")?;
                walk(*start, code, encodings, &mut found);
            }
        }
    }
    anyhow::ensure!(!found.known.is_empty(), "{}: no code", path.display());
    Ok(found)
}

fn walk(start: u64, code: &[u8], encodings: &Encodings, found: &mut ImageInstructions) {
    let halves: Vec<u16> = code
        .chunks_exact(2)
        .map(|b| u16::from_le_bytes([b[0], b[1]]))
        .collect();
    let mut at = 0;
    while let Some(&first) = halves.get(at) {
        let second = halves.get(at + 1).copied().unwrap_or(0);
        let (width, word) = if is_wide(first) {
            (32, u32::from(first) << 16 | u32::from(second))
        } else {
            (16, u32::from(first))
        };
        match encodings.find(width, word) {
            Some(id) => *found.known.entry(id).or_default() += 1,
            None => found.unknown.push((start + at as u64 * 2, width, word)),
        }
        at += width as usize / 16;
    }
}
