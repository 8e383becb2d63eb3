//! CoreMark's 2K performance run on the STM32F405, counted in core clock cycles, with prefetch and
//! without. Takes the difference of two runs with different numbers of iterations, which excludes
//! set-up and checks.
#![no_std]
#![no_main]

use core::hint::black_box;
use coremark::types::{LIST_KNOWN_CRC, MATRIX_KNOWN_CRC, STATE_KNOWN_CRC};
use coremark::{COMPILER_VERSION, Config, Results};
use cortex_m::Peripherals;
use cortex_m::peripheral::DWT;
use cortex_m_rt::entry;
use cortex_m_semihosting::{debug, hprintln};
use embedded_alloc::TlsfHeap;
use panic_semihosting as _;

#[global_allocator]
static HEAP: TlsfHeap = TlsfHeap::empty();

/// FLASH_ACR (RM0090, section 3.9.1): five wait states, prefetch, both caches, as the stimulator at
/// 168 MHz.
const FLASH_ACR: *mut u32 = 0x4002_3C00 as *mut u32;
const PREFETCH: u32 = 1 << 8;
const FIVE_WAIT_STATES_ALL_CACHES: u32 = 5 | PREFETCH | 1 << 9 | 1 << 10;

/// Index of the 2K performance run among the known results.
const PERFORMANCE_2K: usize = 3;

/// Number of counted iterations.
const ITERATIONS: u32 = 10;

#[entry]
fn main() -> ! {
    // SAFETY: this runs once, before any allocation and before any other use of a peripheral. More
    // wait states than needed are always allowed.
    let mut core = unsafe {
        embedded_alloc::init!(HEAP, 16 * 1024);
        FLASH_ACR.write_volatile(FIVE_WAIT_STATES_ALL_CACHES);
        Peripherals::steal()
    };
    core.DCB.enable_trace();
    core.DWT.enable_cycle_counter();

    let valid = measure("");
    // If prefetch were slower than no prefetch, this would show which reading of RM0090 section
    // 3.5.2 is wrong (docs/how/chip.md). SAFETY: as above; the contents of the caches stay valid.
    unsafe { FLASH_ACR.write_volatile(FIVE_WAIT_STATES_ALL_CACHES & !PREFETCH) };
    let valid = measure("prefetch off: ") && valid;
    loop {
        debug::exit(if valid {
            debug::EXIT_SUCCESS
        } else {
            debug::EXIT_FAILURE
        });
    }
}

/// Counts iterations, prints three lines that begin with `how`, and returns whether the results are
/// right.
fn measure(how: &str) -> bool {
    let (one, short) = counted(1);
    let (many, long) = counted(1 + ITERATIONS);
    let cycles = long.wrapping_sub(short);
    let valid = is_valid(&one) && is_valid(&many);
    hprintln!(
        "{}crclist {:04x} crcmatrix {:04x} crcstate {:04x} crcfinal {:04x} {}",
        how,
        many.crclist,
        many.crcmatrix,
        many.crcstate,
        many.crcfinal,
        if valid { "valid" } else { "WRONG" }
    );
    hprintln!("{}iterations {} cycles {}", how, ITERATIONS, cycles);
    if cycles > 0 {
        // Thousandths of iterations per million cycles.
        let milli = u64::from(ITERATIONS) * 1_000_000_000 / u64::from(cycles);
        hprintln!(
            "{}CoreMark/MHz {}.{:03} {} opt-level=3",
            how,
            milli / 1000,
            milli % 1000,
            COMPILER_VERSION
        );
    }
    valid
}

/// Returns whether the results are the reference's for this run. The crate's own check also
/// requires ten seconds, which a simulator does not need.
fn is_valid(results: &Results) -> bool {
    results.known_id == PERFORMANCE_2K as i32
        && results.crclist == LIST_KNOWN_CRC[PERFORMANCE_2K]
        && results.crcmatrix == MATRIX_KNOWN_CRC[PERFORMANCE_2K]
        && results.crcstate == STATE_KNOWN_CRC[PERFORMANCE_2K]
}

/// Runs this many iterations and returns the cycles. All measurements use the same copy of the
/// code, because cycles depend on its address.
#[inline(never)]
fn counted(iterations: u32) -> (Results, u32) {
    let config = Config {
        iterations,
        ..Config::default()
    };
    let begin = DWT::cycle_count();
    let results = coremark::run(black_box(&config));
    (results, DWT::cycle_count().wrapping_sub(begin))
}
