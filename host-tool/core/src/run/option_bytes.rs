//! Describes the chip's option bytes that differ from their required values.

use firmware::link::message::OptionBytes;

/// Describes each option byte that differs from the value that docs/evidence/hil.md requires, with the
/// consequence if it has one. Returns an empty list if all have the required values.
#[must_use]
pub fn describe_option_bytes(found: &OptionBytes) -> Vec<String> {
    let wanted = OptionBytes::WANTED;
    let mut deviations = Vec::new();
    if found.brown_out_level != wanted.brown_out_level {
        let level = match found.brown_out_level {
            0 => "off".to_owned(),
            level => format!("at level {level}"),
        };
        deviations.push(format!(
            "brown-out reset is {level}, not at level 3: the supply voltage is monitored only \
             while the program runs"
        ));
    }
    if found.hardware_watchdog != wanted.hardware_watchdog {
        deviations.push("the hardware starts the watchdog; the program should start it".to_owned());
    }
    if found.read_protection != wanted.read_protection {
        deviations.push(format!(
            "read protection is at level {}; it should be at level 0",
            found.read_protection
        ));
    }
    deviations
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_not_as_it_ought_to_be_is_told() {
        assert_eq!(describe_option_bytes(&OptionBytes::WANTED), [""; 0]);
        // The value as delivered (RM0090 3.9.7), then a value in which every field differs.
        let delivered = describe_option_bytes(&OptionBytes::from_optcr(0x0FFF_AAED));
        assert_eq!(delivered.len(), 1);
        assert!(delivered[0].contains("brown-out reset is off"));
        let other = describe_option_bytes(&OptionBytes::from_optcr(0x0FFF_CCC9));
        assert_eq!(other.len(), 3, "{other:?}");
        assert!(other[0].contains("level 1"), "{other:?}");
        assert!(other[2].contains("level 2"), "{other:?}");
    }
}
