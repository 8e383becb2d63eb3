//! Tests of Lee's protocol on test rigs: output, results, files.

use hal_sim::body::bench::{Foreign, Kind, WristSpec};
use hal_sim::body::{Body, Load};
use host_core::identify::{Fit, IdentifyError, Weighting};
use host_core::run::DeviceName;
use host_core::wearer::Wearer;
use studies::lee2020::{
    Declaration, ExactWrist, LeeError, OnDevice, Part, RunInfo, Stimulator, Study, Train, Unit,
};

fn study() -> Study {
    Study::new(Some(5), Some(1), DeviceName::Native).unwrap()
}

fn train(ma: f64, pulses: u32) -> Train {
    Train {
        ma,
        pulses,
        width_us: 400,
        before: 500,
        samples: 2_500,
    }
}

/// Both give pulses at the same µs; the fitted muscles therefore agree within the noise.
#[test]
fn a_device_puts_out_what_the_body_alone_is_given() {
    let spec = WristSpec::subject(3).unwrap();
    let mut device = OnDevice::new(&DeviceName::Native, (spec, 1), 20.0).unwrap();
    let mut alone = ExactWrist::new(spec, 2).unwrap();
    let records = [20, 30, 40].map(|hz| {
        let own = device.train(&train(13.5, hz)).unwrap();
        let other = alone.train(&train(13.5, hz)).unwrap();
        let after = |all: &[u32]| all.iter().map(|value| value - all[0]).collect::<Vec<_>>();
        assert_eq!(after(&own.pulses_us), after(&other.pulses_us));
        assert_eq!(own.samples_n.len(), 2_500);
        own
    });
    assert_eq!(device.compared_counts(), (3, 90));
    let weighting = Weighting::Whitened;
    let fitted = Fit { weighting }.fit_records(&records).unwrap();
    for (found, truth) in fitted.constants.iter().zip(spec.generator.parameters.all()) {
        // The converter's steps change recruitment by a ten-thousandth.
        assert!((found / truth - 1.0).abs() < 0.02, "{found} {truth}");
    }
}

#[test]
fn an_electrode_that_is_off_moves_nothing() {
    let declared = Declaration::load_embedded().unwrap();
    let mut alone = ExactWrist::new(WristSpec::subject(0).unwrap(), 1).unwrap();
    let detector = declared.search.detector();
    let searched = detector.search(|ma| {
        alone.wrist_mut().loads_mut()[0] = Load::Open;
        let layout = detector.layout;
        let own = Train {
            before: layout.before,
            samples: layout.samples,
            ..train(ma, 30)
        };
        Ok::<_, LeeError>(alone.train(&own)?.samples_n)
    });
    let none = searched.unwrap_err();
    let is_none = matches!(none, LeeError::Identify(IdentifyError::NoThreshold { .. }));
    assert!(is_none, "{none}");
}

/// One replication of all subjects, separately for each: the results are found, written and read
/// again.
#[test]
fn a_replication_finds_its_bench_and_leaves_wearer_files() {
    let study = study();
    let own = (0..10).map(|subject| study.compute_unit(&Unit::Own(subject, 0)).unwrap());
    let parts: Vec<Part> = own.collect();
    let mut covered = 0;
    for part in &parts {
        let Part::Own(drawn) = part else { panic!() };
        let truth = &study.truths[drawn.subject];
        let found = drawn.searched.i_mt_ma().unwrap();
        assert!(
            (found - truth.i_mt_ma).abs() <= 0.5,
            "{found} {}",
            truth.i_mt_ma
        );
        assert!(found < truth.printed_ma);
        let printed = drawn.printed.as_ref().unwrap();
        let constants = truth.constants(1.5 * truth.printed_ma, 400);
        let estimates = printed.fits[0].estimates();
        covered += estimates
            .iter()
            .zip(constants)
            .filter(|(estimate, truth)| estimate.covers(*truth))
            .count();
        assert!(printed.fits.iter().all(|fit| fit.untold.is_empty()));
    }
    // Of 50 intervals with 0.95: fewer than 41 once in ten thousand times.
    assert!(covered >= 41, "{covered}");
    let wearers = study.wearers(&parts).unwrap();
    assert_eq!(wearers.len(), 10);
    for (file, text) in &wearers {
        let wearer = Wearer::parse(file, text).unwrap();
        let electrode = wearer.electrode(1).unwrap();
        assert_eq!(wearer.evidence.word(), "simulated");
        assert_eq!(electrode.haptic_range()[1], electrode.limit);
        assert_eq!(electrode.intervals.len(), 5);
    }
    tells_what_it_found(&study, &parts);
}

fn tells_what_it_found(study: &Study, parts: &[Part]) {
    let told = RunInfo {
        command: "experiment lee".to_owned(),
        cut_short: None,
        device: Vec::new(),
    };
    let outcome = study.outcome(parts, told).unwrap();
    let numbers: Vec<&str> = outcome.sheets.iter().map(|sheet| &*sheet.number).collect();
    let tables = (2..=7).map(|index| format!("Table {index}"));
    let figures = (7..=11).map(|index| format!("Figure {index}"));
    for number in tables.chain(figures) {
        assert!(numbers.contains(&&*number), "{number}");
    }
    // Table 7 follows from table 4 (except for K08 and the misprint of K06).
    let off = outcome
        .rows
        .iter()
        .find(|row| row.id == "t-rt-off-true")
        .unwrap();
    assert!(off.ours.unwrap() <= 0.5, "{off:?}");
    let lines = study.csv(parts).lines().count();
    assert_eq!(lines, 21);
    let heads = study
        .csv(parts)
        .lines()
        .next()
        .unwrap()
        .matches(',')
        .count();
    assert!(
        study
            .csv(parts)
            .lines()
            .all(|line| line.matches(',').count() == heads)
    );
}

/// A muscle of another structure is fitted less well than one with the model's structure.
#[test]
fn a_departure_shows_in_what_the_model_misses() {
    let study = study();
    let of = |size: f64| {
        let foreign = Foreign {
            kind: Kind::Activation,
            size,
        };
        let part = study.compute_unit(&Unit::Foreign(3, foreign, 0)).unwrap();
        let Part::Foreign(Ok(mismatch)) = part else {
            panic!()
        };
        mismatch.nrmse_percent[4]
    };
    let (little, all) = (of(0.125), of(1.0));
    assert!(little > 0.1 && all > 3.0 * little, "{little} {all}");
}
