//! Version of the firmware, and what every board reports about itself to USB.

/// USB vendor and product id of every Flexor board: a test identity of pid.codes, which anybody may
/// use. A product needs its own; until then hosts look at the manufacturer too.
pub const USB_IDS: (u16, u16) = (0x1209, 0x0001);
/// Manufacturer that every Flexor board reports to USB.
pub const USB_MANUFACTURER: &str = "Flexor";

/// Version of the firmware: major, minor, patch.
pub const VERSION: [u8; 3] = [
    digit(env!("CARGO_PKG_VERSION_MAJOR")),
    digit(env!("CARGO_PKG_VERSION_MINOR")),
    digit(env!("CARGO_PKG_VERSION_PATCH")),
];

// USB reports each part as a digit of bcdDevice.
const _: () = assert!(VERSION[0] < 10 && VERSION[1] < 10 && VERSION[2] < 10);

/// Returns the value of a part of the version, or 10 if it is not a single digit.
const fn digit(part: &str) -> u8 {
    match part.as_bytes() {
        [digit @ b'0'..=b'9'] => *digit - b'0', // at least b'0' by the pattern
        _ => 10,
    }
}
