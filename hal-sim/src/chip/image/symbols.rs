//! Finds functions and variables of the image by address and by name.

use object::elf::{STT_FUNC, STT_NOTYPE, STT_OBJECT};
use object::read::elf::ElfFile32;
use object::{Endianness, Object, ObjectSymbol};
use rustc_demangle::demangle;

/// A function or a variable of an image.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Symbol {
    /// Address of the first byte, without the Thumb bit.
    pub address: u32,
    /// Size in bytes; 0 if the file does not give it (assembly).
    pub size: u32,
    /// Mangled name, as the linker knows it.
    pub raw: String,
    /// Name in the source, without the compiler's hash.
    pub name: String,
}

/// Symbols of an image, sorted by address.
#[derive(Clone, Debug, Default)]
pub struct Symbols {
    functions: Vec<Symbol>,
    variables: Vec<Symbol>,
}

impl Symbols {
    /// Reads all symbols of `elf`, except those whose names are not text.
    pub(super) fn read(elf: &ElfFile32<'_, Endianness>) -> Self {
        let mut symbols = Self::default();
        for symbol in elf.symbols() {
            let Ok(raw) = symbol.name() else { continue };
            // "$t" and "$d" mark where code and data alternate; they are not names.
            if raw.is_empty() || raw.starts_with('$') || symbol.is_undefined() {
                continue;
            }
            // ELF32: both fit.
            let (address, size) = (symbol.address() as u32, symbol.size() as u32);
            let new = |address| Symbol {
                address,
                size,
                raw: raw.to_owned(),
                name: format!("{:#}", demangle(raw)),
            };
            match symbol.elf_symbol().st_type() {
                STT_FUNC => symbols.functions.push(new(address & !1)),
                STT_OBJECT => symbols.variables.push(new(address)),
                // Assembly without a type; marks of the linker lie in no section.
                STT_NOTYPE if symbol.section_index().is_some() => {
                    symbols.variables.push(new(address));
                }
                _ => {}
            }
        }
        let order = |s: &Symbol| (s.address, s.size, s.raw.clone());
        symbols.functions.sort_by_cached_key(order);
        symbols.variables.sort_by_cached_key(order);
        symbols
    }

    /// Returns the names of all functions and variables.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        let symbols = self.functions.iter().chain(&self.variables);
        symbols.map(|symbol| symbol.name.as_str())
    }

    /// Returns all functions, by rising address.
    pub fn functions(&self) -> &[Symbol] {
        &self.functions
    }

    /// Returns the function whose code contains `address`: the last that begins at or before it,
    /// unless that function ends before it.
    pub fn function_at(&self, address: u32) -> Option<&Symbol> {
        let after = self.functions.partition_point(|f| f.address <= address);
        let function = self.functions.get(after.checked_sub(1)?)?;
        let inside = address - function.address;
        (function.size == 0 || inside < function.size).then_some(function)
    }

    /// Returns the name of the function at `address` and the distance from its start, as text for
    /// messages.
    pub fn describe(&self, address: u32) -> String {
        match self.function_at(address) {
            Some(symbol) => format!("{} + {:#x}", symbol.name, address - symbol.address),
            None => format!("no function at {address:#010x}"),
        }
    }

    /// Returns the variable with this name in the source; `None` if there is none.
    pub fn variable(&self, name: &str) -> Option<&Symbol> {
        self.variables.iter().find(|symbol| symbol.name == name)
    }

    /// Returns the function or variable with the mangled name `raw`; `None` if there is none.
    pub fn find(&self, raw: &str) -> Option<&Symbol> {
        let mut symbols = self.functions.iter().chain(&self.variables);
        symbols.find(|symbol| symbol.raw == raw)
    }
}
