//! Images as files: read, checked against a board, written in the formats of other tools.

use dfu::chip::STM32F405;
use dfu::container::{self, DfuseIds, Segment};
use firmware::board::image::{BREADBOARD_KIND, ImageRecord};
use firmware::link::SCHEMA;
use hal_sim::chip::image::Image as ElfImage;
use hal_sim::images::sum;
use host_core::record::{DeviceKind, RecordError};
use host_core::run::{Board, board_image};
use std::path::{Path, PathBuf};

/// An image that fits the chip, and the record by which it names its board.
pub struct BoardImage {
    /// Image as the boot loader gets it.
    pub image: dfu::flash::Image,
    /// Board, version and protocol that the image states.
    pub record: ImageRecord,
    /// Where the image comes from.
    pub source: PathBuf,
}

/// Returns the image of `board`: from `file`, or the one that belongs to this program.
///
/// # Errors
/// E803 if the file is no image for this chip, or is damaged; E804 if it is for another board.
pub fn load(board: Board, file: Option<&Path>) -> anyhow::Result<BoardImage> {
    let (segments, source) = match file {
        None => {
            let image = board_image(None, board)?;
            let source = image.path().to_owned();
            (segments_of(image), source)
        }
        Some(path) => (read(path)?, path.to_owned()),
    };
    let refuse = |why: &dyn std::fmt::Display| {
        anyhow::anyhow!(
            "E803 {} cannot be written to the chip: {why}",
            source.display()
        )
    };
    let image = dfu::flash::Image::new(&STM32F405, &segments).map_err(|why| refuse(&why))?;
    let record = ImageRecord::from_image(image.bytes());
    let Some(record) = record else {
        return Err(refuse(
            &"it has no Flexor image record; build it with flexor image, or use another tool for \
              other firmware",
        ));
    };
    if record.origin != STM32F405.origin {
        return Err(refuse(&format_args!(
            "it is linked for {:#010x}, and the flash starts at {:#010x}",
            record.origin, STM32F405.origin
        )));
    }
    let end = record
        .sum_at
        .checked_sub(record.origin)
        .map(|end| end as usize + 4);
    let whole = end.and_then(|end| image.bytes().get(..end));
    if whole.is_none_or(|bytes| sum(bytes) != 0) {
        return Err(refuse(&"its checksum is wrong; copy or build it again"));
    }
    let behind = image.bytes().len() - whole.map_or(0, <[u8]>::len);
    if behind != 0 {
        return Err(refuse(&format_args!(
            "it has {behind} bytes behind its checksum, which does not cover them; copy or build it \
             again"
        )));
    }
    if record.board_name() != board.reported_name() {
        anyhow::bail!(
            "E804 {} is for the board {}, not for {}; give the other --board or another file",
            source.display(),
            record.board_name(),
            board.reported_name()
        );
    }
    anyhow::ensure!(
        record.schema == SCHEMA,
        "E803 {} speaks another version of the protocol than this program; use an image of this \
         version",
        source.display()
    );
    Ok(BoardImage {
        image,
        record,
        source,
    })
}

impl BoardImage {
    /// Describes the image in two lines.
    #[must_use]
    pub fn describe(&self) -> String {
        let [major, minor, patch] = self.record.version;
        let kind = match self.record.kind {
            BREADBOARD_KIND => DeviceKind::Breadboard.words(),
            _ => "board with output stages",
        };
        let commit = self.commit();
        let commit = commit.map_or_else(String::new, |commit| format!(" ({commit})"));
        format!(
            "{} {major}.{minor}.{patch}{commit}, {} bytes\n{kind}",
            self.record.board_name(),
            self.image.bytes().len()
        )
    }

    /// Returns the first 16 digits of the commit from which the image was built, if it states one.
    #[must_use]
    pub fn commit(&self) -> Option<String> {
        let commit = u64::from_be_bytes(self.record.commit);
        (commit != 0).then(|| format!("{commit:016x}"))
    }

    /// Returns the image as the only segment of a file.
    fn segments(&self) -> Vec<Segment> {
        vec![Segment {
            address: STM32F405.origin,
            bytes: self.image.bytes().to_vec(),
        }]
    }

    /// Writes the image as a raw binary, Intel HEX or DfuSe file.
    ///
    /// # Errors
    /// Fails if the file cannot be written.
    pub fn write(&self, format: Format, path: &Path) -> anyhow::Result<()> {
        let bytes = match format {
            Format::Binary => self.image.bytes().to_vec(),
            Format::Hex => container::write_hex(&self.segments())?.into_bytes(),
            Format::Dfuse => {
                let name = format!("Flexor {}", self.record.board_name());
                container::write_dfuse(&self.segments(), &name, DfuseIds::default())?
            }
        };
        std::fs::write(path, bytes).map_err(RecordError::write(path))?;
        Ok(())
    }
}

/// Format of an image file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// Content of flash from its start on.
    Binary,
    /// Intel HEX.
    Hex,
    /// DfuSe file of dfu-util and ST's tools.
    Dfuse,
}

fn segments_of(image: ElfImage) -> Vec<Segment> {
    vec![Segment {
        address: STM32F405.origin,
        bytes: image.flash,
    }]
}

/// Reads a file in any format; an ELF file is linked into segments as a programmer does.
fn read(path: &Path) -> anyhow::Result<Vec<Segment>> {
    let longest = container::MAX_FILE as u64;
    let bytes = hal_sim::input::read(path, longest);
    let bytes = bytes.map_err(|why| {
        anyhow::anyhow!(
            "E803 {} cannot be read: {why}; check the path",
            path.display()
        )
    })?;
    if bytes.starts_with(b"\x7FELF") {
        return Ok(segments_of(ElfImage::parse(path, &bytes)?));
    }
    container::read(&bytes, STM32F405.origin).map_err(|why| {
        anyhow::anyhow!(
            "E803 {} cannot be written to the chip: {why}",
            path.display()
        )
    })
}
