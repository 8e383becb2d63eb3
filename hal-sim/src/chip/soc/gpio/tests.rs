use super::*;

const B: usize = 1;

fn write(gpio: &mut Gpio, offset: u32, value: u32, done: Cycle) {
    gpio.write(B, offset, Lanes::whole(value), done).unwrap();
}

fn read(gpio: &Gpio, port: usize, offset: u32) -> u32 {
    gpio.clone().read(port, offset).unwrap()
}

/// RM0090 8.4: reset values.
#[test]
fn ports_reset_to_the_debug_pins_only() {
    let gpio = Gpio::default();
    assert_eq!(read(&gpio, 0, offset::MODER), 0xA800_0000);
    assert_eq!(read(&gpio, 0, offset::PUPDR), 0x6400_0000);
    assert_eq!(read(&gpio, 1, offset::MODER), 0x280);
    assert_eq!(read(&gpio, 1, offset::PUPDR), 0x100);
    assert_eq!(read(&gpio, 2, offset::MODER), 0);
    // Pull-ups on PA13, PA15, PB4 (NJTRST).
    assert_eq!(read(&gpio, 0, offset::IDR), 0b101 << 13);
    assert_eq!(read(&gpio, 1, offset::IDR), 1 << 4);
}

#[test]
fn bsrr_sets_resets_and_lets_set_win() {
    let mut gpio = Gpio::default();
    write(&mut gpio, offset::BSRR, 0b11, 5);
    assert_eq!(read(&gpio, B, offset::ODR), 0b11);
    assert!(gpio.edges.is_empty(), "inputs make no edge");
    write(&mut gpio, offset::MODER, 0b0101 | 0x280, 9);
    write(&mut gpio, offset::BSRR, 0b11 << 16 | 0b10, 12);
    let edges: Vec<Edge> = gpio.edges.drain(..).collect();
    let seen: Vec<_> = edges.iter().map(|e| (e.cycle, e.changed)).collect();
    assert_eq!(seen, [(9, 0b11), (12, 0b01)]);
    assert_eq!(edges[1].levels, 0b10 | 1 << 4);
    assert_eq!(read(&gpio, B, offset::BSRR), 0);
}

#[test]
fn a_pin_follows_what_drives_it_else_its_pull_else_low() {
    let mut gpio = Gpio::default();
    assert_eq!(gpio.drive(B, 3, Level::High), Some(true));
    assert_eq!(gpio.drive(B, 3, Level::High), None);
    assert_eq!(gpio.drive(B, 3, Level::Open), Some(false));
    write(&mut gpio, offset::PUPDR, 0b01 << 6, 4);
    assert!(gpio.level(B, 3));
    assert_eq!(gpio.drive(B, 3, Level::Low), Some(false));
    // Push-pull overrides an external level, open drain only pulls down.
    write(&mut gpio, offset::MODER, 0b01 << 6, 6);
    write(&mut gpio, offset::BSRR, 1 << 3, 7);
    assert!(gpio.level(B, 3));
    write(&mut gpio, offset::OTYPER, 1 << 3, 8);
    assert!(!gpio.level(B, 3));
    assert_eq!(gpio.drive(B, 3, Level::Open), Some(true));
    write(&mut gpio, offset::BSRR, 1 << 19, 10);
    assert!(!gpio.level(B, 3));
}

#[test]
fn an_analogue_pin_reads_zero() {
    let mut gpio = Gpio::default();
    gpio.drive(B, 0, Level::High);
    assert_eq!(read(&gpio, B, offset::IDR) & 1, 1);
    write(&mut gpio, offset::MODER, 0b11, 2);
    assert_eq!(read(&gpio, B, offset::IDR) & 1, 0);
}

#[test]
fn functions_need_mode_and_number() {
    let mut gpio = Gpio::default();
    assert!(!gpio.has_function(B, 15, 1));
    write(&mut gpio, offset::AFRH, 1 << 28, 1);
    assert!(!gpio.has_function(B, 15, 1));
    write(&mut gpio, offset::MODER, 0b10 << 30, 1);
    assert!(gpio.has_function(B, 15, 1));
    assert!(!gpio.has_function(B, 15, 2));
}

#[test]
fn narrow_accesses_and_other_ports_are_refused() {
    let mut gpio = Gpio::default();
    assert!(gpio.read(B, 0x28).is_err());
    assert!(gpio.read(PORTS, offset::IDR).is_err());
}

/// Performs the key sequence for `pins`: three writes and a read.
fn lock(gpio: &mut Gpio, pins: u32) -> u32 {
    for key in [1 << 16, 0, 1 << 16] {
        write(gpio, offset::LCKR, key | pins, 1);
    }
    gpio.read(B, offset::LCKR).unwrap()
}

#[test]
fn a_locked_pin_keeps_its_configuration_until_reset() {
    let mut gpio = Gpio::default();
    write(&mut gpio, offset::MODER, 0b01 << 2, 0);
    assert_eq!(lock(&mut gpio, 1 << 1 | 1 << 9), 1 << 16 | 1 << 9 | 1 << 1);
    let registers = [
        (offset::MODER, 0xFFF3_FFF3 | 0b01 << 2),
        (offset::OTYPER, 0xFDFD),
        (offset::OSPEEDR, 0xFFF3_FFF3),
        (offset::PUPDR, 0xFFF3_FFF3),
        (offset::AFRL, 0xFFFF_FF0F),
        (offset::AFRH, 0xFFFF_FF0F),
    ];
    for (register, kept) in registers {
        write(&mut gpio, register, u32::MAX, 2);
        assert_eq!(read(&gpio, B, register), kept, "{register:#x}");
    }
    // Data are not configuration.
    write(&mut gpio, offset::BSRR, 1 << 1, 3);
    assert!(gpio.level(B, 1));
    // The lock itself stays, whatever is written.
    assert_eq!(lock(&mut gpio, 0), 1 << 16 | 1 << 9 | 1 << 1);
    gpio.reset_port(B, 4);
    assert_eq!(read(&gpio, B, offset::LCKR), 0);
    write(&mut gpio, offset::MODER, 0, 5);
    assert_eq!(read(&gpio, B, offset::MODER), 0);
}

#[test]
fn a_key_with_any_error_locks_nothing() {
    let key = 1 << 16;
    let wrong: [&[u32]; 5] = [
        &[key | 2, 2],
        &[key | 2, 2, key | 3],
        &[key | 2, 3, key | 2],
        &[2, key | 2, 2],
        &[key | 2, key | 2, 2],
    ];
    for writes in wrong {
        let mut gpio = Gpio::default();
        for &value in writes {
            write(&mut gpio, offset::LCKR, value, 1);
        }
        let seen = gpio.read(B, offset::LCKR).unwrap();
        assert_eq!(seen & key, 0, "{writes:x?}");
        write(&mut gpio, offset::MODER, 0, 2);
        assert_eq!(read(&gpio, B, offset::MODER), 0);
    }
    // A read before the third write also aborts the sequence.
    let mut gpio = Gpio::default();
    write(&mut gpio, offset::LCKR, key | 2, 1);
    write(&mut gpio, offset::LCKR, 2, 1);
    assert_eq!(gpio.read(B, offset::LCKR), Ok(2));
    write(&mut gpio, offset::LCKR, key | 2, 1);
    assert_eq!(gpio.read(B, offset::LCKR), Ok(2));
}
