//! Compares the registers with RM0090 chapter 34, without a host.

use super::*;

const HZ: u64 = 168_000_000;

fn read(otg: &mut Otg, offset: u32) -> u32 {
    otg.read(offset, otg.now).unwrap()
}

fn write(otg: &mut Otg, offset: u32, value: u32) {
    otg.write(offset, value, otg.now).unwrap();
}

/// Attached controller after the bus reset, with FIFOs of 62, 16, 16, 16 words, and endpoint 1 bulk
/// in both directions with 64 bytes.
fn configured() -> Otg {
    let mut otg = Otg::new(HZ);
    write(&mut otg, offset::GCCFG, ccfg::PWRDWN | ccfg::NOVBUSSENS);
    write(&mut otg, offset::GRXFSIZ, 62);
    write(&mut otg, offset::DIEPTXF0, 16 << 16 | 62);
    for n in 0..3 {
        let start = 78 + 16 * n;
        write(&mut otg, offset::DIEPTXF1 + 4 * n, 16 << 16 | start);
    }
    otg.begin_bus_reset();
    otg.end_bus_reset();
    let bulk = 64 | ctl::USBAEP | 0b10 << 18 | ctl::SD0PID;
    write(&mut otg, 0x920, bulk | 1 << 22 | ctl::SNAK);
    write(&mut otg, 0xB20, bulk | ctl::SNAK);
    otg
}

fn arm_out(otg: &mut Otg, packets: u32, bytes: u32) {
    write(otg, 0xB30, packets << 19 | bytes);
    let control = read(otg, 0xB20);
    write(otg, 0xB20, control | ctl::CNAK | ctl::EPENA);
}

fn arm_in(otg: &mut Otg, bytes: &[u8]) {
    write(otg, 0x930, 1 << 19 | bytes.len() as u32);
    let control = read(otg, 0x920);
    write(otg, 0x920, control | ctl::CNAK | ctl::EPENA);
    for chunk in bytes.chunks_exact(4) {
        let word = u32::from_le_bytes([chunk[0], chunk[1], chunk[2], chunk[3]]);
        write(otg, 0x2000, word);
    }
}

#[test]
fn values_after_reset() {
    let mut otg = Otg::new(HZ);
    let expected = [
        (offset::GOTGCTL, otgctl::CIDSTS),
        (offset::GUSBCFG, 0x0A40),
        (offset::GRSTCTL, 0x8000_0000),
        (offset::GINTSTS, 0x0400_0020),
        (offset::GRXFSIZ, 0x0200),
        (offset::DIEPTXF0, 0x0200_0200),
        (offset::DIEPTXF1, 0x0200_0400),
        (offset::DCFG, 0x0220_0000),
        (0x900, 0x8000),
        (0xB00, 0x8000),
        (0x908, 0x80),
    ];
    for (offset, value) in expected {
        assert_eq!(read(&mut otg, offset), value, "{offset:#05x}");
    }
    assert!(!otg.line);
}

#[test]
fn vbus_connects_and_its_loss_ends_the_session() {
    let mut otg = Otg::new(HZ);
    write(&mut otg, offset::GINTMSK, int::SRQINT | int::OTGINT);
    write(&mut otg, offset::GAHBCFG, ahbcfg::GINT);
    write(&mut otg, offset::GCCFG, ccfg::PWRDWN | ccfg::VBUSBSEN);
    assert_eq!(otg.attached_since(), None, "no VBUS");
    otg.set_vbus(true, 0);
    let valid = otg.next_event();
    otg.advance(valid).unwrap();
    assert_eq!(otg.attached_since(), Some(valid));
    assert!(otg.line);
    write(&mut otg, offset::GINTSTS, int::SRQINT);
    assert!(!otg.line);
    assert_ne!(read(&mut otg, offset::GOTGCTL) & otgctl::BSVLD, 0);
    otg.set_vbus(false, valid);
    assert_eq!(otg.attached_since(), None);
    assert_eq!(read(&mut otg, offset::GOTGINT), SEDET);
    assert!(otg.line);
    write(&mut otg, offset::GOTGINT, SEDET);
    assert!(!otg.line);
}

#[test]
fn soft_disconnect_releases_the_pull_up() {
    let mut otg = configured();
    assert!(otg.attached_since().is_some());
    write(&mut otg, offset::DCTL, dctl::SDIS);
    assert_eq!(otg.attached_since(), None);
}

#[test]
fn flushes_clear_themselves_after_eight_phy_clocks() {
    let mut otg = configured();
    arm_in(&mut otg, &[7; 64]);
    assert_eq!(read(&mut otg, 0x938), 0, "16 words fill it");
    write(&mut otg, offset::GRSTCTL, rstctl::TXFFLSH | 1 << 6);
    assert_eq!(read(&mut otg, 0x938), 16);
    let busy = |otg: &mut Otg, at| otg.read(offset::GRSTCTL, at).unwrap() & 0x30;
    assert_ne!(busy(&mut otg, 27), 0);
    // 8 cycles of 48 MHz are 28 of 168 MHz.
    assert_eq!(busy(&mut otg, 28), 0);
}

#[test]
fn out_packet_to_interrupt() {
    let mut otg = configured();
    write(&mut otg, offset::GAHBCFG, ahbcfg::GINT);
    write(&mut otg, offset::GINTMSK, int::RXFLVL | int::OEPINT);
    write(&mut otg, offset::DOEPMSK, epint::XFRC);
    write(&mut otg, offset::DAINTMSK, 1 << 17);
    let packet = Packet::new(&[1, 2, 3, 4, 5], false);
    assert_eq!(otg.receive_out(0, 1, &packet), Handshake::Nak, "NAKSTS");
    arm_out(&mut otg, 1, 64);
    otg.receive_sof(0x5A3);
    assert_eq!(otg.receive_out(0, 1, &packet), Handshake::Ack);
    assert!(otg.line);
    // FRMNUM 3, PKTSTS 2, DATA0, 5 bytes, endpoint 1.
    let status = 3 << 21 | 2 << 17 | 5 << 4 | 1;
    assert_eq!(read(&mut otg, offset::GRXSTSR), status);
    assert_eq!(read(&mut otg, offset::GRXSTSP), status);
    assert!(otg.read(offset::GRXSTSP, 0).is_err(), "data first");
    assert_eq!(read(&mut otg, 0x1000), 0x0403_0201);
    assert_eq!(read(&mut otg, 0x1000), 0x05);
    // A short packet ends the transfer: NAKSTS, and an entry of its own.
    assert_ne!(read(&mut otg, 0xB20) & ctl::NAKSTS, 0);
    assert_ne!(read(&mut otg, 0xB20) & ctl::EPENA, 0, "until it is popped");
    assert_eq!(read(&mut otg, 0xB28), 0);
    assert_eq!(read(&mut otg, offset::GRXSTSP) >> 17 & 0xF, 3);
    assert_eq!(read(&mut otg, 0xB28), epint::XFRC);
    assert_eq!(read(&mut otg, 0xB20) & ctl::EPENA, 0);
    assert_eq!(read(&mut otg, offset::GINTSTS) & int::RXFLVL, 0);
    assert_eq!(read(&mut otg, offset::DAINT), 1 << 17);
    assert!(otg.line);
    write(&mut otg, 0xB28, epint::XFRC);
    assert!(!otg.line);
    assert_eq!(read(&mut otg, 0xB30), 59, "XFRSIZ less 5, PKTCNT 0");
}

#[test]
fn a_repeated_packet_is_acknowledged_and_dropped() {
    let mut otg = configured();
    arm_out(&mut otg, 2, 128);
    let packet = Packet::new(&[9; 64], false);
    assert_eq!(otg.receive_out(0, 1, &packet), Handshake::Ack);
    let words = otg.receive.len();
    assert_eq!(otg.receive_out(0, 1, &packet), Handshake::Ack);
    assert_eq!(otg.receive.len(), words);
    assert_eq!(read(&mut otg, 0xB30) >> 19 & 0x3FF, 1);
}

#[test]
fn a_full_receive_fifo_naks() {
    let mut otg = configured();
    arm_out(&mut otg, 10, 640);
    // 16 words of data and one of status each: after three packets, 11 of 62 are left.
    for n in 0..3 {
        let packet = Packet::new(&[n; 64], n % 2 == 1);
        assert_eq!(otg.receive_out(0, 1, &packet), Handshake::Ack);
    }
    assert!(!otg.out_ready(0, 1, 64));
    assert_eq!(
        otg.receive_out(0, 1, &Packet::new(&[3; 64], true)),
        Handshake::Nak
    );
    assert!(otg.out_ready(0, 1, 36), "9 words and 2");
}

#[test]
fn in_packet_waits_for_all_its_words() {
    let mut otg = configured();
    write(&mut otg, offset::DIEPMSK, epint::XFRC);
    assert_eq!(otg.in_token(0, 1), Reply::Nak);
    write(&mut otg, 0x930, 1 << 19 | 8);
    let control = read(&mut otg, 0x920);
    write(&mut otg, 0x920, control | ctl::CNAK | ctl::EPENA);
    write(&mut otg, 0x2000, 0x0403_0201);
    assert_eq!(otg.in_token(0, 1), Reply::Nak, "4 of 8 bytes");
    write(&mut otg, 0x2000, 0x0807_0605);
    let expected = Packet::new(&[1, 2, 3, 4, 5, 6, 7, 8], false);
    assert_eq!(otg.in_token(0, 1), Reply::Data(expected));
    assert_eq!(otg.in_token(0, 1), Reply::Data(expected), "no ACK: again");
    assert_ne!(read(&mut otg, 0x920) & ctl::EPENA, 0);
    otg.acknowledge(1, 8);
    assert_eq!(read(&mut otg, 0x920) & ctl::EPENA, 0);
    assert_eq!(read(&mut otg, 0x928) & epint::XFRC, epint::XFRC);
    assert_eq!(read(&mut otg, offset::DAINT), 1 << 1);
    arm_in(&mut otg, &[]);
    assert_eq!(otg.in_token(0, 1), Reply::Data(Packet::new(&[], true)));
}

#[test]
fn setup_naks_both_directions_and_ends_with_the_next_token() {
    let mut otg = configured();
    write(&mut otg, 0x900, ctl::STALL);
    write(&mut otg, 0xB10, 0b11 << 29);
    assert_eq!(otg.in_token(0, 0), Reply::Stall);
    let request = [0x80, 6, 0, 1, 0, 0, 8, 0];
    assert_eq!(otg.receive_setup(0, &request), Handshake::Ack);
    assert_eq!(read(&mut otg, 0xB10) >> 29, 2, "STUPCNT counts down");
    let expected = ctl::NAKSTS;
    assert_eq!(read(&mut otg, 0x900) & (ctl::STALL | ctl::NAKSTS), expected);
    assert_eq!(read(&mut otg, offset::GRXSTSP), 6 << 17 | 8 << 4);
    assert_eq!(read(&mut otg, 0x1000), 0x0100_0680);
    assert_eq!(read(&mut otg, 0x1000), 0x0008_0000);
    assert_eq!(read(&mut otg, offset::GINTSTS) & int::RXFLVL, 0);
    assert!(otg.in_ready(0, 0), "the token changes something");
    assert_eq!(otg.in_token(0, 0), Reply::Nak);
    assert!(!otg.in_ready(0, 0));
    assert_eq!(read(&mut otg, 0xB08), 0);
    assert_eq!(read(&mut otg, offset::GRXSTSP) >> 17 & 0xF, 4);
    assert_eq!(read(&mut otg, 0xB08), epint::STUP);
}

#[test]
fn a_new_address_counts_after_the_status_stage() {
    let mut otg = configured();
    write(&mut otg, offset::DCFG, 0b11 | 5 << 4);
    write(&mut otg, 0x910, 1 << 19);
    write(&mut otg, 0x900, ctl::CNAK | ctl::EPENA);
    assert_eq!(otg.in_token(5, 0), Reply::Silent);
    assert!(matches!(otg.in_token(0, 0), Reply::Data(_)));
    otg.acknowledge(0, 0);
    assert_eq!(otg.in_token(0, 0), Reply::Silent);
    assert_eq!(otg.in_token(5, 0), Reply::Nak);
}

#[test]
fn disabling_and_global_naks() {
    let mut otg = configured();
    arm_in(&mut otg, &[7; 8]);
    write(&mut otg, offset::DCTL, dctl::SGINAK);
    assert_eq!(otg.in_token(0, 1), Reply::Nak);
    assert_ne!(read(&mut otg, offset::GINTSTS) & int::GINAKEFF, 0);
    write(&mut otg, offset::DCTL, dctl::CGINAK);
    assert!(matches!(otg.in_token(0, 1), Reply::Data(_)));
    let control = read(&mut otg, 0x920);
    write(&mut otg, 0x920, control | ctl::SNAK | ctl::EPDIS);
    assert_eq!(read(&mut otg, 0x920) & ctl::EPENA, 0);
    let bits = epint::EPDISD | epint::INEPNE;
    assert_eq!(read(&mut otg, 0x928) & bits, bits);
    arm_out(&mut otg, 1, 64);
    write(&mut otg, offset::DCTL, dctl::SGONAK);
    assert_eq!(
        otg.receive_out(0, 1, &Packet::new(&[], false)),
        Handshake::Nak
    );
    assert_eq!(read(&mut otg, offset::GINTSTS) & int::GONAKEFF, 0);
    assert_eq!(read(&mut otg, offset::GRXSTSP) >> 17 & 0xF, 1);
    assert_ne!(read(&mut otg, offset::GINTSTS) & int::GONAKEFF, 0);
}

#[test]
fn a_bus_reset_makes_endpoints_inactive() {
    let mut otg = configured();
    otg.begin_bus_reset();
    assert_ne!(read(&mut otg, offset::GINTSTS) & int::USBRST, 0);
    assert_eq!(read(&mut otg, 0x920) & ctl::USBAEP, 0);
    assert_ne!(read(&mut otg, 0x900) & ctl::USBAEP, 0);
    assert_eq!(otg.in_token(0, 1), Reply::Silent);
    otg.end_bus_reset();
    assert_eq!(read(&mut otg, offset::DSTS) & 0b110, 0b110);
}

#[test]
fn empty_level_of_a_transmit_fifo() {
    let mut otg = configured();
    write(&mut otg, offset::GAHBCFG, ahbcfg::TXFELVL);
    arm_in(&mut otg, &[7; 4]);
    assert_eq!(read(&mut otg, 0x928) & epint::TXFE, 0, "not completely");
    write(&mut otg, offset::GAHBCFG, 0);
    assert_ne!(read(&mut otg, 0x928) & epint::TXFE, 0, "1 of 16 words");
    assert_eq!(read(&mut otg, offset::DAINT), 0, "masked");
    write(&mut otg, offset::DIEPEMPMSK, 1 << 1);
    assert_eq!(read(&mut otg, offset::DAINT), 1 << 1);
}

#[test]
fn what_nobody_needs_is_refused_by_name() {
    let mut otg = configured();
    let bad = [
        (offset::GUSBCFG, usbcfg::FHMOD),
        (offset::GINTMSK, 1 << 24),
        (offset::DCTL, 1),
        (offset::DCFG, 0),
        (offset::GRXFSIZ, 321),
        (offset::DIEPMSK, 1 << 4),
        (offset::PCGCCTL, 1),
        (0x920, ctl::ISOCHRONOUS),
        (0x400, 0),
    ];
    for (offset, value) in bad {
        let result = otg.write(offset, value, 0);
        assert!(result.is_err(), "{offset:#05x} {value:#x}");
    }
    assert!(otg.read(0x1000, 0).is_err(), "empty FIFO");
}
