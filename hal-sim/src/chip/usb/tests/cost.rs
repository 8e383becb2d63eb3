//! What the host costs the simulator.

use super::board::{Board, MS};

/// Prints what the host costs the simulator. Run with
/// `cargo test --release -p hal-sim --lib chip::usb::tests::cost -- --ignored --nocapture`.
#[test]
#[ignore = "a measurement"]
fn cost() {
    let mut board = Board::open();
    let timed = |what: &str, count: u64, run: &mut dyn FnMut()| {
        let start = std::time::Instant::now();
        run();
        let ns = start.elapsed().as_nanos() as f64 / count as f64;
        println!("{what}: {ns:.1} ns");
    };
    let count = 10_000_000;
    timed("advance, idle, every 100 cycles", count, &mut || {
        for _ in 0..count {
            board.now += 100;
            board.host.advance(board.now, &mut board.otg);
        }
    });
    let mut sum = 0_u64;
    timed("next_event, idle", count, &mut || {
        for _ in 0..count {
            sum = sum.wrapping_add(std::hint::black_box(&board.host).next_event(&board.otg));
        }
    });
    timed("irq", count, &mut || {
        for _ in 0..count {
            sum += u64::from(std::hint::black_box(&board.otg).irq());
        }
    });
    std::hint::black_box(sum);
    let wakes = board.wakes;
    timed(
        "one second, a 64-byte packet each way every ms",
        1,
        &mut || {
            for _ in 0..1_000 {
                board.send(&[0xA5; 64]);
                board.to_send.push_back(vec![0x5A; 64]);
                board.wake();
                board.run(board.now + MS);
                while board.host.received().is_some() {}
            }
        },
    );
    println!("wakes in that second: {}", board.wakes - wakes);
}
