//! Reads files that a person names, if they are regular files and not too long.
//!
//! Other kinds are refused: reading a pipe could block forever, reading a device could fill the
//! memory, and merely opening some devices has side effects.

use std::fs::{File, FileType};
use std::io::{self, Read};
use std::path::Path;

/// Maximum length of a file that a person types, bytes: a session, a wearer file, a declaration or
/// answers.
pub const LONGEST_TYPED: u64 = 1 << 20;
/// Maximum length of a document that the program writes and reads as a whole, bytes: the parts of a
/// record except its tables, journals, an image.
pub const LONGEST_DOCUMENT: u64 = 256 << 20;
/// Maximum length of a table of a record or a sweep, bytes. The samples of one day take a third of
/// it.
pub const LONGEST_TABLE: u64 = 4 << 30;

/// Number of bytes that are checked before the rest of a file is read.
const PART: u64 = 1 << 20;

/// Opens the regular file at `path`, or the regular file that a link at `path` points to.
///
/// # Errors
/// Fails if `path` is not a regular file (`InvalidInput`) or cannot be opened.
pub fn open(path: &Path) -> io::Result<File> {
    is_regular(path.metadata()?.file_type())?;
    let file = File::open(path)?;
    // Another file may have replaced it between the check and the opening.
    is_regular(file.metadata()?.file_type())?;
    Ok(file)
}

/// Checks that `path` may be opened for writing: that a regular file or nothing is there.
///
/// # Errors
/// Fails if anything else is there (`InvalidInput`).
pub fn check_appendable(path: &Path) -> io::Result<()> {
    path.metadata()
        .map_or(Ok(()), |metadata| is_regular(metadata.file_type()))
}

/// Reads the bytes of the regular file at `path`, at most `longest`.
///
/// # Errors
/// Fails like [`open`], and if the file is longer (`FileTooLarge`).
pub fn read(path: &Path, longest: u64) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    read_rest(&open(path)?, longest, &mut bytes)?;
    Ok(bytes)
}

/// Reads the text of the regular file at `path`, at most `longest` bytes.
///
/// # Errors
/// Fails like [`read`], and if the file is not UTF-8 or contains a zero byte (`InvalidData`). A
/// zero byte in the first MiB ends the reading early.
pub fn read_text(path: &Path, longest: u64) -> io::Result<String> {
    let (file, mut bytes) = (open(path)?, Vec::new());
    read_rest(&file, PART.min(longest), &mut bytes).or_else(|why| match why.kind() {
        io::ErrorKind::FileTooLarge if longest > PART => Ok(()),
        _ => Err(why),
    })?;
    if [b"\xff\xfe", b"\xfe\xff"]
        .iter()
        .any(|mark| bytes.starts_with(*mark))
    {
        let why = "it is UTF-16 text; save it as UTF-8";
        return Err(io::Error::new(io::ErrorKind::InvalidData, why));
    }
    if bytes.contains(&0) {
        let why = "it contains a zero byte, as UTF-16 text does; save it as UTF-8";
        return Err(io::Error::new(io::ErrorKind::InvalidData, why));
    }
    read_rest(&file, longest, &mut bytes)?;
    String::from_utf8(bytes).map_err(|_| {
        let why = "it is not UTF-8 text; save it as UTF-8";
        io::Error::new(io::ErrorKind::InvalidData, why)
    })
}

/// Appends the rest of `file` to `bytes`; fails if they become longer than `longest`.
fn read_rest(mut file: &File, longest: u64, bytes: &mut Vec<u8>) -> io::Result<()> {
    let room = longest.saturating_sub(bytes.len() as u64);
    file.by_ref().take(room + 1).read_to_end(bytes)?;
    if bytes.len() as u64 > longest {
        let why = match longest {
            ..0x10_0000 => format!("it is longer than {longest} bytes, the most that is accepted"),
            _ => format!(
                "it is longer than {} MiB, the most that is accepted",
                longest >> 20
            ),
        };
        return Err(io::Error::new(io::ErrorKind::FileTooLarge, why));
    }
    Ok(())
}

fn is_regular(kind: FileType) -> io::Result<()> {
    if kind.is_file() {
        return Ok(());
    }
    let is = if kind.is_dir() {
        "a folder"
    } else {
        special(kind)
    };
    let why = format!("it is {is}, not a regular file");
    Err(io::Error::new(io::ErrorKind::InvalidInput, why))
}

#[cfg(unix)]
fn special(kind: FileType) -> &'static str {
    use std::os::unix::fs::FileTypeExt;
    match () {
        () if kind.is_fifo() => "a pipe",
        () if kind.is_socket() => "a socket",
        () => "a device",
    }
}

#[cfg(not(unix))]
fn special(_: FileType) -> &'static str {
    "a device"
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;
    use std::io::ErrorKind;

    fn folder(name: &str) -> std::path::PathBuf {
        let dir = std::env::temp_dir().join(format!("flexor-input-{name}-{}", std::process::id()));
        let _ = std::fs::remove_dir_all(&dir);
        std::fs::create_dir_all(&dir).unwrap();
        dir
    }

    #[test]
    fn what_is_no_regular_file_is_refused_by_its_kind() {
        let dir = folder("kinds");
        let pipe = dir.join("pipe");
        nix::unistd::mkfifo(&pipe, nix::sys::stat::Mode::S_IRWXU).unwrap();
        let socket = dir.join("socket");
        let _listener = std::os::unix::net::UnixListener::bind(&socket).unwrap();
        let link = dir.join("link");
        std::os::unix::fs::symlink(&pipe, &link).unwrap();
        for (path, is) in [
            (&*pipe, "a pipe"),
            (&*socket, "a socket"),
            (&*link, "a pipe"),
            (&*dir, "a folder"),
            (Path::new("/dev/zero"), "a device"),
        ] {
            let why = read(path, 9).unwrap_err();
            assert_eq!(why.kind(), ErrorKind::InvalidInput, "{is}");
            assert_eq!(why.to_string(), format!("it is {is}, not a regular file"));
        }
        std::fs::remove_dir_all(&dir).unwrap();
    }

    #[test]
    fn a_file_is_read_up_to_its_longest_length_and_no_further() {
        let dir = folder("lengths");
        let path = dir.join("file");
        std::fs::write(&path, "0123456789").unwrap();
        assert_eq!(read_text(&path, 10).unwrap(), "0123456789");
        assert_eq!(read(&path, 9).unwrap_err().kind(), ErrorKind::FileTooLarge);
        let long = "x".repeat(PART as usize + 3);
        std::fs::write(&path, &long).unwrap();
        assert_eq!(read_text(&path, PART + 3).unwrap(), long);
        assert_eq!(
            read_text(&path, PART + 2).unwrap_err().kind(),
            ErrorKind::FileTooLarge
        );
        // A sparse file of 1 TiB: it contains only zeros, which no table does.
        std::fs::File::create(&path)
            .unwrap()
            .set_len(1 << 40)
            .unwrap();
        for (longest, kind) in [
            (LONGEST_TYPED, ErrorKind::FileTooLarge),
            (LONGEST_TABLE, ErrorKind::InvalidData),
        ] {
            assert_eq!(read_text(&path, longest).unwrap_err().kind(), kind);
        }
        std::fs::write(&path, b"\xff\xfe").unwrap();
        assert_eq!(
            read_text(&path, 9).unwrap_err().kind(),
            ErrorKind::InvalidData
        );
        std::fs::remove_dir_all(&dir).unwrap();
    }
}
