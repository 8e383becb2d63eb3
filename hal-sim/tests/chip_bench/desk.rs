//! The simulated core with flat memory, for images that speak over semihosting.

use hal_sim::chip::Cycle;
use hal_sim::chip::cpu::bus::{Bus, Denied, LINE_WORDS, Read, Unmodelled};
use hal_sim::chip::cpu::flat::Flat;
use hal_sim::chip::cpu::semihosting::Semihosting;
use hal_sim::chip::cpu::{Cpu, Size, Stop};
use hal_sim::chip::image;
use std::path::Path;

/// Flat memory and the one peripheral register that the image writes.
struct Desk(Flat);

/// FLASH_ACR.
const FLASH_ACR: u32 = 0x4002_3C00;

impl Bus for Desk {
    fn read(&mut self, address: u32, size: Size, at: Cycle) -> Result<Read, Denied> {
        self.0.read(address, size, at)
    }
    fn write(&mut self, address: u32, size: Size, value: u32, at: Cycle) -> Result<u32, Denied> {
        if address == FLASH_ACR {
            return Ok(0);
        }
        self.0.write(address, size, value, at)
    }
    fn code(&mut self, address: u32) -> Result<u16, Denied> {
        self.0.code(address)
    }
    fn fetch(&mut self, line: u32, at: Cycle) -> u32 {
        self.0.fetch(line, at)
    }
    fn is_writable_code(&self, address: u32) -> bool {
        self.0.is_writable_code(address)
    }
    fn advance(&mut self, to: Cycle) -> Result<(), Unmodelled> {
        self.0.advance(to)
    }
    fn next_event(&self) -> Cycle {
        self.0.next_event()
    }
    fn lines(&self) -> [u32; LINE_WORDS] {
        self.0.lines()
    }
    fn request_reset(&mut self, at: Cycle) {
        self.0.request_reset(at);
    }
}

/// What the image at `elf` prints on the simulated core until it ends.
pub fn on_core(elf: &Path) -> Vec<String> {
    let image = image::Image::open(elf).unwrap();
    let mut bus = Desk(Flat::new());
    assert!(bus.0.load(image::FLASH.start, &image.flash));
    let mut cpu = Cpu::new();
    cpu.system.semihosting = Some(Semihosting::default());
    cpu.reset(&mut bus).unwrap();
    let stop = cpu.run(&mut bus, 1_000_000_000).expect_err("must end");
    let console = cpu.system.semihosting.unwrap_or_default().console;
    let words = String::from_utf8_lossy(&console).into_owned();
    let at = |pc| image.symbols.function_at(pc).map(|f| &f.name);
    assert_eq!(
        stop,
        Stop::Exit(0),
        "{stop} in {:?}\n{words}",
        at(cpu.registers.r[15])
    );
    println!("{} instructions, {} cycles", cpu.instructions, cpu.cycle);
    words.lines().map(str::to_owned).collect()
}
