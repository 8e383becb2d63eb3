//! Tests the checks of images with ELF files built byte by byte, and with each way to damage them.

use super::*;

/// A tiny ELF file: its segments in memory, and its symbols.
struct Made {
    entry: u32,
    /// Address and bytes of each segment.
    segments: Vec<(u32, Vec<u8>)>,
    /// Name, value, size and type (1 object, 2 function) of each symbol.
    symbols: Vec<(&'static str, u32, u32, u8)>,
    /// Whether the section of the table is called `.defmt`.
    defmt: bool,
}

/// Returns a valid image: a vector table and eight instructions, followed by a data segment.
fn good() -> Made {
    let mut code = Vec::new();
    for word in [0x2000_4000, 0x0800_0041].into_iter().chain([0; 14]) {
        code.extend_from_slice(&u32::to_le_bytes(word));
    }
    code.extend([0x00, 0xBF].repeat(8));
    Made {
        entry: 0x0800_0041,
        segments: vec![(0x0800_0000, code), (0x0800_0060, vec![1, 2, 3])],
        symbols: vec![
            ("_ZN4demo4work17h0123456789abcdefE", 0x0800_0049, 8, 2),
            ("Reset", 0x0800_0041, 8, 2),
            ("LEVEL", 0x2000_0010, 4, 1),
        ],
        defmt: true,
    }
}

/// Returns an image of these half-words of code from [`CODE`] on, with these functions (name,
/// address, size).
pub fn program(code: &[u16], functions: &[(&'static str, u32, u32)]) -> Image {
    made(code, functions).parse().unwrap()
}

/// Returns the ELF file of [`program`].
pub fn file(code: &[u16], functions: &[(&'static str, u32, u32)]) -> Vec<u8> {
    made(code, functions).bytes()
}

fn made(code: &[u16], functions: &[(&'static str, u32, u32)]) -> Made {
    let mut made = good();
    let (_, bytes) = &mut made.segments[0];
    bytes.truncate(64);
    bytes.extend(code.iter().flat_map(|half| half.to_le_bytes()));
    made.segments.truncate(1);
    let functions = functions.iter();
    made.symbols = functions
        .map(|&(n, at, size)| (n, at | 1, size, 2))
        .collect();
    made
}

/// Address where the code of [`program`] begins, behind the vectors.
pub const CODE: u32 = 0x0800_0040;

impl Made {
    /// Returns header, program headers, segments, then `.symtab`, `.strtab`, `.defmt`, `.shstrtab`
    /// and the section headers.
    fn bytes(&self) -> Vec<u8> {
        let mut data_at = 52 + 32 * self.segments.len();
        let (mut programs, mut body) = (Vec::new(), Vec::new());
        for (address, bytes) in &self.segments {
            let size = bytes.len() as u32;
            words(&mut programs, &[1, data_at as u32, *address, *address]);
            words(&mut programs, &[size, size, 5, 4]);
            body.extend_from_slice(bytes);
            data_at += bytes.len();
        }
        let (mut table, mut names) = (vec![0; 16], vec![0]);
        for (name, value, size, kind) in &self.symbols {
            words(&mut table, &[names.len() as u32, *value, *size]);
            table.extend_from_slice(&[0x10 | kind, 0, 1, 0]);
            names.extend_from_slice(name.as_bytes());
            names.push(0);
        }
        let section_names = b"\0.text\0.symtab\0.strtab\0.defmt\0.shstrtab\0";
        let mut sections = vec![0; 40];
        let first = self.segments.first();
        let (address, bytes) = first.map_or((0, 0), |(at, bytes)| (*at, bytes.len() as u32));
        let place = 52 + 32 * self.segments.len() as u32;
        let text = [1, 1, 6, address, place, bytes, 0, 0, 4, 0];
        words(&mut sections, &text);
        let parts: [(u32, u32, &[u8]); 4] = [
            (7, 2, &table),
            (15, 3, &names),
            (if self.defmt { 23 } else { 1 }, 1, b"{demo}"),
            (30, 3, section_names),
        ];
        for (name, kind, bytes) in parts {
            let (link, item) = if kind == 2 { (3, 16) } else { (0, 0) };
            let size = bytes.len() as u32;
            let section = [name, kind, 0, 0, data_at as u32, size, link, 1, 1, item];
            words(&mut sections, &section);
            body.extend_from_slice(bytes);
            data_at += bytes.len();
        }
        let mut out = b"\x7fELF\x01\x01\x01\0\0\0\0\0\0\0\0\0\x02\0\x28\0".to_vec();
        words(&mut out, &[1, self.entry, 52, data_at as u32, 0x0500_0400]);
        for half in [52, 32, self.segments.len() as u16, 40, 6, 5] {
            out.extend_from_slice(&half.to_le_bytes());
        }
        [out, programs, body, sections].concat()
    }

    fn parse(&self) -> Result<Image, ImageError> {
        Image::parse(Path::new("made.elf"), &self.bytes())
    }
}

fn words(out: &mut Vec<u8>, words: &[u32]) {
    for word in words {
        out.extend_from_slice(&word.to_le_bytes());
    }
}

/// Returns the message of the error that `change` causes.
#[track_caller]
fn refused(change: impl FnOnce(&mut Made)) -> String {
    let mut made = good();
    change(&mut made);
    made.parse().expect_err("must be refused").to_string()
}

#[track_caller]
fn patched(at: usize, bytes: &[u8]) -> String {
    let mut file = good().bytes();
    file[at..at + bytes.len()].copy_from_slice(bytes);
    let error = Image::parse(Path::new("made.elf"), &file);
    error.expect_err("must be refused").to_string()
}

#[test]
fn a_good_image_is_taken_apart() {
    let image = good().parse().unwrap();
    assert_eq!((image.initial_sp, image.reset), (0x2000_4000, 0x0800_0040));
    assert_eq!((image.size, image.flash.len()), (83, 0x63));
    assert_eq!(image.flash[0x60..], [1, 2, 3]);
    assert_eq!(image.flash[0x50..0x60], [0xFF; 16], "erased in between");
    image.require_defmt().unwrap();

    let names: Vec<_> = image.symbols.functions().iter().map(|f| &f.name).collect();
    assert_eq!(names, ["Reset", "demo::work"]);
    let at = |address| image.symbols.function_at(address).map(|f| f.name.as_str());
    assert_eq!(at(0x0800_003F), None);
    assert_eq!(at(0x0800_0040), Some("Reset"));
    assert_eq!(at(0x0800_0047), Some("Reset"));
    assert_eq!(at(0x0800_0048), Some("demo::work"));
    assert_eq!(at(0x0800_0050), None, "past the last");
    let level = image.symbols.find("LEVEL").unwrap();
    assert_eq!((level.address, level.size), (0x2000_0010, 4));
}

#[test]
fn what_is_no_elf_is_refused() {
    let parse = |bytes: &[u8]| {
        let result = Image::parse(Path::new("notes.txt"), bytes);
        result.unwrap_err().to_string()
    };
    for bytes in [&b""[..], b"hello", b"a text that is longer than a header"] {
        let words = parse(bytes);
        assert!(
            words.starts_with("E531 notes.txt is not a readable ELF"),
            "{words}"
        );
    }
    let missing = Image::open(Path::new("no/such/file")).unwrap_err();
    assert!(missing.to_string().starts_with("E530 the image no/such"));
}

#[test]
fn other_architectures_are_refused() {
    for (at, bytes, why) in [
        (4, &[2][..], "64-bit"),
        (5, &[2], "big-endian"),
        (18, &[62, 0], "machine number is 62"),
        (39, &[4], "EABI"),
        (24, &[0x40], "not Thumb"),
    ] {
        let words = patched(at, bytes);
        assert!(words.starts_with("E532 made.elf"), "{words}");
        assert!(words.contains(why), "{words}");
    }
}

#[test]
fn an_image_without_a_vector_table_is_refused() {
    let vector = |n: usize, word: u32| {
        refused(|made| {
            made.segments[0].1[4 * n..4 * n + 4].copy_from_slice(&word.to_le_bytes());
        })
    };
    for (words, why) in [
        (vector(0, 0), "not in RAM"),
        (vector(0, 0x2000_0000), "not in RAM"),
        (vector(0, 0x2002_0004), "not in RAM"),
        (vector(0, 0x2000_4002), "not in RAM"),
        (vector(1, 0x0800_0040), "even"),
        (vector(1, 0x0800_0063), "not in the image"),
        (vector(1, 0x0000_0041), "not in the image"),
        (vector(1, 0x2000_0001), "not in the image"),
        (
            refused(|m| m.segments = vec![(0x0800_0000, vec![0; 63])]),
            "only 63 bytes",
        ),
        (refused(|m| m.segments[0].0 = 0x0800_0200), "not in RAM"),
    ] {
        assert!(
            words.starts_with("E533 made.elf has no vector table"),
            "{words}"
        );
        assert!(words.contains(why), "{words}");
    }
}

#[test]
fn what_does_not_fit_flash_is_refused() {
    for words in [
        refused(|m| m.segments[1].0 = 0x080F_FFFE),
        refused(|m| m.segments[1].0 = 0x07FF_FFFF),
        refused(|m| m.segments[1].0 = 0x2000_0000),
        refused(|m| m.segments[1].0 = 0xFFFF_FFFF),
        refused(|m| m.segments[0].1.resize((1 << 20) + 1, 0)),
        refused(|m| m.segments.clear()),
    ] {
        assert!(words.starts_with("E534 made.elf does not fit"), "{words}");
    }
    let mut full = good();
    full.segments[1].0 = 0x080F_FFFD;
    assert_eq!(full.parse().unwrap().flash.len(), 1 << 20, "the last byte");
}

#[test]
fn logs_need_their_table() {
    let mut made = good();
    made.defmt = false;
    let image = made.parse().unwrap();
    let words = image.require_defmt().unwrap_err().to_string();
    assert!(words.starts_with("E535 made.elf has no defmt"), "{words}");
}

#[test]
fn a_file_cut_or_spoilt_anywhere_is_refused_or_read() {
    let file = good().bytes();
    for length in 0..file.len() {
        let cut = Image::parse(Path::new("cut"), &file[..length]);
        assert!(cut.is_err(), "{length} of {} bytes", file.len());
    }
    let mut read = 0;
    for bit in 0..8 * file.len() {
        let mut spoilt = file.clone();
        spoilt[bit / 8] ^= 1 << (bit % 8);
        read += u32::from(Image::parse(Path::new("spoilt"), &spoilt).is_ok());
    }
    // Most bits are data or names, which nothing can check.
    println!(
        "{read} of {} spoilt files can still be flashed",
        8 * file.len()
    );
    assert!(read > 0);
}
