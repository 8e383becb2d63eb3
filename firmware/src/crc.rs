//! The one check sum of this crate: CRC-32/ISO-HDLC, least significant byte first
//! on the wire and in memory.

use crc::{CRC_32_ISO_HDLC, Crc};

/// Its table stands in flash once.
pub(crate) static CRC: Crc<u32> = Crc::<u32>::new(&CRC_32_ISO_HDLC);
