use super::*;

const PLAYING: u32 = 6 << 25 | 3 << 16 | 2 << 13 | 2 << 11 | 1 << 10 | 1 << 8 | 1 << 6;

fn write(
    dma: &mut Dma,
    stream: usize,
    register: u32,
    value: u32,
) -> Result<(), crate::chip::cpu::bus::Unmodelled> {
    dma.write(stream_offset(stream, register), value, 0)
}

fn read(dma: &Dma, offset: u32) -> u32 {
    dma.read(offset).unwrap()
}

/// DMA2 with stream 5 ready to play 10 words to GPIOB_BSRR.
fn ready() -> Dma {
    let mut dma = Dma::new(2);
    write(&mut dma, 5, offset::PAR, 0x4002_0418).unwrap();
    write(&mut dma, 5, offset::M0AR, 0x2001_C000).unwrap();
    write(&mut dma, 5, offset::NDTR, 10).unwrap();
    write(&mut dma, 5, offset::FCR, 0).unwrap();
    write(&mut dma, 5, offset::CR, PLAYING).unwrap();
    dma
}

#[test]
fn reset_values_and_addresses() {
    let dma = Dma::new(2);
    assert_eq!(stream_offset(7, offset::FCR), 0xCC);
    for stream in 0..STREAMS {
        assert_eq!(read(&dma, stream_offset(stream, offset::CR)), 0);
        assert_eq!(read(&dma, stream_offset(stream, offset::FCR)), 0x21);
    }
    assert!(dma.read(0xD0).is_err());
}

/// RM0090 10.5.1–10.5.4: six bits at 0, 6, 16, 22.
#[test]
fn flags_have_their_places_and_clear_by_ones() {
    let mut dma = Dma::new(2);
    for (stream, shift) in [(0, 0), (1, 6), (2, 16), (3, 22), (4, 0), (7, 22)] {
        dma.raise(stream, bit::TCIF);
        let (isr, ifcr) = [(0, 8), (4, 12)][stream / 4];
        assert_eq!(read(&dma, isr), bit::TCIF << shift);
        dma.write(ifcr, !(bit::TCIF << shift), 0).unwrap();
        assert_eq!(read(&dma, isr), bit::TCIF << shift);
        dma.write(ifcr, bit::TCIF << shift, 0).unwrap();
        assert_eq!(read(&dma, isr), 0);
    }
}

#[test]
fn an_enabled_stream_keeps_its_settings() {
    let mut dma = ready();
    write(&mut dma, 5, offset::CR, PLAYING | bit::EN).unwrap();
    assert_eq!(dma.enabled(), 1 << 5);
    write(&mut dma, 5, offset::NDTR, 99).unwrap();
    write(&mut dma, 5, offset::CR, bit::EN).unwrap();
    assert_eq!(read(&dma, stream_offset(5, offset::NDTR)), 10);
    assert_eq!(read(&dma, stream_offset(5, offset::CR)), PLAYING | bit::EN);
}

#[test]
fn items_count_down_raise_half_and_whole_and_start_anew() {
    let mut dma = ready();
    write(&mut dma, 5, offset::CR, PLAYING | bit::EN).unwrap();
    for left in (1..10).rev() {
        assert!(dma.count(5));
        assert_eq!(read(&dma, stream_offset(5, offset::NDTR)), left);
        let half = if left <= 5 { bit::HTIF << 6 } else { 0 };
        assert_eq!(read(&dma, offset::HISR), half);
    }
    assert!(dma.count(5), "circular");
    assert_eq!(read(&dma, stream_offset(5, offset::NDTR)), 10);
    assert_eq!(read(&dma, offset::HISR), (bit::HTIF | bit::TCIF) << 6);
}

/// RM0090 10.3.4: level first, then the lower number.
#[test]
fn the_arbiter_takes_level_then_number() {
    let mut dma = Dma::new(2);
    for (stream, level) in [(1, 0), (3, 2), (6, 2), (7, 1)] {
        write(&mut dma, stream, offset::CR, level << 16).unwrap();
    }
    assert_eq!(dma.arbitrate(0b1100_1010), Some(3));
    assert_eq!(dma.arbitrate(0b1100_0010), Some(6));
    assert_eq!(dma.arbitrate(0b1000_0010), Some(7));
    assert_eq!(dma.arbitrate(0b0000_0010), Some(1));
    assert_eq!(dma.arbitrate(0), None);
}

/// RM0090 table 43, TIM1's entries.
#[test]
fn tim1_asks_the_streams_of_the_table() {
    let events = |channel| [0, 1, 2, 3, 4, 5, 6, 7].map(|stream| tim1_events(stream, channel));
    let (up, ch1, ch2, ch3, ch4) = (Some(1), Some(2), Some(4), Some(8), Some(16));
    assert_eq!(events(6), [Some(0), ch1, ch2, ch1, ch4, up, ch3, None]);
    assert_eq!(
        events(0),
        [None, None, None, None, None, None, Some(14), None]
    );
    assert!(
        (1..6)
            .chain([7])
            .all(|channel| events(channel) == [None; 8])
    );
}

#[test]
fn ahb_and_apb_at_once_stop_the_run() {
    let mut dma = ready();
    write(&mut dma, 5, offset::CR, PLAYING | bit::EN).unwrap();
    write(&mut dma, 3, offset::PAR, 0x4001_300C).unwrap(); // SPI1_DR
    write(&mut dma, 3, offset::NDTR, 1).unwrap();
    let refusal = write(&mut dma, 3, offset::CR, 3 << 25 | bit::EN).unwrap_err();
    assert_eq!(refusal.0, "DMA2 serves AHB and APB at once (ES0182)");
}

#[test]
fn what_nobody_models_is_refused_when_enabled() {
    let enable = |change: &dyn Fn(&mut Dma)| {
        let mut dma = ready();
        change(&mut dma);
        let cr = read(&dma, stream_offset(5, offset::CR));
        write(&mut dma, 5, offset::CR, cr | bit::EN).is_err()
    };
    assert!(!enable(&|_| ()));
    let set = |register, value| move |dma: &mut Dma| write(dma, 5, register, value).unwrap();
    assert!(enable(&set(offset::NDTR, 0)));
    assert!(enable(&set(offset::FCR, 4)), "FIFO mode");
    assert!(enable(&set(offset::PAR, 0x4002_0414)), "ODR");
    assert!(enable(&set(offset::PAR, 0x4001_2C34)), "TIM1_CCR1");
    assert!(enable(&set(offset::M0AR, 0x1000_0000)), "CCM");
    assert!(enable(&set(offset::M0AR, 0x2001_BFFC)), "both SRAMs");
    assert!(enable(&set(offset::M0AR, 0x2001_FFFC)), "beyond SRAM2");
    assert!(enable(&set(offset::CR, PLAYING ^ 1 << 13)), "half-words");
    assert!(enable(&set(offset::CR, PLAYING | 1 << 9)), "PINC");
    assert!(enable(&set(offset::CR, PLAYING | 1 << 18)), "double buffer");
    assert!(
        enable(&set(offset::CR, PLAYING ^ 1 << 25)),
        "another peripheral"
    );
    let mut dma1 = Dma::new(1);
    assert!(write(&mut dma1, 0, offset::CR, bit::EN).is_err());
}

#[test]
fn a_flag_whose_enable_is_set_asks_for_an_interrupt() {
    let mut dma = ready();
    write(&mut dma, 5, offset::CR, PLAYING | bit::EN).unwrap();
    dma.raise(5, bit::TCIF);
    dma.raise(5, bit::FEIF);
    assert_eq!(dma.interrupts(), 0, "no enable is set");
    let asked = |enables: u32| {
        let mut dma = dma.clone();
        let cr = read(&dma, stream_offset(5, offset::CR));
        write(&mut dma, 5, offset::CR, cr | enables).unwrap();
        dma.interrupts()
    };
    // DMEIE, TEIE, HTIE, TCIE.
    assert_eq!([1, 2, 3, 4].map(|n| asked(1 << n)), [0, 0, 0, 1 << 5]);
    let fcr = stream_offset(5, offset::FCR);
    assert!(dma.upset(fcr, bit::FEIE, 0).unwrap());
    assert_eq!(dma.interrupts(), 1 << 5, "FEIE");
}
