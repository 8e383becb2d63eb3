//! The built-in wearers have the values that the papers print.

use firmware::units::Amplitude;
use hal_sim::body::FingerSpec;
use hal_sim::body::muscle::SUBJECTS;
use hal_sim::body::wearer::Participant;
use host_core::session::Unit;
use host_core::wearer::{Evidence, SHIPPED, Wearer, builtin_wearer, manual, schema};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use crate::session_schema::{as_committed, with_tables};

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

fn wearer(name: &str) -> Wearer {
    let text = builtin_wearer(name).unwrap_or_else(|| panic!("no {name}"));
    Wearer::parse(name, text).unwrap_or_else(|e| panic!("{}", e.lines()))
}

/// Returns the rows of a golden table: the subject, and a number by column name.
fn golden(file: &str) -> Vec<(String, BTreeMap<String, f64>)> {
    let text = std::fs::read_to_string(root().join("tests/golden").join(file)).unwrap();
    let mut lines = text.lines();
    let heads: Vec<&str> = lines.next().unwrap().split(',').collect();
    let row = |line: &str| {
        let mut cells = line.split(',');
        let name = cells.next().unwrap().to_owned();
        let numbers = heads[1..].iter().zip(cells);
        let numbers = numbers.map(|(head, cell)| ((*head).to_owned(), cell.parse().unwrap()));
        (name, numbers.collect())
    };
    lines.map(row).collect()
}

#[test]
fn the_folder_is_what_the_program_has() {
    let folder = root().join("host-tool/wearers");
    let files = std::fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().path());
    let files: Vec<PathBuf> = files
        .filter(|path| path.extension().unwrap() == "toml")
        .collect();
    assert_eq!(files.len(), SHIPPED.len());
    for path in files {
        let name = path.file_stem().unwrap().to_str().unwrap();
        let text = std::fs::read_to_string(&path).unwrap();
        assert_eq!(builtin_wearer(name), Some(&*text));
        let read = wearer(name);
        assert_eq!(read.name, name);
        assert_eq!(Wearer::parse(name, &read.to_toml()).unwrap(), read);
    }
}

#[test]
fn the_schema_and_the_manual_are_as_committed() {
    let made = serde_json::to_string_pretty(&schema()).unwrap() + "\n";
    as_committed(&root().join("host-tool/wearers/schema.json"), &made);
    let path = root().join("docs/reference/wearers.md");
    let (made, tables) = with_tables(&path, "wearer", manual);
    assert!(tables >= 10, "{tables} tables");
    as_committed(&path, &made);
}

#[test]
fn every_wearer_names_and_keeps_the_schema() {
    let validator = jsonschema::draft7::new(&schema()).unwrap();
    for (file, text) in SHIPPED
        .into_iter()
        .chain([("full", crate::wearer_files::FULL)])
    {
        let document: toml::Table = text.parse().unwrap();
        let json = serde_json::to_value(&document).unwrap();
        let wrong: Vec<String> = validator
            .iter_errors(&json)
            .map(|e| e.to_string())
            .collect();
        assert_eq!(wrong, [""; 0], "{file}");
        assert!(
            file == "full" || text.starts_with("#:schema schema.json\n"),
            "{file}"
        );
    }
}

/// Compares with Lee 2020, tables 2 and 4; the simulated subjects are the same people.
#[test]
fn k01_to_k10_are_lees_subjects() {
    let peaks = golden("lee2020_table2_peak_force.csv");
    let models = golden("lee2020_table4_force_model.csv");
    assert_eq!(models.len(), SUBJECTS.len());
    for ((name, model), subject) in models.iter().zip(SUBJECTS) {
        let wearer = wearer(name);
        assert_eq!(wearer.evidence, Evidence::Printed);
        let [electrode] = &*wearer.electrodes else {
            panic!("{name} has one electrode");
        };
        let peak = |hz: f64| {
            let mut rows = peaks.iter().filter(|(person, _)| person == name);
            &rows.find(|(_, row)| row["frequency_hz"] == hz).unwrap().1
        };
        for hz in [20.0, 30.0, 40.0] {
            assert!((electrode.holds_hz[0]..=electrode.holds_hz[1]).contains(&hz));
            let milli = |v: f64| (v * 1e3).round() as u32;
            assert_eq!(electrode.motor_threshold.get(), milli(peak(hz)["i_min_ma"]));
            assert_eq!(electrode.limit.get(), milli(peak(hz)["i_max_ma"]));
        }
        assert_eq!(
            electrode.haptic_range()[1],
            electrode.limit,
            "I_PT = 1.5 I_MT"
        );
        assert_eq!((electrode.width_us, electrode.area_mm2), (400, 2500));
        assert_eq!(
            (electrode.unit, electrode.frequency_hz),
            (Unit::Milliampere, 30.0)
        );
        let muscle = electrode.muscle.unwrap();
        let row = peak(30.0);
        let b = (row["f_max_n"] / row["f_min_n"]).ln() / (row["i_max_ma"] - row["i_min_ma"]);
        assert_eq!(muscle.slope_micro, (b * 1e6).round() as u32, "{name}: b");
        assert_eq!(muscle.reference, electrode.limit, "{name}: A is that of I5");
        let force = muscle.force;
        // K06's time constant is a misprint, which the file's note mentions.
        let is_misprint = name == "K06";
        assert_eq!(
            wearer.note.as_ref().unwrap().contains("misprint"),
            is_misprint
        );
        let tau2_ms = if is_misprint { 176.0 } else { model["tau2_ms"] };
        let printed = [
            (
                force.a_mn_per_s,
                model["a_n_per_s"] * 1e3,
                subject.a_n_per_s * 1e3,
            ),
            (force.k_micro, model["k"] * 1e6, subject.k * 1e6),
            (
                force.tau_c_us,
                model["tau_c_ms"] * 1e3,
                subject.tau_c_s * 1e6,
            ),
            (force.tau1_us, model["tau1_ms"] * 1e3, subject.tau1_s * 1e6),
            (force.tau2_us, tau2_ms * 1e3, subject.tau2_s * 1e6),
        ];
        for (ours, paper, simulated) in printed {
            assert_eq!(ours, paper.round() as u32, "{name}");
            assert_eq!(ours, simulated.round() as u32, "{name}");
        }
    }
}

/// Compares with Hamana 2022, table 7: thresholds and largest voltages of A, B and the extensor;
/// and with the sizes in table 1.
#[test]
fn p_q_r_and_s_are_hamanas_participants() {
    let printed = [
        (
            "P",
            [0.42, 0.28],
            Some([[24.0, 28.0], [28.0, 36.0], [14.0, 26.0]]),
        ),
        (
            "Q",
            [0.42, 0.25],
            Some([[24.0, 32.0], [24.0, 32.0], [16.0, 24.0]]),
        ),
        ("R", [0.40, 0.21], None),
        (
            "S",
            [0.45, 0.23],
            Some([[26.0, 32.0], [18.0, 24.0], [18.0, 26.0]]),
        ),
    ];
    for (name, size, volts) in printed {
        let wearer = wearer(name);
        let forearm = wearer.forearm.unwrap();
        assert_eq!([forearm.reach_m, forearm.around_m], size);
        let thresholds = volts.map(|ranges| ranges.map(|[threshold, _]| threshold));
        assert_eq!(wearer.forearm_thresholds_v(), thresholds);
        let found = wearer
            .electrodes
            .iter()
            .map(|electrode| f64::from(electrode.limit.get()) * 1e-3);
        let most = volts.into_iter().flatten().map(|[_, most]| most);
        assert!(found.eq(most), "{name}");
    }
}

/// The simulated fingers belong to the same participants.
#[test]
fn simulated_fingers_have_the_voltages_of_the_files() {
    for (name, participant) in [
        ("P", Participant::P),
        ("Q", Participant::Q),
        ("S", Participant::S),
    ] {
        let finger = FingerSpec::participant(participant);
        let sites = [finger.flexor_a, finger.flexor_b, finger.extensor];
        let simulated = sites.map(|site| [site.threshold_v, site.max_v]);
        let wearer = wearer(name);
        let volts = |amplitude: Amplitude| f64::from(amplitude.get()) / 1e3;
        let known = wearer.electrodes.iter();
        let known =
            known.map(|electrode| [volts(electrode.motor_threshold), volts(electrode.limit)]);
        assert!(known.eq(simulated), "{name}");
    }
}
