//! Numbers by which USB identifies the boot loader and its protocol.

/// USB vendor ID of STMicroelectronics.
pub const VENDOR_ID: u16 = 0x0483;
/// USB product ID of ST's ROM boot loader in DFU mode.
pub const PRODUCT_ID: u16 = 0xDF11;

/// DFU version of DfuSe as binary-coded decimal.
pub const DFUSE_VERSION: u16 = 0x011A;
