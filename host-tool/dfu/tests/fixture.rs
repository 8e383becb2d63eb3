//! Shared test fixture: images, a connected session and the flash rules that must hold at
//! every moment.
#![allow(dead_code)]

use dfu::chip::STM32F405;
use dfu::container::Segment;
use dfu::flash::{Finish, FlashFailure, Image, Report, flash};
use dfu::protocol::Session;
use dfu::simulated::{Simulated, SimulatedClock};
use hal_sim::random::Sequence;

/// Contents of the stage table's sectors.
pub fn stage_table() -> Vec<u8> {
    (0..0x4_0000_u32)
        .map(|index| (index * 7 % 251) as u8)
        .collect()
}

/// Firmware of `length` bytes with valid vectors and contents by `seed`.
pub fn firmware(length: usize, seed: u64) -> Vec<u8> {
    firmware_with(0x2001_C000, length, seed)
}

/// Firmware with this initial stack pointer.
pub fn firmware_with(pointer: u32, length: usize, seed: u64) -> Vec<u8> {
    let mut random = Sequence::new(seed);
    let mut bytes: Vec<u8> = (0..length).map(|_| random.byte()).collect();
    bytes[0..4].copy_from_slice(&pointer.to_le_bytes());
    bytes[4..8].copy_from_slice(&0x0800_0189_u32.to_le_bytes());
    bytes
}

pub fn image(bytes: &[u8]) -> Image {
    let segment = Segment {
        address: STM32F405.origin,
        bytes: bytes.to_vec(),
    };
    Image::new(&STM32F405, &[segment]).unwrap()
}

/// Chip with old firmware and a stage table.
pub fn chip(old: &[u8]) -> (Simulated, SimulatedClock) {
    let clock = SimulatedClock::default();
    let mut device = Simulated::new(clock.clone());
    device.memory.preset(STM32F405.origin, old);
    device.memory.preset(STM32F405.firmware_end, &stage_table());
    (device, clock)
}

/// Flashes `image` and returns the device with the result.
pub fn run(
    device: Simulated,
    clock: &SimulatedClock,
    image: &Image,
    finish: Finish,
) -> (Simulated, Result<Report, FlashFailure>) {
    let size = device.transfer_size();
    let mut session = Session::new(device, clock.clone(), size, STM32F405.firmware());
    let result = flash(&mut session, image, finish, &mut |_| {});
    (session.into_transport(), result)
}

/// Contents of flash that a cut may leave behind.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Contents {
    /// Exactly as before.
    Old,
    /// Exactly the new image.
    New,
    /// As before except the first eight bytes, which start no program.
    OldExceptVectors,
    /// The new image except the first eight bytes, which start no program.
    NewExceptVectors,
    /// The CPU cannot start: no stack pointer in RAM or no reset vector in flash.
    Unbootable,
}

/// Classifies flash after a cut and checks the rules: untouched stage table, no valid vectors
/// unless the old or the new image is complete to the last bit.
pub fn classify(device: &Simulated, before: &[u8], image: &Image) -> Contents {
    let now = device.memory.bytes();
    let table = (STM32F405.firmware_end - STM32F405.origin) as usize;
    assert_eq!(now[table..], before[table..], "the stage table changed");
    assert!(!device.forbidden, "a forbidden command was sent");
    let length = image.bytes().len();
    if now == before {
        return Contents::Old;
    }
    if now[..length] == *image.bytes() {
        return Contents::New;
    }
    assert!(
        !STM32F405.is_vector_table(now, &STM32F405.firmware()),
        "valid vectors {:02x?} before an incomplete image",
        &now[..8]
    );
    if now[8..] == before[8..] {
        return Contents::OldExceptVectors;
    }
    if now[8..length] == image.bytes()[8..] && now[..8] != [0xFF; 8] {
        return Contents::NewExceptVectors;
    }
    Contents::Unbootable
}
