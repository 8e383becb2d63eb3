//! Single cases of the comparison: starts, ends, clocks, skews, refusals.

use crate::common::{BEGIN_US, Draw, board_plan, exact, session};
use hal_sim::random::Sequence;
use hil::fit::{Alignment, Finding, FitError, FitOptions, Report, Side, Verdict, fit};
use hil::line::{Edge, Expected, ExpectedLine, MeasuredLine, Measurement};
use hil::plan::{Connection, connect};
use hil::synthesise::{Analyser, Fault, synthesise};

const MS: i64 = 1_000_000_000;

fn analyser(start_ps: i64, milliseconds: u64) -> Analyser {
    Analyser {
        samplerate_hz: 100_000_000,
        clock_ppb: 0,
        start_ps,
        samples: milliseconds * 100_000,
        jitter_samples: 1,
        seed: 11,
    }
}

/// Judges a part of the plan of the board.
fn judge(part: usize, analyser: &Analyser, faults: &[Fault]) -> Report {
    let expected = session(1, 0);
    let connections = &board_plan().captures[part];
    let lines = exact(&expected, connections, 5);
    let capture = synthesise(&lines, analyser, faults).unwrap();
    let measured = connect(&capture, connections).unwrap();
    fit(&expected, &measured, &FitOptions::default()).unwrap()
}

#[test]
fn a_whole_session_is_unique() {
    // The prediction ends 1 s after its start. Time after it is unknown.
    let after = judge(0, &analyser(-20 * MS, 1_100), &[]);
    match after.findings.as_slice() {
        [
            Finding::Outside {
                side: Side::After,
                length_us,
                edges: 0,
            },
        ] => {
            assert!((length_us - 80_000.0).abs() < 1.0, "{length_us}");
        }
        other => panic!("{other:?}"),
    }
    let report = judge(0, &analyser(-20 * MS, 1_019), &[]);
    assert_eq!(report.verdict, Verdict::Passed, "{report:?}");
    assert!((report.covered_us - 999_000.0).abs() < 1.0, "{report:?}");
    assert_eq!(report.alignment, Alignment::Unique);
    assert!((report.start_us + 20_000.0).abs() < 0.2, "{report:?}");
    // 37 periods with 2 edges on each line, and 4 on the first line of channel 4.
    assert_eq!(report.compared, 37 * (7 * 2 + 4));
    assert!(report.rms_ns < 60.0 && report.largest_ns.abs() < 129.0);
    assert!(report.line_spread_ns < 40.0, "{report:?}");
    assert!(report.clock_ppm.abs() < 0.1, "{report:?}");
}

/// The electrode check plays pulses before the session: a capture with one is refused.
#[test]
fn edges_before_the_prediction_are_found() {
    let mut expected = session(1, 0);
    expected.from_us = BEGIN_US;
    let connections = &board_plan().captures[0];
    let check = |line| Fault::AddPulse {
        line,
        time_ps: 210 * MS,
        width_ps: 200_000_000,
    };
    let lines = exact(&expected, connections, 5);
    let capture = synthesise(&lines, &analyser(200 * MS, 700), &[check(0), check(3)]).unwrap();
    let measured = connect(&capture, connections).unwrap();
    let report = fit(&expected, &measured, &FitOptions::default()).unwrap();
    match report.findings.as_slice() {
        [
            Finding::Outside {
                side: Side::Before,
                length_us,
                edges: 4,
            },
        ] => assert!((length_us - 50_000.0).abs() < 1.0, "{length_us}"),
        other => panic!("{other:?}"),
    }
}

#[test]
fn captures_that_begin_or_end_within_a_pulse_pass() {
    // 100 µs, 210 µs and 300 µs after the start of a pulse of channel 1, then within channel 4.
    for after_us in [100, 210, 300, 6_100, 11_300] {
        let start = (BEGIN_US as i64 + 40_000 + after_us) * 1_000_000;
        for part in 0..3 {
            let report = judge(part, &analyser(start, 100), &[]);
            assert_eq!(report.verdict, Verdict::Passed, "{after_us} {report:?}");
        }
    }
}

#[test]
fn clock_errors_up_to_1000_ppm_are_measured() {
    for ppm in [-1_000, -600, -201, -199, 0, 199, 201, 600, 1_000] {
        let analyser = Analyser {
            clock_ppb: ppm * 1_000,
            ..analyser(200 * MS, 700)
        };
        let report = judge(1, &analyser, &[]);
        assert!((report.clock_ppm - ppm as f64).abs() < 0.1, "{report:?}");
        let clock_error = matches!(report.findings.as_slice(), [Finding::ClockError { .. }]);
        assert_eq!(clock_error, ppm.abs() > 200, "{report:?}");
        assert_eq!(report.verdict == Verdict::Passed, ppm.abs() < 200);
    }
}

#[test]
fn an_unknown_skew_appears_between_the_lines() {
    let mut expected = session(1, 0);
    let connections = &board_plan().captures[1];
    let lines = exact(&expected, connections, 5);
    let capture = synthesise(&lines, &analyser(200 * MS, 700), &[]).unwrap();
    let measured = connect(&capture, connections).unwrap();
    let known = fit(&expected, &measured, &FitOptions::default()).unwrap();
    expected
        .lines
        .iter_mut()
        .for_each(|line| line.skew_ns = 0.0);
    let unknown = fit(&expected, &measured, &FitOptions::default()).unwrap();
    assert_eq!(known.verdict, Verdict::Passed, "{known:?}");
    assert!(unknown.line_spread_ns > known.line_spread_ns + 15.0);
    // 48 ns between the ports widen the range of 119 ns.
    match unknown.findings.as_slice() {
        [Finding::TooWide { range_ns, .. }] => assert!((160.0..200.0).contains(range_ns)),
        other => panic!("{other:?}"),
    }
}

#[test]
fn a_line_that_is_late_as_a_whole_gives_one_finding() {
    let expected = session(1, 0);
    let connections = &board_plan().captures[0];
    let mut lines = exact(&expected, connections, 5);
    for edge in &mut lines[2].edges {
        edge.time_ps += 1_000_000;
    }
    let capture = synthesise(&lines, &analyser(200 * MS, 700), &[]).unwrap();
    let measured = connect(&capture, connections).unwrap();
    let report = fit(&expected, &measured, &FitOptions::default()).unwrap();
    match report.findings.as_slice() {
        [Finding::LineShifted { line, mean_ns, .. }] => {
            assert_eq!(line, "c2");
            assert!((mean_ns - 1_000.0).abs() < 30.0, "{mean_ns}");
        }
        other => panic!("{other:?}"),
    }
}

#[test]
fn a_large_move_and_a_last_missing_edge_are_named() {
    let report = judge(
        0,
        &analyser(200 * MS, 700),
        &[Fault::MoveEdge {
            line: 1,
            edge: 6,
            by_ps: 35_000_000,
        }],
    );
    let time_us = BEGIN_US + 60_000 + 250;
    match report.findings.as_slice() {
        [
            Finding::EdgeMoved {
                line,
                time_us: found,
                edge: Edge::Rising,
                deviation_ns,
            },
        ] => {
            assert_eq!((line.as_str(), *found), ("a1", time_us));
            assert!((deviation_ns - 35_000.0).abs() < 119.0);
        }
        other => panic!("{other:?}"),
    }
    // The capture ends 50 µs after the missing falling edge of channel 1.
    let short = Analyser {
        samples: (BEGIN_US + 80_250 - 200_000) * 100,
        ..analyser(200 * MS, 0)
    };
    let report = judge(0, &short, &[Fault::DropEdge { line: 0, edge: 9 }]);
    let finding = Finding::EdgeMissing {
        line: "c1".into(),
        time_us: BEGIN_US + 80_200,
        edge: Edge::Falling,
    };
    assert_eq!(report.findings, [finding]);
}

#[test]
fn several_faults_are_all_named() {
    let faults = [
        Fault::HoldLine {
            line: 4,
            high: true,
        },
        Fault::SwapLines {
            first: 0,
            second: 2,
        },
        Fault::InvertLine { line: 6 },
        Fault::MoveEdge {
            line: 3,
            edge: 10,
            by_ps: -1_000_000,
        },
    ];
    let report = judge(0, &analyser(200 * MS, 700), &faults);
    let text: Vec<String> = report.findings.iter().map(ToString::to_string).collect();
    assert_eq!(text.len(), 4, "{text:?}");
    assert_eq!(text[0], "c1 and c2: exchange their probes");
    assert!(
        text[1].starts_with("a2: the rising edge at 352250 µs deviates by -"),
        "{text:?}"
    );
    assert_eq!(
        text[2],
        "c3: always high, with 66 edges predicted; check the probe"
    );
    assert_eq!(text[3], "c4: the levels are inverted; check the isolator");
}

#[test]
fn a_wholly_inverted_capture_is_named() {
    let faults: Vec<Fault> = (0..8).map(|line| Fault::InvertLine { line }).collect();
    let report = judge(0, &analyser(200 * MS, 700), &faults);
    let inverted = |finding: &Finding| matches!(finding, Finding::LineInverted { .. });
    assert_eq!(report.findings.len(), 8, "{:?}", report.findings);
    assert!(report.findings.iter().all(inverted));
}

#[test]
fn a_probe_on_a_line_of_another_capture_is_named() {
    let expected = session(1, 0);
    let plan = board_plan();
    let mut wrong = plan.captures[0].clone();
    wrong[3].line = "c9".into();
    let lines = exact(&expected, &wrong, 5);
    let capture = synthesise(&lines, &analyser(200 * MS, 700), &[]).unwrap();
    let measured = connect(&capture, &plan.captures[0]).unwrap();
    let report = fit(&expected, &measured, &FitOptions::default()).unwrap();
    let finding = Finding::LineCarriesOther {
        line: "a2".into(),
        carries: "c9".into(),
    };
    assert_eq!(report.findings, [finding]);
}

/// One line with a period and widths that repeat after ten pulses.
fn one_line(first_us: u64, pulses: u64) -> Expected {
    let pulse = |n: u64| [first_us + n * 10_000, first_us + n * 10_000 + 200 + n % 10];
    Expected {
        from_us: 0,
        until_us: first_us + pulses * 10_000,
        lines: vec![ExpectedLine {
            name: "c1".into(),
            skew_ns: 0.0,
            first_high: false,
            edges_us: (0..pulses).flat_map(pulse).collect(),
        }],
        toggling: Vec::new(),
    }
}

fn measure(expected: &Expected, from: usize, until: usize, rate: u64) -> Measurement {
    let edges = &expected.lines[0].edges_us[from..until];
    let sample = |t_us: &u64| (t_us - edges[0] + 5) * rate / 1_000_000;
    Measurement {
        samplerate_hz: rate,
        samples: sample(edges.last().unwrap()) + rate / 1_000,
        lines: vec![MeasuredLine {
            name: "c1".into(),
            first_high: from % 2 == 1,
            edges: edges.iter().map(sample).collect(),
        }],
    }
}

#[test]
fn a_single_line_with_changing_widths_is_aligned() {
    let expected = one_line(3_000, 95);
    let measured = measure(&expected, 44, 90, 100_000_000);
    let report = fit(&expected, &measured, &FitOptions::default()).unwrap();
    assert_eq!(report.verdict, Verdict::Passed, "{report:?}");
    let Alignment::Repeated { period_us, .. } = report.alignment else {
        panic!("{report:?}");
    };
    assert_eq!(period_us, 100_000);
    assert!(report.largest_ns.abs() < 1.0 && report.clock_ppm.abs() < 1e-3);
}

#[test]
fn captures_that_cannot_be_compared_are_refused() {
    let expected = one_line(3_000, 40);
    let measured = measure(&expected, 10, 40, 100_000_000);
    let options = FitOptions::default();
    let error = |expected: &Expected, measured: &Measurement, options: &FitOptions| {
        let error = fit(expected, measured, options).expect_err("refused");
        assert!(error.to_string().contains(';'), "{error}");
        error
    };
    let few = measure(&expected, 10, 16, 100_000_000);
    let refusal = error(&expected, &few, &options);
    assert!(matches!(refusal, FitError::TooFewEdges { .. }), "{refusal}");
    let mut other = measured.clone();
    other.lines[0].edges.clear();
    assert_eq!(
        error(&expected, &other, &options),
        FitError::NothingMeasured
    );
    other.samples = 0;
    assert_eq!(
        error(&expected, &other, &options),
        FitError::NothingMeasured
    );
    other.lines.clear();
    assert_eq!(
        error(&expected, &other, &options),
        FitError::NothingMeasured
    );
    let mut silent = expected.clone();
    silent.lines[0].edges_us.clear();
    assert_eq!(
        error(&silent, &measured, &options),
        FitError::NothingExpected
    );

    let mut other = measured.clone();
    other.lines[0].name = "c2".into();
    assert_eq!(error(&expected, &other, &options).number(), 1);
    let mut other = measured.clone();
    other.lines.push(other.lines[0].clone());
    assert_eq!(error(&expected, &other, &options).number(), 2);
    for edge in [0, measured.samples, measured.lines[0].edges[4]] {
        let mut other = measured.clone();
        other.lines[0].edges[5] = edge;
        assert_eq!(error(&expected, &other, &options).number(), 3);
    }
    let mut other = expected.clone();
    other.lines[0].edges_us.swap(0, 1);
    assert_eq!(error(&other, &measured, &options).number(), 3);
    let mut other = measured.clone();
    other.samplerate_hz = 0;
    assert_eq!(error(&expected, &other, &options).number(), 4);
    for skew_ns in [f64::NAN, f64::INFINITY, -1_001.0] {
        let mut other = expected.clone();
        other.lines[0].skew_ns = skew_ns;
        assert_eq!(error(&other, &measured, &options).number(), 4);
    }
    for range_ns in [f64::NAN, -1.0, 1_001.0] {
        let options = FitOptions {
            range_ns,
            ..options
        };
        assert_eq!(error(&expected, &measured, &options).number(), 4);
    }
    // Another rate than stated, so that nothing fits.
    let mut other = measured.clone();
    other.samplerate_hz = 90_000_000;
    assert_eq!(error(&expected, &other, &options).number(), 7);
}

#[test]
fn random_edges_are_refused() {
    let expected = session(1, 0);
    let mut random = Sequence::new(1);
    let lines = ["c1", "a1", "sync"].map(|name| {
        let mut edges: Vec<u64> = (0..400).map(|_| 1 + random.below(9_999_999)).collect();
        edges.sort_unstable();
        edges.dedup();
        MeasuredLine {
            name: name.into(),
            first_high: false,
            edges,
        }
    });
    let measured = Measurement {
        samplerate_hz: 100_000_000,
        samples: 10_000_000,
        lines: lines.into(),
    };
    let error = fit(&expected, &measured, &FitOptions::default()).unwrap_err();
    assert!(matches!(error, FitError::NotAligned { .. }), "{error}");
}

#[test]
fn equal_inputs_give_equal_reports() {
    let reports = [0, 1].map(|_| Draw::new(4, 50_000_000, 100, 0).fit(&[]).unwrap());
    assert_eq!(reports[0], reports[1]);
}

#[test]
fn a_constant_line_with_the_wrong_level_is_found() {
    let expected = Expected {
        lines: [
            one_line(3_000, 40).lines,
            vec![ExpectedLine {
                name: "a1".into(),
                skew_ns: 0.0,
                first_high: false,
                edges_us: Vec::new(),
            }],
        ]
        .concat(),
        ..one_line(3_000, 40)
    };
    let mut measured = measure(&expected, 10, 40, 100_000_000);
    for first_high in [false, true] {
        measured.lines.truncate(1);
        measured.lines.push(MeasuredLine {
            name: "a1".into(),
            first_high,
            edges: Vec::new(),
        });
        let report = fit(&expected, &measured, &FitOptions::default()).unwrap();
        let wrong = Finding::WrongLevel {
            line: "a1".into(),
            high: true,
        };
        let findings = if first_high { vec![wrong] } else { vec![] };
        assert_eq!(report.findings, findings);
    }
}

#[test]
fn connections_need_their_probes() {
    let expected = session(1, 0);
    let connections = &board_plan().captures[0];
    let lines = exact(&expected, connections, 5);
    let capture = synthesise(&lines, &analyser(200 * MS, 100), &[]).unwrap();
    let missing = [Connection {
        bit: 9,
        line: "c1".into(),
    }];
    let error = connect(&capture, &missing).unwrap_err();
    assert!(error.to_string().contains("bit 9 for line `c1`"), "{error}");
}

#[test]
fn a_floating_probe_does_not_disturb_the_other_lines() {
    let expected = session(1, 0);
    let connections = &board_plan().captures[0];
    let mut lines = exact(&expected, connections, 5);
    let mut random = Sequence::new(3);
    let mut time_ps = 0;
    lines[5].edges = (0..200_000)
        .map(|n| {
            time_ps += 1_000_000 + random.below(8_000_000) as i64;
            hil::synthesise::ExactEdge {
                time_ps,
                high: n % 2 == 0,
            }
        })
        .collect();
    let moved = Fault::MoveEdge {
        line: 0,
        edge: 10,
        by_ps: 1_000_000,
    };
    let capture = synthesise(&lines, &analyser(200 * MS, 700), &[moved]).unwrap();
    let measured = connect(&capture, connections).unwrap();
    let report = fit(&expected, &measured, &FitOptions::default()).unwrap();
    match report.findings.as_slice() {
        [
            Finding::EdgeMoved { line, time_us, .. },
            Finding::LineDiffers { line: noisy, .. },
        ] => assert_eq!(
            (line.as_str(), *time_us, noisy.as_str()),
            ("c1", 350_000, "a3")
        ),
        other => panic!("{other:?}"),
    }
}

#[test]
fn a_missing_pulse_that_looks_like_the_end_is_ambiguous() {
    let mut expected = one_line(3_000, 40);
    let line = &mut expected.lines[0];
    line.edges_us = (0..40)
        .flat_map(|n| [3_000 + n * 10_000, 3_200 + n * 10_000])
        .collect();
    let mut measured = measure(&expected, 20, 40, 100_000_000);
    // The next pulse follows after 9.8 ms. The prediction ends 14.8 ms after its last pulse.
    expected.until_us += 5_000;
    for (after_us, verdict) in [
        (1_000, Verdict::Passed),
        (11_000, Verdict::Ambiguous),
        (16_000, Verdict::Failed),
    ] {
        measured.samples = measured.lines[0].edges.last().unwrap() + after_us * 100;
        let report = fit(&expected, &measured, &FitOptions::default()).unwrap();
        assert_eq!(report.verdict, verdict, "{report:?}");
    }
}

#[test]
fn arbitrary_inputs_never_panic() {
    let mut random = Sequence::new(21);
    let mut edges = |limit: u64, count: u64| {
        let mut edges: Vec<u64> = (0..count).map(|_| 1 + random.below(limit)).collect();
        edges.sort_unstable();
        edges.dedup();
        edges
    };
    let mut aligned = 0;
    for round in 0..3_000_u64 {
        let span = [3, 40, 3_000, 1 << 40][round as usize % 4];
        let name = |n: u64| format!("l{n}");
        let expected = (0..round % 4).map(|n| ExpectedLine {
            name: name(n),
            skew_ns: 47.0 * n as f64,
            first_high: n == 1,
            edges_us: edges(span, round % 23),
        });
        let expected = Expected {
            from_us: 0,
            until_us: span,
            lines: expected.collect(),
            toggling: Vec::new(),
        };
        let measured = (0..round % 4).map(|n| MeasuredLine {
            name: name(n),
            first_high: round % 5 == n,
            edges: if round % 7 == 0 {
                edges(span * 100, round % 31)
            } else {
                let line = &expected.lines[n as usize];
                line.edges_us.iter().map(|t_us| t_us * 100 + 7).collect()
            },
        });
        let measured = Measurement {
            samplerate_hz: 100_000_000,
            samples: span * 100 + 10,
            lines: measured.collect(),
        };
        aligned += u32::from(fit(&expected, &measured, &FitOptions::default()).is_ok());
    }
    assert!(aligned > 300, "{aligned}");
}
