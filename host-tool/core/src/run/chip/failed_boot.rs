//! Explains why an image did not open its USB port: the log, and the backup registers, in which the
//! image keeps a failure before USB has a clock (docs/evidence/faults.md, Details of a fault).

use super::{ChipError, LogFile};
use firmware::board::boot_failure::{self, Failure, REGISTER, VALUE_REGISTER};
use firmware::board::image::ImageRecord;
use hal_sim::chip::board::{BoardError, Surroundings};
use hal_sim::chip::image::Image;

/// Writes what the image logged until its boot failed with `error`, and returns the error with the
/// cause that the image kept.
pub(super) fn explain(
    error: BoardError,
    chip: &mut Surroundings,
    image: &Image,
    mut log: LogFile,
) -> ChipError {
    // The failed boot matters more than a log that cannot be written.
    let _ = log.drain(chip);
    let registers = [REGISTER, VALUE_REGISTER].map(|register| chip.soc.backup.word(register));
    match (error, cause(registers, &image.flash)) {
        (BoardError::NoPort { .. }, Some(cause)) => BoardError::NoPort {
            why: format!(": {cause}"),
        },
        (error, _) => error,
    }
    .into()
}

/// Returns the failure in the two registers in words.
fn cause([failure, value]: [u32; 2], flash: &[u8]) -> Option<String> {
    let code = boot_failure::code(failure)?;
    let mhz = |hz: u32| format!("{:.2} MHz", f64::from(hz) / 1e6);
    let expected = ImageRecord::from_image(flash).map(|record| mhz(record.crystal_hz));
    let expected = expected.unwrap_or_else(|| "another frequency".to_owned());
    let known = Failure::ALL.into_iter().find(|known| *known as u8 == code);
    Some(match known {
        Some(Failure::CrystalMissing) => "the crystal does not start".to_owned(),
        Some(Failure::CrystalWrong) => format!(
            "the crystal has {}, and the image is for a board with {expected}",
            mhz(value)
        ),
        Some(Failure::Ram) => "a cell of RAM is defective".to_owned(),
        Some(Failure::SupplyLow) => "the supply is too low to start".to_owned(),
        None => format!("the boot failed with code {code}"),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_cause_is_named_only_if_the_image_kept_one() {
        let words = |code: u32, value| cause([0x4255_0300 | code, value], &[]);
        assert_eq!(cause([2, 12_000_000], &[]), None);
        assert_eq!(words(1, 0).as_deref(), Some("the crystal does not start"));
        let wrong = words(2, 12_003_000).unwrap();
        assert!(wrong.contains("12.00 MHz"), "{wrong}");
        assert!(words(3, 0).unwrap().contains("RAM"));
        assert!(words(4, 0).unwrap().contains("supply"));
        assert!(words(9, 0).unwrap().contains("code 9"));
    }
}
