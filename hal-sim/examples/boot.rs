#![allow(missing_docs)]
use firmware::device::lockstep::{Sensors, Sink};
use firmware::units::{DacCode, Micros};
use hal_sim::chip::board::Board;
use hal_sim::chip::image::Image;
use hal_sim::chip::soc::Pace;
use hal_sim::lockstep::Device;
use std::path::Path;
struct S(u64);
impl Sink for S {
    fn levels(&mut self, _at: Micros, _l: firmware::pulse::Levels) {
        self.0 += 1;
    }
    fn dac(&mut self, _at: Micros, _c: u8, _code: DacCode) {}
    fn bytes(&mut self, at: Micros, bytes: &[u8]) {
        println!("{} us: {} bytes", at.0, bytes.len());
    }
}
fn main() {
    let path = std::env::args().nth(1).unwrap();
    let image = Image::open(Path::new(&path)).unwrap();
    let mut board = Board::power_on(image, [None; 10], Pace::Lazy, ()).unwrap();
    let t = std::time::Instant::now();
    match board.boot(&Sensors::default()) {
        Ok(()) => println!("booted at {} us", board.now_us()),
        Err(e) => println!("{e}"),
    }
    println!(
        "cycle {} instructions {} in {:?}",
        board.cpu.cycle,
        board.cpu.instructions,
        t.elapsed()
    );
    println!(
        "device {:?} failure {:?}",
        board.around.host.device(),
        board.around.host.failure()
    );
    let t = std::time::Instant::now();
    let (c, i) = (board.cpu.cycle, board.cpu.instructions);
    let to = board.now_us() as u32 + 1_000_000;
    let mut sink = S(0);
    if let Err(e) = board.advance(Micros(to), &Sensors::default(), &mut sink) {
        println!("{e}");
    }
    let el = t.elapsed();
    println!(
        "1 s idle: cycles {} instructions {} in {el:?}",
        board.cpu.cycle - c,
        board.cpu.instructions - i
    );
}
