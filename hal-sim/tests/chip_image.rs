//! The flashed image as `chip::image` parses it. Truncated anywhere, it is refused without a panic.

use hal_sim::chip::image::{FLASH, Image};
use hal_sim::images;
use std::path::Path;

#[test]
fn the_flashed_image_is_read_whole_and_refused_when_cut() {
    let workspace = Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap();
    let path = images::Image::Stimulator.build(workspace).unwrap();
    let image = Image::open(&path).unwrap();
    image.require_defmt().unwrap();
    println!(
        "{} bytes of flash, {} functions, reset at {:#010x}",
        image.size,
        image.symbols.functions().len(),
        image.reset
    );
    let reset = image.symbols.function_at(image.reset).unwrap();
    assert_eq!((reset.name.as_str(), reset.address), ("Reset", image.reset));
    assert!(image.flash.len() >= image.size as usize);
    assert!(image.reset - FLASH.start < image.size);
    let rtt = image.symbols.find("_SEGGER_RTT").unwrap();
    assert!((0x2000_0000..0x2001_C000).contains(&rtt.address), "{rtt:?}");
    for handler in ["TIM2", "TIM7", "PVD", "OTG_FS", "TIM5"] {
        let function = image.symbols.find(handler).unwrap();
        assert!(function.size > 0, "{function:?}");
    }

    // The section headers come last, so a truncated file lacks them and their names.
    let bytes = std::fs::read(&path).unwrap();
    for length in (0..bytes.len())
        .step_by(7)
        .chain(bytes.len() - 2000..bytes.len())
    {
        let cut = Image::parse(&path, &bytes[..length]);
        assert!(cut.is_err(), "{length} of {} bytes", bytes.len());
    }
}
