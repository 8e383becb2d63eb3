//! CRC-32/ISO-HDLC, the only CRC of this crate; least significant byte first on the wire and in
//! memory.

use crc::{CRC_32_ISO_HDLC, Crc};

/// The CRC-32 and its table, which is stored in flash once.
pub(crate) static CRC: Crc<u32> = Crc::<u32>::new(&CRC_32_ISO_HDLC);
