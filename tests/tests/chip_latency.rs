//! Latency from the host's write to the earliest slot that it can change, over USB, on the flashed
//! image in the chip simulator, in both readings of its flash documentation.

use hal_sim::chip::soc::flash::Prefetched;
use host_core::run::chip_image;
use host_tool::selftest::{Latency, Path, Subject, latency};

#[test]
fn setpoints_over_usb_change_the_outputs_in_time() {
    setpoints_change_the_outputs_in_time(Prefetched::Cached);
}

#[test]
fn setpoints_over_usb_are_in_time_if_prefetched_lines_are_not_cached() {
    setpoints_change_the_outputs_in_time(Prefetched::NotCached);
}

fn report(name: &str, found: &Latency) {
    let (device, total) = (&found.device, &found.whole);
    println!(
        "{name}, {} arrivals: at the device {} to {} us ({} at any phase, blur {}), \
         whole {} to {} us\n  device by 100 us {:?}\n  whole by 100 us {:?}",
        found.arrivals,
        device.best_us,
        device.worst_us,
        found.worst_phase_us,
        found.blur_us,
        total.best_us,
        total.worst_us,
        device.counts,
        total.counts,
    );
}

/// Requirement: 0.7 ms in the device, 2.0 ms in total with USB frames.
#[track_caller]
fn setpoints_change_the_outputs_in_time(prefetched: Prefetched) {
    let image = chip_image(None).unwrap_or_else(|e| panic!("{e}"));
    let chip = Subject::Chip(&image, prefetched);
    let direct = latency(chip, Path::Direct, 400, 1).unwrap();
    report("direct amplitude", &direct);
    let control = latency(chip, Path::Control, 320, 1).unwrap();
    report("through the control law, one tick more", &control);
    for found in [&direct, &control] {
        assert_eq!(found.unseen, 0, "a setpoint never showed");
        let sum = |counts: &[u32]| counts.iter().sum::<u32>();
        assert_eq!(sum(&found.device.counts), found.arrivals);
        assert_eq!(sum(&found.whole.counts), found.arrivals);
    }
    assert!(direct.worst_phase_us <= 700, "{direct:?}");
    assert!(direct.whole.worst_us <= 2_000, "{direct:?}");
}
