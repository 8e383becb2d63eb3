//! A synthetic run that is written, truncated, read back and rendered. The page stays in Cargo's
//! temporary folder for inspection.

use host_core::analysis::metrics;
use host_core::record::{
    self, Assumption, ChannelInfo, Edge, Ending, PaperRow, Recorder, Role, Run, Sample, Samples,
    State, Trial,
};
use host_core::report::{self, Report};
use std::f64::consts::TAU;
use std::path::{Path, PathBuf};

/// Returns a sine as in Hamana's experiment 4, and a finger that follows it with delay and ripple,
/// up to `reach_deg`.
fn samples(channels: usize, delay_s: f64, reach_deg: f64) -> Samples {
    let target = |t: f64| 45.0 + 40.0 * (TAU * 0.2 * t).sin();
    let sample = |i: u32| {
        let t_s = f64::from(i) * 0.01;
        let true_deg = target(t_s - delay_s).min(reach_deg) + 2.0 * (TAU * 3.1 * t_s).sin();
        let effort = (target(t_s) - true_deg) / 10.0;
        let amplitude = |channel: usize| {
            let is_extensor = channel + 1 == channels;
            let share = if is_extensor { -effort } else { effort };
            14.0 + 12.0 * share.clamp(0.0, 1.0)
        };
        Sample {
            t_s,
            target_deg: Some(target(t_s)),
            measured_deg: Some(true_deg + 0.3 * (TAU * 37.0 * t_s).sin()),
            true_deg: Some(true_deg),
            effort: Some(effort),
            limiting: effort.abs() > 1.0,
            amplitudes: (0..channels).map(|c| Some(amplitude(c))).collect(),
            forces_n: (0..channels)
                .map(|c| Some((amplitude(c) - 14.0) * 0.8))
                .collect(),
            ..Sample::default()
        }
    };
    (0..3000).map(sample).collect()
}

/// Returns a cathodic-first pulse of 200 µs per phase on each channel, `offset_us` apart; if
/// `conducted`, the other channels are grounded meanwhile.
fn edges(channels: u8, offset_us: u64, conducted: bool) -> Vec<Edge> {
    let mut edges = Vec::new();
    for channel in 1..=channels {
        let start = 4_000_000 + u64::from(channel - 1) * offset_us;
        let dac_code = 20_000 + u16::from(channel) * 900;
        let mut edge = |t_us, channel, state| {
            edges.push(Edge {
                t_us,
                channel,
                state,
                dac_code,
            });
        };
        edge(start, channel, State::Cathodic);
        edge(start + 200, channel, State::Isolated);
        edge(start + 205, channel, State::Anodic);
        edge(start + 405, channel, State::Isolated);
        for other in (1..=channels).filter(|&other| conducted && other != channel) {
            edge(start, other, State::Grounded);
            edge(start + 405, other, State::Isolated);
        }
    }
    edges.sort_by_key(|edge| edge.t_us);
    edges
}

fn channel(number: u8, name: &str, limit: f64) -> ChannelInfo {
    ChannelInfo {
        number,
        name: name.to_owned(),
        unit: "V".to_owned(),
        limit,
        live_width: false,
        muscle: true,
        model: None,
        force: false,
        line: false,
        joint: None,
    }
}

fn trial(name: &str, delay_s: f64, reach_deg: f64, edges: Vec<Edge>) -> Trial {
    Trial {
        name: name.to_owned(),
        session_file: format!("sessions/{}.toml", name.replace(' ', "_")),
        duration_s: 30.0,
        channels: vec![
            channel(1, "flexor A", 28.0),
            channel(2, "flexor B", 36.0),
            channel(3, "extensor", 26.0),
        ],
        samples: samples(3, delay_s, reach_deg),
        edges,
        joint: true,
        measure: Some((10.0, 30.0)),
        counters: [("setpoints sent", 2700), ("frames lost", 3)]
            .map(|(name, count)| (name.to_owned(), count))
            .to_vec(),
        events: vec![(0.0, "armed <ok>".to_owned()), (30.0, "stopped".to_owned())],
        ..Trial::default()
    }
}

fn run() -> Run {
    Run {
        title: "Finger angle by one-point and two-point stimulation (synthetic data)".to_owned(),
        device: "native simulator".to_owned(),
        seed: Some(1),
        trials: vec![
            trial("one-point A", 0.25, 66.0, edges(3, 8000, false)),
            trial("one-point B", 0.35, 58.0, edges(3, 8000, false)),
            trial("two-point", 0.15, 90.0, edges(3, 2000, true)),
        ],
        ending: Ending::complete(),
        ..Run::default()
    }
}

/// Returns Hamana 2022, table 8, participants P and Q.
fn paper() -> Vec<PaperRow> {
    let row = |trial: &str, values: [f64; 5], participant: &str| PaperRow {
        trial: trial.to_owned(),
        values: values.to_vec(),
        source: format!("table 8, participant {participant}"),
    };
    vec![
        row("one-point A", [8.40, 19.0, 20.5, 13.5, 26.6], "P"),
        row("one-point A", [9.38, 22.8, 23.6, 24.2, 16.9], "Q"),
        row("two-point", [9.00, 11.0, 12.6, 10.6, 10.2], "P"),
        row("two-point", [17.9, 17.5, 12.0, 22.8, 9.48], "Q"),
    ]
}

fn folder(name: &str) -> PathBuf {
    // Not in the system's temporary folder, because the tests of another checkout may run at the
    // same time.
    let dir = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(format!("report-{name}"));
    let _ = std::fs::remove_dir_all(&dir);
    dir
}

#[test]
fn a_page_stands_alone_and_shows_the_numbers_of_the_run() {
    let run = run();
    let torque = "Conducted two-point stimulation has 2.2 times one-point's torque.";
    let assumptions = [
        (Role::PutIn, torque),
        (Role::CameOut, "The RMSE of each trial."),
    ]
    .map(|(role, text)| Assumption {
        role,
        text: text.to_owned(),
    });
    let report = Report {
        run: &run,
        paper: &paper(),
        assumptions: &assumptions,
        command: "cargo demo --seed 1",
    };
    let dir = folder("page");
    let begin = std::time::Instant::now();
    let path = report::write(&dir, &report).unwrap();
    let seconds = begin.elapsed().as_secs_f64();
    let html = std::fs::read_to_string(&path).unwrap();
    let size = html.len();
    println!("{}: {size} bytes in {seconds:.3} s", path.display());

    assert!(html.len() < 1_500_000, "{} bytes", html.len());
    let without_names = html.replace("http://www.w3.org/2000/svg", "");
    for request in "http: https: <script src= url( @import <link".split(' ') {
        assert!(
            !without_names.contains(request),
            "the page asks for {request}"
        );
    }
    for trial in &run.trials {
        // The number appears in the summary, above the panel, and in the table.
        let rmse = metrics(trial).unwrap().rmse_deg;
        let digits = if rmse < 9.995 { 2 } else { 1 };
        let printed = format!("{rmse:.digits$}°");
        assert!(html.matches(&printed).count() >= 3, "{printed}");
    }
    assert!(html.contains("no evidence about people"));
    assert!(html.contains("armed &lt;ok&gt;") && !html.contains("<ok>"));
    assert!(html.contains("<td>17.6°</td>"));
    assert_eq!(html.matches("<svg").count(), html.matches("</svg>").count());

    let summary = std::fs::read_to_string(dir.join("summary.json")).unwrap();
    let summary: serde_json::Value = serde_json::from_str(&summary).unwrap();
    let written = &summary["trials"][2]["metrics"]["rmse_deg"];
    assert_eq!(*written, metrics(&run.trials[2]).unwrap().rmse_deg);
}

#[test]
fn ten_channels_and_an_empty_run_draw_as_well() {
    let channels = (1..=10).map(|number| channel(number, "", 30.0)).collect();
    let wide = Trial {
        channels,
        samples: samples(10, 0.2, 90.0),
        edges: edges(10, 10_000, true),
        ..trial("ten channels", 0.2, 90.0, Vec::new())
    };
    let empty = Trial {
        name: "nothing came".to_owned(),
        ..Trial::default()
    };
    for (name, trials) in [
        ("ten", vec![wide]),
        ("empty", vec![empty]),
        ("none", Vec::new()),
    ] {
        let run = Run { trials, ..run() };
        let report = Report {
            run: &run,
            paper: &[],
            assumptions: &[],
            command: "flexor run",
        };
        let path = report::write(&folder(name), &report).unwrap();
        let html = std::fs::read_to_string(path).unwrap();
        assert!(html.len() < 1_500_000);
        assert!(html.contains("ten channels") || html.contains("No samples were recorded."));
    }
}

#[test]
fn a_run_reads_back_exactly() {
    let dir = folder("round-trip");
    record::save(&dir, &run()).unwrap();
    // The record is not marked as complete yet.
    let loaded = record::load(&dir).unwrap();
    assert!(loaded.ending.is_incomplete());
    let ending = Ending::complete();
    assert_eq!(Run { ending, ..loaded }, run());
}

/// Starts the record of a run whose first trial has no rows yet.
fn begun(dir: &Path) -> (Run, Recorder) {
    let run = run();
    let trial = Trial {
        samples: Samples::default(),
        ..run.trials[0].clone()
    };
    record::write_run(dir, &run).unwrap();
    let recorder = Recorder::create(dir, 0, &trial).unwrap();
    (run, recorder)
}

#[test]
fn an_interrupted_trial_keeps_its_complete_rows() {
    let dir = folder("interrupted");
    let (run, mut recorder) = begun(&dir);
    for sample in run.trials[0].samples.iter().take(250) {
        recorder.record_sample(&sample).unwrap();
    }
    recorder.record_event(2.5, "device unplugged").unwrap();
    drop(recorder);
    // A last row that is truncated within its last number still looks valid.
    let path = record::trial_folder(&dir, 0, &run.trials[0].name).join("samples.csv");
    let text = std::fs::read_to_string(&path).unwrap();
    std::fs::write(&path, &text[..text.len() - 3]).unwrap();

    let loaded = record::load(&dir).unwrap();
    assert_eq!(loaded.trials.len(), 1);
    let mut complete_rows = run.trials[0].samples.clone();
    complete_rows.truncate(249);
    assert_eq!(loaded.trials[0].samples, complete_rows);
    assert_eq!(loaded.trials[0].edges, run.trials[0].edges);
    let (_, last) = loaded.trials[0].events.last().unwrap();
    assert_eq!(last, "device unplugged");
}

#[test]
fn rows_reach_the_disk_while_the_trial_runs() {
    let dir = folder("streaming");
    let (run, mut recorder) = begun(&dir);
    let samples = run.trials[0].samples.to_vec();
    recorder.record_sample(&samples[0]).unwrap();
    recorder.record_sample(&samples[1]).unwrap();
    let loaded = record::load(&dir).unwrap();
    assert_eq!(loaded.trials[0].samples.to_vec(), samples[..2]);
}

#[test]
fn a_damaged_file_is_named_with_its_line() {
    let dir = folder("damaged");
    record::save(&dir, &run()).unwrap();
    let path = record::trial_folder(&dir, 0, "one-point A").join("edges.csv");
    let text = std::fs::read_to_string(&path).unwrap();
    std::fs::write(&path, text.replacen("cathodic", "cathodik", 1)).unwrap();
    let error = record::load(&dir).unwrap_err().to_string();
    let place = "edges.csv, line 2: state: \"cathodik\"";
    assert!(error.contains(place), "{error}");
}

/// Returns a run with one trial under force control: reference 4 N, predicted force `force_n`, and
/// limiting in every fourth sample.
fn force_run(force_n: Option<f64>) -> Run {
    let sample = |i: u32| Sample {
        t_s: f64::from(i) * 0.1,
        limiting: i.is_multiple_of(4),
        amplitudes: vec![Some(20.0)],
        forces_n: vec![force_n],
        wanted_n: vec![Some(4.0)],
        rates_hz: vec![Some(20.0)],
        below_n: vec![None],
        above_n: vec![None],
        ..Sample::default()
    };
    let trial = Trial {
        name: "ramp".to_owned(),
        channels: vec![ChannelInfo {
            force: true,
            line: false,
            joint: None,
            ..channel(1, "tibialis", 25.0)
        }],
        samples: (0..100).map(sample).collect(),
        ..Trial::default()
    };
    Run {
        title: "Force".to_owned(),
        trials: vec![trial],
        ending: Ending::complete(),
        ..Run::default()
    }
}

#[test]
fn a_page_tells_limiting_and_that_no_model_ran() {
    let limiting = "Limiting in 25 % of the samples with a reference force";
    let no_model = "No muscle model ran on channel 1";
    let written = |name: &str, run: &Run| {
        let dir = folder(name);
        let html = std::fs::read_to_string(report::write(&dir, &Report::from_run(run)).unwrap());
        let summary = std::fs::read(dir.join("summary.json")).unwrap();
        let summary: serde_json::Value = serde_json::from_slice(&summary).unwrap();
        assert_eq!(summary["trials"][0]["force_limiting_share"], 0.25);
        html.unwrap()
    };
    let predicted = written("tired", &force_run(Some(3.0)));
    assert!(predicted.contains(limiting) && !predicted.contains("No muscle model ran"));
    assert!(predicted.contains("Force that the device's muscle model predicts"));
    let html = written("no-model", &force_run(None));
    assert!(html.contains(limiting) && html.contains(no_model));
    assert!(html.contains("no force was predicted"));
    assert!(!html.contains("Nothing was recorded") && !html.contains("model predicts"));
}

#[test]
fn page_and_comparison_tell_models_pulses_and_limit_cycles_alike() {
    let mut run = force_run(Some(3.0));
    run.trials[0].channels[0].model = Some("calcium-force".to_owned());
    run.trials[0].pulses = Some(800);
    run.trials[0].counters = vec![("pulses started".to_owned(), 802)];
    let swung = "limit cycle: 6.0° peak to peak, period 400 ms; feedback at 70 %";
    run.trials[0].events = vec![(1.0, swung.to_owned()), (2.0, swung.to_owned())];
    let model_text = "calcium-force (channel 1)";
    let page = report::page(&Report::from_run(&run));
    assert!(page.contains(model_text));
    assert!(page.contains("<th scope=\"row\">pulses</th><td>800</td>"));
    assert!(page.contains("<th scope=\"row\">pulses started</th><td>802</td>"));
    let records = [report::ComparedRecord::from_run(Path::new("one"), &run)];
    assert!(report::compare_text(&records).contains(&format!("\n      {model_text}")));
    let cells = format!("<td>800</td><td>1</td><td>{model_text}</td>");
    assert!(report::compare_body(&records).as_str().contains(&cells));
    let row = &report::compare_rows(&records)[0].of;
    assert_eq!((row.pulses, row.limit_cycles), (Some(800), 1));
    assert!(report::compare_text(&records).contains("\n      limit cycles: 1\n"));
}
