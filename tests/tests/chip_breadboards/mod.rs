//! Breadboards on the chip simulator: they boot, play the same edges as the reference board, find a
//! wrong crystal and a board that is not theirs, and enter the boot loader.

mod boot_loader;
mod crystals;
mod cuts;
mod log;
mod straps;

use firmware::link::{Code, Request};
use firmware::lockstep::Sensors;
use firmware::safety::Stages;
use firmware::units::Amplitude;
use hal_sim::chip::board::{Board as SimulatedBoard, Hardware};
use hal_sim::chip::image::Image;
use hal_sim::chip::soc::Pace;
use hal_sim::random;
use hal_sim::trace::Edge;
use host_core::run::{Board, ChipOptions, DeviceName, SessionFile, board_image, open_chip_port};
use tests::desk;

use crate::chip_faults::{Bench, spec};

/// Boards without output stages.
const BREADBOARDS: [Board; 2] = [Board::Weact, Board::Feather];

fn image(board: Board) -> Image {
    board_image(None, board).unwrap_or_else(|e| panic!("{e}"))
}

/// Powers on `hardware` with the image of `board`.
fn power_on(board: Board, hardware: &Hardware) -> SimulatedBoard<()> {
    let stages = desk::stages(24.0);
    SimulatedBoard::power_on_as(hardware, image(board), stages, Pace::Lazy, ()).unwrap()
}

fn powered(board: Board) -> SimulatedBoard<()> {
    power_on(board, &Hardware::new(board.wiring()))
}

/// Returns the shipped session of the channels that `board` has, shortened to a second.
fn session_for(board: Board) -> SessionFile {
    let mut file = desk::load_session(match board {
        Board::Feather => "five_channels.toml",
        Board::Reference | Board::Weact => "ten_channels.toml",
    });
    file.session.duration_us = 1_000_000;
    file
}

#[test]
fn breadboards_play_the_edges_of_the_native_device() {
    for board in BREADBOARDS {
        let file = session_for(board);
        let options = ChipOptions {
            board,
            ..ChipOptions::default()
        };
        let port = open_chip_port(&file.session, 1, &options).unwrap_or_else(|e| panic!("{e}"));
        // Until the host's stop, which reaches each device after another delay.
        let is_before_stop = |edge: &Edge| edge.t_us < file.session.duration_us;
        let played = desk::play_on(&file, Box::new(port));
        let on_board: Vec<_> = played.edges().filter(is_before_stop).collect();
        let played = desk::play(&file, &DeviceName::Native);
        let native: Vec<_> = played.edges().filter(is_before_stop).collect();
        println!("{}: {} edges", board.name(), on_board.len());
        assert!(on_board.len() > 1_000, "{}", on_board.len());
        let differs = on_board.iter().zip(&native).find(|(a, b)| a != b);
        assert_eq!(
            (differs, on_board.len()),
            (None, native.len()),
            "{}",
            board.name()
        );
    }
}

/// Printed for docs/guides/breadboard.md.
#[test]
fn a_breadboard_greets_within_two_seconds() {
    for board in Board::ALL {
        let mut simulated = powered(board);
        let mut ms = 0;
        while !simulated.around.host.is_open() {
            // A core at 16 MHz takes ten times as long for as many cycles.
            let before = simulated.cpu.cycle;
            simulated
                .run_to(before + u64::from(simulated.around.soc.hz()) / 1_000)
                .unwrap();
            ms += 1;
            assert!(ms < 2_000, "{}", board.name());
        }
        println!("{}: the port is open {ms} ms after power-on", board.name());
    }
}

#[test]
fn hello_says_that_it_is_a_breadboard() {
    for (board, channels) in [(Board::Weact, 0x3FF), (Board::Feather, 0x28E)] {
        let (_, hello) = Bench::boot_and_greet(powered(board));
        assert_eq!(hello.kind, firmware::link::Kind::Breadboard);
        assert_eq!(hello.board, board.reported_name());
        assert_eq!(hello.stages, Stages::Simulated { channels });
        let nominal = board.wiring().crystal_hz;
        assert!(
            hello.crystal_hz.abs_diff(nominal) < nominal / 500,
            "{hello:?}"
        );
        assert_eq!(
            (hello.last_fault, hello.option_bytes.is_some()),
            (None, true)
        );
    }
}

#[test]
fn a_channel_that_the_board_lacks_is_refused_by_name() {
    let (mut bench, _) = Bench::boot_and_greet(powered(Board::Feather));
    for (channel, is_there) in [(0, false), (1, true), (4, false), (9, true)] {
        let spec = spec(channel);
        let refused = bench.refusal(Request::Channel { channel, spec });
        let code = refused.map(|refused| refused.0);
        assert_eq!(
            code,
            (!is_there).then_some(Code::OtherStage as u16),
            "{channel}"
        );
    }
    let file = desk::load_session("ten_channels.toml");
    let options = ChipOptions {
        board: Board::Feather,
        ..ChipOptions::default()
    };
    let port = open_chip_port(&file.session, 1, &options).unwrap();
    let (outcome, _) = host_core::run::run(&file, port, None, |_| ());
    let error = outcome.error.unwrap().to_string();
    for channel in [1, 5, 6, 7, 9] {
        assert!(error.contains(&format!("channel {channel}: ")), "{error}");
    }
    for channel in [2, 3, 4, 8, 10] {
        assert!(!error.contains(&format!("channel {channel}: ")), "{error}");
    }
}

/// Arms and starts two channels that both boards have.
fn play(bench: &mut Bench) {
    bench.send(Request::Acknowledge);
    bench.send(Request::Clear);
    bench.send(Request::Wearer(desk::wearer(100)));
    for channel in [1, 7] {
        let spec = spec(channel);
        bench.send(Request::Channel { channel, spec });
    }
    bench.send(desk::ARM);
    bench.run_on_ms(60);
    bench.send(Request::Start);
    bench.send(Request::Amplitudes {
        at: None,
        mask: 0b1000_0010,
        values: [Amplitude::new(5_000); 2].into_iter().collect(),
        widths: Default::default(),
    });
    bench.run_on_ms(10);
}

/// Requests, wrong bytes, inputs and resets in random order, some of them while pulses play.
#[test]
fn ten_thousand_hostile_actions_never_drive_the_pump() {
    let requests: Vec<Request> = crate::protocol_vectors::requests()
        .into_iter()
        // `Hello` would renew the session; a boot loader that is entered ends the run, and
        // `boot_loader` tests it.
        .filter(|r| !matches!(r, Request::Hello { .. } | Request::EnterBootLoader))
        .collect();
    for (board, seed) in BREADBOARDS.into_iter().zip([47, 48]) {
        let (mut bench, _) = Bench::boot_and_greet(powered(board));
        let (mut resets, mut plays) = (0, 0);
        for n in 0..5_000_u64 {
            let drawn = random::word(seed, n);
            match drawn % 16 {
                0 => bench.sensors.hand_stop = !bench.sensors.hand_stop,
                1 => bench.sensors.arm = !bench.sensors.arm,
                2 => bench.sensors.over_current = !bench.sensors.over_current,
                3..=8 => {
                    let place = (drawn >> 8) as usize % requests.len();
                    bench.send(requests[place].clone());
                }
                9..=13 => {
                    let bytes = (0..drawn % 90).map(|i| random::word(n, i) as u8);
                    bench.send_bytes(&bytes.collect::<Vec<_>>());
                }
                14 if drawn >> 8 & 7 == 0 => {
                    bench.sensors.hand_stop = true;
                    play(&mut bench);
                    plays += usize::from(bench.is_driving());
                }
                15 if drawn >> 8 & 0x1F == 0 => {
                    bench.board.around.soc.lose_power();
                    bench.run_on_ms(1);
                    bench.after_reset();
                    resets += 1;
                }
                _ => {}
            }
            bench.run_unread_us(drawn >> 32 & 0x1FF);
        }
        println!(
            "{}: 5000 actions, {resets} resets, {plays} plays",
            board.name()
        );
        assert!(
            bench.board.around.has_pump_stayed_input(),
            "{}",
            board.name()
        );
        assert!(resets > 3 && plays > 3, "{resets} {plays}");
    }
    // The check itself finds a board that drives the pump.
    let (bench, _) = Bench::boot_and_greet(powered(Board::Reference));
    assert!(!bench.board.around.has_pump_stayed_input());
}

/// The reference image has no simulated stage and no entry into the boot loader; a breadboard's
/// image has both, and does not write a stage table.
#[test]
fn images_contain_only_their_own_parts() {
    for board in Board::ALL {
        let image = image(board);
        let has = |part: &str| image.symbols.names().any(|name| name.ends_with(part));
        let is_breadboard = board != Board::Reference;
        // The session refuses the request under a longer name.
        let enters = image
            .symbols
            .names()
            .any(|name| name == "enter_boot_loader");
        assert_eq!(enters, is_breadboard, "{}", board.name());
        assert_eq!(
            has("simulated_stage::restart"),
            is_breadboard,
            "{}",
            board.name()
        );
        assert_eq!(has("stages::store"), !is_breadboard, "{}", board.name());
    }
}

/// Returns the core cycles of a millisecond at the internal oscillator.
const HSI_MS: u64 = 16_000;

/// Runs until the RAM test is over: the first port has its clock.
fn end_of_ram_test(board: &mut SimulatedBoard<()>) -> u64 {
    run_until(board, 5_000, |board| ahb1enr(board) & 0xF != 0)
}

fn ahb1enr(board: &mut SimulatedBoard<()>) -> u32 {
    use hal_sim::chip::cpu::{Bus, Size};
    let at = board.cpu.cycle;
    board
        .around
        .soc
        .read(0x4002_3830, Size::Word, at)
        .unwrap()
        .value
}

/// Runs in steps of 100 cycles until `is_so`, at most `limit_ms` at the internal oscillator, and
/// returns the cycle.
fn run_until(
    board: &mut SimulatedBoard<()>,
    limit_ms: u64,
    mut is_so: impl FnMut(&mut SimulatedBoard<()>) -> bool,
) -> u64 {
    board.set_sensors(&Sensors::default()).unwrap();
    let end = board.cpu.cycle + limit_ms * HSI_MS;
    while !is_so(board) {
        assert!(board.cpu.cycle < end, "not within {limit_ms} ms");
        board.run_to(board.cpu.cycle + 100).unwrap();
    }
    board.cpu.cycle
}
