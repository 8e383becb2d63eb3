//! Tests of experiments: declarations, crossed factors, the contents of a sweep, a paper's wall on
//! the whole device.

use crate::declared::refusal;
use crate::sweeps::swept;
use host_core::link::Interruption;
use host_core::record::{Sample, Trial};
use host_core::run::DeviceName;
use host_core::wearer::builtin_wearer;
use std::fs;
use std::path::{Path, PathBuf};
use studies::experiments::load_experiment;
use studies::laboratory::{
    ConductedTrial, Declaration, Experiment, LaboratoryError, Operator, Outcome, ProtocolEnd,
    Shard, publish, rebuild_page,
};

pub(crate) const SESSION: &str =
    include_str!("../../sessions/harris_wall/3_pre_wall_co_contraction.toml");

/// A declaration with two walls, each hit for 1.5 s, which runs quickly.
pub(crate) const SMALL: &str = r#"
name = "small"
title = "Small"
source = "nobody"
session = "wall.toml"
seed = 3
draws = 10
measures = ["deepest_deg", "charge_mc"]

[[factor]]
name = "wall"
[[factor.level]]
name = "pre-wall"
unset = ["wall.co_contraction"]
set = { duration_s = 1.5, "body.start_deg" = 84.0, "body.approaches" = [{ at_s = 0.2, speed_deg_per_s = 30.0, for_s = 9.0 }] }
[[factor.level]]
name = "bare"
unset = ["wall.co_contraction", "wall.pre_wall"]
set = { duration_s = 1.5, "body.start_deg" = 84.0, "body.approaches" = [{ at_s = 0.2, speed_deg_per_s = 30.0, for_s = 9.0 }] }

[[draw]]
field = "body.push_nm"
low = 0.6
high = 2.4
source = "assumed"

[[claim]]
id = "more-charge"
says = "a pre-wall takes more charge"
measure = "charge_mc"
factor = "wall"
this = "pre-wall"
is = "more"
than = "bare"
[[claim]]
id = "not-more"
says = "and not the reverse"
none = ["more-charge"]
"#;

pub(crate) fn texts(name: &str) -> Result<String, LaboratoryError> {
    let wearer = name.strip_prefix("../../wearers/").and_then(builtin_wearer);
    Ok(wearer.unwrap_or(SESSION).to_owned())
}

pub(crate) fn small() -> Experiment {
    Experiment::new("small.toml", SMALL, &texts).unwrap()
}

pub(crate) fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR"))
        .join("laboratory")
        .join(name);
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(folder.parent().unwrap()).unwrap();
    folder
}

#[test]
fn everything_wrong_with_a_declaration_is_told_at_once() {
    let bad = SMALL
        .replace("name = \"small\"", "name = \"Sm all\"")
        .replace("\"charge_mc\"]", "\"charm\"]")
        .replace("low = 0.6", "low = 6.0")
        .replace("than = \"bare\"", "than = \"pre-fall\"")
        .replace("none = [\"more-charge\"]", "none = [\"less-charge\"]")
        .replace("draws = 10", "draws = 0\n[protocol]\nblocks = 0");
    // A table ends the fields before it.
    let bad = bad.replace("draws = 0\n[protocol]\nblocks = 0\n", "draws = 0\n");
    let bad = bad + "\n[protocol]\nblocks = 0\n";
    let error = Declaration::parse("bad.toml", &bad)
        .unwrap_err()
        .to_string();
    for wanted in [
        "E600 the declaration bad.toml has mistakes",
        "`Sm all`",
        "no measure `charm`",
        "draw `body.push_nm` goes from 6 to 2.4",
        "no level `pre-fall`",
        "no claim `less-charge`",
        "0 draws",
        "a block is empty",
    ] {
        assert!(error.contains(wanted), "{wanted}: {error}");
    }
    let typo = SMALL.replace("draws = 10", "drwas = 10");
    let error = Declaration::parse("typo.toml", &typo)
        .unwrap_err()
        .to_string();
    assert!(error.contains("line 7: unknown field `drwas`"), "{error}");
    // Two wrong types, a missing session and a stop without effect are all reported together.
    let many = SMALL
        .replace("draws = 10", "draws = \"ten\"")
        .replace("seed = 3", "seed = -3")
        .replace(
            "name = \"pre-wall\"\n",
            "name = \"pre-wall\"\nsessio = 1\nsession = 4\n",
        )
        .replace("low = 0.6\nhigh = 2.4", "low = \"x\"\nhigh = \"y\"")
        + "[protocol]\nblocks = \"z\"\nwearer = \"other\"\nstop = { angle = 5 }\n";
    let error = Declaration::parse("many.toml", &many).unwrap_err();
    let error = error.to_string();
    let bad = ["\"ten\"", "-3", "sessio ", "session = 4", "\"x\"", "\"y\""];
    let bad = bad.iter().chain(&["\"z\"", "\"other\"", "angle = 5"]);
    for wanted in bad.clone() {
        let line = 1 + many[..many.find(wanted).unwrap()].matches('\n').count();
        let told = error.contains(&format!("line {line}: "));
        assert!(told, "{wanted}, line {line}: {error}");
    }
    assert_eq!(error.lines().count(), bad.count(), "{error}");
    let nowhere = |_: &str| {
        let absent = std::io::Error::other("gone");
        Err(LaboratoryError::File("wall.toml".to_owned(), absent))
    };
    let bad = SMALL.replace("draws = 10", "draws = 0") + "\n[protocol]\nstop = {}\n";
    let error = Experiment::new("bad.toml", &bad, &nowhere).unwrap_err();
    for wanted in [
        "the session `wall.toml` cannot be read",
        "0 draws",
        "stop has no criterion",
    ] {
        assert!(error.to_string().contains(wanted), "{wanted}: {error}");
    }
    let empty = SMALL.replace("[[factor.level]]\nname = \"bare\"", "[[factor.level]]");
    assert!(Declaration::parse("empty.toml", &empty).is_err());
}

#[test]
fn what_a_declaration_cannot_answer_is_noted_before_it_runs() {
    let session = include_str!("../../sessions/open_finger.toml");
    let text = r#"
name = "open"
title = "Open"
source = "nobody"
session = "open_finger.toml"
seed = 1
draws = 1
measures = ["swing_deg", "peak_deg", "rmse_deg"]
[protocol]
blocks = 2
repetitions = 3
[[factor]]
name = "amplitude"
[[factor.level]]
name = "low"
set = { "setpoints.values" = [{ channel = 1, value = 24.5 }, { channel = 2, value = 0.0 }] }
[[factor.level]]
name = "high"
set = { "setpoints.values" = [{ channel = 1, value = 26.5 }, { channel = 2, value = 0.0 }] }
"#;
    let open =
        |text: &str| Experiment::new("open.toml", text, &|_| Ok(session.to_owned())).unwrap();
    let notes = open(text).advice().unwrap();
    assert_eq!(notes.len(), 3, "{notes:?}");
    assert!(notes[0].contains("`swing_deg` has no value in 2 of 2 conditions"));
    assert!(notes[1].contains("`rmse_deg`") && notes[2].contains("all 6 trials"));
    // The notes are true: in a trial these measures have no value, and others have one.
    let experiment = open(text);
    let unit = experiment.unit(1, 1, 0);
    let measured = format!("{:?}", experiment.measure_unit(&unit).unwrap());
    assert!(
        measured.contains("None") && measured.contains("Some"),
        "{measured}"
    );
    let same = text.replace("[protocol]", "[protocol]\nwearer = \"same\"");
    assert_eq!(open(&same).advice().unwrap().len(), 2);
    // Shipped studies name no measure that they cannot have.
    for name in ["harris-wall", "hamana-4"] {
        let advice = load_experiment(name).unwrap().advice().unwrap();
        assert!(advice.is_empty(), "{name}: {advice:?}");
    }
}

#[test]
fn a_condition_that_no_device_arms_is_refused_by_name() {
    let beyond = SMALL.replacen(
        "duration_s = 1.5, \"body.start_deg\"",
        "\"wall.max\" = 90.0, \"body.start_deg\"",
        1,
    );
    let error = refusal(&beyond);
    assert!(
        error.starts_with("E601 the declaration small.toml has invalid conditions: condition `pre"),
        "{error}"
    );
    let beyond = SMALL.replace(
        "duration_s = 1.5,",
        "duration_s = 1.5, \"wall.max\" = 90.0,",
    );
    let error = refusal(&beyond);
    let wanted = "conditions `pre-wall`, `bare` yield sessions that no device would arm: ";
    assert!(error.contains(wanted), "{error}");
}

/// Operator who continues until a number of trials have run, and records the rests.
pub(crate) struct LimitedOperator(pub usize, pub Vec<f64>);

impl Operator for LimitedOperator {
    fn ready(&mut self, _: &str) -> bool {
        true
    }

    fn rest(&mut self, rest_s: f64) -> bool {
        self.1.push(rest_s);
        self.1.len() < self.0
    }

    fn progress(&mut self, _: f64) {}

    fn interruption(&self) -> Interruption {
        Interruption::default()
    }
}

#[test]
fn a_protocol_aborted_at_any_step_says_how_far_it_came() {
    let text = format!("{SMALL}\n[protocol]\nblocks = 2\nrest_s = 1.0\nblock_rest_s = 9.0\n");
    let experiment = Experiment::new("small.toml", &text, &texts).unwrap();
    for rests in 1..=4 {
        let mut operator = LimitedOperator(rests, Vec::new());
        let dir = folder(&format!("aborted{rests}"));
        let course = experiment
            .conduct(&dir, (&DeviceName::Native, 3), &mut operator)
            .unwrap();
        assert_eq!((course.trials.len(), course.of), (rests.min(4), 4));
        assert_eq!(course.ended.is_some(), rests < 4);
        let wanted = [1.0, 9.0, 1.0];
        assert_eq!(operator.1, wanted[..rests.min(3)]);
    }
    for (stop, wanted) in [
        ("angle_above_deg = nan", "E600"),
        ("force_above_n = 5.0", "E614"),
    ] {
        let text = format!("{text}stop = {{ {stop} }}\n");
        let refused = Experiment::new("small.toml", &text, &texts).map(|_| ());
        let told = refused.unwrap_err().to_string();
        assert!(told.starts_with(wanted), "{told}");
    }
    // Every criterion that would stop nothing is reported at once.
    let no_joint = format!("{text}stop = {{ force_above_n = 5.0 }}\n");
    let told = Experiment::new("small.toml", &no_joint, &texts).map(|_| ());
    let told = told.unwrap_err().to_string();
    for condition in ["pre-wall", "bare"] {
        assert!(
            told.contains(&format!("`force_above_n` in `{condition}`")),
            "{told}"
        );
    }
    let text = text + "stop = { angle_above_deg = 88.0 }\n";
    let experiment = Experiment::new("small.toml", &text, &texts).unwrap();
    let dir = folder("criterion");
    let mut operator = LimitedOperator(9, Vec::new());
    let course = experiment
        .conduct(&dir, (&DeviceName::Native, 3), &mut operator)
        .unwrap();
    assert_eq!(course.trials.len(), 1);
    assert!(
        matches!(&course.ended, Some(ProtocolEnd::Criterion(what)) if what.contains("above 88°"))
    );
}

/// Runs Harris' walls on the whole device: the output, the felt forces, the repetition.
#[test]
fn harris_walls_render_what_they_say() {
    let experiment = load_experiment("harris-wall").unwrap();
    let conduct = |name: &str| {
        let mut operator = LimitedOperator(99, Vec::new());
        let place = (&DeviceName::Native, 1);
        let course = experiment
            .conduct(&folder(name), place, &mut operator)
            .unwrap();
        assert!(course.ended.is_none());
        course.trials
    };
    let all = conduct("harris");
    assert_eq!(all.len(), 20);
    let again = conduct("harris_again");
    assert!(all.iter().zip(&again).all(|(a, b)| a.trial == b.trial));
    for conducted in &all {
        renders(conducted);
    }
}

fn renders(conducted: &ConductedTrial) {
    let trial = &conducted.trial;
    let wall = trial.wall.unwrap();
    // A burst has an amplitude computed up to 20 ms after the angle was measured.
    let (slack, front) = (2.0, wall.at_deg - wall.pre_wall_deg);
    let before = |s: &Sample| s.measured_deg.is_some_and(|deg| deg < front - slack);
    // At the end of the trial the current falls.
    let inside = |s: &Sample| s.measured_deg > Some(wall.at_deg + slack) && s.t_s < 7.9;
    let silent = trial.samples.iter().filter(before);
    assert!(silent.clone().count() > 50, "{}", trial.name);
    assert!(
        silent
            .clone()
            .all(|s| s.amplitudes.iter().all(Option::is_none))
    );
    assert!(trial.samples.iter().all(|s| s.amplitudes[0] <= Some(80.0)));
    let has_antagonist = trial.name.contains("co-contraction");
    let is_steep = wall.pre_wall_deg > 0.0 || trial.name.contains("on-off");
    let least = if is_steep { 79.9 } else { 8.0 };
    for s in trial.samples.iter().filter(inside) {
        assert!(s.amplitudes[0] >= Some(least), "{}: {s:?}", trial.name);
        let biceps = s.amplitudes.get(1).copied().flatten();
        assert_eq!(biceps, has_antagonist.then_some(40.0), "{}", trial.name);
    }
    assert!(
        conducted.measured.iter().all(Option::is_some),
        "{}",
        trial.name
    );
}

/// Runs the small protocol with one trial of each wall; returns its record and its result.
fn published(name: &str) -> (PathBuf, Vec<ConductedTrial>, Outcome) {
    let (experiment, dir) = (small(), folder(name));
    let mut operator = LimitedOperator(9, Vec::new());
    let course = experiment
        .conduct(&dir, (&DeviceName::Native, 3), &mut operator)
        .unwrap();
    let outcome = Outcome::from_trials(&experiment, ("native", 3), &course.trials, Some(true));
    publish(&dir, &outcome, &course.trials).unwrap();
    (dir, course.trials, outcome)
}

fn page_of(dir: &Path) -> String {
    fs::read_to_string(dir.join("result.html")).unwrap()
}

/// Returns the part of a page between two texts.
fn between<'a>(page: &'a str, from: &str, to: &str) -> &'a str {
    let (_, rest) = page.split_once(from).unwrap();
    rest.split_once(to).unwrap().0
}

#[test]
fn a_page_is_made_of_the_result_and_the_record_alone() {
    let (dir, trials, _) = published("page");
    let page = page_of(&dir);
    let recorded: Vec<Trial> = trials
        .into_iter()
        .map(|measurement| measurement.trial)
        .collect();
    fs::remove_file(dir.join("result.html")).unwrap();
    let renewed = rebuild_page(&dir, &recorded).unwrap();
    assert_eq!(renewed, Some(dir.join("result.html")));
    assert_eq!(page_of(&dir), page);
    // Without a result there is no page; an invalid result is refused.
    assert_eq!(rebuild_page(&folder("nothing"), &[]).unwrap(), None);
    fs::write(dir.join("result.json"), "{}").unwrap();
    let refused = rebuild_page(&dir, &recorded).unwrap_err().to_string();
    assert!(refused.starts_with("E608"), "{refused}");
}

#[test]
fn drawn_angles_and_edges_are_those_of_the_record() {
    let (dir, trials, _) = published("drawn");
    let page = page_of(&dir);
    let limbs = between(&page, "<h2>Movement of the limb</h2>", "</section>");
    let timing = between(&page, "<h2>Timing of the pulses</h2>", "</section>");
    for conducted in &trials {
        let trial = &conducted.trial;
        let measured = || trial.samples.iter().filter_map(|s| s.measured_deg);
        let furthest = measured().fold(f64::MIN, f64::max);
        let tenths = |deg: f64| (deg * 10.0).round() / 10.0;
        let start = tenths(measured().next().unwrap());
        let words = format!("start {start}°, furthest {}°, wall 90°", tenths(furthest));
        assert!(limbs.contains(&words), "{words}: {limbs}");
        assert!(!trial.edges.is_empty() && timing.contains(&trial.name));
    }
    // The forearm hangs down at 0°: blue, from the elbow to its end, without the pad.
    let circles = limbs.split("<circle cx=\"").skip(1);
    let blue =
        circles.filter(|circle| circle.contains("fill=\"#0072B2\"") && !circle.contains("r=\"5\""));
    let at = |text: &str| -> (f64, f64) {
        let number = |nth| text.split('"').nth(nth).unwrap().parse().unwrap();
        (number(0), number(2))
    };
    let blue: Vec<(f64, f64)> = blue.map(at).collect();
    assert_eq!(blue.len(), 2 * trials.len());
    for (conducted, bone) in trials.iter().zip(blue.chunks(2)) {
        let measured = conducted
            .trial
            .samples
            .iter()
            .filter_map(|s| s.measured_deg);
        let furthest = measured.fold(f64::MIN, f64::max);
        let drawn = (bone[1].0 - bone[0].0).atan2(bone[1].1 - bone[0].1);
        assert!(
            (drawn.to_degrees() - furthest).abs() < 0.2,
            "{drawn} {furthest}"
        );
    }
    // The bare wall's triceps pulses exactly as the pre-wall's, so one drawing shows both.
    assert_eq!(timing.matches("<svg").count(), 1);
    // A line begins with the first edge; its vertical parts are the later edges, at the same
    // distances.
    let triceps = between(
        timing,
        "stroke=\"#0072B2\" stroke-width=\"1.6\" points=\"",
        "\"",
    );
    let points: Vec<(f64, f64)> = triceps
        .split(' ')
        .map(|point| {
            let (x, y) = point.split_once(',').unwrap();
            (x.parse().unwrap(), y.parse().unwrap())
        })
        .collect();
    let upright = points.windows(2).filter(|p| p[0].1 != p[1].1);
    let upright = upright.map(|pair| pair[0].0);
    let drawn: Vec<f64> = [points[0].0].into_iter().chain(upright).collect();
    let edges = trials[0]
        .trial
        .edges
        .iter()
        .filter(|edge| edge.channel == 1);
    let wanted: Vec<f64> = edges.map(|edge| edge.t_us as f64).collect();
    assert_eq!(drawn.len(), wanted.len());
    let part = |all: &[f64], n: usize| (all[n] - all[0]) / (all[all.len() - 1] - all[0]);
    for n in 0..drawn.len() {
        let (drawn, wanted) = (part(&drawn, n), part(&wanted, n));
        assert!((drawn - wanted).abs() < 0.002, "{drawn} {wanted}");
    }
    // Different edges need another drawing.
    let mut recorded: Vec<Trial> = trials
        .into_iter()
        .map(|measurement| measurement.trial)
        .collect();
    recorded[1].edges[0].t_us += 3;
    rebuild_page(&dir, &recorded).unwrap();
    let page = page_of(&dir);
    let timing = between(&page, "<h2>Timing of the pulses</h2>", "</section>");
    assert_eq!(timing.matches("<svg").count(), 2);
}

#[test]
fn what_was_not_played_is_not_told() {
    // A sweep has no trials: no limb, no timing, and a sentence that explains it.
    let dir = folder("swept_page");
    swept(Shard::WHOLE, 3, &dir);
    let page = page_of(&dir);
    assert!(!page.contains("<h2>Movement of the limb</h2>"));
    let timing = between(&page, "<h2>Timing of the pulses</h2>", "</section>");
    assert!(timing.contains("No trial was recorded here") && !timing.contains("<svg"));
    let before = fs::read(dir.join("result.html")).unwrap();
    rebuild_page(&dir, &[]).unwrap();
    assert_eq!(fs::read(dir.join("result.html")).unwrap(), before);
    // Trials belong to no point of a grid.
    let grid = "[[grid]]\nfield = \"body.inertia_kg_m2\"\nvalues = [0.05, 0.07]\nsource = \"x\"\n";
    let text = SMALL.replace(
        "[[claim]]\nid = \"more-charge\"",
        &format!("{grid}[[claim]]\nid = \"more-charge\""),
    );
    let experiment = Experiment::new("small.toml", &text, &texts).unwrap();
    let mut operator = LimitedOperator(9, Vec::new());
    let dir = folder("grid");
    let course = experiment
        .conduct(&dir, (&DeviceName::Native, 3), &mut operator)
        .unwrap();
    let outcome = Outcome::from_trials(&experiment, ("native", 3), &course.trials, Some(true));
    assert!(
        outcome
            .shares
            .iter()
            .all(|share| share.at.is_empty() && share.of == 1)
    );
    assert_eq!((outcome.shares.len(), outcome.rows.len()), (2, 4));
    assert_eq!((outcome.declared.draws, outcome.is_grid()), (0, false));
    assert!(
        outcome
            .notes
            .iter()
            .any(|note| note.contains("body.inertia_kg_m2"))
    );
}
