//! Choice of the boot loader that is written.

use dfu::flash::{DeviceSummary, Expected, FlashError, select_device};

fn device(serial: Option<&str>, address: u8) -> DeviceSummary {
    DeviceSummary {
        serial: serial.map(str::to_owned),
        bus: "3".into(),
        address,
    }
}

#[test]
fn devices_are_selected_by_serial_number() {
    let two = [
        device(Some("3262355B3231"), 5),
        device(Some("207A36915253"), 6),
    ];
    assert_eq!(select_device(&[], None), Err(FlashError::NoDevice));
    assert_eq!(select_device(&[], Some("1")), Err(FlashError::NoDevice));
    assert_eq!(select_device(&two[..1], None), Ok(&two[0]));
    assert_eq!(select_device(&two, Some("207a36915253")), Ok(&two[1]));
    let several = select_device(&two, None).unwrap_err();
    assert!(matches!(several, FlashError::SeveralDevices { .. }));
    assert!(
        several
            .to_string()
            .contains("3262355B3231 at bus 3 address 5; serial 207A")
    );
    let unknown = select_device(&two, Some("33")).unwrap_err();
    assert!(matches!(unknown, FlashError::UnknownSerial { .. }));
    let nameless = [device(None, 5), device(Some("\u{1b}[2J\u{7f}é"), 6)];
    let text = select_device(&nameless, None).unwrap_err().to_string();
    assert!(
        text.contains("serial unknown") && text.contains("?[2J??"),
        "{text}"
    );
}

/// Numbers of chips and the serial numbers of their boot loaders, as people read them: an F4 and an
/// F412 (community.st.com, "USB bootloader serial number" and "Algorithm to derive USB-DFU
/// iSerialNumber").
const CHIPS: [([u32; 3], &str); 2] = [
    ([0x002D_0030, 0x3334_510B, 0x3231_3533], "325E35633334"),
    ([0x0023_001F, 0x3537_5109, 0x3637_3731], "365A375A3537"),
];

#[test]
fn a_boot_loader_that_was_there_before_is_not_written() {
    let foreign = device(Some("207A36915253"), 6);
    for (unique_id, serial) in CHIPS {
        let own = device(Some(&serial.to_lowercase()), 7);
        let expected = Expected::new(unique_id, vec![], None).unwrap();
        assert_eq!(expected.select(&[]), Err(FlashError::NoDevice));
        assert_eq!(expected.select(std::slice::from_ref(&own)), Ok(&own));
        // A boot loader that starts at the same time.
        let both = [foreign.clone(), own.clone()];
        assert_eq!(expected.select(&both), Ok(&own));
        let other = expected.select(&both[..1]).unwrap_err();
        assert!(matches!(other, FlashError::UnknownSerial { .. }), "{other}");
        let text = other.to_string();
        assert!(
            text.contains("207A36915253") && text.contains("35"),
            "{text}"
        );
        // One that is there already.
        let refused = Expected::new(unique_id, vec![foreign.clone()], None).unwrap_err();
        assert!(matches!(refused, FlashError::AlreadyConnected { .. }));
        let text = refused.to_string();
        assert!(text.contains("207A36915253"), "{text}");
        // The user names one: it must be new, and the foreign one is not taken.
        let named = Expected::new(unique_id, vec![foreign.clone()], Some(serial)).unwrap();
        assert_eq!(named.select(&both[..1]), Err(FlashError::NoDevice));
        assert_eq!(named.select(&both), Ok(&own));
        let moved = [device(Some("207A36915253"), 9)];
        assert_eq!(named.select(&moved), Err(FlashError::NoDevice));
        let same = Expected::new(unique_id, vec![own.clone()], Some(serial)).unwrap_err();
        assert!(matches!(same, FlashError::AlreadyConnected { .. }));
        // The user's number counts, not the derived one.
        let named = Expected::new(unique_id, vec![], Some("207a36915253")).unwrap();
        assert_eq!(named.select(&both), Ok(&foreign));
        assert!(named.select(&both[1..]).is_err());
    }
}

#[test]
fn a_new_boot_loader_without_a_readable_number_must_be_alone() {
    let (unique_id, serial) = CHIPS[0];
    let (first, second) = (device(None, 5), device(None, 6));
    let expected = Expected::new(unique_id, vec![], None).unwrap();
    assert_eq!(expected.select(std::slice::from_ref(&first)), Ok(&first));
    let two = [first.clone(), second.clone()];
    let several = expected.select(&two).unwrap_err();
    assert!(matches!(several, FlashError::SeveralDevices { .. }));
    let own = [first.clone(), device(Some(serial), 8)];
    assert_eq!(expected.select(&own), Ok(&own[1]));
    // A number that the user gives must be read.
    let named = Expected::new(unique_id, vec![first], Some(serial)).unwrap();
    assert_eq!(named.select(&two[..1]), Err(FlashError::NoDevice));
    assert!(named.select(&two).is_err());
}
