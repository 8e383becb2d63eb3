//! Record behind the vectors of an image, which says for which board it is and where its checksum
//! lies. Programs that write images into flash read it; the device itself does not.
#![forbid(unsafe_code)]

use super::wiring::BOARD_NAME;

/// Length of the record, bytes.
pub const LENGTH: usize = 64;
/// Offset of the record from the start of the image, bytes: the length of the vector table, 16
/// exceptions and 82 interrupts (RM0090 table 61).
pub const OFFSET: usize = 4 * (16 + 82);
/// Position in the record of the commit from which the image was built: the first eight bytes of its
/// hash, zeros if it is not known. The release writes it after linking.
pub const COMMIT_AT: usize = 48;
/// First bytes of the record; the last is its version.
pub const MAGIC: [u8; 8] = *b"FLEXOR\0\x01";
/// [`ImageRecord::kind`] of an image that drives output stages.
pub const BOARD_KIND: u8 = 0;
/// [`ImageRecord::kind`] of an image with simulated output stages.
pub const BREADBOARD_KIND: u8 = 1;

/// Content of the record.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct ImageRecord {
    /// Name of the board, in ASCII, filled up with zeros.
    pub board: [u8; BOARD_NAME],
    /// Version of the firmware: major, minor, patch.
    pub version: [u8; 3],
    /// [`BOARD_KIND`] or [`BREADBOARD_KIND`].
    pub kind: u8,
    /// Frequency of the board's crystal, Hz.
    pub crystal_hz: u32,
    /// Schema hash of the protocol ([`crate::link::SCHEMA`]).
    pub schema: u64,
    /// Address for which the image is linked.
    pub origin: u32,
    /// Address of the checksum, the last word of the image.
    pub sum_at: u32,
    /// First bytes of the commit's hash, or zeros ([`COMMIT_AT`]).
    pub commit: [u8; 8],
}

impl ImageRecord {
    /// Reads the record from the start of `image`, the content of flash from the image's origin on;
    /// `None` if there is none.
    #[must_use]
    pub fn from_image(image: &[u8]) -> Option<Self> {
        let record: &[u8; LENGTH] = image.get(OFFSET..)?.first_chunk()?;
        let rest = record.strip_prefix(&MAGIC)?;
        let (board, rest) = rest.split_first_chunk()?;
        let (version, rest) = rest.split_first_chunk()?;
        let (&[kind], rest) = rest.split_first_chunk()?;
        let (crystal, rest) = rest.split_first_chunk()?;
        let (schema, rest) = rest.split_first_chunk()?;
        let (origin, rest) = rest.split_first_chunk()?;
        let (sum_at, rest) = rest.split_first_chunk()?;
        let (commit, _) = rest.split_first_chunk()?;
        Some(Self {
            board: *board,
            version: *version,
            kind,
            crystal_hz: u32::from_le_bytes(*crystal),
            schema: u64::from_le_bytes(*schema),
            origin: u32::from_le_bytes(*origin),
            sum_at: u32::from_le_bytes(*sum_at),
            commit: *commit,
        })
    }

    /// Returns the name of the board; empty if it is not text.
    #[must_use]
    pub fn board_name(&self) -> &str {
        let end = self.board.iter().position(|&byte| byte == 0);
        let name = self.board.get(..end.unwrap_or(BOARD_NAME));
        name.and_then(|name| core::str::from_utf8(name).ok())
            .unwrap_or_default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_record_is_found_behind_the_vectors_only() {
        let mut image = [0xFF; OFFSET + LENGTH];
        assert_eq!(ImageRecord::from_image(&image), None);
        let mut record = [0_u8; LENGTH];
        record[..8].copy_from_slice(&MAGIC);
        record[8..13].copy_from_slice(b"board");
        record[24..28].copy_from_slice(&[1, 2, 3, BREADBOARD_KIND]);
        record[28..32].copy_from_slice(&12_000_000_u32.to_le_bytes());
        record[32..40].copy_from_slice(&0x0123_4567_89AB_CDEF_u64.to_le_bytes());
        record[40..44].copy_from_slice(&0x0800_0000_u32.to_le_bytes());
        record[44..48].copy_from_slice(&0x0804_0000_u32.to_le_bytes());
        record[48..56].copy_from_slice(&[1, 2, 3, 4, 5, 6, 7, 8]);
        image[OFFSET..].copy_from_slice(&record);
        let found = ImageRecord::from_image(&image).unwrap();
        assert_eq!((found.board_name(), found.version), ("board", [1, 2, 3]));
        assert_eq!(found.commit, [1, 2, 3, 4, 5, 6, 7, 8]);
        assert_eq!(
            (found.kind, found.crystal_hz),
            (BREADBOARD_KIND, 12_000_000)
        );
        assert_eq!(
            (found.schema, found.origin),
            (0x0123_4567_89AB_CDEF, 0x0800_0000)
        );
        assert_eq!(found.sum_at, 0x0804_0000);
        assert_eq!(ImageRecord::from_image(&image[..OFFSET + LENGTH - 1]), None);
        image[OFFSET + 7] = 2;
        assert_eq!(ImageRecord::from_image(&image), None, "another version");
    }
}
