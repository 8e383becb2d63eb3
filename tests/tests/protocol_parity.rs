//! One protocol on the native simulator and on the flashed image: blocks, order, conditions, and
//! every edge.

use host_core::link::Interruption;
use host_core::run::DeviceName;
use std::fs;
use std::path::Path;
use studies::laboratory::{Course, Experiment, Operator};

/// Protocol in open loop; in a closed loop the sensor is read at other microseconds after each
/// boot.
const DECLARED: &str = r#"
name = "parity"
title = "One protocol on two devices"
source = "nobody"
session = "ten_channels.toml"
seed = 5
draws = 1
measures = ["charge_mc"]

[protocol]
blocks = 2
order = "random"
rest_s = 1.0

[[factor]]
name = "width"
[[factor.level]]
name = "100 µs"
set = { duration_s = 0.2, "channel.1.train.width_us" = 100 }
[[factor.level]]
name = "250 µs"
set = { duration_s = 0.2, "channel.1.train.width_us" = 250 }

[[factor]]
name = "current"
[[factor.level]]
name = "low"
set = { "channel.1.limit" = 6.0 }
[[factor.level]]
name = "as the file"
"#;

struct NoOperator;

impl Operator for NoOperator {
    fn ready(&mut self, _: &str) -> bool {
        true
    }

    fn rest(&mut self, _: f64) -> bool {
        true
    }

    fn progress(&mut self, _: f64) {}

    fn interruption(&self) -> Interruption {
        Interruption::default()
    }
}

fn conducted(device: &DeviceName) -> Course {
    let sessions = Path::new(env!("CARGO_MANIFEST_DIR")).join("../host-tool/sessions");
    let texts = |name: &str| Ok(fs::read_to_string(sessions.join(name)).unwrap());
    let experiment = Experiment::new("parity.toml", DECLARED, &texts).unwrap();
    let name = format!("protocol_parity/{device}");
    let dir = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    let _ = fs::remove_dir_all(&dir);
    fs::create_dir_all(&dir).unwrap();
    let course = experiment
        .conduct(&dir, (device, 5), &mut NoOperator)
        .unwrap();
    assert!(course.ended.is_none(), "{:?}", course.ended);
    course
}

#[test]
fn a_protocol_is_the_same_edges_on_native_and_chip() {
    let [native, chip] =
        [DeviceName::Native, DeviceName::Chip].map(|device_name| conducted(&device_name));
    assert_eq!((native.trials.len(), native.of), (8, 8));
    for (native, chip) in native.trials.iter().zip(&chip.trials) {
        let name = &native.trial.name;
        assert_eq!((native.place, name), (chip.place, &chip.trial.name));
        assert!(
            native.trial.edges.len() > 40,
            "{name}: {}",
            native.trial.edges.len()
        );
        assert_eq!(native.trial.edges, chip.trial.edges, "{name}");
        assert_eq!(native.trial.pulses, chip.trial.pulses, "{name}");
    }
}
